"""Directions, masses and sizes that a user gives, looked at before they are used."""

from typing import Any

from signorini.bodies.algebra import Vector, dot, number, scale
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import Model
from signorini.codegen.frontend.symbols import is_number

_CLOSE = 1e-9


def unit(model: Model, what: str, direction: Vector) -> Vector:
    """A direction of length one: numbers are divided by their length, expressions are checked.

    Raises
    ------
    ModelError
        For the zero vector, or an expression whose length is not one with the default parameters.
    """
    if all(is_number(c) for c in direction):
        square = sum(float(c) ** 2 for c in direction)
        if not 0 < square < float("inf"):
            raise ModelError(
                model.name, what, f"is {tuple(direction)}", "Give a direction that is not zero"
            )
        exact = dot(direction, direction) == 1
        return direction if exact else scale(1 / square**0.5, tuple(float(c) for c in direction))
    length = _default(model, what, dot(direction, direction))
    if length is not None and abs(length - 1) > _CLOSE:
        raise ModelError(
            model.name,
            what,
            f"{tuple(direction)} has length {length**0.5:g} with the default parameters",
            "Divide it by its length: directions are unit vectors",
        )
    return direction


def positive(model: Model, what: str, value: Any, *, zero: bool = False) -> Any:
    """A mass, radius or inertia that is not negative with the default parameters.

    Raises
    ------
    ModelError
        With the value.
    """
    found = _default(model, what, value)
    if found is not None and not (found >= 0 if zero else found > 0):
        raise ModelError(
            model.name,
            what,
            f"is {found:g}" + ("" if is_number(value) else " with the default parameters"),
            "It must be >= 0" if zero else "It must be > 0",
        )
    return value


def _default(model: Model, what: str, expr: Any) -> float | None:
    """The value with the default parameters; None where it depends on more than these."""
    if is_number(expr):
        return float(expr)
    try:
        return number(model, what, expr)
    except ModelError as error:
        if "depends on" in error.problem:
            return None
        raise
