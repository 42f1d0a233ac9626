"""Reference of steps that are cut at their events: the problems of segments, forces and impacts."""

from typing import Any, ClassVar

import numpy as np
from signorini.verify.reference import Reference, Step, Unknowns


class LocatedReference(Reference):
    """The paper's step, and what a located one solves beside it, (T1), (T2), (T4), (T13).

    Attributes
    ----------
    share, given : ndarray
        Friction over the normal percussion at a segment's start, shape (n_F,), and percussions that
        are known there, shape (n_gamma + n_F,).
    """

    scheme = ("lobatto", "located")
    covers = "the paper's form, and segments, forces and impacts of located events (T13)"
    equations: ClassVar[dict[str, str]] = Reference.equations

    def __init__(self, *arguments: Any, **more: Any) -> None:
        super().__init__(*arguments, **more)
        n_F, n_gamma = self.n_R - self.n_normal, self.n_bilateral - self.n_g
        self.share = np.zeros(n_F)
        self.given = np.zeros(n_gamma + n_F)

    @property
    def problems(self) -> dict[str, Unknowns]:
        n, s, n_R = self.n, self.s, self.n_R
        x, R = (s + 1) * n, s * n_R
        x_end, R_end = x + (2 * s - 1) * n, R + s * n_R
        return {
            **super().problems,
            "segment": Unknowns(slice(x, x_end), slice(R, R_end)),
            "accelerations": Unknowns(slice(x_end, x_end + n), slice(R_end, R_end + n_R)),
            "impact": Unknowns(
                slice(x_end + n, x_end + 2 * n), slice(R_end + n_R, R_end + 2 * n_R)
            ),
        }

    def equations_of(
        self, problem: str, x: np.ndarray, lam: np.ndarray, at: tuple[Any, ...], h: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        own = self.problems[problem]
        if problem == "segment":
            return self._segment(x[own.x], lam[own.lam], at, h)
        if problem == "accelerations":
            return self._accelerations(x[own.x], lam[own.lam], at, h)
        if problem == "impact":
            return self._impact(x[own.x], lam[own.lam], at)
        n, s, n_R = self.n, self.s, self.n_R
        return super().equations_of(problem, x[: (s + 1) * n], lam[: s * n_R], at, h)

    def _first_friction(self, R_N: np.ndarray) -> np.ndarray:
        """R_F^1: what is given and a share of the normal percussions."""
        rows = np.array(self.given[self.n_bilateral - self.n_g :], dtype=R_N.dtype)
        for _, f, _, n, _ in self.rows:
            if n is not None:
                for j in range(f.start - self.n_normal, f.stop - self.n_normal):
                    rows[j] = rows[j] + self.share[j] * R_N[n - self.n_bilateral]
        return rows

    def _segment(
        self, x: np.ndarray, lam: np.ndarray, at: tuple[Any, ...], h: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """(47b), (T1); g, g_N of the next stage, gamma of the next and gamma_F of this at U^i."""
        e, n, s, n_R = self.e, self.n, self.s, self.n_R
        t, q, _, u, par = at
        V, U = x[: s * n].reshape(s, n), x[s * n :].reshape(s - 1, n)
        slots = lam.reshape(s, n_R)
        gamma = slice(self.n_g, self.n_bilateral)
        R = slots.copy()
        R[0, gamma] = self.given[: self.n_bilateral - self.n_g]
        R[1:, gamma] = slots[:-1, gamma]
        R[0, self.n_normal :] = self._first_friction(slots[0, self.n_bilateral : self.n_normal])
        times = [t + c * h for c in self.c]
        Q = [q + h * (self.a[i] @ V) for i in range(s)]
        stages = [(times[i], Q[i], V[i], u, par) for i in range(s)]
        F = self.forces(Step(V, U[-1], R), stages, h)
        p_n = e.p(*at)
        rows = [
            e.p(*stages[i]) - p_n - sum(self.a_hat[i, j] * F[j] for j in range(s)) for i in range(s)
        ]
        there = [(times[i], Q[i], U[i - 1], u, par) for i in range(1, s)]
        rows += [
            e.p(*there[i - 1]) - p_n - sum(self.a[i, j] * F[j] for j in range(s))
            for i in range(1, s)
        ]
        y = []
        for j in range(s):
            none = np.zeros(n_R - self.n_normal)
            own = e.value("gamma_F", *there[j - 1]) if j else none
            if j < s - 1:
                y += [e.value("g", *there[j]), e.value("gamma", *there[j])]
                y += [e.value("g_N", *there[j]), own]
            else:
                y += [e.dot("g", *there[-1]), np.zeros(self.n_bilateral - self.n_g)]
                y += [e.dot("g_N", *there[-1]), own]
        return np.concatenate(rows), np.concatenate([np.zeros(0), *y])

    def _accelerations(
        self, dv: np.ndarray, P: np.ndarray, at: tuple[Any, ...], h: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """(T4) with the friction that is known."""
        R = np.array(P)
        R[self.n_normal :] += self._first_friction(P[self.n_bilateral : self.n_normal])
        return self.acceleration_rows(dv, R, at, h)

    def _impact(
        self, v_end: np.ndarray, P: np.ndarray, at: tuple[Any, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        """p(q, v_+) - p(q, v_-) - W Delta P and g_dot, gamma, xi_N, xi_F at one place."""
        there = (*at[:2], v_end, *at[3:])
        r = self.e.p(*there) - self.e.p(*at)
        if self.n_R:
            r = r - self.e.W(*at) @ P
        return r, self._impact_rows(self.e.y_dot(*there), at)


REFERENCE = LocatedReference
