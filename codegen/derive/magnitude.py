"""The size of a sum's terms: what its round-off is measured by where the terms cancel."""

from collections.abc import Callable
from typing import Any

import casadi as ca


def magnitude(expr: ca.SX) -> ca.SX:
    """Sum of the absolute terms of every entry, products multiplied out no further than written.

    At an equilibrium the value of a force is round-off while its terms are not: a tolerance has to
    be relative to these.

    Parameters
    ----------
    expr : SX
        Any dense matrix.

    Returns
    -------
    SX
        The same shape; nowhere less than ``fabs(expr)``.
    """
    memo: dict[int, ca.SX] = {}
    entries: list[Any] = expr.nonzeros()
    for entry in entries:
        stack = [ca.SX(entry)]
        while stack:
            node = stack[-1]
            key = node.element_hash()
            if key in memo:
                stack.pop()
                continue
            # of a quotient only the numerator is a sum of terms
            count = 0 if node.op() not in _RULES else 1 if node.op() == ca.OP_DIV else node.n_dep()
            parts = [node.dep(k) for k in range(count)]
            missing = [part for part in parts if part.element_hash() not in memo]
            if missing:
                stack.extend(missing)
                continue
            terms = [memo[part.element_hash()] for part in parts]
            if node.op() == ca.OP_DIV:
                terms.append(ca.fabs(node.dep(1)))
            memo[key] = _RULES[node.op()](*terms) if terms else ca.fabs(node)
            stack.pop()
    sizes = [memo[ca.SX(entry).element_hash()] for entry in entries]
    return ca.SX(expr.sparsity(), ca.vertcat(ca.SX(0, 1), *sizes))


_RULES: dict[int, Callable[..., ca.SX]] = {
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a + b,
    ca.OP_NEG: lambda a: a,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b,
    ca.OP_TWICE: lambda a: 2 * a,
    ca.OP_SQ: lambda a: a * a,
}
