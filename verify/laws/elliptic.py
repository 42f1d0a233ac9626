"""Anisotropic friction: friction lies in an ellipse along the slip components."""

import numpy as np

_STEPS = 200


class Elliptic:
    """|(P_1 / mu_1, P_2 / mu_2)| <= P_N, with the largest dissipation (normality)."""

    name = "elliptic"

    def residual(
        self, P: np.ndarray, slip: np.ndarray, radius: float, r: float, mu_F: np.ndarray
    ) -> np.ndarray:
        """P + prox_C(r slip - P), C the ellipse: the nearest point, by Lagrange's multiplier."""
        z = r * slip - P
        if not radius > 0:
            return P + 0 * z
        axes = radius * _axes(mu_F)
        if np.sum((z / axes) ** 2) <= 1:
            return P + z
        # x = axes^2 z / (axes^2 + s) with |x / axes| = 1; convex in s, so Newton never goes too far
        s = 0.0
        for _ in range(_STEPS):
            x = axes * z / (axes**2 + s)
            over = np.sum(x**2) - 1
            change = over / (2 * np.sum(x**2 / (axes**2 + s)))
            s = s + change
            if abs(change) <= 1e-15 * s:
                break
        return P + axes**2 * z / (axes**2 + s)

    def size(self, P: np.ndarray, mu_F: np.ndarray) -> np.ndarray:
        """|(P_1 / a_1, P_2 / a_2)| with semi-axes relative to the larger one."""
        return np.linalg.norm(np.asarray(P, dtype=float) / _axes(mu_F), axis=-1)

    def rate(self, slip: np.ndarray, mu_F: np.ndarray) -> np.ndarray:
        """|(a_1 slip_1, a_2 slip_2)|: the support function of the ellipse."""
        return np.linalg.norm(np.asarray(slip, dtype=float) * _axes(mu_F), axis=-1)


def _axes(mu_F: np.ndarray) -> np.ndarray:
    """Semi-axes relative to the larger one; where there is no friction any will do."""
    top = np.max(mu_F)
    return np.asarray(mu_F / top if top > 0 else np.ones_like(mu_F), dtype=float)


LAW = Elliptic()
