"""Terms that derivatives share with the values found before at the same point: computed once."""

import casadi as ca
from signorini.codegen.scheme import Point

# Operations below which a term is computed again: reading it back would cost as much.
_WORTH = 3
_COSTS = {
    **dict.fromkeys((ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_SQ, ca.OP_TWICE), 1),
    **dict.fromkeys((ca.OP_NEG, ca.OP_CONST, ca.OP_INPUT), 0),
}
_CALL = 5  # a quotient, a root or a function of libm
_COMMUTATIVE = frozenset({ca.OP_ADD, ca.OP_MUL})

_Key = tuple[int, tuple[int, ...], float]


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
        index: dict[_Key, int] = {}
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
            else:
                operands = tuple(register[i] for i in inputs)
                key = (op, tuple(sorted(operands)) if op in _COMMUTATIVE else operands, 0.0)
            if key not in index:
                index[key] = len(self.keys)
                self.keys.append(key)
            register[to[0]] = index[key]

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
            elif len(operands) == 1:
                made[k] = ca.SX.unary(op, made[operands[0]])
            else:
                made[k] = ca.SX.binary(op, made[operands[0]], made[operands[1]])
        return made


def share(values: Point, derivatives: Point) -> tuple[Point, Point]:
    """Let `values` keep what `derivatives` would compute again.

    Parameters
    ----------
    values, derivatives : Point
        The second is evaluated after the first, with the same arguments.

    Returns
    -------
    tuple of Point
        The same with a further field ``common`` of the first, and a further argument ``at``, the
        struct of the first, of the second; unchanged where nothing is worth it.
    """
    places = [(name, k) for name in derivatives.fields for k in derivatives.stored(name)]
    first = [values.fields[name].nz[k] for name in values.fields for k in values.stored(name)]
    second = [derivatives.fields[name].nz[k] for name, k in places]
    nodes = _Nodes([*first, *second])
    roots = nodes.roots[len(first) :]
    common = nodes.reach(nodes.roots[: len(first)]) & nodes.reach(roots)
    outer = nodes.reach(roots) - common
    border = {a for k in outer for a in nodes.keys[k][1]} | set(roots)
    kept = _worth_keeping(nodes, common, border)
    if not kept:
        return values, derivatives
    plain = nodes.expressions(nodes.reach(kept), {})
    symbols = {k: ca.SX.sym(f"at->common[{i}]") for i, k in enumerate(kept)}
    made = nodes.expressions(_needed(nodes, roots, symbols), symbols)
    entries = dict(zip(places, (made[k] for k in roots), strict=True))
    fields = {
        name: ca.SX(
            value.sparsity(),
            ca.vertcat(
                ca.SX(0, 1),
                *(entries.get((name, k), value.nz[k]) for k in range(value.nnz())),
            ),
        )
        for name, value in derivatives.fields.items()
    }
    column = ca.vertcat(*(plain[k] for k in kept))
    return (
        Point(values.name, values.arguments, {**values.fields, "common": column}),
        Point(derivatives.name, (*derivatives.arguments, "at"), fields, after=values.name),
    )


def _worth_keeping(nodes: _Nodes, common: set[int], border: set[int]) -> list[int]:
    """Nodes of the border that cost more than reading them back."""
    kept = []
    cost: dict[int, int] = {}
    for k in sorted(common):
        op, operands, _ = nodes.keys[k]
        cost[k] = _COSTS.get(op, _CALL) + sum(cost[a] for a in operands)
        if k in border and cost[k] >= _WORTH:
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
