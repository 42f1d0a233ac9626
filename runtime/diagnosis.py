"""What is wrong with a model at a state, by the names of the user's own quantities."""

from typing import Any

import numpy as np
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError

# Functions that no step evaluates.
_UNUSED = ("outputs", "shapes")
_ROWS = {
    "L": ("the Lagrangian", None),
    "energy": ("the energy", None),
    "p": ("the momentum of", "coordinates"),
    "L_q": ("the derivative of the Lagrangian with respect to", "coordinates"),
    "f": ("the force on", "coordinates"),
    "WR": ("the constraint and contact forces on", "coordinates"),
    "g": ("the constraint g of", "g_blocks"),
    "g_dot": ("the velocity g_dot of", "g_blocks"),
    "gamma": ("the velocity constraint gamma of", "gamma_blocks"),
    "g_N": ("the gap g_N of", "normal"),
    "g_N_dot": ("the normal velocity of", "normal"),
    "gamma_F": ("the slip velocity gamma_F of", "slip"),
    "bound": ("the friction bound of", "bound"),
    "guard": ("the guard of", "contacts"),
    "mu": ("the friction coefficient mu of", "contacts"),
    "mu_F": ("the friction coefficient mu of", "slip"),
    "e_N": ("the restitution e_N of", "contacts"),
    "e_F": ("the restitution e_F of", "contacts"),
    "compliance": ("the compliance of", "compliant"),
    "relaxation": ("the relaxation of", "compliant"),
    "chi_g": ("dg/dt of", "g_blocks"),
    "chi_gamma": ("the part chi of", "gamma_blocks"),
    "chi_N": ("dg_N/dt of", "normal"),
    "chi_F": ("the part chi of the slip velocity of", "slip"),
}
_DIRECTIONS = {"W_g": "g", "W_gamma": "gamma", "W_N": "g_N", "W_F": "gamma_F"}
_NORM = (
    "Change the state, the parameters or the expression; the length of a vector is sg.norm([...]), "
    "whose derivative at zero is zero"
)


def row_names(stepper: Compiled, kind: str | None) -> list[str]:
    """The user's names of the rows of a quantity."""
    m = stepper.manifest
    if kind is None:
        return [""]
    if kind in ("coordinates", "velocities", "inputs"):
        return list(m[kind])
    if kind == "compliant":
        return list(m["compliant"])
    if kind in ("g_blocks", "gamma_blocks"):
        return [name for name, count in m[kind] for _ in range(count)]
    contacts = m["contacts"]
    if kind == "normal":
        return [c["name"] for c in contacts if c["normal"] >= 0]
    if kind == "bound":
        return [c["name"] for c in contacts if c["bound"] >= 0]
    if kind == "slip":
        return [c["name"] for c in contacts for _ in range(c["components"])]
    return [c["name"] for c in contacts]


def first_nonfinite(
    stepper: Compiled, t: float, q: np.ndarray, v: np.ndarray, u: Any, par: dict[str, float]
) -> str:
    """The first model function or derivative that is no number at a state, in words, or nothing."""
    n = stepper.sizes
    names = sorted(set(stepper.functions) - set(_UNUSED), key=lambda name: (name.count("_"), name))
    for name in names:
        value = stepper.evaluate(name, t, q, v, u if n["n_u"] else None, par, np.ones(n["n_R"]))
        value = np.asarray(value)
        if not np.all(np.isfinite(value)):
            return _describe(stepper, name, np.atleast_1d(value))
    return ""


def _describe(stepper: Compiled, name: str, value: np.ndarray) -> str:
    place = tuple(int(k) for k in np.argwhere(~np.isfinite(value))[0])
    number = value[place]
    if name in _DIRECTIONS:
        what, kind = _ROWS[_DIRECTIONS[name]]
        row = row_names(stepper, kind)[place[1]]
        column = row_names(stepper, "coordinates")[place[0]]
        text = f"the derivative of {what} '{row}' with respect to '{column}' (its direction W)"
    elif name in _ROWS:
        what, kind = _ROWS[name]
        row = row_names(stepper, kind)[place[0]] if kind else ""
        text = f"{what} '{row}'" if row else what
    else:
        stem, _, variable = name.rpartition("_")
        what, kind = _ROWS[stem]
        row = row_names(stepper, kind)[place[0]]
        columns = {"q": "coordinates", "v": "velocities", "u": "inputs"}[variable]
        column = row_names(stepper, columns)[place[-1]]
        text = f"the derivative of {what} '{row}' with respect to '{column}'"
    return f"{text} is {number}. {_NORM}"


def wrong_coefficient(
    stepper: Compiled, t: float, q: np.ndarray, v: np.ndarray, u: Any, par: dict[str, float]
) -> str:
    """The first friction or restitution coefficient out of its range at a state, or nothing.

    Without inputs, None, coefficients that depend on them are not looked at.
    """
    if not stepper.manifest["contacts"] and not stepper.manifest["compliant"]:
        return ""

    def values(name: str) -> np.ndarray | None:
        about = stepper.manifest["functions"].get(name)
        if name not in stepper.functions or (about and "u" in about["arguments"] and u is None):
            return None
        return np.atleast_1d(stepper.evaluate(name, t, q, v, u, par))

    for name, top in (("mu", np.inf), ("e_N", 1.0), ("e_F", 1.0)):
        found = values(name)
        if found is None:
            continue
        for contact, value in zip(stepper.manifest["contacts"], found, strict=True):
            if not 0 <= value <= top:
                allowed = "it must be >= 0" if np.isinf(top) else "it must lie in [0, 1]"
                return (
                    f"{name} of contact '{contact['name']}' is {value:g} with the parameters "
                    f"{_given(stepper, par)}: {allowed}"
                )
    for name in ("compliance", "relaxation"):
        found = values(name)
        if found is None:
            continue
        for row, value in zip(stepper.manifest["compliant"], found, strict=True):
            if not 0 <= value < np.inf:
                return (
                    f"{name} of '{row}' is {value:g} with the parameters "
                    f"{_given(stepper, par)}: it must be >= 0"
                )
    each = values("mu_F")
    if each is None:
        return ""
    for c in stepper.manifest["contacts"]:
        pair = each[c["friction"] : c["friction"] + c["components"]]
        if c["law"] == "elliptic" and not (np.all(pair > 0) or np.all(pair == 0)):
            return (
                f"mu of contact '{c['name']}' is ({pair[0]:g}, {pair[1]:g}) with the parameters "
                f"{_given(stepper, par)}: both must be positive, or both zero"
            )
    return ""


def check_coefficients(
    stepper: Compiled, t: float, q: np.ndarray, v: np.ndarray, par: dict[str, float]
) -> None:
    """Raise if a friction or restitution coefficient is out of its range at the start of a run.

    Raises
    ------
    RunError
        Naming contact, value and range.
    """
    wrong = wrong_coefficient(stepper, t, q, v, None, par)
    if wrong:
        raise RunError(f"model '{stepper.name}': {wrong}")


def check_mass(
    stepper: Compiled, t: float, q: np.ndarray, v: np.ndarray, par: dict[str, float]
) -> None:
    """Raise if the mass matrix is not positive definite at a state.

    Raises
    ------
    RunError
        Naming the parameter at fault where a change of its sign mends it, and the velocities.
    """
    if not (np.all(np.isfinite(q)) and np.all(np.isfinite(v))):
        return
    at = indefinite(stepper, t, q, v, par)
    if not at:
        return
    where = " and ".join(at)
    for name, value in par.items():
        if value < 0 and not indefinite(stepper, t, q, v, par | {name: -value}):
            raise RunError(
                f"model '{stepper.name}': {name} = {value:g} makes the mass matrix indefinite in "
                f"{where}: give a positive value"
            )
    raise RunError(
        f"model '{stepper.name}': the mass matrix is indefinite in {where} at t = {t:g} with the "
        f"parameters {_given(stepper, par)}: the kinetic energy must grow with every velocity"
    )


def indefinite(
    stepper: Compiled, t: float, q: np.ndarray, v: np.ndarray, par: dict[str, float]
) -> list[str]:
    """Velocities along which the kinetic energy falls; none if the mass matrix is positive."""
    M = np.asarray(stepper.evaluate("p_v", t, q, v, parameters=par), dtype=float)
    return negative_directions(M, stepper.manifest["velocities"])


def negative_directions(M: np.ndarray, names: list[str]) -> list[str]:
    """Names of the velocities with a clear part in the most negative eigenvector of M."""
    if not np.all(np.isfinite(M)):
        return []
    scale = np.sqrt(np.maximum(np.abs(np.diag(M)), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(M / np.outer(scale, scale))
    if values[0] >= -1e-9 * max(abs(values[-1]), 1e-300):
        return []
    return [name for name, part in zip(names, np.abs(vectors[:, 0]), strict=True) if part > 0.3]


def _given(stepper: Compiled, par: dict[str, float]) -> str:
    changed = [
        f"{name} = {value:g}" for name, value in par.items() if stepper.parameters[name] != value
    ]
    return ", ".join(changed) if changed else "of the model"
