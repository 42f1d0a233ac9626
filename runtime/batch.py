"""Many runs at once: arguments of shape (n, ...), threads in C, one result for all."""

import ctypes
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from signorini.runtime.arguments import reals
from signorini.runtime.chosen import ChosenRun
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError
from signorini.runtime.event import Event
from signorini.runtime.export import COUNTS
from signorini.runtime.memory import check_memory
from signorini.runtime.options import RunOptions
from signorini.runtime.run import Run
from signorini.runtime.threads import drive, number_of_threads
from signorini.runtime.tolerance import control_of
from signorini.runtime.trajectory import Trajectory

_FLOATS = ("t", "q", "v", "P", "residual", "smallest_gap", "energy_range")
_NAMES = {"energy": "energy_range"}
_BLOCK = 64  # runs of each thread between two calls of a progress function


@dataclass(frozen=True, eq=False)
class Batch:
    """Recorded steps of n runs. Row k of a run belongs to ``t[i, k]``, row 0 to its start.

    Rows that a run did not reach hold NaN, their counts -1. An interruption raises
    `KeyboardInterrupt` with the batch so far in its attribute ``batch``.

    Attributes
    ----------
    t : ndarray, shape (n, n_t)
        Times [s].
    q, v : ndarray, shape (n, n_t, n_q)
        Coordinates and velocities.
    P : ndarray, shape (n, n_t, n_R)
        Percussions of the steps up to ``t``, from the row before: g, gamma, N, F in turn.
    residual, smallest_gap : ndarray, shape (n, n_t)
        Largest scaled residual, smallest gap at any stage of the step.
    energy_range : ndarray, shape (n, n_t, 2)
        Smallest and largest energy at the ends of the steps that a row stands for [J].
    counts : ndarray of int, shape (n, n_t, 7)
        status, iterations, substeps, rescues, percussions, lost_impacts, impacts of the steps that
        a row stands for.
    contact : ndarray of int, shape (n, n_t, n_contacts)
        States of the contacts, by the manifest's ``contact_states``; -1 is unknown.
    u : ndarray, shape (n or 1, n_steps, n_u)
        Inputs; one row of runs if all share them.
    steps : ndarray of int, shape (n,)
        Steps done.
    status : list of str, n
        Worst status of each run: OK, or what ended it.
    parameters : dict from name to ndarray, shape (n,)
        All parameters of every run.
    every : int
        Every how many steps a row was recorded.
    bytes_per_run : int
        Memory of the result of one run; each thread needs `bytes_per_thread` besides.
    estimate : ndarray, shape (n, n_t)
        Of runs with ``error=...``: estimated errors of all steps so far, in units of the scale.
    missed : ndarray of int, shape (n,)
        Of such runs: steps less exact than asked for, however small they were.
    dq, dv, doutputs : dict from name to ndarray, shapes (n, n_t, n_q | n_outputs, ...)
        Derivatives of runs with ``derivatives="forward"``.
    gradient : Gradient
        Gradients of runs with ``derivatives="adjoint"``: ``batch.gradient(q_bar, v_bar)``.
    differentiable : list of True or list of NotDifferentiable
        Of such runs, one by one: whether all events have a derivative, or those that have none.
    """

    stepper: Compiled
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    P: np.ndarray
    residual: np.ndarray
    smallest_gap: np.ndarray
    energy_range: np.ndarray
    counts: np.ndarray
    contact: np.ndarray
    u: np.ndarray
    steps: np.ndarray
    status: list[str]
    parameters: dict[str, np.ndarray]
    options: dict[str, Any]
    every: int
    h: float
    bytes_per_run: int
    bytes_per_thread: int
    estimate: np.ndarray | None = None
    missed: np.ndarray | None = None
    dq: dict[str, np.ndarray] = field(default_factory=dict)
    dv: dict[str, np.ndarray] = field(default_factory=dict)
    doutputs: dict[str, np.ndarray] = field(default_factory=dict)
    gradient: Callable[..., dict[str, Any]] | None = None
    differentiable: list[Any] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"Batch('{self.stepper.name}', {len(self)} runs, {int(self.ok.sum())} to their end)"

    @property
    def ok(self) -> np.ndarray:
        """Which runs reached their end."""
        return np.array([name.startswith("OK") for name in self.status], dtype=bool)

    def trajectory(self, k: int) -> Trajectory:
        """Run k as if it had been simulated alone."""
        rows = -(-int(self.steps[k]) // self.every) + 1
        n_steps = self.u.shape[1]
        u = self.u[k if len(self.u) > 1 else 0]
        index = np.minimum(np.arange(rows) * self.every, max(int(self.steps[k]) - 1, 0))
        arrays = {name: getattr(self, name)[k, :rows] for name in (*_FLOATS, "counts", "contact")}
        if self.estimate is not None:
            arrays["estimate"] = self.estimate[k, :rows]
        arrays["u"] = u[index] if n_steps else np.zeros((rows, u.shape[1]))
        parameters = {name: float(values[k]) for name, values in self.parameters.items()}
        return Trajectory(
            self.stepper,
            arrays,
            parameters=parameters,
            options=self.options,
            steps=int(self.steps[k]),
            find_events=partial(self._events, k, parameters),
        )

    def _events(self, k: int, parameters: dict[str, float]) -> list[Event]:
        """Events of run k, found by running it again: it is the same to the last bit."""
        steps = int(self.steps[k])
        u = self.u[k if len(self.u) > 1 else 0][:steps]
        options = RunOptions.of(self.options, chosen=True)
        start = float(self.t[k, 0]), self.q[k, 0].copy(), self.v[k, 0].copy()
        run: Run
        if options.error is None:
            run = Run(
                self.stepper, parameters, options, *start, self.h, steps, max(steps, 1), False
            )
        else:
            end = start[0] + (self.u.shape[1]) * self.h
            run = ChosenRun(
                self.stepper, parameters, options, *start, self.h, steps, max(steps, 1), end
            )
        again = run.go(u, None, None)
        return again.events


def run_batch(
    stepper: Compiled,
    *,
    h: float,
    n_steps: int,
    every: int,
    t0: Any,
    q0: Any,
    v0: Any,
    parameters: Mapping[str, Any] | None,
    inputs: Any,
    options: RunOptions,
    threads: int | None,
    progress: Callable[[int, int], None] | None,
) -> Batch:
    """Run all; see `Stepper.simulate_batch`."""
    lib, sizes = stepper.library, stepper.sizes
    threads = number_of_threads(threads)
    u, shared = _inputs(stepper, inputs, n_steps)
    count = _Count(None if shared else len(u))
    par = {name: count.of(f"parameter '{name}'", x) for name, x in (parameters or {}).items()}
    start = {
        "q0": _states(stepper, "q0", q0, "coordinates", count),
        "v0": _states(stepper, "v0", v0, "velocities", count),
    }
    times = None if t0 is None else count.of("t0", t0)
    n = count.n or 1
    table = _parameter_table(stepper, par, n)
    t, q, v = _starts(stepper, table, n, times, start)
    rows, real = -(-n_steps // every) + 1, lib.dtype
    row_shapes: dict[str, tuple[int, ...]] = {
        "t": (),
        "q": (sizes["n_q"],),
        "v": (sizes["n_q"],),
        "P": (sizes["n_R"],),
        "residual": (),
        "smallest_gap": (),
        "energy": (2,),
        "counts": (len(COUNTS),),
        "contact": (sizes["n_contacts"],),
    }
    check_memory(n * rows, row_shapes.values(), np.dtype(real).itemsize, every)
    nan = np.nan
    result = {
        name: np.full((n, rows, *shape), -1, np.intc)
        if name in ("counts", "contact")
        else np.full((n, rows, *shape), nan, real)
        for name, shape in row_shapes.items()
    }
    result["t"][:, 0], result["q"][:, 0], result["v"][:, 0] = t, q, v
    result["P"][:, 0] = result["residual"][:, 0] = result["counts"][:, 0] = 0
    result["smallest_gap"][:, 0] = np.inf
    per_run = sum(a[0].nbytes for a in result.values())
    control = None
    if options.error is not None:
        control = control_of(stepper, options, 0.0, n_steps * h)
        result["estimate"] = np.zeros((n, rows), real)
    missed = np.zeros(n, np.intc)
    status, done = np.zeros(n, np.intc), np.zeros(n, np.intc)
    interrupted = False
    options_c = stepper.c_options(options)
    used = lib.array(u)
    block = n if progress is None else _BLOCK * threads
    for first in range(0, n, block):
        some = slice(first, min(first + block, n))
        arrays = {
            "t0": t[some], "q0": q[some], "v0": v[some],
            "u": used if shared else used[some], "params": table[some],
            **{name: a[some] for name, a in result.items()},
            "status": status[some], "done": done[some],
        }  # fmt: skip
        batch = lib.batch_struct()
        batch.n_runs, batch.n_steps, batch.every = some.stop - some.start, n_steps, every
        batch.n_u_rows = 0 if shared else n_steps
        batch.n_q, batch.n_R, batch.n_u = sizes["n_q"], sizes["n_R"], sizes["n_u"]
        batch.n_contacts = sizes["n_contacts"]
        batch.h = h
        batch.options = ctypes.cast(ctypes.byref(options_c), ctypes.c_void_p)
        if control is not None:
            batch.control = ctypes.cast(ctypes.byref(control), ctypes.c_void_p)
            arrays["missed"] = missed[some]
        for name, array in arrays.items():
            setattr(batch, name, array.ctypes.data_as(ctypes.c_void_p))
        taken, interrupted = drive(lib.run_batch, batch, threads)
        if interrupted:
            break
        if taken < batch.n_runs:
            raise RunError(
                f"model '{stepper.name}': memory is short, {taken} of {batch.n_runs} runs done"
            )
        if progress is not None:
            progress(some.stop, n)
    named = {name: table[:, k].astype(lib.wide) for k, name in enumerate(stepper.parameters)}
    for k in range(n):
        at = (t[k], q[k], v[k])
        values = dict(zip(stepper.parameters, map(float, table[k]), strict=False))
        result["energy"][k, 0] = stepper.evaluate("energy", *at, parameters=values)
    gaps: np.ndarray = result["smallest_gap"]
    gaps[gaps >= lib.largest] = np.inf
    recorded: dict[str, Any] = {
        _NAMES.get(name, name): a if a.dtype == np.intc else a.astype(lib.wide, copy=False)
        for name, a in result.items()
    }
    made = Batch(
        stepper,
        **recorded,
        u=u if not shared else u[:1],
        steps=done.astype(int),
        status=[lib.statuses[s] for s in status],
        parameters=named,
        options=options.given(),
        every=every,
        h=h,
        bytes_per_run=per_run,
        bytes_per_thread=ctypes.sizeof(lib.structs["work"]),
        missed=missed if control is not None else None,
    )
    if interrupted:
        error = KeyboardInterrupt(
            "the batch was interrupted; what was done is in its attribute batch"
        )
        error.batch = made  # type: ignore[attr-defined]
        raise error
    return made


class _Count:
    """The number of runs that all arguments agree on."""

    def __init__(self, n: int | None) -> None:
        self.n = n
        self.first = "inputs"

    def agree(self, what: str, n: int) -> None:
        if self.n is not None and self.n != n:
            raise RunError(f"{what} is for {n} runs but {self.first} for {self.n}")
        if n < 1:
            raise RunError(f"{what} is for no run at all")
        self.n, self.first = n, what if self.n is None else self.first

    def of(self, what: str, values: Any) -> np.ndarray:
        """A number for all runs or one for each."""
        array = reals(what, values)
        if array.ndim > 1:
            raise RunError(f"{what} has shape {array.shape}: give a number or one for each run")
        if not np.all(np.isfinite(array)):
            raise RunError(f"{what} is not finite in every run")
        if array.ndim == 1:
            self.agree(what, len(array))
        return array


def _states(
    stepper: Compiled, what: str, given: Any, kind: str, count: _Count
) -> np.ndarray | dict[int, np.ndarray] | None:
    """Given coordinates or velocities: all of them, or some by their column."""
    names, coordinates = stepper.manifest[kind], stepper.manifest["coordinates"]
    if given is None:
        return None
    if isinstance(given, Mapping):
        columns = {}
        for name, values in given.items():
            if name not in names and name not in coordinates:
                raise RunError(
                    f"{what}: there is no coordinate '{name}'; there are: {', '.join(coordinates)}"
                )
            k = (coordinates if name in coordinates else names).index(name)
            columns[k] = count.of(f"{what} of '{name}'", values)
        return columns
    array = reals(what, given)
    if array.ndim not in (1, 2) or array.shape[-1] != len(names):
        raise RunError(f"{what} has shape {array.shape}: give (n, {len(names)}) numbers")
    if not np.all(np.isfinite(array)):
        raise RunError(f"{what} is not finite in every run")
    if array.ndim == 2:
        count.agree(what, len(array))
    return array


def _parameter_table(stepper: Compiled, par: dict[str, np.ndarray], n: int) -> np.ndarray:
    """All parameters, run by run, as the C struct holds them."""
    low, high = ({k: float(op(a)) for k, a in par.items()} for op in (np.min, np.max))
    stepper.check_parameters(low)
    full = stepper.check_parameters(high)
    table = np.zeros((n, max(len(full), 1)), stepper.library.dtype)
    for k, (name, value) in enumerate(full.items()):
        table[:, k] = par.get(name, value)
    return table


def _starts(
    stepper: Compiled, table: np.ndarray, n: int, times: np.ndarray | None, given: dict[str, Any]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Initial times and states; what is not given comes from the model and its parameters."""
    lib, n_q = stepper.library, stepper.sizes["n_q"]
    t, q, v = (lib.array(np.zeros((n, *shape))) for shape in ((), (n_q,), (n_q,)))
    params = ctypes.POINTER(lib.structs["params"])
    for k in range(n):
        at = table[k:].ctypes.data_as(params)
        lib.call["initial_state"](at, *(lib.pointer(a[k:]) for a in (t, q, v)))
    if times is not None:
        t[:] = times
    for array, some in ((q, given["q0"]), (v, given["v0"])):
        if isinstance(some, dict):
            for column, values in some.items():
                array[:, column] = values
        elif some is not None:
            array[:] = some
    return t, q, v


def _inputs(stepper: Compiled, inputs: Any, n_steps: int) -> tuple[np.ndarray, bool]:
    """Inputs of shape (1 or n, n_steps, n_u), and whether all runs share them."""
    n_u = stepper.sizes["n_u"]
    if callable(inputs):
        raise RunError("inputs of a batch are arrays: a function cannot be asked from threads")
    if inputs is not None:
        array = reals("inputs", inputs)
        if array.ndim == 3:
            if array.shape[1:] != (n_steps, n_u) or not len(array):
                raise RunError(
                    f"inputs have shape {array.shape}: give (n, {n_steps}, {n_u}), run by run"
                )
            if not np.all(np.isfinite(array)):
                raise RunError("inputs are not finite in every run")
            return array, False
    u, _ = stepper.inputs_of(inputs, n_steps)
    return np.ascontiguousarray(u)[None], True
