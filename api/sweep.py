"""A model over a grid of parameters and initial values: batches on processes, one store."""

import atexit
import contextlib
import itertools
import json
import logging
import math
import multiprocessing
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from signorini.codegen.c.emit import staging_folder
from signorini.runtime.arguments import grid, plain_number
from signorini.runtime.batch import Batch
from signorini.runtime.errors import RunError
from signorini.runtime.export import COUNTS
from signorini.runtime.stepper import Stepper
from signorini.workflow import build_files

_ADVICE = "install it with: pip install 'signorini[sweep]'"
_FORMAT = 4
_MOST_VALUES = 10_000_000
# Counts that are summed over a whole run.
_SUMS = ("iterations", "substeps", "impacts")


@dataclass(frozen=True)
class Axis:
    """Values of one parameter, coordinate (initial value) or velocity (initial value)."""

    name: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Sweep:
    """What is run: the product of the axes, the last axis fastest."""

    axes: tuple[Axis, ...]
    fixed: dict[str, float]
    t_end: float
    dt: float
    every: int
    last: int | None
    error: float | None = None

    @property
    def size(self) -> int:
        """Number of runs."""
        return math.prod(len(a.values) for a in self.axes)

    def points(self) -> np.ndarray:
        """Values of the axes, run by run, shape (n, n_axes)."""
        product = itertools.product(*(a.values for a in self.axes))
        return np.array(list(product), dtype=float).reshape(self.size, len(self.axes))


def axis(text: str) -> Axis:
    """Read ``name=first:last:count`` or ``name=value,value,...``.

    Raises
    ------
    RunError
        If the text says neither.
    """
    name, equal, rest = text.partition("=")
    try:
        if not (name and equal):
            raise ValueError
        parts = rest.split(":")
        if len(parts) == 3:
            first, last, count = (plain_number(x) for x in parts)
            if first is None or last is None or count is None or not count.is_integer():
                raise ValueError
            if not 1 <= count <= _MOST_VALUES:
                raise RunError(
                    f"--over {text}: {count:.3g} values; give from 1 to {_MOST_VALUES} of them"
                )
            # Values that one can write: 0.3, not 0.30000000000000004.
            values = np.array([float(f"{x:.12g}") for x in np.linspace(first, last, int(count))])
        elif len(parts) == 1:
            numbers = [plain_number(x) for x in rest.split(",")]
            if any(x is None for x in numbers):
                raise ValueError
            values = np.array(numbers, dtype=float)
        else:
            raise ValueError
    except ValueError as error:
        if isinstance(error, RunError):
            raise
        raise RunError(
            f"--over {text}: write name=first:last:count or name=value,value,..."
        ) from None
    return Axis(name, tuple(float(x) for x in values))


def check_axes(stepper: Stepper, axes: tuple[Axis, ...]) -> None:
    """See that every axis has a name of the model, and only one.

    Raises
    ------
    RunError
        Naming the axis.
    """
    m = stepper.manifest
    known = (*stepper.parameters, *m["coordinates"], *m["velocities"])
    for k, a in enumerate(axes):
        if a.name not in known:
            raise RunError(
                f"model '{stepper.name}' has no parameter, coordinate or velocity '{a.name}'; "
                f"it has: {', '.join(known)}"
            )
        if a.name in {b.name for b in axes[:k]}:
            raise RunError(f"'{a.name}' is swept twice")
        if a.name in stepper.parameters:
            for value in (min(a.values), max(a.values)):
                stepper.check_parameters({a.name: value})


def run_part(files: dict[str, str], sweep: Sweep, points: np.ndarray) -> dict[str, Any]:
    """Run some points; on a worker. Results as arrays, rows cut to the last ones asked for."""
    stepper = _stepper(json.dumps(files, sort_keys=True))
    m = stepper.manifest
    parameters: dict[str, Any] = {
        name: value for name, value in sweep.fixed.items() if name in stepper.parameters
    }
    q0: dict[str, Any] = {}
    v0: dict[str, Any] = {}
    for k, a in enumerate(sweep.axes):
        column = points[:, k]
        if a.name in stepper.parameters:
            parameters[a.name] = column
        elif a.name in m["coordinates"]:
            q0[a.name] = column
        else:
            v0[a.name] = column
    batch = stepper.simulate_batch(
        t_end=sweep.t_end,
        dt=sweep.dt,
        every=sweep.every,
        q0=q0 or None,
        v0=v0 or None,
        parameters=parameters,
        threads=1,
        events=m["events"],
        error=sweep.error,
    )
    rows = slice(-sweep.last, None) if sweep.last else slice(None)
    kept = {name: getattr(batch, name)[:, rows] for name in ("t", "q", "v", "P")}
    return {
        **kept,
        **_derived(stepper, kept, parameters),
        **_whole(batch),
        "steps": batch.steps,
        "status": np.array([stepper.library.statuses.index(s) for s in batch.status]),
    }


def _derived(
    stepper: Stepper, kept: dict[str, np.ndarray], parameters: dict[str, Any]
) -> dict[str, np.ndarray]:
    """Energy, gaps and outputs of the rows kept; NaN where a run did not come to a row."""
    n, rows = kept["t"].shape
    sizes = stepper.sizes
    found = {
        "energy": np.full((n, rows), np.nan),
        "g_N": np.full((n, rows, sizes["n_N"]), np.nan),
        "outputs": np.full((n, rows, sizes["n_outputs"]), np.nan),
    }
    for k in range(n):
        own = {name: float(np.broadcast_to(x, (n,))[k]) for name, x in parameters.items()}
        there = np.isfinite(kept["t"][k])
        at = {name: kept[name][k][there] for name in ("t", "q", "v")} | {"parameters": own}
        for name, values in found.items():
            if values.size and there.any():
                values[k, there] = stepper.evaluate(name, **at).reshape(values[k, there].shape)
    return found


def _whole(batch: Batch) -> dict[str, np.ndarray]:
    """Figures of whole runs; rows that a run did not reach hold NaN, and -1 as counts."""
    low, high = batch.energy_range[..., 0], batch.energy_range[..., 1]
    sums = np.maximum(batch.counts, 0).sum(axis=1)
    return {
        "smallest_gap": np.fmin.reduce(batch.smallest_gap, axis=1),
        "energy_range": np.stack(
            [np.fmin.reduce(low, axis=1), np.fmax.reduce(high, axis=1)], axis=1
        ),
        **{name: sums[:, COUNTS.index(name)] for name in _SUMS},
    }


@lru_cache(maxsize=4)
def _stepper(files: str) -> Stepper:
    return build_files(json.loads(files))


def read_files(stepper: Stepper) -> dict[str, str]:
    """The generated folder of a stepper as text, to be sent to workers."""
    return {p.name: p.read_text(encoding="utf-8") for p in sorted(stepper.folder.iterdir())}


class Store:
    """One Zarr group that holds the results; a chunk of runs belongs to a batch.

    Arrays ``t``, ``q``, ``v``, ``P`` (rows kept), ``smallest_gap``, ``energy_range``,
    ``iterations``, ``substeps``, ``impacts`` (of the whole run), ``steps``, ``status`` (codes,
    texts in the attributes) and ``points`` (values of the axes), run by run; ``done`` says which
    batches are in. Events are found by running a point again: it is the same to the last bit.

    Raises
    ------
    RunError
        If zarr is missing, or the folder holds anything else than this very sweep.
    """

    def __init__(self, folder: Path, stepper: Stepper, sweep: Sweep, batch: int) -> None:
        zarr = _module("zarr")
        m = stepper.manifest
        about = {
            "format": _FORMAT,
            "model": m["model"],
            "model_hash": m["model_hash"],
            "runtime_hash": m["runtime_hash"],
            "stages": m["stages"],
            "scheme": m["scheme"],
            "precision": m["precision"],
            "batch": batch,
            "coordinates": m["coordinates"],
            "velocities": m["velocities"],
            "outputs": m["outputs"],
            "gaps": [c["name"] for c in m["contacts"] if c["normal"] >= 0],
            "units": {p["name"]: p["unit"] for p in m["parameters"] if p["unit"]}
            | dict(zip(m["coordinates"], m["units"], strict=True)),
            "statuses": [name for name, _ in m["statuses"]],
            "sweep": json.loads(json.dumps(asdict(sweep))),
        }
        arrays = _arrays(stepper, sweep, batch)
        if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
            self._make(folder, arrays, sweep, about)
        try:
            self.group = zarr.open_group(folder, mode="r+")
            found = dict(self.group.attrs)
        except Exception as error:  # zarr raises many kinds for folders that are none of its
            raise RunError(f"{folder} is no store of a sweep ({error})") from None
        if found != about:
            keys = [k for k in about if found.get(k) != about[k]]
            raise RunError(
                f"{folder} holds another sweep: {', '.join(keys) or 'its format'} differs. "
                "Choose another --out, or remove the folder"
            )
        self._check(folder, arrays, sweep)

    @staticmethod
    def _make(
        folder: Path, arrays: dict[str, "_Layout"], sweep: Sweep, about: dict[str, Any]
    ) -> None:
        """Make the store beside its place and put it there when it is complete."""
        staging = folder
        try:
            staging = staging_folder(folder.resolve().parent)
            group = _module("zarr").open_group(staging, mode="w")
            for name, layout in arrays.items():
                group.create_array(name, **asdict(layout))
            group["points"][:] = sweep.points()
            group.attrs.update(about)
            staging.chmod(0o755)
            staging.replace(folder)
        except OSError as error:
            raise RunError(f"cannot write {folder}: {error.strerror or error}") from None
        finally:
            if staging != folder:
                shutil.rmtree(staging, ignore_errors=True)

    def _check(self, folder: Path, arrays: dict[str, "_Layout"], sweep: Sweep) -> None:
        """Raise unless every array is there and can be read where that matters."""
        for name, layout in arrays.items():
            try:
                array = self.group[name]
                whole = array.shape == layout.shape and array.chunks == layout.chunks
                if name in ("done", "points"):
                    values = np.asarray(array[:])
                    whole &= name == "done" or np.array_equal(values, sweep.points())
            except Exception as error:  # of many kinds, as above
                raise RunError(
                    f"{folder}: the array '{name}' is damaged ({error}); remove the folder and run "
                    "the sweep again"
                ) from None
            if not whole:
                raise RunError(
                    f"{folder}: the array '{name}' is damaged; remove the folder and run the sweep "
                    "again"
                )

    @property
    def missing(self) -> list[int]:
        """Batches that are not in."""
        return [int(k) for k in np.flatnonzero(np.asarray(self.group["done"][:]) == 0)]

    def put(self, k: int, size: int, result: dict[str, Any]) -> None:
        """Write batch k, and only then that it is in."""
        try:
            for name, values in result.items():
                if values.size:
                    self.group[name][k * size : k * size + len(values)] = values
            self.group["done"][k] = 1
        except OSError as error:
            raise RunError(
                f"cannot write batch {k} of the sweep: {error.strerror or error}; what is in the "
                "store stays, and the same command goes on"
            ) from None


@dataclass(frozen=True)
class _Layout:
    """One array of a store."""

    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    dtype: str
    fill_value: float
    dimension_names: tuple[str, ...]


def _arrays(stepper: Stepper, sweep: Sweep, batch: int) -> dict[str, _Layout]:
    """All arrays of the store of a sweep by name."""
    n, sizes = sweep.size, stepper.sizes
    _, steps = grid(stepper.initial_state(None)[0], sweep.t_end, sweep.dt)
    rows = -(-steps // min(sweep.every, steps + 1)) + 1
    rows = min(rows, sweep.last) if sweep.last else rows
    extents = {
        "row": rows,
        "coordinate": sizes["n_q"],
        "velocity": sizes["n_q"],
        "percussion": sizes["n_R"],
        "gap": sizes["n_N"],
        "output": sizes["n_outputs"],
        "end": 2,
    }
    dimensions: dict[str, tuple[str, ...]] = {
        "t": ("row",),
        "q": ("row", "coordinate"),
        "v": ("row", "velocity"),
        "P": ("row", "percussion"),
        "energy": ("row",),
        "g_N": ("row", "gap"),
        "outputs": ("row", "output"),
        "smallest_gap": (),
        "energy_range": ("end",),
    }
    columns = max(len(sweep.axes), 1)
    run = ("run",)
    found = {}
    for name, dims in dimensions.items():
        shape = tuple(extents[d] for d in dims)
        chunks = (batch, *(max(x, 1) for x in shape))
        found[name] = _Layout((n, *shape), chunks, "f8", np.nan, (*run, *dims))
    return {
        **found,
        **{name: _Layout((n,), (batch,), "i8", -1, run) for name in _SUMS},
        **{name: _Layout((n,), (batch,), "i4", -1, run) for name in ("steps", "status")},
        "points": _Layout((n, len(sweep.axes)), (n, columns), "f8", np.nan, ("run", "axis")),
        "done": _Layout((math.ceil(n / batch),), (1,), "i1", 0, ("batch",)),
    }


def run_sweep(
    stepper: Stepper,
    sweep: Sweep,
    out: Path,
    *,
    batch: int,
    workers: int | None,
    scheduler: str | None,
    progress: Callable[[int, int], None],
) -> Store:
    """Run what is missing in the store, batch by batch, as workers become free.

    Parameters
    ----------
    workers : int, optional
        Processes on this machine, by default one for each processor.
    scheduler : str, optional
        Address of a running Dask scheduler instead.
    progress : callable (batches in the store, batches in all)
    """
    distributed = _module("distributed")
    store = Store(out, stepper, sweep, batch)
    missing = store.missing
    total = math.ceil(sweep.size / batch)
    progress(total - len(missing), total)
    if not missing:
        return store
    points, files = sweep.points(), read_files(stepper)
    with _client(distributed, workers, scheduler) as client:
        queue = iter(missing)
        places: dict[Any, int] = {}

        def submit(k: int) -> Any:
            part = points[k * batch : (k + 1) * batch]
            future = client.submit(run_part, files, sweep, part, pure=False)
            places[future.key] = k
            return future

        # A few batches ahead of each worker: the points of a large sweep do not pile up.
        ahead = 3 * max(1, sum(client.nthreads().values()))
        pending = distributed.as_completed(
            [submit(k) for k in itertools.islice(queue, ahead)], with_results=True
        )
        done = total - len(missing)
        try:
            for future, result in pending:
                if isinstance(result, BaseException):
                    raise RunError(
                        f"the Dask scheduler gave the runs up; {done} of {total} batches are in "
                        f"{out}, and the same command goes on"
                    )
                store.put(places.pop(future.key), batch, result)
                done += 1
                progress(done, total)
                for k in itertools.islice(queue, 1):
                    pending.add(submit(k))
        except KeyboardInterrupt:
            raise KeyboardInterrupt(
                f"{done} of {total} batches are in {out}; the same command goes on"
            ) from None
    return store


def summary(store: Store) -> Iterator[str]:
    """How the runs ended."""
    statuses = list(store.group.attrs["statuses"])
    codes, counts = np.unique(np.asarray(store.group["status"][:]), return_counts=True)
    for code, count in zip(codes, counts, strict=True):
        yield f"{count} runs: {statuses[code] if code >= 0 else 'not run'}"


@contextlib.contextmanager
def _client(distributed: Any, workers: int | None, scheduler: str | None) -> Iterator[Any]:
    if scheduler is not None:
        try:
            client = distributed.Client(scheduler, timeout="10s")
        except (OSError, ValueError, TimeoutError) as error:
            raise RunError(f"no Dask scheduler answers at {scheduler} ({error})") from None
        with client:
            try:
                yield client
            except BaseException:
                _silence()
                raise
        return
    try:
        with _silent_children():
            started = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address=None,
                # what matters comes as a result; an interrupt may end workers before us
                silence_logs=logging.CRITICAL + 1,
            )
    except KeyboardInterrupt:
        _end_at_once({})
        raise
    with started as cluster, distributed.Client(cluster) as client:
        try:
            yield client
        except BaseException:
            _end_at_once(cluster.workers)
            raise


@contextlib.contextmanager
def _silent_children() -> Iterator[None]:
    """What processes that start here write to stderr is not shown: their errors come as results."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def _silence() -> None:
    """Nothing that Dask logs from now on is shown."""
    for handler in logging.getLogger("distributed").handlers:
        handler.setLevel(logging.CRITICAL + 1)


def _end_at_once(nannies: Any) -> None:
    """Kill the worker processes: what they compute is not waited for, and their end is no news."""
    _silence()
    for nanny in nannies.values():
        nanny.auto_restart = False
    for process in multiprocessing.active_children():
        process.kill()
    if not nannies:  # the cluster is half made and cannot be closed in order
        from distributed.deploy.spec import close_clusters

        atexit.unregister(close_clusters)


def _module(name: str) -> Any:
    try:
        return __import__(name)
    except ImportError:
        raise RunError(f"a sweep needs the package '{name}': {_ADVICE}") from None
