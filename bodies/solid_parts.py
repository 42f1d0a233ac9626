"""What the rules for contacts of solids have in common."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from signorini.bodies.algebra import Algebra, scale
from signorini.bodies.shapes import Touch

TIE = 1e-9  # of a length or a squared sine: what is nearer counts as equal
Found = Iterator[tuple[str, Touch]]


def turned(found: Touch) -> Touch:
    """The same contact with the solids in the other order."""
    n, velocity = scale(-1, found.normal), scale(-1, found.velocity)
    return replace(found, normal=n, velocity=velocity)


def clamped(algebra: Algebra, x: Any, low: Any, high: Any) -> Any:
    return algebra.minimum(algebra.maximum(x, low), high)


def inside(algebra: Algebra, *shares: Any) -> Any:
    """Positive if all shares lie between 0 and 1, and not at their ends."""
    value: Any = 1
    for t in shares:
        value = algebra.minimum(value, algebra.minimum(t, 1 - t))
    return value - TIE
