"""Rendering of the templates and writing of a folder, all or nothing."""

import json
import os
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from signorini.codegen.errors import GenerationError
from signorini.codegen.spec import EmitSpec, manifest

# Name of each file in the folder, with the template it comes from.
TEMPLATES = {
    "{prefix}.h": "stepper.h.jinja",
    "{prefix}.c": "stepper.c.jinja",
    "example.c": "example.c.jinja",
    "Makefile": "Makefile.jinja",
    "CMakeLists.txt": "CMakeLists.txt.jinja",
    "README.md": "README.md.jinja",
}
RUNTIME_BEGIN = "/* ==== runtime, the same for every model ==== begin ==== */"
RUNTIME_END = "/* ==== runtime, the same for every model ==== end ==== */"


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("signorini.templates", ""),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    environment.filters["comment"] = comment_text
    return environment


def comment_text(text: str) -> str:
    """Text that may stand in a C comment on one line, ASCII only."""
    flat = " ".join(str(text).split())
    plain = flat.encode("ascii", "backslashreplace").decode()
    return plain.replace("*/", "* /").replace("/*", "/ *").replace("\\", "|")


def render(spec: EmitSpec) -> dict[str, str]:
    """Return the text of every file of the generated folder by name."""
    files = {
        name.format(prefix=spec.prefix): _environment()
        .get_template(template)
        .render(spec=spec, runtime_begin=RUNTIME_BEGIN, runtime_end=RUNTIME_END)
        for name, template in TEMPLATES.items()
    }
    files["manifest.json"] = json.dumps(manifest(spec), indent=1, ensure_ascii=True) + "\n"
    return files


def write(files: dict[str, str], out_dir: str | os.PathLike[str]) -> Path:
    """Write the files into `out_dir`, replacing an earlier generation, all or nothing.

    Raises
    ------
    GenerationError
        If the folder holds other things than generated files, or cannot be written.
    """
    if not isinstance(out_dir, (str, os.PathLike)) or "\0" in os.fspath(out_dir):
        raise GenerationError(f"out_dir = {out_dir!r}: give a folder")
    target = Path(out_dir)
    _check_target(target, files)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=".signorini-", dir=target.parent))
    except OSError as error:
        raise GenerationError(f"cannot write to {target}: {error.strerror}") from None
    try:
        for name, text in files.items():
            (staging / name).write_bytes(text.encode("utf-8"))
        staging.chmod(0o755)
        if target.exists():
            old = _old_files(target)
            for name in files:
                os.replace(staging / name, target / name)
            for name in old - set(files):
                (target / name).unlink()
        else:
            os.replace(staging, target)
    except OSError as error:
        raise GenerationError(f"cannot write to {target}: {error.strerror}") from None
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    return target


def _old_files(target: Path) -> set[str]:
    """Names that an earlier generation wrote into the folder."""
    try:
        old: dict[str, Any] = json.loads((target / "manifest.json").read_text(encoding="utf-8"))
        prefix = old["prefix"]
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    names = {name.format(prefix=prefix) for name in TEMPLATES} | {"manifest.json"}
    return {name for name in names if (target / name).is_file()}


def _check_target(target: Path, files: dict[str, str]) -> None:
    if target.exists() and not target.is_dir():
        raise GenerationError(f"{target} is a file: give a folder")
    if not target.is_dir() or not any(target.iterdir()):
        return
    old = _old_files(target)
    clash = sorted(name for name in files if (target / name).exists() and name not in old)
    if clash:
        raise GenerationError(
            f"{target} holds {', '.join(clash)} that this generator did not write: "
            "give an empty folder or a new one"
        )
