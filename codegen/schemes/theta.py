"""Moreau's scheme with forces by the theta-method (Jean): one nonlinear problem."""

import casadi as ca
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.program import (
    Assembly,
    Evaluate,
    Memory,
    Parameters,
    Place,
    Point,
    Problem,
    Ref,
    Scheme,
    Time,
    dense,
    evaluate,
    jacobian,
)
from signorini.codegen.schemes import Registered
from signorini.codegen.schemes.moreau import AtMiddle
from signorini.codegen.sharing import share


def theta_scheme(d: Derivation, stages: int, theta: float) -> Scheme:
    """Return the scheme for the model behind `d`.

    Parameters
    ----------
    d : Derivation
        Derived functions of the model.
    stages : int
        Not used: the scheme has one step.
    theta : float
        Weight of the forces at the end: 1/2 (second order without contact) to 1.

    Notes
    -----
    M. Jean, The non-smooth contact dynamics method, 1999. With q_m = q_n + h/2 v_n,
    t_m = t_n + h/2 and force = dL/dq + f - p_q v - p_t::

        p(t_m, q_m, v_{n+1}) - p(t_m, q_m, v_n)
            = h (theta force_{n+1} + (1 - theta) force_n) + W(t_m, q_m) P                  (T9)
        q_{n+1} = q_n + h (theta v_{n+1} + (1 - theta) v_n)                                (T10)

    Constraints and contact laws are those of Moreau's scheme, (T6).
    """
    data = d.data
    n = data.n_q
    memory = Memory()
    middle = AtMiddle(d, memory)
    h, W, P = middle.h, middle.W, middle.P
    v_end, v_n, q_n = middle.v_end, middle.v_n, middle.q_n
    arguments = ("t", "q", "v", "u", "par")
    force, force_jacobian = share(
        memory,
        Point("force", arguments, {"force": d["force"]}),
        Point("force_jacobian", arguments, {name: d[name] for name in ("force_q", "force_v")}),
    )
    begin, end = Place("force_start"), Place("force_end")
    forces = [force.at(memory, place, "force") for place in (begin, end)]
    r = middle.change - h * ((1 - theta) * forces[0] + theta * forces[1])
    if middle.n_R:
        r = r - W @ P
    place = q_n + h * (theta * v_end + (1 - theta) * v_n)
    slope = {
        name: force_jacobian.at(memory, Place("force_jacobian"), name)
        for name in ("force_q", "force_v")
    }
    A = middle.mass - h * theta * (slope["force_v"] + h * theta * slope["force_q"])
    at_end = (Time(1.0), Ref("q_end"), Ref("x"), Ref("u"), Parameters())
    at_start = (Time(0.0), Ref("q"), Ref("v"), Ref("u"), Parameters())
    problem = Problem(
        "velocity",
        "Moreau's scheme with the theta-method: v_{n+1}, P",
        n,
        1,
        0,
        False,
        ((1.0, 1.0),),
        (
            Assembly("end_place", (dense("q_end", place, "q_{n+1}  (T10)"),)),
            middle.evaluate_end(),
            evaluate(force, at_end, end),
            Assembly("velocity_values", (dense("r", r, "(T9)"), *middle.kinematics())),
        ),
        (
            middle.evaluate_end_jacobian(),
            evaluate(force_jacobian, at_end, Place("force_jacobian"), at=end),
        ),
        jacobian(
            "velocity_derivatives",
            ca.sparsify(A),
            -W,
            W.T,
            ca.SX(d["rho"].numel(), n),
            tuple(range(data.n_g + data.n_gamma)),
            ("K = [dr/dv_{n+1}, B; C, 0]", "B = -W, column by column", "C = W^T", ""),
        ),
    )
    name = "theta" if theta == _OPTION[0] else f"theta={theta!r}"
    return Scheme(
        name=name,
        title=f"Moreau, theta-method, theta = {theta:g}",
        memory=memory,
        stages=1,
        points=(*middle.points, force, force_jacobian),
        places=(
            *middle.places,
            ("force", "force_start", 0),
            ("force", "force_end", 0),
            ("force_jacobian", "force_jacobian", 0),
        ),
        inertia=middle.inertia,
        terms=middle.terms,
        recalls=False,
        start=(*middle.start, Evaluate("force", at_start, begin)),
        problems=(problem,),
        finish=Assembly(
            "finish",
            (
                dense("q_end", place, "q_{n+1}  (T10)"),
                dense("v_end", v_end, "v_{n+1}"),
                dense("P", P, "P"),
            ),
        ),
        record=middle.record,
        guarded=middle.guarded,
        stable_phase=_UNBOUNDED,
    )


_OPTION = (0.5, 0.5, 1.0)
_UNBOUNDED = 1e9  # no linear oscillation grows, however large the step
REGISTERED = Registered("theta", theta_scheme, option=_OPTION)
