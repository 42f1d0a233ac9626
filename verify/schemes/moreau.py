"""Reference of Moreau's midpoint scheme, (T5) to (T7) of the theory page."""

from typing import Any, ClassVar

import numpy as np
from signorini.codegen.frontend.model import Model
from signorini.verify.reference import Reference, Step, Unknowns


class MoreauReference(Reference):
    """One evaluation at the middle; contacts on velocity level."""

    scheme = ("moreau", "paper")
    numbered = False
    covers = "Moreau's midpoint scheme, (T5) to (T7)"
    equations: ClassVar[dict[str, str]] = {
        "end": "(T5)",
        "place": "(T7)",
        "bilateral": "g_dot, gamma  (T6)",
        "normal": "(T6), normal",
        "friction": "(T6), friction",
    }

    def __init__(self, model: Model, stages: int, high: bool = False, option: str = "") -> None:
        super().__init__(model, 2, high=high, option=option)

    @property
    def problems(self) -> dict[str, Unknowns]:
        return {"velocity": Unknowns(slice(0, self.n), slice(0, self.n_R))}

    def _middle(self, at: tuple[Any, ...], h: Any) -> tuple[Any, Any]:
        t, q, v, _, _ = at
        return t + h / 2, q + h / 2 * v

    def equations_of(
        self, problem: str, x: np.ndarray, lam: np.ndarray, at: tuple[Any, ...], h: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        _, _, v, u, par = at
        middle = self._middle(at, h)
        here, there = (*middle, v, u, par), (*middle, x, u, par)
        force = self._force(x, at, h)
        r = self.e.p(*there) - self.e.p(*here) - h * force - self.e.W(*here) @ lam
        xi = np.array(self.e.y_dot(*there), dtype=object if self.e.high else float)
        e_N, e_F = self.restitution(here)
        before = self.struck(self.e.y_dot(*here))
        xi[self.n_bilateral : self.n_normal] += e_N * before[self.n_bilateral : self.n_normal]
        xi[self.n_normal :] += e_F * before[self.n_normal :]
        return r, xi

    def _end_place(self, q: Any, v: Any, v_end: Any, h: Any) -> Any:
        return np.asarray(q) + h / 2 * (np.asarray(v) + v_end)

    def _force(self, v_end: np.ndarray, at: tuple[Any, ...], h: Any) -> np.ndarray:
        """What changes the momenta."""
        _, _, v, u, par = at
        return self._force_at((*self._middle(at, h), v, u, par))

    def _force_at(self, at: tuple[Any, ...]) -> np.ndarray:
        """dL/dq + f - p_q v - p_t."""
        t, q, v, u, par = at
        step = self._tiny()
        plus = self.e.p(t + step, q + step * v, v, u, par)
        carried = (plus - self.e.p(t - step, q - step * v, v, u, par)) / (2 * step)
        return np.asarray(self.e.L_q(*at) + self.e.value("f", *at) - carried)

    def _tiny(self) -> Any:
        if self.e.high:
            import mpmath as mp

            return mp.mpf(10) ** -15
        return 1e-6

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
        r = np.ones(self.n_R) if r is None else r
        at = (t, q, v, u, par)
        middle = self._middle(at, h)
        P = step.R[-1]
        momentum, xi = self.equations_of("velocity", step.v_end, P, at, h)
        gaps = self.e.value("g_N", *middle, v, u, par)
        here = (*middle, v, u, par)
        mu, guard = self.e.value("mu", *here), self.e.value("guard", *here)
        mu_F = self.mu_F(*here)
        bounds = np.maximum(self.e.value("bound", *middle, v, u, par), 0)
        normal, friction = [], []
        acting: dict[int, bool] = {}
        for k, (n, f, bound, p, load) in enumerate(self.rows):
            exists = self.e.contacts[k].guard is None or guard[k] >= 0
            if n is not None:
                free = gaps[n - self.n_bilateral] > 0 and not self.e.contacts[k].one_way
                acting[n] = exists and not free
                normal.append(P[n] + min(r[n] * xi[n] - P[n], 0) if acting[n] else P[n])
                if self.e.contacts[k].impact == "poisson":
                    normal[-1] = 0.0
            if load is not None:
                radius = mu[k] * float(np.linalg.norm(P[load]))
            elif p is None:
                radius = h * bounds[bound]
            else:
                radius = mu[k] * max(P[p], 0.0) if acting[p] else 0.0
            rub = self.friction(k, P[f], np.asarray(xi[f], float), radius, r, mu_F)
            friction.append(0 * rub if self.e.contacts[k].impact == "poisson" else rub)
        return {
            "end": momentum,
            **self._place(step, self._end_place(q, v, step.v_end, h)),
            "bilateral": xi[: self.n_bilateral],
            "normal": np.array(normal, dtype=float),
            "friction": np.concatenate([np.zeros(0), *friction]),
        }

    def sizes(
        self, step: Step, t: float, q: Any, v: Any, u: Any, par: Any, h: float, r: np.ndarray
    ) -> dict[str, np.ndarray]:
        whole = Step(np.array([v, step.v_end]), step.v_end, np.array([step.R[-1]] * 2))
        sizes = super().sizes(whole, t, q, v, u, par, h, r)
        s = self.s
        per_friction, first = [], 0
        for _, f, *_ in self.rows:
            width = f.stop - f.start
            per_friction.append(sizes["friction"][first : first + width])
            first += s * width
        return {
            "end": sizes["end"],
            "place": sizes["place"],
            "bilateral": sizes["bilateral"][-self.n_bilateral :]
            if self.n_bilateral
            else np.zeros(0),
            "normal": sizes["normal"][::s],
            "friction": np.concatenate([np.zeros(0), *per_friction]),
        }

    def solve(self, *arguments: Any, **more: Any) -> None:
        """Steps of this scheme are verified, not solved anew."""
        return


REFERENCE = MoreauReference
