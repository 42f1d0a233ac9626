"""One run: buffers, the loop over chunks of steps in C, the trajectory at the end."""

import ctypes
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from signorini.runtime.arguments import reals
from signorini.runtime.compiled import Compiled, Inputs
from signorini.runtime.consistency import contradiction, report
from signorini.runtime.controller import Controller
from signorini.runtime.diagnosis import (
    check_coefficients,
    check_mass,
    first_nonfinite,
    wrong_coefficient,
)
from signorini.runtime.errors import InconsistentStartError, RunError, StepError
from signorini.runtime.event import Event
from signorini.runtime.export import COUNTS
from signorini.runtime.library import SUCCESS
from signorini.runtime.memory import check_memory
from signorini.runtime.options import RunOptions
from signorini.runtime.replay import FailedStep, fields_of
from signorini.runtime.stability import Watch
from signorini.runtime.trajectory import Trajectory

_CHUNK = 4096  # steps between two calls of a progress function
_EVENTS = 200_000  # most events that one call has room for


def events_of_step(stepper: Compiled, options: RunOptions) -> int:
    """Most events that one step can report."""
    n = stepper.sizes
    located = options.events == "located" and n["n_events"] > 0
    # what is left of a step that ran out of events is captured: one more for each contact
    return n["n_contacts"] + n["n_events"] if located else n["n_contacts"]


def event_of(stepper: Compiled, event: Any) -> Event:
    """An event of C by the user's names."""
    m = stepper.manifest
    contact = m["contacts"][event.contact]
    return Event(
        float(event.t),
        contact["name"],
        m["event_kinds"][event.kind].lower(),
        float(event.P_N),
        tuple(float(x) for x in event.P_F[: contact["components"]]),
        float(event.energy),
    )


class Run:
    """State, scratch and buffers of one run of a stepper."""

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
        stages: bool,
    ) -> None:
        lib = stepper.library
        self.stepper, self.lib = stepper, lib
        self.par, self.option_values = par, options
        self.h, self.n_steps, self.every = h, n_steps, every
        self.watched = h  # the step whose stability is looked at
        self.params = stepper.c_params(par)
        self.options = stepper.c_options(options)
        self.state = lib.structs["state"]()
        self.work = lib.structs["work"]()
        self.info = lib.structs["info"]()
        n, s = stepper.sizes, stepper.stages
        rows = -(-n_steps // every)
        self.rows = rows
        shapes: dict[str, tuple[int, ...]] = {
            "t": (),
            "q": (n["n_q"],),
            "v": (n["n_q"],),
            "P": (n["n_R"],),
            "residual": (),
            "smallest_gap": (),
            "counts": (len(COUNTS),),
            "contact": (n["n_contacts"],),
        }
        if every > 1:
            shapes["energy"] = (2,)
        if stages:
            shapes |= {
                "stage_t": (s,),
                "stage_q": (s, n["n_q"]),
                "stage_v": (s, n["n_q"]),
                "stage_R": (s, n["n_R"]),
            }
        check_memory(rows, shapes.values(), np.dtype(lib.dtype).itemsize, every)
        self.buffers = {
            name: np.zeros(
                (rows if name.startswith("stage_") else rows + 1, *shape),
                np.intc if name in ("counts", "contact") else lib.dtype,
            )
            for name, shape in shapes.items()
        }
        self.buffers["contact"][0] = -1
        self.nothing = lib.array(np.zeros(1))
        self.events: list[Event] = []
        room = max(events_of_step(stepper, options), 1)
        self.chunk = max(1, min(_CHUNK, _EVENTS // room))
        self.event_array = (lib.structs["event"] * (self.chunk * room))()
        check_coefficients(stepper, t, q, v, par)
        check_mass(stepper, t, q, v, par)
        q_array, v_array = lib.array(q), lib.array(v)
        status = lib.call["init"](
            self.state, self.params, self.options, t, lib.pointer(q_array), lib.pointer(v_array)
        )
        name = lib.statuses[status]
        if name == "INCONSISTENT_START":
            raise InconsistentStartError(report(stepper, t, q, v, par))
        if status > SUCCESS and name != "NONFINITE":
            raise RunError(
                f"model '{stepper.name}' cannot start at t = {t:g}, q = {q.tolist()}, "
                f"v = {v.tolist()}: {lib.status_texts[status]}"
            )
        self.buffers["t"][0] = t
        self.buffers["q"][0] = q
        self.buffers["v"][0] = v
        self.buffers["smallest_gap"][0] = np.inf
        self.start = (t, q, v)
        self.memory: np.ndarray | None = None

    def controlled(self, asked: Inputs) -> None:
        """Let C ask for the inputs, if it can."""
        if isinstance(asked, Controller):
            n = self.stepper.sizes
            self.memory, self.control = asked.memory.copy(), asked.address
            self.widths = self.lib.widths(
                n["n_q"], n["n_u"], n["n_R"], n["n_contacts"], self.stepper.stages, len(COUNTS)
            )

    def progress(self, done: int) -> tuple[int, int]:
        """What is done, and of how much."""
        return done, self.n_steps

    def look_at_start(self, u: np.ndarray) -> None:
        """Raise if a function or derivative that the steps use is no number at the start.

        Raises
        ------
        StepError
            With the status NONFINITE and a trajectory of the start alone.
        """
        t, q, v = self.start
        begin = time.perf_counter()
        cause = first_nonfinite(self.stepper, t, q, v, u, self.par)
        if cause:
            raise StepError(
                f"model '{self.stepper.name}' cannot start at t = {t:g}: NONFINITE, {cause}",
                "NONFINITE",
                self.trajectory(0, u.reshape(1, -1), begin),
                self.failed("NONFINITE", u),
            )

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
        explicit = bool(used.size) or asked is not None
        watch = Watch(self.stepper, self.par, self.watched, explicit=explicit)
        try:
            if self.n_steps:
                if asked:
                    used[0] = self._ask(asked)
                    self.controlled(asked)
                self.look_at_start(used[0])
            watch.look_at_start(*self.start)
            while done < self.n_steps and status <= SUCCESS:
                in_c = asked is None or self.memory is not None
                count = min(self.chunk, self.n_steps - done) if in_c else 1
                if asked and done and not in_c:
                    used[done] = self._ask(asked)
                status, taken = self._chunk(used, done, count)
                done += taken
                watch.look(self.state, done)
                if progress is not None:
                    progress(*self.progress(done))
        except (Exception, KeyboardInterrupt) as error:
            # a controller that raises, an interruption: what was done is kept
            if not isinstance(error, StepError):
                kept = self.trajectory(done, used, begin)
                error.trajectory = kept  # type: ignore[union-attr]
            raise
        trajectory = self.trajectory(done, used, begin)
        if status > SUCCESS:
            raise self._error(
                status,
                done,
                used[min(done, len(used) - 1)] if used.size else used.ravel(),
                trajectory,
                watch,
            )
        return trajectory

    def _error(
        self, status: int, done: int, u: np.ndarray, trajectory: Trajectory, watch: Watch
    ) -> StepError:
        t = float(self.state.t)
        name = self.lib.statuses[status]
        q, v = self.lib.kept(self.state.q), self.lib.kept(self.state.v)
        causes = [contradiction(self.stepper, t + self.h, q + self.h * v, v, self.par)]
        if name == "BAD_ARGUMENT":
            causes.append(wrong_coefficient(self.stepper, t, q, v, u, self.par))
        if name == "NONFINITE":
            for part in (0.0, 0.5, 1.0):
                at = (t + part * self.h, q + part * self.h * v, v)
                causes.append(first_nonfinite(self.stepper, *at, u, self.par))
                if causes[-1]:
                    break
        if name in ("NOT_CONVERGED", "NONFINITE"):
            causes.append(watch.hint(t, q, v, u))
        cause = "".join(f"; {text}" for text in causes if text)
        return StepError(
            f"model '{self.stepper.name}', step {done + 1} of {self.n_steps} at t = {t:g}: "
            f"{name}, {self.lib.status_texts[status]}{self._where()}{cause}. The steps before are "
            "in the error's attribute 'trajectory'",
            name,
            trajectory,
            self.failed(name, u),
        )

    def _where(self) -> str:
        """The part that was not solved, in a model that falls into several."""
        parts = self.stepper.manifest["parts"]
        failed = int(self.info.failed) if len(parts) > 1 else -1
        return f" in the part '{parts[failed]['name']}'" if failed >= 0 else ""

    def failed(self, status: str, u: Any) -> FailedStep:
        m = self.stepper.manifest
        return FailedStep(
            **{key: m[key] for key in ("model", "model_hash", "scheme", "precision", "stages")},
            state=fields_of(self.state),
            u=[float(x) for x in u],
            parameters=dict(self.par),
            options=self.option_values.given(),
            h=self.h,
            status=status,
            about={},
        )

    def _ask(self, asked: Inputs) -> np.ndarray:
        q, v = self.lib.kept(self.state.q), self.lib.kept(self.state.v)
        n_u = self.stepper.sizes["n_u"]
        u = reals("inputs(t, q, v)", asked(float(self.state.t), q, v)).reshape(-1)
        if u.shape != (n_u,) or not np.all(np.isfinite(u)):
            raise RunError(
                f"inputs(t, q, v) returned {u.tolist()} at t = {float(self.state.t):g}: "
                f"return {n_u} finite numbers"
            )
        return u

    def record(self, done: int) -> tuple[Any, Any]:
        """The buffers from the row behind `done` steps on as C takes them, a count of events."""
        lib = self.lib
        record = lib.structs["record"]()
        row = done // self.every + 1
        for name, buffer in self.buffers.items():
            if not hasattr(record, name):
                continue
            first = row - 1 if name.startswith("stage_") else row
            kind = ctypes.c_int if buffer.dtype == np.intc else lib.real
            # An empty array has no address to rely on; nothing is written through it.
            rows = buffer[first:] if buffer[first:].size else self.nothing
            setattr(record, name, rows.ctypes.data_as(ctypes.POINTER(kind)))
        found = ctypes.c_int(0)
        if self.stepper.sizes["n_contacts"]:
            record.events = self.event_array
            record.n_events = ctypes.pointer(found)
            record.max_events = len(self.event_array)
        record.begun = done % self.every
        return record, found

    def keep_events(self, found: Any) -> None:
        """Take over the events that C has noted."""
        self.events += [event_of(self.stepper, self.event_array[k]) for k in range(found.value)]

    def _chunk(self, u: np.ndarray, done: int, count: int) -> tuple[int, int]:
        lib = self.lib
        record, found = self.record(done)
        taken = ctypes.c_int(0)
        structs = self.state, self.work, self.info, self.params, self.options
        if self.memory is not None:
            status = lib.simulate_controlled(
                *structs, self.control, lib.pointer(self.memory), lib.pointer(u[done:]), self.h,
                count, self.every, record, self.widths, taken,
            )  # fmt: skip
        else:
            inputs = lib.pointer(u[done:]) if u.size else None
            status = lib.call["simulate"](
                *structs, inputs, self.h, count, self.every, record, taken
            )
        self.keep_events(found)
        return status, taken.value

    def trajectory(self, done: int, u: np.ndarray, begin: float) -> Trajectory:
        rows = -(-done // self.every)
        names = {
            "stage_t": "t_stage", "stage_q": "Q", "stage_v": "V", "stage_R": "R",
            "energy": "energy_range",
        }  # fmt: skip
        arrays = {}
        for name, buffer in self.buffers.items():
            kept = buffer[: rows if name.startswith("stage_") else rows + 1]
            integers = name in ("counts", "contact")
            arrays[names.get(name, name)] = (
                kept if integers else kept.astype(self.lib.wide, copy=False)
            )
        gaps = arrays["smallest_gap"]
        gaps[gaps >= self.lib.largest] = np.inf
        if "energy_range" in arrays:
            start = self.stepper.evaluate("energy", *self.start, parameters=self.par)
            arrays["energy_range"][0] = start
        # Inputs of row k: those held from t[k] on; the last row repeats the last step's.
        if self.n_steps and u.size:
            index = np.minimum(np.arange(rows + 1) * self.every, max(done - 1, 0))
            arrays["u"] = u[index].astype(self.lib.wide)
        else:
            arrays["u"] = np.zeros((rows + 1, self.stepper.sizes["n_u"]))
        return Trajectory(
            self.stepper,
            arrays,
            parameters=self.par,
            options=self.option_values.given(),
            seconds=time.perf_counter() - begin,
            steps=done,
            events=self.events,
        )
