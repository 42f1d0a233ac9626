"""What a model looks like: places of points, and what they are the points of. For pictures only."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from signorini.codegen.frontend.errors import ModelError

# Kinds of things to draw and what their points are, in this order.
KINDS = {
    "line": "points in a row",
    "area": "corners around a polygon",
    "circle": "the centre, a point of the circle that does not turn",
    "round": "the centre, the ends of the semi-axes: a disc, ball or ellipse",
    "hull": "points of a convex body in any order",
    "dot": "one point: a particle",
    "pin": "one point: a joint",
    "spring": "both ends",
    "plane": "a point, the tip of the unit normal on the free side",
    "curve": "points in a row along an obstacle, the free side on the left",
    "net": "points of an obstacle's surface, row by row, as many rows as points in a row",
    "contact": "the place, the tip of the unit normal, the tips of unit vectors along the slip",
}


@dataclass
class Drawn:
    """One thing to draw.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    points : list of points
        Expressions of t, q and parameters; two or three each [m].
    name : str
        Of the body or contact.
    by_hand : bool
        Whether `Model.shape` was called for it.
    guessed : bool
        Whether it stands for a body that nothing else was drawn for.
    """

    kind: str
    points: list[tuple[Any, ...]]
    name: str = ""
    by_hand: bool = False
    guessed: bool = False


@dataclass
class Drawing:
    """All that a model wants to be drawn."""

    things: list[Drawn] = field(default_factory=list)

    def add(
        self, kind: str, points: list[tuple[Any, ...]], name: str = "", by_hand: bool = False
    ) -> Drawn:
        """Add a thing."""
        thing = Drawn(kind, points, name, by_hand)
        self.things.append(thing)
        return thing

    def add_shape(
        self,
        places: list[tuple[Any, ...]],
        closed: bool,
        radius: Any,
        convex: bool,
    ) -> None:
        """Add what `Model.shape` was called with."""
        if convex:
            self.add("hull", places, f"body {len(self.things)}", by_hand=True)
        elif radius is None:
            self.add("area" if closed else "line", places, by_hand=True)
        else:
            for x, *rest in places:
                self.add("circle", [(x, *rest), (x + radius, *rest)], by_hand=True)

    def wanted(self) -> list[Drawn]:
        """Bodies that nothing was drawn for are hulls of their points; by hand beats that."""
        by_hand = any(thing.by_hand and thing.kind != "plane" for thing in self.things)
        drawn = ("round", "area", "hull")
        known = {t.name for t in self.things if t.kind in drawn and not t.guessed}
        found = []
        for thing in self.things:
            if thing.guessed:
                if by_hand or thing.name in known:
                    continue
                kind = "dot" if len(thing.points) == 1 else "hull"
                found.append(Drawn(kind, thing.points, thing.name))
            else:
                found.append(thing)
        return found


def points_of(model: str, what: str, points: Any) -> list[tuple[Any, ...]]:
    """Points of a drawing, each with two or three components."""
    try:
        places = [tuple(point) for point in points]
    except TypeError:
        places = []
    if not places or any(len(place) not in (2, 3) for place in places):
        raise ModelError(
            model,
            what,
            f"its points are {points!r}",
            "Give points with two or three components each, e.g. [(x, y), (0, 0)]",
        )
    return places


def tip_of(model: str, what: str, place: tuple[Any, ...], normal: Sequence[Any]) -> tuple[Any, ...]:
    """Where a normal ends that starts at a place."""
    if len(normal) != len(place):
        raise ModelError(
            model,
            what,
            f"its normal has {len(normal)} components, its place {len(place)}",
            "Give both as many",
        )
    return tuple(a + b for a, b in zip(place, normal, strict=True))
