"""The build backend: setuptools, but for where an editable install is looked up.

The package's folders stand at the top of the repository, so an editable install finds them through
an import hook. setuptools puts it behind the path, where a clone that lies beside a script as a
folder called signorini would come first, as an empty namespace package. Here it comes before.
"""

import zipfile
from pathlib import Path
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import (
    build_sdist,
    build_wheel,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

_BEHIND = "sys.meta_path.append(_EditableFinder)"
_BEFORE = "sys.meta_path.insert(0, _EditableFinder)"


def build_editable(
    wheel_directory: str,
    config_settings: Any = None,
    metadata_directory: str | None = None,
) -> str:
    """Build an editable wheel whose import hook comes before the path."""
    name: str = build_meta.build_editable(wheel_directory, config_settings, metadata_directory)
    wheel = Path(wheel_directory) / name
    with zipfile.ZipFile(wheel) as source:
        entries = [(info, source.read(info)) for info in source.infolist()]
    hook = [info.filename for info, _ in entries if info.filename.endswith("_finder.py")]
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as target:
        for info, content in entries:
            if info.filename in hook:
                content = content.replace(_BEHIND.encode(), _BEFORE.encode())
            if info.filename.endswith("/RECORD"):
                # the hash of what changed is left out, as it may be for any file
                lines = content.decode().splitlines()
                content = "".join(
                    f"{line.split(',')[0]},,\n" if line.split(",")[0] in hook else f"{line}\n"
                    for line in lines
                ).encode()
            target.writestr(info, content)
    return name


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
