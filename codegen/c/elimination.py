"""Straight-line code of a sparse elimination: one statement per entry of the factors."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from textwrap import wrap

from signorini.codegen.sparsity import Pattern

# Products of a factorisation up to which straight-line code is written, about 25 bytes each on
# x86-64; beyond it the tables of the runtime are used.
UNROLLED = 1500
ZERO = "SG_C(0.0)"


@dataclass(frozen=True)
class Elimination:
    """Statements on ``K`` (the matrix), ``F`` (its factors) and ``b`` (right-hand side).

    Attributes
    ----------
    first, border : tuple of str
        Rows of the velocities, then of the bilateral percussions.
    solve : tuple of str
        Forward and backward substitution with all of them.
    products : int
        Products of the factorisation.
    """

    first: tuple[str, ...]
    border: tuple[str, ...]
    solve: tuple[str, ...]
    products: int


def eliminate(pattern: Pattern, n_first: int, entries: frozenset[int]) -> Elimination:
    """Write the elimination without exchange of rows; inverses of pivots stand on the diagonal.

    Parameters
    ----------
    pattern : Pattern
        Pattern of the factors.
    n_first : int
        Number of velocities.
    entries : frozenset of int
        Places that hold an entry of the matrix; fill elsewhere.
    """
    place = {
        (i, j): pattern.start[i] + k
        for i, row in enumerate(pattern.rows)
        for k, j in enumerate(row)
    }
    products = 0
    lines: tuple[list[str], list[str]] = ([], [])
    known = set()  # places that are not zero
    for i, row in enumerate(pattern.rows):
        for j in row:
            at = place[i, j]
            pairs = [
                (place[i, k], place[k, j])
                for k in row
                if k < min(i, j) and place[i, k] in known and place.get((k, j)) in known
            ]
            products += len(pairs)
            start = f"K[{at}]" if at in entries else ""
            terms = [f"F[{a}] * F[{b}]" for a, b in pairs]
            if start or terms or i == j:
                known.add(at)
            value = _difference(start, terms)
            if j < i and at in known:
                value = f"{_bracket(value, terms)} * F[{place[j, j]}]"
            elif j == i:
                value = f"SG_C(1.0) / {_bracket(value, terms)}"
            lines[i >= n_first].append(f"F[{at}] = {value};")
    solve = _solve(pattern, {ij: at for ij, at in place.items() if at in known})
    return Elimination(_folded(lines[0]), _folded(lines[1]), _folded(solve), products)


def _folded(lines: Iterable[str]) -> tuple[str, ...]:
    """Statements of several lines where they are long."""
    return tuple(part for line in lines for part in wrap(line, 88, subsequent_indent="    "))


def _solve(pattern: Pattern, place: dict[tuple[int, int], int]) -> Iterator[str]:
    n = len(pattern.rows)
    for i in range(n):
        terms = [f"F[{place[i, j]}] * b[{j}]" for j in range(i) if (i, j) in place]
        if terms:
            yield f"b[{i}] = {_difference(f'b[{i}]', terms)};"
    for i in reversed(range(n)):
        terms = [f"F[{place[i, j]}] * b[{j}]" for j in range(i + 1, n) if (i, j) in place]
        value = _bracket(_difference(f"b[{i}]", terms), terms)
        yield f"b[{i}] = {value} * F[{place[i, i]}];"


def _difference(start: str, terms: list[str]) -> str:
    if not terms:
        return start or ZERO
    return " - ".join([start, *terms]) if start else "-" + " - ".join(terms)


def _bracket(value: str, terms: list[str]) -> str:
    return f"({value})" if terms else value
