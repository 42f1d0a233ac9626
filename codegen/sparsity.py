"""Sparse matrices as tables: elimination order, pattern of the factors, compressed rows."""

from dataclasses import dataclass
from functools import cached_property

import casadi as ca


@dataclass(frozen=True)
class Pattern:
    """Rows of a matrix in compressed form.

    Attributes
    ----------
    rows : tuple of tuple of int
        For every row the columns that are stored, ascending.
    n_columns : int
        Number of columns.
    """

    rows: tuple[tuple[int, ...], ...]
    n_columns: int

    @cached_property
    def start(self) -> tuple[int, ...]:
        """Place of the first entry of every row, and the number of entries."""
        starts = [0]
        for row in self.rows:
            starts.append(starts[-1] + len(row))
        return tuple(starts)

    @cached_property
    def index(self) -> tuple[int, ...]:
        """Column of every entry."""
        return tuple(j for row in self.rows for j in row)

    @cached_property
    def diagonal(self) -> tuple[int, ...]:
        """Place of the diagonal entry of every row of a square pattern that holds them all."""
        return tuple(self.start[i] + row.index(i) for i, row in enumerate(self.rows))

    @property
    def size(self) -> int:
        """Number of entries."""
        return self.start[-1]


def elimination_order(sparsity: ca.Sparsity, n_first: int) -> tuple[int, ...]:
    """Order of least fill by minimum degree on the pattern of A + A^T; ties as they stand.

    The first `n_first` unknowns go before all others: a multiplier has no pivot of its own until
    the unknowns that it acts on are eliminated.
    """
    n = sparsity.size1()
    neighbours: list[set[int]] = [set() for _ in range(n)]
    for i, j in zip(sparsity.row(), sparsity.get_col(), strict=True):
        if i != j:
            neighbours[i].add(j)
            neighbours[j].add(i)
    left = set(range(n))
    order = []
    while left:
        best = min(left, key=lambda k: (k >= n_first, len(neighbours[k]), k))
        left.remove(best)
        order.append(best)
        around = neighbours[best]
        for k in around:
            neighbours[k] |= around
            neighbours[k] -= {k, best}
    return tuple(order)


def factor_pattern(sparsity: ca.Sparsity, order: tuple[int, ...]) -> Pattern:
    """Pattern of L + U of the reordered matrix, pivots on the diagonal; symmetric."""
    n = len(order)
    place = {unknown: k for k, unknown in enumerate(order)}
    later: list[set[int]] = [set() for _ in range(n)]
    for i, j in zip(sparsity.row(), sparsity.get_col(), strict=True):
        low, high = sorted((place[i], place[j]))
        if low != high:
            later[low].add(high)
    for k in range(n):
        if later[k]:
            first = min(later[k])
            later[first] |= later[k] - {first}
    rows: list[set[int]] = [{k} | later[k] for k in range(n)]
    for k in range(n):
        for j in later[k]:
            rows[j].add(k)
    return Pattern(tuple(tuple(sorted(row)) for row in rows), n)


def compress(
    value: ca.SX, pattern: Pattern, rows: tuple[int, ...], columns: tuple[int, ...]
) -> list[tuple[int, ca.SX, tuple[int, int]]]:
    """Entries of a matrix with their places in a pattern, and their row and column in the matrix.

    Parameters
    ----------
    rows, columns : tuple of int
        Row and column of the pattern in which a row and a column of the matrix stand.
    """
    where = {
        (i, j): pattern.start[i] + k
        for i, row in enumerate(pattern.rows)
        for k, j in enumerate(row)
    }
    sparsity = value.sparsity()
    entries = [
        (where[rows[i], columns[j]], value.nz[k], (i, j))
        for k, (i, j) in enumerate(zip(sparsity.row(), sparsity.get_col(), strict=True))
    ]
    return sorted(entries, key=lambda e: e[0])


def rows_of(value: ca.SX, columns: tuple[int, ...]) -> Pattern:
    """Pattern of the rows of a matrix, its columns renumbered."""
    rows: list[list[int]] = [[] for _ in range(value.shape[0])]
    sparsity = value.sparsity()
    for i, j in zip(sparsity.row(), sparsity.get_col(), strict=True):
        rows[i].append(columns[j])
    return Pattern(tuple(tuple(sorted(row)) for row in rows), value.shape[1])


def inverse(order: tuple[int, ...]) -> tuple[int, ...]:
    """Position of every unknown in an order."""
    positions = [0] * len(order)
    for k, unknown in enumerate(order):
        positions[unknown] = k
    return tuple(positions)
