"""What a variational integrator keeps, and what accuracy costs.

Energy over long times, momentum maps, reversibility, error against computing time, and the order
for six and seven stages in 40 digits.
"""

import time
from collections.abc import Callable
from functools import cache
from statistics import median
from typing import Any

import mpmath as mp
import numpy as np
import sympy as sp
from signorini import Model, Stepper, build
from signorini.codegen.schemes.tableau import lobatto
from signorini.models import slope
from signorini.studies.claims import Claim, near
from signorini.studies.paper import Progress, Study, error, slope_of
from signorini.studies.paper import stepper as paper_stepper


def kepler() -> Model:
    """A planet: rotations are affine in q and leave L unchanged."""
    m = Model("kepler")
    x, y = m.coordinates("x y")
    v_x, v_y = m.velocities
    m.lagrangian = (v_x**2 + v_y**2) / 2 + 1 / sp.sqrt(x**2 + y**2)
    e = sp.Rational(1, 5)
    m.initial_state(q=[1 - e, 0], v=[0, sp.sqrt((1 + e) / (1 - e))])
    return m


@cache
def planet(stages: int) -> Stepper:
    """The compiled planet."""
    return build(kepler(), stages=stages)


def runge_kutta(q: np.ndarray, v: np.ndarray, h: float, n: int, every: int) -> np.ndarray:
    """Energies of the planet along the classical explicit method of order 4."""

    def rate(z: np.ndarray) -> np.ndarray:
        r = (z[0] * z[0] + z[1] * z[1]) ** -1.5
        return np.array([z[2], z[3], -z[0] * r, -z[1] * r])

    z = np.concatenate([q, v])
    energies = []
    for step in range(n + 1):
        if step % every == 0:
            energies.append((z[2] ** 2 + z[3] ** 2) / 2 - 1 / np.hypot(z[0], z[1]))
        k1 = rate(z)
        k2 = rate(z + h / 2 * k1)
        k3 = rate(z + h / 2 * k2)
        k4 = rate(z + h * k3)
        z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return np.array(energies)


def energy(report: Progress = lambda text: None, steps: int = 100_000) -> Study:
    """Energy error over many steps of a smooth system; angular momentum beside it."""
    study = Study("energy")
    h, every = 0.1, max(1, steps // 500)
    for s in (2, 3, 4):
        report(f"energy, s = {s}")
        traj = planet(s).simulate(t_end=steps * h, dt=h, every=every, tol=0)
        drift = np.abs(traj.energy - traj.energy[0])
        momentum = traj["x"] * traj["y_dot"] - traj["y"] * traj["x_dot"]
        study.curves[f"Lobatto, s = {s}"] = {"t": traj.t, "error": drift}
        half = len(drift) // 2
        study.claims += [
            Claim(
                f"energy, s = {s}",
                "error of the second half over that of the first",
                float(drift[half:].max() / drift[:half].max()),
                "<=",
                1.2,
            ),
            Claim(
                f"momentum, s = {s}",
                f"angular momentum kept over {steps} steps, off by",
                float(np.abs(momentum - momentum[0]).max()),
                "<=",
                1e-14 * steps,
            ),
        ]
    report("energy, Runge-Kutta")
    q, v = planet(3).initial_state()[1:]
    energies = runge_kutta(q, v, h, steps, every)
    drift = np.abs(energies - energies[0])
    study.curves["explicit Runge-Kutta, order 4"] = {
        "t": h * every * np.arange(len(drift)),
        "error": drift,
    }
    study.claims.append(
        Claim(
            "energy, explicit Runge-Kutta of order 4",
            "its error over that of s = 3",
            float(drift[-1] / study.curves["Lobatto, s = 3"]["error"].max()),
            ">=",
            10.0,
        )
    )
    return study


def reversibility(report: Progress = lambda text: None, steps: int = 1000) -> Study:
    """Run, turn the velocities round, run again: back at the start, up to round-off."""
    study = Study("reversibility")
    for s in (2, 3, 4, 5):
        report(f"reversibility, s = {s}")
        there = planet(s).simulate(t_end=steps * 0.05, dt=0.05, tol=0)
        back = planet(s).simulate(
            t_end=steps * 0.05, dt=0.05, q0=there.q[-1], v0=-there.v[-1], tol=0
        )
        off = max(
            float(np.abs(back.q[-1] - there.q[0]).max()),
            float(np.abs(back.v[-1] + there.v[0]).max()),
        )
        study.curves[f"s = {s}"] = {"t": there.t, "distance": np.abs(back.q[::-1] - there.q).max(1)}
        study.claims.append(
            Claim(
                f"reversible, s = {s}",
                f"distance to the start after {steps} steps and back",
                off,
                "<=",
                1e-9,
            )
        )
    return study


def work_precision(
    report: Progress = lambda text: None,
    stages: tuple[int, ...] = (2, 3, 4, 5),
    halvings: int = 8,
) -> Study:
    """Error (74) of the slope, case 1, against the time of a run; finer pays with more stages."""
    study = Study("work")
    sizes = 3.2e-3 * 2.0 ** np.arange(halvings)
    reference = paper_stepper("slope", max(stages)).simulate(t_end=1.6384, dt=1e-4, tol=0, every=32)
    for s in stages:
        errors, seconds = [], []
        for dt in sizes:
            report(f"work-precision, s = {s}, dt = {dt:g}")
            runs = []
            for _ in range(5):
                start = time.process_time()
                traj = paper_stepper("slope", s).simulate(t_end=1.6384, dt=dt)
                runs.append(time.process_time() - start)
            errors.append(error(traj, reference, "q"))
            seconds.append(median(runs))
        study.curves[f"s = {s}"] = {"seconds": np.array(seconds), "q": np.array(errors)}
    return study


def second_scheme(report: Progress = lambda text: None, halvings: int = 8) -> Study:
    """Moreau's scheme on the slope, case 1: error (74) and penetration against computing time."""
    study = Study("moreau")
    sizes = 3.2e-3 * 2.0 ** np.arange(halvings)
    reference = paper_stepper("slope", 4).simulate(t_end=1.6384, dt=2e-4, tol=0, every=16)
    steppers = {
        "Moreau": build(slope.model(), scheme="moreau"),
        **{f"Lobatto, s = {s}": paper_stepper("slope", s) for s in (2, 3)},
    }
    for name, stepper in steppers.items():
        errors, seconds, sunk = [], [], []
        for dt in sizes:
            report(f"{name}, dt = {dt:g}")
            runs = []
            for _ in range(5):
                start = time.process_time()
                traj = stepper.simulate(t_end=1.6384, dt=dt)
                runs.append(time.process_time() - start)
            errors.append(error(traj, reference, "q"))
            seconds.append(median(runs))
            sunk.append(max(0.0, -float(traj.g_N.min())))
        study.curves[name] = {
            "seconds": np.array(seconds),
            "q": np.array(errors),
            "penetration": np.array(sunk),
        }
        order = slope_of(sizes, np.array(errors), 3e-12)
        expected = {"Moreau": 1.0, "Lobatto, s = 2": 2.0, "Lobatto, s = 3": 4.0}[name]
        study.claims.append(
            near(f"second scheme, {name}", "order", order, expected, 0.2 * expected)
        )
        if name == "Moreau":
            study.claims.append(
                Claim(
                    f"second scheme, {name}",
                    f"penetration at dt = {sizes[0]:g}",
                    sunk[0],
                    ">=",
                    1e-6,
                    "m",
                )
            )
        else:
            study.claims.append(
                Claim(
                    f"second scheme, {name}",
                    "penetration at any step size",
                    max(sunk),
                    "<=",
                    1e-12,
                    "m",
                )
            )
    return study


def high_orders(report: Progress = lambda text: None, stages: tuple[int, ...] = (5, 6, 7)) -> Study:
    """Orders 2s - 2 of a pendulum in 40 digits, the equations of the scheme written out anew."""
    study = Study("high orders")
    counts = (2, 4, 8)
    with mp.workdps(40):
        exact = pendulum(max(stages) + 1, 32, report)
        for s in stages:
            errors = [float(abs(pendulum(s, n, report) - exact)) for n in counts[::-1]]
            dt = 1.0 / np.array(counts[::-1])
            study.curves[f"s = {s}"] = {"dt": dt, "q": errors}
            order = slope_of(dt, np.array(errors), 0.0)
            study.claims.append(
                near(f"40 digits, s = {s}", "order 2s - 2", order, 2.0 * s - 2, 0.08 * (2 * s - 2))
            )
    return study


def pendulum(s: int, n: int, report: Progress) -> Any:
    """Angle at t = 1 of q'' = -sin q, q(0) = 1, q'(0) = 1/2, by the scheme with s stages.

    V^i = v_n - h sum_j a^_ij sin Q^j with Q^i = q_n + h sum_j a_ij V^j, solved by iteration, which
    contracts for these steps; v_{n+1} = v_n - h sum_j b_j sin Q^j.
    """
    report(f"40 digits, s = {s}, {n} steps")
    table = lobatto(s)
    h = mp.mpf(1) / n
    q, v = mp.mpf(1), mp.mpf(1) / 2
    for _ in range(n):
        V = [v] * s
        for _ in range(400):
            Q = [q + h * mp.fdot(table.a[i], V) for i in range(s)]
            force = [-mp.sin(x) for x in Q]
            new = [v + h * mp.fdot(table.a_hat[i], force) for i in range(s)]
            change = max(abs(x - y) for x, y in zip(new, V, strict=True))
            V = new
            if change < mp.mpf(10) ** -36:
                break
        Q = [q + h * mp.fdot(table.a[i], V) for i in range(s)]
        q, v = Q[-1], v - h * mp.fdot(table.b, [mp.sin(x) for x in Q])
    return q


STUDIES: dict[str, Callable[..., Study]] = {
    "energy": energy,
    "reversibility": reversibility,
    "work": work_precision,
    "moreau": second_scheme,
    "high orders": high_orders,
}
