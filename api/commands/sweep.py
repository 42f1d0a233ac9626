"""A model over a grid of parameters and starts."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from signorini.commands.base import Built, Grid, Whole, app, check_figure
from signorini.runtime.errors import RunError


@app.command
def sweep(
    model: str,
    *,
    over: Annotated[list[str], Parameter(consume_multiple=True, negative=())],
    built: Built | None = None,
    grid: Grid | None = None,
    every: Whole = 1,
    last: Whole | None = None,
    batch: Whole | None = None,
    workers: Whole | None = None,
    scheduler: str | None = None,
    out: Path = Path("sweep.zarr"),
    plot: Path | None = None,
    show: str | None = None,
) -> None:
    """Run MODEL over a grid of parameters and initial values, on many processes.

    Results go to one Zarr store as they come. The same command again goes on after an
    interruption; batches that are in the store are not run again.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    over
        Axes, NAME=FIRST:LAST:COUNT or NAME=VALUE,VALUE,...; a parameter, a coordinate or a
        velocity (initial values).
    every
        Record every N-th step.
    last
        Keep only the last N recorded rows of each run; with --plot and --every the second half by
        default.
    batch
        Runs of a batch, by default so that each worker gets several.
    workers
        Processes on this machine, by default one for each processor.
    scheduler
        Address of a running Dask scheduler, in place of workers.
    out
        The store.
    plot
        Picture of one column of the rows kept against the first axis.
    show
        That column: a coordinate, velocity or output, energy, CONTACT.g_N, or smallest_gap,
        impacts, iterations, substeps of whole runs; by default the first coordinate.
    """
    from signorini import sweep as sweeping
    from signorini import swept
    from signorini.locate import find_model
    from signorini.workflow import build

    if workers is not None and scheduler is not None:
        raise RunError("--workers and --scheduler exclude each other")
    for option, value in (
        *(("--every", every), ("--last", last), ("--batch", batch), ("--workers", workers)),
    ):
        if value is not None and value < 1:
            raise RunError(f"{option} {value}: give at least one")
    console = Console()
    if plot is not None:
        check_figure("--plot", plot)
    with console.status(f"generating and compiling {model}"):
        chosen = find_model(model)
        keywords = (built or Built()).keywords()
        if grid is not None and grid.error is not None:
            keywords["events"] = "located"
        stepper = build(chosen, **keywords)
    axes = tuple(sweeping.axis(text) for text in over)
    sweeping.check_axes(stepper, axes)
    grid = grid or Grid()
    fixed = grid.parameters
    stepper.check_parameters(fixed)
    chosen_grid = replace(grid, error=None).over(chosen.suggested)
    end, h = chosen_grid["t_end"], chosen_grid["dt"]
    if not (h > 0 and end > stepper.initial_state(fixed)[0]):
        raise RunError(
            f"--dt {h:g} --t-end {end:g}: give a step size > 0 and an end after the start"
        )
    if plot is not None and every > 1 and last is None:
        # One picture a period: what a run settles to is seen in its second half.
        rows = round((end - stepper.initial_state(fixed)[0]) / h) // every
        last = max(1, rows // 2)
        notes = Console(stderr=True)
        notes.print(f"note: the last {last} of {rows} rows are kept; --last says otherwise")
    plan = sweeping.Sweep(axes, fixed, end, h, every, last, grid.error)
    column = swept.column_of(stepper.manifest, show)
    size = batch or max(1, min(256, plan.size // 64))
    with Progress(
        TextColumn("{task.completed} of {task.total} batches"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    ) as bar:
        task = bar.add_task("", total=None)
        store = sweeping.run_sweep(
            stepper,
            plan,
            out,
            batch=size,
            workers=workers,
            scheduler=scheduler,
            progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    for line in sweeping.summary(store):
        console.print(line, markup=False, highlight=False)
    console.print(f"store: {out}", markup=False, highlight=False, soft_wrap=True)
    if plot is not None:
        swept.diagram(store.group, column, plot)
        console.print(f"picture: {plot}", markup=False, highlight=False, soft_wrap=True)
