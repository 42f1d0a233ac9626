"""The build backend: setuptools, but for what a wheel holds and where an editable install is found.

A wheel holds what a user needs. The studies, whose numbers the documentation quotes, are a wheel of
their own: `python -m build --wheel -C part=studies`. The package's folders stand at the top of the
repository, so an editable install finds them through an import hook. setuptools puts it behind the
path, where a clone that lies beside a script as a folder called signorini would come first, as an
empty namespace package. Here it comes before.
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
    """Build a wheel without the studies, or of the studies alone."""
    settings = dict(config_settings or {})
    part = settings.pop("part", "")
    if part not in ("", "studies"):
        raise SystemExit(f"-C part={part}: there is one part, studies")
    name: str = build_meta.build_wheel(wheel_directory, settings, metadata_directory)
    if part == "studies":
        return _studies_of(Path(wheel_directory) / name)
    _rewrite(
        Path(wheel_directory) / name,
        lambda file, content: None if file.startswith(_STUDIES) else content,
    )
    return name


def _studies_of(whole: Path) -> str:
    """Make the wheel of the studies from one that holds everything; returns its name."""
    version = whole.name.split("-")[1]
    information = f"signorini_studies-{version}.dist-info"
    metadata = (
        "Metadata-Version: 2.1\nName: signorini-studies\n"
        f"Version: {version}\nSummary: Studies, benchmarks and the stress corpus of signorini\n"
        f"License: MIT\nRequires-Python: >=3.11\nRequires-Dist: signorini=={version}\n"
    )
    made = whole.with_name(whole.name.replace("signorini-", "signorini_studies-", 1))
    with zipfile.ZipFile(whole) as source, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        files = {i.filename: source.read(i) for i in source.infolist()}
        kept = {name: content for name, content in files.items() if name.startswith(_STUDIES)}
        tag = next(content for name, content in files.items() if name.endswith("-info/WHEEL"))
        kept |= {f"{information}/METADATA": metadata.encode(), f"{information}/WHEEL": tag}
        for name, content in kept.items():
            new.writestr(name, content)
        lines = [f"{name},," for name in (*kept, f"{information}/RECORD")]
        new.writestr(f"{information}/RECORD", "".join(f"{line}\n" for line in lines))
    whole.unlink()
    return made.name


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
