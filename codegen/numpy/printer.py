"""NumPy text of an expression graph; every node may be an array of any shape."""

import re
from collections.abc import Sequence

from signorini.codegen.graph import Graph, Node

# Operations of the graph that NumPy calls otherwise, or that are written out.
_FUNCTIONS = {
    "fabs": "np.abs", "asin": "np.arcsin", "acos": "np.arccos", "atan": "np.arctan",
    "asinh": "np.arcsinh", "acosh": "np.arccosh", "atanh": "np.arctanh", "pow": "np.power",
    "atan2": "np.arctan2", "erf": "_erf", "remainder": "_remainder",
    "&&": "np.logical_and", "||": "np.logical_or", "!": "np.logical_not",
}  # fmt: skip
_INFIX = frozenset({"+", "-", "*", "/", "<", "<=", "==", "!="})
_PATTERNS = {
    "neg": "(-{0})",
    "sq": "({0} * {0})",
    "inv": "(1.0 / {0})",
    "select": "np.where({0}, {1}, {2})",
    "if_else_zero": "np.where({0}, {1}, 0.0)",
    "cell": "{text}_at({all})",
    "entry": "{0}[..., {text}]",
}
# Operations whose operands are truth values.
_LOGICAL = frozenset({"&&", "||", "!"})
_WIDTH = 88


def statements(graph: Graph) -> tuple[list[str], list[str]]:
    """Lines that compute what is used more than once, and the text of every output."""
    uses = _count_uses(graph)
    text: dict[int, str] = {}
    lines: list[str] = []
    for k in sorted(uses):
        node = graph.nodes[k]
        value = _expression(node, [text[a] for a in node.args])
        leaf = node.op in ("symbol", "const")
        if not leaf and (uses[k] > 1 or node.op == "cell" or len(value) > _WIDTH):
            name = f"w{len(lines)}"
            lines.append(f"{name} = {value}")
            value = name
        text[k] = value
    return lines, [text[k] for k in graph.roots]


def _count_uses(graph: Graph) -> dict[int, int]:
    uses: dict[int, int] = {}
    stack = list(graph.roots)
    while stack:
        k = stack.pop()
        uses[k] = uses.get(k, 0) + 1
        if uses[k] == 1:
            node = graph.nodes[k]
            stack.extend(node.args * 2 if node.op == "sq" else node.args)
    return uses


def _expression(node: Node, args: Sequence[str]) -> str:
    if node.op == "symbol":
        return node.text
    if node.op == "const":
        return repr(node.value)
    if node.op in _INFIX:
        return f"({args[0]} {node.op} {args[1]})"
    if node.op in _PATTERNS:
        return _PATTERNS[node.op].format(*args, text=node.text, all=", ".join(args))
    function = _FUNCTIONS.get(node.op, f"np.{node.op}")
    return f"{function}({', '.join(args)})"


def identifier(name: str, taken: set[str]) -> str:
    """A name of Python that is still free; it is taken from then on."""
    import keyword

    while keyword.iskeyword(name) or name in taken or re.fullmatch(r"w\d+", name):
        name += "_"
    taken.add(name)
    return name
