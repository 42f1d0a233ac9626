"""The collection of models, and pictures of runs."""

from pathlib import Path

from rich import box
from rich.console import Console
from rich.progress import track
from rich.table import Table
from signorini.commands.base import Grid, Whole, app, check_figure
from signorini.runtime.errors import RunError


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
