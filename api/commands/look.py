"""The collection of models, and pictures of runs."""

import json as jsonlib
import sys
from pathlib import Path

from rich import box
from rich.console import Console
from rich.progress import track
from rich.table import Table
from signorini.commands.base import Grid, Real, Switch, Whole, app, check_figure, check_file
from signorini.runtime.errors import RunError
from signorini.runtime.storage import about_of
from signorini.runtime.trajectory import Trajectory


@app.command(name="list")
def list_models(*, json: Switch = False) -> None:
    """List the models that come with the package.

    Parameters
    ----------
    json
        Print JSON instead of a table.
    """
    from signorini.codegen.frontend.validate import freeze
    from signorini.locate import find_model, shipped

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 0, 0, 1))
    for heading in ("model", "", "n_q", "n_g", "n_gamma", "n_N", "n_F"):
        table.add_column(heading, justify="right" if heading.startswith("n_") else "left")
    found = []
    for name in shipped():
        data = freeze(find_model(name))
        sizes = {size: getattr(data, size) for size in ("n_q", "n_g", "n_gamma", "n_N", "n_F")}
        found.append({"model": name, "doc": data.doc, **sizes})
        table.add_row(name, data.doc, *map(str, sizes.values()))
    if json:
        sys.stdout.write(jsonlib.dumps(found, indent=1) + "\n")
    else:
        Console().print(table)


@app.command
def picture(
    model: str,
    *,
    out: Path,
    stages: Whole = 3,
    grid: Grid | None = None,
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
    poses
        Number of poses.
    """
    from signorini.locate import find_model
    from signorini.picture import draw
    from signorini.workflow import build

    check_figure("--out", out)
    if poses < 1:
        raise RunError(f"--poses {poses}: give at least one")
    grid = grid or Grid()
    parameters = grid.parameters
    chosen = find_model(model)
    console = Console()
    with console.status(f"generating, compiling and running {model}"):
        stepper = build(chosen, stages=stages)
        traj = stepper.simulate(parameters=parameters, **grid.over(chosen.suggested))
        draw(traj, out, poses)
    console.print(f"picture: {out}", markup=False, highlight=False)


@app.command
def view(
    model: str,
    *,
    run: Path | None = None,
    out: Path | None = None,
    stages: Whole = 3,
    grid: Grid | None = None,
    fps: Real = 30.0,
    speed: Real | None = None,
) -> None:
    """Show the motion of MODEL in the browser, or write it as a page or film.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function];
        or the .npz of a run of a shipped model.
    run
        Show this run, a file of 'signorini run --out', instead of making one.
    out
        File to write instead of opening a browser: .html, .gif or .mp4.
    stages
        Number of stages s of the Lobatto scheme, at least 2.
    fps
        Frames a second.
    speed
        Model seconds a second on the screen; by default 1, or what makes it last 3 to 20 s.
    """
    from signorini.locate import find_model, shipped
    from signorini.workflow import build

    if out is not None:
        check_file(out)
    if model.endswith(".npz"):
        run, model = Path(model), about_of(model)["model"]
        if model not in shipped():
            raise RunError(
                f"{run} is a run of your own model '{model}': say in which file it is, "
                f"signorini view FILE.py --run {run}"
            )
    grid = grid or Grid()
    chosen = find_model(model)
    console = Console(stderr=True)
    with console.status(f"generating, compiling and running {model}"):
        stepper = build(chosen, stages=stages)
        if run is not None:
            traj = Trajectory.load(run, stepper)
        else:
            traj = stepper.simulate(parameters=grid.parameters, **grid.over(chosen.suggested))
    shown = (
        traj.view(fps=fps, speed=speed) if out is None else traj.animate(out, fps=fps, speed=speed)
    )
    Console().print(f"motion: {shown}", markup=False, highlight=False)


@app.command
def gallery(*names: str, out: Path, moving: Switch = False) -> None:
    """Draw a picture of every shipped model into a folder.

    Parameters
    ----------
    names
        Models to draw, by default all.
    out
        Folder for the pictures.
    moving
        Pages in which the models run instead, as 'signorini web' writes them.
    """
    from signorini.commands.ways import events_of
    from signorini.locate import find_model, shipped
    from signorini.picture import draw
    from signorini.web import page_of
    from signorini.workflow import build

    console = Console()
    out.mkdir(parents=True, exist_ok=True)
    for name in track(names or shipped(), "drawing", console=console, transient=True):
        chosen = find_model(name)
        if moving:
            stepper = build(chosen, stages=2, events=events_of(chosen))
            about = Grid().over(chosen.suggested)
            page = page_of(stepper, dt=about["dt"], t_end=about["t_end"], inputs=about["inputs"])
            (out / f"{name}.html").write_text(page, encoding="utf-8")
        else:
            draw(build(chosen).simulate(**chosen.suggested), out / f"{name}.png")
    console.print(f"pictures: {out}", markup=False, highlight=False)
