"""Frames: what is rigid. Points and directions fixed to them, with positions and velocities."""

from dataclasses import dataclass
from typing import Any

from signorini.bodies.algebra import (
    Algebra,
    Matrix,
    Vector,
    add,
    apply,
    cross,
    dot,
    multiply,
    scale,
    subtract,
)


@dataclass(frozen=True, eq=False)
class Frame:
    """An origin and axes that move together, in the plane or in space.

    Attributes
    ----------
    name : str
        For messages.
    origin, velocity : tuple of 2 or 3 expressions
        Position of the origin and its velocity in the fixed frame [m, m/s].
    axes : tuple of rows
        Matrix whose columns are the frame's axes in the fixed frame.
    spin : tuple of 1 or 3 expressions
        Angular velocity in the fixed frame [rad/s].
    """

    name: str
    algebra: Algebra
    origin: Vector
    velocity: Vector
    axes: Matrix
    spin: Vector

    @property
    def dimension(self) -> int:
        """2 in the plane, 3 in space."""
        return len(self.origin)

    def point(self, *place: Any) -> "Point":
        """The point with the given components in this frame; the origin if none are given."""
        if not place:
            return Point(self, (0,) * self.dimension, self.origin, self.velocity)
        arm = self.direction(*place)
        return Point(self, place, add(self.origin, arm), add(self.velocity, self.turn(arm)))

    def direction(self, *components: Any) -> Vector:
        """A vector with components in this frame, in components of the fixed frame."""
        if len(components) != self.dimension:
            raise ValueError(
                f"frame '{self.name}': {len(components)} components given for a frame of "
                f"dimension {self.dimension}. Give {self.dimension}."
            )
        return apply(self.axes, components)

    def velocity_at(self, position: Vector) -> Vector:
        """Velocity of the frame's material at a position of the fixed frame."""
        return add(self.velocity, self.turn(subtract(position, self.origin)))

    def turn(self, vector: Vector) -> Vector:
        """Rate of a vector fixed to the frame: angular velocity times vector."""
        if self.dimension == 2:
            (omega,) = self.spin
            return (-omega * vector[1], omega * vector[0])
        return cross(self.spin, vector)

    def components(self, vector: Vector) -> Vector:
        """Components in this frame of a vector given in the fixed frame."""
        return tuple(dot(axis, vector) for axis in zip(*self.axes, strict=True))


@dataclass(frozen=True, eq=False)
class Point:
    """A point fixed to a frame: its place there, position and velocity in the fixed frame."""

    frame: Frame
    place: Vector
    position: Vector
    velocity: Vector


def turned_in_plane(
    name: str, parent: Frame, angle: Any, rate: Any, at: tuple[Any, ...], slide: tuple[Any, ...]
) -> Frame:
    """Frame turned against `parent` by `angle`, its origin at `at` moving with `slide` there."""
    algebra = parent.algebra
    c, s = algebra.cos(angle), algebra.sin(angle)
    place = parent.point(*at)
    return Frame(
        name,
        algebra,
        place.position,
        add(place.velocity, parent.direction(*slide)),
        multiply(parent.axes, ((c, -s), (s, c))),
        (parent.spin[0] + rate,),
    )


def turned_in_space(
    name: str,
    parent: Frame,
    axis: tuple[Any, ...],
    angle: Any,
    rate: Any,
    at: tuple[Any, ...],
    slide: tuple[Any, ...],
) -> Frame:
    """The same about a unit axis of the parent."""
    algebra = parent.algebra
    place = parent.point(*at)
    return Frame(
        name,
        algebra,
        place.position,
        add(place.velocity, parent.direction(*slide)),
        multiply(parent.axes, rotation(algebra, axis, angle)),
        add(parent.spin, scale(rate, parent.direction(*axis))),
    )


def rotation(algebra: Algebra, axis: tuple[Any, ...], angle: Any) -> Matrix:
    """Rotation matrix about a unit axis (Rodrigues)."""
    c, s = algebra.cos(angle), algebra.sin(angle)
    x, y, z = axis
    skew = ((0, -z, y), (z, 0, -x), (-y, x, 0))
    return tuple(
        tuple(axis[i] * axis[j] * (1 - c) + (c if i == j else 0) + s * skew[i][j] for j in range(3))
        for i in range(3)
    )
