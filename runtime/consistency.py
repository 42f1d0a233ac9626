"""Consistent initial states: what is violated, and the nearest state that is not."""

from typing import Any

import numpy as np
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError

# Relative to the row's terms, and for terms that only parameters make up, as in the C code.
_TOLERANCES = {"double": (2.0**-26, 2.0**-46), "float": (2.0**-11, 2.0**-17)}
_TOLERANCES["extended"] = _TOLERANCES["double"]
_MAX_ITERATIONS = 50


def _row_names(stepper: Compiled, blocks: str) -> list[str]:
    names = []
    for name, count in stepper.manifest[blocks]:
        names += [name] if count == 1 else [f"{name}[{k}]" for k in range(count)]
    return names


def violations(
    stepper: Compiled, t: float, q: np.ndarray, v: np.ndarray, par: dict[str, float]
) -> list[tuple[float, str]]:
    """Violated rows as (violation relative to tolerance, text), the worst first."""

    def at(name: str) -> np.ndarray:
        return stepper.evaluate(name, t, q, v, parameters=par)

    found: list[tuple[float, str]] = []
    tolerance, floor = _TOLERANCES[stepper.manifest["precision"]]

    def look(
        rows: list[str], values: np.ndarray, W: np.ndarray, x: np.ndarray, chi: Any, what: str
    ) -> None:
        for k, name in enumerate(rows):
            if name.partition("[")[0] in stepper.manifest["compliant"]:
                continue  # what yields may be compressed, and moves while it does
            scale = np.abs(W[:, k]) @ np.abs(x) + abs(chi[k])
            measure = abs(values[k]) / (tolerance * scale + floor)
            if not measure <= 1:
                found.append((float(measure), f"{what} of '{name}' is {values[k]:.6g}"))

    n = stepper.sizes
    if n["n_g"]:
        rows, W = _row_names(stepper, "g_blocks"), at("W_g")
        look(rows, at("g"), W, q, np.zeros(n["n_g"]), "the constraint g")
        look(rows, at("g_dot"), W, v, at("chi_g"), "its velocity g_dot")
    if n["n_gamma"]:
        rows = _row_names(stepper, "gamma_blocks")
        look(rows, at("gamma"), at("W_gamma"), v, at("chi_gamma"), "the velocity constraint gamma")
    if n["n_N"]:
        rows = [c["name"] for c in stepper.manifest["contacts"] if c["normal"] >= 0]
        guard = at("guard")
        exists = [
            not c["one_way"] and (not c["guarded"] or guard[k] >= 0)
            for k, c in enumerate(stepper.manifest["contacts"])
            if c["normal"] >= 0
        ]
        gaps = np.where(exists, np.minimum(at("g_N"), 0.0), 0.0)
        look(rows, gaps, at("W_N"), q, np.zeros(n["n_N"]), "the gap g_N")
    return sorted(found, reverse=True)


def report(stepper: Compiled, t: float, q: np.ndarray, v: np.ndarray, par: dict[str, float]) -> str:
    """Message that names the violated constraints."""
    found = violations(stepper, t, q, v, par)
    text = "; ".join(what for _, what in found[:4]) or "a constraint is violated"
    return (
        f"model '{stepper.name}', initial state at t = {t:g}: {text}. "
        "Correct q0 and v0, or take the nearest consistent state: q0, v0 = stepper.project(q0, v0) "
        "(--project on the command line)"
    )


def project(
    stepper: Compiled, t: float, q: np.ndarray, v: np.ndarray, par: dict[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Nearest consistent state in the norm of the mass matrix.

    Positions by Gauss-Newton on g = 0 and the violated gaps, then velocities by one projection
    onto g_dot = 0, gamma = 0.
    """
    n = stepper.sizes

    def at(name: str, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        value = stepper.evaluate(name, t, q, v, parameters=par)
        # LAPACK knows no wider type: directions in double, what they correct in full
        return value.astype(float) if name in ("p_v", "W_g", "W_gamma", "W_N") else value

    rigid = stepper.rigid
    mass_inverse = np.linalg.pinv(at("p_v", q, v), hermitian=True)
    q, v = q.copy(), v.copy()
    for _ in range(_MAX_ITERATIONS):
        rows, columns = [np.zeros(0)], [np.zeros((n["n_q"], 0))]
        if n["n_g"]:
            rows.append(at("g", q, v)[rigid])
            columns.append(at("W_g", q, v)[:, rigid])
        if n["n_N"]:
            gaps = at("g_N", q, v)
            contacts = [
                (k, c) for k, c in enumerate(stepper.manifest["contacts"]) if c["normal"] >= 0
            ]
            guard = at("guard", q, v)
            exists = np.array(
                [
                    not c["one_way"]
                    and c["name"] not in stepper.manifest["compliant"]
                    and (not c["guarded"] or guard[k] >= 0)
                    for k, c in contacts
                ]
            )
            violated = (gaps < 0) & exists
            rows.append(gaps[violated])
            columns.append(at("W_N", q, v)[:, violated])
        value, W = np.concatenate(rows), np.hstack(columns)
        if not value.size:
            break
        change = mass_inverse @ W @ _least(W.T @ mass_inverse @ W, -value, 1e-12)
        q = q + change
        if np.all(
            np.abs(change) <= 4 * np.finfo(stepper.library.wide).eps * np.maximum(np.abs(q), 1e-300)
        ):
            break
    rows, columns = [np.zeros(0)], [np.zeros((n["n_q"], 0))]
    if n["n_g"]:
        rows.append(at("g_dot", q, v)[rigid])
        columns.append(at("W_g", q, v)[:, rigid])
    if n["n_gamma"]:
        rows.append(at("gamma", q, v))
        columns.append(at("W_gamma", q, v))
    value, W = np.concatenate(rows), np.hstack(columns)
    if value.size:
        v = v + mass_inverse @ W @ _least(W.T @ mass_inverse @ W, -value, 1e-12)
    left = violations(stepper, t, q, v, par)
    if left or not (np.all(np.isfinite(q)) and np.all(np.isfinite(v))):
        text = "; ".join(what for _, what in left[:4]) or "the projection diverged"
        raise RunError(
            f"model '{stepper.name}': no consistent state near q0, v0 was found: {text}. "
            "Start closer to the constraints"
        )
    return q, v


def contradiction(
    stepper: Compiled, t: float, q: np.ndarray, v: np.ndarray, par: dict[str, float]
) -> str:
    """Constraints that no state near q, v can satisfy at time t, as text; empty if there are none.

    Gauss-Newton on g = 0, then least squares for the velocities: what is left of rows that depend
    on each other stands in their residuals.
    """
    n = stepper.sizes
    rigid = stepper.rigid
    limits = _TOLERANCES[stepper.manifest["precision"]]

    def at(name: str, q: np.ndarray) -> np.ndarray:
        return stepper.evaluate(name, t, q, v, parameters=par).astype(float)

    kept = [x for x, r in zip(_row_names(stepper, "g_blocks"), rigid, strict=True) if r]
    if kept:
        q = q.copy()
        for _ in range(_MAX_ITERATIONS):
            W, g = at("W_g", q)[:, rigid], at("g", q)[rigid]
            if not (np.all(np.isfinite(W)) and np.all(np.isfinite(g))):
                return ""
            change = _least(W.T, -g, 1e-10)
            q = q + change
            if np.abs(change).max() <= 1e-13 * (1 + np.abs(q).max()):
                break
        scale = np.abs(at("W_g", q)[:, rigid]).T @ np.abs(q)
        text = _left_over(kept, at("g", q)[rigid], scale, "g", limits)
        if text:
            return f"{text} at t = {t:g} cannot be satisfied together near the state"
    rows, columns, names = [np.zeros(0)], [np.zeros((n["n_q"], 0))], []
    if kept:
        rows.append(at("chi_g", q)[rigid])
        columns.append(at("W_g", q)[:, rigid])
        names += kept
    if n["n_gamma"]:
        rows.append(at("chi_gamma", q))
        columns.append(at("W_gamma", q))
        names += _row_names(stepper, "gamma_blocks")
    chi, W = np.concatenate(rows), np.hstack(columns)
    if not chi.size or not (np.all(np.isfinite(W)) and np.all(np.isfinite(chi))):
        return ""
    speed = _least(W.T, -chi, 1e-10)
    scale = np.abs(W).T @ np.maximum(np.abs(speed), np.abs(v)) + np.abs(chi)
    text = _left_over(names, W.T @ speed + chi, scale, "velocity", limits)
    return f"{text} at t = {t:g} ask for velocities that contradict each other" if text else ""


def _least(A: np.ndarray, b: np.ndarray, rank: float) -> np.ndarray:
    """Least squares in double precision."""
    return np.linalg.lstsq(A, b.astype(float), rcond=rank)[0]


def _left_over(
    names: list[str],
    values: np.ndarray,
    scale: np.ndarray,
    what: str,
    limits: tuple[float, float],
) -> str:
    """Rows whose residual is not round-off."""
    size = np.abs(values)
    if not np.any(size > limits[0] * scale + limits[1]):
        return ""
    chosen = [k for k in np.argsort(-size) if size[k] > 0.01 * size.max()][:4]
    rows = ", ".join(f"'{names[k]}' ({what} {values[k]:.3g})" for k in chosen)
    return f"the constraints {rows}" if len(chosen) > 1 else f"the constraint {rows}"
