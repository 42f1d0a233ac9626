"""Solids in space: capsules with each other, balls with capsules, boxes, cylinders, all on planes.

A pair of solids has one contact or several, of fixed parts of both: ends and sides of capsules,
corners of a box. Each is a condition of its own, the distance of two parts, and exists in a step if
these parts face each other at its start.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any

from signorini.bodies.algebra import Algebra, Vector, add, cross, dot, scale, subtract
from signorini.bodies.frames import Frame, Point
from signorini.bodies.shapes import Box, Capsule, Cylinder, Ellipsoid, Plane, Round, Touch, touch

_TIE = 1e-9  # of a length or a squared sine: what is nearer counts as equal

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
        return [(word, _turned(found)) for word, found in rule(algebra, other, one)]
    found = touch(algebra, one, other)
    return None if found is None else [("", found)]


def has_rule(one: Any, other: Any) -> bool:
    """Whether two solids can touch each other."""
    kinds = type(one), type(other)
    return kinds == (Round, Round) or kinds in _RULES or kinds[::-1] in _RULES


def _turned(found: Touch) -> Touch:
    """The same contact with the solids in the other order."""
    n, velocity = scale(-1, found.normal), scale(-1, found.velocity)
    return replace(found, normal=n, velocity=velocity)


# --- parts ----------------------------------------------------------------------------------------

_Found = Iterator[tuple[str, Touch]]


def _clamped(algebra: Algebra, x: Any, low: Any, high: Any) -> Any:
    return algebra.minimum(algebra.maximum(x, low), high)


def _inside(algebra: Algebra, *shares: Any) -> Any:
    """Positive if all shares lie between 0 and 1, and not at their ends."""
    value: Any = 1
    for t in shares:
        value = algebra.minimum(value, algebra.minimum(t, 1 - t))
    return value - _TIE


def _corners(box: Box) -> list[tuple[str, Point]]:
    """Corners of a box, numbered as those of its signs are counted in binary, x last."""
    at, frame = box.center.place, box.center.frame
    return [
        (
            str(n),
            frame.point(*(c + s * h for c, s, h in zip(at, signs, box.half_sizes, strict=True))),
        )
        for n, signs in enumerate(product((-1, 1), repeat=3))
    ]


def _in_frame(box: Box, position: Vector) -> Vector:
    return subtract(
        box.center.frame.components(subtract(position, box.center.frame.origin)), box.center.place
    )


# --- balls, capsules, cylinders -------------------------------------------------------------------


def _with_plane(algebra: Algebra, one: Any, plane: Plane) -> _Found:
    if isinstance(one, Capsule):
        parts: list[tuple[str, Any]] = [
            ("_start", Round(one.start, one.radius)),
            ("_end", Round(one.end, one.radius)),
        ]
    elif isinstance(one, Box):
        parts = [(f"_{word}", corner) for word, corner in _corners(one)]
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


def _ball_capsule(algebra: Algebra, ball: Round, capsule: Capsule) -> _Found:
    yield "", _end_on_capsule(algebra, ball.center, ball.radius, capsule)[0]


def _end_on_capsule(
    algebra: Algebra, center: Point, radius: Any, capsule: Capsule
) -> tuple[Touch, Any]:
    """A ball on a capsule, and the share of its axis where the ball's foot is."""
    start, direction, length = _axis(algebra, capsule)
    foot = dot(direction, subtract(center.position, start))
    nearest = add(start, scale(_clamped(algebra, foot, 0, length), direction))
    apart = subtract(center.position, nearest)
    distance = algebra.sqrt(dot(apart, apart))
    n = scale(1 / distance, apart)
    place = add(nearest, scale(capsule.radius, n))
    velocity = subtract(center.frame.velocity_at(place), capsule.start.frame.velocity_at(place))
    return Touch(distance - radius - capsule.radius, n, velocity, place), foot / length


def _capsules(algebra: Algebra, one: Capsule, other: Capsule) -> _Found:
    for word, end in (("start", one.start), ("end", one.end)):
        yield f"_a_{word}", _end_on_capsule(algebra, end, one.radius, other)[0]
    for word, end in (("start", other.start), ("end", other.end)):
        found, share = _end_on_capsule(algebra, end, other.radius, one)
        # ends with ends are those of the first capsule
        yield f"_b_{word}", replace(_turned(found), guard=_inside(algebra, share))
    yield "_sides", _sides(algebra, one, other)


def _sides(algebra: Algebra, one: Capsule, other: Capsule) -> Touch:
    """Two capsules across each other: along the common perpendicular of their axes."""
    (p, u, long), (q, w, wide) = (_axis(algebra, capsule) for capsule in (one, other))
    apart, across = subtract(p, q), cross(u, w)
    slanted = dot(across, across)
    slant = slanted - _TIE  # not positive where they are parallel
    square = algebra.where_positive(slant, slanted, 1)
    sine = algebra.sqrt(square)
    cosine, along, beside = dot(u, w), dot(u, apart), dot(w, apart)
    s, t = (cosine * beside - along) / square, (beside - cosine * along) / square
    height = dot(across, apart) / sine
    up = algebra.where_positive(height, 1, -1)
    n = scale(up / sine, across)
    place = add(add(q, scale(t, w)), scale(other.radius, n))
    velocity = subtract(one.start.frame.velocity_at(place), other.start.frame.velocity_at(place))
    guard = algebra.minimum(_inside(algebra, s / long, t / wide), slant)
    gap = up * height - one.radius - other.radius
    return Touch(gap, n, velocity, place, guard, (u, cross(n, u)))


def _axis(algebra: Algebra, capsule: Capsule) -> tuple[Vector, Vector, Any]:
    """Start, direction of length one and length of a capsule's axis."""
    way = subtract(capsule.end.place, capsule.start.place)
    length = algebra.sqrt(dot(way, way))
    direction = capsule.start.frame.direction(*(x / length for x in way))
    return capsule.start.position, direction, length


def _largest(algebra: Algebra, values: list[Any]) -> Any:
    return algebra.maximum(values[0], algebra.maximum(values[1], values[2]))


def _selected(algebra: Algebra, values: list[Any]) -> Vector:
    """One for the largest of three values, the first of equal ones, and zeros."""
    a, b, c = values
    first = algebra.where_positive(a - algebra.maximum(b, c) + _TIE, 1, 0)
    second = algebra.where_positive(b - c + _TIE, 1, 0) * (1 - first)
    return first, second, 1 - first - second


def _ball_box(algebra: Algebra, ball: Round, box: Box) -> _Found:
    """The nearest point of the box; of a centre within it, that on the nearest face."""
    yield "", _point_box(algebra, ball.center, ball.radius, box)


def _point_box(algebra: Algebra, point: Point, radius: Any, box: Box) -> Touch:
    frame = box.center.frame
    c = _in_frame(box, point.position)
    nearest = tuple(_clamped(algebra, x, -h, h) for x, h in zip(c, box.half_sizes, strict=True))
    apart = subtract(c, nearest)
    square = dot(apart, apart)
    signs = [algebra.where_positive(x, 1, -1) for x in c]
    depths = [s * x - h for s, x, h in zip(signs, c, box.half_sizes, strict=True)]
    face, below = _selected(algebra, depths), _largest(algebra, depths)
    outside = algebra.sqrt(algebra.where_positive(square, square, 1))
    distance = algebra.where_positive(square, outside, below)
    n = frame.direction(
        *(
            algebra.where_positive(square, x / outside, chosen * s)
            for x, chosen, s in zip(apart, face, signs, strict=True)
        )
    )
    place = subtract(point.position, scale(distance, n))
    velocity = subtract(point.frame.velocity_at(place), frame.velocity_at(place))
    return Touch(distance - radius, n, velocity, place)


def _ball_cylinder(algebra: Algebra, ball: Round, cylinder: Cylinder) -> _Found:
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
    (Round, Capsule): _ball_capsule,
    (Round, Box): _ball_box,
    (Round, Cylinder): _ball_cylinder,
    (Capsule, Capsule): _capsules,
}
