"""Reference implementation of the scheme: the full coupled system, dense, in NumPy.

Written from the equations of Capobianco, Harsch and Leyendecker, (47), (51)-(60); it shares no
code with derivation, scheme, emission or the C runtime. The unknowns are those of (60):
V^1 ... V^s, v_{n+1}, and R = (R_g, R_gamma, R_N, R_F) at every stage.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import mpmath as mp
import numpy as np
from numpy.polynomial import Legendre, Polynomial
from signorini.codegen.frontend.model import Model
from signorini.verify.expressions import Expressions
from signorini.verify.laws import Law, find

_STEP = 15  # digits of differences along a direction, in 50-digit arithmetic


def coefficients(s: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """c, b, a, a_hat of the Lobatto IIIA-IIIB pair, by NumPy's polynomials."""
    inner = Legendre.basis(s - 1).deriv().roots() if s > 2 else np.zeros(0)
    c = np.concatenate([[0.0], (np.sort(np.real(inner)) + 1) / 2, [1.0]])
    a = np.empty((s, s))
    for j in range(s):
        others = np.delete(c, j)
        basis = Polynomial.fromroots(others) / np.prod(c[j] - others)
        primitive = basis.integ()
        a[:, j] = primitive(c) - primitive(0)
    b = a[-1]
    a_hat = b[None, :] * (1 - a.T / b[:, None])
    a_hat[:, -1] = 0
    return c, b, a, a_hat


@dataclass
class Step:
    """Solution of one step: stage velocities, end velocity, percussions of every stage.

    `q_end` is the end position where it is to be compared with what the velocities say.
    """

    V: np.ndarray
    v_end: np.ndarray
    R: np.ndarray
    q_end: np.ndarray | None = None


@dataclass(frozen=True)
class Unknowns:
    """Where the unknowns of one nonlinear problem stand among those of all problems."""

    x: slice
    lam: slice


class Rows(NamedTuple):
    """Rows of a contact or friction element in a percussion vector.

    Attributes
    ----------
    normal : int or None
        Of its own normal law.
    friction : slice
        Of its slip components.
    bound : int or None
        Which given bound its friction has.
    presses : int or None
        The normal row that bounds its friction otherwise.
    load : slice or None
        The bilateral rows that do.
    """

    normal: int | None
    friction: slice
    bound: int | None
    presses: int | None
    load: slice | None


class Reference:
    """The scheme for one model.

    Parameters
    ----------
    model : Model
        The model as the user wrote it.
    stages : int
        Number of stages.
    active_set : {"any_stage", "end"}
        Rule for the contacts that take part in the impact equations.
    high : bool
        Evaluate the smooth rows with 50 digits.
    option : str
        Value of the scheme's option, "" for its default.
    """

    scheme = ("lobatto", "paper")
    numbered = True  # whether the number of stages can be chosen
    covers = "the paper's form, (47), (51) to (60)"
    equations: ClassVar[dict[str, str]] = {
        "momentum": "(47b)",
        "end": "(47d)",
        "place": "(47a)",
        "bilateral": "(47f), (48), (51)",
        "normal": "(52), (56)",
        "friction": "(57), (58)",
    }

    def __init__(
        self,
        model: Model,
        stages: int,
        active_set: str = "any_stage",
        high: bool = False,
        option: str = "",
    ) -> None:
        self.e = Expressions(model, high)
        self.option = option
        self.s = stages
        self.c, self.b, self.a, self.a_hat = coefficients(stages)
        self.active_set = active_set
        self.n = self.e.n_q
        n = self.e.n
        ends = np.cumsum([n["g"], n["gamma"], n["g_N"], n["gamma_F"]])
        self.n_g, self.n_bilateral, self.n_normal, self.n_R = (int(x) for x in ends)
        self.rows: list[Rows] = []
        self.laws: list[Law] = []
        normal, slip, bound = self.n_bilateral, self.n_normal, 0
        for contact in self.e.contacts:
            count = len(contact.gamma_F)
            unilateral = contact.g_N is not None
            given = contact.bound is not None
            if contact.pressed_by:
                names = [c.name for c in self.e.contacts]
                presses = self.rows[names.index(contact.pressed_by)].normal
            else:
                presses = normal if unilateral else None
            self.rows.append(
                Rows(
                    normal if unilateral else None,
                    slice(slip, slip + count),
                    bound if given else None,
                    presses,
                    None if contact.load is None else self._load(model, contact.load),
                )
            )
            self.laws.append(find("elliptic" if isinstance(contact.mu, (list, tuple)) else ""))
            normal += unilateral
            bound += given
            slip += count

    @staticmethod
    def _load(model: Model, reaction: Any) -> slice:
        """Rows of a reaction among the bilateral ones."""
        first = 0
        for name, rows in (*model.constraints, *model.velocity_constraints):
            if name == reaction.name:
                begin = first + reaction.first
                count = len(rows) - reaction.first if reaction.count is None else reaction.count
                return slice(begin, begin + count)
            first += len(rows)
        raise KeyError(reaction.name)

    # --- the nonlinear problems of the C code, at any unknowns ------------------------------------

    @property
    def problems(self) -> dict[str, Unknowns]:
        """The problems and their unknowns."""
        n, s, n_R = self.n, self.s, self.n_R
        return {
            "position": Unknowns(slice(0, s * n), slice(0, (s - 1) * n_R)),
            "velocity": Unknowns(slice(s * n, (s + 1) * n), slice((s - 1) * n_R, s * n_R)),
        }

    def equations_of(
        self,
        problem: str,
        x: np.ndarray,
        lam: np.ndarray,
        at: tuple[Any, ...],
        h: Any,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Smooth and kinematic rows of one problem at given unknowns of all problems."""
        n, s, n_R = self.n, self.s, self.n_R
        weights = self.b if lam.dtype != object else np.array([_exact(b) for b in self.b], object)
        R = np.zeros((s, n_R), dtype=lam.dtype)
        R[: s - 1] = lam[: (s - 1) * n_R].reshape(s - 1, n_R)
        R[s - 1] = (lam[(s - 1) * n_R :] - weights[: s - 1] @ R[: s - 1]) / weights[s - 1]
        step = Step(x[: s * n].reshape(s, n), x[s * n :], R)
        t, q, v, u, par = at
        momentum, final, y, end_rates, _ = self.smooth(step, t, q, v, u, par, h)
        if problem == "position":
            return np.concatenate(momentum), np.concatenate([np.zeros(0), *y[1:]])
        return final, self._impact_rows(end_rates, at)

    def _impact_rows(self, rates: np.ndarray, at: tuple[Any, ...]) -> np.ndarray:
        """g_dot, gamma, xi_N, xi_F from their velocities at the end, (68), (70)."""
        e_N, e_F = self.restitution(at)
        xi = np.array(rates, dtype=object if self.e.high else float)
        start = self.struck(self.e.y_dot(*at))
        xi[self.n_bilateral : self.n_normal] += e_N * start[self.n_bilateral : self.n_normal]
        xi[self.n_normal :] += e_F * start[self.n_normal :]
        return xi

    def struck(self, rates: np.ndarray) -> np.ndarray:
        """Velocities before an impact: of what goes one way only those backwards."""
        rates = np.array(rates)
        for row, contact in zip(self.rows, self.e.contacts, strict=True):
            if contact.one_way:
                rates[row.normal] = min(rates[row.normal], 0)
        return rates

    def restitution(self, at: tuple[Any, ...]) -> tuple[np.ndarray, np.ndarray]:
        """e_N and e_F, row by row."""
        contacts = self.e.contacts
        e_N, e_F = self.e.value("e_N", *at), self.e.value("e_F", *at)
        kind = object if self.e.high else float
        return (
            np.array(
                [
                    0 * e_N[k] if c.impact == "poisson" else e_N[k]
                    for k, c in enumerate(contacts)
                    if c.g_N is not None
                ],
                kind,
            ),
            np.array([e_F[k] for k, c in enumerate(contacts) for _ in c.gamma_F], kind),
        )

    def acceleration_rows(
        self, dv: np.ndarray, P: np.ndarray, at: tuple[Any, ...], h: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """h (M dv/dt - force - W lambda) and h times the rates of all velocities of rows  (T4).

        For expressions in 50 digits: derivatives along directions are differences.
        """
        e = self.e
        t, q, v, u, par = at

        def rate(function: Any, dt: Any, dq: Any, dv: Any) -> Any:
            step = mp.mpf(10) ** -_STEP
            plus = function(t + step * dt, q + step * dq, v + step * dv, u, par)
            minus = function(t - step * dt, q - step * dq, v - step * dv, u, par)
            return (plus - minus) / (2 * step)

        zero = 0 * v
        force = e.L_q(*at) + e.value("f", *at) - rate(e.p, 1, v, zero)
        r = rate(e.p, 0, zero, dv) - h * force
        if not self.n_R:
            return r, np.zeros(0)
        y = rate(e.y_dot, 0, zero, dv) + h * rate(e.y_dot, 1, v, zero)
        return r - e.W(*at) @ P, y

    # --- a whole step -----------------------------------------------------------------------------

    def residual(
        self,
        step: Step,
        t: float,
        q: Any,
        v: Any,
        u: Any,
        par: Any,
        h: float,
        r: np.ndarray | None = None,
    ) -> dict[str, np.ndarray]:
        """Every equation of the step, by name, at given unknowns.

        Parameters
        ----------
        r : ndarray, shape (n_R,), optional
            Prox parameters, 1 by default: masses make the contact rows percussions.

        Returns
        -------
        dict
            ``momentum`` (47b), ``end`` (47d), ``bilateral`` (47f), (51) with their end conditions
            (48), ``normal`` and ``friction`` the prox equations (66), (69).
        """
        r = np.ones(self.n_R) if r is None else r
        start = (t, q, v, u, par)
        momentum, final, y, end_rates, at = self.smooth(step, t, q, v, u, par, h)
        start_rates = self.struck(self.e.y_dot(*start))
        bilateral = [y[i][: self.n_bilateral] for i in range(1, self.s)]
        bilateral.append(end_rates[: self.n_bilateral])
        normal, friction = self._contact_laws(step, at, start, y, end_rates, start_rates, h, r)
        return {
            "momentum": np.concatenate(momentum),
            "end": final,
            **self._place(step, at[-1][1]),
            "bilateral": np.concatenate(bilateral) if bilateral else np.zeros(0),
            "normal": np.array(normal, dtype=float),
            "friction": np.concatenate([np.zeros(0), *friction]),
        }

    @staticmethod
    def _place(step: Step, place: Any) -> dict[str, np.ndarray]:
        return {} if step.q_end is None else {"place": np.asarray(place - step.q_end, float)}

    def sizes(
        self, step: Step, t: float, q: Any, v: Any, u: Any, par: Any, h: float, r: np.ndarray
    ) -> dict[str, np.ndarray]:
        """What every row of `residual` is measured by: its own terms, added up in size.

        Momentum rows by momenta and forces before they cancel, constraints by the way that one
        step makes, contact rows by r times a velocity.
        """
        e, s = self.e, self.s
        start = (t, q, v, u, par)
        times = [t + c * h for c in self.c]
        Q = [q + h * (self.a[i] @ step.V) for i in range(s)]
        at = [(times[i], Q[i], step.V[i], u, par) for i in range(s)]
        at.append((t + h, Q[-1], step.v_end, u, par))
        R = [*step.R, step.R[-1]]
        size = np.abs(e.p(*start)).astype(float)
        speed = np.zeros(self.n_R)
        pace = np.abs(np.asarray(v, dtype=float))
        for here, force in zip(at, R, strict=True):
            W = np.abs(np.asarray(e.W(*here), dtype=float))
            terms = h * (np.abs(e.L_q(*here)) + np.abs(e.value("f", *here))) + W @ np.abs(force)
            size = np.maximum(size, np.abs(e.p(*here)).astype(float) + terms.astype(float))
            pace = np.maximum(pace, np.abs(here[2]))
        M = self.mass(start)
        # a row whose own terms vanish is moved by others through its inertia
        pace = np.maximum(pace, size / np.maximum(np.abs(np.diag(M)), 1e-300))
        size = np.maximum(size, np.abs(M) @ np.maximum(np.abs(v), 1e-9 * pace))
        # a step is solved for its energy: rows without terms share a thousandth of the largest
        root = np.sqrt(np.abs(np.diag(M)))
        root = np.where(root > 0, root, np.max(root))
        size = np.maximum(size, 1e-3 * np.max(size / root) * root)
        for here in (start, *at):
            W = np.abs(np.asarray(e.W(*here), dtype=float))
            chi = np.abs(e.y_dot(here[0], here[1], np.zeros(self.n), u, par)).astype(float)
            speed = np.maximum(speed, W.T @ pace + chi)
        places = np.concatenate([self._reach(start), np.zeros(self.n_R - self.n_normal)])
        # round-off of positions is no error of the step
        way = np.maximum(h * speed, 1e-6 * places)
        kinematic = np.where(self._is_gap, way, speed)
        contact = r * np.where(self._is_gap, way / h, speed)
        bilateral = np.concatenate(
            [*(kinematic[: self.n_bilateral],) * (s - 1), speed[: self.n_bilateral]]
        )
        per_contact_N, per_contact_F = [], []
        for n, f, _, p, load in self.rows:
            if n is not None:
                per_contact_N += [contact[n]] * s
            # friction and the percussions that bound it
            top = max(np.max(contact[f], initial=0.0), contact[p] if p is not None else 0.0)
            top = max(top, np.max(contact[load], initial=0.0) if load is not None else 0.0)
            per_contact_F += [np.full(f.stop - f.start, top)] * s
        return {
            "momentum": np.tile(size, s),
            "end": size,
            "place": np.abs(np.asarray(q, dtype=float)) + h * pace,
            "bilateral": bilateral,
            "normal": np.array(per_contact_N),
            "friction": np.concatenate([np.zeros(0), *per_contact_F]),
        }

    def prox_parameters(self, at: tuple[Any, ...], h: float) -> np.ndarray:
        """Effective masses of all directions: they make contact rows percussions. What yields
        moves by c / h^2 besides."""
        r = self.effective_masses(at)
        c = self.e.value("compliance", *at)
        for k, row in enumerate(self.e.yields):
            r[row] /= 1 + r[row] * float(c[k]) / h**2
        return r

    def coefficient(self, k: int, mu: np.ndarray, at: tuple[Any, ...]) -> float:
        """mu of contact k: of the step, or at a stage."""
        if self.e.contacts[k].mu_at == "start":
            return float(mu[k])
        return float(self.e.value("mu", *at)[k])

    def end_radius(
        self, k: int, p: int, mu: np.ndarray, step: Step, at: Sequence[tuple[Any, ...]]
    ) -> float:
        """sum_j b_j mu^j R_N^j with b_s R_N^s = P_N - sum_j b_j R_N^j."""
        P = float((self.b @ step.R)[p])
        if self.e.contacts[k].mu_at == "start":
            return float(mu[k]) * max(P, 0.0)
        own = [self.coefficient(k, mu, at[j]) for j in range(self.s)]
        return float(sum(self.b[j] * own[j] * step.R[j][p] for j in range(self.s)))

    @property
    def covers_impacts(self) -> bool:
        """Whether the impact laws of all contacts are known here; Poisson's is not."""
        return all(contact.impact == "newton" for contact in self.e.contacts)

    @property
    def _is_gap(self) -> np.ndarray:
        """Which rows of y are gaps or position constraints."""
        index = np.arange(self.n_R)
        gaps = (index < self.n_g) | ((index >= self.n_bilateral) & (index < self.n_normal))
        for row, contact in zip(self.rows, self.e.contacts, strict=True):
            if contact.one_way:
                gaps[row.normal] = False
        return gaps

    def _reach(self, at: tuple[Any, ...]) -> np.ndarray:
        """|W^T| |q| of constraints and gaps: what their round-off is relative to."""
        W = np.abs(np.asarray(self.e.W(*at), dtype=float))[:, : self.n_normal]
        return W.T @ np.abs(np.asarray(at[1], dtype=float))

    def mass(self, at: tuple[Any, ...]) -> np.ndarray:
        """dp/dv by central differences; exact where L is quadratic in v."""
        t, q, v, u, par = at
        return self._jacobian(lambda x: self.e.p(t, q, x, u, par), np.asarray(v, float))

    def effective_masses(self, at: tuple[Any, ...]) -> np.ndarray:
        """1 / (w^T M^-1 w) of every direction w; a typical one where a direction vanishes."""
        if not self.n_R:
            return np.zeros(0)
        M, W = self.mass(at), np.asarray(self.e.W(*at), dtype=float)
        mobility = np.abs(np.einsum("ik,ik->k", W, np.linalg.solve(M, W)))
        typical = 1 / np.max(np.abs(np.diag(M)))
        return 1 / np.where(mobility > 1e-14 * max(typical, mobility.max()), mobility, typical)

    def smooth(
        self, step: Step, t: Any, q: Any, v: Any, u: Any, par: Any, h: Any
    ) -> tuple[list[np.ndarray], np.ndarray, list[np.ndarray], np.ndarray, list[Any]]:
        """Momentum rows (47b) of every stage, (47d), kinematics at the stages and at the end.

        Returns
        -------
        tuple
            momentum rows, end row, (g, gamma, g_N, gamma_F) at every stage, their velocities at
            the end, and the arguments of every stage.
        """
        e, s = self.e, self.s
        times = [t + c * h for c in self.c]
        Q = [q + h * (self.a[i] @ step.V) for i in range(s)]
        at = [(times[i], Q[i], step.V[i], u, par) for i in range(s)]
        start = (t, q, v, u, par)
        end = (t + h, Q[-1], step.v_end, u, par)
        F = self.forces(step, at, h)
        p_n = e.p(*start)
        momentum = [
            e.p(*at[i]) - p_n - sum(self.a_hat[i, j] * F[j] for j in range(s)) for i in range(s)
        ]
        final = e.p(*end) - p_n - sum(self.b[j] * F[j] for j in range(s))
        y, rates = [e.y(*at[i]) for i in range(s)], e.y_dot(*end)
        self._yield(y, rates, step, start, h)
        return momentum, final, y, rates, at

    def _yield(self, y: list[Any], rates: Any, step: Step, start: tuple[Any, ...], h: Any) -> None:
        """(T20): 0 = g + tau dg/dt + c R / h over 1 + tau / (c_i h), dg/dt = (g - g_n) / (c_i h);
        (T21) over tau + h / 2."""
        c, tau = self.e.value("compliance", *start), self.e.value("relaxation", *start)
        weights = (
            self.b if step.R.dtype != object else np.array([_exact(b) for b in self.b], object)
        )
        P = weights @ step.R
        before = self.e.y(*start)
        for k, row in enumerate(self.e.yields):
            begin = before[row] if row < self.n_bilateral else min(before[row], 0)
            for i in range(1, self.s):
                rate = (y[i][row] - begin) / (h * self.c[i])
                law = y[i][row] + tau[k] * rate + c[k] * step.R[i - 1][row] / h
                if i == self.s - 1:
                    last = y[i][row]
                y[i][row] = law / (1 + tau[k] / (h * self.c[i]))
            width = tau[k] + h / 2
            last = last if row < self.n_bilateral else min(last, 0)
            rates[row] = (last + width * rates[row] + c[k] * P[row] / h) / width

    def forces(self, step: Step, at: list[Any], h: Any) -> list[np.ndarray]:
        """F^j (63) of every stage."""
        e = self.e
        return [
            h * e.L_q(*here) + h * e.value("f", *here) + e.W(*here) @ R
            for here, R in zip(at, step.R, strict=True)
        ]

    def _contact_laws(
        self,
        step: Step,
        at: Any,
        start: Any,
        y: Any,
        end_rates: Any,
        start_rates: Any,
        h: float,
        r: Any,
    ) -> tuple[list[float], list[np.ndarray]]:
        e, s = self.e, self.s
        normal, friction = [], []
        mu, e_N, e_F = (e.value(name, *start) for name in ("mu", "e_N", "e_F"))
        guard, mu_F = e.value("guard", *start), self.mu_F(*start)
        gaps = self._is_gap
        bounds = [np.maximum(e.value("bound", *at[i]), 0) for i in range(s)]
        P = self.b @ step.R
        acting: dict[int, bool] = {}  # by normal row, whether a contact joins the impact equations
        for k, (n, f, bound, p, load) in enumerate(self.rows):
            exists = self.e.contacts[k].guard is None or guard[k] >= 0
            is_closed = []
            for i in range(1, s):
                force = step.R[i - 1]
                if n is not None:
                    z = r[n] * y[i][n] / (h if gaps[n] else 1) - force[n]
                    is_closed.append(z <= 1e-9 * abs(force[n]) + 1e-13 * r[n] / h)
                    normal.append(force[n] + min(z, 0) if exists else force[n])
                if load is not None:
                    radius = mu[k] * float(np.linalg.norm(force[load]))
                elif p is None:
                    radius = h * bounds[i - 1][bound]
                else:
                    own = self.coefficient(k, mu, at[i - 1])
                    radius = own * max(force[p], 0.0) if exists else 0.0
                friction.append(self.friction(k, force[f], y[i][f], radius, r, mu_F))
            if n is not None:
                joins = any(is_closed) if self.active_set == "any_stage" else is_closed[-1]
                acting[n] = exists and (joins or self.e.contacts[k].one_way)
                xi = end_rates[n] + e_N[k] * start_rates[n]
                normal.append(P[n] + min(r[n] * xi - P[n], 0) if acting[n] else P[n])
                if self.e.contacts[k].impact == "poisson":
                    normal[-1] = 0.0  # in two phases, see `covers_impacts`
            if load is not None:
                radius = mu[k] * float(np.linalg.norm(P[load]))
            elif p is None:
                radius = h * float(self.b @ np.array([x[bound] for x in bounds]))
            else:
                radius = self.end_radius(k, p, mu, step, at) if acting[p] else 0.0
            xi_F = end_rates[f] + e_F[k] * start_rates[f]
            rub = self.friction(k, P[f], xi_F, radius, r, mu_F)
            friction.append(0 * rub if self.e.contacts[k].impact == "poisson" else rub)
        return normal, friction

    def mu_F(self, *at: Any) -> np.ndarray:
        """Friction coefficient of every slip component; ones where no law asks for them."""
        values = self.e.value("mu_F", *at)
        return values if values.size else np.ones(self.n_R - self.n_normal)

    def friction(
        self, k: int, P: Any, slip: Any, radius: float, r: np.ndarray, mu_F: np.ndarray
    ) -> np.ndarray:
        """Residual of the friction of contact k, by its law."""
        f = self.rows[k].friction
        own = mu_F[f.start - self.n_normal : f.stop - self.n_normal]
        return self.laws[k].residual(P, slip, radius, np.max(r[f], initial=0.0), own)

    # --- solving ----------------------------------------------------------------------------------

    def solve(
        self, t: float, q: Any, v: Any, u: Any, par: Any, h: float, start: Step | None = None
    ) -> Step | None:
        """Newton's method from a cold start, minimum-norm steps; None if it does not converge."""
        q, v = np.asarray(q, float), np.asarray(v, float)
        at = (t, q, v, u, par)
        r = self.prox_parameters(at, h)
        x = self._pack(start or self._cold(v))

        def residual(x: np.ndarray) -> np.ndarray:
            parts = self.residual(self._unpack(x), t, q, v, u, par, h, r)
            return np.concatenate(list(parts.values()))

        # Percussions in units of velocity: small masses must not look like a loss of rank.
        unit = self._units(r)
        value, rows = residual(x), np.ones(1)
        for _ in range(40):
            J = self._jacobian(residual, x, unit) * unit
            rows = np.maximum(np.max(np.abs(J), axis=1, initial=0), 1e-300)
            change = unit * np.linalg.lstsq(J / rows[:, None], -value / rows, rcond=1e-9)[0]
            best = None
            for alpha in (1.0, 0.5, 0.25, 0.1):
                trial = residual(x + alpha * change)
                if best is None or np.linalg.norm(trial / rows) < np.linalg.norm(best[1] / rows):
                    best = (alpha, trial)
                if np.linalg.norm(trial / rows) < 0.7 * np.linalg.norm(value / rows):
                    break
            assert best is not None
            x, value = x + best[0] * change, best[1]
            if not np.all(np.isfinite(x)):
                return None
            size = max(1e-300, np.max(np.abs(x / unit)))
            if np.max(np.abs(best[0] * change / unit)) <= 1e-12 * size:
                break
        # Rows over their largest derivative: errors of velocities, whatever the masses are.
        scale = float(np.max(np.abs(x / unit), initial=0))
        return self._unpack(x) if np.max(np.abs(value) / rows) <= 1e-9 * scale else None

    def _cold(self, v: np.ndarray) -> Step:
        return Step(np.tile(v, (self.s, 1)), v.copy(), np.zeros((self.s, self.n_R)))

    def _units(self, masses: np.ndarray) -> np.ndarray:
        return np.concatenate([np.ones((self.s + 1) * self.n), np.tile(masses, self.s)])

    def _pack(self, step: Step) -> np.ndarray:
        return np.concatenate([step.V.ravel(), step.v_end, step.R.ravel()])

    def _unpack(self, x: np.ndarray) -> Step:
        n, s = self.n, self.s
        return Step(
            x[: s * n].reshape(s, n), x[s * n : (s + 1) * n], x[(s + 1) * n :].reshape(s, self.n_R)
        )

    @staticmethod
    def _jacobian(f: Any, x: np.ndarray, unit: np.ndarray | None = None) -> np.ndarray:
        columns = []
        units = np.ones(x.size) if unit is None else unit
        for k in range(x.size):
            d = 1e-6 * max(units[k], abs(x[k]))
            plus, minus = x.copy(), x.copy()
            plus[k] += d
            minus[k] -= d
            columns.append((f(plus) - f(minus)) / (plus[k] - minus[k]))
        return np.array(columns, dtype=float).T


def _exact(x: float) -> Any:
    return mp.mpf(x)
