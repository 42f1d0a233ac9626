"""CasADi expressions that count as twice continuously differentiable although they branch."""

import casadi as ca

# CasADi has no named wrapper for scalars, so vouched nodes are remembered; the reference keeps
# the key unique.
_vouched: dict[int, ca.SX] = {}


def vouch(expr: ca.SX) -> ca.SX:
    """Return `expr`, which is vouched for from now on."""
    _vouched[expr.element_hash()] = expr
    return expr


def all_vouched() -> list[ca.SX]:
    """Every vouched expression of this process."""
    return list(_vouched.values())


def is_vouched(key: int) -> bool:
    """Whether the expression with this hash is vouched for."""
    return key in _vouched
