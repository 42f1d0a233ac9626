"""Statements in a row that differ in their indices alone: they become loops."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from signorini.codegen.graph import Graph

_LEAST = 16  # statements in a row that are worth a loop: fewer are read more easily one by one
_LARGEST = 60  # nodes of an expression that is looked at


@dataclass(frozen=True)
class Entry:
    """An entry of an array: C text with a hole for the index, and the index."""

    text: str
    index: int


@dataclass(frozen=True)
class Run:
    """Statements `first`, `first + 1`, ... of a function, `count` of them.

    `indices` has first index and stride of every entry in the order in which they are read;
    `target` those of the entry that is written.
    """

    first: int
    count: int
    target: tuple[int, int]
    indices: tuple[tuple[int, int], ...]


_Form = tuple[tuple[str | float, ...], ...]


def find_runs(
    graph: Graph,
    targets: Sequence[Entry | None],
    comments: Sequence[str],
    entries: Mapping[str, Entry],
) -> list[Run]:
    """Runs of statements with equal expressions, equal strides and no comments."""
    forms = [
        None if target is None or comment else _form(graph, root, entries)
        for target, comment, root in zip(targets, comments, graph.roots, strict=True)
    ]
    runs = []
    first = 0
    while first < len(forms):
        run = _run_from(first, targets, forms)
        if run.count >= _LEAST:
            runs.append(run)
        first += max(run.count, 1)
    return runs


def _form(
    graph: Graph, root: int, entries: Mapping[str, Entry]
) -> tuple[_Form, tuple[int, ...]] | None:
    """The expression without its indices, and the indices; None if it is long or no arithmetic."""
    parts: list[tuple[str | float, ...]] = []
    indices: list[int] = []
    stack = [root]
    while stack:
        node = graph.nodes[stack.pop()]
        if node.op in ("cell", "entry") or len(parts) > _LARGEST:
            return None
        if node.op == "symbol" and node.text in entries:
            parts.append(("entry", entries[node.text].text))
            indices.append(entries[node.text].index)
        else:
            parts.append((node.op, node.text, node.value))
            stack.extend(node.args)
    return tuple(parts), tuple(indices)


def _run_from(
    first: int,
    targets: Sequence[Entry | None],
    forms: Sequence[tuple[_Form, tuple[int, ...]] | None],
) -> Run:
    start, form = targets[first], forms[first]
    if start is None or form is None or first + 1 == len(forms):
        return Run(first, 1, (0, 0), ())
    strides: tuple[int, ...] | None = None
    count = 1
    while first + count < len(forms):
        target, other = targets[first + count], forms[first + count]
        if target is None or other is None or other[0] != form[0] or target.text != start.text:
            break
        moved = tuple(
            b - a for a, b in zip((start.index, *form[1]), (target.index, *other[1]), strict=True)
        )
        if strides is None:
            strides = moved
        if min(moved) < 0 or moved != tuple(count * d for d in strides):
            break
        count += 1
    if strides is None or count == 1:
        return Run(first, 1, (0, 0), ())
    pairs = tuple(zip((start.index, *form[1]), strides, strict=True))
    return Run(first, count, pairs[0], pairs[1:])


def index_text(first: int, stride: int) -> str:
    """The index of an entry in a loop over k."""
    if stride == 0:
        return str(first)
    step = "k" if stride == 1 else f"{stride} * k"
    return step if first == 0 else f"{first} + {step}"
