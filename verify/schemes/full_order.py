"""Reference of velocity constraints at full order, (T1) to (T4) of the theory page."""

from typing import Any, ClassVar

import mpmath as mp
import numpy as np
from signorini.codegen.frontend.model import Model
from signorini.verify.expressions import DIGITS, Expressions
from signorini.verify.reference import Reference, Step, Unknowns


class FullOrderReference(Reference):
    """The scheme for a model without contacts, gamma = 0 at auxiliary velocities U^i."""

    scheme = ("lobatto", "full_order")
    covers = "velocity constraints at full order, (47b), (47d), (47f), (48), (T1) to (T4)"
    equations: ClassVar[dict[str, str]] = {
        "momentum": "(47b)",
        "end": "(47d)",
        "place": "(47a)",
        "bilateral": "(47f), (48), (T2)",
        "start": "R_gamma^1 = h lambda_n  (T3), (T4)",
    }

    def __init__(self, model: Model, stages: int, high: bool = False, option: str = "") -> None:
        super().__init__(model, stages, high=high, option=option)
        self.exact = self.e if high else Expressions(model, True)

    @property
    def problems(self) -> dict[str, Unknowns]:
        n, s, n_R = self.n, self.s, self.n_R
        return {
            "start": Unknowns(slice(0, n), slice(0, n_R)),
            "whole": Unknowns(slice(n, 2 * s * n), slice(n_R, (s + 1) * n_R)),
        }

    def equations_of(
        self, problem: str, x: np.ndarray, lam: np.ndarray, at: tuple[Any, ...], h: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        n, s, n_R, n_g = self.n, self.s, self.n_R, self.n_g
        if problem == "start":
            return self.acceleration_rows(x[:n], lam[:n_R], at, h)
        V = x[n : (s + 1) * n].reshape(s, n)
        U = x[(s + 1) * n :].reshape(s - 1, n)
        slots = lam[n_R:].reshape(s, n_R)
        R = slots.copy()
        R[0, n_g:] = lam[n_g:n_R]
        R[1:, n_g:] = slots[:-1, n_g:]
        momentum, places, here = self._momenta(Step(V, U[-1], R), at, h)
        auxiliary, kinematic = self._auxiliary(U, here, at)
        rates = self.e.dot("g", here["times"][-1], here["Q"][-1], U[-1], *at[3:])
        y = [np.concatenate([places[i], kinematic[i - 1]]) for i in range(1, s)]
        y.append(np.concatenate([rates, np.zeros(n_R - n_g)]))
        return np.concatenate([*momentum, *auxiliary]), np.concatenate(y)

    # --- pieces ----------------------------------------------------------------------------------

    def _momenta(self, step: Step, at: tuple[Any, ...], h: Any) -> Any:
        """Rows (47b), g at the stages, and what the auxiliary velocities need."""
        e, s = self.e, self.s
        t, q, _, u, par = at
        times = [t + c * h for c in self.c]
        Q = [q + h * (self.a[i] @ step.V) for i in range(s)]
        stages = [(times[i], Q[i], step.V[i], u, par) for i in range(s)]
        F = self.forces(step, stages, h)
        p_n = e.p(*at)
        momentum = [
            e.p(*stages[i]) - p_n - sum(self.a_hat[i, j] * F[j] for j in range(s)) for i in range(s)
        ]
        goals = [p_n + sum(self.a[i, j] * F[j] for j in range(s)) for i in range(s)]
        places = [e.value("g", *stages[i]) for i in range(s)]
        return momentum, places, {"times": times, "Q": Q, "goals": goals, "stages": stages}

    def _auxiliary(self, U: np.ndarray, here: Any, at: tuple[Any, ...]) -> Any:
        """(T1) and gamma (T2) at the auxiliary velocities of the stages 2 ... s."""
        rows, kinematic = [], []
        for i in range(1, self.s):
            place = (here["times"][i], here["Q"][i], U[i - 1], *at[3:])
            rows.append(self.e.p(*place) - here["goals"][i])
            kinematic.append(self.e.value("gamma", *place))
        return rows, kinematic

    def start_percussion(self, at: tuple[Any, ...], h: float) -> np.ndarray:
        """h lambda of the constraints at t_n, solved for in 50 digits."""
        with mp.workdps(DIGITS):
            exact = [np.array([mp.mpf(x) for x in np.atleast_1d(part)], object) for part in at[1:4]]
            there = (mp.mpf(at[0]), *exact, at[4])
            n, n_R = self.n, self.n_R
            own, self.e = self.e, self.exact
            try:
                one = np.array([mp.mpf(0)] * (n + n_R), object)

                def rows(z: np.ndarray) -> np.ndarray:
                    return np.concatenate(self.acceleration_rows(z[:n], z[n:], there, mp.mpf(h)))

                base = rows(one)
                J = []
                for k in range(n + n_R):
                    z = one.copy()
                    z[k] = mp.mpf(1)
                    J.append(rows(z) - base)
            finally:
                self.e = own
            J_double = np.array(J, dtype=float).T
            solution = np.linalg.lstsq(J_double, -np.array(base, dtype=float), rcond=1e-12)[0]
        return solution[n + self.n_g :]

    # --- a whole step ----------------------------------------------------------------------------

    def _aux_velocities(self, step: Step, here: Any, at: tuple[Any, ...]) -> np.ndarray:
        """U^i from their momenta (T1), by Newton's method."""
        U = np.array([step.V[i] for i in range(1, self.s)], dtype=float)
        for i in range(1, self.s):
            place, goal = (here["times"][i], here["Q"][i]), here["goals"][i]
            for _ in range(20):
                wrong = np.asarray(self.e.p(*place, U[i - 1], *at[3:]) - goal, dtype=float)
                M = self.mass((*place, U[i - 1], *at[3:]))
                change = np.linalg.solve(M, wrong)
                U[i - 1] -= change
                if np.max(np.abs(change)) <= 1e-14 * max(np.max(np.abs(U)), 1e-300):
                    break
        return U

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
        at = (t, q, v, u, par)
        momentum, places, here = self._momenta(step, at, h)
        U = self._aux_velocities(step, here, at)
        end = (here["times"][-1], here["Q"][-1], step.v_end, u, par)
        kinematic = [
            self.e.value("gamma", here["times"][i], here["Q"][i], U[i - 1], u, par)
            for i in range(1, self.s)
        ]
        bilateral = [np.concatenate([places[i], kinematic[i - 1]]) for i in range(1, self.s)]
        bilateral.append(np.concatenate([self.e.dot("g", *end), self.e.value("gamma", *end)]))
        return {
            "momentum": np.concatenate(momentum),
            "end": self.e.p(*end) - here["goals"][-1],
            **self._place(step, here["Q"][-1]),
            "bilateral": np.concatenate(bilateral),
            "start": step.R[0, self.n_g :] - self.start_percussion(at, h),
        }

    def sizes(
        self, step: Step, t: float, q: Any, v: Any, u: Any, par: Any, h: float, r: np.ndarray
    ) -> dict[str, np.ndarray]:
        sizes = super().sizes(step, t, q, v, u, par, h, r)
        at = (t, q, v, u, par)
        speed = sizes["bilateral"][-self.n_bilateral :]
        masses = self.effective_masses(at)[self.n_g : self.n_bilateral]
        largest = np.max(np.abs(step.R), initial=0.0)
        start = masses * speed[self.n_g :] + np.max(np.abs(step.R[:, self.n_g :]), initial=0.0)
        return {
            **{name: sizes[name] for name in ("momentum", "end", "place", "bilateral")},
            "start": np.maximum(start, 1e-6 * largest),
        }

    def solve(self, *arguments: Any, **more: Any) -> None:
        """Steps of this form are verified, not solved anew."""
        return


REFERENCE = FullOrderReference
