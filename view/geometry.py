"""Hulls of a few points, axes of round things."""

from itertools import combinations

import numpy as np

_MOST = 24  # points of a hull in space; the search over triples is cubic
_FLAT = 1e-9  # of the size of a body: points so close to a plane are in it


def semi_axes(points: np.ndarray) -> np.ndarray:
    """Semi-axes of a round thing in rows; of a circle that does not turn the second is added."""
    axes: np.ndarray = points[1:] - points[0]
    if len(axes) == 1:
        size = np.linalg.norm(axes[0])
        other = np.zeros(points.shape[1])
        other[1] = size
        axes = np.vstack([axes, other])
    return axes


def meshes(points: np.ndarray, rows: int, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Indices of the four corners of the meshes of a net that are all known, shape (meshes, 4).

    They lie below a box or beside it by little, unless none does.
    """
    number = np.arange(len(points)).reshape(rows, -1)
    corners = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    found = np.stack([c.ravel() for c in corners], axis=1)
    found = found[np.isfinite(points[found]).all(axis=(1, 2))]
    middle, beside = points[found].mean(axis=1)[:, :2], 0.1 * float((high - low).max())
    near = ((middle >= low[:2] - beside) & (middle <= high[:2] + beside)).all(axis=1)
    return np.asarray(found[near] if near.any() else found)


def hull(points: np.ndarray) -> np.ndarray:
    """Convex hull in the plane, closed, counterclockwise (Andrew's monotone chain)."""
    order = sorted(map(tuple, points))

    def half(places: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
        out: list[tuple[float, ...]] = []
        for p in places:
            while len(out) > 1:
                (ax, ay), (bx, by) = out[-2:]
                if (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax) > 0:
                    break
                out.pop()
            out.append(p)
        return out[:-1]

    ring = half(order) + half(order[::-1])
    return np.array([*ring, ring[0]])


def faces(points: np.ndarray) -> list[list[int]]:
    """Faces of the convex hull in space, corners counterclockwise seen from outside.

    Points inside take no part; more than 24 points, or flat bodies, give no faces.
    """
    n = len(points)
    if n < 4 or n > _MOST:
        return []
    size = float(np.ptp(points, axis=0).max())
    found: dict[tuple[int, ...], np.ndarray] = {}
    for a, b, c in combinations(range(n), 3):
        normal = np.cross(points[b] - points[a], points[c] - points[a])
        length = float(np.linalg.norm(normal))
        if length <= _FLAT * size**2:
            continue
        normal = normal / length
        height = (points - points[a]) @ normal
        if height.min() < -_FLAT * size:
            normal, height = -normal, -height
        if height.min() < -_FLAT * size or height.max() <= _FLAT * size:
            continue
        face = tuple(int(k) for k in np.flatnonzero(height <= _FLAT * size))
        found[face] = -normal  # outwards
    return [_around(points, face, normal) for face, normal in found.items()]


def _around(points: np.ndarray, face: tuple[int, ...], normal: np.ndarray) -> list[int]:
    """Corners of a convex face in order; points within it are left out."""
    places = points[list(face)]
    middle = places.mean(axis=0)
    one = places[0] - middle
    one /= max(float(np.linalg.norm(one)), 1e-300)
    two = np.cross(normal, one)
    flat = np.stack([(places - middle) @ one, (places - middle) @ two], axis=1)
    ring = hull(flat)[:-1]
    return [face[int(np.argmin(np.abs(flat - p).sum(axis=1)))] for p in ring]
