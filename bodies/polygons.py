"""Contact between polygons: which corner meets which edge, decided pair by pair of convex pieces.

At the start of every step each pair of pieces has one axis: the normal of the real edge, of either
piece, along which they are furthest apart, or overlap least. That edge is the reference; the edge
of the other piece that faces it is the incident one. A corner exists as a contact with an edge if
it projects onto the edge and one of the two holds the reference: corners of the other piece with
the reference edge, ends of the reference edge with the incident edge. So two faces that lie on
each other touch at two points, whatever their widths are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from signorini.bodies.algebra import Algebra, Vector, dot, number, subtract
from signorini.bodies.frames import Point
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import Model

_TIE = 1e-9  # of the size of a polygon: axes and projections closer than this count as equal


@dataclass(frozen=True, eq=False)
class Outline:
    """A polygon with its corners counterclockwise, and its convex pieces as corner numbers."""

    corners: tuple[Point, ...]
    numbers: tuple[int, ...]  # of the corners as the user gave them
    pieces: tuple[tuple[int, ...], ...]
    size: float

    def edge_number(self, k: int) -> int:
        """Number of the edge behind corner k: edge j joins the user's corners j and j + 1."""
        a, b = self.numbers[k], self.numbers[(k + 1) % len(self.numbers)]
        return min(a, b) if abs(a - b) == 1 else max(a, b)

    def is_real(self, a: int, b: int) -> bool:
        """Whether the way from corner a to corner b is an edge of the polygon, not a cut."""
        return b == (a + 1) % len(self.corners)


def outline(model: Model, what: str, corners: Sequence[Any]) -> Outline:
    """Read the corners of a polygon, in either order, and cut it into convex pieces.

    Raises
    ------
    ModelError
        If the corners are no simple polygon fixed in one frame.
    """
    points = list(corners)
    if len(points) < 3 or not all(isinstance(p, Point) for p in points):
        raise ModelError(
            model.name, what, f"{len(points)} corners were given", "Give three or more points"
        )
    if any(p.frame is not points[0].frame for p in points):
        raise ModelError(
            model.name, what, "its corners belong to several frames", "Give points of one frame"
        )
    places = [tuple(number(model, what, x) for x in p.place) for p in points]
    order = list(range(len(points)))
    area = _area(places)
    size = max(abs(x - y) for a in places for b in places for x, y in zip(a, b, strict=True))
    if not abs(area) > 1e-12 * size**2 or _crosses(places):
        raise ModelError(
            model.name,
            what,
            "its corners enclose no area, or its edges cross",
            "Give the corners one after the other around the polygon",
        )
    if area < 0:
        order.reverse()
        places.reverse()
    return Outline(
        tuple(points[k] for k in order), tuple(order), tuple(_convex_pieces(places)), size
    )


# --- geometry in numbers ----------------------------------------------------------------------

_Place = tuple[float, ...]


def _turn(a: _Place, b: _Place, c: _Place) -> float:
    """Twice the signed area of a triangle: positive counterclockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _area(places: Sequence[_Place]) -> float:
    pairs = zip(places, [*places[1:], places[0]], strict=True)
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in pairs) / 2


def _crosses(places: Sequence[_Place]) -> bool:
    n = len(places)
    for i in range(n):
        for j in range(i + 2, n):
            if (j + 1) % n == i:
                continue
            a, b, c, d = places[i], places[i + 1], places[j], places[(j + 1) % n]
            if _turn(a, b, c) * _turn(a, b, d) < 0 and _turn(c, d, a) * _turn(c, d, b) < 0:
                return True
    return False


def _convex_pieces(places: Sequence[_Place]) -> list[tuple[int, ...]]:
    """Triangles by cutting ears, joined again over cuts that no convex piece needs."""
    pieces = _ears(places)
    joined = True
    while joined:
        joined = False
        for i, one in enumerate(pieces):
            for j in range(i + 1, len(pieces)):
                whole = _join(places, one, pieces[j])
                if whole is not None:
                    pieces[i] = whole
                    del pieces[j]
                    joined = True
                    break
            if joined:
                break
    return pieces


def _ears(places: Sequence[_Place]) -> list[tuple[int, ...]]:
    left = list(range(len(places)))
    triangles: list[tuple[int, ...]] = []
    while len(left) > 3:
        best = None
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            size = _turn(places[a], places[b], places[c])
            inside = any(
                min(
                    _turn(places[a], places[b], places[p]),
                    _turn(places[b], places[c], places[p]),
                    _turn(places[c], places[a], places[p]),
                )
                >= 0
                for p in left
                if p not in (a, b, c)
            )
            if size > 0 and not inside and (best is None or size > best[0]):
                best = (size, k)
        if best is None:  # three corners in a row: the middle one bounds no area
            best = (0.0, min(range(len(left)), key=lambda k: abs(_at(places, left, k))))
        k = best[1]
        if best[0] > 0:
            triangles.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[k]
    triangles.append((left[0], left[1], left[2]))
    return triangles


def _at(places: Sequence[_Place], left: list[int], k: int) -> float:
    return _turn(places[left[k - 1]], places[left[k]], places[left[(k + 1) % len(left)]])


def _join(
    places: Sequence[_Place], one: tuple[int, ...], other: tuple[int, ...]
) -> tuple[int, ...] | None:
    """Two pieces with a common cut as one, if that is convex."""
    n, m = len(one), len(other)
    for i in range(n):
        a, b = one[i], one[(i + 1) % n]
        if b in other and other[(other.index(b) + 1) % m] == a:
            k = other.index(a)
            between = [other[(k + 1 + r) % m] for r in range(m - 2)]
            whole = [*one[: i + 1], *between, *one[i + 1 :]]
            turns = [
                _turn(places[whole[r - 1]], places[whole[r]], places[whole[(r + 1) % len(whole)]])
                for r in range(len(whole))
            ]
            if min(turns) >= -1e-12 * max(turns):
                return tuple(whole)
    return None


# --- kinematics -------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Edge:
    """A real edge of a polygon with its outward normal, in the fixed frame."""

    start: Point
    end: Point
    tangent: Vector
    normal: Vector
    length: Any


def _edges(algebra: Algebra, shape: Outline) -> dict[int, _Edge]:
    edges = {}
    for k, start in enumerate(shape.corners):
        end = shape.corners[(k + 1) % len(shape.corners)]
        along = subtract(end.place, start.place)
        length = algebra.sqrt(dot(along, along))
        t = start.frame.direction(*(x / length for x in along))
        edges[k] = _Edge(start, end, t, (t[1], -t[0]), length)
    return edges


@dataclass(frozen=True, eq=False)
class Pair:
    """A corner that may meet an edge: numbers as the user gave them, kinematics, guard."""

    corner: int
    edge: int
    gap: Any
    normal: Vector
    velocity: Vector
    place: Vector
    guard: Any


def pairs(algebra: Algebra, one: Outline, other: Outline) -> tuple[list[Pair], list[Pair]]:
    """Corners of `one` with edges of `other`, and the other way round."""
    tie = _TIE * max(one.size, other.size)
    shapes = (one, other)
    edges = tuple(_edges(algebra, shape) for shape in shapes)
    gaps: tuple[dict[tuple[int, int], Any], ...] = tuple(
        {
            (i, j): dot(edge.normal, subtract(corner.position, edge.start.position))
            for i, corner in enumerate(shapes[side].corners)
            for j, edge in edges[1 - side].items()
        }
        for side in (0, 1)
    )
    reasons: tuple[dict[tuple[int, int], list[Any]], ...] = ({}, {})
    for P in one.pieces:
        for Q in other.pieces:
            _look_at_pieces(algebra, shapes, (P, Q), edges, gaps, tie, reasons)
    found: list[list[Pair]] = []
    for side in (0, 1):
        own, facing = shapes[side], shapes[1 - side]
        rows = []
        for (i, j), terms in sorted(reasons[side].items()):
            edge, corner = edges[1 - side][j], own.corners[i]
            place = dot(edge.tangent, subtract(corner.position, edge.start.position))
            inside = algebra.minimum(place, edge.length - place) + tie
            frame = edge.start.frame
            rows.append(
                Pair(
                    own.numbers[i],
                    facing.edge_number(j),
                    gaps[side][i, j],
                    edge.normal,
                    subtract(corner.velocity, frame.velocity_at(corner.position)),
                    corner.position,
                    algebra.minimum(inside, _fold(algebra.maximum, terms)),
                )
            )
        found.append(rows)
    return found[0], found[1]


def _look_at_pieces(
    algebra: Algebra,
    shapes: tuple[Outline, Outline],
    pieces: tuple[tuple[int, ...], tuple[int, ...]],
    edges: tuple[dict[int, _Edge], ...],
    gaps: tuple[dict[tuple[int, int], Any], ...],
    tie: float,
    reasons: tuple[dict[tuple[int, int], list[Any]], ...],
) -> None:
    """Add to `reasons` when corners of these two convex pieces meet their edges."""
    real = tuple(
        [a for a, b in zip(piece, [*piece[1:], piece[0]], strict=True) if shape.is_real(a, b)]
        for shape, piece in zip(shapes, pieces, strict=True)
    )
    # side 0: edges of the second piece seen from corners of the first, and the other way round
    separation = tuple(
        {
            j: _fold(algebra.minimum, [gaps[side][i, j] for i in pieces[side]])
            for j in real[1 - side]
        }
        for side in (0, 1)
    )
    every = [*separation[0].values(), *separation[1].values()]
    if not every:
        return
    top = _fold(algebra.maximum, every)
    leads = tuple({j: s - top + tie for j, s in sides.items()} for sides in separation)
    for side in (0, 1):
        corners, facing = pieces[side], real[1 - side]
        # how much edge j of the other piece faces edge k of this one
        facings = {
            k: {j: -dot(edges[side][k].normal, edges[1 - side][j].normal) for j in facing}
            for k in real[side]
        }
        most = {k: _fold(algebra.maximum, list(row.values())) for k, row in facings.items() if row}
        count = len(shapes[side].corners)
        for i in corners:
            for j in facing:
                terms = reasons[side].setdefault((i, j), [])
                terms.append(leads[side][j])
                for k in (i, (i - 1) % count):
                    if k in real[side]:
                        incident = facings[k][j] - most[k] + _TIE
                        terms.append(algebra.minimum(leads[1 - side][k], incident))


def _fold(operation: Any, terms: Sequence[Any]) -> Any:
    value = terms[0]
    for term in terms[1:]:
        value = operation(value, term)
    return value
