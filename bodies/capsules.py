"""Capsules with balls and with each other."""

from dataclasses import replace
from typing import Any

from signorini.bodies.algebra import Algebra, Vector, add, cross, dot, scale, subtract
from signorini.bodies.frames import Point
from signorini.bodies.shapes import Capsule, Round, Touch
from signorini.bodies.solid_parts import TIE, Found, clamped, inside, turned


def ball_capsule(algebra: Algebra, ball: Round, capsule: Capsule) -> Found:
    yield "", end_on_capsule(algebra, ball.center, ball.radius, capsule)[0]


def end_on_capsule(
    algebra: Algebra, center: Point, radius: Any, capsule: Capsule
) -> tuple[Touch, Any]:
    """A ball on a capsule, and the share of its axis where the ball's foot is."""
    start, direction, length = _axis(algebra, capsule)
    foot = dot(direction, subtract(center.position, start))
    nearest = add(start, scale(clamped(algebra, foot, 0, length), direction))
    apart = subtract(center.position, nearest)
    distance = algebra.sqrt(dot(apart, apart))
    n = scale(1 / distance, apart)
    place = add(nearest, scale(capsule.radius, n))
    velocity = subtract(center.frame.velocity_at(place), capsule.start.frame.velocity_at(place))
    return Touch(distance - radius - capsule.radius, n, velocity, place), foot / length


def capsules(algebra: Algebra, one: Capsule, other: Capsule) -> Found:
    for word, end in (("start", one.start), ("end", one.end)):
        yield f"_a_{word}", end_on_capsule(algebra, end, one.radius, other)[0]
    for word, end in (("start", other.start), ("end", other.end)):
        found, share = end_on_capsule(algebra, end, other.radius, one)
        # ends with ends are those of the first capsule
        yield f"_b_{word}", replace(turned(found), guard=inside(algebra, share))
    yield "_sides", sides(algebra, one, other)


def sides(algebra: Algebra, one: Capsule, other: Capsule) -> Touch:
    """Two capsules across each other: along the common perpendicular of their axes."""
    (p, u, long), (q, w, wide) = (_axis(algebra, capsule) for capsule in (one, other))
    apart, across = subtract(p, q), cross(u, w)
    slanted = dot(across, across)
    slant = slanted - TIE  # not positive where they are parallel
    square = algebra.where_positive(slant, slanted, 1)
    sine = algebra.sqrt(square)
    cosine, along, beside = dot(u, w), dot(u, apart), dot(w, apart)
    s, t = (cosine * beside - along) / square, (beside - cosine * along) / square
    height = dot(across, apart) / sine
    up = algebra.where_positive(height, 1, -1)
    n = scale(up / sine, across)
    place = add(add(q, scale(t, w)), scale(other.radius, n))
    velocity = subtract(one.start.frame.velocity_at(place), other.start.frame.velocity_at(place))
    guard = algebra.minimum(inside(algebra, s / long, t / wide), slant)
    gap = up * height - one.radius - other.radius
    return Touch(gap, n, velocity, place, guard, (u, cross(n, u)))


def _axis(algebra: Algebra, capsule: Capsule) -> tuple[Vector, Vector, Any]:
    """Start, direction of length one and length of a capsule's axis."""
    way = subtract(capsule.end.place, capsule.start.place)
    length = algebra.sqrt(dot(way, way))
    direction = capsule.start.frame.direction(*(x / length for x in way))
    return capsule.start.position, direction, length
