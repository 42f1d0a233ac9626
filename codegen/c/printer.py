"""C99 text of an expression graph: nodes used once are folded, the rest are named temporaries."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from signorini.codegen.c.loops import Entry, Run, find_runs, index_text
from signorini.codegen.frontend.errors import GenerationError
from signorini.codegen.graph import LOGICAL, Graph, Node

_WIDTH = 96  # columns after which a statement is broken or a temporary made
_PRECEDENCE = {"*": 5, "/": 5, "+": 4, "-": 4, "<": 3, "<=": 3, "==": 2, "!=": 2, "&&": 1, "||": 0}
_IDENTIFIER = re.compile(r"[A-Za-z_]\w*\Z")


@dataclass(frozen=True)
class Precision:
    """The real type: name, C type, literal suffix, libm suffix, bytes on the host."""

    name: str
    c_type: str
    literal: str
    libm: str
    size: int

    def number(self, value: float) -> str:
        """Shortest literal that reads back as `value` (for float: as the nearest float)."""
        text = repr(float(value))
        if self.name == "float":
            import numpy as np

            if abs(value) > float(np.finfo(np.float32).max):
                raise GenerationError(
                    f"the number {value:g} in an expression is beyond what single precision holds: "
                    "scale the model's units, or generate in double precision"
                )
            text = str(np.float32(value))
        if "e" in text:
            mantissa, exponent = text.split("e")
            text = (mantissa if "." in mantissa else mantissa + ".0") + "e" + str(int(exponent))
        elif "." not in text:
            text += ".0"
        return text + self.literal


DOUBLE = Precision("double", "double", "", "", 8)
FLOAT = Precision("float", "float", "F", "f", 4)
# for verification: 64 bits on x86, 113 on 64-bit ARM under Linux; without NumPy's or ctypes' help
# none of the wider types could be had from Python
EXTENDED = Precision("extended", "long double", "L", "l", 16)
PRECISIONS = {p.name: p for p in (DOUBLE, FLOAT, EXTENDED)}


def statements(
    graph: Graph,
    targets: Sequence[str],
    comments: Sequence[str],
    real: str,
    precision: Precision,
    taken: set[str],
    entries: Mapping[str, Entry],
) -> tuple[list[str], list[list[str]], int]:
    """Return temporaries, the lines of each output, as C, and the number of operations.

    Parameters
    ----------
    graph : Graph
        What is computed.
    targets : sequence of str
        Left-hand side of each output.
    comments : sequence of str
        Comment behind each output, or "".
    real : str
        Name of the real type.
    precision : Precision
        Literal and libm suffixes.
    taken : set of str
        Identifiers that temporaries must not use.
    entries : mapping from C text to Entry
        Which symbols and targets are entries of arrays: long runs of them become loops.
    """
    runs = find_runs(graph, [entries.get(t) for t in targets], comments, entries)
    return _Printer(graph, real, precision, taken, entries, runs).run(targets, comments)


class _Printer:
    def __init__(
        self,
        graph: Graph,
        real: str,
        precision: Precision,
        taken: set[str],
        entries: Mapping[str, Entry],
        runs: Sequence[Run],
    ) -> None:
        self.graph = graph
        self.entries = entries
        self.runs = {run.first: run for run in runs}
        looped = {k for run in runs for k in range(run.first, run.first + run.count)}
        self.roots = [root for k, root in enumerate(graph.roots) if k not in looped]
        self.looped = looped
        self.real = real
        self.precision = precision
        self.taken = set(taken)
        self.uses = self._count_uses()
        self.text: dict[int, tuple[str, int]] = {}
        self.temporaries: list[str] = []
        self.numbered = 0

    def _count_uses(self) -> list[int]:
        uses = [0] * len(self.graph.nodes)
        seen: set[int] = set()
        stack = list(self.roots)
        for root in self.roots:
            uses[root] += 1
        while stack:
            k = stack.pop()
            if k in seen:
                continue
            seen.add(k)
            node = self.graph.nodes[k]
            for a in node.args:
                # A square repeats its operand in the text.
                uses[a] += 2 if node.op in ("sq", "sign") else 1
                stack.append(a)
        return uses

    def run(
        self, targets: Sequence[str], comments: Sequence[str]
    ) -> tuple[list[str], list[list[str]], int]:
        needed = self.graph.reach(self.roots)
        for k in sorted(needed):
            self._print(k)
        operations = self.graph.count(needed)
        outputs = []
        for k, (target, root, comment) in enumerate(
            zip(targets, self.graph.roots, comments, strict=True)
        ):
            if k in self.runs:
                run = self.runs[k]
                outputs.append(self._loop(run, target, root))
                operations += run.count * self.graph.count(self.graph.reach([root]))
            elif k in self.looped:
                outputs.append([])
            else:
                value = self.text[root][0]
                outputs.append(_wrap(f"{target} = {self._real(root, value)};", comment))
        return self.temporaries, outputs, operations

    def _loop(self, run: Run, target: str, root: int) -> list[str]:
        """One statement for all of a run."""
        order = iter(run.indices)
        texts: dict[str, str] = {}
        stack = [root]
        while stack:
            node = self.graph.nodes[stack.pop()]
            if node.op == "symbol" and node.text in self.entries:
                texts[node.text] = self.entries[node.text].text.format(index_text(*next(order)))
            stack.extend(node.args)
        outside, self.text = self.text, {}
        for k in sorted(self.graph.reach([root])):
            node = self.graph.nodes[k]
            self.text[k] = self._expression(node)
            if node.op == "symbol" and node.text in texts:
                self.text[k] = texts[node.text], 9
        value = self._real(root, self.text[root][0])
        self.text = outside
        left = self.entries[target].text.format(index_text(*run.target))
        body = [f"    {line}" for line in _wrap(f"{left} = {value};", "")]
        return [f"for (k = 0; k < {run.count}; ++k) {{", *body, "}"]

    def _real(self, k: int, text: str) -> str:
        """A truth value as a number."""
        if self.graph.nodes[k].op in LOGICAL:
            one, zero = self.precision.number(1.0), self.precision.number(0.0)
            return f"({text}) ? {one} : {zero}"
        return text

    def _print(self, k: int) -> None:
        node = self.graph.nodes[k]
        text, precedence = self._expression(node)
        leaf = node.op in ("symbol", "const", "entry") or (
            node.op == "neg" and self.graph.nodes[node.args[0]].op in ("symbol", "const")
        )
        simple = leaf and ("[" not in text or self.uses[k] <= 2 or node.op == "symbol")
        if node.op == "cell":
            name = self._numbered("cell")
            self.temporaries += _wrap(f"const {self.real} *const {name} = {text};", "")
            text, precedence = name, 9
        elif (self.uses[k] > 1 and not simple) or (len(text) > _WIDTH and not leaf):
            name = self._name(node)
            kind = "int" if node.op in LOGICAL else self.real
            self.temporaries += _wrap(f"const {kind} {name} = {text};", "")
            text, precedence = name, 9
        self.text[k] = (text, precedence)

    def _name(self, node: Node) -> str:
        name = ""
        if node.op in ("sin", "cos", "tan", "exp", "log", "sqrt", "sq"):
            argument = self.text[node.args[0]][0]
            if _IDENTIFIER.match(argument) and not re.match(r"w\d+\Z", argument):
                name = f"{node.op}_{argument}"
        if not name or name in self.taken:
            name = f"w{self.numbered}"
            while name in self.taken:
                self.numbered += 1
                name = f"w{self.numbered}"
        self.taken.add(name)
        return name

    def _numbered(self, name: str) -> str:
        """A name that is still free: this one, or with a number."""
        free, k = name, 1
        while free in self.taken:
            k += 1
            free = f"{name}_{k}"
        self.taken.add(free)
        return free

    def _operand(self, k: int, minimum: int) -> str:
        text, precedence = self.text[k]
        node = self.graph.nodes[k]
        if node.op in LOGICAL and not _IDENTIFIER.match(text):
            return f"({text})"
        return f"({text})" if precedence < minimum else text

    def _value(self, k: int, minimum: int) -> str:
        """Operand of arithmetic: a truth value counts as 0 or 1."""
        if self.graph.nodes[k].op in LOGICAL:
            return f"({self._real(k, self.text[k][0])})"
        return self._operand(k, minimum)

    def _truth(self, k: int) -> str:
        """Operand of logic: a number counts as true if it is not 0."""
        if self.graph.nodes[k].op in LOGICAL:
            text = self.text[k][0]
            return text if _IDENTIFIER.match(text) else f"({text})"
        return f"({self._operand(k, 3)} != {self.precision.number(0.0)})"

    def _expression(self, node: Node) -> tuple[str, int]:
        op = node.op
        if op == "symbol":
            return node.text, 9
        if op == "const":
            return self.precision.number(node.value), 9
        if op == "cell":
            place = ", ".join(self._value(a, 0) for a in node.args)
            return f"{node.text}_at({place})", 9
        if op == "entry":
            return f"{self.text[node.args[0]][0]}[{node.text}]", 9
        if op == "neg":
            return f"-{self._value(node.args[0], 6)}", 6
        if op == "sq":
            x = self._value(node.args[0], 6)
            return f"{x} * {x}", 5
        if op == "inv":
            return f"{self.precision.number(1.0)} / {self._value(node.args[0], 6)}", 5
        if op == "sign":
            x = self._value(node.args[0], 4)
            one, zero = self.precision.number(1.0), self.precision.number(0.0)
            return f"({x} > {zero} ? {one} : ({x} < {zero} ? -{one} : {x}))", 9
        if op == "!":
            return f"!{self._truth(node.args[0])}", 6
        if op in ("&&", "||"):
            return f"{self._truth(node.args[0])} {op} {self._truth(node.args[1])}", _PRECEDENCE[op]
        if op in ("<", "<=", "==", "!="):
            left, right = (self._value(a, 4) for a in node.args)
            return f"{left} {op} {right}", _PRECEDENCE[op]
        if op in ("select", "if_else_zero"):
            condition = self._truth(node.args[0])
            yes = self._value(node.args[1], 1)
            no = self._value(node.args[2], 1) if op == "select" else self.precision.number(0.0)
            return f"({condition} ? {yes} : {no})", 9
        if op in ("+", "-"):
            left = self._value(node.args[0], 4)
            return f"{left} {op} {self._value(node.args[1], 5)}", 4
        if op in ("*", "/"):
            left = self._value(node.args[0], 5)
            return f"{left} {op} {self._value(node.args[1], 6)}", 5
        arguments = ", ".join(self._value(a, 0) for a in node.args)
        return f"{op}{self.precision.libm}({arguments})", 9


def _wrap(line: str, comment: str) -> list[str]:
    """Break a long statement where the fewest parentheses are open; a long comment goes first."""
    if len(line) + len(comment) + 7 <= _WIDTH + 14 and comment:
        return [f"{line} /* {comment} */"]
    lines = [f"/* {comment} */"] if comment else []
    indent = ""
    while len(line) > _WIDTH + 4:
        depth = 0
        best: tuple[int, int] | None = None  # (rank of the break, column)
        for k, character in enumerate(line[: _WIDTH + 3]):
            depth += (character == "(") - (character == ")")
            if character == " " and k > 30 and line[k + 2 : k + 3] == " ":
                rank = 2 * depth + (line[k + 1] in "*/")
                if line[k + 1] in "+-*/?:" and (best is None or rank <= best[0]):
                    best = (rank, k)
        if best is None:
            break
        lines.append(line[: best[1]])
        indent = "    "
        line = indent + line[best[1] + 1 :]
    return [*lines, line]
