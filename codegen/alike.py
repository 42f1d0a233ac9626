"""Expressions that differ in their numbers alone: one expression with constants in their place.

Every expression is read as a number times something without one: a symbol, a sum of such terms, a
product, a function of them. Two expressions have the same form if they are the same once all
numbers are taken out; those that nobody wrote, 1 and -1, are numbers like others. What they have in
common is then their generalisation: it has every number that is the same in all of them, and a
constant wherever one differs.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
from signorini.codegen.graph import Operations

_ONE = 0  # the core of a plain number


@dataclass(frozen=True)
class _Core:
    """What a number is multiplied with: an operation on terms, each a number and another core.

    `fixed` is a number that stays one, because derivatives depend on which: an exponent.
    """

    op: int
    terms: tuple[tuple[float, int], ...]
    expression: ca.SX
    fixed: float = 0.0


class Form:
    """Some expressions, taken apart into numbers and cores.

    Parameters
    ----------
    column : sequence of scalar SX
        The expressions.
    roles : mapping from element hash
        What each symbol stands for, the same in all that is compared.

    Attributes
    ----------
    operations : int
        How many operations they have.
    is_plain : bool
        Whether they can be compared: not if they look up tables.
    cores : list of _Core
        Operands come first.
    roots : list of (float, int)
        Number and core of each expression.
    """

    def __init__(self, column: Sequence[ca.SX], roles: Mapping[int, object]) -> None:
        what = Operations(column)
        self.operations = len(what.keys)
        self.is_plain = not what.called
        self.cores: list[_Core] = [_Core(ca.OP_CONST, (), ca.SX(1.0))]
        self.roots: list[tuple[float, int]] = []
        self._found: dict[tuple[int, tuple[tuple[float, int], ...], float], int] = {}
        self._shapes = [_digest("one")]
        terms: list[tuple[float, int]] = []
        for k, (op, operands, number) in enumerate(what.keys if self.is_plain else ()):
            if op == ca.OP_CONST:
                terms.append((number, _ONE))
            elif op == ca.OP_INPUT:
                symbol = what.symbols[int(number)]
                shape = roles[symbol.element_hash()]
                terms.append((1.0, self._add(op, (), symbol, shape, float(k))))
            else:
                terms.append(self._term(op, [terms[k] for k in operands]))
        if self.is_plain:
            self.roots = [terms[k] for k in what.roots]

    def key(self, first: int, behind: int) -> object:
        """Equal for expressions number `first` to `behind` of the same form."""
        return tuple(self._shapes[core] for _, core in self.roots[first:behind])

    def said(self, first: int, behind: int) -> object:
        """Equal for expressions number `first` to `behind` that are equal, numbers included."""
        roots = self.roots[first:behind]
        place: dict[int, int] = {}  # in the order in which they are come upon
        stack = [core for _, core in reversed(roots)]
        while stack:
            k = stack.pop()
            if k not in place:
                place[k] = len(place)
                stack.extend(core for _, core in reversed(self.cores[k].terms))
        return (
            tuple((number, place[core]) for number, core in roots),
            tuple(
                (
                    self._shapes[k],
                    tuple((number, place[core]) for number, core in self.cores[k].terms),
                )
                for k in place
            ),
        )

    def _term(self, op: int, of: list[tuple[float, int]]) -> tuple[float, int]:
        """An operation as a number times a core."""
        numbers, cores = [c for c, _ in of], [core for _, core in of]
        if op in (ca.OP_NEG, ca.OP_TWICE):
            return (-1.0 if op == ca.OP_NEG else 2.0) * numbers[0], cores[0]
        if op == ca.OP_SQ:
            return numbers[0] ** 2, self._add(op, ((1.0, cores[0]),))
        if op in (ca.OP_ADD, ca.OP_SUB):
            sign = 1.0 if op == ca.OP_ADD else -1.0
            both = [of[0], (sign * numbers[1], cores[1])]
            both.sort(key=lambda term: self._shapes[term[1]])
            return 1.0, self._add(ca.OP_ADD, tuple(both))
        if op == ca.OP_MUL:
            factors = sorted((k for k in cores if k != _ONE), key=lambda k: self._shapes[k])
            number = numbers[0] * numbers[1]
            if len(factors) < 2:
                return number, factors[0] if factors else _ONE
            if factors[0] == factors[1]:
                return number, self._add(ca.OP_SQ, ((1.0, factors[0]),))
            return number, self._add(op, tuple((1.0, k) for k in factors))
        if op == ca.OP_INV:
            return 1.0 / numbers[0], self._add(op, ((1.0, cores[0]),))
        if op == ca.OP_DIV and numbers[1]:
            number = numbers[0] / numbers[1]
            if cores[1] == _ONE:
                return number, cores[0]
            return number, self._add(op, ((1.0, cores[0]), (1.0, cores[1])))
        if op == ca.OP_CONSTPOW:
            return 1.0, self._add(op, (of[0],), fixed=numbers[1])
        return 1.0, self._add(op, tuple(of))

    def _add(
        self,
        op: int,
        terms: tuple[tuple[float, int], ...],
        expression: ca.SX = ca.SX(),  # noqa: B008 - nothing changes it
        shape: object = None,
        fixed: float = 0.0,
    ) -> int:
        key = (op, terms, fixed)
        if key not in self._found:
            self._found[key] = len(self.cores)
            self.cores.append(_Core(op, terms, expression, fixed))
            own = (shape,) if op == ca.OP_INPUT else tuple(self._shapes[k] for _, k in terms)
            exponent = fixed if op == ca.OP_CONSTPOW else 0.0
            self._shapes.append(_digest((op, exponent, *own)))
        return self._found[key]


def _digest(shape: object) -> int:
    """The same in every run: what is generated depends on the order of these."""
    return int.from_bytes(hashlib.blake2b(repr(shape).encode(), digest_size=8).digest(), "big")


class _Constants:
    """Numbers of several expressions: one number where all are equal, else a constant."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.found: dict[tuple[float, ...], ca.SX] = {}

    def of(self, numbers: tuple[float, ...]) -> ca.SX:
        if len(set(numbers)) == 1:
            return ca.SX(numbers[0])
        opposite = tuple(-x for x in numbers)
        if opposite in self.found:
            return -self.found[opposite]
        if numbers not in self.found:
            self.found[numbers] = ca.SX.sym(f"{self.name}[{len(self.found)}]")
        return self.found[numbers]


def generalise(
    forms: Sequence[Form], name: str, count: int | None = None
) -> tuple[list[ca.SX], ca.SX, list[tuple[float, ...]]]:
    """What expressions of one form have in common.

    Parameters
    ----------
    forms : sequence of Form
        With the same key.
    name : str
        Of the constants.
    count : int, optional
        How many expressions, from the first; by default all.

    Returns
    -------
    list of SX
        The expressions, in the symbols of the first of the forms and the constants.
    SX
        Column of the constants.
    list of tuple of float
        For each form the values of the constants.
    """
    constants = _Constants(name)
    made: dict[tuple[int, ...], ca.SX] = {(_ONE,) * len(forms): ca.SX(1.0)}

    def of(terms: tuple[tuple[float, int], ...]) -> ca.SX:
        """A number, one in each form, times a core that is made."""
        numbers, cores = zip(*terms, strict=True)
        return constants.of(numbers) * made[cores]

    roots = list(zip(*(form.roots[:count] for form in forms), strict=True))
    stack = [tuple(core for _, core in root) for root in roots]
    while stack:
        at = stack[-1]
        if at in made:
            stack.pop()
            continue
        cores = [form.cores[k] for form, k in zip(forms, at, strict=True)]
        operands = list(zip(*(core.terms for core in cores), strict=True))
        waiting = [
            beneath for terms in operands if (beneath := tuple(k for _, k in terms)) not in made
        ]
        if waiting:
            stack.extend(waiting)
            continue
        made[at] = _apply(cores[0], [of(terms) for terms in operands])
        stack.pop()
    common = [of(root) for root in roots]
    table = [tuple(values[k] for values in constants.found) for k in range(len(forms))]
    return common, ca.vertcat(ca.SX(0, 1), *constants.found.values()), table


def _apply(core: _Core, operands: Sequence[ca.SX]) -> ca.SX:
    """The operation of a core."""
    if core.op == ca.OP_INPUT:
        return core.expression
    if core.op == ca.OP_CONSTPOW:
        return ca.SX.binary(ca.OP_POW, operands[0], ca.SX(core.fixed))
    if len(operands) == 1:
        return ca.SX.unary(core.op, operands[0])
    return ca.SX.binary(core.op, *operands)
