"""The scenes in MuJoCo: compliant contacts, so the settings are chosen by a sweep."""

from collections.abc import Iterator
from math import log, pi, sqrt
from typing import Any

import mujoco
import numpy as np
from signorini.benchmarks.scenes import BALL, BOX, CRANK, Run, clock

VERSION = mujoco.__version__
# Time constants of contacts in step sizes; two is the least that MuJoCo accepts.
TIME_CONSTANTS = (2, 4, 12)


def damping_ratio(e_N: float) -> float:
    """Damping ratio of a linear spring that returns the share e_N of a speed."""
    return 1.0 if e_N <= 0 else -log(e_N) / sqrt(pi**2 + log(e_N) ** 2)


def _option(dt: float, integrator: str) -> str:
    return (
        f'<option timestep="{dt}" gravity="0 0 -9.81" integrator="{integrator}" cone="elliptic"/>'
    )


def _contact(dt: float, constant: int, e_N: float, mu: float) -> str:
    return (
        f'solref="{constant * dt} {damping_ratio(e_N)}" friction="{mu} 0 0" condim="3" priority="1"'
    )


def ball(dt: float, constant: int, e_N: float, integrator: str) -> Any:
    """Sphere that moves and turns in the plane."""
    contact = _contact(dt, constant, e_N, BALL.mu)
    return mujoco.MjModel.from_xml_string(f"""<mujoco>{_option(dt, integrator)}<worldbody>
      <geom type="plane" size="100 100 1" {contact}/>
      <body pos="0 0 {BALL.height}"><joint type="slide" axis="1 0 0"/>
        <joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 -1 0"/>
        <geom type="sphere" size="{BALL.R}" mass="{BALL.mass}" {contact}/></body>
      </worldbody></mujoco>""")


def slider_crank(dt: float, constant: int, integrator: str) -> Any:
    """A tree of three hinges; corners are small spheres, walls are planes."""
    c = CRANK
    contact = _contact(dt, constant, c.e_N, c.mu)
    r = 1e-3
    corners = "".join(
        f'<geom type="sphere" size="{r}" pos="{x * (c.a - r)} 0 {z * (c.b - r)}" {contact}/>'
        for x in (-1, 1)
        for z in (-1, 1)
    )

    def body(pos: float, m: float, J: float, inner: str, at: float) -> str:
        return (
            f'<body pos="{pos} 0 0"><joint type="hinge" axis="0 -1 0"/>'
            f'<inertial pos="{at} 0 0" mass="{m}" diaginertia="{J} {J} {J}"/>{inner}</body>'
        )

    slider = body(c.l_2, c.m_3, c.J_3, corners, 0.0)
    rod = body(c.l_1, c.m_2, c.J_2, slider, c.l_2 / 2)
    crank = body(0.0, c.m_1, c.J_1, rod, c.l_1 / 2)
    return mujoco.MjModel.from_xml_string(f"""<mujoco>{_option(dt, integrator)}<worldbody>
      <geom type="plane" size="9 9 1" pos="0 0 {-c.d / 2}" {contact}/>
      <geom type="plane" size="9 9 1" pos="0 0 {c.d / 2}" euler="180 0 0" {contact}/>
      {crank}</worldbody></mujoco>""")


def box(dt: float, constant: int, e_N: float, integrator: str) -> Any:
    """A free box above a plane."""
    contact = _contact(dt, constant, e_N, BOX.mu)
    size = f"{BOX.a} {BOX.b} {BOX.c}"
    return mujoco.MjModel.from_xml_string(f"""<mujoco>{_option(dt, integrator)}<worldbody>
      <geom type="plane" size="100 100 1" {contact}/><body><freejoint/>
        <geom type="box" size="{size}" mass="{BOX.mass}" {contact}/></body>
      </worldbody></mujoco>""")


def _run(model: Any, start: Any, steps: int, look: Any) -> tuple[float, np.ndarray]:
    """Median microseconds a step, and what `look` sees after every step."""
    data = mujoco.MjData(model)

    def go() -> None:
        mujoco.mj_resetData(model, data)
        start(data)
        for _ in range(steps):
            mujoco.mj_step(model, data)

    time = clock(go) / steps
    mujoco.mj_resetData(model, data)
    start(data)
    seen = []
    for _ in range(steps):
        mujoco.mj_step(model, data)
        seen.append(look(data))
    return time, np.array(seen)


def runs() -> Iterator[Run]:
    """All scenes with all settings."""
    for integrator in ("Euler", "RK4"):
        for constant in TIME_CONSTANTS:
            settings = f"{integrator}, time constant {constant} dt"

            def ball_start(data: Any, omega: float = 0.0) -> None:
                data.qvel[2] = omega

            def ball_look(data: Any) -> list[float]:
                return [data.qpos[0], BALL.height + data.qpos[1], data.qpos[2]]

            model = ball(BALL.dt, constant, 0.5, integrator)
            time, seen = _run(model, ball_start, 300, ball_look)
            yield Run.of_bouncing("MuJoCo", settings, time, seen[:, 1])
            model = ball(BALL.dt, constant, 0.0, integrator)
            time, seen = _run(model, lambda data: ball_start(data, 50.0), 110, ball_look)
            yield Run.of_slipping("MuJoCo", settings, time, seen)
            time, seen = _run(
                slider_crank(CRANK.dt, constant, integrator), _crank_start, 1466, _crank_look
            )
            yield Run.of_crank("MuJoCo", settings, time, seen)
            for name, start, e_N, steps in (
                ("box_tumbles", _box_thrown, 0.1, 600),
                ("box_rests", _box_flat, 0.0, 300),
            ):
                model = box(BOX.dt, constant, e_N, integrator)
                time, seen = _run(model, start, steps, _box_look)
                yield Run.of_box("MuJoCo", name, settings, time, seen)


def slip(dt: float) -> tuple[float, float]:
    """Error of x(1.1) of the slipping ball [m], microseconds a simulated second."""
    model = ball(dt, TIME_CONSTANTS[0], 0.0, "Euler")

    def start(data: Any) -> None:
        data.qvel[2] = 50.0

    time, seen = _run(model, start, round(1.1 / dt), lambda data: [data.qpos[0]])
    return abs(float(seen[-1, 0]) - BALL.exact_x), time / dt


def _crank_start(data: Any) -> None:
    phi_1, phi_2, phi_3 = 0.0, 0.0, CRANK.phi_3
    data.qpos[:] = [phi_1, phi_2 - phi_1, phi_3 - phi_2]
    data.qvel[:] = [CRANK.omega_1, CRANK.omega_2 - CRANK.omega_1, -CRANK.omega_2]


def _crank_look(data: Any) -> list[float]:
    angles = np.cumsum(data.qpos)
    return [*angles.tolist()]


def _box_thrown(data: Any) -> None:
    q, v = BOX.thrown()
    data.qpos[:], data.qvel[:] = q, v


def _box_flat(data: Any) -> None:
    data.qpos[:] = [0, 0, BOX.c, 1, 0, 0, 0]
    data.qvel[:] = 0


def _box_look(data: Any) -> list[float]:
    return [*data.qpos.tolist()]
