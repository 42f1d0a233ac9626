"""Run scenes, judge every step, add up."""

import multiprocessing
import time
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from signorini.runtime.errors import RunError, StepError
from signorini.runtime.options import RunOptions
from signorini.runtime.replay import FailedStep
from signorini.runtime.stepper import Stepper
from signorini.stress.corpus import CORPUS, SCENES
from signorini.stress.judge import judge
from signorini.stress.scene import Case
from signorini.workflow import build

RESCUES = {"cold": 1, "path": 4, "soft": 8, "relaxed": 16}


@dataclass
class Result:
    """What the runs of one scene with one number of stages showed."""

    scene: str
    stages: int
    runs: int = 0
    steps: int = 0
    counted: int = 0
    substepped: int = 0
    captured: int = 0
    lost: int = 0
    pushing: int = 0
    gap: float = np.inf
    complementarity: float = 0.0
    cone: float = 0.0
    gain: float = 0.0
    rescues: Counter[str] = field(default_factory=Counter)
    iterations: Counter[int] = field(default_factory=Counter)
    times: list[float] = field(default_factory=list)
    failures: list[FailedStep] = field(default_factory=list)

    def add(self, other: "Result") -> None:
        """Add the numbers of another result."""
        for name in ("runs", "steps", "counted", "substepped", "captured", "lost", "pushing"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.gap = min(self.gap, other.gap)
        for name in ("complementarity", "cone", "gain"):
            setattr(self, name, max(getattr(self, name), getattr(other, name)))
        self.rescues += other.rescues
        self.iterations += other.iterations
        self.times += other.times
        self.failures += other.failures

    def quantile(self, share: float) -> int:
        """Iterations that this share of the steps did not exceed."""
        left = share * sum(self.iterations.values())
        for count in sorted(self.iterations):
            left -= self.iterations[count]
            if left <= 0:
                return count
        return 0

    def time(self, share: float) -> float:
        """Time of a step that this share of them did not exceed [us]; NaN if none was measured."""
        return float(np.quantile(self.times, share)) if self.times else np.nan

    @property
    def mean(self) -> float:
        """Mean number of iterations."""
        total = sum(self.iterations.values())
        return sum(k * n for k, n in self.iterations.items()) / max(total, 1)


@cache
def stepper_of(scene: str, stages: int, events: str = "captured") -> Stepper:
    """The compiled stepper of a scene."""
    return build(SCENES[scene].model(), stages=stages, events=events)


def case_of(scene: str, seed: int, number: int) -> Case:
    """Draw the start of one run."""
    rng = np.random.default_rng([seed, zlib.crc32(scene.encode()), number])
    return SCENES[scene].draw(rng)


def step_times(
    stepper: Stepper, case: Case, start: float, q: Any, v: Any, count: int, options: dict[str, Any]
) -> list[float]:
    """CPU time of each step of a run that is taken alone [us], of `count` steps at most.

    Of the thread, so that other programs do not count; the call from Python is about 2 us of it.
    """
    lib = stepper.library
    work, info = (lib.structs[name]() for name in ("work", "info"))
    state = stepper.c_state(start, q, v)
    par = stepper.c_params(stepper.check_parameters(case.parameters))
    chosen = stepper.c_options(RunOptions.of(options))
    u = lib.pointer(stepper.rows("u", None, 1, stepper.sizes["n_u"])[0])
    step = lib.call["step"]
    found = []
    for _ in range(count):
        before = time.thread_time_ns()
        status = step(state, work, info, par, chosen, u, case.dt)
        found.append((time.thread_time_ns() - before) / 1e3)
        if lib.statuses[status] not in ("OK", "OK_RESCUED", "OK_SUBSTEPPED"):
            break
    return found


def run_case(
    scene: str, stages: int, seed: int, number: int, timed: bool = False, **options: Any
) -> Result:
    """Run one case and judge it; `timed`: take it a second time, to measure its steps."""
    events = options.get("events", "captured")
    stepper, case = stepper_of(scene, stages, events), case_of(scene, seed, number)
    q, v = stepper.project(case.q, case.v, case.t, case.parameters)
    start = stepper.initial_state(case.parameters)[0] if case.t is None else case.t
    result = Result(scene, stages, runs=1)
    steps = SCENES[scene].steps
    try:
        traj = stepper.simulate(
            t0=start,
            t_end=start + steps * case.dt,
            dt=case.dt,
            q0=q,
            v0=v,
            parameters=case.parameters,
            record="stages",
            **options,
        )
    except StepError as error:
        traj = error.trajectory
        about = {"scene": scene, "seed": seed, "run": number, "step": len(traj)}
        result.failures.append(replace(error.step, about=about))
    result.steps = len(traj) - 1
    if timed:
        result.times = step_times(stepper, case, start, q, v, steps, options)
    if result.steps == 0:
        return result
    found = judge(traj, case.dt, case.passive)
    result.counted = int(np.count_nonzero(found.counted))
    result.substepped = int(np.count_nonzero(traj.substeps))
    result.captured = int(np.count_nonzero(traj.captured))
    result.lost, result.pushing = found.lost, found.pushing
    result.gap, result.gain = found.gap, found.gain
    result.complementarity, result.cone = found.complementarity, found.cone
    whole = traj.substeps == 0
    for name, bit in RESCUES.items():
        result.rescues[name] += int(np.count_nonzero(traj.rescues[whole] & bit))
    numbers, times = np.unique(traj.iterations[1:], return_counts=True)
    result.iterations.update(dict(zip(numbers.tolist(), times.tolist(), strict=True)))
    return result


def run_scene(
    scene: str, stages: int, seed: int, runs: range, options: dict[str, Any], timed: bool = False
) -> Result:
    """Run many cases of a scene."""
    total = Result(scene, stages)
    for number in runs:
        total.add(run_case(scene, stages, seed, number, timed, **options))
    return total


def campaign(
    scenes: Sequence[str],
    stages: Sequence[int],
    runs: int,
    seed: int,
    workers: int | None,
    options: dict[str, Any] | None = None,
    timed: bool = False,
) -> Iterator[Result]:
    """Run scenes in several processes; yields results as they come, one of each chunk.

    Parameters
    ----------
    scenes : names of scenes
    stages : numbers of stages
    runs : int
        Runs of a scene with each number of stages, times the share of the scene.
    seed : int
        Seed of the random starts.
    workers : int or None
        Processes; as many as there are cores by default.
    options : dict, optional
        Options of `Stepper.simulate`.
    timed : bool
        Whether every run is taken a second time, to measure its steps.
    """
    for s in stages:
        if s < 2:
            raise RunError(f"stages = {s}: give at least 2")
    tasks = [
        (name, s, seed, range(first, min(first + 25, count)), options or {}, timed)
        for name in scenes
        for s in stages
        for count in [max(1, round(runs * SCENES[name].share))]
        for first in range(0, count, 25)
    ]
    if workers == 1:
        for task in tasks:
            yield run_scene(*task)
        return
    pool = ProcessPoolExecutor(workers)
    try:
        for done in as_completed([pool.submit(run_scene, *task) for task in tasks]):
            yield done.result()
    except BaseException:
        # an interruption, or a caller that wants no more: a scene may take minutes to end by itself
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.kill()
        raise
    pool.shutdown()


def chosen(names: Iterable[str]) -> list[str]:
    """Scenes by name, all if none is named; `RunError` for an unknown one."""
    wanted = list(names)
    for name in wanted:
        if name not in SCENES:
            raise RunError(f"there is no scene '{name}'; there are: {', '.join(SCENES)}")
    return wanted or [scene.name for scene in CORPUS]
