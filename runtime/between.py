"""States of a run between its rows: the step from the row before, taken up to there."""

import math
from typing import Any

import numpy as np
from signorini.runtime.arguments import reals
from signorini.runtime.errors import RunError
from signorini.runtime.library import SUCCESS
from signorini.runtime.options import RunOptions
from signorini.runtime.tolerance import control_of


def between(traj: Any, t: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return (q, v) of a trajectory at any times of its run; see `Trajectory.__call__`."""
    times = reals("t", t)
    flat = times.reshape(-1)
    first, last = float(traj.t[0]), float(traj.t[-1])
    if not np.all((flat >= first) & (flat <= last)):
        wrong = flat[~((flat >= first) & (flat <= last))][0]
        raise RunError(f"t = {wrong:g} is outside the run, which goes from {first:g} to {last:g}")
    walker = _Walker(traj)
    n = traj.q.shape[1]
    q, v = np.empty((flat.size, n)), np.empty((flat.size, n))
    for k, time in enumerate(flat):
        q[k], v[k] = walker.at(float(time))
    return q.reshape(*times.shape, n), v.reshape(*times.shape, n)


class _Walker:
    """Goes from rows of a trajectory to times behind them."""

    def __init__(self, traj: Any) -> None:
        self.traj = traj
        options = RunOptions.of(traj.options, chosen=True)
        self.stepper = stepper = traj.stepper.fitting(options)
        self.lib = stepper.library
        self.params = stepper.c_params(traj.parameters)
        self.options = stepper.c_options(options)
        self.work, self.info = self.lib.structs["work"](), self.lib.structs["info"]()
        self.control = None
        if options.error is not None:
            self.control = control_of(stepper, options, float(traj.t[0]), float(traj.t[-1]))
        rows = max(len(traj.t) - 1, 1)
        self.h = (traj.t[-1] - traj.t[0]) / max(traj.steps, 1)
        self.every = math.ceil(traj.steps / rows)

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        traj = self.traj
        row = int(np.searchsorted(traj.t, time, side="right")) - 1
        t = float(traj.t[row])
        state = self.stepper.c_state(t, traj.q[row], traj.v[row])
        u = self.lib.array(traj.u[row])
        if self.control is not None:
            self._advance(state, u, time)
            return self.lib.kept(state.q), self.lib.kept(state.v)
        whole = 0 if self.every == 1 else int((time - t) / self.h * (1 + 1e-12))
        for h in (*(self.h,) * whole, time - t - whole * self.h):
            if h > 1e-14 * max(abs(time), self.h):
                self._step(state, u, h)
        return self.lib.kept(state.q), self.lib.kept(state.v)

    def _advance(self, state: Any, u: np.ndarray, time: float) -> None:
        """As exact as the run is."""
        if time <= float(state.t):
            return
        status = self.lib.call["advance_to"](
            state, self.work, self.info, self.params, self.options,
            self.lib.pointer(u) if u.size else None, time, self.control,
        )  # fmt: skip
        self._check(state, status)

    def _step(self, state: Any, u: np.ndarray, h: float) -> None:
        pointer = self.lib.pointer(u) if u.size else None
        status = self.lib.call["step"](
            state, self.work, self.info, self.params, self.options, pointer, h
        )
        self._check(state, status)

    def _check(self, state: Any, status: int) -> None:
        if status > SUCCESS:
            raise RunError(
                f"model '{self.traj.model}': no state is found behind t = {float(state.t):g}, "
                f"{self.lib.status_texts[status]}"
            )
