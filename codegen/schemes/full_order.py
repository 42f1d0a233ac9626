"""Velocity constraints at full order: conditions on auxiliary velocities with IIIA weights."""

from dataclasses import replace

import casadi as ca
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.program import (
    CALLER,
    Assembly,
    Evaluate,
    Jacobian,
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
from signorini.codegen.schemes.lobatto import Lobatto, blocks, part
from signorini.codegen.sharing import share


def full_order_scheme(d: Derivation, stages: int, value: float) -> Scheme:
    """Return the scheme for a model without contacts.

    Parameters
    ----------
    d : Derivation
        Derived functions of the model.
    stages : int
        Number of stages s >= 2.
    value : float
        Not used: there is no option.

    Notes
    -----
    (51) tests gamma at the IIIB velocities V^i, whose stage order is low: order s - 1. Here
    auxiliary velocities U^i, i = 2 ... s, with U^s = v_{n+1}, solve::

        p(t^i, Q^i, U^i) = p_n + sum_j a_ij F^j,    gamma(t^i, Q^i, U^i) = 0    (T1), (T2)

    for R_gamma^2 ... R_gamma^s; R_gamma^1 / h is the force at t_n (T3), found at the start of
    every step from the equations of motion (T4). (T1) ... are the equations of docs/theory.md.
    R^s enters the U^i, so that all unknowns but that force stand in one problem. The order is
    2 s - 2. Nothing is carried from step to step: a force that is has a mode of its own, which
    grows wherever the constrained motion contracts.
    """
    return FullOrder(d, stages).scheme()


class FullOrder(Lobatto):
    """The problem with auxiliary velocities, and that of the accelerations before it."""

    def __init__(self, d: Derivation, s: int) -> None:
        super().__init__(d, s)
        self.auxiliary, self.auxiliary_jacobian = share(self.memory, *self.others)
        rates = ("g_rate", "gamma_rate")
        self.forces = Point(
            "forces", ("t", "q", "v", "u", "par"), {name: d[name] for name in ("force", *rates)}
        )

    def place(self) -> None:
        """Problem 0: accelerations and forces at t_n, times h; problem 1: V, U and R."""
        self.place_at(self.n, self.n_R)
        self.start_percussion = self.memory.column("R", self.d.data.n_gamma, self.d.data.n_g)

    def place_at(self, x: int, R: int) -> None:
        """Unknowns of the problem with auxiliary velocities, from these entries on."""
        s, n, memory = self.s, self.n, self.memory
        self.n_g, self.n_gamma = self.d.data.n_g, self.d.data.n_gamma
        self.first_x = x
        self.x = memory.column("x", s * n, x)
        self.U = memory.column("x", (s - 1) * n, x + s * n)
        self.v_end = self.U[(s - 2) * n :]
        self.percussions = memory.column("R", s * self.n_R, R)

    def points(self) -> list[Point]:
        """The same, and what is evaluated at the auxiliary velocities."""
        arguments = ("t", "q", "v", "par")
        derivatives = ("p_q", "p_v", "gamma_q", "gamma_v", "g_dot_q", "g_dot_v")
        return [
            *super().points(),
            self.point("auxiliary", arguments, ("p", "gamma", "g_dot")),
            self.point("auxiliary_jacobian", arguments, derivatives),
        ]

    # --- percussions of the stages ---------------------------------------------------------------

    def R_g(self, i: int) -> ca.SX:
        """R_g^{i+1}: slot i."""
        return part(self.percussions, i * self.n_R, self.n_g)

    def R_gamma(self, i: int) -> ca.SX:
        """R_gamma^{i+1}: that of problem 0 for the first stage, slot i - 1 for the others."""
        if i == 0:
            return self.start_percussion
        first = (i - 1) * self.n_R + self.n_g
        return part(self.percussions, first, self.n_gamma)

    def stage_percussions(self) -> Assembly:
        rows = [x for i in range(self.s) for x in (self.R_g(i), self.R_gamma(i))]
        return Assembly(
            "stage_percussions",
            (
                dense(
                    "R_stage", ca.vertcat(*rows), "R_g^i, R_gamma^i; R_gamma^1 = h lambda_n  (T3)"
                ),
            ),
        )

    def percussions_of(self, i: int) -> Ref:
        return Ref("R_stage", i * self.n_R)

    def auxiliary_calls(self, point: Point) -> tuple[Evaluate, ...]:
        calls = []
        for i in range(1, self.s):
            q, v = Ref("Q", i * self.n), Ref("x", self.first_x + self.n * (self.s - 1 + i))
            calls.append(
                evaluate(
                    point,
                    (self.time(i), q, v, Parameters()),
                    Place(point.name, i - 1),
                    self.terms_at(i),
                    Place("auxiliary", i - 1),
                )
            )
        return tuple(calls)

    def aux(self, i: int, name: str) -> ca.SX:
        """A function at the auxiliary velocity of stage i, counted from 0."""
        if name in self.auxiliary.fields:
            return self.auxiliary.at(self.memory, Place("auxiliary", i - 1), name)
        return self.auxiliary_jacobian.at(self.memory, Place("auxiliary_jacobian", i - 1), name)

    # --- the scheme ------------------------------------------------------------------------------

    def scheme(self) -> Scheme:
        """Both problems, and what stands around them."""
        paper = super().scheme()
        return replace(
            paper,
            title=f"{paper.title}, velocity constraints at full order",
            adaptive=True,
            points=(
                *(self.stage, self.stage_jacobian, self.end, self.end_jacobian, self.opening),
                *(self.auxiliary, self.auxiliary_jacobian, self.forces),
            ),
            places=(
                ("stage", "stage", self.s),
                ("stage_jacobian", "stage_jacobian", self.s),
                ("auxiliary", "auxiliary", self.s - 1),
                ("auxiliary_jacobian", "auxiliary_jacobian", self.s - 1),
                ("end", "start", 0),
                ("end_jacobian", "start_jacobian", 0),
                ("opening", "opening", 0),
                ("forces", "forces", 0),
            ),
        )

    def start(self) -> tuple[Evaluate | Assembly, ...]:
        """What is known at the start of a step, forces too."""
        at_start = (Time(0.0), Ref("q"), Ref("v"), Ref("u"), Parameters())
        return (*super().start(), Evaluate("forces", at_start, Place("forces")))

    def problems(self) -> tuple[Problem, ...]:
        """Accelerations and constraint forces at t_n, then the whole step."""
        opening = Problem(
            "start",
            "accelerations and constraint forces at t_n, times h",
            self.n,
            1,
            0,
            False,
            ((1.0, 1.0),),
            (self.opening_values(),),
            (),
            self.opening_derivatives(),
        )
        return opening, self.whole("whole")

    def whole(self, name: str) -> Problem:
        """The problem with auxiliary velocities."""
        s, n = self.s, self.n
        a_a_hat = self.tableau.a_a_hat
        response = [
            (float(abs(a_a_hat[i][i - 1])), float(self.tableau.a[i][i])) for i in range(1, s)
        ]
        last = float(self.tableau.b[s - 1])
        return Problem(
            name,
            "(47b), (47d), (47f), (48), (T1), (T2)",
            (2 * s - 1) * n,
            s,
            s - 1,
            False,
            (*response, (last, last)),
            (
                self.stage_points(),
                self.stage_percussions(),
                *self.terms_calls(),
                *self.stage_calls(self.stage),
                *self.auxiliary_calls(self.auxiliary),
                self.whole_values(),
            ),
            (
                *self.stage_calls(self.stage_jacobian),
                *self.auxiliary_calls(self.auxiliary_jacobian),
            ),
            self.whole_derivatives(),
            last_rows=self.n_g,
        )

    def _start_directions(self) -> ca.SX:
        memory, e = self.memory, Place("start")
        return ca.horzcat(self.end.at(memory, e, "W_g"), self.end.at(memory, e, "W_gamma"))

    def opening_values(self) -> Assembly:
        M = self.end_jacobian.at(self.memory, Place("start_jacobian"), "p_v")
        W = self._start_directions()
        dv, P = self.memory.column("x", self.n), self.memory.column("R", self.n_R)
        forces = {n: self.forces.at(self.memory, Place("forces"), n) for n in self.forces.fields}
        rate = ca.vertcat(forces["g_rate"], forces["gamma_rate"])
        r = M @ dv - self.h * forces["force"] - W @ P
        y = W.T @ dv + self.h * rate
        return Assembly(
            "opening_values",
            (
                dense("r", r, "h (M dv/dt - force - W lambda) = 0 at t_n  (T4)"),
                dense("y", y, "h d(g_dot)/dt, h d(gamma)/dt at t_n"),
            ),
        )

    def opening_derivatives(self) -> Jacobian:
        M = self.end_jacobian.at(self.memory, Place("start_jacobian"), "p_v")
        W = self._start_directions()
        return jacobian(
            "opening_derivatives",
            M,
            -W,
            W.T,
            ca.SX(0, self.n),
            tuple(range(self.n_b)),
            ("K = [M, B; C, 0]", "B = -W, column by column", "C = W^T", ""),
        )

    def whole_values(self) -> Assembly:
        s = self.s
        r = self.stage_momenta()
        for i in range(1, s):
            r_i = self.aux(i, "p") - self.p_n
            for j in range(s):
                r_i = r_i - self.a(i, j) * self.at(j, "F")
            r.append(r_i)
        y = []
        for i in range(1, s):
            y += [ca.densify(self.at(i, "g")), ca.densify(self.aux(i, "gamma"))]
        y += [ca.densify(self.aux(s - 1, "g_dot")), ca.SX.zeros(self.n_gamma, 1)]
        return Assembly(
            "whole_values",
            (
                dense(
                    "r",
                    ca.vertcat(*r),
                    "(47b); (T1) p(U^i) - p_n - sum_j a_ij F^j = 0, the last (47d)",
                ),
                dense("y", ca.vertcat(*y), "g(Q^i), gamma(U^i)  (T2); g_dot at the end"),
            ),
        )

    def whole_A(self) -> ca.SX:
        """Derivative of all rows by V and U."""
        s, n = self.s, self.n
        none = ca.SX(n, n)
        A = [[self._A_block(i, k) for k in range(s)] + [none] * (s - 1) for i in range(s)]
        for i in range(1, s):
            row = []
            for k in range(s):
                block = self.h * self.a(i, k) * self.aux(i, "p_q")
                for j in range(s):
                    block = block - self.a(i, j) * self.F_V(j, k)
                row.append(ca.sparsify(block))
            A.append([*row, *(self.aux(i, "p_v") if k == i else none for k in range(1, s))])
        return blocks(A)

    def whole_derivatives(self) -> Jacobian:
        s, n, n_g, n_gamma = self.s, self.n, self.n_g, self.n_gamma

        def weights(i: int, j: int) -> float:
            """Weight of F^j in row i: IIIB for V, then IIIA for U."""
            return self.a_hat(i, j) if i < s else self.a(i - s + 1, j)

        B = []
        for i in range(2 * s - 1):
            columns = []
            for slot in range(s):
                W_g = self.at(slot, "g_q").T
                columns.append(-weights(i, slot) * W_g)
                if slot < s - 1:
                    columns.append(-weights(i, slot + 1) * self.at(slot + 1, "gamma_v").T)
                else:
                    columns.append(ca.SX(n, n_gamma))
            B.append([ca.sparsify(c) for c in columns])
        C = []
        for i in range(1, s):
            ha = [self.h * self.a(i, k) for k in range(s)]
            g = [x * self.at(i, "g_q") for x in ha]
            gamma = [x * self.aux(i, "gamma_q") for x in ha]
            own = [self.aux(i, "gamma_v") if k == i else ca.SX(n_gamma, n) for k in range(1, s)]
            C.append([*(ca.sparsify(x) for x in g), *([ca.SX(n_g, n)] * (s - 1))])
            C.append([*(ca.sparsify(x) for x in gamma), *own])
        end = [self.h * self.a(s - 1, k) * self.aux(s - 1, "g_dot_q") for k in range(s)]
        last = [self.aux(s - 1, "g_dot_v") if k == s - 1 else ca.SX(n_g, n) for k in range(1, s)]
        C.append([*(ca.sparsify(x) for x in end), *last])
        C.append([ca.SX(n_gamma, n)] * (2 * s - 1))
        return jacobian(
            "whole_derivatives",
            self.whole_A(),
            blocks(B),
            blocks(C),
            ca.SX(0, (2 * s - 1) * n),
            (
                *(i * self.n_R + c for i in range(s - 1) for c in range(self.n_b)),
                *((s - 1) * self.n_R + c for c in range(n_g)),
            ),
            ("K = [dr/d(V, U), B; C, 0]", "B = dr/dR, column by column", "C = dy/d(V, U)", ""),
        )

    def finish(self) -> Assembly:
        s = self.s
        Q = self.memory.column("Q", self.n, (s - 1) * self.n)
        P_g, P_gamma = ca.SX.zeros(self.n_g, 1), ca.SX.zeros(self.n_gamma, 1)
        for j in range(s):
            P_g += self.b(j) * self.R_g(j)
            P_gamma += self.b(j) * self.R_gamma(j)
        return Assembly(
            "finish",
            (
                dense("q_end", Q, "q_{n+1} = Q^s"),
                dense("v_end", self.v_end, "v_{n+1} = U^s"),
                dense("P", ca.vertcat(P_g, P_gamma), "Delta P = sum_j b_j R^j"),
            ),
        )

    def record(self) -> Assembly:
        t = [self.memory.number("t") + float(c) * self.h for c in self.tableau.c]
        return Assembly(
            "stages",
            (
                dense("stage_t", ca.vertcat(*t), "t^i = t_n + c_i h", CALLER),
                dense("stage_q", self.memory.column("Q", self.s * self.n), "Q^i", CALLER),
                dense("stage_v", self.x, "V^i", CALLER),
                dense("stage_R", self.memory.column("R_stage", self.s * self.n_R), "R^i", CALLER),
            ),
        )


def _unfit(data: ModelData) -> str:
    """Why a model cannot have this form."""
    if data.contacts:
        return "it has contacts, and their impacts need events='located', which has this form"
    if data.compliances:
        return f"'{data.compliances[0].name}' is compliant"
    return "" if data.n_gamma else "it has no velocity constraints"


REGISTERED = Registered("lobatto", full_order_scheme, form="full_order", unfit=_unfit)
