"""Expression graph between CasADi SX and C text: equal nodes are one node, signs are gathered."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import casadi as ca
from signorini.codegen.frontend.operations import OPERATIONS

_UNARY = {o.op: o.name for o in OPERATIONS if o.arity == 1}
_BINARY = {o.op: o.name for o in OPERATIONS if o.arity == 2}
COMMUTATIVE = frozenset({"+", "*", "fmin", "fmax", "==", "!=", "&&", "||", "hypot"})
LOGICAL = frozenset({"<", "<=", "==", "!=", "&&", "||", "!"})
# Operations that a count of arithmetic reports; function calls count one each.
ARITHMETIC = frozenset({"+", "-", "*", "/", "sq", "twice", "inv"})
ENTRY = -1  # the operation that takes one result of a call
_COMMUTATIVE_IN_SX = frozenset({ca.OP_ADD, ca.OP_MUL})

# An expression and what is known to have its value: a symbol or the negative of one.
Known = tuple[tuple[ca.SX, ca.SX], ...]
_Key = tuple[int, tuple[int, ...], float]
_UNMET = ca.SX()  # stands for a result of a call until something that uses it is read


class Operations:
    """The operations of several scalar expressions as CasADi has them, equal ones once.

    Parameters
    ----------
    outputs : sequence of scalar SX
        The expressions.
    known : tuple of (scalar SX, scalar SX)
        Expressions that need not be computed, and what has their values.

    Attributes
    ----------
    keys : list of (operation, operands, number)
        Operands are indices of earlier keys; the number is that of a symbol, of a called function
        or of its result, or a constant.
    expressions : list of SX
        Each operation as the expression that it was read from.
    symbols : list of SX
        All symbols.
    called : list of str
        Names of the functions of tables.
    roots : list of int
        Key of each output.
    """

    def __init__(self, outputs: Sequence[ca.SX], known: Known = ()) -> None:
        self.keys: list[_Key] = []
        self.expressions: list[ca.SX] = []
        self.called: list[str] = []
        self._index: dict[_Key, int] = {}
        replaced, by = [pair[0] for pair in known], [pair[1] for pair in known]
        column = ca.vertcat(ca.SX(0, 1), *outputs, *replaced, *by)
        self.symbols: list[ca.SX] = ca.symvar(column)
        roots = self._read(column)
        first = len(outputs)
        self.roots = roots[:first]
        pairs = zip(roots[first : first + len(known)], roots[first + len(known) :], strict=True)
        if known:
            self._replace(dict(pairs))

    def _read(self, column: ca.SX) -> list[int]:
        """Take a column apart; the key of each entry."""
        f = ca.Function("f", [ca.vertcat(ca.SX(0, 1), *self.symbols)], [column])
        found = cast(list[ca.SX], f.instructions_sx().elements())
        called = False
        register: dict[int, int] = {}
        rows = column.sparsity().row()
        roots = [-1] * column.numel()
        if len(rows) < len(roots):
            roots = [self._place((ca.OP_CONST, (), 0.0), ca.SX(0.0))] * len(roots)
        for k in range(f.n_instructions()):
            op, to = f.instruction_id(k), f.instruction_output(k)
            inputs = f.instruction_input(k)
            if op == ca.OP_OUTPUT:
                roots[rows[to[1]]] = register[inputs[0]]
                if called:
                    self._meet(register[inputs[0]], column.nz[to[1]])
            elif op == ca.OP_ASSIGN:
                register[to[0]] = register[inputs[0]]
            elif op == ca.OP_INPUT:
                key: _Key = (op, (), float(inputs[1]))
                register[to[0]] = self._place(key, self.symbols[inputs[1]])
            elif op == ca.OP_CONST:
                value = f.instruction_constant(k)
                register[to[0]] = self._place((op, (), value), ca.SX(value))
            elif op == ca.OP_CALL:
                called = True
                for at, i in enumerate(inputs):
                    self._meet(register[i], found[k].dep(at))
                name = found[k].which_function().name()
                if name not in self.called:
                    self.called.append(name)
                number = float(self.called.index(name))
                cell = self._place((op, tuple(register[i] for i in inputs), number), found[k])
                for entry, place in enumerate(to):
                    if place >= 0:
                        register[place] = self._place((ENTRY, (cell,), float(entry)), _UNMET)
            else:
                for at, i in enumerate(inputs if called else ()):
                    self._meet(register[i], found[k].dep(at))
                key = (op, tuple(register[i] for i in inputs), 0.0)
                register[to[0]] = self._place(key, found[k])
        return roots

    def _meet(self, k: int, expression: ca.SX) -> None:
        """The result of a call as others use it: CasADi takes no second one of the same call."""
        if self.expressions[k] is _UNMET:
            self.expressions[k] = expression

    def _place(self, key: _Key, expression: ca.SX) -> int:
        op, operands, number = key
        if op in _COMMUTATIVE_IN_SX:
            key = (op, tuple(sorted(operands)), number)
        if key not in self._index:
            self._index[key] = len(self.keys)
            self.keys.append(key)
            self.expressions.append(expression)
        return self._index[key]

    def _replace(self, known: dict[int, int]) -> None:
        """Put the keys that are known in the place of those that have to be computed."""
        keys, expressions = self.keys, self.expressions
        self.keys, self.expressions, self._index = [], [], {}
        place: dict[int, int] = {}
        for by in sorted(_reach(keys, known.values())):
            op, operands, number = keys[by]
            key = (op, tuple(place[a] for a in operands), number)
            place[by] = self._place(key, expressions[by])
        place |= {k: place[by] for k, by in known.items()}
        for k in sorted(_reach(keys, self.roots, known)):
            if k not in place:
                op, operands, number = keys[k]
                key = (op, tuple(place[a] for a in operands), number)
                place[k] = self._place(key, expressions[k])
        self.roots = [place[k] for k in self.roots]

    def reach(self, roots: Iterable[int]) -> set[int]:
        """All keys that the given ones need, with these."""
        return _reach(self.keys, roots)

    def used(self) -> list[ca.SX]:
        """The symbols that the outputs need."""
        needed = self.reach(self.roots)
        keys = (self.keys[k] for k in sorted(needed))
        return [self.symbols[int(number)] for op, _, number in keys if op == ca.OP_INPUT]


def _reach(keys: Sequence[_Key], roots: Iterable[int], ends: Iterable[int] = ()) -> set[int]:
    """What the roots need, not going on behind some."""
    ends = set(ends)
    found: set[int] = set()
    stack = list(roots)
    while stack:
        k = stack.pop()
        if k not in found:
            found.add(k)
            if k not in ends:
                stack.extend(keys[k][1])
    return found


@dataclass(frozen=True)
class Node:
    """One operation; `args` are indices of earlier nodes."""

    op: str
    args: tuple[int, ...] = ()
    text: str = ""
    value: float = 0.0


class Graph:
    """Hash-consed graph of several scalar outputs.

    Parameters
    ----------
    operations : Operations
        What is to be computed.
    names : mapping from element hash to C text
        How each symbol is written.
    tables : mapping from the name of a table's CasADi function to C text
        How the arrays of each table begin; the same name where there is none.

    Attributes
    ----------
    nodes : list of Node
        In an order in which operands come first.
    roots : list of int
        Node of each output.
    """

    def __init__(
        self,
        operations: Operations,
        names: Mapping[int, str],
        tables: Mapping[str, str] | None = None,
    ) -> None:
        self.nodes: list[Node] = []
        self._index: dict[Node, int] = {}
        place: dict[int, int] = {}
        for k in sorted(operations.reach(operations.roots)):
            op, operands, number = operations.keys[k]
            args = tuple(place[a] for a in operands)
            if op == ca.OP_INPUT:
                symbol = operations.symbols[int(number)]
                place[k] = self._add(Node("symbol", (), names[symbol.element_hash()]))
            elif op == ca.OP_CONST:
                place[k] = self._constant(number)
            elif op == ca.OP_CALL:
                called = operations.called[int(number)]
                place[k] = self._add(Node("cell", args, (tables or {}).get(called, called)))
            elif op == ENTRY:
                place[k] = self._add(Node("entry", args, str(int(number))))
            elif op in _UNARY:
                place[k] = self._unary(_UNARY[op], *args)
            else:
                place[k] = self._binary(_BINARY[op], *args)
        self.roots = [place[k] for k in operations.roots]
        self._share_reciprocals()

    def _share_reciprocals(self) -> None:
        """Several quotients by one divisor become products with its reciprocal."""
        divisors: dict[int, int] = {}
        for k in self._needed():
            node = self.nodes[k]
            if node.op in ("/", "inv"):
                divisors[node.args[-1]] = divisors.get(node.args[-1], 0) + 1
        shared = {d for d, n in divisors.items() if n > 1 and self.nodes[d].op != "const"}
        if not shared:
            return
        old, self.nodes, self._index = self.nodes, [], {}
        place: list[int] = []
        for node in old:
            args = tuple(place[a] for a in node.args)
            if node.op == "/" and node.args[1] in shared:
                factors = sorted((args[0], self._add(Node("inv", (args[1],)))))
                place.append(self._add(Node("*", (factors[0], factors[1]))))
            else:
                place.append(self._add(Node(node.op, args, node.text, node.value)))
        self.roots = [place[k] for k in self.roots]

    @property
    def operations(self) -> int:
        """Number of operations that the outputs need."""
        return self.count(self._needed())

    def count(self, nodes: set[int]) -> int:
        """Number of operations among nodes."""
        free = ("symbol", "const", "neg", "entry")
        return sum(self.nodes[k].op not in free for k in nodes)

    def _needed(self) -> set[int]:
        """Nodes that the outputs need."""
        return self.reach(self.roots)

    def reach(self, roots: Sequence[int]) -> set[int]:
        """Nodes that the given ones need, with these."""
        seen: set[int] = set()
        stack = list(roots)
        while stack:
            k = stack.pop()
            if k not in seen:
                seen.add(k)
                stack.extend(self.nodes[k].args)
        return seen

    def _add(self, node: Node) -> int:
        if node not in self._index:
            self._index[node] = len(self.nodes)
            self.nodes.append(node)
        return self._index[node]

    def _constant(self, value: float) -> int:
        if value < 0:
            return self._unary("neg", self._constant(-value))
        return self._add(Node("const", (), "", value + 0.0))

    def _unary(self, op: str, a: int) -> int:
        node = self.nodes[a]
        if op == "neg":
            if node.op == "neg":
                return node.args[0]
            if node.op == "-":  # -(x - y) = y - x
                return self._binary("-", node.args[1], node.args[0])
        elif op == "sq":
            if node.op == "neg":
                a = node.args[0]
            return self._binary("*", a, a)
        elif op == "twice":
            return self._binary("*", self._constant(2.0), a)
        elif op in ("sin", "tan", "sinh", "tanh", "asin", "atan", "asinh", "atanh", "erf", "inv"):
            if node.op == "neg":  # odd functions: the sign comes out exactly
                return self._unary("neg", self._unary(op, node.args[0]))
        elif op in ("cos", "cosh", "fabs") and node.op == "neg":
            a = node.args[0]
        return self._add(Node(op, (a,)))

    def _binary(self, op: str, a: int, b: int) -> int:
        # Signs are moved outwards; IEEE arithmetic is symmetric in sign, so no bit changes.
        na, nb = self.nodes[a], self.nodes[b]
        if op == "+":
            if nb.op == "neg":
                return self._binary("-", a, nb.args[0])
            if na.op == "neg":
                return self._binary("-", b, na.args[0])
            chosen = self._select(na, nb)
            if chosen is not None:
                return chosen
        elif op == "-":
            if nb.op == "neg":
                return self._binary("+", a, nb.args[0])
            if na.op == "neg":
                return self._unary("neg", self._binary("+", na.args[0], b))
        elif op in ("*", "/"):
            if na.op == "neg":
                return self._unary("neg", self._binary(op, na.args[0], b))
            if nb.op == "neg":
                return self._unary("neg", self._binary(op, a, nb.args[0]))
            scaled = self._pull_scale(op, a, b)
            if scaled is not None:
                return scaled
            if op == "*" and a == b:
                return self._add(Node("sq", (a,)))
            if op == "*" and nb.op == "inv":
                return self._binary("/", a, nb.args[0])
            if op == "*" and na.op == "inv":
                return self._binary("/", b, na.args[0])
        if (op in COMMUTATIVE and (nb.op == "const") > (na.op == "const")) or (
            op in COMMUTATIVE and (nb.op == "const") == (na.op == "const") and a > b
        ):
            a, b = b, a
        return self._add(Node(op, (a, b)))

    def _scale(self, k: int) -> tuple[float, int]:
        """Split node k into a power of two and the rest."""
        node = self.nodes[k]
        if node.op == "*" and self.nodes[node.args[0]].op == "const":
            value = self.nodes[node.args[0]].value
            if math.frexp(value)[0] == 0.5:
                return value, node.args[1]
        return 1.0, k

    def _pull_scale(self, op: str, a: int, b: int) -> int | None:
        """Gather powers of two in front of products and quotients, which changes no bit."""
        na, nb = self.nodes[a], self.nodes[b]
        if op == "/" and nb.op == "const" and math.frexp(nb.value)[0] == 0.5:
            return self._binary("*", self._constant(1.0 / nb.value), a)
        if na.op == "const" and op == "*":
            if na.value == 1.0:
                return b
            c, rest = self._scale(b)
            if c == 1.0:
                return None
            return self._binary("*", self._constant(na.value * c), rest)
        if nb.op == "const" and op == "*":
            return self._pull_scale(op, b, a)
        c_a, rest_a = self._scale(a)
        c_b, rest_b = self._scale(b)
        c = c_a * c_b if op == "*" else c_a / c_b
        if c_a == 1.0 and c_b == 1.0:
            return None
        return self._binary("*", self._constant(c), self._binary(op, rest_a, rest_b))

    def _select(self, a: Node, b: Node) -> int | None:
        """CasADi writes c ? x : y as (c ? x : 0) + (!c ? y : 0)."""
        if a.op != "if_else_zero" or b.op != "if_else_zero":
            return None
        ca_, cb = self.nodes[a.args[0]], self.nodes[b.args[0]]
        if cb.op == "!" and cb.args[0] == a.args[0]:
            return self._add(Node("select", (a.args[0], a.args[1], b.args[1])))
        if ca_.op == "!" and ca_.args[0] == b.args[0]:
            return self._add(Node("select", (b.args[0], b.args[1], a.args[1])))
        return None
