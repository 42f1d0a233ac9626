"""A time-stepping scheme as data: points where the model is evaluated, nonlinear problems made
of what was found there, and the map to the end of the step.

Everything is an `Assembly`: entries of arrays of the work struct as expressions of symbols that
are C lvalues. The emitter prints them; it knows nothing of Lobatto.
"""

from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from signorini.codegen.derive import Derivation


@dataclass(frozen=True, eq=False)
class Point:
    """Model functions that are evaluated together at one point.

    Attributes
    ----------
    name : str
        Name of the C struct and of the evaluating function.
    arguments : tuple of str
        Among t, q, v, u, par, h, R.
    fields : dict from name to SX
        Values; entries that are numbers take no storage, they are folded where used.
    """

    name: str
    arguments: tuple[str, ...]
    fields: dict[str, ca.SX]

    def stored(self, name: str) -> list[int]:
        """Nonzeros of a field that are no plain numbers, in column-major order."""
        value = self.fields[name]
        return [k for k in range(value.nnz()) if not value.nz[k].is_constant()]

    def at(self, place: str, name: str) -> ca.SX:
        """The field as SX whose nonzeros are the C lvalues ``place.name[k]``."""
        value = self.fields[name]
        stored = {k: i for i, k in enumerate(self.stored(name))}
        entries = [
            ca.SX.sym(f"{place}.{name}[{stored[k]}]") if k in stored else value.nz[k]
            for k in range(value.nnz())
        ]
        return ca.sparsify(ca.SX(value.sparsity(), ca.vertcat(ca.SX(0, 1), *entries)))


@dataclass(frozen=True, eq=False)
class Target:
    """Entries of one array of the work struct; entries not listed are zero if `fill`."""

    array: str
    size: int
    entries: tuple[tuple[int, ca.SX], ...]
    fill: bool
    equation: str


@dataclass(frozen=True, eq=False)
class Assembly:
    """Straight-line code that fills arrays of the work struct."""

    name: str
    targets: tuple[Target, ...]


@dataclass(frozen=True)
class Call:
    """One evaluation of a point: arguments as C text, and where the result goes."""

    point: str
    arguments: tuple[str, ...]
    place: str


@dataclass(frozen=True, eq=False)
class Problem:
    """One nonlinear problem.

    Attributes
    ----------
    name : str
        "position" or "velocity".
    n_x, n_slots : int
        Smooth unknowns (blocks of velocities) and groups of percussions.
    gap_slots : int
        In how many slots, from the first, the rows of g and g_N are gaps; velocities in the rest.
    follows : bool
        Only contacts that the previous problem left closed take part.
    response : tuple of (mpf, mpf)
        For every slot the response of gap / h and of slip velocity to the own percussion.
    values, derivatives : tuple of Call or Assembly
        How r, y, radius and A, B, C, C_radius are computed.
    last_rows : int, optional
        How many bilateral rows the last slot has, by default all.
    opening : bool
        The problem finds the constraint forces at the start that later steps carry along.
    """

    name: str
    equations: str
    n_x: int
    n_slots: int
    gap_slots: int
    follows: bool
    response: tuple[tuple[float, float], ...]
    values: tuple[Call | Assembly, ...]
    derivatives: tuple[Call | Assembly, ...]
    last_rows: int | None = None
    opening: bool = False


@dataclass(frozen=True, eq=False)
class Scheme:
    """A scheme for one model.

    `guarded` tells which contacts exist only while their entry of work.guard is >= 0 at the start
    of a step; by default those with a guard in the model.
    """

    name: str
    title: str
    stages: int
    points: tuple[Point, ...]
    places: tuple[tuple[str, str, int], ...]
    start: tuple[Call | Assembly, ...]
    problems: tuple[Problem, ...]
    finish: Assembly
    record: Assembly
    coefficients: dict[str, np.ndarray] = field(default_factory=dict)
    guarded: tuple[bool, ...] | None = None


def column(name: str, n: int, offset: int = 0) -> ca.SX:
    """A column of symbols that are the C lvalues ``name[offset]`` ..."""
    return ca.vertcat(ca.SX(0, 1), *(ca.SX.sym(f"{name}[{offset + k}]") for k in range(n)))


def dense(array: str, value: ca.SX, equation: str) -> Target:
    """A column, every entry assigned."""
    full = ca.densify(value)
    entries = tuple((k, full.nz[k]) for k in range(full.numel()))
    return Target(array, full.numel(), entries, False, equation)


def matrix(array: str, value: ca.SX, equation: str, order: str = "row") -> Target:
    """A matrix of which only the structural nonzeros are assigned, the rest filled with zero."""
    rows, columns = value.shape
    entries = []
    sparsity = value.sparsity()
    for k, (i, j) in enumerate(zip(sparsity.row(), sparsity.get_col(), strict=True)):
        index = i * columns + j if order == "row" else j * rows + i
        entries.append((index, value.nz[k]))
    return Target(array, rows * columns, tuple(sorted(entries, key=lambda e: e[0])), True, equation)


def slip_rows(d: Derivation) -> list[tuple[int, int, int]]:
    """(first slip row, components, bound index) of every friction element with a given bound."""
    rows, first, bound = [], 0, 0
    for c in d.data.contacts:
        if c.g_N is None:
            rows.append((first, c.n_F, bound))
            bound += 1
        first += c.n_F
    return rows


def restitution(
    d: Derivation, g_N_dot: ca.SX, gamma_F: ca.SX, e_N: ca.SX, e_F: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """e_N g_N_dot and e_F gamma_F, row by row; e_N and e_F have an entry for every contact."""
    xi_N, xi_F = [], []
    normal = first = 0
    for k, c in enumerate(d.data.contacts):
        if c.g_N is not None:
            xi_N.append(e_N[k] * g_N_dot[normal])
            normal += 1
        xi_F += [e_F[k] * gamma_F[first + j] for j in range(c.n_F)]
        first += c.n_F
    return ca.vertcat(ca.SX(0, 1), *xi_N), ca.vertcat(ca.SX(0, 1), *xi_F)
