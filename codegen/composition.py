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
    equal, exact = _equal_kinds(parts)
    kinds, of_equal, values, drawn = _merged(equal)
    kind_of = [of_equal[k] for k in exact]
    constants = tuple(values[k] for k in exact)
    alike = drawn and _moves_with_one(data, parts) and _drawn_alike(parts, exact)
    alike = alike or len(parts) == 1
    return Composition(parts, tuple(kinds), tuple(kind_of), constants, alike)


def _equal_kinds(parts: Sequence[Part]) -> tuple[list[ModelData], list[int]]:
    """Kinds of parts that say the same with the same numbers, and the kind of each part."""
    kinds: list[ModelData] = []
    found: dict[object, int] = {}
    kind_of = []
    known: dict[object, object] = {}  # signatures by what is the same to the letter
    for part in parts:
        shape, columns = _said(part.data)
        letters = shape, _letters(part.data, columns)
        if letters not in known:
            known[letters] = _signature(part.data)
        signature = known[letters]
        if signature not in found:
            found[signature] = len(kinds)
            kinds.append(part.data)
        kind_of.append(found[signature])
    return kinds, kind_of


def _merged(
    equal: Sequence[ModelData],
) -> tuple[list[ModelData], list[int], list[tuple[float, ...]], bool]:
    """Kinds of which some that differ in numbers alone are one: the kinds, which of them each of
    the given ones is, its constants, and whether each kind draws all that it stands for."""
    groups: dict[object, list[int]] = {}
    forms = []
    for k, data in enumerate(equal):
        shape, columns = _said(data)
        forms.append(Form(_entries(columns), _roles(data)))
        key = forms[-1].key
        groups.setdefault(k if key is None else (shape, key), []).append(k)
    kinds: list[ModelData] = []
    kind_of = [-1] * len(equal)
    constants: list[tuple[float, ...]] = [()] * len(equal)
    drawn = True
    group_of = {k: members for members in groups.values() for k in members}
    for k, data in enumerate(equal):
        members = group_of[k]
        if kind_of[k] >= 0:
            continue
        if sum(forms[j].operations for j in members[1:]) < _WORTH:
            kind_of[k] = len(kinds)
            kinds.append(data)
            continue
        # what is drawn has constants, too, if it differs in numbers alone
        looks = [
            Form(_entries([*_said(equal[j])[1], equal[j].places]), _roles(equal[j]))
            for j in members
        ]
        alike = len({form.key for form in looks}) == 1
        drawn = drawn and alike
        chosen = looks if alike else [forms[j] for j in members]
        said, own, values = generalise(chosen, "own")
        for j, numbers in zip(members, values, strict=True):
            kind_of[j], constants[j] = len(kinds), numbers
        kinds.append(replace(_saying(data, said), own=own))
    return kinds, kind_of, constants, drawn


def _drawn_alike(parts: Sequence[Part], kind_of: Sequence[int]) -> bool:
    """Whether parts of a kind are drawn alike."""
    pictures: dict[int, object] = {}
    drawn: dict[object, object] = {}
    for part, kind in zip(parts, kind_of, strict=True):
        picture = _letters(part.data, [part.data.places])
        if picture not in drawn:
            drawn[picture] = _text_of(part.data, [part.data.places])
        if pictures.setdefault(kind, drawn[picture]) != drawn[picture]:
            return False
    return True


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


def _letters(data: ModelData, columns: Sequence[ca.SX]) -> object:
    """Equal for expressions of two parts that were built the same way: seen at once, but not of all
    that the same text describes."""
    own = ca.vertcat(data.q, data.v)
    common = ca.SX.sym("x", own.numel())
    said = ca.vertcat(ca.SX(0, 1), *(ca.vec(ca.densify(x)) for x in columns))
    # other symbols are those of the model
    f = ca.Function("f", [common], [ca.substitute(said, own, common)], {"allow_free": True})
    return f.serialize()


def _signature(data: ModelData) -> object:
    """Equal for parts that the same text describes: all that is said, with the same numbers and
    parameters, of coordinates in the same order."""
    shape, columns = _said(data)
    return shape, _text_of(data, columns)


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
