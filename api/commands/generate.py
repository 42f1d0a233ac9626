"""C and what is derived for it: generate, check, show."""

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from rich.console import Console
from rich.table import Table
from signorini.commands.base import Built, Form, Switch, Whole, app
from signorini.runtime.errors import RunError


@app.command
def generate(
    model: str,
    *,
    built: Built | None = None,
    out: Path | None = None,
    prefix: str | None = None,
    target: Literal["c", "numpy"] = "c",
    derivatives: Switch = False,
    max_couplings: Whole | None = None,
    bind: Annotated[
        list[Literal["rust", "arduino", "octave"]] | None,
        Parameter(consume_multiple=True, negative=()),
    ] = None,
    check: Path | None = None,
) -> None:
    """Write the C stepper of MODEL into a folder.

    Parameters
    ----------
    model
        A shipped name (see 'signorini list'), path.py[:function] or package.module[:function].
    out
        Folder to write, by default ./<model>_c.
    prefix
        Prefix of the C names, by default the model's name.
    target
        c, or numpy: the model's functions as one Python module.
    derivatives
        Steps can be differentiated (p_step_forward), and cut at their events.
    max_couplings
        Pairs of parts that contacts may join at once, in a model of many bodies.
    bind
        rust, arduino, octave: the folder is a crate, an Arduino library, a function of Octave, too.
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
        **(built or Built()).keywords(),
        prefix=prefix,
        target=target,
        derivatives=derivatives,
        max_couplings=max_couplings,
        bind=bind or (),
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
    form: Form | None = None,
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
    prefix
        Prefix of the C names, by default the model's name.
    seed
        Seed of the random states.
    sanitize
        Also run the generated example under the compiler's sanitizers.
    json
        File for the report as JSON; --json=- prints it instead of the table.
    junit
        File for the report as JUnit XML.
    """
    from signorini.locate import find_model
    from signorini.workflow import check as compare

    printed = json is not None and str(json) == "-"
    console = Console(stderr=printed)
    for path in (json, junit):
        if path is not None and str(path) != "-" and not path.resolve().parent.is_dir():
            raise RunError(f"there is no folder {path.resolve().parent} for {path.name}")
    chosen = find_model(model)
    with console.status("comparing") as status:
        report = compare(
            chosen,
            stages=stages or (2, 3, 4),
            seed=seed,
            sanitize=sanitize,
            **(form or Form()).keywords(),
            prefix=prefix,
            progress=lambda text: status.update(f"{chosen.name}: {text}"),
        )
    if printed:
        sys.stdout.write(report.to_json() + "\n")
    else:
        report.show(console)
    for path, text in ((json, report.to_json), (junit, report.to_junit)):
        if path is not None and str(path) != "-":
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
