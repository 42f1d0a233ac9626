"""Files that are written whole or not at all."""

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from signorini.runtime.errors import RunError


def check_ending(path: Path, endings: Iterable[str]) -> None:
    """Raise unless the ending of a file stands for one of the formats."""
    known = list(endings)
    if path.suffix not in known:
        raise RunError(
            f"{path}: the ending '{path.suffix}' stands for no format; use {', '.join(known)}"
        )


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Have `write` fill a new file beside `path` and put it in its place when it is complete.

    The new file has a name of its own that nobody can guess, so that two writers do not meet and
    no link is followed.

    Raises
    ------
    RunError
        If the file cannot be written; what stood at `path` stays.
    """
    try:
        handle, name = tempfile.mkstemp(prefix=".", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise RunError(f"cannot write {path}: {error.strerror}") from None
    os.close(handle)
    partial = Path(name)
    try:
        write(partial)
        mask = os.umask(0)
        os.umask(mask)
        partial.chmod(0o666 & ~mask)
        partial.replace(path)
    except OSError as error:
        raise RunError(f"cannot write {path}: {error.strerror or error}") from None
    finally:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file as a whole; `RunError` if it cannot be written."""

    def write(partial: Path) -> None:
        partial.write_text(text, encoding="utf-8")

    write_whole(path, write)
