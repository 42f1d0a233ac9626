"""Located steps over short intervals, from drawn states, beside the motion by events."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from signorini.codegen.frontend.model import Model
from signorini.runtime.errors import RunError, StepError
from signorini.runtime.stepper import Stepper
from signorini.runtime.trajectory import Trajectory
from signorini.verify.draw import Drawer, State
from signorini.verify.event_driven import EventDriven, UndecidedError

_WANTED = 6  # intervals with events
_DRAWS = 60
_STEPS = 8  # of an interval
_TOLERANCES = {2: 1e-3, 3: 1e-6}  # truncation, by the number of stages
_FINE = 1e-8  # of four stages and more
_WISH = 1e-6  # of steps whose sizes a tolerance chooses
MOST = 10.0  # that such steps may err by, in wishes


@dataclass
class Found:
    """Errors of the intervals compared, how many of them held events, and in how many others than
    the motion's impacts were told; errors of steps that a tolerance chose, in its units."""

    errors: list[float] = field(default_factory=list)
    wishes: list[float] = field(default_factory=list)
    eventful: int = 0
    wrong: int = 0


def tolerance(stages: int) -> float:
    """What truncation may leave of an interval, relative to the largest speed."""
    return _TOLERANCES.get(stages, _FINE)


def compare(
    model: Model, stepper: Stepper, seed: int, is_tie: Callable[[Stepper, State], bool]
) -> Found | None:
    """Compare a few intervals; None where the motion by events knows less than the stepper.

    Parameters
    ----------
    model : Model
        The model as the user wrote it.
    stepper : Stepper
        Its stepper with located events.
    seed : int
        Seed of the drawn states.
    is_tie : callable (stepper, state) -> bool
        Whether round-off alone decides what happens at a state; such states are left out.
    """
    m = stepper.manifest
    if m["precision"] != "double" or any(c["law"] == "elliptic" for c in m["contacts"]):
        return None
    drawer = Drawer(stepper, seed)
    found = Found()
    for _ in range(_DRAWS):
        state = drawer.draw()
        one = None if state is None or is_tie(stepper, state) else _interval(model, stepper, state)
        if one is None:
            continue
        error, chosen, events, differs = one
        # intervals without events are compared, too, but few of them
        if events or len(found.errors) - found.eventful < _WANTED // 2:
            found.errors.append(error)
            found.wishes.append(chosen)
            found.eventful += events > 0
            found.wrong += differs
        if found.eventful >= _WANTED:
            break
    return found


def _interval(
    model: Model, stepper: Stepper, state: State
) -> tuple[float, float, int, bool] | None:
    """Error of located steps, and of steps that a tolerance chose, in its units; the events of the
    motion, whether other impacts are told. None where the motion is not decided."""
    t, dt = state.t, state.dt
    motion = EventDriven(model, 0.01 * dt / _STEPS)
    at = (t, state.q, state.v, state.u, list(state.parameters.values()))
    try:
        traj = _run(stepper, state, _STEPS, dt=dt / _STEPS, events="located", max_halvings=0)
        if traj.captured.any():
            return None
        q, v = motion.run(at, t + dt, dt / 4)
        way = dt * _fastest(state, q, v)
        chosen = _run(stepper, state, 1, error=_WISH, scale=way if way > 0 else 1.0)
    except (StepError, RunError, UndecidedError, np.linalg.LinAlgError):
        return None
    speed = _fastest(state, q, v)
    apart = max(
        float(np.max(np.abs(traj.v[-1] - v), initial=0.0)),
        float(np.max(np.abs(traj.q[-1] - q), initial=0.0)) / dt,
    )
    mine = sum(e.kind == "impact" for e in traj.events)
    other = sum(kind == "impact" for _, _, kind in motion.events)
    off = float(np.max(np.abs(chosen.q[-1] - q), initial=0.0)) / (way if way > 0 else 1.0)
    if chosen.captured.any() or chosen.missed:
        off = 0.0  # it says so itself
    return (
        apart / speed if speed > 0 else apart,
        off / _WISH,
        len(motion.events),
        mine != other,
    )


def _fastest(state: State, q: np.ndarray, v: np.ndarray) -> float:
    """The largest velocity at both ends, and on the average."""
    ends = (state.v, v, (q - state.q) / state.dt)
    return max(float(np.max(np.abs(x), initial=0.0)) for x in ends)


def _run(stepper: Stepper, state: State, rows: int, **steps: Any) -> Trajectory:
    """The interval from a drawn state, its inputs held."""
    return stepper.simulate(
        t0=state.t,
        t_end=state.t + state.dt,
        q0=state.q,
        v0=state.v,
        parameters=state.parameters,
        inputs=np.tile(state.u, (rows, 1)) if state.u.size else None,
        tol=0.0,
        **steps,
    )
