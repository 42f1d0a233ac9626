"""One run: buffers, the loop over chunks of steps in C, the trajectory at the end."""

import ctypes
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from signorini.runtime.arguments import reals
from signorini.runtime.consistency import contradiction, report
from signorini.runtime.errors import InconsistentStartError, RunError, StepError
from signorini.runtime.replay import FailedStep, fields_of
from signorini.runtime.trajectory import Trajectory

if TYPE_CHECKING:
    from signorini.runtime.stepper import Stepper

SUCCESS = 2  # largest status of a solved step
_CHUNK = 4096  # steps between two calls of a progress function
Inputs = Callable[[float, np.ndarray, np.ndarray], Any]


class Run:
    """State, scratch and buffers of one run of a stepper."""

    def __init__(
        self,
        stepper: "Stepper",
        par: dict[str, float],
        options: dict[str, Any],
        t: float,
        q: np.ndarray,
        v: np.ndarray,
        h: float,
        n_steps: int,
        every: int,
        stages: bool,
    ) -> None:
        lib = stepper._library
        self.stepper, self.lib = stepper, lib
        self.par, self.option_values = par, options
        self.h, self.n_steps, self.every = h, n_steps, every
        self.params = stepper._params(par)
        self.options = stepper._options(**options)
        self.state = lib.structs["state"]()
        self.work = lib.structs["work"]()
        self.info = lib.structs["info"]()
        n, s = stepper.sizes, stepper.stages
        rows = n_steps // every
        self.rows = rows
        self.buffers = {
            "t": lib.array(np.zeros(rows + 1)),
            "q": lib.array(np.zeros((rows + 1, n["n_q"]))),
            "v": lib.array(np.zeros((rows + 1, n["n_q"]))),
            "P": lib.array(np.zeros((rows + 1, n["n_R"]))),
            "residual": lib.array(np.zeros(rows + 1)),
            "smallest_gap": lib.array(np.full(rows + 1, np.inf)),
            "counts": np.zeros((rows + 1, 6), dtype=np.intc),
        }
        self.nothing = lib.array(np.zeros(1))
        if stages:
            self.buffers |= {
                "stage_t": lib.array(np.zeros((rows, s))),
                "stage_q": lib.array(np.zeros((rows, s, n["n_q"]))),
                "stage_v": lib.array(np.zeros((rows, s, n["n_q"]))),
                "stage_R": lib.array(np.zeros((rows, s, n["n_R"]))),
            }
        q_array, v_array = lib.array(q), lib.array(v)
        status = lib.call["init"](
            self.state, self.params, self.options, t, lib.pointer(q_array), lib.pointer(v_array)
        )
        name = lib.statuses[status]
        if name == "INCONSISTENT_START":
            raise InconsistentStartError(report(stepper, t, q, v, par))
        if status > SUCCESS:
            raise RunError(
                f"model '{stepper.name}' cannot start at t = {t:g}, q = {q.tolist()}, "
                f"v = {v.tolist()}: {lib.status_texts[status]}"
            )
        self.buffers["t"][0] = t
        self.buffers["q"][0] = q
        self.buffers["v"][0] = v

    def go(
        self,
        u: np.ndarray,
        asked: Inputs | None,
        progress: Callable[[int, int], None] | None,
    ) -> Trajectory:
        used = self.lib.array(u)
        begin = time.perf_counter()
        done = 0
        status = 0
        try:
            while done < self.n_steps and status <= SUCCESS:
                count = 1 if asked else min(_CHUNK, self.n_steps - done)
                # A chunk ends on a recorded row, so that rows are counted from its start.
                if not asked and count < self.n_steps - done:
                    count = max(self.every, count - count % self.every)
                if asked:
                    used[done] = self._ask(asked)
                status, taken = self._chunk(used, done, count)
                done += taken
                if progress is not None:
                    progress(done, self.n_steps)
        except KeyboardInterrupt as error:
            error.trajectory = self._trajectory(done, used, begin)  # type: ignore[attr-defined]
            raise
        trajectory = self._trajectory(done, used, begin)
        if status > SUCCESS:
            t = float(self.state.t)
            name = self.lib.statuses[status]
            q, v = np.array(self.state.q, dtype=float), np.array(self.state.v, dtype=float)
            cause = contradiction(self.stepper, t + self.h, q + self.h * v, v, self.par)
            raise StepError(
                f"model '{self.stepper.name}', step {done + 1} of {self.n_steps} at t = {t:g}: "
                f"{name}, {self.lib.status_texts[status]}{cause and '; ' + cause}. The steps "
                "before are in the error's attribute 'trajectory'",
                name,
                trajectory,
                self._failed(name, used[done] if used.size else []),
            )
        return trajectory

    def _failed(self, status: str, u: Any) -> FailedStep:
        m = self.stepper.manifest
        return FailedStep(
            **{key: m[key] for key in ("model", "model_hash", "scheme", "precision", "stages")},
            state=fields_of(self.state),
            u=[float(x) for x in u],
            parameters=dict(self.par),
            options={k: v for k, v in self.option_values.items() if v is not None},
            h=self.h,
            status=status,
            about={},
        )

    def _ask(self, asked: Inputs) -> np.ndarray:
        q, v = np.array(self.state.q, dtype=float), np.array(self.state.v, dtype=float)
        n_u = self.stepper.sizes["n_u"]
        u = reals("inputs(t, q, v)", asked(float(self.state.t), q, v)).reshape(-1)
        if u.shape != (n_u,) or not np.all(np.isfinite(u)):
            raise RunError(
                f"inputs(t, q, v) returned {u.tolist()} at t = {float(self.state.t):g}: "
                f"return {n_u} finite numbers"
            )
        return u

    def _chunk(self, u: np.ndarray, done: int, count: int) -> tuple[int, int]:
        lib = self.lib
        record = lib.structs["record"]()
        # With feedback one step at a time is taken; it is recorded if its turn has come.
        every = 1 if count < self.every else self.every
        wanted = count >= self.every or (done + count) % self.every == 0
        if wanted:
            row = (done + count) // self.every if count < self.every else done // self.every + 1
            for name, buffer in self.buffers.items():
                first = row - 1 if name.startswith("stage_") else row
                if first < len(buffer):
                    kind = ctypes.c_int if name == "counts" else lib.real
                    # An empty array has no address to rely on; nothing is written through it.
                    rows = buffer[first:] if buffer.size else self.nothing
                    setattr(record, name, rows.ctypes.data_as(ctypes.POINTER(kind)))
        taken = ctypes.c_int(0)
        status = lib.call["simulate"](
            self.state,
            self.work,
            self.info,
            self.params,
            self.options,
            lib.pointer(u[done:]) if u.size else None,
            self.h,
            count,
            every,
            record if wanted else None,
            taken,
        )
        return status, taken.value

    def _trajectory(self, done: int, u: np.ndarray, begin: float) -> Trajectory:
        rows = done // self.every
        names = {"stage_t": "t_stage", "stage_q": "Q", "stage_v": "V", "stage_R": "R"}
        arrays = {}
        for name, buffer in self.buffers.items():
            kept = buffer[: rows if name in names else rows + 1]
            arrays[names.get(name, name)] = kept if name == "counts" else kept.astype(float)
        # Inputs of row k: those held from t[k] on; the last row repeats the last step's.
        if self.n_steps and u.size:
            index = np.minimum(np.arange(rows + 1) * self.every, max(done - 1, 0))
            arrays["u"] = u[index].astype(float)
        else:
            arrays["u"] = np.zeros((rows + 1, self.stepper.sizes["n_u"]))
        return Trajectory(
            self.stepper,
            arrays,
            parameters=self.par,
            options={k: v for k, v in self.option_values.items() if v is not None},
            seconds=time.perf_counter() - begin,
        )
