"""A hopper finds its way of hopping: two stances and the flights around them, by IPOPT.

From a drop at rest it shall be one metre further after two stances, at the top of its flight, level
and with its leg hanging down, with the least effort. Decision variables are the thrust of the leg
and the torque of the hip, held over pieces of 20 ms; derivatives through touch-downs, slip and
take-off are exact. Run it: python hopper_jump.py
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import signorini as sg
from signorini.models import hopper

DT, STEPS = 5e-3, 4  # a piece has so many steps
PIECES = 62
WAY, HEIGHT = 1.0, 0.75
START = np.array([0, 0.8, 0, 0, 0.5])


@dataclass
class Jump:
    """Inputs of the pieces, the run with them, and how IPOPT got there."""

    inputs: np.ndarray
    run: sg.Trajectory
    first: sg.Trajectory
    effort: float
    iterations: int


def held(pieces: np.ndarray) -> np.ndarray:
    """Inputs of the steps."""
    return np.repeat(pieces, STEPS, axis=0)


def solve() -> Jump:
    """Find the jump."""
    stepper = sg.build(hopper.model(), stages=3, derivatives=True)
    about = {"t_end": PIECES * STEPS * DT, "dt": DT, "events": "located", "q0": START}
    first = stepper.simulate(**about, inputs=hopper.controller(0.8))
    guess = first.u[:-1].reshape(PIECES, STEPS, 2).mean(axis=1)

    piece = sg.casadi_step(stepper, DT, steps=STEPS)
    parameters = list(stepper.parameters.values())
    u = ca.MX.sym("u", 2, PIECES)
    scale = ca.DM([30.0, 5.0])  # of a thrust, of a torque
    q, v = ca.MX(START), ca.MX.zeros(5)
    for k in range(PIECES):
        q, v = piece(q, v, u[:, k] * scale, parameters)
    problem = {
        "x": ca.vec(u),
        "f": ca.sumsqr(u) / PIECES,
        "g": ca.vertcat(q[0] - WAY, q[1] - HEIGHT, v[1], q[2], q[3], v[2], v[3]),
    }
    quiet = {
        "print_time": False,
        "ipopt": {
            "print_level": 0, "sb": "yes", "hessian_approximation": "limited-memory",
            "tol": 1e-4, "constr_viol_tol": 1e-6, "max_iter": 200,
        },
    }  # fmt: skip
    solver = ca.nlpsol("solver", "ipopt", problem, quiet)
    found = solver(x0=(guess / np.array([30.0, 5.0])).ravel(), lbg=0, ubg=0, lbx=-8, ubx=8)
    if not solver.stats()["success"]:
        raise RuntimeError(solver.stats()["return_status"])
    inputs = np.array(found["x"]).reshape(PIECES, 2) * np.array([30.0, 5.0])
    run = stepper.simulate(**about, inputs=held(inputs))
    return Jump(inputs, run, first, float(found["f"]), solver.stats()["iter_count"])


if __name__ == "__main__":
    jump = solve()
    print(f"{jump.iterations} iterations, effort {jump.effort:.3f}")
    for event in jump.run.events:
        print(f"  {event.t:.4f} s: {event.kind}")
    print(f"at the end at {jump.run.q[-1]}")
    jump.run.animate("hopper_jump.html")
