"""Derivatives of runs that have been taken: forward along directions, or gradients carried back."""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from signorini.runtime.batch import Batch
from signorini.runtime.compiled import Compiled
from signorini.runtime.derivatives import SPREADS, NotDifferentiable, Seeds, Tangents, Walk, reason
from signorini.runtime.errors import RunError
from signorini.runtime.memory import check_memory
from signorini.runtime.options import RunOptions
from signorini.runtime.run import Run
from signorini.runtime.tangent import Tangent
from signorini.runtime.threads import drive
from signorini.runtime.trajectory import Trajectory

_MOST_LOST = 64  # events of a run that are listed
_KEPT = 1 << 24  # bytes of states that an adjoint run keeps


@dataclass(frozen=True, eq=False)
class Taken:
    """Runs that have been taken, as they can be taken again.

    Attributes
    ----------
    t, q, v : ndarray, shapes (n,), (n, n_q), (n, n_q)
        Their starts.
    table : ndarray, shape (n, n_par)
        Their parameters, as the C struct holds them.
    u : ndarray, shape (n or 1, n_steps, n_u)
        Inputs; one row of runs if all share them.
    steps : ndarray of int, shape (n,)
        Steps that each has taken.
    sizes, ends : ndarray, shapes (n_steps,) and (rows,), optional
        Sizes of steps that a tolerance has chosen, of one run, and steps before the end of each
        row; by default all have the size h and `every` of them make a row.
    project : bool
        Whether changes of the start are made to keep what holds there.
    """

    stepper: Compiled
    options: RunOptions
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    table: np.ndarray
    u: np.ndarray
    h: float
    n_steps: int
    steps: np.ndarray
    every: int
    threads: int
    project: bool
    sizes: np.ndarray | None = None
    ends: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.t)

    @property
    def rows(self) -> int:
        """Recorded rows of a run."""
        return len(self.row_ends)

    @property
    def row_ends(self) -> np.ndarray:
        """Steps before the end of each row."""
        if self.ends is not None:
            return self.ends
        rows = -(-self.n_steps // self.every) + 1
        return np.minimum(np.arange(rows) * self.every, self.n_steps)

    @property
    def of_one_size(self) -> RunOptions:
        """The options of its steps, whoever chooses their sizes."""
        return replace(self.options, error=None, scale=None)

    def size(self, step: int) -> float:
        """Of a step."""
        return self.h if self.sizes is None else float(self.sizes[step])

    def parameters(self, k: int) -> dict[str, float]:
        """Those of run k."""
        return dict(zip(self.stepper.parameters, map(float, self.table[k]), strict=False))

    def end(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Where run k ends."""
        start = float(self.t[k]), self.q[k], self.v[k]
        steps = int(self.steps[k])
        run = Run(self.stepper, self.parameters(k), self.options, *start, self.h, steps,
                  max(steps, 1), False)  # fmt: skip
        traj = run.go(self.u[k if len(self.u) > 1 else 0], None, None)
        return traj.q[-1], traj.v[-1]

    def tangent(self, k: int) -> Tangent:
        """What holds at the start of run k."""
        start = float(self.t[k]), self.q[k], self.v[k]
        return Tangent(self.stepper, start, self.parameters(k), self._contacts(k, start))

    def _contacts(self, k: int, start: tuple[float, np.ndarray, np.ndarray]) -> list[str]:
        """States of the contacts of run k after its first step."""
        if not self.project or not self.steps[k]:
            return []
        one = Run(
            self.stepper, self.parameters(k), self.of_one_size, *start, self.size(0), 1, 1, False
        )
        traj = one.go(self.u[k if len(self.u) > 1 else 0, :1], None, None)
        names = [c["name"] for c in self.stepper.manifest["contacts"]]
        return [str(traj[f"{name}.state"][1]) for name in names]

    def tangents(self, k: int) -> Tangents | None:
        """Changes of its state that stay tangent, if they are asked for."""
        return self.tangent(k).directions() if self.project else None

    def leaving(self, k: int) -> dict[str, np.ndarray]:
        """Changes of the start of run k that leave what holds there, beside those that C finds."""
        if self.project:
            return self._leaving_still(k)
        captured = self.options.events == "captured" or not self.stepper.manifest["contacts"]
        return self.tangent(k).leaving() if captured else {}

    def _leaving_still(self, k: int) -> dict[str, np.ndarray]:
        """Changes that C does not find tangent although they were made so."""
        of = ("q0", "v0", "parameters", "t0")
        seeds = Seeds(self.stepper, of, True, self.tangents(k))
        start = float(self.t[k]), self.q[k], self.v[k]
        if self.steps[k]:
            walk = Walk(self.stepper, self.parameters(k), self.options, start, seeds)
            walk.step(self.u[k if len(self.u) > 1 else 0, 0], self.size(0))
        leaves = np.frombuffer(seeds.directions.leaves, np.intc)[: seeds.directions.count] != 0
        return seeds.by_name(leaves)

    def seeds(self, of: tuple[str, ...]) -> list[Seeds]:
        """Directions at the start of each run."""
        found = []
        for k in range(len(self)):
            seeds = Seeds(self.stepper, of, True, self.tangents(k) if of else None)
            seeds.leave(self.leaving(k) if of and not self.project else {})
            found.append(seeds)
        return found


def table_of(stepper: Compiled, parameters: dict[str, float]) -> np.ndarray:
    """Parameters of one run as a table, which has a column at least."""
    values = [parameters[name] for name in stepper.parameters] or [0.0]
    return np.array([values], stepper.library.wide)


class _Job:
    """The struct that the driver takes, with what it points to."""

    def __init__(self, taken: Taken, seeds: list[Seeds]) -> None:
        lib, n = taken.stepper.library, taken.stepper.sizes
        runs = len(taken)
        self.lib, self.taken = lib, taken
        self.options = taken.stepper.c_options(taken.options)
        self.arrays = {
            "t0": lib.array(taken.t), "q0": lib.array(taken.q), "v0": lib.array(taken.v),
            "u": lib.array(taken.u), "params": lib.array(taken.table),
            "steps": np.ascontiguousarray(taken.steps, np.intc),
            "status": np.zeros(runs, np.intc), "n_lost": np.zeros(runs, np.intc),
            "lost_t": np.zeros((runs, _MOST_LOST), lib.dtype),
            "lost_contact": np.zeros((runs, _MOST_LOST), np.intc),
            "lost_why": np.zeros((runs, _MOST_LOST), np.intc),
        }  # fmt: skip
        self.seeds = (lib.structs["directions"] * runs)(*(x.directions for x in seeds))
        self.job = job = lib.changes_struct()
        job.n_runs, job.n_steps, job.n_rows = runs, taken.n_steps, taken.rows
        self.arrays["ends"] = np.ascontiguousarray(taken.row_ends, np.intc)
        if taken.sizes is not None:
            self.arrays["sizes"] = lib.array(taken.sizes)
        job.n_u_rows = 0 if len(taken.u) < runs else taken.n_steps
        job.n_q, job.n_u, job.n_ways = n["n_q"], n["n_u"], seeds[0].directions.count
        job.max_lost, job.h = _MOST_LOST, taken.h
        job.captured = int(of_map(taken.stepper, taken.options))
        job.options = ctypes.cast(ctypes.byref(self.options), ctypes.c_void_p)
        job.seeds = ctypes.cast(self.seeds, ctypes.c_void_p)

    def go(self, name: str, **results: np.ndarray) -> None:
        """Do it, and say where it failed."""
        taken = self.taken
        for where, array in {**self.arrays, **results}.items():
            setattr(self.job, where, array.ctypes.data_as(ctypes.c_void_p))
        done, interrupted = drive(self.lib.call[name], self.job, taken.threads)
        if interrupted:
            raise KeyboardInterrupt
        if done < len(taken):
            raise RunError(
                f"model '{taken.stepper.name}': memory is short, {done} of {len(taken)} runs were "
                "differentiated"
            )
        for k in np.flatnonzero(self.arrays["status"]):
            raise RunError(
                f"model '{taken.stepper.name}', run {k}: a step that was taken cannot be "
                f"differentiated, {self.lib.status_texts[self.arrays['status'][k]]}"
            )

    def lost(self, k: int) -> list[NotDifferentiable]:
        """What has no derivative in run k."""
        found = (self.arrays[name][k] for name in ("lost_why", "lost_t", "lost_contact"))
        rows = zip(*found, strict=True)
        return [
            reason(self.taken.stepper, *row)
            for _, row in zip(range(self.arrays["n_lost"][k]), rows, strict=False)
        ]


def of_map(stepper: Compiled, options: RunOptions) -> bool:
    """Whether steps are captured, so that derivatives are those of their map."""
    return options.events == "captured" and bool(stepper.manifest["contacts"])


def forward(
    taken: Taken, of: tuple[str, ...]
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], list[list[NotDifferentiable]]]:
    """Changes of q and v of every recorded row, by what was asked for.

    Returns
    -------
    dq, dv : dict from name to ndarray, shape (n, rows, n_q, number)
        NaN where there are none.
    lost : list of lists of NotDifferentiable
        By run.
    """
    lib, n_q = taken.stepper.library, taken.stepper.sizes["n_q"]
    seeds = taken.seeds(of)
    count = seeds[0].directions.count
    shape = (len(taken), taken.rows, count, n_q)
    check_memory(
        len(taken) * taken.rows, [(2 * count * n_q,)], np.dtype(lib.dtype).itemsize, taken.every
    )
    dq, dv = np.full(shape, np.nan, lib.dtype), np.full(shape, np.nan, lib.dtype)
    job = _Job(taken, seeds)
    job.go("run_forward", dq=dq, dv=dv)
    by_q, by_v = (
        seeds[0].by_name(np.swapaxes(change.astype(lib.wide, copy=False), -1, -2))
        for change in (dq, dv)
    )
    return by_q, by_v, [job.lost(k) for k in range(len(taken))]


def lost(taken: Taken) -> list[list[NotDifferentiable]]:
    """The events of each run that have no derivative."""
    nothing = np.zeros(1, taken.stepper.library.dtype)
    job = _Job(taken, taken.seeds(()))
    job.go("run_forward", dq=nothing, dv=nothing)
    return [job.lost(k) for k in range(len(taken))]


def outputs(
    taken: Taken,
    k: int,
    arrays: dict[str, np.ndarray],
    dq: dict[str, np.ndarray],
    dv: dict[str, np.ndarray],
) -> dict[str, np.ndarray]:
    """Changes of the outputs of run k with those of its recorded rows.

    Parameters
    ----------
    arrays : dict
        "t", "q", "v", "u" of the rows.
    dq, dv : dict from name to ndarray, shape (rows, n_q, number)
    """  # fmt: skip
    stepper, n = taken.stepper, taken.stepper.sizes
    rows = len(arrays["t"])
    columns = {"t": 1, "q": n["n_q"], "v": n["n_q"], "u": n["n_u"], "par": n["n_par"]}
    slopes = {}
    for by, count in columns.items():
        slopes[by] = np.zeros((rows, n["n_outputs"], count))
        if f"outputs_{by}" in stepper.functions:
            found = stepper.evaluate(
                f"outputs_{by}", arrays["t"], arrays["q"], arrays["v"], arrays["u"],
                taken.parameters(k),
            )  # fmt: skip
            slopes[by] += found.reshape(slopes[by].shape)
    steps = np.minimum(taken.row_ends[:rows], taken.steps[k])
    own = {
        "parameters": slopes["par"], "inputs": slopes["u"], "t0": slopes["t"],
        "dt": slopes["t"] * steps[:, None, None],
    }  # fmt: skip
    return {
        name: slopes["q"] @ dq[name] + slopes["v"] @ dv[name] + own.get(name, 0.0) for name in dq
    }


class Gradient:
    """Gradients of functions of the recorded states, carried back over the steps.

    Call it with cotangents; see `Stepper.simulate`. Steps are taken again from states that are kept
    on the way, so that memory does not grow with their number.
    """

    def __init__(
        self, taken: Taken, alone: bool, found: Callable[[int, list[NotDifferentiable]], None]
    ) -> None:
        self.taken, self.alone, self.found = taken, alone, found

    def __call__(self, q_bar: Any = None, v_bar: Any = None) -> dict[str, Any]:
        """Gradients of the sum of q_bar * q + v_bar * v.

        Parameters
        ----------
        q_bar, v_bar : array, shape (n_q,) or (n_t, n_q)
            Cotangents of the end, or of every recorded row; zero by default. Of a batch also
            (n, n_q) or (n, n_t, n_q), run by run.

        Returns
        -------
        dict
            "q0", "v0" of shape (n_q,), "parameters" (number of them,), "inputs" (n_steps, n_u),
            "t0", "dt" numbers; of a batch with runs in front. They are NaN along what leaves the
            constraints of the start, and before an event that has no derivative.

        Raises
        ------
        RunError
            If a cotangent has another shape.
        """
        taken, lib = self.taken, self.taken.stepper.library
        n, sizes = len(taken), taken.stepper.sizes
        n_q, n_par, n_u = sizes["n_q"], sizes["n_par"], sizes["n_u"]
        bars = [self._cotangent(name, x) for name, x in (("q_bar", q_bar), ("v_bar", v_bar))]
        rows = any(bar.ndim == 3 for bar in bars)
        if rows:
            bars = [self._at_steps(bar) for bar in bars]
        gradients = (lib.structs["adjoint"] * n)()
        u_bar = np.full((n, taken.n_steps, n_u), np.nan, lib.dtype)
        away = np.zeros((n, 2 * n_q + 3 + n_par + n_u), np.intc)
        seeds = taken.seeds(())
        for one in seeds:
            one.directions.count = away.shape[1]
        job = _Job(taken, seeds)
        room = _KEPT // ctypes.sizeof(lib.structs["checkpoint"])
        job.job.n_kept = max(2, min(taken.n_steps + 2, room))
        if taken.sizes is not None:
            job.job.n_kept = taken.n_steps + 2
        job.job.rows = int(rows)
        job.go(
            "run_back", q_bar=lib.array(bars[0]), v_bar=lib.array(bars[1]), u_bar=u_bar,
            leaves=away, gradient=np.frombuffer(gradients, np.uint8),
        )  # fmt: skip
        given = [max(float(np.max(np.abs(bar[k]))) for bar in bars) for k in range(n)]
        runs = [self._of_run(k, gradients[k], away[k] != 0, job, given[k]) for k in range(n)]
        found = {name: np.array([run[name] for run in runs]) for name in runs[0]}
        found["inputs"] = u_bar.astype(lib.wide, copy=False)
        if taken.sizes is not None:
            # of the intervals over which they are held
            found["inputs"] = np.add.reduceat(found["inputs"], taken.row_ends[:-1], axis=1)
        if not self.alone:
            return found
        if taken.sizes is not None:
            del found["dt"]  # sizes of steps are held as they were chosen
        return {
            name: float(x[0]) if x.ndim == 1 and lib.wide is np.float64 else x[0]
            for name, x in found.items()
        }

    def _of_run(
        self, k: int, g: Any, leaves: np.ndarray, job: _Job, given: float
    ) -> dict[str, np.ndarray]:
        """The gradient by the start of run k, of cotangents of size `given`, as C has found it."""
        taken, lib = self.taken, self.taken.stepper.library
        n_q, n_par = taken.stepper.sizes["n_q"], taken.stepper.sizes["n_par"]
        found = {
            "q0": lib.kept(g.q)[:n_q],
            "v0": lib.kept(g.v)[:n_q],
            "parameters": lib.kept(g.par)[:n_par],
            "t0": np.array([g.t], lib.wide),
            "dt": np.array([g.h], lib.wide),
        }
        tangents = taken.tangents(k)
        if tangents is not None:
            by_q, by_v = found["q0"], found["v0"]
            own = {name: found[name] for name in ("t0", "parameters")} | {"q0": 0.0, "v0": 0.0}
            for name, (q, v) in tangents.items():
                found[name] = by_q @ q + by_v @ v + own[name]
            leaves = np.zeros_like(leaves)  # of the changes as they were not made
        first = {"q0": 0, "v0": n_q, "t0": 2 * n_q + 1, "parameters": 2 * n_q + 3}
        away = taken.leaving(k)
        for name, start in first.items():
            own_away = leaves[start : start + found[name].size]
            found[name] = np.where(own_away | away.get(name, False), np.nan, found[name])
        events = [] if job.job.captured else job.lost(k)
        by_state = max(float(np.max(np.abs(lib.kept(x)))) for x in (g.q, g.v))
        if not events and not by_state * np.sqrt(np.finfo(lib.dtype).eps) <= given:
            events.append(reason(taken.stepper, SPREADS, float(taken.t[k]), -1))
        if events:
            self.found(k, events)
            found = {name: np.full_like(x, np.nan) for name, x in found.items()}
        found["t0"], found["dt"] = found["t0"][0], found["dt"][0]
        return found

    def _cotangent(self, name: str, given: Any) -> np.ndarray:
        """Of the end (n, n_q) or of all recorded rows (n, rows, n_q)."""
        taken = self.taken
        n, rows, n_q = len(taken), taken.rows, taken.stepper.sizes["n_q"]
        if given is None:
            return np.zeros((n, n_q))
        bar = np.asarray(given, dtype=float)
        if not np.all(np.isfinite(bar)):
            raise RunError(f"{name} is not finite")
        if bar.shape == (n_q,):
            return np.tile(bar, (n, 1))
        if self.alone and bar.shape == (rows, n_q):
            return bar[None]
        if not self.alone and bar.shape in ((n, n_q), (n, rows, n_q)):
            return bar
        of_batch = f", ({n}, {n_q}) run by run or ({n}, {rows}, {n_q})"
        raise RunError(
            f"{name} has the shape {bar.shape}: give ({n_q},) for the end"
            + (f" or ({rows}, {n_q}) for all rows" if self.alone else of_batch)
        )

    def _at_steps(self, bar: np.ndarray) -> np.ndarray:
        """Cotangents of every step, from those of the end or of recorded rows."""
        taken = self.taken
        n, n_q = len(taken), taken.stepper.sizes["n_q"]
        full = np.zeros((n, taken.n_steps + 1, n_q))
        for k in range(n):
            steps = int(taken.steps[k])
            if bar.ndim == 2:
                full[k, steps] = bar[k]
            else:
                reached = int(np.searchsorted(taken.row_ends, steps)) + 1
                full[k, np.minimum(taken.row_ends[:reached], steps)] = bar[k, :reached]
        return full


def differentiate(traj: Trajectory, taken: Taken, of: tuple[str, ...] | None) -> None:
    """Give a trajectory its derivatives by `of`; without, what carries gradients back."""
    if of is None:
        traj.differentiable = lost(taken)[0] or True

        def add(_: int, events: list[NotDifferentiable]) -> None:
            known = traj.differentiable if isinstance(traj.differentiable, list) else []
            traj.differentiable = [*known, *(e for e in events if e not in known)]

        traj.gradient = Gradient(taken, True, add)
        return
    dq, dv, events = forward(taken, of)
    traj.dq = {name: x[0] for name, x in dq.items()}
    traj.dv = {name: x[0] for name, x in dv.items()}
    arrays = {name: getattr(traj, name) for name in ("t", "q", "v", "u")}
    traj.doutputs = outputs(taken, 0, arrays, traj.dq, traj.dv)
    traj.differentiable = events[0] or True


def differentiate_batch(batch: Batch, taken: Taken, of: tuple[str, ...] | None) -> Batch:
    """The batch with its derivatives by `of`; without, with what carries gradients back."""
    if of is None:
        events = lost(taken)
        found: list[Any] = [x or True for x in events]

        def add(k: int, events: list[NotDifferentiable]) -> None:
            known = [] if found[k] is True else found[k]
            found[k] = [*known, *(e for e in events if e not in known)]

        return replace(batch, gradient=Gradient(taken, False, add), differentiable=found)
    dq, dv, events = forward(taken, of)
    rows = []
    for k in range(len(batch)):
        u = batch.trajectory(k).u
        held = np.concatenate([u, np.repeat(u[-1:], batch.t.shape[1] - len(u), axis=0)])
        arrays = {"t": batch.t[k], "q": batch.q[k], "v": batch.v[k], "u": held}
        own = ({name: change[k] for name, change in by.items()} for by in (dq, dv))
        rows.append(outputs(taken, k, arrays, *own))
    return replace(
        batch, dq=dq, dv=dv, doutputs={name: np.array([row[name] for row in rows]) for name in dq},
        differentiable=[x or True for x in events],
    )  # fmt: skip
