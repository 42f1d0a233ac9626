"""What a scene looks like: bodies, obstacles, springs and contacts tell the model's drawing."""

from itertools import product
from math import cos, pi, sin
from typing import Any

from signorini.bodies.algebra import Vector, add, dot, scale, subtract
from signorini.bodies.frames import Frame, Point
from signorini.bodies.shapes import (
    Box,
    Capsule,
    Cylinder,
    Edge,
    Ellipsoid,
    Plane,
    Round,
    Surface,
    perpendicular,
)
from signorini.codegen.frontend.drawing import Drawing, Drawn
from signorini.codegen.frontend.symbols import is_number

_SAMPLES = 40  # intervals of a curve
_MESHES = 10  # intervals of a surface along both sides
_RIM = 8  # points on the rim of a cylinder


class Looks:
    """Draws what a scene is told of.

    Parameters
    ----------
    drawing : Drawing
        Of the model.
    """

    def __init__(self, drawing: Drawing) -> None:
        self._drawing = drawing
        self._hulls: dict[int, Drawn] = {}
        self._seen: set[tuple[Any, ...]] = set()

    def body(self, frame: Frame) -> None:
        """A body is the hull of its points, unless something better is known."""
        guess = self._drawing.add("hull", [frame.origin], frame.name)
        guess.guessed = True
        self._hulls[id(frame)] = guess
        self._first("hull", frame, frame.point().place)

    def dot(self, name: str, at: Point) -> None:
        """A point mass."""
        self._drawing.add("dot", [at.position], name)

    def spring(self, one: Point, other: Point) -> None:
        """A spring between two points."""
        self._on_bodies(one, other)
        self._drawing.add("spring", [one.position, other.position])

    def line(self, one: Point, other: Point) -> None:
        """A cylinder, an actuator, a rope between two points."""
        self._on_bodies(one, other)
        self._drawing.add("line", [one.position, other.position])

    def joint(self, one: Point, other: Point) -> None:
        """A joint of two points."""
        self._on_bodies(one, other)
        self._drawing.add("pin", [one.position])

    def polygon(self, corners: Any) -> None:
        """A polygon fixed to a frame."""
        frame = corners[0].frame
        if self._first("area", frame, *(c.place for c in corners)):
            self._drawing.add("area", [c.position for c in corners], frame.name)

    def contact(self, name: str, place: Vector, normal: Vector, directions: Any) -> None:
        """Where a contact is, its normal and the directions of its slip."""
        tips = [add(place, arm) for arm in (normal, *directions)]
        self._drawing.add("contact", [place, *tips], name)

    def touching(self, one: Any, other: Any) -> None:
        """Both things of a contact."""
        for thing in (one, other):
            if isinstance(thing, Point):
                self._on_bodies(thing)
            elif isinstance(thing, Round):
                self._round(thing.center, (thing.radius,) * len(thing.center.position))
            elif isinstance(thing, Ellipsoid):
                self._round(thing.frame.point(), thing.semi_axes)
            elif isinstance(thing, (Box, Capsule, Cylinder)):
                self._solid(thing)
            elif isinstance(thing, Plane):
                at = thing.point.position
                if self._first("plane", thing.point.frame, thing.point.place, thing.normal):
                    self._drawing.add("plane", [at, add(at, thing.normal)], thing.point.frame.name)
            elif isinstance(thing, Edge):
                ends = [thing.start.position, thing.end.position]
                if self._first("edge", thing.start.frame, thing.start.place, thing.end.place):
                    self._drawing.add("line", ends, thing.start.frame.name)
        if isinstance(one, Point) and isinstance(other, Surface):
            self._graph(one, other)

    def _round(self, center: Point, semi_axes: Vector) -> None:
        frame = center.frame
        if self._first("round", frame, center.place, semi_axes):
            axes = zip(semi_axes, zip(*frame.axes, strict=True), strict=True)
            ends = [add(center.position, scale(size, axis)) for size, axis in axes]
            self._drawing.add("round", [center.position, *ends], frame.name)

    def solid(self, thing: Any) -> None:
        """A solid that belongs to a body, whether it touches anything or not."""
        if isinstance(thing, Round):
            self._round(thing.center, (thing.radius,) * 3)
        elif isinstance(thing, Ellipsoid):
            self._round(thing.frame.point(), thing.semi_axes)
        else:
            self._solid(thing)

    def _solid(self, thing: Box | Capsule | Cylinder) -> None:
        """The hull of its corners, or of points on its rims; a capsule has balls at its ends."""
        if isinstance(thing, Box):
            sides = product(*((-h, h) for h in thing.half_sizes))
            frame, at = thing.center.frame, thing.center.place
            points = [frame.point(*add(at, side)).position for side in sides]
            about: tuple[Any, ...] = (at, thing.half_sizes)
        else:
            if isinstance(thing, Capsule):
                frame = thing.start.frame
                ends = [thing.start.place, thing.end.place]
                for end in (thing.start, thing.end):
                    self._round(end, (thing.radius,) * 3)
                axis = subtract(ends[1], ends[0])
                if not all(is_number(x) for x in axis):
                    self.line(thing.start, thing.end)
                    return
                across = perpendicular(scale(dot(axis, axis) ** -0.5, axis))
            else:
                frame, (x, y, z) = thing.center.frame, thing.center.place
                ends = [(x, y, z - thing.half_length), (x, y, z + thing.half_length)]
                across = (1, 0, 0), (0, 1, 0)
            angles = [2 * pi * k / _RIM for k in range(_RIM)]
            arms = [add(scale(cos(a), across[0]), scale(sin(a), across[1])) for a in angles]
            points = [
                frame.point(*add(end, scale(thing.radius, arm))).position
                for end in ends
                for arm in arms
            ]
            about = (ends, thing.radius)
        if self._first("solid", frame, *about):
            self._drawing.add("hull", points, frame.name)

    def _graph(self, point: Point, surface: Surface) -> None:
        """The graph of a function around a point: a curve, in space a net."""
        if surface.height is None:
            return
        frame = surface.frame
        *below, _height = frame.components(add(point.position, scale(-1, frame.origin)))
        count = _SAMPLES if frame.dimension == 2 else _MESHES
        sides = [[x + surface.shown * (2 * k / count - 1) for k in range(count + 1)] for x in below]
        points = [frame.point(*xy, surface.height(*xy)).position for xy in product(*sides)]
        self._drawing.add("curve" if frame.dimension == 2 else "net", points, frame.name)

    def _on_bodies(self, *points: Point) -> None:
        for point in points:
            hull = self._hulls.get(id(point.frame))
            if hull is not None and self._first("hull", point.frame, point.place):
                hull.points.append(point.position)

    def _first(self, kind: str, frame: Frame, *places: Any) -> bool:
        """Whether a thing at some places of a frame is met for the first time."""
        key = (kind, id(frame), str(places))
        known = key in self._seen
        self._seen.add(key)
        return not known
