"""The command ``signorini``."""

import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, Parameter, Token
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
    track,
)
from rich.table import Table
from signorini.codegen.frontend.errors import GenerationError, ModelError
from signorini.runtime.arguments import plain_number
from signorini.runtime.compile import CompilerError
from signorini.runtime.errors import RunError, StepError
from signorini.runtime.files import check_ending
from signorini.runtime.stepper import Stepper
from signorini.runtime.trajectory import Trajectory
from signorini.version import __version__

_EXPECTED = (ModelError, GenerationError, CompilerError, RunError)
_QUIET_STEPS = 20_000  # runs shorter than this show no progress


def _decimal(kind: type, tokens: Sequence[Token]) -> Any:
    """A plain decimal number from the command line."""
    text = tokens[0].value
    number = plain_number(text)
    if number is None or (kind is int and not number.is_integer()):
        raise ValueError(
            f"{text!r} is no decimal number" if kind is float else f"{text!r} is no whole number"
        )
    return kind(number)


Real = Annotated[float, Parameter(converter=_decimal)]
Whole = Annotated[int, Parameter(converter=_decimal)]

app = App(
    name="signorini",
    help="From a symbolic mechanical model with contact to a standalone C stepper.",
    version=__version__,
    suppress_keyboard_interrupt=False,
)
Pairs = Annotated[list[str] | None, Parameter(consume_multiple=True, negative=())]
Switch = Annotated[bool, Parameter(negative=())]


def main() -> None:
    """Entry point: expected errors end with one message and exit status 1."""
    errors = Console(stderr=True)
    try:
        app()
    except StepError as error:
        errors.print(f"error: {error}", style="red", markup=False, highlight=False)
        sys.exit(1)
    except _EXPECTED as error:
        errors.print(f"error: {error}", style="red", markup=False, highlight=False)
        sys.exit(1)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        errors.print(f"error: {where}{error.strerror or error}", style="red", markup=False)
        sys.exit(1)
    except KeyboardInterrupt as interruption:
        text = f": {interruption}" if str(interruption) else ""
        errors.print(f"interrupted{text}", markup=False, highlight=False, soft_wrap=True)
        sys.exit(130)


@app.command
def run(
    model: str,
    *,
    stages: Whole = 3,
    scheme: str = "lobatto",
    velocity_constraints: Literal["paper", "full_order"] | None = None,
    dt: Real | None = None,
    t_end: Real | None = None,
    set: Pairs = None,
    q0: Pairs = None,
    v0: Pairs = None,
    tol: Real | None = None,
    r: Real | None = None,
    active_set: Literal["any_stage", "end"] = "any_stage",
    every: Whole = 1,
    precision: Literal["double", "float"] = "double",
    project: Switch = False,
    out: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Generate C for MODEL, compile it, run it, show the result.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    stages
        Number of stages s of the Lobatto scheme, at least 2.
    scheme
        lobatto; moreau (midpoint) or theta[=VALUE] (theta-method, 0.5 to 1): contacts on velocity
        level.
    velocity_constraints
        paper, or full_order: the default for models without contacts.
    dt
        Step size, by default what the model suggests or 0.01.
    t_end
        End of the run, by default what the model suggests or 2.
    set
        Parameters, NAME=VALUE ...
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
    precision
        Real type of the generated C.
    project
        Start from the nearest state that satisfies the constraints.
    out
        File for the trajectory: .npz (all that is known) or .csv (a table).
    plot
        File for a plot, e.g. run.png.
    """
    from signorini import report
    from signorini.locate import find_model
    from signorini.workflow import build

    console = Console()
    if out is not None:
        check_ending(out, (".npz", ".csv"))
        _check_file(out)
    if plot is not None:
        _check_figure("--plot", plot)
    parameters = _pairs("--set", set)
    start_q, start_v = _pairs("--q0", q0), _pairs("--v0", v0)
    with console.status(f"generating and compiling {model}"):
        chosen = find_model(model)
        stepper = build(
            chosen,
            stages=stages,
            scheme=scheme,
            velocity_constraints=velocity_constraints,
            precision=precision,
        )
    grid = {"dt": 1e-2, "t_end": 2.0, "inputs": None} | chosen.suggested
    if stepper.manifest["inputs"] and grid["inputs"] is None:
        names = ", ".join(stepper.manifest["inputs"])
        console.print(
            f"note: the inputs {names} stay zero: the model suggests none", style="yellow"
        )
    q, v = _start(stepper, parameters, start_q, start_v, project)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        traj = _simulate(
            console,
            stepper,
            out,
            t_end=grid["t_end"] if t_end is None else t_end,
            dt=grid["dt"] if dt is None else dt,
            inputs=grid["inputs"],
            q0=q,
            v0=v,
            parameters=parameters,
            tol=tol,
            r=r,
            active_set=active_set,
            every=every,
        )
    for warning in caught:
        console.print(f"note: {warning.message}", style="yellow", markup=False, highlight=False)
    report.show(console, traj)
    if out is not None:
        console.print(f"trajectory: {traj.save(out)}", markup=False, highlight=False)
    if plot is not None:
        report.plot(traj, plot)
        console.print(f"plot: {plot}", markup=False, highlight=False)


@app.command
def generate(
    model: str,
    *,
    stages: Whole = 3,
    scheme: str = "lobatto",
    velocity_constraints: Literal["paper", "full_order"] | None = None,
    out: Path | None = None,
    prefix: str | None = None,
    precision: Literal["double", "float"] = "double",
    target: Literal["c", "numpy"] = "c",
    check: Path | None = None,
) -> None:
    """Write the C stepper of MODEL into a folder.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    stages
        Number of stages s of the Lobatto scheme, at least 2.
    scheme
        lobatto; moreau (midpoint) or theta[=VALUE] (theta-method, 0.5 to 1): contacts on velocity
        level.
    velocity_constraints
        paper, or full_order: the default for models without contacts.
    out
        Folder to write, by default ./<model>_c.
    prefix
        Prefix of the C names, by default the model's name.
    precision
        Real type of the generated C.
    target
        c, or numpy: the model's functions as one Python module.
    check
        Write nothing; compare this generated folder with the model and show what differs.
    """
    from signorini.locate import find_model
    from signorini.workflow import drift
    from signorini.workflow import generate as write

    chosen = find_model(model)
    if check is not None:
        difference = drift(chosen, check)
        if difference:
            sys.stdout.write(difference)
            raise RunError(f"{check} has drifted from the model: generate it again")
        Console().print(f"{check} is what the model generates", markup=False, highlight=False)
        return
    folder = write(
        chosen,
        Path(f"{chosen.name}_c") if out is None else out,
        stages=stages,
        scheme=scheme,
        velocity_constraints=velocity_constraints,
        prefix=prefix,
        precision=precision,
        target=target,
    )
    console = Console()
    if folder.is_file():
        console.print(f"module: {folder}", markup=False, highlight=False, soft_wrap=True)
        return
    table = Table(title=f"{folder}", title_justify="left")
    table.add_column("file")
    table.add_column("bytes", justify="right")
    for path in sorted(folder.iterdir()):
        if path.is_file():
            table.add_row(path.name, str(path.stat().st_size))
    console.print(table)
    console.print(
        f"build and run: make -C {folder} && {folder}/example", markup=False, highlight=False
    )


@app.command
def check(
    model: str,
    *,
    stages: Annotated[list[int] | None, Parameter(consume_multiple=True, negative=())] = None,
    scheme: str = "lobatto",
    velocity_constraints: Literal["paper", "full_order"] | None = None,
    precision: Literal["double", "float"] = "double",
    prefix: str | None = None,
    seed: Whole = 0,
    sanitize: Switch = False,
    json: Path | None = None,
    junit: Path | None = None,
) -> None:
    """Prove that the C generated from MODEL is MODEL.

    Compares every emitted function and derivative, residuals and Jacobians, single steps from drawn
    states and a short run with an independent implementation. The exit status is 1 if anything
    fails or a kind of motion of a contact was never seen.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    stages
        Numbers of stages to check, by default 2 3 4.
    scheme
        lobatto, moreau, or theta[=VALUE].
    velocity_constraints
        paper, or full_order: the default for models without contacts.
    precision
        Real type of the generated C.
    prefix
        Prefix of the C names, by default the model's name.
    seed
        Seed of the random states.
    sanitize
        Also run the generated example under the compiler's sanitizers.
    json
        File for the report as JSON.
    junit
        File for the report as JUnit XML.
    """
    from signorini.locate import find_model
    from signorini.workflow import check as compare

    console = Console()
    for path in (json, junit):
        if path is not None and not path.resolve().parent.is_dir():
            raise RunError(f"there is no folder {path.resolve().parent} for {path.name}")
    chosen = find_model(model)
    with console.status("comparing") as status:
        report = compare(
            chosen,
            stages=stages or (2, 3, 4),
            seed=seed,
            sanitize=sanitize,
            scheme=scheme,
            velocity_constraints=velocity_constraints,
            precision=precision,
            prefix=prefix,
            progress=lambda text: status.update(f"{chosen.name}: {text}"),
        )
    report.show(console)
    for path, text in ((json, report.to_json), (junit, report.to_junit)):
        if path is not None:
            path.write_text(text() + "\n", encoding="utf-8")
    if not report:
        sys.exit(1)


@app.command
def show(
    model: str,
    *,
    quantity: Annotated[list[str] | None, Parameter(consume_multiple=True, negative=())] = None,
    latex: Switch = False,
) -> None:
    """Print what is derived from MODEL: sizes, sparsity, operations and expressions.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    quantity
        Names of derived quantities, e.g. W_N or g_N_q; by default all, long ones as a size only.
    latex
        Print LaTeX instead of text.
    """
    from signorini import show as showing
    from signorini.locate import find_model

    chosen = find_model(model)
    quantities = showing.derived(chosen, tuple(quantity or ()))
    if latex:
        sys.stdout.write(showing.latex(quantities) + "\n")
    else:
        showing.show(Console(), chosen, quantities)


@app.command
def picture(
    model: str,
    *,
    out: Path,
    stages: Whole = 3,
    dt: Real | None = None,
    t_end: Real | None = None,
    set: Pairs = None,
    poses: Whole = 8,
) -> None:
    """Run MODEL and draw superimposed poses of its shapes, or curves over time.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    out
        File for the picture: .png, .pdf or .svg.
    stages
        Number of stages s of the Lobatto scheme, at least 2.
    dt
        Step size, by default what the model suggests or 0.01.
    t_end
        End of the run, by default what the model suggests or 2.
    set
        Parameters, NAME=VALUE ...
    poses
        Number of poses.
    """
    from signorini.locate import find_model
    from signorini.picture import draw
    from signorini.workflow import build

    _check_figure("--out", out)
    if poses < 1:
        raise RunError(f"--poses {poses}: give at least one")
    parameters = _pairs("--set", set)
    chosen = find_model(model)
    console = Console()
    with console.status(f"generating, compiling and running {model}"):
        stepper = build(chosen, stages=stages)
        grid = {"dt": 1e-2, "t_end": 2.0} | chosen.suggested
        grid |= {k: v for k, v in (("dt", dt), ("t_end", t_end)) if v is not None}
        traj = stepper.simulate(parameters=parameters, **grid)
        draw(chosen, traj, out, parameters, poses)
    console.print(f"picture: {out}", markup=False, highlight=False)


@app.command
def gallery(*names: str, out: Path) -> None:
    """Draw a picture of every shipped model into a folder.

    Parameters
    ----------
    names
        Models to draw, by default all.
    out
        Folder for the pictures.
    """
    from signorini.locate import find_model, shipped
    from signorini.picture import draw
    from signorini.workflow import build

    console = Console()
    out.mkdir(parents=True, exist_ok=True)
    for name in track(names or shipped(), "drawing", console=console, transient=True):
        chosen = find_model(name)
        traj = build(chosen).simulate(**chosen.suggested)
        draw(chosen, traj, out / f"{name}.png", {})
    console.print(f"pictures: {out}", markup=False, highlight=False)


@app.command
def reproduce(*names: str, out: Path) -> None:
    """Run the studies of the paper and beyond: figures, and a table of claims with verdicts.

    Parameters
    ----------
    names
        all, or some of fig3, fig4, fig6, fig8, fig9 (the paper's figures), orders,
        lost_impacts, bilateral (where its orders end), full_order (where they do not),
        energy, reversibility, work,
        moreau (a second scheme), high_orders.
    out
        Folder for figures (PNG, PDF), results.md and results.json.
    """
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
    """
    from signorini.benchmarks import report

    if repeats < 1:
        raise RunError(f"repeats = {repeats}: give at least 1")
    if store and not counts:
        raise RunError("--store goes with --counts")
    console = Console()
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    chosen = report.select(tuple(cases or ()))
    with console.status("timing") as status:
        results = report.measure(chosen, repeats, native, counts, peers, status.update)
    tables = [report.ours(results), *([report.others(results)] if peers else [])]
    for head, rows in tables:
        table = Table(box=None, padding=(0, 0, 0, 1))
        for name in head:
            left = name in (head[0], "engine", "settings", "")
            table.add_column(name, justify="left" if left else "right")
        for row in rows:
            table.add_row(*row)
        console.print(table)
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
    out: Path | None = None,
    replay: Path | None = None,
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
    out
        Folder for stress.md, stress.json and files of failed steps.
    replay
        Take the failed step of this file again and examine it; run nothing else.
    """
    from signorini.stress import report as reporting
    from signorini.stress.campaign import campaign, chosen

    console = Console()
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
            for result in campaign(names, numbers, runs, seed, workers):
                results.add(result)
                bar.update(task, completed=results.total.steps)
        interrupted = "failed steps are not all examined"
        with console.status("examining failed steps"):
            unproven = results.examine()
        interrupted = ""
    except KeyboardInterrupt:
        interrupted = interrupted or "the table holds the runs that had ended"
    results.show(console)
    if out is not None:
        results.save(out)
        console.print(f"table, data and failed steps: {out}", markup=False, highlight=False)
    if interrupted:
        console.print(f"interrupted: {interrupted}", markup=False, highlight=False)
        sys.exit(130)
    if unproven:
        sys.exit(1)


@app.command(name="list")
def list_models() -> None:
    """List the models that come with the package."""
    from signorini.codegen.frontend.validate import freeze
    from signorini.locate import find_model, shipped

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 0, 0, 1))
    for heading in ("model", "", "n_q", "n_g", "n_gamma", "n_N", "n_F"):
        table.add_column(heading, justify="right" if heading.startswith("n_") else "left")
    for name in shipped():
        data = freeze(find_model(name))
        sizes = (data.n_q, data.n_g, data.n_gamma, data.n_N, data.n_F)
        table.add_row(name, data.doc, *map(str, sizes))
    Console().print(table)


def _check_file(path: Path) -> None:
    if not path.resolve().parent.is_dir():
        raise RunError(f"there is no folder {path.resolve().parent} for {path.name}")
    if path.is_dir():
        raise RunError(f"{path} is a folder: give a file name")


def _check_figure(option: str, path: Path) -> None:
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise RunError(f"{option} {path}: give a name that ends in .png, .pdf or .svg")
    _check_file(path)


@app.command
def sweep(
    model: str,
    *,
    over: Annotated[list[str], Parameter(consume_multiple=True, negative=())],
    set: Pairs = None,
    stages: Whole = 3,
    scheme: str = "lobatto",
    precision: Literal["double", "float"] = "double",
    dt: Real | None = None,
    t_end: Real | None = None,
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
    set
        Parameters of all runs, NAME=VALUE ...
    stages
        Number of stages s of the Lobatto scheme, at least 2.
    scheme
        lobatto; moreau (midpoint) or theta[=VALUE] (theta-method, 0.5 to 1): contacts on velocity
        level.
    precision
        Real type of the generated C.
    dt
        Step size, by default what the model suggests or 0.01.
    t_end
        End of the runs, by default what the model suggests or 2.
    every
        Record every N-th step.
    last
        Keep only the last N recorded rows of each run.
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
        That column, by default the first coordinate.
    """
    from signorini import sweep as sweeping
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
        _check_figure("--plot", plot)
    with console.status(f"generating and compiling {model}"):
        chosen = find_model(model)
        stepper = build(chosen, stages=stages, scheme=scheme, precision=precision)
    grid = {"dt": 1e-2, "t_end": 2.0} | chosen.suggested
    axes = tuple(sweeping.axis(text) for text in over)
    sweeping.check_axes(stepper, axes)
    fixed = _pairs("--set", set)
    stepper.check_parameters(fixed)
    end, h = (grid[k] if x is None else x for k, x in (("t_end", t_end), ("dt", dt)))
    if not (h > 0 and end > stepper.initial_state(fixed)[0]):
        raise RunError(
            f"--dt {h:g} --t-end {end:g}: give a step size > 0 and an end after the start"
        )
    plan = sweeping.Sweep(axes, fixed, end, h, every, last)
    column = sweeping.column_of(stepper, show) if plot is not None else None
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
    if plot is not None and column is not None:
        sweeping.diagram(store, *column, plot)
        console.print(f"picture: {plot}", markup=False, highlight=False, soft_wrap=True)


def _pairs(option: str, pairs: list[str] | None) -> dict[str, float]:
    """NAME=VALUE ... as a dictionary."""
    values: dict[str, float] = {}
    for pair in pairs or []:
        name, equals, text = pair.partition("=")
        number = plain_number(text)
        if not name or not equals or number is None:
            raise RunError(f"{option} {pair}: write NAME=VALUE with a finite decimal number")
        if name in values:
            raise RunError(f"{option}: '{name}' is given twice")
        values[name] = number
    return values


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
    long = arguments["t_end"] / arguments["dt"] > _QUIET_STEPS if arguments["dt"] > 0 else False
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


if __name__ == "__main__":
    main()
