"""Ways out: a model as a unit for other programs."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from rich.console import Console
from signorini.codegen.frontend.model import Model
from signorini.codegen.frontend.validate import freeze
from signorini.codegen.schemes import unlocated
from signorini.commands.base import Grid, Switch, Whole, app
from signorini.runtime.errors import RunError


def events_of(model: Model) -> str:
    """How a unit or a page treats impacts: located wherever that is possible."""
    return "captured" if unlocated(freeze(model)) else "located"


@app.command
def fmu(
    model: str,
    *,
    out: Path | None = None,
    fmi: Literal["2", "3"] = "3",
    stages: Whole = 3,
    grid: Grid | None = None,
    sources_only: Switch = False,
    systems: Annotated[list[str] | None, Parameter(consume_multiple=True, negative=())] = None,
) -> None:
    """Write MODEL as a functional mock-up unit for co-simulation.

    The unit has the parameters, coordinates, velocities, inputs and outputs of the model, and gaps,
    mean forces and states of its contacts. Impacts are located within its steps.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    out
        File to write, by default ./<model>.fmu.
    fmi
        Version of the standard.
    stages
        Number of stages s of the Lobatto scheme, at least 2.
    sources_only
        Leave the binary of this machine out.
    systems
        Other systems whose binaries go into it, compiled by zig: x86_64-windows, x86_64-linux,
        aarch64-linux, x86_64-darwin, aarch64-darwin.
    """
    from signorini.fmu import write_fmu
    from signorini.locate import find_model
    from signorini.workflow import build

    grid = grid or Grid()
    if grid.set or grid.error is not None:
        raise RunError("a unit has its parameters and its error set by the program that runs it")
    chosen = find_model(model)
    path = Path(f"{chosen.name}.fmu") if out is None else out
    suggested = grid.over(chosen.suggested)
    console = Console()
    with console.status(f"generating and compiling {model}"):
        stepper = build(chosen, stages=stages, events=events_of(chosen))
        write_fmu(
            stepper, path, fmi=int(fmi), dt=suggested["dt"], t_end=suggested["t_end"],
            binary=not sources_only, systems=systems or (),
        )  # fmt: skip
    console.print(f"unit: {path}", markup=False, highlight=False, soft_wrap=True)


@app.command
def web(
    model: str,
    *,
    out: Path | None = None,
    stages: Whole = 3,
    grid: Grid | None = None,
) -> None:
    """Write MODEL as a page for a browser, in which it runs.

    The page opens from the file. It has the stepper in WebAssembly, a picture of the bodies,
    sliders for the parameters, fields for the start, inputs by keys, and plots. Impacts are located
    within its steps.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    out
        Folder of the page, by default ./<model>_page.
    stages
        Number of stages s of the Lobatto scheme, at least 2.
    """
    from signorini.locate import find_model
    from signorini.web import write_page
    from signorini.workflow import build

    grid = grid or Grid()
    if grid.error is not None:
        raise RunError("a page takes steps of one size: give --dt instead of --error")
    chosen = find_model(model)
    folder = Path(f"{chosen.name}_page") if out is None else out
    suggested = grid.over(chosen.suggested)
    console = Console()
    with console.status(f"generating and compiling {model}"):
        stepper = build(chosen, stages=stages, events=events_of(chosen))
        path = write_page(
            stepper, folder, dt=suggested["dt"], t_end=suggested["t_end"],
            inputs=suggested["inputs"], parameters=grid.parameters,
        )  # fmt: skip
    size = path.stat().st_size / 1000
    console.print(f"page: {path} ({size:.0f} kB)", markup=False, highlight=False, soft_wrap=True)
