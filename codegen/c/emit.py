"""Rendering of the templates and writing of a folder, all or nothing."""

import json
import os
import shutil
import tempfile
import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import jinja2
from signorini import templates
from signorini.codegen.c.manifest import manifest
from signorini.codegen.c.spec import EmitSpec
from signorini.codegen.frontend.errors import GenerationError

# Name of each file in the folder, with the template it comes from.
TEMPLATES = {
    "{prefix}.h": "stepper.h.jinja",
    "{prefix}.c": "stepper.c.jinja",
    "{prefix}_model.c": "model.c.jinja",
    "{prefix}_unity.h": "unity.h.jinja",
    "example.c": "example.c.jinja",
    "Makefile": "Makefile.jinja",
    "CMakeLists.txt": "CMakeLists.txt.jinja",
    "README.md": "README.md.jinja",
}
# The same where steps are differentiated, of double precision, which is that of other programs.
EXTERNAL = {"{prefix}_casadi.c": "casadi.c.jinja"}
# What makes the folder a package of another language or system as well.
BINDINGS = {
    "rust": {
        "Cargo.toml": "Cargo.toml.jinja",
        "build.rs": "build.rs.jinja",
        "lib.rs": "lib.rs.jinja",
        "run.rs": "run.rs.jinja",
    },
    "arduino": {
        "library.properties": "library.properties.jinja",
        "examples/run/run.ino": "sketch.ino.jinja",
    },
    "octave": {
        "{prefix}_mex.c": "mex.c.jinja",
        "make_mex.m": "make_mex.m.jinja",
        "run_mex.m": "run_mex.m.jinja",
    },
}
RUNTIME_BEGIN = "/* ==== runtime, the same for every model ==== begin ==== */"
RUNTIME_END = "/* ==== runtime, the same for every model ==== end ==== */"
TABLES_BEGIN = "/* ==== tables of this model ==== begin ==== */"
TABLES_END = "/* ==== tables of this model ==== end ==== */"
# Every generated text says so near its top, by the name of this package.
_MARK = "signorini"
_MARKED = 600  # characters


@cache
def _environment() -> jinja2.Environment:
    environment = templates.environment()
    environment.filters["comment"] = comment_text
    return environment


def comment_text(text: str) -> str:
    """Text that may stand in a C comment on one line, ASCII only."""
    flat = " ".join(str(text).split())
    plain = flat.encode("ascii", "backslashreplace").decode()
    return plain.replace("*/", "* /").replace("/*", "/ *").replace("\\", "|")


def render(spec: EmitSpec, bind: Sequence[str] = ()) -> dict[str, str]:
    """Return the text of every file of the generated folder by name; `bind` are names of BINDINGS.

    Raises
    ------
    GenerationError
        For another name, or a precision that the language does not have.
    """
    wanted = spec.forward is not None and spec.precision.name == "double"
    templates_of = dict(TEMPLATES) | (EXTERNAL if wanted else {})
    for name in bind:
        if name not in BINDINGS:
            raise GenerationError(f"bind = {name!r}: choose among {', '.join(BINDINGS)}")
        if name == "rust" and spec.precision.name == "extended":
            raise GenerationError(
                f"model '{spec.model}', bind = 'rust': Rust has no extended precision. Give "
                "precision='double' or 'float'"
            )
        templates_of |= BINDINGS[name]
    files = {
        name.format(prefix=spec.prefix): _environment()
        .get_template(template)
        .render(
            spec=spec,
            runtime_begin=RUNTIME_BEGIN,
            runtime_end=RUNTIME_END,
            tables_begin=TABLES_BEGIN,
            tables_end=TABLES_END,
        )
        for name, template in templates_of.items()
    }
    files["manifest.json"] = json.dumps(manifest(spec), indent=1, ensure_ascii=True) + "\n"
    return files


def write(files: dict[str, str], out_dir: str | os.PathLike[str]) -> Path:
    """Write the files into `out_dir`, replacing an earlier generation as a whole.

    The new folder is made beside the old one, gets what else stands in that, and takes its place in
    one step where the system can do that; elsewhere the manifest, without which a folder is not
    loaded, is written last. A run that was killed leaves nothing that the next one does not remove.

    Raises
    ------
    GenerationError
        If the folder holds files of these names that no generator wrote, or cannot be written.
    """
    if not isinstance(out_dir, (str, os.PathLike)) or "\0" in os.fspath(out_dir):
        raise GenerationError(f"out_dir = {out_dir!r}: give a folder")
    target = Path(out_dir)
    _check_target(target, files)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        staging = staging_folder(target.parent)
    except OSError as error:
        raise GenerationError(f"cannot write to {target}: {error.strerror}") from None
    try:
        for name, text in files.items():
            (staging / name).parent.mkdir(parents=True, exist_ok=True)
            (staging / name).write_bytes(text.encode("utf-8"))
        staging.chmod(0o755)
        if not target.exists():
            staging.replace(target)
        else:
            _keep_others(target, staging, set(files))
            if not _exchange(staging, target):
                _replace_one_by_one(staging, target, files)
    except OSError as error:
        raise GenerationError(f"cannot write to {target}: {error.strerror}") from None
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    return target


_STAGING = ".signorini-"


def staging_folder(parent: Path) -> Path:
    """A new hidden folder to be filled and put in its place; those of dead processes go."""
    _remove_left_over(parent)
    return Path(tempfile.mkdtemp(prefix=f"{_STAGING}{os.getpid()}-", dir=parent))


def _remove_left_over(parent: Path) -> None:
    """Remove folders of runs that were killed: the process in their name is gone."""
    for path in parent.glob(f"{_STAGING}*-*"):
        number = path.name.removeprefix(_STAGING).partition("-")[0]
        ours = number.isdigit() and path.is_dir() and not path.is_symlink()
        if ours and not _is_alive(int(number), path):
            shutil.rmtree(path, ignore_errors=True)


def _is_alive(process: int, folder: Path) -> bool:
    """Whether the process that made a folder may still fill it."""
    if os.name == "nt":  # a signal of number zero would end it there: an hour is long enough
        return time.time() - folder.stat().st_mtime < 3600
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _keep_others(target: Path, staging: Path, names: set[str]) -> None:
    """Link or copy what a user has in the folder into the new one."""
    old = _old_files(target)

    def own(folder: str, entries: list[str]) -> set[str]:
        place = Path(folder).relative_to(target).as_posix()
        return {entry for entry in entries if f"{place}/{entry}" in names | old}

    def link(one: str, other: str) -> None:
        try:
            os.link(one, other, follow_symlinks=False)
        except OSError:
            shutil.copy2(one, other, follow_symlinks=False)

    for path in target.iterdir():
        if path.name in names or path.name in old:
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.copytree(
                *(path, staging / path.name),
                symlinks=True,
                copy_function=link,
                ignore=own,
                dirs_exist_ok=True,
            )
        else:
            link(str(path), str(staging / path.name))


def _exchange(one: Path, other: Path) -> bool:
    """Let two folders change places in one step; false where the system cannot."""
    import ctypes

    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError, TypeError):
        return False
    here, exchange = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    done: int = rename(here, os.fsencode(one), here, os.fsencode(other), exchange)
    return done == 0


def _replace_one_by_one(staging: Path, target: Path, files: dict[str, str]) -> None:
    old = _old_files(target)
    (target / "manifest.json").unlink(missing_ok=True)
    for name in sorted(files, key=lambda name: name == "manifest.json"):
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        (staging / name).replace(target / name)
    for name in old - set(files):
        (target / name).unlink(missing_ok=True)


def _old_files(target: Path) -> set[str]:
    """Names that an earlier generation wrote into the folder: they say so themselves."""
    of_bindings = (name for files in BINDINGS.values() for name in files)
    return {
        path.relative_to(target).as_posix()
        for name in ("manifest.json", *TEMPLATES, *EXTERNAL, *of_bindings)
        for path in target.glob(name.format(prefix="*"))
        if _is_generated(path)
    }


def bindings_of(folder: Path) -> tuple[str, ...]:
    """What a generated folder is a package of."""
    return tuple(
        name
        for name, files in BINDINGS.items()
        if any(
            _is_generated(path) for file in files for path in folder.glob(file.format(prefix="*"))
        )
    )


def _is_generated(path: Path) -> bool:
    """Whether a file is a plain file that says that this package made it."""
    if path.is_symlink() or not path.is_file():
        return False
    try:
        with path.open(encoding="utf-8", errors="replace") as stream:
            return _MARK in stream.read(_MARKED)
    except OSError:
        return False


def _check_target(target: Path, files: dict[str, str]) -> None:
    if target.exists() and not target.is_dir():
        raise GenerationError(f"{target} is a file: give a folder")
    if not target.is_dir() or not any(target.iterdir()):
        return
    clash = sorted(
        name for name in files if (target / name).exists() and not _is_generated(target / name)
    )
    if clash:
        raise GenerationError(
            f"{target} holds {', '.join(clash)} that this generator did not write: "
            "give an empty folder or a new one"
        )
