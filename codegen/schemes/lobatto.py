"""The s-stage Lobatto IIIA-IIIB scheme as two nonlinear problems, position then velocity."""

import casadi as ca
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.program import (
    CALLER,
    COEFFICIENTS,
    STATE,
    Assembly,
    Evaluate,
    Jacobian,
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
from signorini.codegen.schemes.tableau import first_instability, lobatto
from signorini.codegen.sharing import share, terms_of_place

_STAGE_ROWS = ("g", "gamma", "g_N", "gamma_F")
_END_ROWS = ("g_dot", "gamma", "g_N_dot", "gamma_F")
_DIRECTIONS = ("W_g", "W_gamma", "W_N", "W_F")


def lobatto_scheme(d: Derivation, stages: int, value: float) -> Scheme:
    """Return the scheme for the model behind `d`.

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
    The column s of the IIIB tableau is zero, so the percussions R^s never enter V or q_{n+1}:
    first (V^1 ... V^s, R^1 ... R^{s-1}) are found from (47b), (47f), (51), (52), (57), then
    (v_{n+1}, Delta P) from (47d), (48), (51), (56), (58).
    """
    return Lobatto(d, stages).scheme()


class Lobatto:
    def __init__(self, d: Derivation, s: int) -> None:
        self.d = d
        self.s = s
        self.tableau = lobatto(s)
        self.memory = Memory()
        data = d.data
        self.n = data.n_q
        self.n_b = data.n_g + data.n_gamma
        self.n_R = self.n_b + data.n_N + data.n_F
        self.terms, points = terms_of_place(self.memory, data, self.points())
        stage, stage_jacobian, end, end_jacobian, self.opening, *self.others = points
        self.stage, self.stage_jacobian = share(self.memory, stage, stage_jacobian)
        self.end, self.end_jacobian = share(self.memory, end, end_jacobian)
        self.h = self.memory.number("h")
        self.place()
        self.p_n = self.end.at(self.memory, Place("start"), "p")
        self.inertia = inertia(
            self.end_jacobian.at(self.memory, Place("start_jacobian"), "p_v"),
            ca.horzcat(*(self.end.at(self.memory, Place("start"), name) for name in _DIRECTIONS)),
            ("M = dp/dv at t_n", "W^T at t_n, row by row"),
        )

    def place(self) -> None:
        """Unknowns of the two problems: V^1 ... V^s, v_{n+1} and R^1 ... R^{s-1}, Delta P."""
        s, n, memory = self.s, self.n, self.memory
        self.first_x = 0
        self.percussions = memory.column("R", (s - 1) * self.n_R)
        self.delta_P = memory.column("R", self.n_R, (s - 1) * self.n_R)
        self.x = memory.column("x", s * n)
        self.v_end = memory.column("x", n, s * n)

    def points(self) -> list[Point]:
        """What is evaluated at the stages, at the end and at the start."""
        at_stage = ("t", "q", "v", "u", "par", "h", "R")
        jacobian_of_stage = (
            *("p_q", "p_v", "F_q", "F_v", "g_q", "gamma_q", "gamma_v"),
            *("g_N_q", "gamma_F_q", "gamma_F_v", "rho_q"),
            *(("g_N_v", "W_N") if self.d.one_way else ()),
            *(("rho_v",) if self.d.varying else ()),
        )
        at_start = (
            *("force_size", "chi_g", "chi_gamma", "chi_N", "chi_F"),
            *("guard", *(name for name, _ in COEFFICIENTS)),
            *(("compliance", "relaxation", "slack") if self.d.data.compliances else ()),
        )
        return [
            self.point("stage", at_stage, ("p", "F", *_STAGE_ROWS, "rho")),
            self.point("stage_jacobian", at_stage, jacobian_of_stage),
            self.point("end", ("t", "q", "v", "par"), ("p", *_END_ROWS, *_DIRECTIONS)),
            self.point("end_jacobian", ("t", "q", "v", "par"), ("p_v",)),
            self.point("opening", ("t", "q", "v", "u", "par"), at_start),
        ]

    # --- helpers ---------------------------------------------------------------------------------

    def point(self, name: str, arguments: tuple[str, ...], fields: tuple[str, ...]) -> Point:
        return point_of(self.d, name, arguments, {field: self.d[field] for field in fields})

    def a(self, i: int, j: int) -> float:
        return float(self.tableau.a[i][j])

    def a_hat(self, i: int, j: int) -> float:
        return float(self.tableau.a_hat[i][j])

    def b(self, j: int) -> float:
        return float(self.tableau.b[j])

    def at(self, i: int, name: str) -> ca.SX:
        if name in self.stage.fields:
            return self.stage.at(self.memory, Place("stage", i), name)
        return self.stage_jacobian.at(self.memory, Place("stage_jacobian", i), name)

    def R(self, i: int) -> ca.SX:
        return self.percussions[i * self.n_R : (i + 1) * self.n_R]

    def percussions_of(self, i: int) -> Ref:
        """The percussions of a stage; those of the last never enter the stages."""
        return Ref("R", i * self.n_R) if i < self.s - 1 else Ref("no_R")

    def stage_momenta(self) -> list[ca.SX]:
        """Rows (47b), stage by stage."""
        rows = []
        for i in range(self.s):
            r_i = self.at(i, "p") - self.p_n
            for j in range(self.s - 1):
                r_i = r_i - self.a_hat(i, j) * self.at(j, "F")
            rows.append(r_i)
        return rows

    def stage_calls(self, point: Point) -> tuple[Evaluate, ...]:
        calls = []
        for i in range(self.s):
            R = self.percussions_of(i)
            q, v = Ref("Q", i * self.n), Ref("x", self.first_x + i * self.n)
            arguments = (self.time(i), q, v, Ref("u"), Parameters(), Ref("h"), R)
            place = Place(point.name, i)
            calls.append(evaluate(point, arguments, place, self.terms_at(i), Place("stage", i)))
        return tuple(calls)

    def time(self, i: int) -> Time:
        """t^i of a stage, counted from 0."""
        return Time(float(self.tableau.c[i]))

    def terms_at(self, i: int) -> Ref:
        """The terms of the place of a stage, counted from 0."""
        first = Ref("terms", owner=STATE)  # where the step before left them
        return Ref("terms", (i - 1) * self.terms.values.numel()) if i else first

    def terms_calls(self) -> tuple[Evaluate, ...]:
        """Those of the first stage are known: q_n does not change."""
        return tuple(
            Evaluate(
                "terms",
                (self.time(i), Ref("Q", i * self.n), Parameters()),
                self.terms_at(i),
            )
            for i in range(1, self.s)
        )

    def end_call(self, point: Point) -> Evaluate:
        q, v = Ref("Q", (self.s - 1) * self.n), Ref("x", self.s * self.n)
        arguments = (Time(1.0), q, v, Parameters())
        return evaluate(
            point, arguments, Place(point.name), self.terms_at(self.s - 1), Place("end")
        )

    # --- the scheme ------------------------------------------------------------------------------

    def scheme(self) -> Scheme:
        """Both problems, and what stands around them."""
        return Scheme(
            name="lobatto",
            title=f"Lobatto IIIA-IIIB, {self.s} stages",
            memory=self.memory,
            stages=self.s,
            points=(self.stage, self.stage_jacobian, self.end, self.end_jacobian, self.opening),
            places=(
                ("stage", "stage", self.s),
                ("stage_jacobian", "stage_jacobian", self.s),
                ("end", "start", 0),
                ("end_jacobian", "start_jacobian", 0),
                ("end", "end", 0),
                ("end_jacobian", "end_jacobian", 0),
                ("opening", "opening", 0),
            ),
            inertia=self.inertia,
            terms=self.terms,
            recalls=True,
            start=self.start(),
            problems=self.problems(),
            finish=self.finish(),
            record=self.record(),
            coefficients=self.tableau.arrays(),
            stable_phase=first_instability(self.s),
            adaptive=not (self.d.data.contacts or self.d.data.n_gamma or self.d.data.compliances),
        )

    def problems(self) -> tuple[Problem, ...]:
        """The position problem, then the velocity problem."""
        t = self.tableau
        a_a_hat = t.a_a_hat
        response = tuple(
            (float(abs(a_a_hat[i][i - 1])), float(abs(t.a_hat[i][i - 1]))) for i in range(1, self.s)
        )
        position = Problem(
            "position",
            "(47b), (47f), (51), (52), (57): V^1 ... V^s, R^1 ... R^{s-1}",
            self.s * self.n,
            self.s - 1,
            self.s - 1,
            False,
            response,
            (
                self.stage_points(),
                *self.terms_calls(),
                *self.stage_calls(self.stage),
                self.position_values(),
            ),
            self.stage_calls(self.stage_jacobian),
            self.position_derivatives(),
        )
        velocity = Problem(
            "velocity",
            "(47d), (48), (51), (56), (58): v_{n+1}, Delta P",
            self.n,
            1,
            0,
            True,
            ((1.0, 1.0),),
            (self.end_call(self.end), self.velocity_values()),
            (self.end_call(self.end_jacobian),),
            self.velocity_derivatives(),
        )
        return position, velocity

    def start(self) -> tuple[Evaluate | Assembly, ...]:
        """What is known at the start of a step."""
        at_start = (Time(0.0), Ref("q"), Ref("v"), Parameters())
        terms = self.terms_at(0)
        with_inputs = (Time(0.0), Ref("q"), Ref("v"), Ref("u"), Parameters())
        return (
            evaluate(self.end, at_start, Place("start"), terms),
            evaluate(self.end_jacobian, at_start, Place("start_jacobian"), terms, Place("start")),
            evaluate(self.opening, with_inputs, Place("opening"), terms),
            self.start_assembly(),
        )

    def start_assembly(self) -> Assembly:
        memory, o = self.memory, Place("opening")
        opening = {name: self.opening.at(memory, o, name) for name in self.opening.fields}
        chi = [opening[name] for name in ("chi_g", "chi_gamma", "chi_N", "chi_F")]
        return Assembly(
            "start_assembly",
            (
                *self.inertia.targets,
                dense("drift", ca.vertcat(ca.SX(0, 1), *chi), "chi at t_n"),
                dense("force_size", opening["force_size"], "size of dL/dq and f at t_n"),
                dense("p", self.p_n, "p(t_n, q_n, v_n)"),
                *(dense(name, opening[name], what) for name, what in COEFFICIENTS),
                dense("guard", opening["guard"], "guards at (t_n, q_n)"),
                *self.compliance(),
                Target("no_R", self.n_R, (), True, "no percussions at the last stage"),
            ),
        )

    # --- rows that yield: 0 <= y = g + tau dg/dt + c force, docs/theory.md ------------------------

    def _yielding(self) -> list[tuple[int, int, ca.SX, ca.SX]]:
        """Row among the percussions, row of g or g_N, c / h and tau of all that yield."""
        d = self.d.data
        rows = d.compliances
        c, tau = (
            ca.densify(self.opening.at(self.memory, Place("opening"), name)) if rows else ca.SX(0)
            for name in ("compliance", "relaxation")
        )
        return [
            (y.row, y.row - (self.n_b if y.normal else 0), c[k] / self.h, tau[k])
            for k, y in enumerate(rows)
        ]

    def _slack(self, row: int) -> str:
        return "g" if row < self.n_b else "g_N"

    def own(self, i: int) -> dict[int, ca.SX]:
        """dy/dR of the rows that yield, at stage i or, for i = s, at the end."""
        h = self.h
        if i == self.s:
            return {row: c / (tau + h / 2) for row, _, c, tau in self._yielding()}
        backward = h * float(self.tableau.c[i])
        return {row: c / (1 + tau / backward) for row, _, c, tau in self._yielding()}

    def compliance(self) -> tuple[Target, ...]:
        """dy/dR row by row, of both problems."""
        if not self.d.data.compliances:
            return ()
        rows, size = ca.SX.zeros(self.s * self.n_R, 1), ca.SX.zeros(self.n_R, 1)
        signs = {row: ca.fmin(c, tau) < 0 for row, _, c, tau in self._yielding()}
        for i in range(1, self.s + 1):
            for row, value in self.own(i).items():
                rows[(i - 1) * self.n_R + row] = ca.if_else(signs[row], -1, value)
        slack = ca.densify(self.opening.at(self.memory, Place("opening"), "slack"))
        for k, c in enumerate(self.d.data.compliances):
            size[c.row] = ca.fabs(slack[k])
        return (
            dense("compliance", rows, "dy/dR of the rows that yield, < 0: refused  (T20), (T21)"),
            dense("slack", size, "|g|, |g_N| of the rows that yield at t_n"),
        )

    def _yield_at(self, i: int, y: dict[str, ca.SX]) -> None:
        """y = g(Q^i) + (c R^{i-1} / h - tau g^- / (c_i h)) / (1 + tau / (c_i h))  (T20): the rate
        is that since t_n, of a gap that since it closed."""
        own = self.own(i)
        backward = self.h * float(self.tableau.c[i])
        for row, place, _, tau in self._yielding():
            before = ca.densify(self.at(0, self._slack(row)))[place]
            if row >= self.n_b:
                before = ca.fmin(before, 0)
            y[self._slack(row)][place] += own[row] * self.R(i - 1)[row]
            y[self._slack(row)][place] -= tau / (backward + tau) * before

    def _yield_in_the_end(self, g_dot: ca.SX, g_N_dot: ca.SX) -> None:
        """y = g_dot + (g(q_{n+1}) + c Delta P / h) / (tau + h / 2)  (T21)."""
        own = self.own(self.s)
        for row, place, _, tau in self._yielding():
            rate = g_N_dot if row >= self.n_b else g_dot
            slack = ca.densify(self.at(self.s - 1, self._slack(row)))[place]
            if row >= self.n_b:
                slack = ca.fmin(slack, 0)  # what has opened again keeps no velocity of approach
            rate[place] += slack / (tau + self.h / 2) + own[row] * self.delta_P[row]

    def stage_points(self) -> Assembly:
        """Q^i = q_n + h sum_j a_ij V^j  (47a)."""
        q_n = self.memory.column("q", self.n)
        Q = []
        for i in range(self.s):
            rate = ca.SX.zeros(self.n, 1)
            for j in range(self.s):
                if self.a(i, j):
                    rate += self.a(i, j) * self.x[j * self.n : (j + 1) * self.n]
            Q.append(q_n + self.h * rate)
        return Assembly(
            "stage_points", (dense("Q", ca.vertcat(*Q), "Q^i = q_n + h sum_j a_ij V^j  (47a)"),)
        )

    def position_values(self) -> Assembly:
        s = self.s
        r = self.stage_momenta()
        y: list[ca.SX] = []
        radius: list[ca.SX] = []
        for i in range(1, s):
            rows = {name: ca.densify(self.at(i, name)) for name in _STAGE_ROWS}
            self._yield_at(i, rows)
            y += rows.values()
            radius.append(ca.densify(self.at(i - 1, "rho")))
        return Assembly(
            "position_values",
            (
                dense("r", ca.vertcat(*r), "p^i - p_n - sum_j a_hat_ij F^j = 0  (47b)"),
                dense(
                    "y",
                    ca.vertcat(ca.SX(0, 1), *y),
                    "g, gamma, g_N, gamma_F at the stages 2 ... s",
                ),
                dense(
                    "radius",
                    ca.vertcat(ca.SX(0, 1), *radius),
                    "radii h bound of friction elements",
                ),
            ),
        )

    def F_V(self, j: int, k: int) -> ca.SX:
        """dF^j / dV^k."""
        value = self.h * self.a(j, k) * self.at(j, "F_q")
        return value + self.at(j, "F_v") if j == k else value

    def position_derivatives(self) -> Jacobian:
        s, n = self.s, self.n
        A = [[self._A_block(i, k) for k in range(s)] for i in range(s)]
        W = [
            ca.horzcat(
                self.at(j, "g_q").T,
                self.at(j, "gamma_v").T,
                self.at(j, "W_N") if self.d.one_way else self.at(j, "g_N_q").T,
                self.at(j, "gamma_F_v").T,
            )
            for j in range(s - 1)
        ]
        B = [[-self.a_hat(i, j) * W[j] for j in range(s - 1)] for i in range(s)]
        C, C_radius = [], []
        for i in range(1, s):
            C.append([self._kinematic_block(i, k) for k in range(s)])
            C_radius.append([self._radius_block(i - 1, k) for k in range(s)])
        n_bounds = self.d["rho"].numel()
        return jacobian(
            "position_derivatives",
            blocks(A),
            blocks(B),
            blocks(C),
            blocks(C_radius) if n_bounds else ca.SX(0, s * n),
            tuple(i * self.n_R + c for i in range(s - 1) for c in range(self.n_b)),
            ("K = [dr/dV, B; C, 0]", "B = dr/dR, column by column", "C = dy/dV", "d(radius)/dV"),
            {
                (i - 1) * self.n_R + row: value
                for i in range(1, s)
                for row, value in self.own(i).items()
            },
        )

    def _A_block(self, i: int, k: int) -> ca.SX:
        block = self.h * self.a(i, k) * self.at(i, "p_q")
        if i == k:
            block = block + self.at(i, "p_v")
        for j in range(self.s - 1):
            block = block - self.a_hat(i, j) * self.F_V(j, k)
        return ca.sparsify(block)

    def _radius_block(self, i: int, k: int) -> ca.SX:
        """Derivative of the radii of stage i by V^k."""
        block = self.h * self.a(i, k) * self.at(i, "rho_q")
        return block + self.at(i, "rho_v") if self.d.varying and i == k else block

    def _kinematic_block(self, i: int, k: int) -> ca.SX:
        ha = self.h * self.a(i, k)
        gamma = ha * self.at(i, "gamma_q")
        gamma_F = ha * self.at(i, "gamma_F_q")
        g_N = ha * self.at(i, "g_N_q")
        if i == k:
            gamma = gamma + self.at(i, "gamma_v")
            gamma_F = gamma_F + self.at(i, "gamma_F_v")
            if self.d.one_way:
                g_N = g_N + self.at(i, "g_N_v")
        return ca.sparsify(ca.vertcat(ha * self.at(i, "g_q"), gamma, g_N, gamma_F))

    def velocity_values(self) -> Assembly:
        s, d = self.s, self.d
        end = {name: self.end.at(self.memory, Place("end"), name) for name in self.end.fields}
        W = ca.horzcat(*(end[name] for name in _DIRECTIONS))
        r = end["p"] - self.p_n
        last = self.delta_P
        for j in range(s - 1):
            r = r - self.b(j) * self.at(j, "F")
            last = last - self.b(j) * self.R(j)
        # b_s F^s with b_s R^s = Delta P - sum_{j<s} b_j R^j; F^s was evaluated without R^s.
        r = r - self.b(s - 1) * self.at(s - 1, "F")
        if self.n_R:
            r = r - W @ last
        xi_N, xi_F = self._restitution()
        g_dot, g_N_dot = ca.densify(end["g_dot"]), ca.densify(end["g_N_dot"] + xi_N)
        self._yield_in_the_end(g_dot, g_N_dot)
        y = ca.vertcat(g_dot, end["gamma"], g_N_dot, end["gamma_F"] + xi_F)
        radius = ca.SX.zeros(d["rho"].numel(), 1)
        for j in range(s):
            radius += self.b(j) * ca.densify(self.at(j, "rho"))
        for _, place, normal in d.varying:
            # mu^s (Delta P_N - sum_j b_j R_N^j) + sum_j b_j mu^j R_N^j
            last_mu = ca.densify(self.at(s - 1, "rho"))[place]
            radius[place], radius[place + 1] = last_mu, 0
            for j in range(s - 1):
                share = ca.densify(self.at(j, "rho"))[place] - last_mu
                radius[place + 1] += self.b(j) * share * self.R(j)[self.n_b + normal]
        return Assembly(
            "velocity_values",
            (
                dense("r", r, "p_{n+1} - p_n - sum_j b_j F^j = 0  (47d)"),
                dense(
                    "y",
                    y,
                    "g_dot, gamma, xi_N = g_N_dot + e_N g_N_dot(t_n), xi_F likewise  (68)",
                ),
                dense("radius", radius, "radii sum_j b_j h bound^j of friction elements"),
            ),
        )

    def _restitution(self) -> tuple[ca.SX, ca.SX]:
        """e_N g_N_dot and e_F gamma_F at the start of the step."""
        return restitution(
            self.d,
            ca.densify(self.end.at(self.memory, Place("start"), "g_N_dot")),
            ca.densify(self.end.at(self.memory, Place("start"), "gamma_F")),
            self.opening.at(self.memory, Place("opening"), "e_N"),
            self.opening.at(self.memory, Place("opening"), "e_F"),
        )

    def velocity_derivatives(self) -> Jacobian:
        W = ca.horzcat(*(self.end.at(self.memory, Place("end"), name) for name in _DIRECTIONS))
        n_bounds = self.d["rho"].numel()
        return jacobian(
            "velocity_derivatives",
            self.end_jacobian.at(self.memory, Place("end_jacobian"), "p_v"),
            -W,
            W.T,
            ca.SX(n_bounds, self.n),
            tuple(range(self.n_b)),
            ("K = [dp_{n+1}/dv_{n+1}, B; C, 0]", "B = -W, column by column", "C = W^T", ""),
            self.own(self.s),
        )

    def finish(self) -> Assembly:
        Q = self.memory.column("Q", self.n, (self.s - 1) * self.n)
        return Assembly(
            "finish",
            (
                dense("q_end", Q, "q_{n+1} = Q^s"),
                dense("v_end", self.v_end, "v_{n+1}"),
                dense("P", self.delta_P, "Delta P"),
            ),
        )

    def record(self) -> Assembly:
        """Stages of a solved step, R^s from (55), (59)."""
        last = self.delta_P
        for j in range(self.s - 1):
            last = last - self.b(j) * self.R(j)
        t = [self.memory.number("t") + float(c) * self.h for c in self.tableau.c]
        return Assembly(
            "stages",
            (
                dense("stage_t", ca.vertcat(*t), "t^i = t_n + c_i h", CALLER),
                dense("stage_q", self.memory.column("Q", self.s * self.n), "Q^i", CALLER),
                dense("stage_v", self.x, "V^i", CALLER),
                dense(
                    "stage_R",
                    ca.vertcat(ca.SX(0, 1), self.percussions, last / self.b(self.s - 1)),
                    "R^i, the last from Delta P = sum_j b_j R^j",
                    CALLER,
                ),
            ),
        )


def blocks(rows: list[list[ca.SX]]) -> ca.SX:
    """A matrix of blocks."""
    return ca.vertcat(*(ca.horzcat(*row) for row in rows))


def part(column: ca.SX, first: int, count: int) -> ca.SX:
    """Entries of a column, as a column; a slice of a single number would be a row."""
    return column[first : first + count] if count else ca.SX(0, 1)


REGISTERED = Registered("lobatto", lobatto_scheme)
