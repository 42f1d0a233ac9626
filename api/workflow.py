"""The whole path: model -> C text -> compiled stepper."""

import difflib
import os
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from signorini.codegen.c import emit
from signorini.codegen.c.build import emit_spec
from signorini.codegen.frontend.errors import GenerationError
from signorini.codegen.frontend.model import Model
from signorini.codegen.frontend.names import HEADERS
from signorini.codegen.frontend.validate import freeze
from signorini.codegen.numpy import emit as numpy_target
from signorini.runtime.compile import cache_folder
from signorini.runtime.errors import StepError
from signorini.runtime.library import read_manifest
from signorini.runtime.stepper import Stepper, load
from signorini.verify.check import Checker
from signorini.verify.report import Report

_STAGES = (2, 3, 4, 5)  # that "auto" tries
_COARSE = 1e-4  # error that two stages are tried with
_PILOT = 1 << 20  # its runs keep no row but the last


def build(
    model: Model,
    *,
    stages: int | str = 3,
    scheme: str = "lobatto",
    velocity_constraints: str | None = None,
    prefix: str | None = None,
    precision: str = "double",
    events: str = "captured",
    derivatives: bool = False,
    max_couplings: int | None = None,
    error: float | None = None,
    t_end: float | None = None,
) -> Stepper:
    """Generate, compile and load a stepper of a model.

    Parameters
    ----------
    model : Model
        The model.
    stages : int or "auto"
        Number of stages s >= 2 of the scheme; smooth motion has order 2 s - 2. "auto": that of
        2, 3, 4, 5 with which a run as exact as `error` takes the least operations up to `t_end`,
        from the start and with the parameters of the model file, inputs being zero.
    scheme : {"lobatto", "moreau", "theta", "theta=0.7"}
        The variational scheme, or Moreau's midpoint rule, for which `stages` means nothing.
    velocity_constraints : {"paper", "full_order"}, optional
        "paper": gamma = 0 holds at the stage velocities V^i, (51), order s - 1 where its directions
        depend on q. "full_order": at auxiliary velocities, order 2 s - 2; for models without
        contacts, and their default.
    prefix : str, optional
        Prefix of the C names; the model's name by default.
    precision : {"double", "float", "extended"}
        Real type of the generated code. "extended" is C's ``long double`` (64 bits of mantissa on
        x86, 113 on 64-bit ARM under Linux), for verification: arrays that go in and come out are
        ``numpy.longdouble``; parameters, times and numbers of the model are those of double.
    events : {"captured", "located"}
        "located" makes a stepper that can cut its steps at impacts and changes of stick and slip,
        so that the order 2 s - 2 holds through them; runs say which of both they want. Scheme
        "lobatto" alone has it. A stepper that was built without it makes it on first use.
    derivatives : bool
        Whether steps can be differentiated, see `Stepper.simulate`; they can be cut at their events
        then, too. A stepper that was built without makes it on first use.
    max_couplings : int, optional
        In a model of many bodies: how many pairs of parts that contacts may join at once have room
        in a step, by default 64 or, if that is more, four for each part. More pairs that may touch
        make a step fail with the status CROWDED; fewer take less memory.
    error, t_end : float
        What ``stages="auto"`` is to be good at: as for `Stepper.simulate`; by default the time that
        the model suggests.

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
    if stages == "auto":
        return _with_least_work(
            model, error, t_end, scheme=scheme, velocity_constraints=velocity_constraints,
            prefix=prefix, precision=precision, derivatives=derivatives,
            max_couplings=max_couplings,
        )  # fmt: skip
    if isinstance(stages, str):
        raise GenerationError(f'stages = {stages!r}: give a number of at least 2, or "auto"')
    if error is not None or t_end is not None:
        raise GenerationError(
            'error and t_end say what stages = "auto" is to be good at; give them to simulate(...)'
        )
    stepper = build_files(
        _render(
            *(model, stages, scheme, velocity_constraints, prefix, precision, events, derivatives),
            max_couplings,
        )
    )
    again = partial(
        build, model, stages=stages, scheme=scheme, prefix=prefix, precision=precision,
        max_couplings=max_couplings,
    )  # fmt: skip
    stepper.locating = partial(again, events="located")
    stepper.differentiating = partial(again, derivatives=True)
    return stepper


def _with_least_work(
    model: Model, error: float | None, t_end: float | None, **options: Any
) -> Stepper:
    """The stepper that takes the least operations for an error."""
    if error is None:
        raise GenerationError(
            'stages = "auto" needs error: how exact runs are to be, e.g. error=1e-6'
        )
    end = model.suggested.get("t_end") if t_end is None else t_end
    if end is None:
        raise GenerationError('stages = "auto" needs t_end: the model suggests no time of a run')
    best: tuple[float, Stepper] | None = None
    for stages in _STAGES:
        stepper = build(model, stages=stages, events="located", **options)
        # two stages would take very many steps: their number follows from a larger error
        pilot = max(error, _COARSE) if stages == 2 else error
        cost = stepper.manifest["footprint"]
        work = cost["values"] + cost["derivatives"]
        work += 2 * cost["products"]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # a run that misses the wish is none to choose
                traj = stepper.simulate(t_end=end, error=pilot, every=_PILOT)
        except StepError:
            continue
        taken = work * float(traj.iterations.sum())
        taken *= (pilot / error) ** (1 / (2 * stages - 2))
        if not traj.missed and (best is None or taken < best[0]):
            best = taken, stepper
        elif best is not None and taken > 4 * best[0]:
            break  # more stages cost more from here on
    if best is None:
        raise GenerationError(
            f"model '{model.name}': with no number of stages a run up to t_end = {end:g} is as "
            f"exact as error = {error:g}. Give stages, and a larger error or an earlier end"
        )
    return best[1]


_build = build  # where an argument has the same name


def build_files(files: dict[str, str]) -> Stepper:
    """Write the files of a generated folder into the cache, compile and load them."""
    folder = cache_folder(files)
    if not _is_there(files, folder):
        try:
            emit.write(files, folder)
        except GenerationError:
            # Another process may have written the same content in the meantime.
            if not _is_there(files, folder):
                raise
    return load(folder)


def _is_there(files: dict[str, str], folder: Path) -> bool:
    """Whether the folder in the cache holds these files, undamaged."""
    try:
        return all((folder / name).read_bytes() == text.encode() for name, text in files.items())
    except OSError:
        return False


def generate(
    model: Model,
    out_dir: str | os.PathLike[str],
    *,
    stages: int = 3,
    scheme: str = "lobatto",
    velocity_constraints: str | None = None,
    prefix: str | None = None,
    precision: str = "double",
    events: str = "captured",
    derivatives: bool = False,
    max_couplings: int | None = None,
    target: str = "c",
    bind: Sequence[str] = (),
) -> Path:
    """Write the C stepper of a model into a folder, all files or none.

    Parameters
    ----------
    model : Model
        The model.
    out_dir : path
        Folder to write; an earlier generation in it is replaced.
    stages, scheme, velocity_constraints, prefix, precision, events, derivatives, max_couplings
        As for `build`.
    target : {"c", "numpy"}
        "numpy" writes the model's functions, without a scheme, as the module
        ``<prefix>_model.py``, which needs NumPy alone.
    bind : sequence of {"rust", "arduino", "octave"}
        What the folder is besides: a Rust crate, whose declarations bindgen makes when it is built;
        an Arduino library with a sketch; a function of Octave and MATLAB, in MEX.

    Returns
    -------
    Path
        The folder, or the module.

    Raises
    ------
    ModelError, GenerationError
        Before anything is written.
    """
    if target == "numpy":
        data = freeze(model)
        return numpy_target.write(data, out_dir, data.name if prefix is None else prefix)
    if target != "c":
        raise GenerationError(f"target {target!r} is unknown; choose c or numpy")
    return emit.write(
        _render(
            *(model, stages, scheme, velocity_constraints, prefix, precision, events, derivatives),
            *(max_couplings, bind),
        ),
        out_dir,
    )


def check(
    model: Model,
    *,
    stages: Sequence[int] = (2, 3, 4),
    seed: int = 0,
    sanitize: bool = False,
    progress: Callable[[str], None] | None = None,
    build: Callable[[Model, int], Stepper] | None = None,
    **options: Any,
) -> Report:
    """Prove that the generated C is the model.

    Every emitted function and derivative, all residuals and Jacobians, single steps from drawn
    states and a short run are compared with an independent implementation in NumPy and mpmath,
    every row in units of its own terms. What is checked is what `build` gives with the same
    options, and the report says what that covers.

    Parameters
    ----------
    model : Model
        The model.
    stages : sequence of int
        Numbers of stages to check.
    seed : int
        Seed of the random states.
    sanitize : bool
        Also run the generated example under the compiler's sanitizers.
    progress : callable (text), optional
        Told what is being compared.
    build : callable (model, stages) -> Stepper, optional
        Makes the stepper, e.g. loads what one ships; `signorini.build` by default.
    **options
        ``scheme``, ``velocity_constraints``, ``prefix``, ``precision`` as for `signorini.build`.

    Returns
    -------
    Report
        True in a condition if everything holds and every kind of motion of every contact was
        seen, or waived by the model and not seen. Its text says why it is false.

    Raises
    ------
    ModelError, GenerationError, CompilerError
        As for `build`.
    """
    if not stages:
        raise GenerationError("stages is empty: give at least one number of stages")
    freeze(model)
    if build is not None and options:
        raise GenerationError(
            f"build was given together with {', '.join(options)}: it decides on these itself"
        )
    make = build or (lambda m, s: _build(m, stages=s, **options))
    return Checker(model, make, seed, progress).run(list(stages), sanitize)


def drift(
    model: Model,
    folder: str | os.PathLike[str],
    *,
    stages: int | None = None,
) -> str:
    """Compare a generated folder with what the model generates now.

    Parameters
    ----------
    model : Model
        The model.
    folder : path
        A generated folder; its prefix, precision and, unless given, its stages are used.

    Returns
    -------
    str
        A unified diff, empty if the folder is up to date.
    """
    target = Path(folder)
    about = read_manifest(target)
    files = _render(
        model,
        about["stages"] if stages is None else stages,
        about["scheme"],
        # located steps have one form, and refuse to be asked for another
        None if about["events"] == "located" else about["velocity_constraints"],
        about["prefix"],
        about["precision"],
        about["events"],
        about["derivatives"],
        about["max_couplings"],
        emit.bindings_of(target),
    )
    lines: list[str] = []
    for name, text in files.items():
        path = target / name
        old = path.read_bytes() if path.is_file() else b""
        if old == text.encode():
            continue
        difference = list(
            difflib.unified_diff(
                old.decode("utf-8", "backslashreplace").splitlines(keepends=True),
                text.splitlines(keepends=True),
                f"{target / name}",
                f"{name} generated now",
            )
        )
        lines += difference or [f"{target / name} differs in bytes that do not show as text\n"]
    for path in sorted(target.glob("*.h")):
        if path.stem in HEADERS:
            lines.append(f"{path} hides a header of the C library and was not generated\n")
    return "".join(lines)


def _render(
    model: Model,
    stages: int,
    scheme: str,
    velocity_constraints: str | None,
    prefix: str | None,
    precision: str,
    events: str,
    derivatives: bool = False,
    max_couplings: int | None = None,
    bind: Sequence[str] = (),
) -> dict[str, str]:
    spec = emit_spec(
        freeze(model),
        stages=stages,
        scheme=scheme,
        velocity_constraints=velocity_constraints,
        prefix=prefix,
        precision=precision,
        events=events,
        derivatives=derivatives,
        max_couplings=max_couplings,
    )
    return emit.render(spec, bind)
