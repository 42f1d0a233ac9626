"""The frames of a motion: places of everything that is drawn, states and forces of contacts."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

_MESHES = 60  # most of a net along each side
_NEAR = 0.1  # share of a picture: what rests within it of what moves is shown whole
_MOST = 900  # frames of a film
_SPEEDS = (1.0, 2.0, 5.0)  # times powers of ten
_FILM = (3.0, 20.0)  # seconds that a film should last


OBSTACLES = ("plane", "curve", "net")


@dataclass(frozen=True, eq=False)
class Thing:
    """Something drawn; `points` has the shape (frames, points, 2 or 3), one frame if it rests.

    The points of a net stand in `rows` rows; where the surface is not known they are NaN.
    """

    kind: str
    name: str
    points: np.ndarray
    rows: int = 1

    @property
    def rests(self) -> bool:
        return len(self.points) == 1

    def at(self, k: int) -> np.ndarray:
        """Its points in frame k."""
        return self.points[0 if self.rests else k]


@dataclass(frozen=True, eq=False)
class Mark:
    """A contact or friction element.

    Attributes
    ----------
    name : str
    state : ndarray of str, shape (frames,)
        As in ``traj["name.state"]``.
    hit : ndarray of bool, shape (frames,)
        Whether it closed with an impact since the frame before.
    place : ndarray, shape (frames, dimension), or None
        Where it is, if the model says so; where it was when it was hit.
    force : ndarray, shape (frames, dimension), or None
        Mean force since the frame before [N], where directions are known.
    """

    name: str
    state: np.ndarray
    hit: np.ndarray
    place: np.ndarray | None
    force: np.ndarray | None


@dataclass(frozen=True, eq=False)
class Motion:
    """Frames of a run, equally spaced on the screen.

    Attributes
    ----------
    title : str
    t : ndarray, shape (frames,)
        Times of the rows shown [s].
    fps, speed : float
        Frames a second on the screen, model seconds a second on the screen.
    things : list of Thing
    marks : list of Mark
    """

    title: str
    t: np.ndarray
    fps: float
    speed: float
    things: list[Thing]
    marks: list[Mark]

    @property
    def dimension(self) -> int:
        return int(self.things[0].points.shape[2])

    def moving(self) -> list[Thing]:
        """Bodies and what joins them: no obstacles."""
        return [thing for thing in self.things if thing.kind not in OBSTACLES]

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates that bodies reach; what rests far away does not count."""
        points = [_outline(thing) for thing in self.moving() if not thing.rests]
        points += [t.points[:, :1] for t in self.things if t.kind == "plane" and not t.rests]
        points = points or [_outline(thing) for thing in self.things]
        low, high = _corners(points)
        size = float((high - low).max())
        for thing in self.moving():
            least, most = _corners([_outline(thing)])
            near = np.all((least <= high + _NEAR * size) & (most >= low - _NEAR * size))
            # a pulley at rest belongs to its rope, a box to what falls on it, a room to nobody
            if thing.rests and near and float((most - least).max()) <= 2 * size:
                low, high = np.minimum(low, least), np.maximum(high, most)
        return low, high

    def size(self) -> float:
        """Size of the bodies without their way [m]."""
        spans = [np.ptp(_outline(thing), axis=1).max() for thing in self.moving()]
        return float(max(spans, default=0.0))


def _corners(points: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates of all points."""
    everything = np.concatenate([p.reshape(-1, p.shape[2]) for p in points])
    return everything.min(axis=0), everything.max(axis=0)


def _outline(thing: Thing) -> np.ndarray:
    """Points that bound a thing."""
    if thing.kind in ("round", "circle"):
        center, ends = thing.points[:, :1], thing.points[:, 1:]
        radius = np.linalg.norm(ends - center, axis=2, keepdims=True).max(axis=1, keepdims=True)
        return np.concatenate([center - radius, center + radius], axis=1)
    return thing.points


def pace(duration: float) -> float:
    """Model seconds a second on the screen for a film that one can follow: 1, 2, 5 times 10^k."""
    if duration <= 0 or _FILM[0] <= duration <= _FILM[1]:
        return 1.0
    wanted = duration / (_FILM[0] if duration < _FILM[0] else _FILM[1])
    decade = 10.0 ** np.floor(np.log10(wanted))
    choices = [decade * x for x in (*_SPEEDS, 10.0)]
    if wanted < 1:
        return float(max(c for c in choices if c <= wanted * (1 + 1e-9)))
    return float(min(c for c in choices if c >= wanted * (1 - 1e-9)))


def frames(t: np.ndarray, fps: float, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Times of the frames, and rows to show: the last ones that are not behind them."""
    count = int(np.floor((t[-1] - t[0]) * fps / speed * (1 + 1e-12))) + 1
    count = max(1, min(count, _MOST))
    times = np.linspace(t[0], t[-1], count) if count > 1 else t[:1]
    rows = np.searchsorted(t, times + 1e-9 * (t[-1] - t[0]), side="right") - 1
    return times, np.clip(rows, 0, len(t) - 1)


def _states(traj: Any, times: np.ndarray, rows: np.ndarray) -> dict[str, np.ndarray]:
    """What is shown: rows, or what is between them where steps were cut at their events."""
    if traj.options.get("events") != "located":
        return {"t": traj.t[rows], "q": traj.q[rows]}
    return {"t": times, "q": traj(times)[0]}


def motion(traj: Any, fps: float = 30.0, speed: float | None = None) -> Motion:
    """Frames of a trajectory.

    Parameters
    ----------
    traj : Trajectory
    fps : float
        Frames a second on the screen.
    speed : float, optional
        Model seconds a second on the screen; by default 1, or what makes the film last between
        3 and 20 seconds.

    Raises
    ------
    ValueError
        If the model draws nothing.
    """
    manifest = traj.stepper.manifest
    chosen = pace(float(traj.t[-1] - traj.t[0])) if speed is None else float(speed)
    times, rows = frames(traj.t, fps, chosen)
    if not manifest["shapes"]:
        raise ValueError(
            f"the model '{traj.model}' draws nothing: add m.shape(...) to it, or write it with "
            "signorini.bodies, whose bodies draw themselves. traj.plot() shows curves over time"
        )
    shown = _states(traj, times, rows)
    places = traj.stepper.evaluate("shapes", **shown, parameters=traj.parameters)
    if not np.all(np.isfinite(places)):
        frame, point = (int(k) for k in np.argwhere(~np.isfinite(places))[0][:2])
        counts = np.cumsum([shape["points"] for shape in manifest["shapes"]])
        shape = manifest["shapes"][int(np.searchsorted(counts, point, side="right"))]
        of = f" of '{shape['name']}'" if shape["name"] else ""
        raise ValueError(
            f"model '{traj.model}': a {shape['kind']}{of} that is drawn has no place at "
            f"t = {shown['t'][frame]:g}: a coordinate of it is not finite. Correct the shape"
        )
    hits = {name: _impacts(traj, name) for name in traj.contacts}
    struck = np.unique(np.concatenate([np.zeros(0, dtype=int), *hits.values()]))
    hit = _states(traj, _hit_times(traj, struck), struck)
    there = traj.stepper.evaluate("shapes", **hit, parameters=traj.parameters)
    things: list[Thing] = []
    contacts: dict[str, np.ndarray] = {}
    begins: dict[str, int] = {}
    first = 0
    for shape in manifest["shapes"]:
        points = places[:, first : first + shape["points"]]
        first += shape["points"]
        if shape["kind"] == "contact":
            name = shape["name"]
            contacts[name] = points.copy()
            own = there[np.searchsorted(struck, hits[name]), first - shape["points"] : first]
            contacts[name][_frames_of(rows, hits[name])] = own
            begins[name] = first - shape["points"]
            continue
        rests = np.ptp(points, axis=0).max() <= 1e-12 * max(1.0, float(np.abs(points).max()))
        lines = math.isqrt(shape["points"]) if shape["kind"] == "net" else 1
        if shape["kind"] in ("curve", "net") and not rests:
            points, lines = _along(points) if lines == 1 else _across(points, lines)
            rests = len(points) == 1
        things.append(Thing(shape["kind"], shape["name"], points[:1] if rests else points, lines))
    _add_slip_directions(traj, shown, contacts, begins)
    marks = [_mark(traj, name, rows, hits[name], contacts.get(name)) for name in traj.contacts]
    title = manifest["doc"] or traj.model
    return Motion(title, shown["t"], fps, chosen, things, marks)


def _along(points: np.ndarray) -> tuple[np.ndarray, int]:
    """A curve that is always seen near a moving point; at rest, if all frames lie on one graph."""
    x, y = points[..., 0].ravel(), points[..., 1].ravel()
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    grid = np.linspace(x[0], x[-1], max(200, points.shape[1]))
    line = np.interp(grid, x, y)
    # Between samples a graph differs from its chords by little; a curve that moves does by more.
    off = np.abs(np.interp(points[..., 0], grid, line) - points[..., 1]).max()
    if off > 1e-2 * max(float(np.ptp(y)), 1e-3 * float(np.ptp(x))):
        return points, 1
    return np.stack([grid, line], axis=1)[None], 1


def _across(points: np.ndarray, lines: int) -> tuple[np.ndarray, int]:
    """A net that is always seen around a moving point; at rest, if all frames lie on one graph.

    Then all that was ever seen of it is one net, with as many meshes a metre.
    """
    frames = points.reshape(len(points), lines, lines, 3)
    x, y = frames[:, :, 0, 0], frames[:, 0, :, 1]
    if np.ptp(frames[..., 0], axis=2).any() or np.ptp(frames[..., 1], axis=1).any():
        return points, lines  # its frame turns
    if (np.diff(x) <= 0).any() or (np.diff(y) <= 0).any():
        return points, lines
    side = float(x[0, -1] - x[0, 0]) / (lines - 1)
    grid = [np.arange(a.min(), a.max() + side / 2, side)[:_MESHES] for a in (x, y)]
    height = np.full((len(grid[0]), len(grid[1])), np.nan)
    off = 0.0
    for k in range(0, len(points), max(1, len(points) // _MESHES)):
        i, j = (
            np.flatnonzero((g >= a[0]) & (g <= a[-1]))
            for g, a in zip(grid, (x[k], y[k]), strict=True)
        )
        along = np.array([np.interp(grid[1][j], y[k], row) for row in frames[k, :, :, 2]])
        seen = np.array([np.interp(grid[0][i], x[k], column) for column in along.T]).T
        known = height[np.ix_(i, j)]
        both = np.isfinite(known)
        off = max(off, float(np.abs(known - seen)[both].max(initial=0.0)))
        height[np.ix_(i, j)] = np.where(both, known, seen)
    # Between points a graph differs from its chords by little; a net that moves does by more.
    if off > 2e-2 * max(float(np.ptp(frames[..., 2])), side):
        return points, lines
    flat = np.stack([*np.meshgrid(*grid, indexing="ij"), height], axis=2)
    return flat.reshape(1, -1, 3), len(grid[0])


def _add_slip_directions(
    traj: Any, shown: dict[str, np.ndarray], contacts: dict[str, np.ndarray], begins: dict[str, int]
) -> None:
    """Tips of the directions of slip where the model gives a place and a normal alone.

    The force of P_F acts along the t with d(place)/dq^T t = W_F, or nearest to it, for
    displacements that the constraints allow (no others have a meaning: quaternions keep their
    length).
    """
    bare = [
        name
        for name, points in contacts.items()
        if points.shape[1] == 2 and traj.contacts[name]["P_F"]
    ]
    if not bare:
        return
    stepper = traj.stepper
    q = shown["q"]
    at = {"t": shown["t"], "parameters": traj.parameters}
    step = 1e-6 * max(1.0, float(np.abs(q).max()))
    slopes = []
    for k in range(q.shape[1]):
        ends = [
            stepper.evaluate("shapes", q=q + sign * step * np.eye(q.shape[1])[k], **at)
            for sign in (1, -1)
        ]
        slopes.append((ends[0] - ends[1]) / (2 * step))
    W_F = stepper.evaluate("W_F", q=q, **at)
    free = np.broadcast_to(np.eye(q.shape[1]), (len(q), q.shape[1], q.shape[1]))
    if stepper.sizes["n_g"]:
        W_g = stepper.evaluate("W_g", q=q, **at)[..., stepper.rigid]
        free = free - W_g @ np.linalg.pinv(W_g)
    for name in bare:
        points = contacts[name]
        place, tip = points[:, 0], points[:, 1]
        slope = np.stack([s[:, begins[name]] for s in slopes], axis=1)  # d(place)/dq^T
        normal = tip - place
        tips = [place, tip]
        for column in traj.contacts[name]["P_F"]:
            t = (np.linalg.pinv(free @ slope) @ (free @ W_F[:, :, column, None]))[..., 0]
            t -= (t * normal).sum(axis=1, keepdims=True) * normal
            size = np.linalg.norm(t, axis=1, keepdims=True)
            tips.append(place + t / np.where(size > 1e-9, size, np.inf))
        contacts[name] = np.stack(tips, axis=1)


def _impacts(traj: Any, name: str) -> np.ndarray:
    """Rows at whose ends a contact was hit."""
    times = np.array([e.t for e in traj.events if e.contact == name and e.kind == "impact"])
    found = np.searchsorted(traj.t, times - 1e-12 * np.abs(times))
    return np.unique(np.minimum(found, len(traj.t) - 1)).astype(int)


def _hit_times(traj: Any, rows: np.ndarray) -> np.ndarray:
    """When a row's last impact was; the row's own time where none is told."""
    times = traj.t[rows].astype(float)
    hits = np.array([e.t for e in traj.events if e.kind == "impact"])
    for k, row in enumerate(rows):
        within = hits[(hits <= traj.t[row]) & (hits > traj.t[max(row - 1, 0)])]
        times[k] = within[-1] if within.size else times[k]
    return times


def _frames_of(rows: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Frames that show rows, or the first ones after them."""
    return np.minimum(np.searchsorted(rows, of), len(rows) - 1)


def _mark(
    traj: Any, name: str, rows: np.ndarray, impacts: np.ndarray, points: np.ndarray | None
) -> Mark:
    # The start's states are not known: they are shown as those of the first step.
    state = traj[f"{name}.state"][np.maximum(rows, min(1, len(traj.t) - 1))]
    # A row that several frames show has the force since the row shown before it.
    shown, which = np.unique(rows, return_inverse=True)
    before = np.concatenate([[0], shown[:-1]])[which]
    hits = np.zeros(len(rows), dtype=bool)
    hits[_frames_of(rows, impacts)] = True
    if points is None:
        return Mark(name, state, hits, None, None)
    columns = traj.contacts[name]
    parts = []
    if columns["P_N"] is not None and points.shape[1] > 1:
        parts.append((traj.P_N[:, columns["P_N"]], points[:, 1] - points[:, 0]))
        for k, column in enumerate(columns["P_F"]):
            if points.shape[1] > 2 + k:
                parts.append((traj.P_F[:, column], points[:, 2 + k] - points[:, 0]))
    force = None
    if parts:
        span = np.maximum(traj.t[rows] - traj.t[before], 1e-300)[:, None]
        force = np.zeros((len(rows), points.shape[2]))
        for percussion, direction in parts:
            total = np.concatenate([[0.0], np.cumsum(percussion[1:])])
            force += (total[rows] - total[before])[:, None] * direction / span
    return Mark(name, state, hits, points[:, 0], force)
