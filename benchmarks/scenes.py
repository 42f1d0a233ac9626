"""The scenes that other engines run, too, and what is measured of each run."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import cos, sin, sqrt

import numpy as np

_REPEATS = 5


def clock(run: Callable[[], None]) -> float:
    """Median CPU time of a run in microseconds, after one that is not counted."""
    run()
    samples = []
    for _ in range(_REPEATS):
        start = time.process_time()
        run()
        samples.append(time.process_time() - start)
    return float(np.median(samples) * 1e6)


class BALL:
    """Rotating ball: m, kg, s; apex heights and end of the slipping case are exact."""

    R, mass, mu, height, dt = 0.1, 1.0, 0.2, 1.0, 1e-2
    drop = 0.9
    exact_x = -0.8713


def _exact_x() -> float:
    """x(1.1) of the ball that slips, then rolls: impact, slip with mu g, rolling."""
    g, mu, R, omega = 9.81, BALL.mu, BALL.R, 50.0
    impact = sqrt(2 * BALL.drop / g)
    v = -mu * sqrt(2 * BALL.drop * g)
    slip = R * omega + 3.5 * v
    stop = slip / (3.5 * mu * g)
    x = v * stop - mu * g * stop**2 / 2
    return x + (v - mu * g * stop) * (1.1 - impact - stop)


BALL.exact_x = _exact_x()


class CRANK:
    """Slider-crank of the paper: m, kg, s."""

    l_1, l_2, a, b, d = 0.153, 0.306, 0.05, 0.025, 0.052
    m_1, m_2, m_3, J_1, J_2, J_3 = 0.038, 0.038, 0.076, 7.4e-5, 5.9e-4, 2.7e-6
    mu, e_N, dt = 0.01, 0.4, 1e-4
    phi_3, omega_1, omega_2 = 0.017, 150.0, -75.0


class BOX:
    """Box in space: half lengths, kg."""

    a, b, c, mass, mu, dt = 0.2, 0.15, 0.1, 1.0, 0.3, 2e-3

    @staticmethod
    def thrown() -> tuple[list[float], list[float]]:
        """Position and quaternion, velocity and angular velocity in the body's frame."""
        p = np.array([cos(0.4), 0.6 * sin(0.4), 0.8 * sin(0.4), 0.0])
        p_dot = np.array([0.0, 1.5, -1.0, 2.0])
        p_dot = p_dot - p * (p @ p_dot)
        H = np.array(
            [[-p[1], p[0], p[3], -p[2]], [-p[2], -p[3], p[0], p[1]], [-p[3], p[2], -p[1], p[0]]]
        )
        return [0.0, 0.0, 0.45, *p.tolist()], [0.3, 0.0, 0.0, *(2 * H @ p_dot).tolist()]


@dataclass(frozen=True)
class Run:
    """One scene in one engine: microseconds a step; depth of penetration [m]; what else counts."""

    scene: str
    engine: str
    settings: str
    time: float
    depth: float
    note: str

    @classmethod
    def of_bouncing(cls, engine: str, settings: str, time: float, y: np.ndarray) -> "Run":
        """Ball, case 1: first apex over the drop height, exactly 0.25."""
        turning = np.flatnonzero((y[1:-1] >= y[:-2]) & (y[1:-1] > y[2:])) + 1
        apex = (y[turning[0]] - BALL.R) / BALL.drop if turning.size else 0.0
        note = f"apex {apex:.3f} (0.250), rests {1e3 * (y[-1] - BALL.R):+.3f} mm"
        depth = max(0.0, float(BALL.R - y.min()))
        return cls("ball_bounces", engine, settings, time, depth, note)

    @classmethod
    def of_slipping(cls, engine: str, settings: str, time: float, q: np.ndarray) -> "Run":
        """Ball, case 2: x at t = 1.1."""
        note = f"x(1.1) off by {abs(q[-1, 0] - BALL.exact_x):.1e} m"
        depth = max(0.0, float(BALL.R - q[:, 1].min()))
        return cls("ball_slips", engine, settings, time, depth, note)

    @classmethod
    def of_crank(cls, engine: str, settings: str, time: float, angles: np.ndarray) -> "Run":
        """Slider-crank: deepest corner in a wall."""
        phi_1, phi_2, phi_3 = angles.T
        c = CRANK
        y = c.l_1 * np.sin(phi_1) + c.l_2 * np.sin(phi_2)
        corners = [
            y + x * c.a * np.sin(phi_3) + z * c.b * np.cos(phi_3) for x in (-1, 1) for z in (-1, 1)
        ]
        depth = max(0.0, float(np.max(np.abs(corners)) - c.d / 2))
        note = f"phi_1 {phi_1[-1]:.3f} (13.43)"
        return cls("slider_crank", engine, settings, time, depth, note)

    @classmethod
    def of_box(cls, engine: str, scene: str, settings: str, time: float, q: np.ndarray) -> "Run":
        """Box in space: lowest corner below the floor."""
        w, x, y, z = q[:, 3:7].T
        down = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), w**2 - x**2 - y**2 + z**2])
        half = np.array([BOX.a, BOX.b, BOX.c])
        lowest = q[:, 2] - np.abs(down).T @ half
        return cls(scene, engine, settings, time, max(0.0, float(-lowest.min())), "")
