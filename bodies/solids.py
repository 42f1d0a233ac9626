"""Solids in space: balls, capsules, boxes with each other, balls with cylinders, all on planes.

A pair of solids has one contact or several, of fixed parts of both: ends and sides of capsules,
corners and edges of a box. Each is a condition of its own, the distance of two parts, and exists in
a step if these parts face each other at its start.
"""

from typing import Any

from signorini.bodies.algebra import Algebra, Vector, scale, subtract
from signorini.bodies.boxes import ball_box, boxes, capsule_box, corners
from signorini.bodies.capsules import ball_capsule, capsules
from signorini.bodies.frames import Frame
from signorini.bodies.shapes import Box, Capsule, Cylinder, Ellipsoid, Plane, Round, Touch, touch
from signorini.bodies.solid_parts import Found, turned

Solid = Round | Ellipsoid | Capsule | Box | Cylinder


def sizes_of(thing: Any) -> Vector:
    """Radii and lengths that must be positive."""
    if isinstance(thing, Ellipsoid):
        return thing.semi_axes
    if isinstance(thing, Box):
        return thing.half_sizes
    if isinstance(thing, Cylinder):
        return thing.radius, thing.half_length
    return (thing.radius,) if isinstance(thing, (Round, Capsule)) else ()


def contacts_of(algebra: Algebra, one: Any, other: Any) -> list[tuple[str, Touch]] | None:
    """The contacts of a pair with the endings of their names, or None if there is no rule."""
    rule = _RULES.get((type(one), type(other)))
    if rule is not None:
        return list(rule(algebra, one, other))
    rule = _RULES.get((type(other), type(one)))
    if rule is not None:
        return [(word, turned(found)) for word, found in rule(algebra, other, one)]
    found = touch(algebra, one, other)
    return None if found is None else [("", found)]


def has_rule(one: Any, other: Any) -> bool:
    """Whether two solids can touch each other."""
    kinds = type(one), type(other)
    return kinds == (Round, Round) or kinds in _RULES or kinds[::-1] in _RULES


# --- planes and cylinders -------------------------------------------------------------------------


def _with_plane(algebra: Algebra, one: Any, plane: Plane) -> Found:
    if isinstance(one, Capsule):
        parts: list[tuple[str, Any]] = [
            ("_start", Round(one.start, one.radius)),
            ("_end", Round(one.end, one.radius)),
        ]
    elif isinstance(one, Box):
        parts = [(f"_{word}", corner) for word, corner in corners(one)]
    else:
        frame, (x, y, z) = one.center.frame, one.center.place
        parts = []
        for word, sign in (("_top", 1), ("_bottom", -1)):
            middle = frame.point(x, y, z + sign * one.half_length)
            rim = Frame(
                *(frame.name, algebra, middle.position, middle.velocity, frame.axes, frame.spin)
            )
            parts.append((word, Ellipsoid(rim, (one.radius, one.radius, 0))))
    for word, part in parts:
        found = touch(algebra, part, plane)
        assert found is not None
        yield word, found


def _ball_cylinder(algebra: Algebra, ball: Round, cylinder: Cylinder) -> Found:
    """The nearest point of the cylinder; of a centre within it, that on side or end."""
    frame, (x0, y0, z0) = cylinder.center.frame, cylinder.center.place
    c = frame.components(subtract(ball.center.position, frame.origin))
    x, y, z = c[0] - x0, c[1] - y0, c[2] - z0
    square = x * x + y * y
    around = algebra.sqrt(algebra.where_positive(square, square, 1))
    rho = algebra.where_positive(square, around, 0)
    side, end = rho - cylinder.radius, algebra.where_positive(z, z, -z) - cylinder.half_length
    up = algebra.where_positive(z, 1, -1)
    over, beyond = algebra.maximum(side, 0), algebra.maximum(end, 0)
    apart = over * over + beyond * beyond
    outside = algebra.sqrt(algebra.where_positive(apart, apart, 1))
    nearer = algebra.where_positive(side - end, 1, 0)  # within: the side is nearer
    distance = algebra.where_positive(apart, outside, algebra.maximum(side, end))
    radial = algebra.where_positive(apart, over / outside, nearer)
    axial = algebra.where_positive(apart, beyond / outside, 1 - nearer) * up
    n = frame.direction(radial * x / around, radial * y / around, axial)
    place = subtract(ball.center.position, scale(distance, n))
    velocity = subtract(ball.center.frame.velocity_at(place), frame.velocity_at(place))
    yield "", Touch(distance - ball.radius, n, velocity, place)


_RULES: dict[tuple[type, type], Any] = {
    (Capsule, Plane): _with_plane,
    (Box, Plane): _with_plane,
    (Cylinder, Plane): _with_plane,
    (Round, Capsule): ball_capsule,
    (Round, Box): ball_box,
    (Round, Cylinder): _ball_cylinder,
    (Capsule, Capsule): capsules,
    (Capsule, Box): capsule_box,
    (Box, Box): boxes,
}
