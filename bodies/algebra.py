"""Scalars and small vectors in either symbol world."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import casadi as ca
import sympy as sp
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import Model

Vector = tuple[Any, ...]
Matrix = tuple[Vector, ...]


class Algebra(Protocol):
    """What the layer computes with expressions of one symbol world."""

    def sin(self, x: Any) -> Any: ...
    def cos(self, x: Any) -> Any: ...
    def acos(self, x: Any) -> Any: ...
    def sqrt(self, x: Any) -> Any: ...
    def minimum(self, a: Any, b: Any) -> Any: ...
    def maximum(self, a: Any, b: Any) -> Any: ...
    def where_positive(self, x: Any, yes: Any, no: Any) -> Any:
        """`yes` where x > 0, else `no`."""
        ...

    def derivative(self, expr: Any, symbol: Any) -> Any: ...
    def value_and_gradient(self, phi: Callable[..., Any], at: Vector) -> tuple[Any, Vector]:
        """phi(*at) and its partial derivatives there."""
        ...


class _SymPy:
    def sin(self, x: Any) -> Any:
        return sp.sin(x)

    def cos(self, x: Any) -> Any:
        return sp.cos(x)

    def acos(self, x: Any) -> Any:
        return sp.acos(x)

    def sqrt(self, x: Any) -> Any:
        return sp.sqrt(x)

    # not evaluated: SymPy would compare all pairs of terms, at length
    def minimum(self, a: Any, b: Any) -> Any:
        return sp.Min(a, b, evaluate=False)

    def maximum(self, a: Any, b: Any) -> Any:
        return sp.Max(a, b, evaluate=False)

    def where_positive(self, x: Any, yes: Any, no: Any) -> Any:
        return sp.Piecewise((yes, sp.sympify(x) > 0), (no, True))

    def derivative(self, expr: Any, symbol: Any) -> Any:
        return sp.diff(expr, symbol)

    def value_and_gradient(self, phi: Callable[..., Any], at: Vector) -> tuple[Any, Vector]:
        arguments = [sp.Dummy(real=True) for _ in at]
        value = sp.sympify(phi(*arguments))
        there = dict(zip(arguments, at, strict=True))
        gradient = tuple(sp.diff(value, x).subs(there, simultaneous=True) for x in arguments)
        return value.subs(there, simultaneous=True), gradient


class _CasADi:
    def sin(self, x: Any) -> Any:
        return ca.sin(x)

    def cos(self, x: Any) -> Any:
        return ca.cos(x)

    def acos(self, x: Any) -> Any:
        return ca.acos(x)

    def sqrt(self, x: Any) -> Any:
        return ca.sqrt(x)

    def minimum(self, a: Any, b: Any) -> Any:
        return ca.fmin(a, b)

    def maximum(self, a: Any, b: Any) -> Any:
        return ca.fmax(a, b)

    def where_positive(self, x: Any, yes: Any, no: Any) -> Any:
        return ca.if_else(ca.SX(x) > 0, yes, no)

    def derivative(self, expr: Any, symbol: Any) -> Any:
        return ca.jacobian(ca.SX(expr), symbol)

    def value_and_gradient(self, phi: Callable[..., Any], at: Vector) -> tuple[Any, Vector]:
        arguments = [ca.SX.sym(f"x{k}") for k in range(len(at))]
        value = ca.SX(phi(*arguments))
        gradient = [ca.jacobian(value, x) for x in arguments]
        there = [ca.SX(x) for x in at]
        values = ca.substitute([value, *gradient], arguments, there)
        return values[0], tuple(values[1:])


def algebra_of(model: Model) -> Algebra:
    """The algebra of the model's symbol world."""
    return _CasADi() if model.world.name == "casadi" else _SymPy()


def number(model: Model, what: str, expr: Any) -> float:
    """An expression of parameters as a number, with their defaults.

    Raises
    ------
    ModelError
        If it depends on anything else.
    """
    sx = model.world.to_sx(model.name, what, expr)
    defaults = [float(p.default) for p in model.parameter_table.values()]
    par = [model.world.to_sx(model.name, what, p) for p in model.par]
    f = ca.Function("number", [ca.vertcat(ca.SX(0, 1), *par)], [sx], {"allow_free": True})
    free = f.get_free()
    if free:
        raise ModelError(
            model.name, what, f"depends on {free[0]}", "Only parameters may stand here"
        )
    return float(f(defaults))


def total_derivative(model: Model, expr: Any) -> Any:
    """d(expr)/dt of an expression of t, q along the motion."""
    algebra = algebra_of(model)
    rate = algebra.derivative(expr, model.time)
    for q, v in zip(model.q, model.v, strict=True):
        rate = rate + algebra.derivative(expr, q) * v
    return rate


def is_zero(x: Any) -> bool:
    """Whether a number is zero, or an expression that is nothing else."""
    if isinstance(x, (int, float)):
        return x == 0
    said = getattr(x, "is_zero", False)  # SymPy has a property, CasADi a method
    return bool(said() if callable(said) else said)


def add(a: Sequence[Any], b: Sequence[Any]) -> Vector:
    """a + b."""
    return tuple(x + y for x, y in zip(a, b, strict=True))


def subtract(a: Sequence[Any], b: Sequence[Any]) -> Vector:
    """a - b."""
    return tuple(x - y for x, y in zip(a, b, strict=True))


def scale(factor: Any, a: Sequence[Any]) -> Vector:
    """factor times a."""
    return tuple(factor * x for x in a)


def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """a . b."""
    terms = [x * y for x, y in zip(a, b, strict=True)]
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def cross(a: Sequence[Any], b: Sequence[Any]) -> Vector:
    """a x b in space."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def apply(A: Matrix, x: Sequence[Any]) -> Vector:
    """A x."""
    return tuple(dot(row, x) for row in A)


def multiply(A: Matrix, B: Matrix) -> Matrix:
    """A B."""
    return tuple(tuple(dot(row, column) for column in zip(*B, strict=True)) for row in A)


def transpose(A: Matrix) -> Matrix:
    """A^T."""
    return tuple(zip(*A, strict=True))
