"""Moreau's midpoint time-stepping as one nonlinear problem."""

import casadi as ca
from signorini.codegen.derive.magnitude import magnitude
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.program import (
    CALLER,
    COEFFICIENTS,
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
    point_of,
    restitution,
)
from signorini.codegen.schemes import Registered
from signorini.codegen.sharing import share, terms_of_place

_END_ROWS = ("g_dot", "gamma", "g_N_dot", "gamma_F")
_DIRECTIONS = ("W_g", "W_gamma", "W_N", "W_F")
_MIDDLE = Time(0.5)


def moreau_scheme(d: Derivation, stages: int, value: float) -> Scheme:
    """Return the scheme for the model behind `d`.

    Parameters
    ----------
    d : Derivation
        Derived functions of the model.
    stages : int
        Not used: the scheme has one point, the middle.
    value : float
        Not used: there is no option.

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
    memory = Memory()
    middle = AtMiddle(d, memory)
    n, h, W, P = d.data.n_q, middle.h, middle.W, middle.P
    r = middle.change - h * middle.known["force"]
    if middle.n_R:
        r = r - W @ P
    problem = Problem(
        "velocity",
        "Moreau's midpoint rule: v_{n+1}, P",
        n,
        1,
        0,
        False,
        ((1.0, 1.0),),
        (
            middle.evaluate_end(),
            Assembly(
                "velocity_values",
                (
                    dense("r", r, "(T5): p(v_{n+1}) - p(v_n) - h force - W P = 0"),
                    *middle.kinematics(),
                ),
            ),
        ),
        (middle.evaluate_end_jacobian(),),
        jacobian(
            "velocity_derivatives",
            middle.mass,
            -W,
            W.T,
            ca.SX(d["rho"].numel(), n),
            tuple(range(d.data.n_g + d.data.n_gamma)),
            ("K = [dp/dv_{n+1}, B; C, 0]", "B = -W, column by column", "C = W^T", ""),
        ),
    )
    place = middle.q_n + h / 2 * (middle.v_n + middle.v_end)
    return Scheme(
        name="moreau",
        title="Moreau, midpoint",
        memory=memory,
        stages=1,
        points=middle.points,
        places=middle.places,
        inertia=middle.inertia,
        terms=middle.terms,
        recalls=False,
        start=middle.start,
        problems=(problem,),
        finish=Assembly(
            "finish",
            (
                dense("q_end", place, "q_n + h/2 (v_n + v_{n+1})"),
                dense("v_end", middle.v_end, "v_{n+1}"),
                dense("P", P, "P"),
            ),
        ),
        record=middle.record,
        guarded=middle.guarded,
    )


class AtMiddle:
    """What schemes on velocity level share: momenta, directions and contact laws at (t_m, q_m).

    Attributes
    ----------
    points, places, inertia, terms, start, record, guarded
        Parts of the `Scheme`.
    h, q_n, v_n, v_end, P : SX
        Step size, state, unknown velocity and percussions.
    change : SX
        p(t_m, q_m, v_{n+1}) - p(t_m, q_m, v_n).
    mass, W : SX
        dp/dv_{n+1} and the directions.
    known : dict of SX
        What was found at the start: force, rho, ...
    """

    def __init__(self, d: Derivation, memory: Memory) -> None:
        data = d.data
        n = data.n_q
        self.n_R = data.n_g + data.n_gamma + data.n_N + data.n_F
        self.h = memory.number("h")
        values = point_of(
            d,
            "end",
            ("t", "q", "v", "par"),
            {name: d[name] for name in ("p", *_END_ROWS, *_DIRECTIONS)},
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
                "rho": d["rho"],
                **{name: d[name] for name, _ in COEFFICIENTS},
            },
        )
        self.terms, points = terms_of_place(memory, data, (values, mass, start_values))
        values, mass, opening = points
        end, end_jacobian = share(memory, values, mass)
        self._end, self._end_jacobian = end, end_jacobian
        self.points = (end, end_jacobian, opening)
        self.places = (
            ("end", "start", 0),
            ("end_jacobian", "start_jacobian", 0),
            ("end", "end", 0),
            ("end_jacobian", "end_jacobian", 0),
            ("opening", "opening", 0),
        )
        begin = {name: end.at(memory, Place("start"), name) for name in end.fields}
        self._finish = {name: end.at(memory, Place("end"), name) for name in end.fields}
        self.known = {name: opening.at(memory, Place("opening"), name) for name in opening.fields}
        self.W = ca.horzcat(*(self._finish[name] for name in _DIRECTIONS))
        self.mass = end_jacobian.at(memory, Place("end_jacobian"), "p_v")
        self.P = memory.column("R", self.n_R)
        self.v_end = memory.column("x", n)
        self.q_n, self.v_n = memory.column("q", n), memory.column("v", n)
        self.change = self._finish["p"] - begin["p"]
        self._xi_N, self._xi_F = restitution(
            d,
            ca.densify(begin["g_N_dot"]),
            ca.densify(begin["gamma_F"]),
            self.known["e_N"],
            self.known["e_F"],
        )
        self.inertia = inertia(
            end_jacobian.at(memory, Place("start_jacobian"), "p_v"),
            ca.horzcat(*(begin[name] for name in _DIRECTIONS)),
            ("M at (t_m, q_m)", "W^T at (t_m, q_m), row by row"),
        )
        self.guarded = tuple(c.presser is not None or c.guard is not None for c in data.contacts)
        self.start = self._start(opening, begin)
        self.record = Assembly(
            "stages",
            (
                dense("stage_t", memory.number("t") + self.h / 2, "t_m", CALLER),
                dense("stage_q", memory.column("Q", n), "q_m", CALLER),
                dense("stage_v", self.v_end, "v_{n+1}", CALLER),
                dense("stage_R", ca.vertcat(ca.SX(0, 1), self.P), "P", CALLER),
            ),
        )

    def _start(self, opening: Point, begin: dict[str, ca.SX]) -> tuple[Evaluate | Assembly, ...]:
        known = self.known
        at_start = (_MIDDLE, Ref("Q"), Ref("v"), Parameters())
        with_inputs = (_MIDDLE, Ref("Q"), Ref("v"), Ref("u"), Parameters(), Ref("h"))
        terms = Ref("terms")
        drift = [known[name] for name in ("chi_g", "chi_gamma", "chi_N", "chi_F")]
        middle = self.q_n + self.h / 2 * self.v_n
        return (
            Assembly("middle", (dense("Q", middle, "q_m = q_n + h/2 v_n"),)),
            Evaluate("terms", (_MIDDLE, Ref("Q"), Parameters()), terms),
            evaluate(self._end, at_start, Place("start"), terms),
            evaluate(self._end_jacobian, at_start, Place("start_jacobian"), terms, Place("start")),
            evaluate(opening, with_inputs, Place("opening"), terms),
            Assembly(
                "start_assembly",
                (
                    *self.inertia.targets,
                    dense("drift", ca.vertcat(ca.SX(0, 1), *drift), "chi at (t_m, q_m)"),
                    dense("force_size", known["force_size"], "size of the forces"),
                    dense("p", begin["p"], "p(t_m, q_m, v_n)"),
                    *(dense(name, known[name], what) for name, what in COEFFICIENTS),
                    dense("guard", known["guard"], "-g_N(t_m, q_m), and the guard if smaller"),
                    Target("no_R", self.n_R, (), True, "not used"),
                ),
            ),
        )

    def evaluate_end(self) -> Evaluate:
        """Momenta, directions and velocities of contacts with v_{n+1}."""
        at_end = (_MIDDLE, Ref("Q"), Ref("x"), Parameters())
        return evaluate(self._end, at_end, Place("end"), Ref("terms"))

    def evaluate_end_jacobian(self) -> Evaluate:
        """The mass matrix with v_{n+1}."""
        at_end = (_MIDDLE, Ref("Q"), Ref("x"), Parameters())
        into, at = Place("end_jacobian"), Place("end")
        return evaluate(self._end_jacobian, at_end, into, Ref("terms"), at)

    def kinematics(self) -> tuple[Target, Target]:
        """Rows of constraints and contacts, and radii, (T6)."""
        finish = self._finish
        y = ca.vertcat(
            finish["g_dot"],
            finish["gamma"],
            finish["g_N_dot"] + self._xi_N,
            finish["gamma_F"] + self._xi_F,
        )
        return (
            dense("y", y, "g_dot, gamma, xi_N, xi_F at the middle"),
            dense("radius", ca.densify(self.known["rho"]), "radii h bound"),
        )


def _closed(d: Derivation) -> ca.SX:
    """For every contact what must be >= 0 for it to act: -g_N, and its guard."""
    rows = []
    for c in d.data.contacts:
        presser = None if c.presser is None else d.data.contacts[c.presser]
        gap = None if presser is None or presser.one_way else presser.g_N
        closed = ca.SX(0) if gap is None else -gap
        rows.append(closed if c.guard is None else ca.fmin(closed, c.guard))
    return ca.vertcat(ca.SX(0, 1), *rows)


REGISTERED = Registered("moreau", moreau_scheme)
