"""Terms that several evaluations share: computed once.

Nothing is rewritten: a point keeps its expressions and learns which of them are `known`.
"""

from collections.abc import Sequence

import casadi as ca
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.graph import Graph, Known, Operations
from signorini.codegen.program import ARGUMENT, Memory, Point, Ref, Terms

# Operations below which a term is computed again: reading it back would cost as much.
_WORTH = 3
_COSTS = {
    **dict.fromkeys((ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_SQ, ca.OP_TWICE), 1),
    **dict.fromkeys((ca.OP_NEG, ca.OP_CONST, ca.OP_INPUT), 0),
}
_CALL = 5  # a quotient, a root or a function of libm


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
    first, second = values.entries(), derivatives.entries()
    operations = Operations([*first, *second], values.known)
    own, others = operations.roots[: len(first)], operations.roots[len(first) :]
    common = operations.reach(own) & operations.reach(others)
    kept = [operations.expressions[k] for k in _worth_keeping(operations, common, others)]
    if not kept:
        return values, derivatives
    known = tuple((x, memory[Ref("at", None, ARGUMENT, ("common", i))]) for i, x in enumerate(kept))
    return (
        Point(
            values.name,
            values.arguments,
            {**values.fields, "common": ca.vertcat(*kept)},
            known=values.known,
        ),
        Point(
            derivatives.name,
            (*derivatives.arguments, "at"),
            derivatives.fields,
            after=values.name,
            known=derivatives.known + known,
        ),
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
    columns = [point.entries() for point in points]
    operations = Operations([x for column in columns for x in column])
    own = operations.roots[: len(columns[0])]
    others = operations.roots[len(columns[0]) :]
    place = ca.vertcat(data.t, data.q, data.par)
    hashes = [place[k].element_hash() for k in range(place.numel())]
    of_place: set[int] = set()
    for k, (op, inputs, number) in enumerate(operations.keys):
        here = op != ca.OP_INPUT or operations.symbols[int(number)].element_hash() in hashes
        if here and of_place.issuperset(inputs):
            of_place.add(k)
    # What is a result of the first alone would only be copied.
    operands = {a for k in operations.reach(operations.roots) for a in operations.keys[k][1]}
    results = set(own) - operands - set(others)
    candidates = (of_place & operations.reach(own)) - results
    kept = _worth_keeping(operations, candidates, operations.roots)
    values, known = _distinct(memory, [operations.expressions[k] for k in kept], "terms")
    used = {s.element_hash() for s in ca.symvar(values)}
    if used.isdisjoint(hashes[: 1 + data.n_q]):
        return Terms(ca.SX(0, 1), ca.SX(0, 1)), list(points)
    key = ca.vertcat(*(place[k] for k, own_hash in enumerate(hashes) if own_hash in used))
    symbols = {s.element_hash() for _, x in known for s in ca.symvar(x)}
    taken = []
    for point, column in zip(points, columns, strict=True):
        needs = any(s.element_hash() in symbols for s in Operations(column, known).used())
        arguments = (*point.arguments, "terms") if needs else point.arguments
        taken.append(Point(point.name, arguments, point.fields, known=known))
    return Terms(values, key), taken


def _distinct(memory: Memory, terms: list[ca.SX], array: str) -> tuple[ca.SX, Known]:
    """Column of the terms that differ by more than their sign; all as entries of an array."""
    operations = Operations(terms)
    graph = Graph(operations, {s.element_hash(): s.name() for s in operations.symbols})
    column: list[ca.SX] = []
    found: dict[tuple[int, ...], tuple[float, ca.SX]] = {}
    known: list[tuple[ca.SX, ca.SX]] = []
    for term, root in zip(terms, graph.roots, strict=True):
        node = graph.nodes[root]
        sign = 1.0
        form: tuple[int, ...] = (root,)
        if node.op == "neg":
            sign, form = -1.0, node.args
        elif node.op == "-":
            sign, form = (1.0 if node.args[0] < node.args[1] else -1.0), tuple(sorted(node.args))
        if form not in found:
            found[form] = sign, memory[Ref(array, len(column), ARGUMENT)]
            column.append(term)
        own, symbol = found[form]
        known.append((term, symbol if sign == own else -symbol))
    return ca.vertcat(ca.SX(0, 1), *column), tuple(known)


def _worth_keeping(operations: Operations, common: set[int], roots: list[int]) -> list[int]:
    """Keys of the border of `common` that cost more than reading them back."""
    outer = operations.reach(roots) - common
    border = {a for k in outer for a in operations.keys[k][1]} | set(roots)
    kept = []
    cost: dict[int, int] = {}
    for k in sorted(common):
        op, operands, _ = operations.keys[k]
        cost[k] = _COSTS.get(op, _CALL) + sum(cost[a] for a in operands)
        if k in border and cost[k] >= _WORTH and op != ca.OP_CALL:
            kept.append(k)
            cost[k] = 0
    return kept
