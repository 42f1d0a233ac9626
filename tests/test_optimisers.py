"""Derivatives where they are used: optimisation, identification, other frameworks."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.models import bouncing_ball

Build = Callable[..., sg.Stepper]


def test_a_step_as_a_function_of_casadi(stepper: Build) -> None:
    """Its derivatives are those of a run, chained by CasADi over four calls of ten steps each."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    step = sg.casadi_step(made, 1e-2, steps=10)
    assert (step.name_in(1), step.name_out(0), step.size_in(3)) == ("v", "q_next", (5, 1))
    q, v, par = ca.MX.sym("q", 3), ca.MX.sym("v", 3), ca.MX.sym("par", 5)
    where, speed = q, v
    for _ in range(5):
        where, speed = step(where, speed, ca.MX(0, 1), par)
    end = ca.vertcat(where, speed)
    of = ca.vertcat(q, v, par)
    slopes = ca.Function("slopes", [q, v, par], [end, ca.jacobian(end, of)])
    start = made.initial_state()[1:]
    values = list(made.parameters.values())
    found, slope_of = (np.array(x) for x in slopes(*start, values))
    traj = made.simulate(
        t_end=0.5, dt=1e-2, events="located", derivatives="forward", of=("q0", "v0", "parameters")
    )
    np.testing.assert_allclose(found[:, 0], [*traj.q[-1], *traj.v[-1]], atol=1e-12)
    mine = np.vstack([np.hstack(list(x.values())) for x in (
        {k: c[-1] for k, c in traj.dq.items()}, {k: c[-1] for k, c in traj.dv.items()})
    ])  # fmt: skip
    np.testing.assert_allclose(slope_of, mine, atol=1e-10)


def test_a_bounce_shot(stepper: Build) -> None:
    """IPOPT finds the throw whose third bounce is in a cup; closed form: vertical speed e^3 v."""
    m = sg.Model("shot")
    (_, y), (v, w) = m.coordinates("x y", units="m m"), m.velocities
    m.lagrangian = (v**2 + w**2) / 2 - sp.Rational(981, 100) * y
    m.contact("floor", g_N=y, e_N=sp.Rational(4, 5))
    m.initial_state(q=[0, 1])
    fly = sg.casadi_step(sg.build(m, stages=2, derivatives=True), 1.7 / 40, steps=40)
    throw = ca.MX.sym("throw", 2)
    end, _ = fly(ca.DM([0, 1]), throw, ca.MX(0, 1), ca.MX(0, 1))
    away = end - ca.DM([3, 0.3])
    problem = {"x": throw, "f": ca.sumsqr(throw), "g": away}
    quiet = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-11,
             "hessian_approximation": "limited-memory"}}  # fmt: skip
    solver = ca.nlpsol("solver", "ipopt", problem, quiet)
    found = np.array(solver(x0=[1, 0.5], lbg=0, ubg=0)["x"]).ravel()
    assert solver.stats()["success"]
    assert found[0] == pytest.approx(3 / 1.7, rel=1e-9)
    # three flights by hand
    place, speed, t = 1.0, found[1], 0.0
    bounces = 0
    while True:
        fall = (speed + np.sqrt(speed**2 + 2 * 9.81 * place)) / 9.81
        if t + fall > 1.7:
            rest = 1.7 - t
            place += speed * rest - 9.81 * rest**2 / 2
            break
        t, bounces = t + fall, bounces + 1
        place, speed = 0.0, -0.8 * (speed - 9.81 * fall)
    assert bounces >= 2 and place == pytest.approx(0.3, abs=1e-9)
