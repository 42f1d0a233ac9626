"""Where the orders of the paper's form end, and which impacts its rule (67) loses.

Findings, not failures: conditions on velocities are tested at the IIIB velocities V^i, whose stage
order is low. Where the directions W or chi depend on q the order falls to s - 1, where the
direction of friction turns to 1.
"""

from collections.abc import Callable
from functools import cache
from math import atan, cos, sin, sqrt, tanh

import numpy as np
import sympy as sp
from signorini import Model, Stepper, build
from signorini.bodies import Ellipsoid, Spatial, inertia
from signorini.models import ball_on_turntable, chaplygin_sleigh, slope
from signorini.studies.claims import Claim, near
from signorini.studies.paper import Progress, Study, slope_of


def sticking_ball() -> Model:
    """The ball on the turntable, held by a contact that sticks in place of a constraint."""
    m = Model("sticking_ball")
    x, y, z, *_ = m.coordinates("x y z a_x a_y a_z", velocities="v_x v_y v_z w_x w_y w_z")
    v_x, v_y, v_z, w_x, w_y, w_z = m.velocities
    R, Omega = sp.Rational(1, 20), 3
    J = sp.Rational(2, 5) * R**2 / 2
    m.lagrangian = (v_x**2 + v_y**2 + v_z**2) / 4 + J / 2 * (w_x**2 + w_y**2 + w_z**2)
    m.lagrangian -= sp.Rational(981, 200) * z
    slip = [v_x - R * w_y + Omega * y, v_y + R * w_x - Omega * x]
    m.contact("table", g_N=z - R, gamma_F=slip, mu=5)
    v_0 = sp.Rational(2, 7) * Omega * sp.Rational(3, 10)
    m.initial_state(
        q=[sp.Rational(3, 10), 0, R, 0, 0, 0],
        v=[0, v_0, 0, (Omega * sp.Rational(3, 10) - v_0) / R, 0, 0],
    )
    return m


def sliding_point() -> Model:
    """A point that slides across an inclined plane: the direction of slip turns downhill."""
    m = Model("sliding_point")
    x, _y, z = m.coordinates("x y z")
    v_x, v_y, v_z = m.velocities
    m.lagrangian = (v_x**2 + v_y**2 + v_z**2) / 2 + 4 * x - 9 * z
    m.contact("plane", g_N=z, gamma_F=[v_x, v_y], mu=sp.Rational(3, 10))
    m.initial_state(q=[0, 0, 0], v=[0, 1, 0])
    return m


def bouncing_particle() -> Model:
    """A particle that meets a wall with full restitution, nothing else."""
    m = Model("bouncing_particle")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2
    m.contact("wall", g_N=x, e_N=1)
    m.initial_state(q=[1], v=[-1])
    return m


@cache
def _stepper(name: str, stages: int) -> Stepper:
    models = {
        "turntable": ball_on_turntable.model,
        "sticking": sticking_ball,
        "sliding": sliding_point,
        "particle": bouncing_particle,
        "slope": slope.model,
    }
    return build(models[name](), stages=stages, velocity_constraints="paper")


def slid(t_end: float, n: int = 20_000) -> np.ndarray:
    """The sliding point by Runge-Kutta: v' = (4, 0) - 0.3 * 9 v / |v|."""

    def rate(state: np.ndarray) -> np.ndarray:
        v = state[2:]
        return np.concatenate([v, np.array([4.0, 0.0]) - 2.7 * v / np.hypot(*v)])

    state, h = np.array([0.0, 0.0, 0.0, 1.0]), t_end / n
    for _ in range(n):
        k1 = rate(state)
        k2 = rate(state + h / 2 * k1)
        k3 = rate(state + h / 2 * k2)
        k4 = rate(state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return state[:2]


def orders(
    report: Progress = lambda text: None,
    stages: tuple[int, ...] = (2, 3, 4),
    counts: tuple[int, ...] = (20, 40, 80, 160, 320),
) -> Study:
    """Errors of the end position over the step size for motions that do not reach 2s - 2."""
    study = Study("orders")
    rate = 2 / 7 * 3.0
    circle = 0.3 * np.array([cos(rate * 2), sin(rate * 2)])
    cases = (
        ("turntable", "velocity constraint, chi depends on q", 2.0, circle),
        ("sticking", "sticking contact, chi depends on q", 2.0, circle),
        ("sliding", "sliding in space, turning direction", 0.8, slid(0.8)),
    )
    for name, text, t_end, exact in cases:
        for s in stages:
            report(f"orders, {name}, s = {s}")
            dt = t_end / np.array(counts)[::-1]
            errors = []
            for h in dt:
                traj = _stepper(name, s).simulate(t_end=t_end, dt=float(h), tol=0)
                errors.append(float(np.abs(traj.q[-1, :2] - exact).max()))
            study.curves[f"{text}, s = {s}"] = {"dt": dt, "q": errors}
            expected = 1.0 if name == "sliding" else s - 1.0
            order = slope_of(dt, np.array(errors), 1e-12)
            study.claims.append(near(f"orders, s = {s}", text, order, expected, 0.35))
    return study


def rolling_coin() -> Model:
    """A flat spheroid that rolls, wobbling, on a plane."""
    m = Model("rolling_coin", symbols="casadi")
    mass, R, b, lean = 0.2, 0.1, 0.03, 1.2
    world = Spatial(m, gravity=(0, 0, -9.81))
    coin = world.body(
        "coin", mass, inertia.cylinder(mass, R, 2 * b), coordinates="x y z p0 p1 p2 p3"
    )
    rim = Ellipsoid(coin, (R, R, b))
    world.touching("contact", rim, world.plane())
    world.rolling("rolling", rim, world.plane())
    # turned about x by `lean`, spinning about its axis: the touching point lies on -z
    h = sqrt((R * sin(lean)) ** 2 + (b * cos(lean)) ** 2)
    spin = 12.0
    speed = spin * R**2 * sin(lean) / h
    m.initial_state(
        q=[0, 0, h, cos(lean / 2), sin(lean / 2), 0, 0],
        v=[-speed, 0, 0, 0, 0, -spin * sin(lean / 2) / 2, spin * cos(lean / 2) / 2],
    )
    return m


def full_order(
    report: Progress = lambda text: None, stages: tuple[int, ...] = (2, 3, 4, 5)
) -> Study:
    """Orders 2s - 2 with velocity constraints at auxiliary velocities, on three examples.

    The sleigh's angle is n gd(omega_0 t / n) with n^2 = 1 + J / (m a^2) and Gudermann's function;
    the coin is compared with its own run of 400 steps at s = 5.
    """
    study = Study("full order")
    rate = 2 / 7 * 3.0
    circle = 0.3 * np.array([cos(rate * 2), sin(rate * 2)])
    n = sqrt(1 + 0.03 / (2.0 * 0.15**2))
    angle = np.array([n * 2 * atan(tanh(4.0 / n / 2))])
    coin = build(rolling_coin(), stages=5).simulate(t_end=0.4, dt=1e-3, tol=0).q[-1]
    cases = (
        ("ball on turntable", ball_on_turntable.model, 2.0, slice(0, 2), circle, 5),
        ("sleigh", chaplygin_sleigh.model, 1.0, slice(2, 3), angle, 10),
        ("rolling coin", rolling_coin, 0.4, slice(0, 7), coin, 10),
    )
    for text, make, t_end, part, exact, coarsest in cases:
        for s in stages:
            report(f"full order, {text}, s = {s}")
            stepper = build(make(), stages=s)
            # with five stages few steps reach round-off
            first = coarsest if s < 5 else (coarsest + 1) // 2 - 1
            dt = t_end / (first * 2.0 ** np.arange(5))[::-1]
            errors = [
                float(np.abs(stepper.simulate(t_end=t_end, dt=h, tol=0).q[-1, part] - exact).max())
                for h in dt
            ]
            study.curves[f"{text}, s = {s}"] = {"dt": dt, "q": errors}
            order = slope_of(dt, np.array(errors), 1e-12)
            # some errors cancel at the end of the sleigh's run: the order is at least 2s - 2
            study.claims.append(
                Claim(
                    f"full order, s = {s}",
                    f"{text}: order at least 2s - 2 = {2 * s - 2}, to a tenth",
                    order,
                    ">=",
                    0.9 * (2 * s - 2),
                )
            )
    return study


def lost_impacts(
    report: Progress = lambda text: None,
    stages: tuple[int, ...] = (2, 3, 4, 5),
    phases: int = 100,
) -> Study:
    """Share of impacts, over phases within a step, that reverse the velocity in their own step."""
    study = Study("lost impacts")
    expected_end = {2: 1.0, 3: 1.0, 4: 0.71, 5: 0.51}
    for rule in ("end", "any_stage"):
        shares = []
        for s in stages:
            report(f"lost impacts, {rule}, s = {s}")
            kept = 0
            for k in range(phases):
                # meets the wall at the fraction (k + 1/2) / phases of the sixth step
                start = 0.01 * (5 + (k + 0.5) / phases)
                traj = _stepper("particle", s).simulate(
                    t_end=0.06, dt=0.01, q0=[start], active_set=rule
                )
                kept += traj.v[-1, 0] > 0
            shares.append(kept / phases)
            limit = expected_end.get(s) if rule == "end" else 1.0
            if limit is not None:
                study.claims.append(
                    near(
                        f"impacts, rule {rule}, s = {s}",
                        "share registered in its own step",
                        shares[-1],
                        limit,
                        0.03,
                    )
                )
        study.curves[rule] = {"stages": np.array(stages), "share": np.array(shares)}
    return study


def bilateral(report: Progress = lambda text: None, stages: tuple[int, ...] = (2, 3, 4)) -> Study:
    """A permanently closed frictionless contact against the same gap as a bilateral constraint."""
    study = Study("bilateral")
    for s in stages:
        report(f"bilateral, s = {s}")
        m = slope.model()
        (contact,) = m.contacts
        m.contacts = []
        m.constraint("kept_closed", contact.g_N)
        kept = build(m, stages=s).simulate(t_end=1.0, dt=2e-2, tol=0)
        closed = _stepper("slope", s).simulate(t_end=1.0, dt=2e-2, parameters={"mu": 0.0}, tol=0)
        apart = np.abs(kept.q - closed.q).max(axis=1)
        study.curves[f"s = {s}"] = {"t": kept.t, "difference": apart}
        study.claims.append(
            Claim(
                f"closed contact = constraint, s = {s}",
                "largest difference of q",
                float(apart.max()),
                "<=",
                1e-11,
                "m",
            )
        )
    return study


STUDIES: dict[str, Callable[..., Study]] = {
    "orders": orders,
    "full order": full_order,
    "lost impacts": lost_impacts,
    "bilateral": bilateral,
}
