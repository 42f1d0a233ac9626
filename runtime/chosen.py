"""A run whose step sizes a tolerance chooses."""

import ctypes
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError, StepError
from signorini.runtime.options import RunOptions
from signorini.runtime.replay import FailedStep
from signorini.runtime.run import Run
from signorini.runtime.tolerance import control_of
from signorini.runtime.trajectory import Trajectory

_EIGHTHS = 8  # times at which runs of different steps are compared
_MOST_STEPS = 1 << 20
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

    def parts(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The steps of one size that the run is made of, found by taking it again.

        Parameters
        ----------
        u : ndarray, shape (rows or 1, n_u)
            Inputs of its intervals.

        Returns
        -------
        sizes : ndarray, shape (n,)
        ends : ndarray of int, shape (rows + 1,)
            How many there are before the end of each row.
        inputs : ndarray, shape (n, n_u)
        """
        lib, (t, q, v) = self.lib, self.start
        state = self.stepper.c_state(t, q, v)
        c = control_of(self.stepper, self.option_values, t, self.control.t_end)
        used = lib.array(u)
        sizes: list[float] = []
        ends, held = [0], []
        intervals = 0
        while intervals < self.n_steps:
            end = c.t_end if self.free else c.t_start + (intervals + 1) * self.h
            row = used[0 if self.free else intervals]
            while state.t < end:
                lib.call["step_within"](
                    state, self.work, self.info, self.params, self.options,
                    lib.pointer(row) if row.size else None, end, c,
                )  # fmt: skip
                sizes += np.diff([0.0, *c.parts[: c.n_parts]]).tolist()
                held += [u[0 if self.free else intervals]] * c.n_parts
                if self.free:
                    break
            intervals += 1
            if intervals % self.every == 0 or intervals == self.n_steps:
                ends.append(len(sizes))
        return np.array(sizes), np.array(ends), np.array(held).reshape(len(sizes), u.shape[1])

    def failed(self, status: str, u: Any) -> FailedStep:
        """The step that was not solved, of the size that was tried last."""
        step = super().failed(status, u)
        size = float(self.control.h) or float(self.control.span)
        options = {k: x for k, x in step.options.items() if k not in ("error", "scale")}
        return replace(step, h=size, options=options)

    def progress(self, done: int) -> tuple[int, int]:
        """Thousandths of the time."""
        c = self.control
        return round(1000 * (float(self.state.t) - c.t_start) / c.span), 1000

    def trajectory(self, done: int, u: np.ndarray, begin: float) -> Trajectory:
        if self.free and u.size:
            u = np.broadcast_to(u[:1], (max(done, 1), u.shape[1]))
        traj = super().trajectory(done, u, begin)
        c = self.control
        traj.steps, traj.missed = int(c.steps), int(c.missed)
        if c.missed:
            warnings.warn(
                f"model '{self.stepper.name}': {c.missed} of {c.steps} steps, the first one before "
                f"t = {c.t_missed:g}, are less exact than error = {self.option_values.error:g} "
                "asks for however small they are; the estimate of each row is in 'estimate'",
                stacklevel=5,
            )
        return traj


def largest_step(
    stepper: Any,
    t: float,
    t_end: float,
    error: float,
    scale: np.ndarray,
    parameters: dict[str, float],
    options: dict[str, Any],
) -> float:
    """The largest step size of runs as exact as `error` says; see `Stepper.step_size`."""
    if t_end <= t:
        raise RunError(f"t_end = {t_end:g}: give an end after the start t0 = {t:g}")
    order = 2 * stepper.stages - 2
    runs: dict[int, np.ndarray | None] = {}

    def places(n: int) -> np.ndarray | None:
        """Coordinates after every eighth of the time in n steps; None where one is not solved."""
        if n not in runs:
            try:
                traj = stepper.simulate(
                    t0=t, t_end=t_end, dt=(t_end - t) / n, every=n // _EIGHTHS,
                    parameters=parameters, **{"events": "located", **options},
                )  # fmt: skip
                runs[n] = traj.q
            except StepError:
                runs[n] = None
        return runs[n]

    def off(n: int) -> float:
        """Error of n steps, by what twice as many differ by."""
        one, other = places(n), places(2 * n)
        if one is None or other is None:
            return np.inf
        return float(np.max(np.abs(one - other) / scale)) / (1 - 2.0**-order)

    n = _EIGHTHS
    while off(n) > error:
        if n > _MOST_STEPS // 2:
            raise RunError(
                f"error = {error:g}: with {2 * n} steps it is still {off(n):.2g}. The motion "
                "spreads errors, or the wish is below rounding"
            )
        n *= 2
    # in between, where the order says that fewer are enough
    if n > _EIGHTHS and np.isfinite(off(n // 2)):
        fewer = n // 2 * (off(n // 2) / error) ** (1 / order) * 1.05
        fewer = _EIGHTHS * int(np.ceil(fewer / _EIGHTHS))
        if fewer < n and off(fewer) <= error:
            n = fewer
    return (t_end - t) / n
