"""The whole path: model -> C text -> compiled stepper."""

import os
from pathlib import Path

from signorini.codegen import emit
from signorini.codegen.errors import GenerationError
from signorini.codegen.model import Model
from signorini.codegen.spec import emit_spec
from signorini.codegen.validate import freeze
from signorini.runtime.compile import cache_folder
from signorini.runtime.library import load
from signorini.runtime.stepper import Stepper


def build(
    model: Model,
    *,
    stages: int = 3,
    scheme: str = "lobatto",
    velocity_constraints: str = "paper",
    prefix: str | None = None,
    precision: str = "double",
) -> Stepper:
    """Generate, compile and load a stepper of a model.

    Parameters
    ----------
    model : Model
        The model.
    stages : int
        Number of stages s >= 2 of the scheme; smooth motion has order 2 s - 2.
    scheme : str
        "lobatto".
    velocity_constraints : str
        "paper": gamma = 0 holds at the stage velocities V^i, (51).
    prefix : str, optional
        Prefix of the C names; the model's name by default.
    precision : {"double", "float"}
        Real type of the generated code.

    Returns
    -------
    Stepper

    Raises
    ------
    ModelError
        If the model is incomplete or wrong.
    GenerationError
        If an option is out of range.
    CompilerError
        If there is no C compiler or it fails.
    """
    files = _render(model, stages, scheme, velocity_constraints, prefix, precision)
    folder = cache_folder(files)
    if not (folder / "manifest.json").is_file():
        emit.write(files, folder)
    return load(folder)


def generate(
    model: Model,
    out_dir: str | os.PathLike[str],
    *,
    stages: int = 3,
    scheme: str = "lobatto",
    velocity_constraints: str = "paper",
    prefix: str | None = None,
    precision: str = "double",
) -> Path:
    """Write the C stepper of a model into a folder, all files or none.

    Parameters
    ----------
    model : Model
        The model.
    out_dir : path
        Folder to write; an earlier generation in it is replaced.
    stages, scheme, velocity_constraints, prefix, precision
        As for `build`.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    ModelError, GenerationError
        Before anything is written.
    """
    return emit.write(
        _render(model, stages, scheme, velocity_constraints, prefix, precision), out_dir
    )


def _render(
    model: Model,
    stages: int,
    scheme: str,
    velocity_constraints: str,
    prefix: str | None,
    precision: str,
) -> dict[str, str]:
    if velocity_constraints != "paper":
        raise GenerationError(
            f"velocity_constraints {velocity_constraints!r} is unknown; there is: paper"
        )
    spec = emit_spec(
        freeze(model), stages=stages, scheme=scheme, prefix=prefix, precision=precision
    )
    return emit.render(spec)
