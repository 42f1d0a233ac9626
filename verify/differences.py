"""Rows and derivatives of a problem of the reference, by differences in 50 digits."""

from typing import Any

import mpmath as mp
import numpy as np
from signorini.verify.expressions import DIGITS
from signorini.verify.reference import Reference


def by_differences(
    reference: Reference,
    problem: str,
    at: tuple[Any, ...],
    h: float,
    x: np.ndarray,
    lam: np.ndarray,
) -> dict[str, np.ndarray]:
    """r, y, A = dr/dx, B = dr/dR, C = dy/dx of one problem at unknowns of all of them."""
    where = reference.problems[problem]
    with mp.workdps(DIGITS):
        exact = np.vectorize(mp.mpf, otypes=[object])

        def vector(values: np.ndarray) -> np.ndarray:
            return exact(values) if np.size(values) else np.zeros(0, dtype=object)

        t, q, v, u, par = at
        start = (mp.mpf(t), vector(q), vector(v), u, par)
        h = mp.mpf(h)
        xs, lams = vector(x), vector(lam)

        def rows(x: np.ndarray, lam: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return reference.equations_of(problem, x, lam, start, h)

        here = rows(xs, lams)
        step = mp.mpf(10) ** -20
        A, B, C = [], [], []
        for k in range(*where.x.indices(x.size)):
            plus, minus = xs.copy(), xs.copy()
            plus[k] += step
            minus[k] -= step
            (r_plus, y_plus), (r_minus, y_minus) = rows(plus, lams), rows(minus, lams)
            A.append((r_plus - r_minus) / (2 * step))
            C.append((y_plus - y_minus) / (2 * step))
        for k in range(*where.lam.indices(lam.size)):
            plus = lams.copy()
            plus[k] += 1
            B.append(rows(xs, plus)[0] - here[0])

        def number(value: Any, *shape: int) -> np.ndarray:
            return np.array(value, dtype=float).reshape(shape)

        n_r, n_y = len(here[0]), len(here[1])
        return {
            "r": number(here[0], n_r),
            "y": number(here[1], n_y),
            "A": number(A, len(A), n_r).T,
            "B": number(B, len(B), n_r).T,
            "C": number(C, len(C), n_y).T,
        }
