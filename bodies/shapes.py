"""What touches: points, rounds and ellipsoids against planes, curves, surfaces and edges."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from signorini.bodies.algebra import Algebra, Vector, add, cross, dot, scale, subtract
from signorini.bodies.frames import Frame, Point


@dataclass(frozen=True, eq=False)
class Round:
    """A disc in the plane or a ball in space around a point."""

    center: Point
    radius: Any


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """An ellipsoid fixed to a frame, its axes along the frame's; a flat one is a coin."""

    frame: Frame
    semi_axes: Vector


@dataclass(frozen=True, eq=False)
class Capsule:
    """All that is within a radius of the line between two points of one frame."""

    start: Point
    end: Point
    radius: Any


@dataclass(frozen=True, eq=False)
class Box:
    """A box around a point, with edges along the axes of the frame that it is a point of."""

    center: Point
    half_sizes: Vector


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylinder around a point, its axis the z axis of the frame that it is a point of."""

    center: Point
    radius: Any
    half_length: Any


@dataclass(frozen=True, eq=False)
class Plane:
    """A half plane or half space: everything on the side of the normal is free.

    `belt` is the velocity of the surface relative to the frame that carries it [m/s].
    """

    point: Point
    normal: Vector
    belt: Vector


@dataclass(frozen=True, eq=False)
class Surface:
    """A smooth curve or surface phi(x, y[, z]) = 0 in components of a frame; phi > 0 is free.

    `height` is the function whose graph it is, if it is one; pictures show `shown` [m] of it on
    both sides of what touches it.
    """

    frame: Frame
    phi: Callable[..., Any]
    height: Callable[..., Any] | None = None
    shown: Any = 1


@dataclass(frozen=True, eq=False)
class Edge:
    """An edge between two points of one frame; going along it, the free side is on the left.

    In front of the edge a corner touches it between its ends. Behind it a corner still counts up to
    `depth` [m], and no nearer to an end than it is behind the edge: what lies nearer belongs to the
    face around the corner. `beyond` lengthens the edge at both ends [m].
    """

    start: Point
    end: Point
    depth: Any
    beyond: Any = 0


@dataclass(frozen=True, eq=False)
class Touch:
    """Gap, normal and relative velocity of a pair of things."""

    gap: Any
    normal: Vector
    velocity: Vector  # of the first thing's material relative to the second's
    place: Vector  # of that material
    guard: Any = None
    tangents: tuple[Vector, ...] | None = None  # of slip, where the shapes have some of their own


def frame_of(thing: Any) -> Frame:
    """The frame that a thing is fixed to."""
    if isinstance(thing, (Round, Box, Cylinder)):
        return thing.center.frame
    if isinstance(thing, Plane):
        return thing.point.frame
    if isinstance(thing, (Edge, Capsule)):
        return thing.start.frame
    frame: Frame = thing.frame
    return frame


def touch(algebra: Algebra, one: Any, other: Any) -> Touch | None:
    """Kinematics of a pair, or None if there is no rule for it."""
    if isinstance(other, Plane):
        return _with_plane(algebra, one, other)
    if isinstance(one, Round) and isinstance(other, Round):
        return _rounds(algebra, one, other)
    if isinstance(one, Point) and isinstance(other, Surface):
        return _with_surface(algebra, one, other)
    if isinstance(one, Point) and isinstance(other, Edge):
        return _with_edge(algebra, one, other)
    return None


def _with_plane(algebra: Algebra, one: Any, plane: Plane) -> Touch | None:
    n = plane.normal
    if isinstance(one, Point):
        frame, center, reach = one.frame, one.position, None
    elif isinstance(one, Round):
        frame, center = one.center.frame, one.center.position
        reach = scale(-one.radius, n)
    elif isinstance(one, Ellipsoid):
        # Support point of the ellipsoid in the direction -n.
        frame, center = one.frame, one.frame.origin
        nu = frame.components(n)
        stretched = tuple(a**2 * x for a, x in zip(one.semi_axes, nu, strict=True))
        height = algebra.sqrt(dot(nu, stretched))
        reach = scale(-1 / height, frame.direction(*stretched))
        material = add(frame.velocity_at(add(center, reach)), scale(-1, plane.belt))
        gap = dot(n, subtract(center, plane.point.position)) - height
        ground = plane.point.frame.velocity_at(add(center, reach))
        return Touch(gap, n, subtract(material, ground), add(center, reach))
    else:
        return None
    gap = dot(n, subtract(center, plane.point.position))
    if reach is None:
        place, velocity = center, one.velocity
    else:
        place = add(center, reach)
        # the radius is along the normal: no need of the place itself
        velocity = add(one.center.velocity, frame.turn(reach))
        gap = gap - one.radius
    surface = add(plane.point.frame.velocity_at(place), plane.belt)
    return Touch(gap, n, subtract(velocity, surface), place)


def _rounds(algebra: Algebra, one: Round, other: Round) -> Touch:
    apart = subtract(one.center.position, other.center.position)
    distance = algebra.sqrt(dot(apart, apart))
    n = scale(1 / distance, apart)
    material = add(one.center.velocity, one.center.frame.turn(scale(-one.radius, n)))
    ground = add(other.center.velocity, other.center.frame.turn(scale(other.radius, n)))
    place = add(one.center.position, scale(-one.radius, n))
    return Touch(distance - one.radius - other.radius, n, subtract(material, ground), place)


def _with_surface(algebra: Algebra, one: Point, surface: Surface) -> Touch:
    place = surface.frame.components(subtract(one.position, surface.frame.origin))
    value, gradient = algebra.value_and_gradient(surface.phi, place)
    size = algebra.sqrt(dot(gradient, gradient))
    n = surface.frame.direction(*scale(1 / size, gradient))
    velocity = subtract(one.velocity, surface.frame.velocity_at(one.position))
    return Touch(value / size, n, velocity, one.position)


def _with_edge(algebra: Algebra, one: Point, edge: Edge) -> Touch:
    frame = edge.start.frame
    along = subtract(edge.end.place, edge.start.place)
    length = algebra.sqrt(dot(along, along))
    t = frame.direction(*scale(1 / length, along))
    n = (-t[1], t[0])
    apart = subtract(one.position, edge.start.position)
    gap, place = dot(n, apart), dot(t, apart)
    inside = algebra.minimum(place, length - place)
    behind = algebra.minimum(gap, 0)
    guard = algebra.minimum(inside + edge.beyond + behind, gap + edge.depth)
    velocity = subtract(one.velocity, frame.velocity_at(one.position))
    return Touch(gap, n, velocity, one.position, guard)


def tangents(algebra: Algebra, normal: Vector) -> tuple[Vector, ...]:
    """One or two unit vectors perpendicular to a unit normal.

    In space they are those of a rotation from the z axis to the normal, which fails at the south
    pole; within about 25 degrees of it the rotation from the x axis takes over. Coulomb's law does
    not see the change of frame.
    """
    if len(normal) == 2:
        return ((normal[1], -normal[0]),)
    x, y, z = normal
    if all(isinstance(c, (int, float)) for c in normal):
        return _frame_from_z(x, y, z) if z > -0.9 else _frame_from_x(x, y, z)
    # The branch that is not taken must not divide by zero.
    safe = algebra.where_positive(z + 0.9, z, 1)
    aside = algebra.where_positive(z + 0.9, 0, x)
    first, second = _frame_from_z(x, y, safe), _frame_from_x(aside, y, z)
    return tuple(
        tuple(algebra.where_positive(z + 0.9, a, b) for a, b in zip(one, other, strict=True))
        for one, other in zip(first, second, strict=True)
    )


def _frame_from_z(x: Any, y: Any, z: Any) -> tuple[Vector, Vector]:
    k = 1 / (1 + z)
    return (1 - x * x * k, -x * y * k, -x), (-x * y * k, 1 - y * y * k, -y)


def _frame_from_x(x: Any, y: Any, z: Any) -> tuple[Vector, Vector]:
    k = 1 / (1 + x)
    return (-y, 1 - y * y * k, -y * z * k), (-z, -y * z * k, 1 - z * z * k)


def perpendicular(axis: Vector) -> tuple[Vector, Vector]:
    """Two vectors of numbers that form a right-handed frame with a unit axis of numbers."""
    x, y, z = axis
    if abs(z) >= max(abs(x), abs(y)):
        first: Vector = (1, 0, 0) if x == 0 else _unit((z, 0, -x))
    else:
        first = (0, 0, 1) if z == 0 else _unit((y, -x, 0))
    return first, cross(axis, first)


def _unit(a: Vector) -> Vector:
    return scale(1 / dot(a, a) ** 0.5, a)
