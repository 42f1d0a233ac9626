"""A walk over the different terms of a SymPy expression."""

from collections.abc import Iterator
from typing import Any

import sympy as sp


class unique_nodes:  # noqa: N801 - used as a function: for node in unique_nodes(expr)
    """The different terms of an expression, each once, operands first; equal terms are one.

    Neither the depth of an expression nor the number of paths to a shared term matters: the walk
    is a loop, and hashes are made from the leaves upwards.
    """

    def __init__(self, root: sp.Basic) -> None:
        self._canonical: dict[int, sp.Basic] = {}
        self._kept: list[sp.Basic] = []
        table: dict[Any, sp.Basic] = {}
        self._order: list[sp.Basic] = []
        stack: list[tuple[sp.Basic, bool]] = [(root, False)]
        while stack:
            node, ready = stack.pop()
            if id(node) in self._canonical:
                continue
            children = node.args
            if not ready and children:
                stack.append((node, True))
                stack.extend((c, False) for c in children if id(c) not in self._canonical)
                continue
            key: Any = node
            if children:
                key = (type(node), tuple(id(self._canonical[id(c)]) for c in children))
            chosen = table.setdefault(key, node)
            self._kept.append(node)  # an id is that of a living object
            self._canonical[id(node)] = chosen
            if chosen is node:
                hash(node)
                self._order.append(node)
        self.root = self._canonical[id(root)]

    def __iter__(self) -> Iterator[sp.Basic]:
        return iter(self._order)

    def canonical(self, node: sp.Basic) -> sp.Basic:
        """The one that stands for all terms equal to `node`."""
        return self._canonical[id(node)]

    def children(self, node: sp.Basic) -> list[sp.Basic]:
        """Operands of a term, each the one that stands for all equal ones."""
        return [self._canonical[id(c)] for c in node.args]
