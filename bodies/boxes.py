"""Boxes with balls, capsules and each other.

Two boxes touch where corners of one lie on a face of the other, and where edges cross. The face is,
of each of them, the one along whose normal the boxes are furthest apart; an edge counts where it
crosses the border of that face.
"""

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from signorini.bodies.algebra import Algebra, Vector, add, cross, dot, scale, subtract
from signorini.bodies.capsules import end_on_capsule, sides
from signorini.bodies.frames import Point
from signorini.bodies.shapes import Box, Capsule, Round, Touch
from signorini.bodies.solid_parts import TIE, Found, clamped, inside, turned


def corners(box: Box) -> list[tuple[str, Point]]:
    """Corners of a box, numbered as those of its signs are counted in binary, x last."""
    at, frame = box.center.place, box.center.frame
    return [
        (
            str(n),
            frame.point(*(c + s * h for c, s, h in zip(at, signs, box.half_sizes, strict=True))),
        )
        for n, signs in enumerate(product((-1, 1), repeat=3))
    ]


def _edges(box: Box) -> list[tuple[str, Point, Point]]:
    """Edges of a box by the numbers of their ends."""
    ends = corners(box)
    return [
        (f"{a}{b}", ends[a][1], ends[b][1])
        for axis in (4, 2, 1)
        for a in range(8)
        for b in [a | axis]
        if not a & axis
    ]


def _sides(box: Box, edge: str) -> list[Vector]:
    """Outward normals of the two faces that meet in an edge, and its own direction."""
    axes = zip((4, 2, 1), zip(*box.center.frame.axes, strict=True), strict=True)
    return [scale(1 if int(edge[0]) & bit else -1, axis) for bit, axis in axes]


def in_frame(box: Box, position: Vector) -> Vector:
    return subtract(
        box.center.frame.components(subtract(position, box.center.frame.origin)), box.center.place
    )


def _largest(algebra: Algebra, values: list[Any]) -> Any:
    return algebra.maximum(values[0], algebra.maximum(values[1], values[2]))


def _selected(algebra: Algebra, values: list[Any]) -> Vector:
    """One for the largest of three values, the first of equal ones, and zeros."""
    a, b, c = values
    first = algebra.where_positive(a - algebra.maximum(b, c) + TIE, 1, 0)
    second = algebra.where_positive(b - c + TIE, 1, 0) * (1 - first)
    return first, second, 1 - first - second


def ball_box(algebra: Algebra, ball: Round, box: Box) -> Found:
    """The nearest point of the box; of a centre within it, that on the nearest face."""
    yield "", point_box(algebra, ball.center, ball.radius, box)


def point_box(algebra: Algebra, point: Point, radius: Any, box: Box) -> Touch:
    frame = box.center.frame
    c = in_frame(box, point.position)
    nearest = tuple(clamped(algebra, x, -h, h) for x, h in zip(c, box.half_sizes, strict=True))
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


def capsule_box(algebra: Algebra, capsule: Capsule, box: Box) -> Found:
    """Ends of the capsule on the box; corners and edges of the box at the capsule's side."""
    for word, end in (("start", capsule.start), ("end", capsule.end)):
        yield f"_{word}", point_box(algebra, end, capsule.radius, box)
    for word, corner in corners(box):
        found, share = end_on_capsule(algebra, corner, 0, capsule)
        yield f"_corner{word}", replace(turned(found), guard=inside(algebra, share))
    for word, a, b in _edges(box):
        yield f"_edge{word}", sides(algebra, capsule, Capsule(a, b, 0))


_SLANTED = 0.1  # sine by which a normal may lie beyond those of the faces at its edge


@dataclass(frozen=True, eq=False)
class _Face:
    """The face of a box that another one is furthest from, seen in axes of its own.

    The third axis is its outward normal; `axes` are the three in the fixed frame.
    """

    box: Box
    axes: tuple[Vector, Vector, Vector]
    half_sizes: Vector

    def place(self, position: Vector) -> Vector:
        """Components of a point, from the middle of the face."""
        apart = subtract(position, self.box.center.position)
        x, y, z = (dot(axis, apart) for axis in self.axes)
        return x, y, z - self.half_sizes[2]


def _facing(algebra: Algebra, box: Box, other: Box) -> _Face:
    frame = box.center.frame
    middle = in_frame(box, other.center.position)
    signs = [algebra.where_positive(x, 1, -1) for x in middle]
    apart = []
    for k, axis in enumerate(zip(*frame.axes, strict=True)):
        reach: Any = box.half_sizes[k]
        for half, edge in zip(
            other.half_sizes, zip(*other.center.frame.axes, strict=True), strict=True
        ):
            along = dot(axis, edge)
            reach = reach + half * algebra.maximum(along, -along)
        apart.append(signs[k] * middle[k] - reach)
    face = _selected(algebra, apart)
    axes = list(zip(*frame.axes, strict=True))
    across: list[Vector] = []
    sizes: list[Any] = []
    for shift in (1, 2, 0):
        # the axis that lies `shift` behind the normal's
        chosen = [face[(k - shift) % 3] * (signs[k] if shift == 0 else 1) for k in range(3)]
        across.append(
            tuple(sum(c * axis[i] for c, axis in zip(chosen, axes, strict=True)) for i in range(3))
        )
        sizes.append(sum(face[(k - shift) % 3] * box.half_sizes[k] for k in range(3)))
    return _Face(box, (across[0], across[1], across[2]), tuple(sizes))


def _corners_on_face(algebra: Algebra, box: Box, face: _Face) -> Found:
    ground = face.box.center.frame
    for word, corner in corners(box):
        x, y, gap = face.place(corner.position)
        within: Any = gap + face.half_sizes[2]
        for at, half in ((x, face.half_sizes[0]), (y, face.half_sizes[1])):
            within = algebra.minimum(within, half * (1 + TIE) - algebra.maximum(at, -at))
        velocity = subtract(corner.velocity, ground.velocity_at(corner.position))
        yield f"{word}", Touch(gap, face.axes[2], velocity, corner.position, within)


def _edges_on_face(algebra: Algebra, box: Box, face: _Face) -> Found:
    """Where edges of a box enter and leave the borders of a face: edge against edge."""
    ground = face.box.center.frame
    for word, a, b in _edges(box):
        p, q = face.place(a.position), face.place(b.position)
        way = subtract(q, p)
        length = algebra.sqrt(dot(way, way))
        shares, rising = [], []
        for k in (0, 1):
            up = algebra.where_positive(way[k], 1, -1)
            steep = algebra.maximum(up * way[k], TIE * length)
            # shares of the way where it crosses the borders on its near and on its far side
            shares.append([(s * face.half_sizes[k] - up * p[k]) / steep for s in (-1, 1)])
            rising.append((up, up * way[k] / length - TIE))
        enters = algebra.maximum(shares[0][0], shares[1][0])
        leaves = algebra.minimum(shares[0][1], shares[1][1])
        for name, t, s, by_first in (
            ("in", enters, -1, shares[0][0] - shares[1][0]),
            ("out", leaves, 1, shares[1][1] - shares[0][1]),
        ):
            first = algebra.where_positive(by_first, 1, 0)
            crossed = (first, 1 - first)
            up = crossed[0] * rising[0][0] + crossed[1] * rising[1][0]
            border = [c * s * up * h for c, h in zip(crossed, face.half_sizes[:2], strict=True)]
            along = (1 - first, first, 0)  # the border that is crossed
            across = cross(way, along)
            size = algebra.sqrt(algebra.maximum(dot(across, across), (TIE * length) ** 2))
            sign = algebra.where_positive(across[2], 1, -1)
            n = scale(sign / size, across)
            gap = n[0] * (p[0] - border[0]) + n[1] * (p[1] - border[1]) + n[2] * p[2]
            steep = crossed[0] * rising[0][1] + crossed[1] * rising[1][1]
            guard = algebra.minimum(algebra.minimum(inside(algebra, t), leaves - enters), steep)
            guard = algebra.minimum(guard, gap + face.half_sizes[2])
            normal = tuple(
                sum(c * axis[i] for c, axis in zip(n, face.axes, strict=True)) for i in range(3)
            )
            # edges hold each other apart if n lies between the normals of the faces at both; it is
            # perpendicular to their own directions
            outward = s * up * sum(c * x for c, x in zip(crossed, n[:2], strict=True))
            for between in (outward, *(-dot(side, normal) for side in _sides(box, word))):
                guard = algebra.minimum(guard, between + _SLANTED)
            along_edge = subtract(b.position, a.position)
            place = add(a.position, scale(clamped(algebra, t, 0, 1), along_edge))
            velocity = subtract(box.center.frame.velocity_at(place), ground.velocity_at(place))
            yield f"{word}_{name}", Touch(gap, normal, velocity, place, guard)


def boxes(algebra: Algebra, one: Box, other: Box) -> Found:
    """Corners of both on faces of the other, and edges of the first across the second's face."""
    faces = _facing(algebra, other, one), _facing(algebra, one, other)
    for word, found in _corners_on_face(algebra, one, faces[0]):
        yield f"_a{word}", found
    for word, found in _corners_on_face(algebra, other, faces[1]):
        yield f"_b{word}", turned(found)
    for word, found in _edges_on_face(algebra, one, faces[0]):
        yield f"_edge{word}", found
