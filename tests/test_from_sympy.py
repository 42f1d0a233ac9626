"""Models taken over from SymPy's mechanics against SymPy's own equations of motion."""

from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.bodies import (
    Translated,
    from_lagranges_method,
    from_lagrangian,
    from_system,
)
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    PinJoint,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    System,
    TorqueActuator,
    dynamicsymbols,
    inertia,
)


def error(made: Translated, method: Any, q: list[Any], values: dict[Any, float]) -> float:
    """Largest error of mass matrix, forcing and constraint directions at random states (autonomous
    systems), over the tolerance of each."""
    worst = 0.0
    n = len(q)
    method.form_lagranges_equations()
    qd = [x.diff(dynamicsymbols._t) for x in q]
    u = list(made.model.input_names)
    inputs = [dynamicsymbols(name) for name in u]
    at = [*q, *qd, *inputs]
    # derivatives first, so that q(t) inside them is not replaced
    dummies = [sp.Dummy() for _ in at]
    order = dict(zip(at, dummies, strict=True))
    numeric = [
        sp.lambdify(dummies, sp.Matrix(e).subs(values).xreplace(order), "numpy")
        for e in (method._m_d, method._f_d, method.lam_coeffs)
    ]
    made.model.initial_state(q=[0] * n)
    stepper = sg.build(made.model, stages=2)
    rng = np.random.default_rng(3)
    for _ in range(5):
        q0, v0 = rng.uniform(-1, 1, (2, n))
        u0 = rng.uniform(-1, 1, len(u))
        M, forcing, W = (np.atleast_2d(f(*q0, *v0, *u0)) for f in numeric)
        state = {"t": 0.0, "q": q0, "v": v0}
        worst = max(worst, over(stepper.evaluate("p_v", **state), M, 1e-12))
        p_q = stepper.evaluate("p_q", **state)
        force = stepper.evaluate("L_q", **state) + stepper.evaluate("f", **state, u=u0)
        worst = max(worst, over(force - p_q @ v0, forcing.ravel(), 1e-11))
        if W.size:
            mine = [stepper.evaluate(k, **state).reshape(n, -1) for k in ("W_g", "W_gamma")]
            worst = max(worst, over(np.hstack(mine).T, -W, 1e-12))
    return worst


def over(mine: np.ndarray, other: np.ndarray, tolerance: float) -> float:
    """Largest difference over a tolerance: absolute, or 1e-6 of the other value."""
    return float(np.max(np.abs(mine - other) / np.maximum(tolerance, 1e-6 * np.abs(other))))


def test_lagranges_method() -> None:
    """A driven double pendulum with a slider on a rail and a knife edge: all kinds of data."""
    q = dynamicsymbols("q1 q2 q3")
    F = dynamicsymbols("F")
    m, g, l_1, c = sp.symbols("m g l_1 c")
    N = ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [q[0], N.z])
    origin, P, Q = Point("O"), Point("P"), Point("Q")
    origin.set_vel(N, 0)
    P.set_pos(origin, l_1 * A.x)
    P.set_vel(N, l_1 * q[0].diff() * A.y)
    Q.set_pos(P, q[1] * N.x + q[2] * N.y)
    Q.set_vel(N, P.vel(N) + q[1].diff() * N.x + q[2].diff() * N.y)
    T = m / 2 * P.vel(N).dot(P.vel(N)) + m / 2 * Q.vel(N).dot(Q.vel(N))
    V = m * g * (P.pos_from(origin).dot(N.y) + Q.pos_from(origin).dot(N.y))
    method = LagrangesMethod(
        sp.expand(T - V),
        q,
        forcelist=[(Q, F * N.x - c * Q.vel(N)), (A, c * q[1] * N.z)],
        frame=N,
        hol_coneqs=[q[2] - sp.sin(q[1])],
        nonhol_coneqs=[q[0].diff() * sp.cos(q[1]) - q[1].diff() * q[0]],
    )
    values = {m: 1.3, g: 9.81, l_1: 0.4, c: 0.2}
    made = from_lagranges_method("taken_over", method, parameters=values, inputs=[F])
    assert error(made, method, q, values) < 1


def test_system() -> None:
    """Joints, bodies, potential energies, loads and an actuator."""
    q, u, x, v = dynamicsymbols("q u x v")
    M, m, g, k, length, J = sp.symbols("M m g k length J")
    torque = dynamicsymbols("torque")
    rail = RigidBody("rail")
    cart = RigidBody("cart", mass=M)
    rod_frame = ReferenceFrame("R")
    center = Point("center")
    own_inertia = (inertia(rod_frame, J, J, J), center)
    rod = RigidBody("rod", center, rod_frame, m, own_inertia)
    system = System.from_newtonian(rail)
    slide = PrismaticJoint("slide", rail, cart, x, v, joint_axis=rail.frame.x)
    pin = PinJoint(
        "pin",
        cart,
        rod,
        q,
        u,
        joint_axis=cart.frame.z,
        child_point=length / 2 * rod_frame.y,
    )
    system.add_joints(slide, pin)
    rod.potential_energy = m * g * rod.masscenter.pos_from(system.fixed_point).dot(rail.frame.y)
    cart.potential_energy = k * x**2 / 2
    system.add_loads((cart.masscenter, -3 * v * rail.frame.x))
    system.add_actuators(TorqueActuator(torque, rail.frame.z, rod_frame, rail.frame))
    values = {M: 2.0, m: 0.7, g: 9.81, k: 4.0, length: 0.9, J: 0.05}
    made = from_system("cart_and_rod", system, parameters=values, inputs=[torque])
    rates = {u: q.diff(), v: x.diff()}
    from sympy.physics.mechanics import Lagrangian

    own = LagrangesMethod(
        Lagrangian(system.frame, *system.bodies).subs(rates),
        list(system.q),
        forcelist=[
            (place, vector.subs(rates))
            for place, vector in (
                *system.loads,
                *(load for a in system.actuators for load in a.to_loads()),
            )
        ],
        frame=system.frame,
    )
    for point in (cart.masscenter, rod.masscenter):
        point.set_vel(system.frame, point.vel(system.frame).subs(rates))
    rod_frame.set_ang_vel(system.frame, q.diff() * system.frame.z)
    assert error(made, own, list(system.q), values) < 1


def test_contacts_on_top() -> None:
    """A ball from a Lagrangian in dynamicsymbols hits the floor when it should."""
    y = dynamicsymbols("y")
    m, g = sp.symbols("m g")
    made = from_lagrangian(
        "ball", m * y.diff() ** 2 / 2 - m * g * y, [y], parameters={m: 2.0, g: sg.par(9.81)}
    )
    made.model.contact("floor", g_N=made.translate(y - sp.Rational(1, 10)), e_N=0.5)
    made.model.initial_state(q=[1])
    traj = sg.build(made.model).simulate(t_end=0.5, dt=1e-4)
    hit = traj.t[np.argmax(traj["floor.P_N"] > 0)]
    assert hit == pytest.approx(np.sqrt(2 * 0.9 / 9.81), abs=2e-4)


def test_what_is_missing_is_named() -> None:
    y = dynamicsymbols("y")
    m, g = sp.symbols("m g")
    with pytest.raises(sg.ModelError, match="contains g, which is no coordinate"):
        from_lagrangian("ball", m * y.diff() ** 2 / 2 - m * g * y, [y], parameters={m: 1.0})
    with pytest.raises(sg.ModelError, match="x is no dynamicsymbol"):
        from_lagrangian("ball", m, [sp.Symbol("x")])


def test_names_that_c_lacks_are_given() -> None:
    """A pendulum in LaTeX, Greek and elements of matrices moves as one in plain names."""
    theta, plain = dynamicsymbols(r"\theta"), dynamicsymbols("theta")
    length, M = sp.Symbol("ℓ"), sp.MatrixSymbol("M", 2, 2)
    k = sp.IndexedBase("k")

    def lagrangian(angle: sp.Expr, mass: sp.Expr, arm: sp.Expr, spring: sp.Expr) -> sp.Expr:
        speed = angle.diff()
        potential = -9.81 * mass * arm * sp.cos(angle) + spring * angle**2 / 2
        return mass * arm**2 * speed**2 / 2 - potential

    with pytest.raises(sg.ModelError, match=r'names=\{\\theta\(t\): "theta"\}'):
        from_lagrangian("p", lagrangian(theta, sp.S.One, sp.S.One, sp.S.Zero), [theta])
    made = from_lagrangian(
        "p",
        lagrangian(theta, M[0, 1], length, k[1]),
        [theta],
        parameters={M[0, 1]: 2.0, length: 0.7, k[1]: 3.0},
        names={theta: "theta", length: "arm"},
    )
    other = from_lagrangian(
        "other", lagrangian(plain, sp.Integer(2), sp.Rational(7, 10), sp.Integer(3)), [plain]
    )
    for m in (made, other):
        m.model.initial_state(q=[1.0], v=[0.2])
    steppers = [sg.build(m.model, stages=2) for m in (made, other)]
    one, two = (stepper.simulate(t_end=0.2, dt=1e-2) for stepper in steppers)
    np.testing.assert_allclose(one["theta"], two["theta"], rtol=1e-12)
    assert abs(one["theta"][-1] - 1) > 0.1
    assert list(steppers[0].parameters) == ["M_0_1", "arm", "k_1"]
    with pytest.raises(sg.ModelError, match=r"names of 'z': it is no coordinate"):
        from_lagrangian("p", theta, [theta], names={theta: "theta", sp.Symbol("z"): "z"})


def test_methods_of_kane_are_answered_by_name() -> None:
    q, u = dynamicsymbols("q u")
    kane = KanesMethod(ReferenceFrame("N"), [q], [u], kd_eqs=[u - q.diff()])
    for make in (from_lagranges_method, from_system, lambda n, k: from_lagrangian(n, k, [q])):
        with pytest.raises(sg.ModelError, match=r"KanesMethod.*hold no Lagrangian.*from_system"):
            make("k", kane)


@pytest.mark.thorough
def test_weights_given_as_loads_are_in_the_energy() -> None:
    """A double pendulum whose weights are loads on points keeps its energy; a force that turns with
    a body stays a force."""
    g, rod, m = sp.symbols("g rod m")
    a, b, w_a, w_b = dynamicsymbols("a b w_a w_b")
    system = System.from_newtonian(RigidBody("ground"))
    bodies = [RigidBody(name, mass=m) for name in ("upper", "lower")]
    for body in bodies:
        body.central_inertia = inertia(body.frame, 0, 0, m * rod**2 / 12)
    down = -system.y
    previous = system.bodies[0]
    for body, q, u in zip(bodies, (a, b), (w_a, w_b), strict=True):
        at = None if previous is system.bodies[0] else previous.masscenter.locatenew(
            f"end_{body.name}", -rod / 2 * previous.frame.y
        )  # fmt: skip
        system.add_joints(
            PinJoint(
                f"joint_{body.name}", previous, body, coordinates=q, speeds=u,
                parent_point=at, child_point=rod / 2 * body.frame.y, joint_axis=system.z,
            )
        )  # fmt: skip
        system.add_loads((body.masscenter, m * g * down))
        previous = body
    made = from_system("pendulum", system, parameters={g: 9.81, rod: 0.7, m: 0.4})
    assert made.model.forces == []
    made.model.initial_state(q=[1.0, 0.4])
    run = sg.build(made.model, stages=3).simulate(dt=2e-3, t_end=1)
    rises = 0.4 * 9.81 * 0.7 * (np.cos(1.0) * 1.5 + np.cos(1.4) * 0.5)
    assert np.ptp(run.energy) < 1e-6 * rises
    assert np.abs(run.v).max() > 3
    system.add_loads((bodies[1].masscenter, bodies[1].frame.x))
    again = from_system("pendulum", system, parameters={g: 9.81, rod: 0.7, m: 0.4})
    assert len(again.model.forces) == 1
