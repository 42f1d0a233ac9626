"""Velocity constraints at full order: orders, equations from the model's functions, start force."""

from collections.abc import Callable
from math import cos, pi, sin, sqrt, tanh

import casadi as ca
import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.bodies import Ellipsoid, Round, Spatial, inertia
from signorini.codegen.frontend.errors import GenerationError
from signorini.codegen.schemes.tableau import lobatto
from signorini.models import ball_on_turntable, bouncing_ball, chaplygin_sleigh, slope
from trap_models import only_constraints, unconstrained

Build = Callable[..., sg.Stepper]


def rolling_coin() -> sg.Model:
    """A flat spheroid that rolls on a plane: two velocity and two position constraints."""
    m = sg.Model("rolling_coin", symbols="casadi")
    mass, R, b = 0.2, 0.1, 0.03
    world = Spatial(m, gravity=(0, 0, -9.81))
    coin = world.body("coin", mass, inertia.cylinder(mass, R, 2 * b), coordinates="x y z a b c d")
    rim = Ellipsoid(coin, (R, R, b))
    world.touching("contact", rim, world.plane())
    world.rolling("rolling", rim, world.plane())
    m.initial_state(q=[0, 0, b, 1, 0, 0, 0])
    return m


def driven() -> sg.Model:
    """Time, inputs, parameters and a Lagrangian that is not separable, both kinds of constraint."""
    m = sg.Model("driven")
    x, y, phi, z = m.coordinates("x y phi z")
    v_x, v_y, w, v_z = m.velocities
    t = m.time
    (k,) = m.parameters(k=1.5)
    (u,) = m.inputs("u")
    m.lagrangian = (
        (v_x**2 + v_y**2 + v_z**2) / 2 * (1 + sp.sin(x) / 5)
        + w**2 * (2 + sp.cos(phi)) / 10
        + v_x * w * sp.cos(y) / 10
        + v_y * x * sp.sin(t) / 3
        - k / 2 * (x**2 + z**2)
    )
    m.force({"x": u * sp.cos(t), "phi": -w / 20, "z": sp.sin(2 * t)})
    m.velocity_constraint("edge", -v_x * sp.sin(phi) + v_y * sp.cos(phi) - w / 5 - sp.sin(t) / 4)
    m.constraint("rail", z - x**2 / 4 - sp.sin(t) / 5)
    m.initial_state(q=[0, 0, 0.3, 0], v=[0, 0, 0, 0.2])
    return m


def end_errors(stepper: sg.Stepper, counts: tuple[int, ...], t_end: float, exact: np.ndarray,
               part: slice, **start: object) -> np.ndarray:  # fmt: skip
    return np.array(
        [
            np.abs(
                stepper.simulate(t_end=t_end, dt=t_end / n, tol=0, **start).q[-1, part] - exact
            ).max()
            for n in counts
        ]
    )


@pytest.mark.parametrize(
    ("stages", "counts"), [(2, (20, 40)), (3, (10, 20)), (4, (5, 10)), (5, (3, 6))]
)
def test_turntable_orders(stepper: Build, stages: int, counts: tuple[int, int]) -> None:
    rate = 2 / 7 * 3.0
    exact = 0.3 * np.array([cos(2 * rate), sin(2 * rate)])
    coarse, fine = end_errors(
        stepper(ball_on_turntable.model, stages), counts, 2.0, exact, slice(0, 2)
    )
    assert np.log2(coarse / fine) == pytest.approx(2 * stages - 2, abs=0.3)


@pytest.mark.parametrize(
    ("stages", "counts"), [(2, (40, 80)), (3, (20, 40)), (4, (20, 40)), (5, (12, 24))]
)
def test_sleigh_orders(stepper: Build, stages: int, counts: tuple[int, int]) -> None:
    """Angle in closed form: phi = n gd(omega_0 t / n) with n^2 = 1 + J/(m a^2), gd Gudermann's."""
    ratio = sqrt(1 + 0.03 / (2.0 * 0.15**2))
    gd = 2 * np.arctan(tanh(4.0 * 1.0 / ratio / 2))
    coarse, fine = end_errors(
        stepper(chaplygin_sleigh.model, stages), counts, 1.0, np.array([ratio * gd]), slice(2, 3)
    )
    assert np.log2(coarse / fine) > 2 * stages - 2.5


@pytest.mark.parametrize(
    ("stages", "counts"),
    [
        pytest.param(2, (80, 160), marks=pytest.mark.slow),
        (3, (40, 80)),
        pytest.param(4, (20, 40), marks=pytest.mark.thorough),
    ],
)
def test_coin_orders(stepper: Build, stages: int, counts: tuple[int, int]) -> None:
    """A wobbling coin against its own fine run with five stages."""
    lean = 1.2
    R, b = 0.1, 0.03
    h = sqrt(R**2 * sin(lean) ** 2 + b**2 * cos(lean) ** 2)
    coin = stepper(rolling_coin, stages)
    q = [0, 0, h, cos(lean / 2), sin(lean / 2), 0, 0]
    start = {"q0": q, "v0": rolling_start(q, [0.5, 0.0, 12.0])}
    exact = stepper(rolling_coin, 5).simulate(t_end=0.4, dt=0.4 / 200, tol=0, **start).q[-1]
    coarse, fine = end_errors(coin, counts, 0.4, exact, slice(0, 7), **start)
    assert np.log2(coarse / fine) == pytest.approx(2 * stages - 2, abs=0.4)


def rolling_start(q: list[float], omega: list[float]) -> np.ndarray:
    """Velocities of the coin with an angular velocity in body axes, rolling."""
    p = np.array(q[3:])
    H = np.array(
        [[-p[1], p[0], p[3], -p[2]], [-p[2], -p[3], p[0], p[1]], [-p[3], p[2], -p[1], p[0]]]
    )
    v = np.concatenate([np.zeros(3), H.T @ omega / 2])
    steady = sg.build(rolling_coin(), stages=2)
    W = np.hstack([steady.evaluate(n, t=0, q=q, v=v).reshape(7, -1) for n in ("W_g", "W_gamma")])
    # only the velocity of the centre is free to meet the constraints
    rest = np.concatenate([steady.evaluate(n, t=0, q=q, v=v).ravel() for n in ("g_dot", "gamma")])
    v[:3] -= np.linalg.lstsq(W[:3].T, rest, rcond=None)[0]
    return v


@pytest.mark.parametrize("stages", [2, 3, 4])
@pytest.mark.parametrize("make", [driven, only_constraints, chaplygin_sleigh.model])
def test_steps_satisfy_the_equations(make: Callable[[], sg.Model], stages: int) -> None:
    """(47b), (47d), g, g_dot, gamma at auxiliary velocities found anew."""
    stepper = sg.build(make(), stages=stages)
    assert stepper.manifest["velocity_constraints"] == "full_order"
    n, s, table = stepper.sizes, stages, lobatto(stages).arrays()
    h = 0.05
    u = np.random.default_rng(1).normal(size=(12, n["n_u"]))
    traj = stepper.simulate(t_end=12 * h, dt=h, inputs=u if u.size else None, record="stages")
    functions = set(stepper.functions)

    def value(name: str, *at: object, **more: object) -> np.ndarray:
        return np.atleast_1d(stepper.evaluate(name, *at, **more))

    for k in range(12):
        p_n = value("p", traj.t[k], traj.q[k], traj.v[k])
        F = []
        for j in range(s):
            at = traj.t[k] + table["c"][j] * h, traj.Q[k, j], traj.V[k, j]
            R = np.concatenate([traj.R_g[k, j], traj.R_gamma[k, j]])
            W = np.hstack(
                [value(w, *at).reshape(n["n_q"], -1) for w in ("W_g", "W_gamma") if w in functions]
            )
            F.append(h * (value("L_q", *at) + value("f", *at, u=u[k])) + W @ R)
        for i in range(s):
            t, Q = traj.t[k] + table["c"][i] * h, traj.Q[k, i]
            momentum = value("p", t, Q, traj.V[k, i]) - p_n
            assert momentum == pytest.approx(
                sum(table["a_hat"][i, j] * F[j] for j in range(s)), abs=1e-10
            )
            if i == 0:
                continue
            # U^i from its momentum; p is affine in v
            goal = p_n + sum(table["a"][i, j] * F[j] for j in range(s))
            M = value("p_v", t, Q, traj.V[k, i])
            U = traj.V[k, i] + np.linalg.solve(M, goal - value("p", t, Q, traj.V[k, i]))
            assert np.abs(value("gamma", t, Q, U)).max() < 1e-10
            if "g" in functions:
                assert np.abs(value("g", t, Q)).max() < 1e-12
        assert pytest.approx(traj.v[k + 1], abs=1e-10) == U
        if "g_dot" in functions:
            assert np.abs(value("g_dot", t, Q, U)).max() < 1e-10
        assert traj.P_gamma[k + 1] == pytest.approx(
            sum(table["b"][j] * traj.R_gamma[k, j] for j in range(s)), abs=1e-12
        )


@pytest.mark.parametrize("make", [driven, only_constraints])
def test_force_at_the_start_of_every_step(make: Callable[[], sg.Model]) -> None:
    """R_gamma^1 / h comes from d(g_dot)/dt = d(gamma)/dt = 0 with the equations of motion (T4).

    Differences of the model's functions along the motion stand in for all second derivatives.
    """
    stepper = sg.build(make(), stages=3)
    h = 1e-3
    n = stepper.sizes
    u = np.full((30, n["n_u"]), 0.4)
    traj = stepper.simulate(t_end=30 * h, dt=h, inputs=u if u.size else None, record="stages")
    for k in (0, 1, 29):
        t, q, v = traj.t[k], traj.q[k], traj.v[k]
        assert traj.R_gamma[k, 0] / h == pytest.approx(
            force_of_constraints(stepper, t, q, v, u[k]), abs=1e-6
        )


def force_of_constraints(
    stepper: sg.Stepper, t: float, q: np.ndarray, v: np.ndarray, u: np.ndarray
) -> np.ndarray:
    """lambda of the velocity constraints from (T4)."""
    n = stepper.sizes
    W = np.hstack([stepper.evaluate(w, t, q, v).reshape(n["n_q"], -1) for w in ("W_g", "W_gamma")])
    eps = 1e-5

    def along(name: str) -> np.ndarray:
        return (
            stepper.evaluate(name, t + eps, q + eps * v, v)
            - stepper.evaluate(name, t - eps, q - eps * v, v)
        ) / (2 * eps)

    force = stepper.evaluate("L_q", t, q, v) + stepper.evaluate("f", t, q, v, u=u) - along("p")
    M = stepper.evaluate("p_v", t, q, v)
    rate = np.concatenate([along("g_dot"), along("gamma")])
    system = np.block([[M, -W], [W.T, np.zeros((W.shape[1],) * 2)]])
    solution = np.linalg.solve(system, np.concatenate([force, -rate]))
    return solution[n["n_q"] + n["n_g"] :]


def test_energy_and_force_stay_bounded(stepper: Build) -> None:
    """10^4 steps on the turntable: energy and force of the constraint do not drift."""
    traj = stepper(ball_on_turntable.model, 3).simulate(t_end=1000, dt=0.1, every=10)
    radius = np.hypot(traj["x"], traj["y"])
    assert radius == pytest.approx(np.full(len(radius), 0.3), abs=2e-4)
    forces = traj["rolling.force"]
    size = np.linalg.norm(forces[1:], axis=1)
    assert np.ptp(size) < 2e-3 * size.mean()


@pytest.mark.parametrize("stages", [2, 3, 4])
def test_a_sleigh_settles(stages: int) -> None:
    """A sleigh with its centre of mass ahead of the edge runs straight: its turning decays.

    About v = (1, 0) the motion is phi_ddot = -m a v / (m a^2 + J) phi_dot = -4 phi_dot. A force
    carried from step to step has a mode that grows at 4 / (s - 1) instead.
    """
    m = sg.Model("sleigh")
    m.coordinates("x y phi")
    phi = m.q[2]
    v_x, v_y, omega = m.velocities
    mass, J, a = 1.0, 0.015, 0.15
    m.lagrangian = mass * (v_x**2 + v_y**2) / 2 + J * omega**2 / 2
    m.velocity_constraint("edge", -v_x * sp.sin(phi) + v_y * sp.cos(phi) - a * omega)
    m.initial_state(q=[0, 0, 0], v=[1, a * 1e-3, 1e-3])
    rate = mass * a / (mass * a**2 + J)
    assert rate == pytest.approx(4)
    traj = sg.build(m, stages=stages).simulate(t_end=30, dt=5e-3)
    turning = traj["phi_dot"]
    assert turning[400] == pytest.approx(1e-3 * np.exp(-rate * 2), rel=1e-3)
    assert np.abs(turning[3000:]).max() < 1e-13  # rounding of velocities of 1
    assert traj.energy == pytest.approx(np.full(len(traj), traj.energy[0]), rel=1e-9)


def test_a_restart_needs_the_state_alone() -> None:
    """Nothing is carried along: a run equals its second half started anew, up to the tolerance."""
    stepper = sg.build(driven(), stages=3)
    u = np.full((40, 1), 0.3)
    whole = stepper.simulate(t_end=1.0, dt=0.025, inputs=u)
    again = stepper.simulate(
        t_end=1.0, t0=0.5, dt=0.025, q0=whole.q[20], v0=whole.v[20], inputs=u[20:]
    )
    assert again.q[-1] == pytest.approx(whole.q[-1], abs=1e-11)
    fine = stepper.simulate(t_end=1.0, dt=0.0125, inputs=np.full((80, 1), 0.3))
    assert whole.q[-1] == pytest.approx(fine.q[-1], abs=1e-5)


def test_defaults_and_refusals() -> None:
    """Full order where it can be had; a named reason where not."""
    forms = {
        make: sg.build(make(), stages=2).manifest["velocity_constraints"]
        for make in (chaplygin_sleigh.model, slope.model, unconstrained)
    }
    assert list(forms.values()) == ["full_order", "paper", "paper"]
    asked = sg.build(chaplygin_sleigh.model(), stages=2, velocity_constraints="paper")
    assert asked.manifest["velocity_constraints"] == "paper"
    with pytest.raises(GenerationError, match=r"'bouncing_ball'.*it has contacts"):
        sg.build(bouncing_ball.model(), velocity_constraints="full_order")
    with pytest.raises(GenerationError, match="no velocity constraints"):
        sg.build(unconstrained(), velocity_constraints="full_order")
    with pytest.raises(GenerationError, match="the scheme is moreau"):
        sg.build(chaplygin_sleigh.model(), scheme="moreau", velocity_constraints="full_order")
    with pytest.raises(GenerationError, match="unknown; choose one of"):
        sg.build(chaplygin_sleigh.model(), velocity_constraints="half")


def test_ball_is_no_ellipsoid_apart() -> None:
    """Rolling of a round and of an ellipsoid with equal axes is the same constraint."""
    m = sg.Model("two_forms", symbols="casadi")
    world = Spatial(m)
    ball = world.body("b", 1.0, (0.1, 0.1, 0.1))
    world.rolling("one", Round(ball.point(), 0.2), world.plane())
    world.rolling("two", Ellipsoid(ball, (0.2, 0.2, 0.2)), world.plane())
    rows = [m.world.to_sx("m", "g", e) for _, block in m.velocity_constraints for e in block]
    f = ca.Function("f", [ca.vertcat(*m.q), ca.vertcat(*m.v)], [ca.vertcat(*rows)])
    q = np.array([0.1, 0.2, 0.3, cos(pi / 5), sin(pi / 5) * 0.6, 0, sin(pi / 5) * 0.8])
    one = np.asarray(f(q, np.arange(7.0))).ravel()
    assert one[:2] == pytest.approx(one[2:], abs=1e-12)
