"""Runs of one model."""

import json as jsonlib
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from signorini.commands.base import (
    Built,
    Grid,
    Pairs,
    Real,
    Switch,
    Whole,
    app,
    check_figure,
    check_file,
    pairs_of,
)
from signorini.runtime.errors import RunError, StepError
from signorini.runtime.export import writers
from signorini.runtime.files import check_ending
from signorini.runtime.stepper import Stepper
from signorini.runtime.trajectory import Trajectory

_QUIET_STEPS = 20_000  # runs shorter than this show no progress


@app.command
def run(
    model: str,
    *,
    built: Built | None = None,
    grid: Grid | None = None,
    q0: Pairs = None,
    v0: Pairs = None,
    tol: Real | None = None,
    r: Real | None = None,
    active_set: Literal["any_stage", "end"] = "any_stage",
    every: Whole = 1,
    project: Switch = False,
    out: Path | None = None,
    plot: Path | None = None,
    inputs: Pairs = None,
    all_events: Switch = False,
    json: Switch = False,
) -> None:
    """Generate C for MODEL, compile it, run it, show the result.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    q0
        Initial coordinates, NAME=VALUE ...
    v0
        Initial velocities by the coordinate's name, NAME=VALUE ...
    tol
        Relative tolerance of the Newton iterations; 0 iterates to round-off.
    r
        Prox parameter; chosen per contact if not given.
    active_set
        Which contacts take part in the impact equations.
    every
        Record every N-th step.
    project
        Start from the nearest state that satisfies the constraints.
    out
        File for the trajectory: .npz (all that is known), .csv or .parquet (a table), .nc (netCDF).
    plot
        File for a plot, e.g. run.png.
    inputs
        Inputs that are held, NAME=VALUE ..., or one FILE.py:FUNCTION of (t, q, v); the others are
        zero. By default what the model suggests.
    all_events
        Print all events of contacts, not only the first twelve.
    json
        Print JSON instead of tables: model, scheme, start, end, events, energy, work.
    """
    from signorini import report
    from signorini.locate import find_model
    from signorini.workflow import build

    console = Console(stderr=json)
    notes = Console(stderr=True)
    if out is not None:
        check_ending(out, (".npz", ".csv", *writers()))
        check_file(out)
    if plot is not None:
        check_figure("--plot", plot)
    built, grid = built or Built(), grid or Grid()
    parameters = grid.parameters
    start_q, start_v = pairs_of("--q0", q0), pairs_of("--v0", v0)
    with console.status(f"generating and compiling {model}"):
        chosen = find_model(model)
        stepper = build(chosen, **built.keywords())
    chosen_grid = grid.over(chosen.suggested)
    if inputs:
        chosen_grid["inputs"] = _inputs(inputs, stepper.manifest["inputs"])
    if stepper.manifest["inputs"] and chosen_grid["inputs"] is None:
        names = ", ".join(stepper.manifest["inputs"])
        notes.print(f"note: the inputs {names} stay zero: the model suggests none", style="yellow")
    q, v = _start(stepper, parameters, start_q, start_v, project)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        traj = _simulate(
            console,
            stepper,
            out,
            **chosen_grid,
            q0=q,
            v0=v,
            parameters=parameters,
            tol=tol,
            r=r,
            active_set=active_set,
            every=every,
            events=built.events,
        )
    for warning in caught:
        notes.print(f"note: {warning.message}", style="yellow", markup=False, highlight=False)
    if json:
        sys.stdout.write(jsonlib.dumps(report.summary(traj), indent=1) + "\n")
    else:
        report.show(console, traj, len(traj.events) if all_events else 12)
    if out is not None:
        console.print(f"trajectory: {traj.save(out)}", markup=False, highlight=False)
    if plot is not None:
        traj.plot(plot)
        console.print(f"plot: {plot}", markup=False, highlight=False)


def _inputs(words: list[str], names: list[str]) -> Callable[..., Any]:
    """Inputs from the command line: constants by name, or a function of a file."""
    if len(words) == 1 and "=" not in words[0]:
        from signorini.locate import find_function

        function: Callable[..., Any] = find_function(words[0])
        return function
    values = pairs_of("--inputs", words)
    for name in values:
        if name not in names:
            raise RunError(
                f"--inputs {name}: there is no such input; "
                + (f"there are: {', '.join(names)}" if names else "the model has none")
            )
    held = [values.get(name, 0.0) for name in names]
    return lambda t, q, v: held


def _start(
    stepper: Stepper,
    parameters: dict[str, float],
    q0: dict[str, float],
    v0: dict[str, float],
    project: bool,
) -> tuple[Any, Any]:
    if not project:
        return q0, v0
    return stepper.project(q0, v0, parameters=parameters)


def _simulate(console: Console, stepper: Stepper, out: Path | None, **arguments: Any) -> Trajectory:
    """Run with progress; what was done before a failure or an interruption is saved."""
    dt = arguments["dt"]
    long = dt is not None and dt > 0 and arguments["t_end"] / dt > _QUIET_STEPS
    columns = (TextColumn("steps"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not long, transient=True) as bar:
        task = bar.add_task("steps", total=None)

        def advance(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        try:
            return stepper.simulate(progress=advance, **arguments)
        except (StepError, KeyboardInterrupt) as error:
            partial = getattr(error, "trajectory", None)
            if out is not None and partial is not None:
                partial.save(out)
                console.print(f"the {len(partial) - 1} steps done are in {out}", markup=False)
            raise
