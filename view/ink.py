"""Frames drawn with matplotlib: still pictures and films."""

import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from signorini.view.geometry import faces, hull, meshes, semi_axes
from signorini.view.motion import OBSTACLES, Motion, Thing
from signorini.view.page import force_scale, pace_in_words

FILLS = ("#cfe3f3", "#f8dcc4", "#d3ecdf", "#eadcf1", "#f7ecc0", "#dde2e8")
STATES = {"slip": "#d55e00", "stick": "#0072b2", "closed": "#0072b2", "unknown": "#8a929c"}
HIT, FORCE, INK = "#c2185b", "#009e73", "#1b1f24"
_TURN = np.linspace(0, 2 * np.pi, 61)


def new_figure(width: float, height: float) -> Any:
    """A figure that belongs to nobody else, and that a notebook shows where it is a result."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    class Shown(Figure):
        def _repr_png_(self) -> bytes:
            stream = io.BytesIO()
            self.savefig(stream, format="png", dpi=100)
            return stream.getvalue()

    figure = Shown(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def new_axes(figure: Any, motion: Motion) -> Any:
    """Axes in which the whole motion fits, both directions with one scale."""
    low, high = motion.box()
    size = max(float((high - low).max()), motion.size(), 1e-9)
    middle = (low + high) / 2
    # What lies on a line still gets a picture that one can read.
    half = np.maximum((high - low) / 2 * 1.15, 0.25 * size if motion.dimension == 2 else 0.1 * size)
    if motion.dimension == 2:
        axis = figure.add_subplot()
        axis.set_xlim(middle[0] - half[0], middle[0] + half[0])
        axis.set_ylim(middle[1] - half[1], middle[1] + half[1])
        axis.set_aspect("equal")
        axis.set_xlabel("x [m]")
        axis.set_ylabel("y [m]")
        axis.spines[["top", "right"]].set_visible(False)
        return axis
    from mpl_toolkits import mplot3d  # noqa: F401  (registers the projection)

    axis = figure.add_subplot(projection="3d")
    limits = [(m - h, m + h) for m, h in zip(middle, half, strict=True)]
    axis.set(xlim=limits[0], ylim=limits[1], zlim=limits[2])
    axis.set_box_aspect(half)
    axis.set_proj_type("persp", focal_length=0.6)
    axis.locator_params(nbins=4)
    for name, place in (("x", 4), ("y", 4), ("z", 2)):
        getattr(axis, f"set_{name}label")(f"{name} [m]", labelpad=place)
        getattr(axis, f"{name}axis").pane.set_facecolor("#f6f8fa")
    axis.tick_params(labelsize=8, pad=0)
    return axis


def obstacles(axis: Any, motion: Motion) -> None:
    """Planes, curves and nets that rest."""
    for thing in motion.things:
        if thing.rests and thing.kind in OBSTACLES:
            _obstacle(axis, motion, thing, thing.at(0))


def _obstacle(axis: Any, motion: Motion, thing: Thing, points: np.ndarray) -> list[Any]:
    low, high = motion.box()
    far = 3 * max(float((high - low).max()), motion.size(), 1e-9)
    if motion.dimension == 3:
        if thing.kind == "net":
            return [_surface(axis, points[meshes(points, thing.rows, low, high)])]
        return [_surface(axis, patch(points[0], points[1] - points[0], low, high)[None])]
    if thing.kind == "plane":
        p, n = points[0], points[1] - points[0]
        along = np.array([n[1], -n[0]])
        middle = p + along * (along @ ((low + high) / 2 - p))
        points = np.array([middle - far * along, middle + far * along])
    line = axis.plot(*points.T, c=INK, lw=1.8, zorder=0.9, scalex=False, scaley=False)
    way = np.diff(points, axis=0, append=2 * points[-1:] - points[-2:-1])
    behind = np.stack([way[:, 1], -way[:, 0]], axis=1)
    behind /= np.maximum(np.linalg.norm(behind, axis=1, keepdims=True), 1e-300)
    band = np.vstack([points, (points + 0.03 * far / 3 * behind)[::-1]])
    area = axis.fill(*band.T, fc="none", ec="#6b737d", hatch="////", lw=0, zorder=0.8)
    return [*line, *area]


def _surface(axis: Any, corners: np.ndarray) -> Any:
    """Part of an obstacle in space; corners of its meshes, shape (meshes, 4, 3)."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    width = 0.8 if len(corners) == 1 else 0.3
    return axis.add_collection3d(
        Poly3DCollection(
            corners, facecolor="#dfe5ea", edgecolor="#aab3bd", lw=width, alpha=0.45, zorder=0
        )
    )


def patch(p: np.ndarray, normal: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """A square of a plane below a box, shape (4, 3)."""
    n = normal / np.linalg.norm(normal)
    one = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    one /= np.linalg.norm(one)
    two = np.cross(n, one)
    middle = (low + high) / 2
    middle = middle - n * (n @ (middle - p))
    half = 0.65 * float((high - low).max())
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return np.array([middle + half * (a * one + b * two) for a, b in signs])


def frame(axis: Any, motion: Motion, k: int, colour: str | None = None) -> list[Any]:
    """Draw frame k; lines of one `colour`, or filled bodies. Returns what was drawn."""
    names = list(dict.fromkeys(thing.name for thing in motion.things))
    drawn: list[Any] = []
    for thing in motion.things:
        points = thing.at(k)
        if thing.kind in OBSTACLES:
            if not thing.rests:
                drawn += _obstacle(axis, motion, thing, points)
            continue
        fill = FILLS[names.index(thing.name) % len(FILLS)]
        for line, closed in _lines(thing, points):
            if motion.dimension == 2 and closed and colour is None:
                drawn += axis.fill(*line.T, fc=fill, ec=INK, lw=1.3, zorder=2)
            else:
                wide = 3.5 if thing.kind == "hull" and len(line) == 2 else 1.3
                c = colour or INK
                drawn += axis.plot(*line.T, c=c, lw=wide, solid_capstyle="round", zorder=2.1)
        if thing.kind in ("dot", "pin"):
            face = "w" if thing.kind == "pin" else colour or INK
            drawn += axis.plot(*points.T, "o", ms=5, mfc=face, mec=colour or INK, zorder=3)
    return drawn


def contacts(axis: Any, motion: Motion, k: int) -> list[Any]:
    """Contact points of frame k by state, and forces."""
    drawn: list[Any] = []
    low, high = motion.box()
    unit = 0.15 * max(float((high - low).max()), motion.size(), 1e-9) / force_scale(motion)
    for mark in motion.marks:
        if mark.place is None:
            continue
        place = mark.place[k]
        if mark.force is not None:
            arm = mark.force[k] * unit
            size = float(np.linalg.norm(arm))
            if size > 0:
                arm *= min(size, 1.6 * unit * force_scale(motion)) / size
                drawn += axis.plot(
                    *np.array([place, place + arm]).T, c=FORCE, lw=2, zorder=4,
                    scalex=False, scaley=False,
                )  # fmt: skip
        state = str(mark.state[k])
        if mark.hit[k] or state in STATES:
            c = HIT if mark.hit[k] else STATES[state]
            drawn += axis.plot(*place[:, None], "o", c=c, ms=6, mec="w", mew=0.8, zorder=5)
    return drawn


def _lines(thing: Thing, points: np.ndarray) -> Iterator[tuple[np.ndarray, bool]]:
    """Lines of a thing, and whether each bounds an area."""
    if thing.kind == "line":
        yield points, False
    elif thing.kind == "area":
        yield np.vstack([points, points[:1]]), True
    elif thing.kind == "hull":
        if points.shape[1] == 2 and len(points) > 2:
            yield hull(points), True
        elif points.shape[1] == 3 and len(points) > 3:
            for face in faces(points):
                yield points[[*face, face[0]]], False
        else:
            yield points, False
    elif thing.kind in ("round", "circle"):
        center, axes = points[0], semi_axes(points)
        pairs = [(axes[0], axes[1])] if len(axes) == 2 else _planes(axes)
        for a, b in pairs:
            yield center + np.outer(np.cos(_TURN), a) + np.outer(np.sin(_TURN), b), True
        if thing.kind == "round" and len(axes) == 2:
            yield np.array([center, center + axes[0]]), False
    elif thing.kind == "spring":
        yield _spring(points), False


def _planes(axes: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Great circles of an ellipsoid; a flat one has its rim."""
    pairs = ((axes[0], axes[1]), (axes[1], axes[2]), (axes[2], axes[0]))
    return [(a, b) for a, b in pairs if min(np.linalg.norm(a), np.linalg.norm(b)) > 0]


def _spring(points: np.ndarray) -> np.ndarray:
    a, b = points
    way = b - a
    aside = np.zeros_like(way)
    aside[:2] = (-way[1], way[0]) if np.hypot(*way[:2]) > 0 else (1.0, 0.0)
    aside *= 0.04 * np.linalg.norm(way) / max(float(np.linalg.norm(aside)), 1e-300)
    turns = np.arange(17)
    inside = a + way * (0.15 + 0.7 * turns / 16)[:, None]
    off = np.where(turns % 2 == 1, 1.0, -1.0) * ((turns > 0) & (turns < 16))
    return np.vstack([a, inside + off[:, None] * aside, b])


def poses(motion: Motion, path: Path, count: int = 8) -> None:
    """A picture of `count` poses equally spaced in time, from pale to dark, with their times."""
    import matplotlib as mpl

    fig = new_figure(7.5, 5)
    axis = new_axes(fig, motion)
    obstacles(axis, motion)
    rows = np.unique(np.linspace(0, len(motion.t) - 1, count).astype(int))
    colours = mpl.colormaps["viridis_r"]
    last = max(float(motion.t[-1] - motion.t[0]), 1e-300)
    for row in rows:
        share = float(motion.t[row] - motion.t[0]) / last
        frame(axis, motion, int(row), mpl.colors.to_hex(colours(0.1 + 0.85 * share)))
    for thing in motion.moving():
        if not thing.rests:
            axis.plot(*_way(thing).T, c="0.75", lw=0.6, zorder=1.5, scalex=False, scaley=False)
    if len(rows) > 1:
        scale = mpl.cm.ScalarMappable(
            mpl.colors.Normalize(float(motion.t[0]), float(motion.t[-1])), _cut(mpl, colours)
        )
        pad = 0.08 if motion.dimension == 3 else 0.02
        bar = fig.colorbar(scale, ax=axis, shrink=0.7, pad=pad)
        bar.set_label("t [s]")
        times = [float(motion.t[row]) for row in rows]
        bar.set_ticks(times, labels=[f"{t:.3g}" for t in times])
    fig.suptitle(_short(motion.title), fontsize=11)
    fig.savefig(path, dpi=130)


def _cut(mpl: Any, colours: Any) -> Any:
    return mpl.colors.ListedColormap(colours(np.linspace(0.1, 0.95, 256)))


def _way(thing: Thing) -> np.ndarray:
    middle = thing.kind in ("round", "circle")
    way: np.ndarray = thing.points[:, 0] if middle else thing.points.mean(axis=1)
    return way


def _short(title: str, most: int = 80) -> str:
    return title if len(title) <= most else f"{title[: most - 1].rstrip()}…"


def film(motion: Motion, path: Path) -> None:
    """Write a .gif, or an .mp4 if imageio-ffmpeg or ffmpeg is there."""
    import matplotlib as mpl
    from matplotlib import animation

    fig = new_figure(6.4, 4.8)
    axis = new_axes(fig, motion)
    obstacles(axis, motion)
    title = axis.set_title("", fontsize=10, loc="left")
    fig.suptitle(_short(motion.title, 70), fontsize=11)
    drawn: list[Any] = []

    def show(k: int) -> Sequence[Any]:
        for artist in drawn:
            artist.remove()
        drawn[:] = [*frame(axis, motion, k), *contacts(axis, motion, k)]
        title.set_text(f"t = {motion.t[k]:.4g} s{pace_in_words(motion)}")
        return drawn

    writer: Any = animation.PillowWriter(fps=round(motion.fps))
    program = {}
    if path.suffix != ".gif":
        writer = animation.FFMpegWriter(fps=round(motion.fps), bitrate=2400)
        program = {"animation.ffmpeg_path": _ffmpeg()}
    with mpl.rc_context(program):
        animation.FuncAnimation(fig, show, frames=len(motion.t)).save(path, writer=writer, dpi=100)


def _ffmpeg() -> str:
    import shutil

    found = shutil.which("ffmpeg")
    if found:
        return found
    try:
        import imageio_ffmpeg
    except ImportError:
        raise ModuleNotFoundError(
            "an .mp4 needs ffmpeg: install it, or pip install 'signorini[view]', or write a .gif"
        ) from None
    return str(imageio_ffmpeg.get_ffmpeg_exe())
