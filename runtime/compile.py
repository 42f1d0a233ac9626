"""The C compiler: found, run, its results cached by content."""

import hashlib
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

from platformdirs import user_cache_dir

FLAGS = ("-std=c99", "-ffp-contract=off", "-fPIC", "-shared", "-pthread")
# The driver of many runs, compiled together with every stepper.
_BATCH = Path(__file__).with_name("batch.c")
# Lines of C above which a lower optimisation level keeps compilation short: compilers take more
# than linear time over long straight-line functions.
_LEVELS = ((40_000, "-O0"), (20_000, "-O1"), (0, "-O2"))


class CompilerError(RuntimeError):
    """No C compiler, or one that fails."""


def find_compiler() -> list[str]:
    """Return the command of the C compiler: ``$CC``, or the first of cc, gcc, clang.

    Raises
    ------
    CompilerError
        With advice, if there is none.
    """
    chosen = os.environ.get("CC", "").strip()
    if chosen:
        command = shlex.split(chosen)
        if shutil.which(command[0]) is None:
            raise CompilerError(
                f"the compiler CC={chosen!r} is not on the PATH: install it or unset CC"
            )
        return command
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name) is not None:
            return [name]
    raise CompilerError(
        "no C compiler found (looked for cc, gcc, clang). Install one, e.g. 'apt-get install gcc' "
        "or 'xcode-select --install', or name yours in the environment variable CC"
    )


def cache_root() -> Path:
    """Folder of generated and compiled steppers: ``$SIGNORINI_CACHE`` or the user's cache."""
    chosen = os.environ.get("SIGNORINI_CACHE", "").strip()
    return Path(chosen) if chosen else Path(user_cache_dir("signorini"))


def cache_folder(files: dict[str, str]) -> Path:
    """Folder for generated files, named by their content."""
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0{files[name]}\0".encode())
    return cache_root() / "generated" / digest.hexdigest()[:32]


# What the loader sets itself, or checks in the text: it may differ between equal libraries.
_DEFAULTS = re.compile(rb'par\.\w+ = [^;]+;|meta\.(model|manifest)_hash = "\w+";|sha256 \w+')


def _without_defaults(text: bytes) -> bytes:
    """Generated C without the defaults of parameters and the hashes that they enter."""
    return _DEFAULTS.sub(b"", text)


def compile_library(source: Path, prefix: str) -> Path:
    """Compile a generated C file into a shared library and return its path.

    Files that differ only in defaults of parameters share a library: it is called with all
    parameters given.

    Parameters
    ----------
    source : Path
        The ``.c`` file; its header stands beside it.
    prefix : str
        Prefix of its names.

    Raises
    ------
    CompilerError
        If there is no compiler, or with its messages if it fails.
    """
    text = source.read_bytes()
    lines = text.count(b"\n")
    level = next(level for least, level in _LEVELS if lines >= least)
    header = source.with_suffix(".h")
    parts = (_without_defaults(text), _without_defaults(header.read_bytes()), _BATCH.read_bytes())
    heading = (f"-DSIGNORINI_PREFIX={prefix}", "-include", header.name, "-I.")
    return _shared(source, parts, (level, *FLAGS), heading, (str(_BATCH), "-lm"))


def compile_plain(source: Path) -> Path:
    """Compile one C file that needs only libm into a shared library and return its path.

    Raises
    ------
    CompilerError
        If there is no compiler, or with its messages if it fails.
    """
    return _shared(source, (source.read_bytes(),), ("-O2", *FLAGS), (), ("-lm",))


def _shared(
    source: Path,
    parts: tuple[bytes, ...],
    flags: tuple[str, ...],
    before: tuple[str, ...],
    after: tuple[str, ...],
) -> Path:
    """Compile to a library in the cache, named by what goes into it."""
    command = find_compiler()
    flags = (*flags, *shlex.split(os.environ.get("SIGNORINI_CFLAGS", "")))
    digest = hashlib.sha256()
    for part in (*parts, repr([*command, *flags]).encode()):
        digest.update(part)
    target = cache_root() / "compiled" / f"{source.stem}-{digest.hexdigest()[:32]}.so"
    if target.is_file():
        return target
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(suffix=".so", dir=target.parent)
    except OSError as error:
        raise CompilerError(
            f"cannot write to the cache {target.parent} ({error.strerror}): "
            "set SIGNORINI_CACHE to a writable folder"
        ) from None
    os.close(handle)
    try:
        result = subprocess.run(
            [*command, *flags, *before, "-o", name, source.name, *after],
            cwd=source.parent,
            capture_output=True,
            text=True,
            check=False,
        )
        if result.returncode != 0:
            raise CompilerError(
                f"{' '.join(command)} failed on {source.name}:\n{result.stderr.strip()[:4000]}"
            )
        Path(name).replace(target)
    finally:
        Path(name).unlink(missing_ok=True)
    return target
