"""Reference implementation of the scheme: the full coupled system, dense, in NumPy.

Written from the equations of Capobianco, Harsch and Leyendecker, (47), (51)-(60); it shares no
code with derivation, scheme, emission or the C runtime. The unknowns are those of (60):
V^1 ... V^s, v_{n+1}, and R = (R_g, R_gamma, R_N, R_F) at every stage.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from signorini.codegen.model import Model
from signorini.verify.expressions import Expressions


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
    """Solution of one step: stage velocities, end velocity, percussions of every stage."""

    V: np.ndarray
    v_end: np.ndarray
    R: np.ndarray


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
    """

    def __init__(
        self, model: Model, stages: int, active_set: str = "any_stage", high: bool = False
    ) -> None:
        self.e = Expressions(model, high)
        self.s = stages
        self.c, self.b, self.a, self.a_hat = coefficients(stages)
        self.active_set = active_set
        self.n = self.e.n_q
        n = self.e.n
        ends = np.cumsum([n["g"], n["gamma"], n["g_N"], n["gamma_F"]])
        self.n_g, self.n_bilateral, self.n_normal, self.n_R = (int(x) for x in ends)
        self.rows: list[tuple[int | None, slice, int | None]] = []
        normal, slip, bound = self.n_bilateral, self.n_normal, 0
        for contact in self.e.contacts:
            count = len(contact.gamma_F)
            unilateral = contact.g_N is not None
            self.rows.append(
                (
                    normal if unilateral else None,
                    slice(slip, slip + count),
                    None if unilateral else bound,
                )
            )
            normal += unilateral
            bound += not unilateral
            slip += count

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

        Returns
        -------
        dict
            ``momentum`` (47b), ``end`` (47d), ``bilateral`` (47f), (51) with their end conditions
            (48), ``normal`` and ``friction`` the prox equations (66), (69).
        """
        r = np.ones(self.n_R) if r is None else r
        start = (t, q, v, u, par)
        momentum, final, y, end_rates, at = self.smooth(step, t, q, v, u, par, h)
        start_rates = self.e.y_dot(*start)
        bilateral = [y[i][: self.n_bilateral] for i in range(1, self.s)]
        bilateral.append(end_rates[: self.n_bilateral])
        normal, friction = self._contact_laws(step, at, start, y, end_rates, start_rates, h, r)
        return {
            "momentum": np.concatenate(momentum),
            "end": final,
            "bilateral": np.concatenate(bilateral) if bilateral else np.zeros(0),
            "normal": np.array(normal, dtype=float),
            "friction": np.concatenate([np.zeros(0), *friction]),
        }

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
        F = [
            h * e.L_q(*at[j]) + h * e.value("f", *at[j]) + e.W(*at[j]) @ step.R[j] for j in range(s)
        ]
        p_n = e.p(*start)
        momentum = [
            e.p(*at[i]) - p_n - sum(self.a_hat[i, j] * F[j] for j in range(s)) for i in range(s)
        ]
        final = e.p(*end) - p_n - sum(self.b[j] * F[j] for j in range(s))
        return momentum, final, [e.y(*at[i]) for i in range(s)], e.y_dot(*end), at

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
        guard = e.value("guard", *start)
        bounds = [np.maximum(e.value("bound", *at[i]), 0) for i in range(s)]
        P = self.b @ step.R
        for k, (n, f, bound) in enumerate(self.rows):
            exists = self.e.contacts[k].guard is None or guard[k] >= 0
            is_closed = []
            for i in range(1, s):
                force = step.R[i - 1]
                if n is not None:
                    z = r[n] * y[i][n] - force[n]
                    is_closed.append(z <= 1e-9 * abs(force[n]) + 1e-13 * r[n])
                    normal.append(force[n] + min(z, 0) if exists else force[n])
                    radius = mu[k] * max(force[n], 0.0) if exists else 0.0
                else:
                    radius = h * bounds[i - 1][bound]
                friction.append(_friction(force[f], y[i][f], radius, r[f]))
            if n is None:
                radius = h * float(self.b @ np.array([x[bound] for x in bounds]))
            else:
                active = exists and (
                    any(is_closed) if self.active_set == "any_stage" else is_closed[-1]
                )
                xi = end_rates[n] + e_N[k] * start_rates[n]
                normal.append(P[n] + min(r[n] * xi - P[n], 0) if active else P[n])
                radius = mu[k] * max(P[n], 0.0) if active else 0.0
            friction.append(_friction(P[f], end_rates[f] + e_F[k] * start_rates[f], radius, r[f]))
        return normal, friction

    def solve(
        self, t: float, q: Any, v: Any, u: Any, par: Any, h: float, start: Step | None = None
    ) -> Step | None:
        """Newton's method from a cold start, minimum-norm steps; None if it does not converge."""
        q, v = np.asarray(q, float), np.asarray(v, float)
        at = (t, q, v, u, par)
        M = self._jacobian(lambda x: self.e.p(t, q, x, u, par), v)
        W = self.e.W(*at)
        mobility = np.einsum("ik,ik->k", W, np.linalg.solve(M, W)) if self.n_R else np.zeros(0)
        m_eff = 1 / np.where(np.abs(mobility) > 1e-14, np.abs(mobility), 1.0)
        r_gap = np.ones(self.n_R, dtype=bool)
        r_gap[self.n_g : self.n_bilateral] = False
        r_gap[self.n_normal :] = False
        # One r for stages and end; only the rate of convergence depends on it.
        r = m_eff
        x = self._pack(
            start or Step(np.tile(v, (self.s, 1)), v.copy(), np.zeros((self.s, self.n_R)))
        )

        def residual(x: np.ndarray) -> np.ndarray:
            parts = self.residual(self._unpack(x), t, q, v, u, par, h, r)
            return np.concatenate(list(parts.values()))

        # Percussions in units of velocity: small masses must not look like a loss of rank.
        unit = np.concatenate([np.ones((self.s + 1) * self.n), np.tile(m_eff, self.s)])
        value, rows = residual(x), np.ones(1)
        for _ in range(40):
            J = self._jacobian(residual, x) * unit
            rows = np.maximum(np.max(np.abs(J), axis=1, initial=0), 1e-300)
            change = unit * np.linalg.lstsq(J / rows[:, None], -value / rows, rcond=1e-9)[0]
            best = None
            for alpha in (1.0, 0.5, 0.25, 0.1):
                trial = residual(x + alpha * change)
                if best is None or np.linalg.norm(trial) < np.linalg.norm(best[1]):
                    best = (alpha, trial)
                if np.linalg.norm(trial) < 0.7 * np.linalg.norm(value):
                    break
            assert best is not None
            x, value = x + best[0] * change, best[1]
            if not np.all(np.isfinite(x)):
                return None
            if np.max(np.abs(best[0] * change)) <= 1e-12 * max(1.0, np.max(np.abs(x))):
                break
        # Rows over their largest derivative: errors of velocities, whatever the masses are.
        scale = max(1.0, float(np.max(np.abs(x / unit))))
        return self._unpack(x) if np.max(np.abs(value) / rows) <= 1e-9 * scale else None

    def _pack(self, step: Step) -> np.ndarray:
        return np.concatenate([step.V.ravel(), step.v_end, step.R.ravel()])

    def _unpack(self, x: np.ndarray) -> Step:
        n, s = self.n, self.s
        return Step(
            x[: s * n].reshape(s, n), x[s * n : (s + 1) * n], x[(s + 1) * n :].reshape(s, self.n_R)
        )

    @staticmethod
    def _jacobian(f: Any, x: np.ndarray) -> np.ndarray:
        columns = []
        for k in range(x.size):
            d = 1e-6 * max(1.0, abs(x[k]))
            plus, minus = x.copy(), x.copy()
            plus[k] += d
            minus[k] -= d
            columns.append((f(plus) - f(minus)) / (plus[k] - minus[k]))
        return np.array(columns).T


def _friction(force: np.ndarray, slip: np.ndarray, radius: float, r: np.ndarray) -> np.ndarray:
    """R + prox_C(r gamma - R), C the ball of the given radius  (65), (66)."""
    if force.size == 0:
        return np.zeros(0)
    z = np.max(r) * slip - force
    size = float(np.sqrt(z @ z))
    if size <= radius:
        return force + z
    return force + radius * z / size
