"""A motion in space as one HTML page: the scene and player of viser."""

import contextlib
import io
import socket
from typing import Any

import numpy as np
from signorini.view.geometry import faces, meshes, semi_axes
from signorini.view.ink import FILLS, FORCE, HIT, STATES, patch
from signorini.view.motion import OBSTACLES, Motion, Thing
from signorini.view.page import force_scale

_INK = (40, 45, 52)
_ADVICE = "a page of a motion in space needs viser: pip install 'signorini[view]'"


def page(motion: Motion) -> str:
    """The page as text.

    Raises
    ------
    ModuleNotFoundError
        If viser is missing.
    """
    try:
        import viser
    except ImportError:
        raise ModuleNotFoundError(_ADVICE) from None
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=port, verbose=False)
    try:
        return _record(server, motion)
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _record(server: Any, motion: Motion) -> str:
    scene = server.scene
    scene.set_up_direction("+z")
    low, high = motion.box()
    size = max(float((high - low).max()), motion.size(), 1e-9)
    middle = (low + high) / 2
    server.initial_camera.position = tuple(middle + size * np.array([0.55, -1.0, 0.5]))
    server.initial_camera.look_at = tuple(middle)
    server.initial_camera.up = (0.0, 0.0, 1.0)
    obstacles = [
        _Obstacle(scene, f"/obstacles/{k}", thing, (low, high))
        for k, thing in enumerate(motion.things)
        if thing.kind in OBSTACLES
    ]
    names = list(dict.fromkeys(thing.name for thing in motion.things))
    bodies = [
        _Body(scene, f"/things/{k}", thing, FILLS[names.index(thing.name) % len(FILLS)], size)
        for k, thing in enumerate(motion.things)
        if thing.kind not in OBSTACLES
    ]
    marks = _Marks(scene, motion, size)
    for thing in motion.moving():
        if not thing.rests and thing.kind in ("round", "hull", "area", "dot"):
            _trail(scene, thing, size)
    record = server.get_scene_serializer()
    for k in range(len(motion.t)):
        for obstacle in obstacles:
            obstacle.show(k)
        for body in bodies:
            body.show(k)
        marks.show(k)
        record.insert_sleep(1.0 / motion.fps)
    return str(record.as_html())


class _Obstacle:
    """A square of a plane below the motion, or a net; it moves where its frame does."""

    def __init__(
        self, scene: Any, name: str, thing: Thing, box: tuple[np.ndarray, np.ndarray]
    ) -> None:
        self.thing, self.box = thing, box
        net = thing.kind == "net"
        quads = meshes(thing.at(0), thing.rows, *box) if net else np.arange(4)[None]
        self.handle = scene.add_mesh_simple(
            name,
            vertices=self._corners(0),
            faces=np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]),
            color=(214, 221, 227),
            side="double",
            opacity=0.7 if net else None,
        )
        if net and thing.rests:
            corners = thing.at(0)[quads]
            sides = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
            scene.add_line_segments(
                f"{name}/lines", sides.astype(np.float32), colors=(170, 179, 189), thickness=1.0,
                thickness_units="screen",
            )  # fmt: skip

    def _corners(self, k: int) -> np.ndarray:
        points = self.thing.at(k)
        if self.thing.kind == "plane":
            points = patch(points[0], points[1] - points[0], *self.box)
        return np.nan_to_num(points).astype(np.float32)

    def show(self, k: int) -> None:
        if not self.thing.rests:
            self.handle.vertices = self._corners(k)


def _trail(scene: Any, thing: Thing, size: float) -> None:
    way = thing.points[:, 0] if thing.kind == "round" else thing.points.mean(axis=1)
    if len(way) > 1:
        pairs = np.stack([way[:-1], way[1:]], axis=1).astype(np.float32)
        name = f"/trails/{thing.name or thing.kind}"
        grey = (170, 178, 187)
        scene.add_line_segments(name, pairs, colors=grey, thickness=1.0, thickness_units="screen")


class _Body:
    """One thing in the scene: a rigid mesh that is moved, or lines that are drawn anew."""

    def __init__(self, scene: Any, name: str, thing: Thing, fill: str, size: float) -> None:
        self.thing = thing
        self.first = thing.at(0)
        self.handle: Any = None
        self.rigid = False
        points = self.first
        colour = tuple(int(fill[i : i + 2], 16) for i in (1, 3, 5))
        if thing.kind == "round":
            self.rigid = True
            self.handle = _ball(scene, name, semi_axes(points), colour)
        elif thing.kind == "hull" and faces(points):
            self.rigid = True
            self.handle = _solid(scene, name, points, colour)
        elif thing.kind in ("dot", "pin"):
            self.handle = scene.add_icosphere(name, radius=0.012 * size, color=_INK)
        else:
            self.closed = thing.kind == "area"
            self.handle = scene.add_line_segments(
                name, self._segments(points), colors=_INK, thickness=2.5, thickness_units="screen"
            )
        self.shown: Any = None

    def _segments(self, points: np.ndarray) -> np.ndarray:
        line = np.vstack([points, points[:1]]) if self.closed else points
        return np.stack([line[:-1], line[1:]], axis=1).astype(np.float32)

    def show(self, k: int) -> None:
        if self.thing.rests and self.shown is not None:
            return
        self.shown = k
        points = self.thing.at(k)
        if self.thing.kind in ("dot", "pin"):
            self.handle.position = tuple(points[0])
        elif self.rigid:
            turn, place = _pose(self.thing.kind, self.first, points)
            self.handle.wxyz = _quaternion(turn)
            self.handle.position = tuple(place)
        else:
            self.handle.points = self._segments(points)


def _ball(scene: Any, name: str, axes: np.ndarray, colour: tuple[int, ...]) -> Any:
    """A ball, ellipsoid or coin around the origin in quarters of two shades: one sees it turn."""
    sizes = np.linalg.norm(axes, axis=1)
    thick = np.maximum(sizes, 2e-3 * sizes.max())  # a flat one still has two sides
    down, around = np.linspace(0, np.pi, 17), np.linspace(0, 2 * np.pi, 33)
    theta, phi = (x.ravel() for x in np.meshgrid(down, around, indexing="ij"))
    ball = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1
    )
    vertices = ((ball * thick) @ _complete(axes)).astype(np.float32)
    quads = [(i * 33 + j, i, j) for i in range(16) for j in range(32)]
    body = scene.add_frame(name, show_axes=False)
    for shade, part in ((1.0, "light"), (0.55, "dark")):
        triangles = [
            corner
            for k, i, j in quads
            if ((i < 8) == ((j // 8) % 2 == 0)) == (part == "light")
            for corner in ((k, k + 33, k + 34), (k, k + 34, k + 1))
        ]
        scene.add_mesh_simple(
            f"{name}/{part}",
            vertices=vertices,
            faces=np.array(triangles),
            color=tuple(int(shade * c) for c in colour),
        )
    return body


def _solid(scene: Any, name: str, points: np.ndarray, colour: tuple[int, ...]) -> Any:
    """A convex body with flat faces."""
    middle = points.mean(axis=0)
    triangles = [
        (face[0], face[i], face[i + 1]) for face in faces(points) for i in range(1, len(face) - 1)
    ]
    return scene.add_mesh_simple(
        name,
        vertices=(points - middle).astype(np.float32),
        faces=np.array(triangles),
        color=colour,
        flat_shading=True,
    )


def _complete(axes: np.ndarray) -> np.ndarray:
    """Unit vectors along semi-axes of which one may be zero."""
    sizes = np.linalg.norm(axes, axis=1)
    frame = np.array([a / s if s > 0 else a for a, s in zip(axes, sizes, strict=True)])
    for k in range(3):
        if sizes[k] == 0:
            frame[k] = np.cross(frame[(k + 1) % 3], frame[(k + 2) % 3])
    return frame


def _pose(kind: str, first: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and place of a rigid body that was at `first` (Kabsch)."""
    if kind == "round":
        a, b = _complete(semi_axes(first)), _complete(semi_axes(points))
        return (a.T @ b).T, points[0]
    middle, place = first.mean(axis=0), points.mean(axis=0)
    u, _, vt = np.linalg.svd((first - middle).T @ (points - place))
    sign = np.sign(np.linalg.det(vt.T @ u.T))
    turn = vt.T @ np.diag([1.0, 1.0, sign]) @ u.T
    return turn, place


def _quaternion(turn: np.ndarray) -> tuple[float, ...]:
    """Unit quaternion (w, x, y, z) of a rotation matrix (Shepperd)."""
    t = np.array([np.trace(turn), *np.diag(turn)])
    k = int(np.argmax(t))
    if k == 0:
        w = np.sqrt(1 + t[0]) / 2
        rest = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
        q = np.array([w, *(r / (4 * w) for r in rest)])
    else:
        i = k - 1
        j, m = (i + 1) % 3, (i + 2) % 3
        x = np.sqrt(1 + turn[i, i] - turn[j, j] - turn[m, m]) / 2
        q = np.empty(4)
        q[0] = (turn[m, j] - turn[j, m]) / (4 * x)
        q[1 + i], q[1 + j] = x, (turn[j, i] + turn[i, j]) / (4 * x)
        q[1 + m] = (turn[m, i] + turn[i, m]) / (4 * x)
    return tuple(float(c) for c in q)


class _Marks:
    """Contact points that light up, and arrows of their forces."""

    def __init__(self, scene: Any, motion: Motion, size: float) -> None:
        self.marks = [m for m in motion.marks if m.place is not None]
        self.radius = 0.014 * size
        self.unit = 0.18 * size / force_scale(motion)
        self.longest = 1.6 * self.unit * force_scale(motion)
        self.dots = {}
        for colour in {*STATES.values(), HIT}:
            for k in range(len(self.marks)):
                rgb = tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5))
                self.dots[colour, k] = scene.add_icosphere(
                    f"/contacts/{k}/{colour[1:]}", radius=self.radius, color=rgb, visible=False
                )
        self.arrows = None
        if any(m.force is not None for m in self.marks):
            rgb = tuple(int(FORCE[i : i + 2], 16) for i in (1, 3, 5))
            self.arrows = scene.add_arrows(
                "/forces",
                points=np.zeros((1, 2, 3), dtype=np.float32),
                colors=rgb,
                shaft_radius=0.006 * size,
                head_radius=0.014 * size,
                head_length=0.035 * size,
            )

    def show(self, k: int) -> None:
        arrows = []
        for number, mark in enumerate(self.marks):
            assert mark.place is not None
            state = str(mark.state[k])
            colour = HIT if mark.hit[k] else STATES.get(state)
            for candidate in {*STATES.values(), HIT}:
                dot = self.dots[candidate, number]
                if dot.visible != (candidate == colour):
                    dot.visible = candidate == colour
                if candidate == colour:
                    dot.position = tuple(mark.place[k])
            if mark.force is not None:
                arm = mark.force[k] * self.unit
                length = float(np.linalg.norm(arm))
                if length > 0:
                    arm = arm * min(length, self.longest) / length
                    arrows.append([mark.place[k], mark.place[k] + arm])
        if self.arrows is not None:
            shown = arrows or [[np.zeros(3), np.zeros(3)]]
            self.arrows.points = np.array(shown, dtype=np.float32)
