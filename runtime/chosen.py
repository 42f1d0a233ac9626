"""A run whose step sizes a tolerance chooses."""

import ctypes
import warnings

import numpy as np
from signorini.runtime.compiled import Compiled
from signorini.runtime.options import RunOptions
from signorini.runtime.run import Run
from signorini.runtime.tolerance import control_of
from signorini.runtime.trajectory import Trajectory

_ROWS = 256  # of the first buffers of a run whose rows are its steps


class ChosenRun(Run):
    """A run of chosen steps: rows are those of a grid, or with ``h = 0`` the steps themselves."""

    def __init__(
        self,
        stepper: Compiled,
        par: dict[str, float],
        options: RunOptions,
        t: float,
        q: np.ndarray,
        v: np.ndarray,
        h: float,
        n_steps: int,
        every: int,
        t_end: float,
    ) -> None:
        self.free = h == 0
        n_steps = _ROWS * every if self.free else n_steps
        super().__init__(stepper, par, options, t, q, v, h, n_steps, every, False)
        self.watched = 0.0
        self.control = control_of(stepper, options, t, t_end)
        self.buffers["estimate"] = np.zeros(self.rows + 1, self.lib.dtype)

    def _chunk(self, u: np.ndarray, done: int, count: int) -> tuple[int, int]:
        lib = self.lib
        record, found = self.record(done)
        row = done // self.every + 1
        estimates = self.buffers["estimate"][row:]
        self.control.estimates = estimates.ctypes.data_as(ctypes.POINTER(lib.real))
        taken = ctypes.c_int(0)
        held = u if self.free else u[done:]
        status = lib.call["simulate_within"](
            self.state, self.work, self.info, self.params, self.options,
            lib.pointer(held) if u.size else None, self.h, count, self.every, record, taken,
            self.control,
        )  # fmt: skip
        self.keep_events(found)
        if self.free:
            self._adapt(done + taken.value)
        return status, taken.value

    def _adapt(self, done: int) -> None:
        """End a free run that has arrived; make room for one that has not."""
        if self.state.t >= self.control.t_end:
            self.n_steps = done
        elif done >= self.n_steps:
            rows = self.rows
            for name, buffer in self.buffers.items():
                more = np.zeros((rows, *buffer.shape[1:]), buffer.dtype)
                self.buffers[name] = np.concatenate([buffer, more])
            self.rows, self.n_steps = 2 * rows, 2 * self.n_steps

    def progress(self, done: int) -> tuple[int, int]:
        """Thousandths of the time."""
        c = self.control
        return round(1000 * (float(self.state.t) - c.t_start) / c.span), 1000

    def trajectory(self, done: int, u: np.ndarray, begin: float) -> Trajectory:
        if self.free and u.size:
            u = np.broadcast_to(u[:1], (max(done, 1), u.shape[1]))
        traj = super().trajectory(done, u, begin)
        c = self.control
        traj.steps = int(c.steps)
        if c.missed:
            warnings.warn(
                f"model '{self.stepper.name}': {c.missed} of {c.steps} steps, the first one before "
                f"t = {c.t_missed:g}, are less exact than error = {self.option_values.error:g} "
                "asks for however small they are; the estimate of each row is in 'estimate'",
                stacklevel=5,
            )
        return traj
