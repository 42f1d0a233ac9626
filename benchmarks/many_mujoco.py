"""Families of many bodies in MuJoCo: the same starts, compliant contacts, Euler's method."""

import time
from collections.abc import Callable
from math import cos, pi, sin
from statistics import median
from typing import Any

import mujoco
import numpy as np
from signorini.benchmarks.peer_mujoco import damping_ratio

VERSION = mujoco.__version__
_PLANAR = (
    '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
    '<joint type="hinge" axis="0 -1 0"/>'
)


_FLOOR = '<geom type="plane" size="100 100 1"/>'


def _model(bodies: str, walls: str, dt: float, e_N: float, mu: float) -> str:
    """Contacts as hard as MuJoCo accepts them: a time constant of two steps."""
    return f"""<mujoco><option timestep="{dt}" gravity="0 0 -9.81" integrator="Euler"
      cone="elliptic"/><default><geom solref="{2 * dt} {damping_ratio(e_N)}" friction="{mu} 0 0"
      condim="3" priority="1"/></default><worldbody>
      {walls}{bodies}</worldbody></mujoco>"""


def _wall(x: float, sign: int) -> str:
    return f'<geom type="plane" size="9 9 1" pos="{x} 0 0" euler="0 {90 * sign} 0"/>'


def chain(links: int, dt: float) -> str:
    """A tree of hinges whose tip may touch a wall."""
    length, lean = 0.2, 0.3 * 180 / pi
    inner = f'<geom type="sphere" size="1e-6" pos="0 0 {-length}" mass="1e-9"/>'
    for k in reversed(range(links)):
        place = f'pos="0 0 {-length if k else 0}"' + ("" if k else f' euler="0 {-lean} 0"')
        inertia = 0.1 * length**2 / 12
        inner = (
            f'<body {place}><joint type="hinge" axis="0 -1 0"/><inertial pos="0 0 {-length / 2}" '
            f'mass="0.1" diaginertia="{inertia} {inertia} 1e-9"/>{inner}</body>'
        )
    return _model(inner, _wall(-0.1, 1), dt, 0.5, 0.2)


def boxes(count: int, dt: float) -> str:
    """Planar boxes, dropped at different angles."""
    text = ""
    for k in range(count):
        turn = 0.4 * 180 * k / count
        text += (
            f'<body pos="{k} 0 0.4" euler="0 {-turn} 0">{_turned(turn)}'
            f'<geom type="box" size=".2 .5 .1" mass="1" contype="1" conaffinity="1"/></body>'
        )
    return _model(text, _FLOOR, dt, 0.2, 0.3)


def _turned(degrees: float) -> str:
    """Slides along the axes of the world of a body that is turned."""
    c, s = cos(degrees * pi / 180), sin(degrees * pi / 180)
    return (
        f'<joint type="slide" axis="{c} 0 {-s}"/><joint type="slide" axis="{s} 0 {c}"/>'
        '<joint type="hinge" axis="0 -1 0"/>'
    )


def boxes_in_space(count: int, dt: float) -> str:
    """Boxes in space side by side above a floor."""
    text = "".join(
        f'<body pos="{k} 0 0.4"><freejoint/><geom type="box" size=".2 .15 .1" mass="1"/></body>'
        for k in range(count)
    )
    return _model(text, _FLOOR, dt, 0.2, 0.3)


def stack(count: int, dt: float) -> str:
    """Blocks in the plane on each other, the upper ones further out."""
    text, place = "", 0.0
    for k in range(count):
        place += 0.9 * 0.4 / (2 * (count - k)) if k else 0.0
        text += (
            f'<body pos="{place} 0 {0.05 + 0.1 * k}">{_PLANAR}'
            f'<geom type="box" size=".2 .5 .05" mass="1"/></body>'
        )
    return _model(text, _FLOOR, dt, 0.0, 0.6)


def discs(count: int, dt: float) -> str:
    """Balls that move and turn in a plane, in a container."""
    columns = max(3, round(count**0.5))
    text = ""
    for k in range(count):
        shift = 0.02 * (k * 7 % 5) / 5
        x, z = 1.11 + 0.23 * (k % columns) + shift, 0.15 + 0.25 * (k // columns)
        text += (
            f'<body pos="{x} 0 {z}">{_PLANAR}<inertial pos="0 0 0" mass="1" '
            f'diaginertia=".005 .005 .005"/><geom type="sphere" size=".1"/></body>'
        )
    walls = _FLOOR + _wall(1.0, 1) + _wall(1.0 + 0.24 * columns, -1)
    return _model(text, walls, dt, 0.2, 0.3)


FAMILIES: dict[str, Callable[[int, float], str]] = {
    "chain, minimal": chain,
    "chain, redundant": chain,
    "boxes": boxes,
    "boxes in space": boxes_in_space,
    "stack": stack,
    "discs, all pairs": discs,
}


def measure(family: str, count: int, steps: int, dt: float) -> tuple[float, float] | None:
    """Mean time of a step [µs] and deepest penetration [m] of the same run, if there is one."""
    if family not in FAMILIES:
        return None
    model = mujoco.MjModel.from_xml_string(FAMILIES[family](count, dt))
    data: Any = mujoco.MjData(model)
    seconds, deepest = [], 0.0
    for k in range(5):
        mujoco.mj_resetData(model, data)
        before = time.perf_counter()
        if k:
            mujoco.mj_step(model, data, steps)
        seconds.append(time.perf_counter() - before)
        for _ in range(0 if k else steps):
            mujoco.mj_step(model, data)
            if data.ncon:
                deepest = min(deepest, float(np.min(data.contact.dist)))
    return median(seconds[1:]) / steps * 1e6, deepest
