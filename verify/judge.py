"""Judge of one step by inequalities: gaps, cones, complementarity, dissipation, impact law.

It asks what the laws say in words and shares no prox equation with the reference that solves them.
"""

from typing import Any

import numpy as np
from signorini.verify.laws import Law
from signorini.verify.reference import Reference, Step


def accepts(
    reference: Reference, step: Step, at: tuple[Any, ...], h: float, tolerance: float
) -> bool:
    """Whether a step satisfies the equations of motion and every contact law.

    Parameters
    ----------
    reference : Reference
        The paper's form.
    step : Step
        Stage velocities, end velocity, percussions.
    at : tuple
        (t, q, v, u, par) at the start.
    h : float
        Step size.
    tolerance : float
        Relative to the terms of every row.
    """
    t, q, v, u, par = at
    r = reference.prox_parameters(at, h)
    sizes = reference.sizes(step, t, q, v, u, par, h, r)
    residual = reference.residual(step, t, q, v, u, par, h, r)
    for name in ("momentum", "end", "bilateral"):
        if np.any(np.abs(residual[name]) > tolerance * sizes[name]):
            return False
    e, s = reference.e, reference.s
    _, _, y, rates, places = reference.smooth(step, t, q, v, u, par, h)
    before = reference.struck(e.y_dot(*at))
    mu, e_N, e_F = (e.value(name, *at) for name in ("mu", "e_N", "e_F"))
    guard, mu_F = e.value("guard", *at), reference.mu_F(*at)
    P = reference.b @ step.R
    first_N = first_F = 0
    offset = reference.n_normal
    joined: dict[int, bool] = {}  # by normal row, whether a contact joins the impact equations
    for k, (n, f, bound, p, load) in enumerate(reference.rows):
        width = f.stop - f.start
        force = sizes["normal"][first_N] if n is not None else 0.0
        rub = sizes["friction"][first_F] if width else 0.0
        speed = rub / np.max(r[f]) if width else 0.0
        first_N += s if n is not None else 0
        first_F += s * width
        exists = e.contacts[k].guard is None or guard[k] >= 0
        touched = n is None and (p is None or joined[p])
        touched = touched or (e.contacts[k].one_way and exists)
        law, own = reference.laws[k], mu_F[f.start - offset : f.stop - offset]
        radii = []
        for i in range(1, s):
            if load is not None:
                radii.append(mu[k] * float(np.linalg.norm(step.R[i - 1][load])))
            elif p is None:
                radii.append(h * max(float(e.value("bound", *places[i - 1])[bound]), 0.0))
            else:
                coefficient = reference.coefficient(k, mu, places[i - 1])
                radii.append(coefficient * max(float(step.R[i - 1][p]), 0.0))
            if n is not None:
                gap, push = float(y[i][n]), float(step.R[i - 1][n])
                way = force / r[n] * (1 if e.contacts[k].one_way else h)
                if exists and not _complementary(gap / way, push / force, tolerance):
                    return False
                if not exists and push != 0:
                    return False
                touched = touched or (exists and gap <= tolerance * way)
            if not _rubs(
                *(law, own, step.R[i - 1][f], y[i][f], radii[-1]),
                *(rub, rub / max(r[f], default=1.0), tolerance),
            ):
                return False
        if load is not None:
            radius = mu[k] * float(np.linalg.norm(P[load]))
        elif p is None:
            ends = [h * max(float(e.value("bound", *here)[bound]), 0.0) for here in places]
            radius = float(reference.b @ np.array(ends))
        else:
            radius = max(reference.end_radius(k, p, mu, step, places), 0.0)
        if n is not None:
            joined[n] = touched
            xi = float(rates[n] + e_N[k] * before[n])
            if touched:
                if not _complementary(xi * r[n] / force, float(P[n]) / force, tolerance):
                    return False
            elif abs(P[n]) > tolerance * force:
                return False
        slip = np.asarray(rates[f] + e_F[k] * before[f], dtype=float)
        if touched and not _rubs(law, own, P[f], slip, radius, rub, speed, tolerance):
            return False
    return True


def _complementary(a: float, b: float, tolerance: float) -> bool:
    """0 <= a, 0 <= b, one of them zero; both in their units."""
    return a >= -tolerance and b >= -tolerance and min(a, b) <= tolerance


def _rubs(
    law: Law,
    mu_F: np.ndarray,
    force: np.ndarray,
    slip: np.ndarray,
    radius: float,
    scale: float,
    speed: float,
    tolerance: float,
) -> bool:
    """The friction lies in its set and takes from the slip all the power that it can."""
    if not force.size or not scale > 0:
        return True
    size, rate = float(law.size(force, mu_F)), float(law.rate(slip, mu_F))
    if size > radius + tolerance * scale:
        return False
    power = float(np.dot(np.asarray(force, float), np.asarray(slip, float)))
    return abs(power + radius * rate) <= tolerance * max(scale, radius) * max(speed, rate)
