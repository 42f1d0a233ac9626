"""Reference of Moreau's scheme with forces by the theta-method, (T9) and (T10)."""

from typing import Any, ClassVar

import numpy as np
from signorini.verify.schemes.moreau import MoreauReference


class ThetaReference(MoreauReference):
    """Forces at the start and at the end, weighted; contact laws of Moreau's scheme."""

    scheme = ("theta", "paper")
    covers = "Moreau's scheme with the theta-method, (T6), (T9), (T10)"
    equations: ClassVar[dict[str, str]] = MoreauReference.equations | {
        "end": "(T9)",
        "place": "(T10)",
    }

    @property
    def theta(self) -> float:
        return float(self.option or 0.5)

    def _end_place(self, q: Any, v: Any, v_end: Any, h: Any) -> Any:
        return np.asarray(q) + h * (self.theta * np.asarray(v_end) + (1 - self.theta) * v)

    def _force(self, v_end: np.ndarray, at: tuple[Any, ...], h: Any) -> np.ndarray:
        t, q, v, u, par = at
        before = self._force_at(at)
        after = self._force_at((t + h, self._end_place(q, v, v_end, h), v_end, u, par))
        return (1 - self.theta) * before + self.theta * after


REFERENCE = ThetaReference
