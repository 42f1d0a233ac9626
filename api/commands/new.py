"""A first file of one's own."""

import keyword
from pathlib import Path
from typing import Literal

from rich.console import Console
from signorini import templates
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.names import check_identifier
from signorini.commands.base import Switch, app, check_file
from signorini.runtime.errors import RunError
from signorini.runtime.files import write_text

# Which text each kind starts from.
_TEXTS = {
    "plane": "new_plane.py.jinja",
    "space": "new_space.py.jinja",
    "lagrangian": "new_lagrangian.py.jinja",
    "casadi": "new_lagrangian.py.jinja",
}


@app.command
def new(
    file: Path,
    *,
    kind: Literal["plane", "space", "lagrangian", "casadi"] = "plane",
    force: Switch = False,
) -> None:
    """Write a small model that runs, to be changed into one's own.

    Parameters
    ----------
    file
        The file to write, ending in .py; its name becomes the model's.
    kind
        plane, space: bodies, joints and contacts without a Lagrangian; lagrangian: coordinates and
        a Lagrangian in SymPy; casadi: the same in CasADi.
    force
        Replace a file that is there.
    """
    name = file.stem
    if file.suffix != ".py":
        raise RunError(f"{file}: give a name that ends in .py")
    try:
        check_identifier(name, "its name", name, symbol=True)
    except ModelError as error:
        raise RunError(f"{file}: '{name}' cannot be a model's name. {error}") from None
    if keyword.iskeyword(name):
        raise RunError(f"{file}: '{name}' cannot be a model's name: it is a keyword of Python")
    check_file(file)
    if file.exists() and not force:
        raise RunError(f"{file} is there already: choose another name, or add --force")
    text = (
        templates.environment()
        .get_template(_TEXTS[kind])
        .render(name=name, file=file.name, kind=kind)
    )
    write_text(file, text)
    out = Console()
    for line in (
        f"{file}: a model that runs. Next:",
        f"  signorini run {file}",
        f"  signorini view {file}",
        f"  signorini check {file}",
    ):
        out.print(line, markup=False, highlight=False)
