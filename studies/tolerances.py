"""Tolerances: how exact runs are that were asked to be, what it costs, what energy does."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from signorini import Model, Stepper, Trajectory, build
from signorini.locate import find_model
from signorini.models import bouncing_ball
from signorini.studies.claims import Claim
from signorini.studies.invariants import kepler
from signorini.studies.paper import Progress, Study

# Shipped models and times in which their motion does not spread errors [s].
SCENES = {
    "bouncing_ball": 2.0, "slope": 2.2, "rocking_block": 1.0, "conveyor_oscillator": 10.5,
    "pendulum_with_wall": 1.5, "andrews_squeezer": 0.03, "four_bar": 1.0, "coin": 0.5,
    "hopper": 0.6, "bead_on_hoop": 2.0,
}  # fmt: skip
WISHES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
# Steps of an integrator with error control for compliant contact (CENIC, Drake 1.51) for the ball
# that slips, with an error of 7e-3 m.
CENIC_STEPS = 697
_PERIOD = 2 * np.pi  # of the planet


@cache
def stepper(make: Callable[[], Model], stages: int) -> Stepper:
    """A stepper whose steps a tolerance can choose."""
    return build(make(), stages=stages, events="located")


def wishes(
    report: Progress = lambda text: None,
    scenes: dict[str, float] = SCENES,
    asked: tuple[float, ...] = WISHES,
    stages: tuple[int, ...] = (2, 3, 4),
    steps: int = 100_000,
) -> Study:
    """Errors against wishes, work against errors, energy with chosen and with equal steps."""
    study = Study("tolerances")
    for name, t_end in scenes.items():
        report(f"tolerances, {name}")
        _wishes(study, name, t_end, asked, stages)
    report("tolerances, ball that slips")
    _ball(study)
    report("tolerances, work")
    _work(study, asked)
    report("tolerances, energy")
    _energy(study, steps)
    return study


def _wishes(
    study: Study, name: str, t_end: float, asked: tuple[float, ...], stages: tuple[int, ...]
) -> None:
    exact = _built(name, 5).simulate(t_end=t_end, error=1e-11)
    for s in stages:
        # two stages take ever so many steps for the smallest
        own = [e for e in asked if s > 2 or e >= 1e-7]
        runs = [_built(name, s).simulate(t_end=t_end, error=e) for e in own]
        errors = [float(np.max(np.abs(r.q[-1] - exact.q[-1]))) for r in runs]
        study.curves[f"{name}, s = {s}"] = {
            "wish": own, "error": errors, "steps": [r.steps for r in runs],
            "iterations": [int(r.iterations.sum()) for r in runs],
        }  # fmt: skip
        worst = max(a / b for a, b in zip(errors, own, strict=True))
        study.claims.append(
            Claim("tolerances", f"{name}, s = {s}: largest error in wishes", worst, "<=", 10.0)
        )


@cache
def _built(name: str, stages: int) -> Stepper:
    return build(find_model(name), stages=stages, events="located")


def _ball(study: Study) -> None:
    """The ball that slips, then rolls: its end is known."""
    made = stepper(bouncing_ball.model, 3)
    start: dict[str, Any] = {"v0": {"phi": 50.0}, "parameters": {"e_N": 0.0}}
    traj = made.simulate(t_end=1.1, error=1e-6, **start)
    fall = np.sqrt(2 * 0.9 / 9.81)
    v = -0.2 * np.sqrt(2 * 0.9 * 9.81)
    stop = (5.0 + 3.5 * v) / (3.5 * 0.2 * 9.81)
    x = v * stop - 0.2 * 9.81 * stop**2 / 2
    x += (v - 0.2 * 9.81 * stop) * (1.1 - fall - stop)
    study.claims += [
        Claim("tolerances", "slipping ball, error 1e-6: steps", traj.steps, "<=", CENIC_STEPS),
        Claim("tolerances", "... error of x", abs(float(traj.q[-1, 0]) - x), "<=", 1e-6, "m"),
    ]


def _planet(t: float, z: np.ndarray) -> np.ndarray:
    r = (z[0] * z[0] + z[1] * z[1]) ** -1.5
    return np.array([z[2], z[3], -z[0] * r, -z[1] * r])


def _work(study: Study, asked: tuple[float, ...]) -> None:
    """A planet over three periods, beside SciPy's solvers: evaluations of the forces."""
    t_end = 3 * _PERIOD
    for s in (2, 3, 4, 5):
        made = stepper(kepler, s)
        _, q, _ = made.initial_state()
        errors, work = [], []
        for e in (e for e in asked if s > 2 or e >= 1e-6):
            traj = made.simulate(t_end=t_end, error=e)
            errors.append(float(np.max(np.abs(traj.q[-1] - q))))
            work.append(s * int(traj.iterations.sum()))
        study.curves[f"planet, s = {s}"] = {"error": errors, "evaluations": work}
    try:
        from scipy.integrate import solve_ivp
    except ImportError:
        return
    _, q, v = stepper(kepler, 3).initial_state()
    for method in ("RK45", "DOP853", "Radau"):
        errors, work = [], []
        for e in asked:
            done = solve_ivp(
                _planet, (0.0, t_end), np.concatenate([q, v]), method=method, rtol=e, atol=e
            )
            errors.append(float(np.max(np.abs(done.y[:2, -1] - q))))
            work.append(int(done.nfev))
        study.curves[f"planet, {method}"] = {"error": errors, "evaluations": work}


def _energy(study: Study, steps: int) -> None:
    """The planet for long: chosen steps lose what equal ones keep."""
    made = stepper(kepler, 3)
    orbit = made.simulate(t_end=_PERIOD, error=1e-3)
    orbits = max(2, round(steps / orbit.steps))
    t_end = orbits * _PERIOD
    chosen = made.simulate(t_end=t_end, error=1e-3 * orbits**2)
    dt = made.step_size(t_end=_PERIOD, error=1e-3)
    n = round(_PERIOD / dt) * orbits
    equal = made.simulate(t_end=t_end, dt=t_end / n, every=max(1, n // 2000))
    for name, traj in (("chosen", chosen), ("equal", equal)):
        drift = traj.energy / traj.energy[0] - 1
        keep = slice(None, None, max(1, len(drift) // 2000))
        study.curves[f"energy, {name}"] = {"t": traj.t[keep] / _PERIOD, "energy": drift[keep]}
    first, last = (_spread(equal, half) for half in (0, 1))
    study.claims += [
        Claim("tolerances", f"planet, {chosen.steps} chosen steps: energy changes by",
              float(abs(chosen.energy[-1] / chosen.energy[0] - 1)), "<=", 1.0),
        Claim("tolerances", f"planet, {n} equal steps: energy error, second half over first",
              last / first, "<=", 1.1),
    ]  # fmt: skip


def _spread(traj: Trajectory, half: int) -> float:
    middle = len(traj.t) // 2
    part = traj.energy[:middle] if half == 0 else traj.energy[middle:]
    return float(np.max(np.abs(part / traj.energy[0] - 1)))


STUDIES: dict[str, Callable[..., Study]] = {"tolerances": wishes}
