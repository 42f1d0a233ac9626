"""A time-stepping scheme as data: points where the model is evaluated, nonlinear problems made
of what was found there, and the map to the end of the step.

Everything is an `Assembly`: entries of arrays as expressions of symbols, each of which stands for a
`Ref`, a number that the step works on. What prints a program knows nothing of Lobatto, and a scheme
knows nothing of C.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.graph import Known
from signorini.codegen.sparsity import (
    Pattern,
    compress,
    elimination_order,
    factor_pattern,
    inverse,
    rows_of,
)

# Products up to which the mobilities W^T M^-1 W are written as straight-line code.
_UNROLLED_MOBILITY = 1000


# Arrays that the contact laws read, found at the start of a step: a law that asks for another
# coefficient adds it here and to the derived functions.
COEFFICIENTS = (
    ("mu", "friction coefficients"),
    ("mu_F", "friction coefficients of slip components"),
    ("e_N", "normal restitution"),
    ("e_F", "tangential restitution"),
)

WORK, STATE, CALLER, ARGUMENT, FORWARD = "work", "state", "caller", "argument", "forward"


@dataclass(frozen=True)
class Ref:
    """A number, or the first of several, that a step works on.

    Attributes
    ----------
    array : str
        Name of the array, or of the single number if there is no `index`.
    index : int or None
        Place in the array.
    owner : {"work", "state", "caller", "argument", "forward"}
        Whose array it is: scratch of the step, the state that survives it, a buffer of the caller,
        an argument of the function that reads it, or changes of the scratch along a direction.
    field : tuple (name, index) or ()
        Function and entry where the array holds the results of a `Point`.
    """

    array: str
    index: int | None = None
    owner: str = WORK
    field: tuple[str, int] | tuple[()] = ()


@dataclass(frozen=True)
class Place:
    """Where the results of a `Point` stand: a struct, or one of an array of structs."""

    name: str
    index: int | None = None
    owner: str = WORK


@dataclass(frozen=True)
class Time:
    """The time t_n + c h, or its change along a direction."""

    c: float
    owner: str = WORK


@dataclass(frozen=True)
class Parameters:
    """The parameters of the model, as an argument, or their change along a direction."""

    owner: str = WORK


class Memory:
    """The symbols that stand for the numbers of a program, one for each `Ref`."""

    def __init__(self) -> None:
        self._symbols: dict[Ref, ca.SX] = {}
        self._refs: dict[int, Ref] = {}

    def __getitem__(self, ref: Ref) -> ca.SX:
        if ref not in self._symbols:
            self._symbols[ref] = ca.SX.sym(ref.array)
            self._refs[self._symbols[ref].element_hash()] = ref
        return self._symbols[ref]

    def number(self, name: str) -> ca.SX:
        """A single number of the step, such as its size h."""
        return self[Ref(name)]

    def column(self, array: str, n: int, first: int = 0, owner: str = WORK) -> ca.SX:
        """`n` entries of an array from `first` on."""
        entries = (self[Ref(array, first + k, owner)] for k in range(n))
        return ca.vertcat(ca.SX(0, 1), *entries)

    def ref(self, symbol: ca.SX) -> Ref | None:
        """What a symbol stands for, if it is one of these."""
        return self._refs.get(symbol.element_hash())


@dataclass(frozen=True, eq=False)
class Point:
    """Model functions that are evaluated together at one point.

    Attributes
    ----------
    name : str
        Name of the C struct and of the evaluating function.
    arguments : tuple of str
        Among t, q, v, u, par, h, R, terms, at.
    fields : dict from name to SX
        Values; entries that are numbers take no storage, they are folded where used.
    after : str
        Name of the point evaluated before with the same arguments, whose struct is the argument
        ``at``.
    known : tuple of (SX, SX)
        Expressions within the fields that are read, not computed, and the arguments that hold
        them.
    """

    name: str
    arguments: tuple[str, ...]
    fields: dict[str, ca.SX]
    after: str = ""
    known: Known = ()

    def stored(self, name: str) -> list[int]:
        """Nonzeros of a field that are no plain numbers, in column-major order."""
        value = self.fields[name]
        return [k for k in range(value.nnz()) if not value.nz[k].is_constant()]

    def entries(self) -> list[ca.SX]:
        """Entries of all fields that are no plain numbers."""
        return [self.fields[name].nz[k] for name in self.fields for k in self.stored(name)]

    def at(self, memory: Memory, place: Place, name: str) -> ca.SX:
        """The field as it was found at a place."""
        value = self.fields[name]
        stored = {k: i for i, k in enumerate(self.stored(name))}
        entries = [
            memory[Ref(place.name, place.index, place.owner, (name, stored[k]))]
            if k in stored
            else value.nz[k]
            for k in range(value.nnz())
        ]
        return ca.sparsify(ca.SX(value.sparsity(), ca.vertcat(ca.SX(0, 1), *entries)))


@dataclass(frozen=True, eq=False)
class Terms:
    """Terms of a place (t, q, parameters) that evaluations there share, and what they depend on.

    Attributes
    ----------
    values, key : SX
        Columns; the terms as expressions of the symbols in `key`.
    """

    values: ca.SX
    key: ca.SX


@dataclass(frozen=True, eq=False)
class Target:
    """Entries of one array; entries not listed are zero if `fill`. `labels` say what each is."""

    array: str
    size: int
    entries: tuple[tuple[int, ca.SX], ...]
    fill: bool
    equation: str
    owner: str = WORK
    labels: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Assembly:
    """Entries of arrays, all known from what was found before."""

    name: str
    targets: tuple[Target, ...]


@dataclass(frozen=True, eq=False)
class Jacobian:
    """Derivatives of one problem: how they are stored and how they are computed.

    Attributes
    ----------
    order : tuple of int
        Elimination order of K: the velocities, then n_x + k for the bilateral percussions k.
    K, B, C, radius : Pattern
        Factors of K = [dr/dx, dr/dR; dy/dx, 0] with the bilateral percussions and rows;
        columns of B = dr/dR, rows of C = dy/dx and of d(radius)/dx for all of them.
    assembly : Assembly
        Their entries.
    """

    order: tuple[int, ...]
    K: Pattern
    B: Pattern
    C: Pattern
    radius: Pattern
    assembly: "Assembly"


@dataclass(frozen=True, eq=False)
class Inertia:
    """Mass matrix and directions of a step: elimination order, patterns, entries.

    `mobility` tells whether the arrays mass_pivot and mobility are among the targets.
    """

    order: tuple[int, ...]
    mass: Pattern
    direction: Pattern
    mobility: bool
    targets: tuple["Target", ...]


Argument = Ref | Place | Time | Parameters


@dataclass(frozen=True)
class Evaluate:
    """One evaluation of a point or of the terms of a place, called "terms"."""

    point: str
    arguments: tuple[Argument, ...]
    into: Ref | Place


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
    values : tuple of Evaluate or Assembly
        How r, y and radius are computed.
    derivatives : tuple of Evaluate or Assembly
        What is evaluated before `jacobian`.
    jacobian : Jacobian
        K, B, C and the derivatives of the radii.
    last_rows : int, optional
        How many bilateral rows the last slot has, by default all.
    alone : bool, optional
        Whether no problem comes before it: the contacts that take part are said from outside.
    """

    name: str
    equations: str
    n_x: int
    n_slots: int
    gap_slots: int
    follows: bool
    response: tuple[tuple[float, float], ...]
    values: tuple[Evaluate | Assembly, ...]
    derivatives: tuple[Evaluate | Assembly, ...]
    jacobian: Jacobian
    last_rows: int | None = None
    alone: bool = False


@dataclass(frozen=True, eq=False)
class Located:
    """What a step needs that is cut at its events, beside the problems of a step that is not.

    Attributes
    ----------
    chain : int
        How many problems, from the first, make up a step that is not cut. Behind them stand the
        problem of a segment in which contacts rub, that of accelerations, and that of an impact.
    kept : int
        How many problems, from the first, the next step starts from.
    watch : tuple of Evaluate or Assembly
        Gaps, velocities and guards at (look_t, look_q, look_v).
    finish : Assembly
        The end of a segment in which contacts rub.
    positions, velocities : ndarray, shape (s + 2, s + 2) and (s, s)
        Polynomials of the dense output, a row of coefficients each, the constant first: those of
        Q^1 ... Q^s, h v_n, h v_{n+1} and those of U^1 ... U^s.
    """

    chain: int
    kept: int
    watch: tuple[Evaluate | Assembly, ...]
    finish: Assembly
    positions: np.ndarray
    velocities: np.ndarray


@dataclass(frozen=True, eq=False)
class Forward:
    """Changes of a step along a direction; see forward.py.

    Attributes
    ----------
    seeds : dict from name to SX
        Symbols for the changes of the arguments of points.
    points : tuple of Point
        Changes of the fields of points.
    start, watch : tuple of Evaluate or Assembly
        Of what is known at the start of a step, and of gaps, velocities and guards.
    values : tuple of tuples of Evaluate or Assembly
        Of the rows of each problem.
    finish, finish_segment : Assembly
        Of the end.
    places : tuple of Assembly
        Of the places that the end of a segment is made of.
    """

    seeds: dict[str, ca.SX]
    points: tuple[Point, ...]
    start: tuple[Evaluate | Assembly, ...]
    values: tuple[tuple[Evaluate | Assembly, ...], ...]
    watch: tuple[Evaluate | Assembly, ...]
    finish: Assembly
    places: tuple[Assembly, ...]
    finish_segment: Assembly | None


@dataclass(frozen=True, eq=False)
class Scheme:
    """A scheme for one model.

    `memory` says what the symbols of its assemblies stand for.
    `terms` stand in the array terms. If the scheme `recalls`, these are of the stages 2 ... s,
    those of the last hold at the end, and those of the first are part of the state before `start`.
    `located` is there if steps can be cut at their events, `forward` if they are differentiated.
    `adaptive` tells whether steps have the order 2s - 2 through all that may happen in them: then a
    tolerance can choose their sizes.
    `stable_phase` is the smallest h omega at which a linear oscillation of frequency omega grows.
    `guarded` tells which contacts exist only while their entry of the array guard is >= 0 at the
    start of a step; by default those with a guard in the model.
    """

    name: str
    title: str
    memory: Memory
    stages: int
    points: tuple[Point, ...]
    places: tuple[tuple[str, str, int], ...]
    inertia: Inertia
    terms: Terms
    recalls: bool
    start: tuple[Evaluate | Assembly, ...]
    problems: tuple[Problem, ...]
    finish: Assembly
    record: Assembly
    coefficients: dict[str, np.ndarray] = field(default_factory=dict)
    guarded: tuple[bool, ...] | None = None
    stable_phase: float = 2.0
    located: Located | None = None
    forward: Forward | None = None
    adaptive: bool = False


def point_of(
    d: Derivation, name: str, arguments: tuple[str, ...], fields: dict[str, ca.SX]
) -> Point:
    """A point; inputs are among its arguments, before the parameters, if its fields need them."""
    commanded = any(ca.depends_on(value, d.data.u) for value in fields.values())
    if commanded and "u" not in arguments:
        behind = arguments.index("par")
        arguments = (*arguments[:behind], "u", *arguments[behind:])
    return Point(name, arguments, fields)


def evaluate(
    point: Point,
    arguments: tuple[Argument, ...],
    into: Place,
    terms: Ref | None = None,
    at: Place | None = None,
) -> Evaluate:
    """Evaluation of a point, with the inputs, the terms of its place and the results `at` another
    where it needs them."""
    further = {"terms": terms, "at": at}
    if "u" in point.arguments and Ref("u") not in arguments:
        behind = arguments.index(Parameters())
        arguments = (*arguments[:behind], Ref("u"), *arguments[behind:])
    needed = (further[name] for name in point.arguments if name in further)
    return Evaluate(point.name, (*arguments, *(a for a in needed if a is not None)), into)


def dense(array: str, value: ca.SX, equation: str, owner: str = WORK) -> Target:
    """A column, every entry assigned."""
    full = ca.densify(value)
    entries = tuple((k, full.nz[k]) for k in range(full.numel()))
    return Target(array, full.numel(), entries, False, equation, owner)


def compressed(
    array: str,
    value: ca.SX,
    pattern: Pattern,
    rows: tuple[int, ...],
    columns: tuple[int, ...],
    equation: str,
    label: Callable[[int, int], str] | None = None,
) -> Target:
    """A sparse matrix, entry by entry as `pattern` stores them; entries of fill are zero.

    `label` says what the entry of a row and a column of the matrix is.
    """
    found = compress(value, pattern, rows, columns)
    entries = tuple((place, entry) for place, entry, _ in found)
    labels = () if label is None else tuple(label(i, j) for _, _, (i, j) in found)
    return Target(array, pattern.size, entries, True, equation, labels=labels)


def jacobian(
    name: str,
    A: ca.SX,
    B: ca.SX,
    C: ca.SX,
    radius: ca.SX,
    bilateral: tuple[int, ...],
    equations: tuple[str, str, str, str],
    own: dict[int, ca.SX] | None = None,
) -> Jacobian:
    """Tables and assembly of the derivatives A = dr/dx, B = dr/dR, C = dy/dx, d(radius)/dx.

    Parameters
    ----------
    bilateral : tuple of int
        Percussions of bilateral constraints that take part.
    equations : tuple of str
        Headings of the four blocks.
    own : dict from row to SX, optional
        dy/dR of rows that yield to their own percussion.
    """
    n_x = A.shape[0]
    chosen = list(bilateral)
    yields = ca.SX(len(chosen), len(chosen))
    for k, row in enumerate(chosen):
        if own and row in own:
            yields[k, k] = own[row]
    K = ca.blockcat([[A, B[:, chosen]], [C[chosen, :], yields]])
    order = elimination_order(K.sparsity(), n_x)
    place = inverse(order)
    n_rows = tuple(range(max(B.shape[1], C.shape[0], radius.shape[0])))
    patterns = (
        factor_pattern(K.sparsity(), order),
        rows_of(B.T, place[:n_x]),
        rows_of(C, place[:n_x]),
        rows_of(radius, place[:n_x]),
    )

    def of_K(i: int, j: int) -> str:
        row = f"r[{i}]" if i < n_x else f"y[{chosen[i - n_x]}]"
        return f"d{row}/d" + (f"x[{j}]" if j < n_x else f"R[{chosen[j - n_x]}]")

    targets = tuple(
        compressed(array, value, pattern, rows, place, equation, label)
        for array, value, pattern, rows, equation, label in zip(
            ("K", "B", "C", "C_radius"),
            (K, B.T, C, radius),
            patterns,
            (place, n_rows, n_rows, n_rows),
            equations,
            (of_K, None, None, None),
            strict=True,
        )
    )
    unknowns = tuple(k if k < n_x else n_x + chosen[k - n_x] for k in order)
    return Jacobian(unknowns, *patterns, Assembly(name, targets))


def inertia(M: ca.SX, W: ca.SX, equations: tuple[str, str]) -> Inertia:
    """Tables and targets of the mass matrix and of the directions W^T at the start of a step."""
    n, n_R = W.shape
    order = elimination_order(M.sparsity(), n)
    place = inverse(order)
    mass = factor_pattern(M.sparsity(), order)
    plain = tuple(range(max(n, n_R)))
    direction = rows_of(W.T, plain[:n])
    targets = [
        compressed("mass", M, mass, place, place, equations[0]),
        compressed("direction", W.T, direction, plain, plain, equations[1]),
    ]
    products = sum(len(row) ** 2 for row in mass.rows) + mass.size * n_R
    # a coupling has no masses of its own
    unrolled = products <= _UNROLLED_MOBILITY and M.nnz() > 0
    if unrolled:
        pivots, mobility = _mobility(M, W, mass, order)
        targets += [
            dense("mass_pivot", pivots, "D of M = L D L^T, in elimination order"),
            dense("mobility", mobility, "W^T M^-1 W, direction by direction"),
        ]
    return Inertia(order, mass, direction, unrolled, tuple(targets))


def _mobility(M: ca.SX, W: ca.SX, pattern: Pattern, order: tuple[int, ...]) -> tuple[ca.SX, ca.SX]:
    """D of M = L D L^T and the diagonal of W^T M^-1 W."""
    n, n_R = W.shape
    M = M[list(order), list(order)]
    W = W[list(order), :]
    L: list[dict[int, ca.SX]] = []
    D: list[ca.SX] = []
    for i, row in enumerate(pattern.rows):
        L.append({})
        for j in (j for j in row if j <= i):
            value = M[i, j] - sum(
                (L[i][k] * D[k] * L[j][k] for k in L[j] if k in L[i]), start=ca.SX(0)
            )
            if j < i:
                L[i][j] = value / D[j]
            else:
                D.append(value)
    mobility = []
    for c in range(n_R):
        y: dict[int, ca.SX] = {}
        total = ca.SX(0)
        for i in range(n):
            known = [j for j in L[i] if j in y]
            if W.sparsity().has_nz(i, c) or known:
                y[i] = W[i, c] - sum((L[i][j] * y[j] for j in known), start=ca.SX(0))
                total += y[i] * y[i] / D[i]
        mobility.append(total)
    return ca.vertcat(*D), ca.vertcat(ca.SX(0, 1), *mobility)


def slip_rows(d: Derivation) -> list[tuple[int, int, int]]:
    """(first slip row, components, bound index) of every friction element with a given bound."""
    rows, first, bound = [], 0, 0
    for c in d.data.contacts:
        if c.bound is not None:
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
            # what goes one way is struck only where it comes backwards
            before = ca.fmin(g_N_dot[normal], 0) if c.one_way else g_N_dot[normal]
            # Poisson's restitution is one of percussions: in C
            xi_N.append(ca.SX(0) if c.poisson else e_N[k] * before)
            normal += 1
        xi_F += [e_F[k] * gamma_F[first + j] for j in range(c.n_F)]
        first += c.n_F
    return ca.vertcat(ca.SX(0, 1), *xi_N), ca.vertcat(ca.SX(0, 1), *xi_F)
