"""The build backend: setuptools, but for what a wheel holds and where an editable install is found.

A wheel holds what a user needs; the studies, whose numbers the documentation quotes, come with the
source. The package's folders stand at the top of the repository, so an editable install finds them
through an import hook. setuptools puts it behind the path, where a clone that lies beside a script
as a folder called signorini would come first, as an empty namespace package. Here it comes before.
"""

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import (
    build_sdist,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

_STUDIES = tuple(f"signorini/{name}/" for name in ("benchmarks", "stress", "studies"))
_BEHIND = "sys.meta_path.append(_EditableFinder)"
_BEFORE = "sys.meta_path.insert(0, _EditableFinder)"


def build_wheel(
    wheel_directory: str,
    config_settings: Any = None,
    metadata_directory: str | None = None,
) -> str:
    """Build a wheel without the studies."""
    name: str = build_meta.build_wheel(wheel_directory, config_settings, metadata_directory)
    _rewrite(
        Path(wheel_directory) / name,
        lambda file, content: None if file.startswith(_STUDIES) else content,
    )
    return name


def build_editable(
    wheel_directory: str,
    config_settings: Any = None,
    metadata_directory: str | None = None,
) -> str:
    """Build an editable wheel whose import hook comes before the path."""
    name: str = build_meta.build_editable(wheel_directory, config_settings, metadata_directory)

    def first(file: str, content: bytes) -> bytes:
        if file.endswith("_finder.py"):
            return content.replace(_BEHIND.encode(), _BEFORE.encode())
        return content

    _rewrite(Path(wheel_directory) / name, first)
    return name


def _rewrite(wheel: Path, change: Callable[[str, bytes], bytes | None]) -> None:
    """Change files of a wheel, or leave them out, with their lines in its record."""
    with zipfile.ZipFile(wheel) as source:
        entries = [(info, source.read(info)) for info in source.infolist()]
    changed: dict[str, bytes | None] = {}
    for info, content in entries:
        new = change(info.filename, content)
        if new != content:
            changed[info.filename] = new
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as target:
        for info, content in entries:
            if info.filename.endswith(".dist-info/RECORD"):
                target.writestr(info, _record(content.decode(), changed).encode())
            elif info.filename not in changed:
                target.writestr(info, content)
            elif (new := changed[info.filename]) is not None:
                target.writestr(info, new)


def _record(record: str, changed: dict[str, bytes | None]) -> str:
    """The record without files left out; hashes of changed ones are omitted, as they may be."""
    lines = []
    for line in record.splitlines():
        name = line.split(",")[0]
        if name not in changed:
            lines.append(line)
        elif changed[name] is not None:
            lines.append(f"{name},,")
    return "".join(f"{line}\n" for line in lines)


__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]
