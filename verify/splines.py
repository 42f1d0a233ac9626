"""Tables once more: the same splines from their second derivatives at the points (moments)."""

import math
from typing import Any

import numpy as np
from signorini.codegen.frontend.table import Table


class Spline:
    """Corner and coefficients of the cells of a table, and its derivatives, in any arithmetic."""

    def __init__(self, table: Table) -> None:
        self.points = table.points
        self.ends = table.ends
        pieces = [_pieces(p, e) for p, e in zip(table.points, table.ends, strict=True)]
        if len(pieces) == 1:
            self.coefficients = np.einsum("ika,a->ik", pieces[0], table.values)
        else:
            self.coefficients = np.einsum("ika,jlb,ab->ijkl", pieces[0], pieces[1], table.values)

    def cell(self, x: list[Any]) -> list[Any]:
        """Corner and coefficients of the cell of `x`, whose real parts decide."""
        where = [self._where(k, number.real) for k, number in enumerate(x)]
        corner = [self.points[k][max(i - 1, 0)] for k, i in enumerate(where)]
        return [*map(float, corner), *map(float, self.coefficients[tuple(where)].ravel())]

    def derivative(self, orders: tuple[int, ...], *x: Any) -> Any:
        """A derivative at real numbers `x`."""
        inside = [self._inside(k, number) for k, number in enumerate(x)]
        n = len(inside)
        numbers = self.cell(inside)
        flat = [
            math.perm(k, orders[a]) * (inside[a] - numbers[a]) ** max(k - orders[a], 0)
            for a in range(n)
            for k in range(4)
        ]
        if n == 1:
            return sum(c * p for c, p in zip(numbers[1:], flat, strict=True))
        return sum(
            numbers[2 + 4 * k + m] * flat[k] * flat[4 + m] for k in range(4) for m in range(4)
        )

    def _where(self, k: int, x: Any) -> int:
        return sum(1 for p in self.points[k] if p <= x)

    def _inside(self, k: int, x: Any) -> Any:
        if self.ends[k] != "periodic":
            return x
        first, last = (float(self.points[k][j]) for j in (0, -1))
        return x - (last - first) * math.floor((x - first) / (last - first))


def _pieces(x: np.ndarray, ends: str) -> np.ndarray:
    """Coefficients [cell, power, point] of y_i + ... from the moments M = y'' at the points."""
    n = x.size
    h = np.diff(x)
    unit = np.eye(n)
    delta = np.diff(unit, axis=0) / h[:, None]
    left, right = np.zeros((n, n)), np.zeros((n, n))
    for i in range(1, n - 1):
        left[i, i - 1 : i + 2] = h[i - 1], 2 * (h[i - 1] + h[i]), h[i]
        right[i] = 6 * (delta[i] - delta[i - 1])
    if ends == "natural":
        left[0, 0] = left[-1, -1] = 1
    elif ends == "not-a-knot":
        left[0, :3] = -1 / h[0], 1 / h[0] + 1 / h[1], -1 / h[1]
        left[-1, -3:] = -1 / h[-2], 1 / h[-2] + 1 / h[-1], -1 / h[-1]
    else:
        left[0, 0], left[0, -1] = 1, -1
        left[-1, 0] += 2 * h[0]
        left[-1, 1] += h[0]
        left[-1, -1] += 2 * h[-1]
        left[-1, -2] += h[-1]
        right[-1] = 6 * (delta[0] - delta[-1])
    M = np.linalg.solve(left, right)
    pieces = np.zeros((n + 1, 4, n))
    for i in range(n - 1):
        slope = delta[i] - h[i] * (2 * M[i] + M[i + 1]) / 6
        pieces[i + 1] = unit[i], slope, M[i] / 2, (M[i + 1] - M[i]) / (6 * h[i])
    end = delta[-1] + h[-1] * (M[-2] + 2 * M[-1]) / 6
    pieces[0, :3] = unit[0], pieces[1, 1], M[0] / 2
    pieces[n, :3] = unit[-1], end, M[-1] / 2
    return pieces
