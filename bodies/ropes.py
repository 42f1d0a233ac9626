"""Ropes: how long the way is through points and around pulleys."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from signorini.bodies.algebra import Algebra, Vector, add, dot, scale, subtract
from signorini.bodies.frames import Frame, Point


@dataclass(frozen=True, eq=False)
class Pulley:
    """A disc that a rope lies on.

    Attributes
    ----------
    center : Point
        Of a frame: the pulley moves with it.
    radius : expression
        [m]
    over : sequence of 2 or 3 expressions
        Unit vector from the centre, in components of the centre's frame, to a place where the
        rope lies on the disc all along; on either side it leaves the disc along a tangent, within
        half a turn. Where the rope ends on the disc, as on a drum, it is fastened there.
    crossed : bool
        On its way to the next pulley the rope crosses the line of their centres.
    """

    center: Point
    radius: Any
    over: Sequence[Any]
    crossed: bool = False

    @property
    def frame(self) -> Frame:
        """The frame that the pulley moves with."""
        return self.center.frame


def way(algebra: Algebra, path: Sequence[Point | Pulley]) -> tuple[Any, list[Vector]]:
    """Length of the way along a path, and the ends of its straight parts, two for each.

    Between two discs of radii r and s whose centres are D apart the straight part is
    sqrt(D^2 - (r - s)^2) long, crossed sqrt(D^2 - (r + s)^2); it leaves the first disc at the angle
    acos((r - s) / D), crossed acos((r + s) / D), from the line of centres. A point is a disc of
    radius zero. On a disc the rope lies from `over` to either angle.
    """
    length: Any = 0
    corners: list[Vector] = []
    for one, other in pairwise(path):
        crossed = isinstance(one, Pulley) and one.crossed
        apart = subtract(_place(other), _place(one))
        distance = algebra.sqrt(dot(apart, apart))
        r, s = _radius(one), _radius(other)
        reach = r + s if crossed else r - s
        length = length + (
            distance
            if not isinstance(one, Pulley) and not isinstance(other, Pulley)
            else algebra.sqrt(distance**2 - reach**2)
        )
        along = scale(1 / distance, apart)
        ends = []
        for thing, ahead, beyond in ((one, along, reach), (other, scale(-1, along), s - r)):
            if not isinstance(thing, Pulley):
                ends.append(_place(thing))
                continue
            span = r + s if crossed else beyond
            n = thing.frame.direction(*thing.over)
            angle = algebra.acos(dot(n, ahead)) - algebra.acos(span / distance)
            length = length + thing.radius * angle
            ends.append(_tangent(algebra, thing, n, ahead, span / distance))
        corners += ends
    return length, corners


def _place(thing: Point | Pulley) -> Vector:
    return thing.center.position if isinstance(thing, Pulley) else thing.position


def _radius(thing: Point | Pulley) -> Any:
    return thing.radius if isinstance(thing, Pulley) else 0


def _tangent(algebra: Algebra, pulley: Pulley, n: Vector, ahead: Vector, cosine: Any) -> Vector:
    """Where the straight part touches the disc: on the side of `over`, for pictures."""
    across = subtract(n, scale(dot(n, ahead), ahead))
    size = algebra.sqrt(dot(across, across))
    side = scale(algebra.sqrt(1 - cosine**2) / size, across)
    return add(pulley.center.position, scale(pulley.radius, add(scale(cosine, ahead), side)))
