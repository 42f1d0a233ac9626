"""Studies, timings and the stress corpus."""

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table
from signorini.commands.base import Pairs, Switch, Whole, app
from signorini.runtime.errors import RunError


@contextlib.contextmanager
def from_source(command: str) -> Iterator[None]:
    """Say where a command is that the wheel leaves out."""
    try:
        yield
    except ModuleNotFoundError as error:
        if not (error.name or "").startswith("signorini."):
            raise
        raise RunError(
            f"'signorini {command}' belongs to the studies: install the wheel signorini_studies of "
            "the same version, or clone the project and install it with 'pip install -e .'"
        ) from None


@app.command
def reproduce(*names: str, out: Path) -> None:
    """Run the studies of the paper and beyond: figures, and a table of claims with verdicts.

    Parameters
    ----------
    names
        all, or some of fig3, fig4, fig6, fig8, fig9 (the paper's figures), orders,
        lost_impacts, bilateral (where its orders end), full_order (where they do not),
        energy, reversibility, work,
        moreau (a second scheme), high_orders, located (events at their own time).
    out
        Folder for figures (PNG, PDF), results.md and results.json.
    """
    with from_source("reproduce"):
        from signorini.studies import reproduce as study

    console = Console()
    study.chosen(names)
    with console.status("running") as status:
        claims = study.reproduce(names, out, status.update)
    table = Table(box=box.SIMPLE_HEAD)
    for heading in ("study", "claim", "measured, limit", "verdict"):
        table.add_column(heading)
    for c in claims:
        verdict = "[green]met[/green]" if c.met else "[red]missed[/red]"
        table.add_row(escape(c.study), escape(c.text), c.numbers, verdict)
    console.print(table)
    missed = sum(not c.met for c in claims)
    console.print(
        f"{len(claims) - missed} of {len(claims)} claims met; figures and tables: {out}",
        markup=False,
        highlight=False,
    )
    if missed:
        sys.exit(1)


@app.command
def growth(*, out: Path, largest: Whole | None = None) -> None:
    """Measure how generation, C size, compilation and steps grow with bodies and contacts.

    Parameters
    ----------
    out
        Folder for growth.md, growth.json and growth.png.
    largest
        Largest number of links or boxes, by default 32 and 16.
    """
    with from_source("growth"):
        from signorini.studies import growth as study

    console = Console()
    sizes = []
    with console.status("measuring") as status:
        for size in study.study(largest):
            sizes.append(size)
            status.update(f"measured: {size.family}, {size.count}")
    study.save(sizes, out)
    console.print(study.markdown(sizes), markup=False, highlight=False, soft_wrap=True)
    console.print(f"table, data and plot: {out}", markup=False, highlight=False)


@app.command
def bench(
    *,
    cases: Pairs = None,
    repeats: Whole = 51,
    native: Switch = False,
    counts: Switch = False,
    peers: Switch = False,
    store: Switch = False,
    out: Path | None = None,
    json: Switch = False,
) -> None:
    """Time steps: ours with their goals, other engines beside them, instructions for regressions.

    Parameters
    ----------
    cases
        Cases to time, by default all.
    repeats
        Repetitions of every run; the time of a step is their median.
    native
        Also with -march=native.
    counts
        Count instructions with valgrind and compare them with the stored counts.
    peers
        Also run the scenes in MuJoCo, Exudyn and Drake: pip install 'signorini[peers]'.
    store
        Keep the counted instructions as what later runs are compared with.
    out
        Folder for bench.md, bench.json and, with --peers, cost.png.
    json
        Print JSON instead of tables.
    """
    with from_source("bench"):
        from signorini.benchmarks import report

    if repeats < 1:
        raise RunError(f"repeats = {repeats}: give at least 1")
    if store and not counts:
        raise RunError("--store goes with --counts")
    console = Console(stderr=json)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    chosen = report.select(tuple(cases or ()))
    with console.status("timing") as status:
        results = report.measure(chosen, repeats, native, counts, peers, status.update)
    tables = [report.ours(results), *([report.others(results)] if peers else [])]
    if json:
        sys.stdout.write(results.to_json() + "\n")
        tables = []
    for head, rows in tables:
        table = Table(box=None, padding=(0, 0, 0, 1))
        for name in head:
            left = name in (head[0], "engine", "settings", "")
            table.add_column(name, justify="left" if left else "right")
        for row in rows:
            table.add_row(*row)
        console.print(table)
    if not json:
        console.print(report.NOTES, style="dim", highlight=False)
    if store:
        report.store_counts(results)
    if out is not None:
        (out / "bench.md").write_text(report.markdown(results), encoding="utf-8")
        (out / "bench.json").write_text(results.to_json() + "\n", encoding="utf-8")
        if peers:
            report.picture(results, out / "cost.png")
        console.print(f"page and data: {out}", highlight=False)


@app.command
def stress(
    *,
    scenes: Pairs = None,
    runs: Whole = 4,
    seed: Whole = 1,
    stages: Annotated[list[int] | None, Parameter(consume_multiple=True, negative=())] = None,
    workers: Whole | None = None,
    events: Literal["captured", "located"] = "captured",
    out: Path | None = None,
    replay: Path | None = None,
    times: Switch = False,
    json: Switch = False,
) -> None:
    """Run scenes that break time-steppers in great numbers and judge every step.

    A step that fails is written as a file that replays it alone, and examined: for up to four
    planar contacts all combinations of contact states are tried, which finds a solution or proves
    that there is none. The exit status is 1 if any other step failed.

    Parameters
    ----------
    scenes
        Scenes by name, by default those of the corpus.
    runs
        Runs of a scene with each number of stages; a few scenes get more, or less.
    seed
        Seed of the random starts.
    stages
        Numbers of stages, by default 2 3 4.
    workers
        Processes, by default one for each core.
    events
        located: steps are cut at impacts and changes of stick and slip.
    out
        Folder for stress.md, stress.json and files of failed steps.
    replay
        Take the failed step of this file again and examine it; run nothing else.
    times
        Take every run a second time and measure its steps: median, 99.9 % and worst in the table.
    json
        Print JSON instead of the table.
    """
    with from_source("stress"):
        from signorini.stress import report as reporting
        from signorini.stress.campaign import campaign, chosen

    console = Console(stderr=json)
    if replay is not None:
        for line in reporting.replay(replay):
            console.print(line, markup=False, highlight=False, soft_wrap=True)
        return
    names, numbers = chosen(scenes or ()), stages or [2, 3, 4]
    if runs < 1:
        raise RunError(f"--runs {runs}: give at least one")
    if workers is not None and workers < 1:
        raise RunError(f"--workers {workers}: give at least one")
    results = reporting.Results(names, numbers)
    interrupted, unproven = "", 0
    try:
        with Progress(console=console, transient=True) as bar:
            task = bar.add_task("steps", total=None)
            for result in campaign(names, numbers, runs, seed, workers, {"events": events}, times):
                results.add(result)
                bar.update(task, completed=results.total.steps)
        interrupted = "failed steps are not all examined"
        with console.status("examining failed steps"):
            unproven = results.examine()
        interrupted = ""
    except KeyboardInterrupt:
        interrupted = interrupted or "the table holds the runs that had ended"
    if json:
        sys.stdout.write(results.to_json() + "\n")
    else:
        results.show(console)
    if out is not None:
        results.save(out)
        console.print(f"table, data and failed steps: {out}", markup=False, highlight=False)
    if interrupted:
        console.print(f"interrupted: {interrupted}", markup=False, highlight=False)
        sys.exit(130)
    if unproven:
        sys.exit(1)
