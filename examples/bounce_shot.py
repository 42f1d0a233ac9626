"""A throw whose third bounce ends in a cup.

The throw and the time are found by IPOPT from exact derivatives through two bounces on a floor with
friction, which also changes the spin. Run it: python bounce_shot.py
"""

import casadi as ca
import numpy as np
import signorini as sg
from signorini.models import bouncing_ball

STEPS = 60
CUP = 2.5, 0.25  # place of the cup, and height of the ball's middle at its rim [m]


def solve() -> dict[str, np.ndarray]:
    """The throw (speeds and spin), the time of the way, and the run."""
    stepper = sg.build(bouncing_ball.model(), stages=3, derivatives=True)
    fly = sg.casadi_step(stepper, steps=STEPS)
    parameters = list((stepper.parameters | {"e_N": 0.8}).values())

    throw, time = ca.MX.sym("throw", 3), ca.MX.sym("time")
    start = ca.DM([0, 1, 0])
    q, v = fly(start, throw, ca.DM(0, 1), parameters, 0, time / STEPS)
    problem = {
        "x": ca.vertcat(throw, time),
        "f": ca.sumsqr(throw[:2]) + 0.004 * throw[2] ** 2,  # with little energy
        "g": ca.vertcat(q[:2] - ca.DM(CUP), v[1]),
    }
    quiet = {
        "print_time": False,
        "ipopt": {"print_level": 0, "sb": "yes", "hessian_approximation": "limited-memory"},
    }
    solver = ca.nlpsol("solver", "ipopt", problem, quiet)
    found = solver(
        x0=[1.5, 0.5, 0, 1.75], lbx=[0, -3, -30, 1.4], ubx=[5, 3, 30, 2.4],
        lbg=[0, 0, -ca.inf], ubg=[0, 0, -0.5],  # into the cup from above
    )  # fmt: skip
    if not solver.stats()["success"]:
        raise RuntimeError(solver.stats()["return_status"])
    x = np.array(found["x"]).ravel()
    run = stepper.simulate(
        t_end=x[3], dt=x[3] / STEPS, q0=[0, 1, 0], v0=x[:3], parameters={"e_N": 0.8},
        events="located",
    )  # fmt: skip
    return {"throw": x[:3], "time": x[3], "run": run}


if __name__ == "__main__":
    shot = solve()
    print(f"throw at {shot['throw'][:2]} m/s with spin {shot['throw'][2]:.2f} rad/s")
    for event in shot["run"].events:
        print(f"  {event.t:.3f} s: {event.kind}")
    print(f"in the cup at {shot['time']:.3f} s, {shot['run'].q[-1, :2]} m")
    shot["run"].animate("bounce_shot.html")
