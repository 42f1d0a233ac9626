"""Moreau's midpoint time-stepping as one nonlinear problem."""

import casadi as ca
from signorini.codegen.derive.magnitude import magnitude
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.program import (
    CALLER,
    Assembly,
    Evaluate,
    Memory,
    Parameters,
    Place,
    Point,
    Problem,
    Ref,
    Scheme,
    Target,
    Time,
    dense,
    evaluate,
    inertia,
    jacobian,
    restitution,
)
from signorini.codegen.sharing import share, terms_of_place

_END_ROWS = ("g_dot", "gamma", "g_N_dot", "gamma_F")
_DIRECTIONS = ("W_g", "W_gamma", "W_N", "W_F")
_MIDDLE = Time(0.5)


def moreau_scheme(d: Derivation, stages: int) -> Scheme:
    """Return the scheme for the model behind `d`.

    Parameters
    ----------
    d : Derivation
        Derived functions of the model.
    stages : int
        Not used: the scheme has one point, the middle.

    Notes
    -----
    J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988. With
    q_m = q_n + h/2 v_n and t_m = t_n + h/2::

        p(t_m, q_m, v_{n+1}) - p(t_m, q_m, v_n) = h (dL/dq + f - p_q v - p_t)(t_m, q_m, v_n) + W P
        g_dot = gamma = 0,  0 <= xi_N, P_N and the impact laws at (t_m, q_m) if g_N(t_m, q_m) <= 0
        q_{n+1} = q_n + h/2 (v_n + v_{n+1})

    (T5), (T6), (T7) of docs/theory.md. Constraints hold on velocity level only: position
    constraints drift, contacts penetrate.
    """
    data = d.data
    n, n_R = data.n_q, data.n_g + data.n_gamma + data.n_N + data.n_F
    memory = Memory()
    h = memory.number("h")
    values = Point(
        "end", ("t", "q", "v", "par"), {name: d[name] for name in ("p", *_END_ROWS, *_DIRECTIONS)}
    )
    mass = Point("end_jacobian", ("t", "q", "v", "par"), {"p_v": d["p_v"]})
    start_values = Point(
        "opening",
        ("t", "q", "v", "u", "par", "h"),
        {
            "force": d["force"],
            "force_size": magnitude(d["force"]) + d["bound_force"],
            "guard": _closed(d),
            **{name: d[name] for name in ("chi_g", "chi_gamma", "chi_N", "chi_F")},
            **{name: d[name] for name in ("rho", "mu", "e_N", "e_F")},
        },
    )
    terms, (values, mass, opening) = terms_of_place(memory, data, (values, mass, start_values))
    end, end_jacobian = share(memory, values, mass)
    begin = {name: end.at(memory, Place("start"), name) for name in end.fields}
    finish = {name: end.at(memory, Place("end"), name) for name in end.fields}
    known = {name: opening.at(memory, Place("opening"), name) for name in opening.fields}
    W = ca.horzcat(*(finish[name] for name in _DIRECTIONS))
    P = memory.column("lambda", n_R)
    v_end = memory.column("x", n)
    q_n, v_n = memory.column("q", n), memory.column("v", n)

    r = finish["p"] - begin["p"] - h * known["force"]
    if n_R:
        r = r - W @ P
    xi_N, xi_F = restitution(
        d,
        ca.densify(begin["g_N_dot"]),
        ca.densify(begin["gamma_F"]),
        known["e_N"],
        known["e_F"],
    )
    y = ca.vertcat(
        finish["g_dot"], finish["gamma"], finish["g_N_dot"] + xi_N, finish["gamma_F"] + xi_F
    )
    at_start = (_MIDDLE, Ref("Q"), Ref("v"), Parameters())
    at_end = (_MIDDLE, Ref("Q"), Ref("x"), Parameters())
    with_inputs = (_MIDDLE, Ref("Q"), Ref("v"), Ref("u"), Parameters(), Ref("h"))
    problem = Problem(
        "velocity",
        "Moreau's midpoint rule: v_{n+1}, P",
        n,
        1,
        0,
        False,
        ((1.0, 1.0),),
        (
            evaluate(end, at_end, Place("end"), Ref("terms")),
            Assembly(
                "velocity_values",
                (
                    dense("r", r, "(T5): p(v_{n+1}) - p(v_n) - h force - W P = 0"),
                    dense("y", y, "g_dot, gamma, xi_N, xi_F at the middle"),
                    dense("radius", ca.densify(known["rho"]), "radii h bound"),
                ),
            ),
        ),
        (evaluate(end_jacobian, at_end, Place("end_jacobian"), Ref("terms"), Place("end")),),
        jacobian(
            "velocity_derivatives",
            end_jacobian.at(memory, Place("end_jacobian"), "p_v"),
            -W,
            W.T,
            ca.SX(d["rho"].numel(), n),
            tuple(range(data.n_g + data.n_gamma)),
            ("K = [dp/dv_{n+1}, B; C, 0]", "B = -W, column by column", "C = W^T", ""),
        ),
    )
    masses = inertia(
        end_jacobian.at(memory, Place("start_jacobian"), "p_v"),
        ca.horzcat(*(begin[name] for name in _DIRECTIONS)),
        ("M at (t_m, q_m)", "W^T at (t_m, q_m), row by row"),
    )
    drift = [known[name] for name in ("chi_g", "chi_gamma", "chi_N", "chi_F")]
    start = (
        Assembly("middle", (dense("Q", q_n + h / 2 * v_n, "q_m = q_n + h/2 v_n"),)),
        Evaluate("terms", (_MIDDLE, Ref("Q"), Parameters()), Ref("terms")),
        evaluate(end, at_start, Place("start"), Ref("terms")),
        evaluate(end_jacobian, at_start, Place("start_jacobian"), Ref("terms"), Place("start")),
        evaluate(opening, with_inputs, Place("opening"), Ref("terms")),
        Assembly(
            "start_assembly",
            (
                *masses.targets,
                dense("drift", ca.vertcat(ca.SX(0, 1), *drift), "chi at (t_m, q_m)"),
                dense("force_size", known["force_size"], "size of the forces"),
                dense("p", begin["p"], "p(t_m, q_m, v_n)"),
                dense("mu", known["mu"], "friction coefficients"),
                dense("e_N", known["e_N"], "normal restitution"),
                dense("e_F", known["e_F"], "tangential restitution"),
                dense("guard", known["guard"], "-g_N(t_m, q_m), and the guard if smaller"),
                Target("no_R", n_R, (), True, "not used"),
            ),
        ),
    )
    return Scheme(
        name="moreau",
        title="Moreau, midpoint",
        memory=memory,
        stages=1,
        points=(end, end_jacobian, opening),
        places=(
            ("end", "start", 0),
            ("end_jacobian", "start_jacobian", 0),
            ("end", "end", 0),
            ("end_jacobian", "end_jacobian", 0),
            ("opening", "opening", 0),
        ),
        inertia=masses,
        terms=terms,
        recalls=False,
        start=start,
        problems=(problem,),
        finish=Assembly(
            "finish",
            (
                dense("q_end", q_n + h / 2 * (v_n + v_end), "q_n + h/2 (v_n + v_{n+1})"),
                dense("v_end", v_end, "v_{n+1}"),
                dense("P", P, "P"),
            ),
        ),
        record=Assembly(
            "stages",
            (
                dense("stage_t", memory.number("t") + h / 2, "t_m", CALLER),
                dense("stage_q", memory.column("Q", n), "q_m", CALLER),
                dense("stage_v", v_end, "v_{n+1}", CALLER),
                dense("stage_R", ca.vertcat(ca.SX(0, 1), P), "P", CALLER),
            ),
        ),
        guarded=tuple(c.g_N is not None or c.guard is not None for c in data.contacts),
    )


def _closed(d: Derivation) -> ca.SX:
    """For every contact what must be >= 0 for it to act: -g_N, and its guard."""
    rows = []
    for c in d.data.contacts:
        closed = ca.SX(0) if c.g_N is None else -c.g_N
        rows.append(closed if c.guard is None else ca.fmin(closed, c.guard))
    return ca.vertcat(ca.SX(0, 1), *rows)
