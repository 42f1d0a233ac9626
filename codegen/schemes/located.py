"""Steps that are cut at their events: smooth segments with friction, impacts at one place."""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.program import (
    Assembly,
    Evaluate,
    Jacobian,
    Located,
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
    restitution,
    slip_rows,
)
from signorini.codegen.schemes import Registered
from signorini.codegen.schemes.full_order import FullOrder
from signorini.codegen.schemes.lobatto import Lobatto, blocks, part
from signorini.codegen.schemes.tableau import dense_positions, dense_velocities
from signorini.codegen.sharing import share


def located_scheme(d: Derivation, stages: int, value: float) -> Scheme:
    """Return the scheme whose steps are cut at their events.

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
    In a segment every contact keeps its mode. Where none rubs and there are no velocity constraints
    the two problems of the step itself serve, with contacts held; otherwise::

        R_F^i = -mu R_N^i n(gamma_F(t^i, Q^i, U^i))   or   gamma_F(t^i, Q^i, U^i) = 0    (T13)

    at the auxiliary velocities U^i of (T1), for i = 2 ... s; at the first stage the direction of
    slip is that of the start, or R_F^1 = h lambda_F with the force at t_n (T4). (T13) ... are
    equations of docs/theory.md.
    """
    return _Located(d, stages).scheme()


class _Segment(FullOrder):
    """The problem of a segment in which contacts rub; shares the evaluations of the step."""

    def __init__(self, step: "_Located") -> None:
        self.__dict__.update(step.__dict__)
        self.slips = _contacts_of_slips(step.d.data)
        self.place()

    def place(self) -> None:
        """V, U and R behind the unknowns of the two problems of the step."""
        self.place_at((self.s + 1) * self.n, self.s * self.n_R)
        memory, data = self.memory, self.d.data
        self.share_F = memory.column("share", data.n_F)
        self.given = memory.column("given", data.n_gamma + data.n_F)

    # --- percussions of the stages ---------------------------------------------------------------

    def R_gamma(self, i: int) -> ca.SX:
        """R_gamma^{i+1}: given at the first stage, slot i - 1 for the others."""
        return super().R_gamma(i) if i else part(self.given, 0, self.n_gamma)

    def R_N(self, i: int) -> ca.SX:
        """R_N^{i+1}: slot i."""
        first = i * self.n_R + self.n_b
        return part(self.percussions, first, self.d.data.n_N)

    def R_F(self, i: int) -> ca.SX:
        """R_F^{i+1}: slot i, but at the first stage a share of R_N and what is given."""
        n_N, n_F = self.d.data.n_N, self.d.data.n_F
        if i == 0:
            rows = part(self.given, self.n_gamma, n_F)
            R_N = self.R_N(0)
            for f, (normal, _) in enumerate(self.slips):
                if normal >= 0:
                    rows[f] += self.share_F[f] * R_N[normal]
            return rows
        first = i * self.n_R + self.n_b + n_N
        return part(self.percussions, first, n_F)

    def parts(self) -> tuple[Callable[[int], ca.SX], ...]:
        """Percussions of a stage, group by group."""
        return self.R_g, self.R_gamma, self.R_N, self.R_F

    def stage_points(self) -> Assembly:
        return replace(super().stage_points(), name="segment_points")

    def stage_percussions(self) -> Assembly:
        rows = [percussions(i) for i in range(self.s) for percussions in self.parts()]
        title = "R_g^i, R_gamma^i, R_N^i, R_F^i; at the first stage those of rows known at t_n"
        return Assembly(
            "stage_percussions", (dense("R_stage", ca.vertcat(ca.SX(0, 1), *rows), title),)
        )

    # --- rows and derivatives --------------------------------------------------------------------

    def whole_values(self) -> Assembly:
        s, data = self.s, self.d.data
        plain = super().whole_values()
        radius = [ca.densify(self.at(j, "rho")) for j in range(s)]
        for j in range(1, s):
            for k, place, _ in self.d.varying:
                radius[j][place] = ca.densify(self.aux(j, "mu"))[k]
        y = []
        for j in range(s):
            own = self.aux(j, "gamma_F") if j else ca.SX.zeros(data.n_F, 1)
            if j < s - 1:
                rows = (self.at(j + 1, "g"), self.aux(j + 1, "gamma"), self.at(j + 1, "g_N"), own)
            else:
                none = ca.SX.zeros(self.n_gamma, 1)
                rows = (self.aux(j, "g_dot"), none, self.aux(j, "g_N_dot"), own)
            y += [ca.densify(x) for x in rows]
        title = "g(Q^i), gamma(U^i), g_N(Q^i) of the next stage, gamma_F(U^i) of this  (T13)"
        return Assembly(
            "segment_values",
            (
                next(t for t in plain.targets if t.array == "r"),
                dense("y", ca.vertcat(ca.SX(0, 1), *y), title),
                dense("radius", ca.vertcat(ca.SX(0, 1), *radius), "radii h bound^i"),
            ),
        )

    def whole_derivatives(self) -> Jacobian:
        s, n, data = self.s, self.n, self.d.data
        n_x = (2 * s - 1) * n

        def weights(i: int, j: int) -> float:
            """Weight of F^j in row i: IIIB for V, then IIIA for U."""
            return self.a_hat(i, j) if i < s else self.a(i - s + 1, j)

        def at_auxiliary(i: int, name: str) -> ca.SX:
            """Derivative of a function of (t^i, Q^i, U^i) by V and U."""
            along = [self.h * self.a(i, k) * self.aux(i, f"{name}_q") for k in range(s)]
            rows = along[0].shape[0]
            own = [self.aux(i, f"{name}_v") if k == i else ca.SX(rows, n) for k in range(1, s)]
            return ca.horzcat(*along, *own)

        def at_stage(i: int, name: str) -> ca.SX:
            """Derivative of a function of (t^i, Q^i) by V and U."""
            along = [self.h * self.a(i, k) * self.at(i, f"{name}_q") for k in range(s)]
            return ca.horzcat(*along, ca.SX(along[0].shape[0], (s - 1) * n))

        B, C, C_radius = [], [], []
        for i in range(2 * s - 1):
            columns = []
            for j in range(s):
                W_F = self.at(j, "gamma_F_v").T
                W_N = self.at(j, "g_N_q").T
                if j == 0:
                    W_N = W_N + self._shared(W_F)
                    W_F = ca.SX(n, data.n_F)
                columns.append(-weights(i, j) * self.at(j, "g_q").T)
                if j < s - 1:
                    columns.append(-weights(i, j + 1) * self.at(j + 1, "gamma_v").T)
                else:
                    columns.append(ca.SX(n, self.n_gamma))
                columns += [-weights(i, j) * W_N, -weights(i, j) * W_F]
            B.append([ca.sparsify(c) for c in columns])
        for j in range(s):
            if j < s - 1:
                C += [at_stage(j + 1, "g"), at_auxiliary(j + 1, "gamma"), at_stage(j + 1, "g_N")]
            else:
                C += [at_auxiliary(j, "g_dot"), ca.SX(self.n_gamma, n_x)]
                C.append(at_auxiliary(j, "g_N_dot"))
            C.append(at_auxiliary(j, "gamma_F") if j else ca.SX(data.n_F, n_x))
            slopes = at_stage(j, "rho")
            for k, place, _ in self.d.varying if j else ():
                slopes[place, :] = at_auxiliary(j, "mu")[k, :]
            C_radius.append(slopes)
        n_bounds = self.d["rho"].numel()
        return jacobian(
            "segment_derivatives",
            self.whole_A(),
            blocks(B),
            ca.sparsify(ca.vertcat(*C)),
            ca.sparsify(ca.vertcat(*C_radius)) if n_bounds else ca.SX(0, n_x),
            (
                *(i * self.n_R + c for i in range(s - 1) for c in range(self.n_b)),
                *((s - 1) * self.n_R + c for c in range(self.n_g)),
            ),
            ("K = [dr/d(V, U), B; C, 0]", "B = dr/dR, column by column", "C = dy/d(V, U)", "radii"),
        )

    def _shared(self, W_F: ca.SX) -> ca.SX:
        """Directions of friction that follows the normal percussions by the given shares."""
        columns = [ca.SX(self.n, 1) for _ in range(self.d.data.n_N)]
        for f, (normal, _) in enumerate(self.slips):
            if normal >= 0:
                columns[normal] = columns[normal] + self.share_F[f] * W_F[:, f]
        return ca.horzcat(ca.SX(self.n, 0), *columns)

    def finish(self) -> Assembly:
        P = [ca.SX.zeros(rows, 1) for rows in self._sizes()]
        for j in range(self.s):
            for k, percussions in enumerate(self.parts()):
                P[k] += self.b(j) * percussions(j)
        Q = self.memory.column("Q", self.n, (self.s - 1) * self.n)
        return Assembly(
            "finish_segment",
            (
                dense("q_end", Q, "q_{n+1} = Q^s"),
                dense("v_end", self.v_end, "v_{n+1} = U^s"),
                dense("P", ca.vertcat(ca.SX(0, 1), *P), "Delta P = sum_j b_j R^j"),
            ),
        )

    def _sizes(self) -> tuple[int, int, int, int]:
        data = self.d.data
        return data.n_g, data.n_gamma, data.n_N, data.n_F

    # --- accelerations ---------------------------------------------------------------------------

    def accelerations(self, x: int, R: int) -> Problem:
        """M dv/dt = force + W lambda with the second derivatives of what is closed or sticks."""
        memory, data, n = self.memory, self.d.data, self.n
        at = {k: self.forces.at(memory, Place("forces"), k) for k in self.forces.fields}
        W_F = self.end.at(memory, Place("start"), "W_F")
        W_N = self.end.at(memory, Place("start"), "W_N") + self._shared(W_F)
        B = ca.horzcat(self._start_directions(), W_N, W_F)
        C = ca.horzcat(self._start_directions(), self.end.at(memory, Place("start"), "W_N"), W_F).T
        M = self.end_jacobian.at(memory, Place("start_jacobian"), "p_v")
        dv, P = memory.column("x", n, x), memory.column("R", self.n_R, R)
        r = M @ dv - self.h * at["force"]
        if self.n_R:
            r = r - B @ P - W_F @ part(self.given, self.n_gamma, data.n_F)
        rate = [at[k] for k in ("g_rate", "gamma_rate", "g_N_rate", "gamma_F_rate")]
        y = self.h * ca.vertcat(ca.SX(0, 1), *rate)
        if self.n_R:
            y = y + C @ dv
        bounds = at["bound"]
        radius = [self.h * ca.if_else(bounds[k] > 0, bounds[k], 0) for k in range(bounds.numel())]
        radius += coefficients_there(self.d, memory)
        values = Assembly(
            "acceleration_values",
            (
                dense("r", r, "h (M dv/dt - force - W lambda) = 0  (T4)"),
                dense("y", y, "h times the rates of g_dot, gamma, g_N_dot, gamma_F"),
                dense("radius", ca.vertcat(ca.SX(0, 1), *radius), "radii h bound"),
            ),
        )
        looked = (Ref("look_t"), Ref("look_q"), Ref("look_v"), Ref("u"), Parameters())
        return Problem(
            "accelerations",
            "(T4): accelerations and forces of all contacts that touch, times h",
            n,
            1,
            0,
            True,
            ((1.0, 1.0),),
            (Evaluate("forces", looked, Place("forces")), values),
            (),
            jacobian(
                "acceleration_derivatives",
                M,
                -B,
                C,
                ca.SX(len(radius), n),
                tuple(range(self.n_b)),
                ("K = [M, B; C, 0]", "B = -W, column by column", "C = W^T", ""),
            ),
            alone=True,
        )


class _Located(Lobatto):
    def points(self) -> list[Point]:
        """The same, and what is evaluated at the auxiliary velocities."""
        arguments = ("t", "q", "v", "par")
        derivatives = ("p_q", "p_v", "gamma_q", "gamma_v", "g_dot_q", "g_dot_v")
        of_contacts = ("g_N_dot_q", "g_N_dot_v", "gamma_F_q", "gamma_F_v")
        varying = self.d.varying
        return [
            *super().points(),
            self.point(
                "auxiliary",
                arguments,
                ("p", "gamma", "g_dot", "g_N_dot", "gamma_F", *(("mu",) if varying else ())),
            ),
            self.point(
                "auxiliary_jacobian",
                arguments,
                (*derivatives, *of_contacts, *(("mu_q", "mu_v") if varying else ())),
            ),
        ]

    def scheme(self) -> Scheme:
        s, n, n_R = self.s, self.n, self.n_R
        plain = super().scheme()
        self.auxiliary, self.auxiliary_jacobian = share(self.memory, *self.others)
        forces = ("force", "g_rate", "gamma_rate", "g_N_rate", "gamma_F_rate", "bound")
        self.forces = self.point("forces", ("t", "q", "v", "u", "par"), forces)
        watched = ("g_N", "g_N_dot", "gamma_F", "guard")
        self.watched = self.point("watched", ("t", "q", "v", "par"), watched)
        segment = _Segment(self)
        x, R = 3 * s * n, 2 * s * n_R
        return replace(
            plain,
            title=f"{plain.title}, located events",
            adaptive=True,
            points=(
                *plain.points,
                *(self.auxiliary, self.auxiliary_jacobian, self.forces, self.watched),
            ),
            places=(
                *plain.places,
                ("auxiliary", "auxiliary", s - 1),
                ("auxiliary_jacobian", "auxiliary_jacobian", s - 1),
                ("forces", "forces", 0),
                ("watched", "watched", 0),
            ),
            problems=(
                *plain.problems,
                segment.whole("segment"),
                segment.accelerations(x, R),
                self.impact(x + n, R + n_R),
            ),
            located=Located(
                chain=2,
                kept=3,
                watch=self.watch(),
                finish=segment.finish(),
                positions=dense_positions(s),
                velocities=dense_velocities(s),
            ),
        )

    def watch(self) -> tuple[Evaluate | Assembly, ...]:
        """What events are found from, where the step looks."""
        at = {k: self.watched.at(self.memory, Place("watched"), k) for k in self.watched.fields}
        looked = (Ref("look_t"), Ref("look_q"), Ref("look_v"), Parameters())
        return (
            evaluate(self.watched, looked, Place("watched")),
            Assembly(
                "watch_assembly",
                (
                    dense("gap", at["g_N"], "g_N"),
                    dense("gap_rate", at["g_N_dot"], "g_N_dot"),
                    dense("slip_rate", at["gamma_F"], "gamma_F"),
                    dense("guard_there", at["guard"], "guards"),
                ),
            ),
        )

    def impact(self, x: int, R: int) -> Problem:
        """Impact equations at one place: p(v_+) - p(v_-) = W Delta P, (48), (51), (56), (58)."""
        memory, data, n = self.memory, self.d.data, self.n
        end = {k: self.end.at(memory, Place("end"), k) for k in self.end.fields}
        start = {k: self.end.at(memory, Place("start"), k) for k in ("g_N_dot", "gamma_F")}
        W = ca.horzcat(*(end[k] for k in ("W_g", "W_gamma", "W_N", "W_F")))
        P = memory.column("R", self.n_R, R)
        contacts = len(data.contacts)
        xi_N, xi_F = restitution(
            self.d,
            ca.densify(start["g_N_dot"]),
            ca.densify(start["gamma_F"]),
            memory.column("e_N", contacts),
            memory.column("e_F", contacts),
        )
        r = end["p"] - self.p_n
        if self.n_R:
            r = r - W @ P
        y = ca.vertcat(end["g_dot"], end["gamma"], end["g_N_dot"] + xi_N, end["gamma_F"] + xi_F)
        n_given = len(slip_rows(self.d))
        radius = [*ca.vertsplit(ca.SX.zeros(n_given, 1)), *coefficients_there(self.d, memory)]
        n_bounds = len(radius)
        values = Assembly(
            "impact_values",
            (
                dense("r", r, "p(q, v_+) - p(q, v_-) - W Delta P = 0"),
                dense("y", y, "g_dot, gamma, xi_N, xi_F, all at one place  (68)"),
                dense(
                    "radius",
                    ca.vertcat(ca.SX(0, 1), *radius),
                    "a given bound has no impulse; coefficients at the place",
                ),
            ),
        )
        at_place = (Time(0.0), Ref("q"), Ref("x", x), Parameters())
        terms = self.terms_at(0)
        return Problem(
            "impact",
            "(48), (51), (56), (58) at one place: v_+, Delta P",
            n,
            1,
            0,
            True,
            ((1.0, 1.0),),
            (evaluate(self.end, at_place, Place("end"), terms), values),
            (evaluate(self.end_jacobian, at_place, Place("end_jacobian"), terms, Place("end")),),
            jacobian(
                "impact_derivatives",
                self.end_jacobian.at(memory, Place("end_jacobian"), "p_v"),
                -W,
                W.T,
                ca.SX(n_bounds, n),
                tuple(range(self.n_b)),
                ("K = [dp/dv, B; C, 0]", "B = -W, column by column", "C = W^T", ""),
            ),
            alone=True,
        )


def coefficients_there(d: Derivation, memory: Memory) -> list[ca.SX]:
    """Coefficients that vary, at one place, and nothing besides in their radii."""
    mu = memory.column("mu", len(d.data.contacts))
    return [x for k, _, _ in d.varying for x in (mu[k], ca.SX(0))]


def _contacts_of_slips(data: ModelData) -> list[tuple[int, int]]:
    """Normal row that presses (-1: the bound is given) and contact of every slip row."""
    rows = []
    normal: dict[int | None, int] = {None: -1}
    for k, c in enumerate(data.contacts):
        if c.g_N is not None:
            normal[k] = len(normal) - 1
        rows += [(normal[c.presser], k)] * c.n_F
    return rows


REGISTERED = Registered("lobatto", located_scheme, form="any", events="located")
