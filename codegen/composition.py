"""A model as parts of kinds: equal parts share their text, and so do parts that differ in numbers.

Where parts differ in numbers alone, their kind has constants in place of these, and each part its
values of them.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import casadi as ca
from signorini.codegen.alike import Form, generalise
from signorini.codegen.frontend.model_data import Contact, ModelData
from signorini.codegen.graph import Operations
from signorini.codegen.parts import OF_CONTACT, Dependence, Part, of_contact, parts_of, whole

# Operations that kinds which differ in numbers must have in common to become one: shorter ones are
# read, and run, better with their own numbers.
_WORTH = 400


@dataclass(frozen=True, eq=False)
class Composition:
    """A model as parts, each of a kind.

    Attributes
    ----------
    parts : tuple of Part
        In the order of their first coordinates; behind them couplings, in that of their contacts.
    kinds : tuple of ModelData
        One of each kind.
    kind_of : tuple of int
        The kind of each part.
    constants : tuple of tuple of float
        For each part the values of the constants of its kind.
    drawn_alike : bool
        Whether every point moves with one part at most, and parts of a kind are drawn alike.
    """

    parts: tuple[Part, ...]
    kinds: tuple[ModelData, ...]
    kind_of: tuple[int, ...]
    constants: tuple[tuple[float, ...], ...]
    drawn_alike: bool

    @property
    def names(self) -> tuple[str, ...]:
        """A name of C for each kind: that of its first part."""
        found: list[str] = []
        for k in range(len(self.kinds)):
            name = _spelled(self.parts[self.kind_of.index(k)])
            found.append(f"{name}_{k}" if name in found else name)
        return tuple(found)


def compose(data: ModelData) -> Composition:
    """The parts of a model and their kinds; a single part is the model itself."""
    parts = parts_of(data)
    # the coefficients of all slip rows are one array or none, so is what an impact gives back
    elliptic = {any(c.mu_F is not None for c in part.data.contacts) for part in parts}
    poisson = {any(c.poisson for c in part.data.contacts) for part in parts}
    if len(elliptic) > 1 or len(poisson) > 1:
        parts = (whole(data),)
    if len(parts) == 1:
        return Composition(parts, (parts[0].data,), (0,), ((),), True)
    said: dict[object, _Said] = {}
    of_parts = []
    for part in parts:
        letters = _letters(part.data)
        if letters not in said:
            said[letters] = _Said(part.data)
        of_parts.append(said[letters])
    kinds, kind_of, constants, drawn = _kinds(of_parts)
    alike = drawn and _moves_with_one(data, parts)
    return Composition(parts, tuple(kinds), tuple(kind_of), tuple(constants), alike)


class _Said:
    """What a part says of its coordinates and how it is drawn, as it is compared with others.

    Attributes
    ----------
    laws : hashable
        Equal for parts that say the same, with the same numbers and parameters, of coordinates in
        the same order.
    form : hashable or None
        Equal for parts that say the same but for numbers; None if no other is compared with it.
    picture, picture_form : hashable
        The same of what is drawn.
    """

    def __init__(self, data: ModelData) -> None:
        self.data = data
        shape, columns = _said(data)
        laws = _entries(columns)
        self.count = n = len(laws)
        roles = _roles(data)
        self.numbers = numbers = Form([*laws, *_entries([data.places])], roles)
        self.operations = numbers.operations
        if numbers.is_plain:
            everything = len(numbers.roots)
            self.laws: object = (shape, numbers.said(0, n))
            self.form: object = (shape, numbers.key(0, n))
            self.picture: object = numbers.said(n, everything)
            self.picture_form: object = numbers.key(n, everything)
        else:
            self.laws, self.form = (shape, _text_of(data, columns)), None
            self.picture = self.picture_form = _text_of(data, [data.places])


def _kinds(
    parts: Sequence[_Said],
) -> tuple[list[ModelData], list[int], list[tuple[float, ...]], bool]:
    """Kinds of parts, which of them each part is, its constants, and whether what is drawn is the
    same for all of a kind."""
    equal: dict[object, list[int]] = {}
    for k, part in enumerate(parts):
        equal.setdefault(part.laws, []).append(k)
    firsts = {laws: parts[members[0]] for laws, members in equal.items()}
    groups: dict[object, list[object]] = {}
    for laws, first in firsts.items():
        groups.setdefault(laws if first.form is None else first.form, []).append(laws)
    group_of = {laws: group for group in groups.values() for laws in group}
    kinds: list[ModelData] = []
    kind_of = [-1] * len(parts)
    constants: list[tuple[float, ...]] = [()] * len(parts)
    drawn = all(parts[k].picture == parts[m[0]].picture for m in equal.values() for k in m)
    for laws, members in equal.items():
        group = group_of[laws]
        if kind_of[members[0]] >= 0:
            continue
        if sum(firsts[other].operations for other in group[1:]) < _WORTH:
            for k in members:
                kind_of[k] = len(kinds)
            kinds.append(firsts[laws].data)
            continue
        of_group = [firsts[other] for other in group]
        # what is drawn has constants, too, if it differs in numbers alone
        alike = len({part.picture_form for part in of_group}) == 1
        drawn = drawn and alike
        count = None if alike else firsts[laws].count
        said, own, values = generalise([part.numbers for part in of_group], "own", count)
        for other, numbers in zip(group, values, strict=True):
            for k in equal[other]:
                kind_of[k], constants[k] = len(kinds), numbers
        kinds.append(replace(_saying(firsts[laws].data, said), own=own))
    return kinds, kind_of, constants, drawn


def _moves_with_one(data: ModelData, parts: Sequence[Part]) -> bool:
    """Whether every point that is drawn and moves does so with one part or coupling."""
    depends = Dependence(data)
    with_one = {k for part in parts for k in part.points}
    rows = range(data.places.shape[0])
    return all(k in with_one for k in rows if depends.of(data.places[k, :]))


def _spelled(part: Part) -> str:
    """The name of a part as C can have it: nothing else begins like this."""
    is_name = re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", part.name)
    return f"of_{part.name if is_name else part.data.coordinates[0]}"


def _said(data: ModelData) -> tuple[str, list[ca.SX]]:
    """All that is said of a part: what is no expression, and the expressions."""
    columns = [data.L, data.f, data.g, data.gamma]
    shape: list[object] = [len(data.coordinates), data.g_blocks and data.n_g, data.n_gamma]
    for c in data.contacts:
        for field in fields(Contact):
            value = getattr(c, field.name)
            if field.name != "name":
                shape.append(value.shape if isinstance(value, ca.SX) else value)
        columns += [x for x in of_contact(c) if x is not None]
    for y in data.compliances:
        shape.append((y.row, y.normal))
        columns += [y.compliance, y.relaxation]
    return repr(shape), columns


def _saying(data: ModelData, entries: Sequence[ca.SX]) -> ModelData:
    """A part that says other expressions, in the order of _said, and draws what is left of them."""
    left = iter(entries)

    def like(x: ca.SX) -> ca.SX:
        return ca.reshape(ca.vertcat(ca.SX(0, 1), *(next(left) for _ in range(x.numel()))), x.shape)

    columns: dict[str, Any] = {name: like(getattr(data, name)) for name in ("L", "f", "g", "gamma")}
    contacts = []
    for c in data.contacts:
        given = {name: getattr(c, name) for name in OF_CONTACT}
        said: dict[str, Any] = {name: like(x) for name, x in given.items() if x is not None}
        contacts.append(replace(c, **said))
    compliances = [
        replace(y, compliance=like(y.compliance), relaxation=like(y.relaxation))
        for y in data.compliances
    ]
    rest = list(left)
    if rest:
        columns["places"] = ca.reshape(ca.vertcat(*rest), data.places.shape)
    return replace(data, **columns, contacts=tuple(contacts), compliances=tuple(compliances))


def _letters(data: ModelData) -> object:
    """Equal for parts whose expressions were built the same way: seen at once, but not of all that
    say the same."""
    shape, columns = _said(data)
    own = ca.vertcat(data.q, data.v)
    common = ca.SX.sym("x", own.numel())
    said = ca.vertcat(ca.SX(0, 1), *(ca.vec(ca.densify(x)) for x in (*columns, data.places)))
    # other symbols are those of the model
    f = ca.Function("f", [common], [ca.substitute(said, own, common)], {"allow_free": True})
    return shape, f.serialize()


def _text_of(data: ModelData, columns: Sequence[ca.SX]) -> object:
    """Equal where expressions of two parts are the same of coordinates in the same order."""
    operations = Operations(_entries(columns))
    roles = _roles(data)
    symbols = [roles[s.element_hash()] for s in operations.symbols]
    keys = tuple(
        (op, args, symbols[int(number)] if op == ca.OP_INPUT else number)
        for op, args, number in operations.keys
    )
    return keys, tuple(operations.roots), tuple(operations.called)


def _entries(columns: Sequence[ca.SX]) -> list[ca.SX]:
    """All entries of several matrices, column by column."""
    full = [ca.densify(x) for x in columns]
    return [x[k] for x in full for k in range(x.numel())]


def _roles(data: ModelData) -> dict[int, tuple[str, int]]:
    """What the symbols of a part are in all parts of its kind."""
    return {
        column[k].element_hash(): (letter, k)
        for letter, column in (
            *(("t", data.t), ("q", data.q), ("v", data.v)),
            *(("u", data.u), ("par", data.par)),
        )
        for k in range(column.numel())
    }
