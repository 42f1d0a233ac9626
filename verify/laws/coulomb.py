"""Coulomb's law: friction lies in a ball, (57)."""

import numpy as np


class Coulomb:
    """|P| <= radius, against the slip while there is slip."""

    name = "coulomb"

    def residual(
        self, P: np.ndarray, slip: np.ndarray, radius: float, r: float, mu_F: np.ndarray
    ) -> np.ndarray:
        """P + prox_C(r slip - P), C the ball of the given radius  (65), (66)."""
        if P.size == 0:
            return np.zeros(0)
        z = r * slip - P
        size = float(np.sqrt(z @ z))
        if size <= radius:
            return P + z
        return P + radius * z / size

    def size(self, P: np.ndarray, mu_F: np.ndarray) -> np.ndarray:
        """|P|."""
        return np.linalg.norm(np.asarray(P, dtype=float), axis=-1)

    def rate(self, slip: np.ndarray, mu_F: np.ndarray) -> np.ndarray:
        """|slip|."""
        return np.linalg.norm(np.asarray(slip, dtype=float), axis=-1)


LAW = Coulomb()
