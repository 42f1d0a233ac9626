"""The parts that a model falls into: coordinates that nothing couples move apart from each other.

Terms of L, forces, constraints and most contacts couple the coordinates that they depend on. What
is left in several pieces is stepped piece by piece. Contacts between parts of a model of many are
couplings: they join their parts only in steps in which they may act.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import casadi as ca
from signorini.codegen.frontend.model_data import Contact, ModelData

_SUMS = {ca.OP_ADD: 1, ca.OP_SUB: -1}
_MULTIPLES = (ca.OP_NEG, ca.OP_TWICE)
_REST = -1  # what of L moves with no part
# Parts from which on contacts join them step by step: what fewer say is solved at once sooner.
LEAST_PARTS = 6
# Nodes of all contacts between two parts from which on each of them is a coupling of its own: what
# they say is then printed once for each kind of contact, and evaluated for those that may act.
MANY_NODES = 3000
_LINEAR = frozenset({*_SUMS, *_MULTIPLES, ca.OP_MUL, ca.OP_DIV})


@dataclass(frozen=True, eq=False)
class Part:
    """Coordinates that nothing couples to others, and what stands on them.

    Attributes
    ----------
    name : str
        Of its first body, or of its first coordinate.
    coordinates, contacts, rows, points : tuple of int
        Places among those of the model; rows are percussions R = (R_g, R_gamma, R_N, R_F), points
        what is drawn.
    data : ModelData
        What the model says of them, with their names.
    couples : bool
        Whether it is a coupling: contacts between parts, which have the coordinates.
    """

    name: str
    coordinates: tuple[int, ...]
    contacts: tuple[int, ...]
    rows: tuple[int, ...]
    points: tuple[int, ...]
    data: ModelData
    couples: bool = False


class _Joined:
    """Sets of coordinates, joined by what couples them."""

    def __init__(self, n: int) -> None:
        self._root = list(range(n))

    def of(self, k: int) -> int:
        while self._root[k] != k:
            self._root[k] = self._root[self._root[k]]
            k = self._root[k]
        return k

    def join(self, members: Iterable[int]) -> None:
        first = -1
        for k in members:
            root = self.of(k)
            if first < 0:
                first = root
            elif root != first:
                first, root = min(first, root), max(first, root)
                self._root[root] = first


class Dependence:
    """Which coordinates an expression depends on, by itself or by its velocity."""

    def __init__(self, data: ModelData) -> None:
        self._index = {
            column[k].element_hash(): k for column in (data.q, data.v) for k in range(data.n_q)
        }

    def of(self, *expressions: ca.SX | None) -> set[int]:
        found = set()
        for expression in expressions:
            if expression is not None and not expression.is_constant():
                for symbol in ca.symvar(expression):
                    k = self._index.get(symbol.element_hash())
                    if k is not None:
                        found.add(k)
        return found


OF_CONTACT = ("g_N", "gamma_F", "mu", "e_N", "e_F", "bound", "guard", "mu_F")


def of_contact(c: Contact) -> tuple[ca.SX | None, ...]:
    return tuple(getattr(c, name) for name in OF_CONTACT)


def parts_of(data: ModelData) -> tuple[Part, ...]:
    depends = Dependence(data)
    joined = _Joined(data.n_q)
    for _, own in data.bodies:
        joined.join(own)
    terms = _terms(data.L, depends)
    for of_term, _ in terms:
        joined.join(of_term)
    forces = ca.densify(data.f)
    for k in range(data.n_q):
        joined.join({k} | depends.of(forces[k]))
    g, gamma = _blocks(data.g, data.g_blocks), _blocks(data.gamma, data.gamma_blocks)
    blocks = [depends.of(*rows) for rows in (*g, *gamma)]
    of_rows = [b for b, rows in zip(blocks, (*g, *gamma), strict=True) for _ in rows]
    contacts: list[set[int]] = []
    for k, c in enumerate(data.contacts):
        members = depends.of(*of_contact(c))
        if c.load is not None:
            members |= set().union(*of_rows[c.load[0] : c.load[0] + c.load[1]])
        if c.presser is not None and c.presser != k:
            members |= contacts[c.presser]
        contacts.append(members)
    for y in data.compliances:
        stiff = depends.of(y.compliance, y.relaxation)
        if stiff and y.normal:
            contacts[_contact_of_row(data, y.row)] |= stiff
        elif stiff:
            of_rows[y.row] |= stiff
            blocks.append(of_rows[y.row])
    for members in blocks:
        joined.join(members)
    if any(not members for members in (*blocks, *contacts)):
        return (whole(data),)
    couplings = _couplings(data, joined, contacts)
    bound = {joined.of(k) for members in (*blocks, *contacts) for k in members}
    if len(bound) < 2:
        return (whole(data),)
    # what nothing touches or holds needs no step of its own
    joined.join(k for k in range(data.n_q) if joined.of(k) not in bound)
    return _cut(data, joined, terms, (of_rows, contacts), couplings)


def _couplings(
    data: ModelData, joined: _Joined, members: list[set[int]]
) -> tuple[tuple[int, ...], ...]:
    """Contacts between parts that join them step by step, those between the same parts together
    unless they say very much; all other contacts join their parts for good."""
    groups: dict[int, list[int]] = {}
    for k, c in enumerate(data.contacts):
        groups.setdefault(k if c.presser is None else c.presser, []).append(k)
    may_open = []
    plain = not data.compliances and not any(c.poisson or c.mu_F is not None for c in data.contacts)
    for first, group in groups.items():
        if plain and _may_open(data, first, group):
            may_open.append(group)
        else:
            joined.join(j for k in group for j in members[k])
    bodies = {j for _, own in data.bodies for j in own}

    def between() -> dict[frozenset[int], list[list[int]]]:
        found: dict[frozenset[int], list[list[int]]] = {}
        for group in may_open:
            parts = frozenset(joined.of(j) for k in group for j in members[k])
            if len(parts) > 1:
                found.setdefault(parts, []).append(group)
        return found

    def is_long(groups: Sequence[Sequence[int]]) -> bool:
        said = [x for group in groups for k in group for x in of_contact(data.contacts[k])]
        return ca.n_nodes(ca.veccat(*(x for x in said if x is not None))) >= MANY_NODES

    # what is no body is no part of its own: single coordinates of one that is written by hand
    while loose := [p for p in between() if not p <= {joined.of(j) for j in bodies}]:
        for parts in loose:
            joined.join(parts)
    if len({joined.of(j) for own in members for j in own}) < LEAST_PARTS:
        for parts, pair in between().items():
            if not is_long(pair):
                joined.join(parts)
    couplings: list[tuple[int, ...]] = []
    for pair in between().values():
        if is_long(pair):
            couplings += [tuple(group) for group in pair]
        else:
            couplings.append(tuple(sorted(k for group in pair for k in group)))
    return tuple(couplings)


def _may_open(data: ModelData, first: int, group: Sequence[int]) -> bool:
    """Whether contacts, with the friction that the first presses, may be left out of a step in
    which its gap stays open."""
    contact = data.contacts[first]
    pressed = all(data.contacts[k].presser == first for k in group)
    loaded = any(data.contacts[k].load is not None for k in group)
    gaps = sum(data.contacts[k].g_N is not None for k in group)
    return contact.g_N is not None and not contact.one_way and pressed and not loaded and gaps == 1


def whole(data: ModelData) -> Part:
    n_R = data.n_g + data.n_gamma + data.n_N + data.n_F
    return Part(
        data.name,
        tuple(range(data.n_q)),
        tuple(range(len(data.contacts))),
        tuple(range(n_R)),
        tuple(range(data.places.shape[0])),
        data,
    )


def _blocks(column: ca.SX, blocks: Sequence[tuple[str, int]]) -> list[list[ca.SX]]:
    """The rows of each block: what one declaration says stays together."""
    full, found, at = ca.densify(column), [], 0
    for _, count in blocks:
        found.append([full[k] for k in range(at, at + count)])
        at += count
    return found


def _contact_of_row(data: ModelData, row: int) -> int:
    """The contact whose gap a percussion row belongs to."""
    normal = row - data.n_g - data.n_gamma
    return [k for k, c in enumerate(data.contacts) if c.g_N is not None][normal]


def _terms(L: ca.SX, depends: Dependence) -> list[tuple[set[int], ca.SX]]:
    """What L is a sum of, and what each term depends on; differences and products with numbers and
    parameters are taken apart, too."""
    found = []
    stack = [L]
    while stack:
        x = stack.pop()
        if x.is_constant() or x.is_symbolic():
            inner = []
        elif x.op() in _SUMS:
            inner = [x.dep(1), x.dep(0)]
        elif x.op() in _MULTIPLES:
            inner = [x.dep(0)]
        elif x.op() in (ca.OP_MUL, ca.OP_DIV):
            inner = [x.dep(k) for k in (0, 1) if depends.of(x.dep(k))]
            fits = len(inner) == 1 and (x.op() == ca.OP_MUL or not depends.of(x.dep(1)))
            inner = inner if fits else []
        else:
            inner = []
        if inner:
            stack.extend(inner)
        else:
            members = depends.of(x)
            if members:
                found.append((members, x))
    return found


class _Share:
    """What each part has of L: the same sum without the terms of the others."""

    def __init__(self, joined: _Joined, terms: list[tuple[set[int], ca.SX]]) -> None:
        self._of_term = {x.element_hash(): joined.of(min(members)) for members, x in terms}

    def of(self, L: ca.SX) -> dict[int, ca.SX]:
        """L of each part, without recursion: sums of many bodies are deep."""
        done: dict[int, dict[int, ca.SX]] = {}
        stack = [L]
        while stack:
            x = stack[-1]
            key = x.element_hash()
            if key in done:
                stack.pop()
                continue
            if key in self._of_term:
                done[key] = {self._of_term[key]: x}
            elif x.is_constant() or x.is_symbolic() or x.op() not in _LINEAR:
                # a number, or what depends on parameters and time alone
                done[key] = {} if x.is_zero() else {_REST: x}
            else:
                deps = [x.dep(k) for k in range(x.n_dep())]
                waiting = [d for d in deps if d.element_hash() not in done]
                if waiting:
                    stack.extend(waiting)
                    continue
                done[key] = self._combine(x, deps, [done[d.element_hash()] for d in deps])
            stack.pop()
        return done[L.element_hash()]

    def _combine(
        self, x: ca.SX, deps: list[ca.SX], shares: list[dict[int, ca.SX]]
    ) -> dict[int, ca.SX]:
        moving = [set(share) - {_REST} for share in shares]
        if not any(moving):
            return {_REST: x}
        if x.op() in _MULTIPLES:
            negative = x.op() == ca.OP_NEG
            return {part: -share if negative else 2 * share for part, share in shares[0].items()}
        if x.op() == ca.OP_DIV:
            return {part: share / deps[1] for part, share in shares[0].items()}
        if x.op() == ca.OP_MUL:
            which = 0 if moving[0] else 1
            other = deps[1 - which]
            return {
                part: share * other if which == 0 else other * share
                for part, share in shares[which].items()
            }
        sign = _SUMS[x.op()]
        left, right = (dict(share) for share in shares)
        # what does not move belongs to the part that it is added to, if that is one
        if not moving[0] and len(moving[1]) == 1 and left:
            left = {next(iter(moving[1])): left[_REST]}
        if not moving[1] and len(moving[0]) == 1 and right:
            right = {next(iter(moving[0])): right[_REST]}
        for part, share in right.items():
            if part in left:
                left[part] = left[part] + share if sign > 0 else left[part] - share
            else:
                left[part] = share if sign > 0 else -share
        return left


def _cut(
    data: ModelData,
    joined: _Joined,
    terms: list[tuple[set[int], ca.SX]],
    members: tuple[list[set[int]], list[set[int]]],
    couplings: tuple[tuple[int, ...], ...],
) -> tuple[Part, ...]:
    of_rows, of_contacts = members
    coupling = {k for contacts in couplings for k in contacts}
    L = _Share(joined, terms).of(data.L)
    rest = L.pop(_REST, None)
    forces = ca.densify(data.f)
    roots = sorted({joined.of(k) for k in range(data.n_q)})
    if rest is not None:  # it moves nothing, but the energy has it
        L[roots[0]] = L[roots[0]] + rest if roots[0] in L else rest
    rows_of: dict[int, list[int]] = {root: [] for root in roots}
    contacts_of: dict[int, list[int]] = {root: [] for root in roots}
    for row, of_row in enumerate(of_rows):
        rows_of[joined.of(min(of_row))].append(row)
    for k, of_contact in enumerate(of_contacts):
        if k not in coupling:
            contacts_of[joined.of(min(of_contact))].append(k)
    normal, slip = _rows_of_contacts(data)
    n_b, n_N = data.n_g + data.n_gamma, data.n_N

    def percussions(contacts: Sequence[int]) -> tuple[int, ...]:
        """Normal rows, then slip rows of some contacts among the percussions of the model."""
        of = [data.contacts[k] for k in contacts]
        return (
            *(n_b + normal[k] for k, c in zip(contacts, of, strict=True) if c.g_N is not None),
            *(
                n_b + n_N + slip[k] + d
                for k, c in zip(contacts, of, strict=True)
                for d in range(c.n_F)
            ),
        )

    depends = Dependence(data)
    moving = [
        frozenset(joined.of(j) for j in depends.of(data.places[k, :]))
        for k in range(data.places.shape[0])
    ]
    parts = []
    for root in roots:
        own = tuple(k for k in range(data.n_q) if joined.of(k) == root)
        contacts = tuple(contacts_of[root])
        rows = (*rows_of[root], *percussions(contacts))
        points = tuple(k for k, among in enumerate(moving) if among == {root})
        parts.append(
            Part(
                _name(data, own),
                own,
                contacts,
                rows,
                points,
                _restrict(data, own, contacts, rows, points, L.get(root, ca.SX(0)), forces),
            )
        )
    still = ca.SX.zeros(data.n_q, 1)
    drawn = _drawn_by_contact(data)
    of_contact_drawn = {k for name in drawn for k in drawn[name]}
    between: dict[frozenset[int], list[int]] = {}
    for k, among in enumerate(moving):
        if len(among) > 1 and k not in of_contact_drawn:
            between.setdefault(among, []).append(k)
    for contacts in sorted(couplings):
        # contacts are drawn where they are, by coordinates of both
        touched = frozenset(joined.of(j) for k in contacts for j in of_contacts[k])
        own_points = [p for k in contacts for p in drawn.get(data.contacts[k].name, ())]
        points = (*between.pop(touched, ()), *(p for p in own_points if len(moving[p]) > 1))
        seen = (depends.of(data.places[k, :]) for k in points)
        own = tuple(sorted(set().union(*(of_contacts[k] for k in contacts), *seen)))
        rows = percussions(contacts)
        inside = _restrict(data, own, contacts, rows, points, ca.SX(0), still)
        name = data.contacts[contacts[0]].name
        parts.append(Part(name, own, contacts, rows, points, inside, couples=True))
    return tuple(parts)


def _drawn_by_contact(data: ModelData) -> dict[str, range]:
    """Points that contacts are drawn with, by their names."""
    names = {c.name for c in data.contacts}
    found, at = {}, 0
    for kind, name, count in data.shapes:
        if kind == "contact" and name in names:
            found[name] = range(at, at + count)
        at += count
    return found


def _name(data: ModelData, own: tuple[int, ...]) -> str:
    bodies = (name for name, members in data.bodies if set(members) & set(own))
    return next(bodies, data.coordinates[own[0]])


def _rows_of_contacts(data: ModelData) -> tuple[list[int], list[int]]:
    """First normal and first slip row of each contact."""
    normal, slip, n, f = [], [], 0, 0
    for c in data.contacts:
        normal.append(n)
        slip.append(f)
        n += c.g_N is not None
        f += c.n_F
    return normal, slip


def _restrict(
    data: ModelData,
    own: tuple[int, ...],
    contacts: tuple[int, ...],
    rows: tuple[int, ...],
    points: tuple[int, ...],
    L: ca.SX,
    forces: ca.SX,
) -> ModelData:
    """What the model says of some of its coordinates."""
    n_g, n_b = data.n_g, data.n_g + data.n_gamma
    at = {row: place for place, row in enumerate(rows)}
    chosen = list(own)
    g = [row for row in rows if row < n_g]
    gamma = [row - n_g for row in rows if n_g <= row < n_b]
    place = {k: i for i, k in enumerate(contacts)}
    inside = []
    for k in contacts:
        c = data.contacts[k]
        load = None if c.load is None else (at[c.load[0]], c.load[1])
        presser = None if c.presser is None else place[c.presser]
        inside.append(replace(c, load=load, presser=presser))
    return replace(
        data,
        q=data.q[chosen],
        v=data.v[chosen],
        coordinates=tuple(data.coordinates[k] for k in own),
        velocities=tuple(data.velocities[k] for k in own),
        units=tuple(data.units[k] for k in own) if data.units else (),
        bodies=(),
        L=L,
        f=forces[chosen],
        g=ca.vertcat(ca.SX(0, 1), *(data.g[row] for row in g)),
        gamma=ca.vertcat(ca.SX(0, 1), *(data.gamma[row] for row in gamma)),
        g_blocks=_kept(data.g_blocks, set(g)),
        gamma_blocks=_kept(data.gamma_blocks, set(gamma)),
        contacts=tuple(inside),
        compliances=tuple(replace(y, row=at[y.row]) for y in data.compliances if y.row in at),
        outputs=(),
        shapes=(),
        places=data.places[list(points), :],
        q0=data.q0[chosen],
        v0=data.v0[chosen],
    )


def _kept(blocks: tuple[tuple[str, int], ...], rows: set[int]) -> tuple[tuple[str, int], ...]:
    """The blocks whose rows are among those that are kept."""
    found, at = [], 0
    for name, count in blocks:
        if at in rows:
            found.append((name, count))
        at += count
    return tuple(found)
