"""Terms that several evaluations share: computed once."""

from collections.abc import Sequence

import casadi as ca
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.graph import Graph
from signorini.codegen.program import ARGUMENT, Memory, Point, Ref, Terms

# Operations below which a term is computed again: reading it back would cost as much.
_WORTH = 3
_COSTS = {
    **dict.fromkeys((ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_SQ, ca.OP_TWICE), 1),
    **dict.fromkeys((ca.OP_NEG, ca.OP_CONST, ca.OP_INPUT), 0),
}
_CALL = 5  # a quotient, a root or a function of libm
_COMMUTATIVE = frozenset({ca.OP_ADD, ca.OP_MUL})

_Key = tuple[int, tuple[int, ...], float]
_ENTRY = -1  # of what a call returns


class _Nodes:
    """Hash-consed operations of several scalar expressions.

    Attributes
    ----------
    keys : list of (operation, operands, constant or number of the symbol)
        Operands come first.
    roots : list of int
        Node of each expression.
    """

    def __init__(self, outputs: list[ca.SX]) -> None:
        self.keys: list[_Key] = []
        self._index: dict[_Key, int] = {}
        self._called: list[ca.Function] = []
        column = ca.vertcat(ca.SX(0, 1), *outputs)
        self.symbols = ca.symvar(column)
        f = ca.Function("f", [ca.vertcat(ca.SX(0, 1), *self.symbols)], [column])
        register: dict[int, int] = {}
        self.roots = [-1] * len(outputs)
        for k in range(f.n_instructions()):
            op, to = f.instruction_id(k), f.instruction_output(k)
            inputs = f.instruction_input(k)
            if op == ca.OP_OUTPUT:
                self.roots[to[1]] = register[inputs[0]]
                continue
            if op == ca.OP_ASSIGN:
                register[to[0]] = register[inputs[0]]
                continue
            if op == ca.OP_INPUT:
                key: _Key = (op, (), float(inputs[1]))
            elif op == ca.OP_CONST:
                key = (op, (), f.instruction_constant(k))
            elif op == ca.OP_CALL:
                called = self._number(f.instructions_sx()[k].which_function())
                cell = self._place((op, tuple(register[i] for i in inputs), float(called)))
                for entry, place in enumerate(to):
                    register[place] = self._place((_ENTRY, (cell,), float(entry)))
                continue
            else:
                operands = tuple(register[i] for i in inputs)
                key = (op, tuple(sorted(operands)) if op in _COMMUTATIVE else operands, 0.0)
            register[to[0]] = self._place(key)

    def _place(self, key: _Key) -> int:
        if key not in self._index:
            self._index[key] = len(self.keys)
            self.keys.append(key)
        return self._index[key]

    def _number(self, called: ca.Function) -> int:
        """Number of a table's function; equal names are one."""
        names = [f.name() for f in self._called]
        if called.name() not in names:
            self._called.append(called)
            return len(names)
        return names.index(called.name())

    def reach(self, roots: list[int]) -> set[int]:
        """All nodes that the given ones need."""
        found: set[int] = set()
        stack = [k for k in roots if k >= 0]
        while stack:
            k = stack.pop()
            if k not in found:
                found.add(k)
                stack.extend(self.keys[k][1])
        return found

    def expressions(self, wanted: set[int], known: dict[int, ca.SX]) -> dict[int, ca.SX]:
        """Expressions of the wanted nodes, those in `known` replaced."""
        made: dict[int, ca.SX] = {}
        for k in sorted(wanted):
            op, operands, value = self.keys[k]
            if k in known:
                made[k] = known[k]
            elif op == ca.OP_INPUT:
                made[k] = self.symbols[int(value)]
            elif op == ca.OP_CONST:
                made[k] = ca.SX(value)
            elif op == ca.OP_CALL:
                made[k] = self._called[int(value)](*(made[a] for a in operands))
            elif op == _ENTRY:
                made[k] = made[operands[0]][int(value)]
            elif len(operands) == 1:
                made[k] = ca.SX.unary(op, made[operands[0]])
            else:
                made[k] = ca.SX.binary(op, made[operands[0]], made[operands[1]])
        return made


def share(memory: Memory, values: Point, derivatives: Point) -> tuple[Point, Point]:
    """Let `values` keep what `derivatives` would compute again.

    Parameters
    ----------
    memory : Memory
        Gets the symbols of what is kept.
    values, derivatives : Point
        The second is evaluated after the first, with the same arguments.

    Returns
    -------
    tuple of Point
        The same with a further field ``common`` of the first, and a further argument ``at``, the
        struct of the first, of the second; unchanged where nothing is worth it.
    """
    first, second = _stored(values), _stored(derivatives)
    nodes = _Nodes([*first, *second])
    roots = nodes.roots[len(first) :]
    common = nodes.reach(nodes.roots[: len(first)]) & nodes.reach(roots)
    kept = _worth_keeping(nodes, common, roots)
    if not kept:
        return values, derivatives
    plain = nodes.expressions(nodes.reach(kept), {})
    column = ca.vertcat(*(plain[k] for k in kept))
    symbols = {k: memory[Ref("at", None, ARGUMENT, ("common", i))] for i, k in enumerate(kept)}
    fields = _rewritten(derivatives, nodes, roots, symbols)
    return (
        Point(values.name, values.arguments, {**values.fields, "common": column}),
        Point(derivatives.name, (*derivatives.arguments, "at"), fields, after=values.name),
    )


def terms_of_place(
    memory: Memory, data: ModelData, points: Sequence[Point]
) -> tuple[Terms, list[Point]]:
    """Take terms that depend on the place (t, q, parameters) alone out of evaluations there.

    Parameters
    ----------
    memory : Memory
        Gets the symbols of the terms.
    data : ModelData
        The model, for its symbols.
    points : sequence of Point
        What is evaluated there, perhaps at several velocities; the first alone decides what is
        worth it, because it is evaluated most often.

    Returns
    -------
    Terms
        The terms and the symbols that they depend on; both empty where nothing is worth it, or
        where only parameters matter.
    list of Point
        The points, with a further argument ``terms`` where they need it.
    """
    stored = [_stored(point) for point in points]
    nodes = _Nodes([x for column in stored for x in column])
    roots, at = [], 0
    for column in stored:
        roots.append(nodes.roots[at : at + len(column)])
        at += len(column)
    place = ca.vertcat(data.t, data.q, data.par)
    hashes = [place[k].element_hash() for k in range(place.numel())]
    of_place: set[int] = set()
    for k, (op, inputs, value) in enumerate(nodes.keys):
        here = op != ca.OP_INPUT or nodes.symbols[int(value)].element_hash() in hashes
        if here and of_place.issuperset(inputs):
            of_place.add(k)
    # What is a result of the first alone would only be copied.
    operands = {a for k in nodes.reach(nodes.roots) for a in nodes.keys[k][1]}
    results = set(roots[0]) - operands - {k for others in roots[1:] for k in others}
    kept = _worth_keeping(nodes, (of_place & nodes.reach(roots[0])) - results, nodes.roots)
    plain = nodes.expressions(nodes.reach(kept), {})
    values, symbols = _distinct(memory, {k: plain[k] for k in kept}, "terms")
    used = {s.element_hash() for s in ca.symvar(values)}
    if used.isdisjoint(hashes[: 1 + data.n_q]):
        return Terms(ca.SX(0, 1), ca.SX(0, 1)), list(points)
    key = ca.vertcat(*(place[k] for k, own in enumerate(hashes) if own in used))
    taken = []
    for point, own_roots in zip(points, roots, strict=True):
        needs = not symbols.keys().isdisjoint(_needed(nodes, own_roots, symbols))
        arguments = (*point.arguments, "terms") if needs else point.arguments
        taken.append(Point(point.name, arguments, _rewritten(point, nodes, own_roots, symbols)))
    return Terms(values, key), taken


def _distinct(
    memory: Memory, plain: dict[int, ca.SX], array: str
) -> tuple[ca.SX, dict[int, ca.SX]]:
    """Column of the expressions that C text tells apart but for their sign; all as its entries."""
    names = {
        s.element_hash(): s.name() for s in ca.symvar(ca.vertcat(ca.SX(0, 1), *plain.values()))
    }
    graph = Graph(list(plain.values()), names)
    column: list[ca.SX] = []
    found: dict[tuple[int, ...], tuple[float, ca.SX]] = {}
    symbols: dict[int, ca.SX] = {}
    for (k, value), root in zip(plain.items(), graph.roots, strict=True):
        node = graph.nodes[root]
        sign = 1.0
        form: tuple[int, ...] = (root,)
        if node.op == "neg":
            sign, form = -1.0, node.args
        elif node.op == "-":
            sign, form = (1.0 if node.args[0] < node.args[1] else -1.0), tuple(sorted(node.args))
        if form not in found:
            found[form] = sign, memory[Ref(array, len(column), ARGUMENT)]
            column.append(value)
        own, symbol = found[form]
        symbols[k] = symbol if sign == own else -symbol
    return ca.vertcat(ca.SX(0, 1), *column), symbols


def _stored(point: Point) -> list[ca.SX]:
    """Entries of a point that are no plain numbers."""
    return [point.fields[name].nz[k] for name in point.fields for k in point.stored(name)]


def _rewritten(
    point: Point, nodes: _Nodes, roots: list[int], symbols: dict[int, ca.SX]
) -> dict[str, ca.SX]:
    """Fields of a point whose stored entries are `roots`, some nodes replaced by symbols."""
    places = [(name, k) for name in point.fields for k in point.stored(name)]
    made = nodes.expressions(_needed(nodes, roots, symbols), symbols)
    entries = dict(zip(places, (made[k] for k in roots), strict=True))
    return {
        name: ca.SX(
            value.sparsity(),
            ca.vertcat(
                ca.SX(0, 1),
                *(entries.get((name, k), value.nz[k]) for k in range(value.nnz())),
            ),
        )
        for name, value in point.fields.items()
    }


def _worth_keeping(nodes: _Nodes, common: set[int], roots: list[int]) -> list[int]:
    """Nodes of the border of `common` that cost more than reading them back."""
    outer = nodes.reach(roots) - common
    border = {a for k in outer for a in nodes.keys[k][1]} | set(roots)
    kept = []
    cost: dict[int, int] = {}
    for k in sorted(common):
        op, operands, _ = nodes.keys[k]
        cost[k] = _COSTS.get(op, _CALL) + sum(cost[a] for a in operands)
        if k in border and cost[k] >= _WORTH and op != ca.OP_CALL:
            kept.append(k)
            cost[k] = 0
    return kept


def _needed(nodes: _Nodes, roots: list[int], known: dict[int, ca.SX]) -> set[int]:
    """Nodes that the roots need when some are known."""
    found: set[int] = set()
    stack = list(roots)
    while stack:
        k = stack.pop()
        if k not in found:
            found.add(k)
            if k not in known:
                stack.extend(nodes.keys[k][1])
    return found
