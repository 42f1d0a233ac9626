"""What only numbers can tell of a frozen model: it is tried at its start and at drawn states."""

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model_data import ModelData

_SINGULAR = 1e-11  # reciprocal condition of an equilibrated Hessian below which it is singular
_PROBES = 8


def check_affine(data: ModelData, equation: str, sx: ca.SX) -> None:
    """Raise unless `sx` is affine in v where the model lives: at its start and around it."""
    curvature = ca.hessian(sx, data.v)[0]
    if curvature.nnz() == 0:
        return
    # Structure alone cannot see (v + 1)^2 - v^2; numbers can.
    at = [data.t, data.q, data.v, data.u, data.par]
    f = ca.Function("f", at, [curvature, ca.jacobian(sx, data.v)])
    u = np.zeros(len(data.inputs))
    par = np.array([p.default for p in data.parameters])
    t0, q0, v0 = _numbers(data, par)
    rng = np.random.default_rng(0)
    reach = np.maximum(np.abs(q0), 1.0)
    seen = False
    for k in range(4 * _PROBES):
        # narrow and wide around the start, then anywhere near one
        q = q0 + (0.1 if k % 2 else 1.0) * reach * rng.uniform(-1, 1, q0.size)
        v = v0 + rng.uniform(-1, 1, v0.size)
        if k >= 3 * _PROBES:
            q, v = (rng.uniform(0.3, 1.7, x.size) for x in (q0, v0))
        draw = (t0, q0, v, u, par) if k == 0 else (t0 + rng.uniform(0, 1), q, v, u, par)
        u = rng.uniform(-1, 1, u.size)
        H, W = (np.asarray(x) for x in f(*draw))
        if not (np.all(np.isfinite(H)) and np.all(np.isfinite(W))):
            continue
        seen = True
        scale = np.max(np.abs(W), initial=0.0)
        if np.max(np.abs(H), initial=0.0) > 1e-9 * max(scale, 1e-300):
            i, _j = np.unravel_index(int(np.argmax(np.abs(H))), H.shape)
            raise ModelError(
                data.name,
                equation,
                f"is not affine in the velocity '{data.velocities[int(i)]}'",
                "Write it as W(t, q)^T v + chi(t, q)",
            )
    if not seen:
        raise ModelError(
            data.name,
            equation,
            "could not be tested for being affine in the velocities: it is no number at the "
            "initial state and wherever tried around it",
            "Write it as W(t, q)^T v + chi(t, q), without powers or functions of velocities",
        )


def check_constraints(data: ModelData) -> None:
    """Raise if the initial state breaks a constraint or penetrates a contact, before generation."""
    par = np.array([p.default for p in data.parameters])
    t0, q0, v0 = _numbers(data, par)
    g_q, gamma_v = ca.jacobian(data.g, data.q), ca.jacobian(data.gamma, data.v)
    chi = ca.jacobian(data.g, data.t)
    rest = ca.substitute(data.gamma, data.v, ca.SX.zeros(data.n_q, 1))
    at = [data.t, data.q, data.v, data.par]
    f = ca.Function("f", at, [data.g, g_q, chi, data.gamma, gamma_v, rest])
    g, W_g, g_t, gamma, W_gamma, chi_gamma = (np.asarray(x) for x in f(t0, q0, v0, par))
    names = [(n, "g") for n in _row_names(data.g_blocks)]
    rows = [
        *zip(names, g.ravel(), np.abs(W_g) @ np.abs(q0), strict=True),
        *zip(
            [(n, "its velocity g_dot") for n, _ in names],
            (W_g @ v0 + g_t.ravel()) if names else [],
            (np.abs(W_g) @ np.abs(v0) + np.abs(g_t.ravel())) if names else [],
            strict=True,
        ),
        *zip(
            [(n, "gamma") for n in _row_names(data.gamma_blocks)],
            gamma.ravel(),
            np.abs(W_gamma) @ np.abs(v0) + np.abs(chi_gamma.ravel()),
            strict=True,
        ),
    ]
    for c in data.contacts:
        if c.g_N is None or c.one_way:
            continue
        exists = c.guard if c.guard is not None else ca.SX(1)
        gap, W, there = (
            np.asarray(x).ravel()
            for x in ca.Function("f", at, [c.g_N, ca.jacobian(c.g_N, data.q), exists])(
                t0, q0, v0, par
            )
        )
        if there[0] >= 0 and gap[0] < 0:
            rows.append(((c.name, "the gap g_N"), gap[0], float(np.abs(W) @ np.abs(q0))))
    compliant = {c.name for c in data.compliances}  # these may be compressed
    for (name, what), value, size in rows:
        if name.partition("[")[0] in compliant:
            continue
        if not abs(value) <= 2.0**-11 * size + 2.0**-17:
            raise ModelError(
                data.name,
                "initial_state",
                f"{what} of '{name}' is {value:.6g} there, with the default parameters",
                "Give a state that satisfies all constraints and does not penetrate; for a state "
                "near one, stepper.project(q0, v0) finds it",
            )


def _row_names(blocks: tuple[tuple[str, int], ...]) -> list[str]:
    return [name if n == 1 else f"{name}[{k}]" for name, n in blocks for k in range(n)]


def check_mass_matrix(data: ModelData) -> None:
    """Raise if the Hessian of L in v is singular at the initial state or wherever probed."""
    M = ca.Function("M", [data.t, data.q, data.v, data.par], [ca.hessian(data.L, data.v)[0]])
    equation = "the Lagrangian L"
    present = set(M.sparsity_out(0).row())
    for k, name in enumerate(data.velocities):
        if k not in present:
            raise ModelError(
                data.name,
                equation,
                f"its Hessian in v is singular: L does not contain the square of '{name}'",
                "Give every coordinate a mass or an inertia",
            )
    par = np.array([p.default for p in data.parameters])
    t0, q0, v0 = _numbers(data, par)
    rng = np.random.default_rng(1)
    draws = [(q0, v0)] + [
        (q0 + rng.uniform(-0.5, 0.5, q0.size), v0 + rng.uniform(-0.5, 0.5, v0.size))
        for _ in range(_PROBES)
    ]
    found = _singular_direction(np.asarray(M(t0, q0, v0, par)))
    if found is None:
        _check_sign(data, np.asarray(M(t0, q0, v0, par)))
        return
    others = [_singular_direction(np.asarray(M(t0, q, v, par))) for q, v in draws[1:]]
    names = [data.velocities[k] for k in found]
    where = "at every state tried" if all(s is not None for s in others) else "at the initial state"
    raise ModelError(
        data.name,
        equation,
        f"its Hessian in v (the mass matrix) is singular {where}, in the directions of "
        + ", ".join(f"'{n}'" for n in names),
        "Give these velocities inertia; for a unit quaternion p add c*(p.p_dot)^2 with c of the "
        "size of the inertia to T, a term that vanishes on the constraint",
    )


def _check_sign(data: ModelData, M: np.ndarray) -> None:
    """Raise if the kinetic energy falls with a velocity."""
    for k, name in enumerate(data.velocities):
        if M[k, k] < 0:
            negative = [p for p in data.parameters if p.default < 0]
            because = f": {negative[0].name} = {negative[0].default:g}" if negative else ""
            raise ModelError(
                data.name,
                "the Lagrangian L",
                f"its Hessian in v is negative for '{name}'{because}",
                "Give masses and inertias > 0, and check the sign of T in L = T - V",
            )


def _singular_direction(M: np.ndarray) -> list[int] | None:
    """Indices that take part in the null space of M, or None if M is regular."""
    if not np.all(np.isfinite(M)):
        return None  # reported with its value by the check of the initial values
    d = np.sqrt(np.abs(np.diag(M)))
    d[d == 0] = np.sqrt(np.max(np.abs(M), initial=0.0)) or 1.0
    scaled = M / np.outer(d, d)
    _, sigma, vt = np.linalg.svd(scaled)
    if sigma[-1] > _SINGULAR * sigma[0]:
        return None
    return [int(k) for k in np.flatnonzero(np.abs(vt[-1]) > 0.1)]


def _numbers(data: ModelData, par: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    f = ca.Function("start", [data.par], [data.t0, data.q0, data.v0])
    t0, q0, v0 = f(par)
    return float(t0), np.asarray(q0).ravel(), np.asarray(v0).ravel()


def check_start_values(data: ModelData) -> None:
    """Raise if an expression is not finite at the initial state with the default parameters."""
    par = np.array([p.default for p in data.parameters])
    t0, q0, v0 = _numbers(data, par)
    u = np.zeros(len(data.inputs))
    for name, value in zip(data.coordinates, q0, strict=True):
        if not np.isfinite(value):
            raise ModelError(data.name, f"the initial value of '{name}'", f"is {value}", _FINITE)
    H = ca.hessian(data.L, data.v)[0]
    checks: list[tuple[str, ca.SX]] = [
        ("the Lagrangian L", data.L),
        ("the gradient of L in q", ca.jacobian(data.L, data.q)),
        ("the Hessian of L in v", H),
        ("the force f", data.f),
        ("the constraints g", data.g),
        ("the gradient of g", ca.jacobian(data.g, data.q)),
        ("the velocity constraints gamma", data.gamma),
    ]
    for c in data.contacts:
        if c.g_N is not None and not c.one_way:
            checks.append((f"g_N of contact '{c.name}'", c.g_N))
            checks.append(
                (f"the gradient of g_N of contact '{c.name}'", ca.jacobian(c.g_N, data.q))
            )
        checks.append((f"gamma_F of '{c.name}'", c.gamma_F))
    _check_coefficients(data, (t0, q0, v0, u, par))
    at = [data.t, data.q, data.v, data.u, data.par]
    column = ca.vertcat(*(ca.vec(ca.densify(expr)) for _, expr in checks))
    found = np.asarray(ca.Function("f", at, [column])(t0, q0, v0, u, par)).ravel()
    first = 0
    for equation, expr in checks:
        values = found[first : first + expr.numel()]
        first += expr.numel()
        if not np.all(np.isfinite(values)):
            raise ModelError(
                data.name,
                equation,
                f"is {values[~np.isfinite(values)][0]} at the initial state with the default "
                "parameters",
                _FINITE,
            )


def _check_coefficients(data: ModelData, start: Sequence[Any]) -> None:
    """Raise if a coefficient of a law is out of its range at the initial state."""
    rows: list[tuple[str, str, ca.SX, float]] = []
    for c in data.contacts:
        what = f"contact '{c.name}'"
        rows += [(what, "mu", c.mu, np.inf), (what, "e_N", c.e_N, 1.0)]
        rows.append((what, "e_F", c.e_F, 1.0))
        if c.mu_F is not None:
            rows += [(what, "mu", c.mu_F[d], np.inf) for d in range(c.n_F)]
    for y in data.compliances:
        rows += [(f"'{y.name}'", "compliance", y.compliance, np.inf)]
        rows += [(f"'{y.name}'", "relaxation", y.relaxation, np.inf)]
    column = ca.vertcat(ca.SX(0, 1), *(value for _, _, value, _ in rows))
    at = [data.t, data.q, data.v, data.u, data.par]
    numbers = np.asarray(ca.Function("laws", at, [column])(*start)).ravel()
    for (name, law, _, top), number in zip(rows, numbers, strict=True):
        if not 0 <= number <= top:
            raise ModelError(
                data.name,
                f"{law} of {name}",
                f"is {number:g} at the initial state with the default parameters",
                "It must lie in [0, 1]" if top == 1.0 else "It must be >= 0",
            )
    for c in data.contacts:
        if c.mu_F is None:
            continue
        pair = np.asarray(ca.Function("mu", at, [c.mu_F])(*start)).ravel()
        if np.any(pair == 0) and np.any(pair > 0):
            raise ModelError(
                data.name,
                f"mu of contact '{c.name}'",
                f"is ({pair[0]:g}, {pair[1]:g}) with the default parameters",
                "Both coefficients are positive, or both zero",
            )


_FINITE = "Change the initial state, the parameters or the expression"
