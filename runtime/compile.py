"""The C compiler: found, run, its results cached by content."""

import contextlib
import hashlib
import importlib.util
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

from platformdirs import user_cache_dir
from signorini.runtime.errors import CompilerError
from signorini.runtime.system import FLAGS, System, compiler_for, here

# A module of functions that is called, with nothing but code.
_MODULE = ("-mexec-model=reactor", "-Wl,--strip-all")
_SYSROOTS = (
    Path("/usr"),
    Path("/usr/share/wasi-sysroot"),
    Path("/opt/wasi-sdk/share/wasi-sysroot"),
)
# The driver of many runs, compiled together with every stepper.
_BATCH = Path(__file__).with_name("batch.c")
_CONTROLLED = _BATCH.with_name("controlled.c")
# where steps can be differentiated
_CHANGES = (_BATCH.with_name("changes.c"), _BATCH.with_name("maps.c"))
_POOL = _BATCH.with_name("pool.h")
# Lines of model code in a file above which it is optimised less: compilers take more than linear
# time over long straight-line functions. The runtime stays at -O2 where the compiler can do both.
_LEVELS = ((200_000, 0), (60_000, 1), (0, 2))
_RUNTIME = re.compile(rb"/\* ==== runtime[^\n]* begin.*?/\* ==== runtime[^\n]* end ", re.DOTALL)


def find_compiler() -> list[str]:
    """Return the command of the C compiler: ``$CC``, or the first of cc, gcc, clang, ziglang.

    The last one comes by pip, with the extra ``signorini[cc]``.

    Raises
    ------
    CompilerError
        With advice, if there is none.
    """
    command = _words("CC")
    if command:
        if shutil.which(command[0]) is None:
            raise CompilerError(
                f"the compiler CC={' '.join(command)!r} is not on the PATH: install it or unset CC"
            )
        return command
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name) is not None:
            return [name]
    if importlib.util.find_spec("ziglang") is not None:
        # Its cc is clang; undefined behaviour would trap in what is not optimised.
        return [sys.executable, "-m", "ziglang", "cc", "-fno-sanitize=undefined"]
    raise CompilerError(
        "no C compiler found (looked for cc, gcc, clang, ziglang). Install one, e.g. 'apt-get "
        "install gcc', 'xcode-select --install' or \"pip install 'signorini[cc]'\", or name yours "
        "in the environment variable CC"
    )


def find_wasm_compiler() -> list[str]:
    """Return the command of a compiler that makes WebAssembly, with a libm.

    ``$SIGNORINI_WASM_CC``, clang where a sysroot of wasi-libc is installed, or ziglang, which comes
    by pip with the extra ``signorini[cc]``.

    Raises
    ------
    CompilerError
        With advice, if there is none.
    """
    command = _words("SIGNORINI_WASM_CC")
    if command:
        if shutil.which(command[0]) is None:
            raise CompilerError(
                f"the compiler SIGNORINI_WASM_CC={' '.join(command)!r} is not on the PATH: "
                "install it or unset SIGNORINI_WASM_CC"
            )
        return command
    if shutil.which("clang") and shutil.which("wasm-ld"):
        for root in _SYSROOTS:
            if (root / "include" / "wasm32-wasi").is_dir():
                return ["clang", "--target=wasm32-wasi", f"--sysroot={root}"]
    if importlib.util.find_spec("ziglang") is not None:
        return [
            *(sys.executable, "-m", "ziglang", "cc", "-target", "wasm32-wasi"),
            "-fno-sanitize=undefined",
        ]
    raise CompilerError(
        "no compiler for WebAssembly found. Install one, e.g. 'apt-get install clang lld wasi-libc "
        "libclang-rt-dev-wasm32' or \"pip install 'signorini[cc]'\", or name yours in the "
        "environment variable SIGNORINI_WASM_CC"
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


# What the loader sets itself, or checks in the text: it may differ between equal libraries. Only
# numbers count as defaults, so that nothing else hides behind one.
_DEFAULTS = re.compile(
    rb'par\.\w+ = -?[0-9][0-9.eE+-]*F?;|meta\.(model|manifest)_hash = "\w+";|sha256 \w+'
)


def _without_defaults(text: bytes) -> bytes:
    """Generated C without the defaults of parameters and the hashes that they enter."""
    return _DEFAULTS.sub(b"", text)


def compile_library(source: Path, prefix: str, again: bool = False) -> Path:
    """Compile a generated C file into a shared library and return its path.

    Files that differ only in defaults of parameters share a library: it is called with all
    parameters given. What is compiled is a copy of the file and its header in a folder of its own:
    nothing else that lies beside them can take part.

    Parameters
    ----------
    source : Path
        The ``.c`` file; its header and the file of the model functions stand beside it.
    prefix : str
        Prefix of its names.
    again : bool
        Compile even if the cache has a library.

    Raises
    ------
    CompilerError
        If there is no compiler, or with its messages if it fails.
    """
    text, heading = source.read_bytes(), source.with_suffix(".h").read_bytes()
    model = source.with_name(f"{source.stem}_model.c")
    functions = model.read_bytes()
    level = _level(_RUNTIME.sub(b"", text))
    flags = [f"-O{level}"]
    if level < 2 and _mixes_levels():
        flags = ["-O2", f"-DSIGNORINI_EVALUATION={level}"]
    drivers = [
        _BATCH,
        _CONTROLLED,
        *(_CHANGES if f"{prefix}_step_forward".encode() in heading else ()),
    ]
    own = {path.name: path.read_bytes() for path in (*drivers, _POOL)}
    files = {source.name: text, model.name: functions, f"{source.stem}.h": heading, **own}
    parts = (*map(_without_defaults, (text, functions, heading)), *own.values())
    adaptive = int(f"{prefix}_step_within".encode() in heading)
    before = (
        f"-DSIGNORINI_PREFIX={prefix}",
        f"-DSIGNORINI_ADAPTIVE={adaptive}",
        "-include",
        f"{source.stem}.h",
        "-I.",
    )
    sources = (
        (source.name, *flags),
        # nothing that takes steps calls these: compiled meanwhile, at less expense
        (model.name, f"-O{_level(functions + functions)}"),
        *((path.name, "-O2") for path in drivers),
    )
    return _shared(source.stem, files, parts, before, sources, again)


def _level(text: bytes) -> int:
    """At which level a compiler gets through model code in reasonable time."""
    lines = text.count(b"\n")
    return next(level for least, level in _LEVELS if lines >= least)


def _mixes_levels() -> bool:
    """Whether the compiler is gcc and no level is asked for: it can optimise a file in two ways."""
    said = _version(tuple(find_compiler()))
    asked = any(word.startswith("-O") for word in _words("SIGNORINI_CFLAGS"))
    return not asked and "clang" not in said and "Free Software Foundation" in said


def compile_plain(source: Path, flags: tuple[str, ...] = ()) -> Path:
    """Compile one C file that needs only libm into a shared library and return its path.

    Parameters
    ----------
    flags : tuple of str
        Where else to look for headers.

    Raises
    ------
    CompilerError
        If there is no compiler, or with its messages if it fails.
    """
    text = source.read_bytes()
    files = {source.name: text}
    return _shared(source.stem, files, (text,), flags, ((source.name, "-O2"),), False)


def compile_shared(
    name: str, files: dict[str, bytes], sources: Sequence[str], system: System | None = None
) -> Path:
    """Compile some of the files, which include one another, into a library of hidden names.

    Parameters
    ----------
    system : System, optional
        For which; by default that of this machine, with its own compiler.

    Returns
    -------
    Path

    Raises
    ------
    CompilerError
        If there is no compiler, or with its messages if it fails.
    """
    flags = ("-I.", "-fvisibility=hidden")
    compiled = tuple((source, "-O2") for source in sources)
    return _shared(name, files, tuple(files.values()), flags, compiled, False, system)


def compile_wasm(name: str, files: dict[str, bytes], sources: Sequence[str]) -> Path:
    """Compile some of the files, which include one another, into a module of WebAssembly.

    The module exports what the sources mark so, and needs nothing.

    Returns
    -------
    Path

    Raises
    ------
    CompilerError
        If there is no compiler for it, or with its messages if it fails.
    """
    compiled = tuple((source, f"-O{_level(files[source])}") for source in sources)
    flags = (*FLAGS, "-I.", "-fvisibility=hidden")
    command = find_wasm_compiler()
    return _made(
        *(name, files, tuple(files.values()), command, flags, compiled, False),
        linked=_MODULE,
        ending=".wasm",
    )


def _shared(
    name: str,
    files: dict[str, bytes],
    parts: tuple[bytes, ...],
    flags: tuple[str, ...],
    sources: tuple[tuple[str, ...], ...],
    again: bool,
    system: System | None = None,
) -> Path:
    """Compile to a shared library, of this system unless another one is given."""
    chosen = here() if system is None else system
    own = _words("SIGNORINI_CFLAGS") if system is None else []
    command = find_compiler() if system is None else compiler_for(system)
    return _made(
        *(name, files, parts, command, (*FLAGS, *chosen.flags, *flags, *own), sources, again),
        linked=("-shared",),
        ending=chosen.ending,
    )


def _made(
    name: str,
    files: dict[str, bytes],
    parts: tuple[bytes, ...],
    command: list[str],
    flags: tuple[str, ...],
    sources: tuple[tuple[str, ...], ...],
    again: bool,
    *,
    linked: tuple[str, ...],
    ending: str,
) -> Path:
    """Compile to a library in the cache, named by what goes into it.

    Beside it stands the hash of its bytes: a damaged library is compiled anew.
    """
    digest = hashlib.sha256()
    machine = (platform.system(), platform.machine(), *platform.libc_ver())
    for part in (
        *parts,
        repr([command, flags, sources, linked, _version(tuple(command)), machine]).encode(),
    ):
        digest.update(len(part).to_bytes(8, "big") + part)
    target = cache_root() / "compiled" / f"{name}-{digest.hexdigest()[:32]}{ending}"
    if not again and _is_whole(target):
        return target
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CompilerError(
            f"cannot write to the cache {target.parent} ({error.strerror}): "
            "set SIGNORINI_CACHE to a writable folder"
        ) from None
    with _locked(target.with_suffix(".lock")):
        # another process may have made it meanwhile
        if again or not _is_whole(target):
            _compile(command, flags, files, sources, linked, target)
    return target


def _compile(
    command: list[str],
    flags: tuple[str, ...],
    files: dict[str, bytes],
    sources: tuple[tuple[str, ...], ...],
    linked: tuple[str, ...],
    target: Path,
) -> None:
    """Compile each source, with the flags behind its name, at the same time; link them."""
    try:
        folder = Path(tempfile.mkdtemp(dir=target.parent))
    except OSError as error:
        raise CompilerError(
            f"cannot write to the cache {target.parent} ({error.strerror}): "
            "set SIGNORINI_CACHE to a writable folder"
        ) from None
    try:
        for file, content in files.items():
            (folder / file).write_bytes(content)
        made = folder / f"made{target.suffix}"

        def run(name: str, *arguments: str) -> None:
            result = subprocess.run(
                [*command, *arguments], cwd=folder, capture_output=True, text=True, check=False
            )
            if result.returncode != 0:
                raise CompilerError(
                    f"{' '.join(command)} failed on {name}:\n{result.stderr.strip()[:4000]}"
                )

        def compile_one(source: tuple[str, ...]) -> str:
            name, *own = source
            run(name, *own, *flags, "-c", name, "-o", f"{name}.o")
            return f"{name}.o"

        with ThreadPoolExecutor(len(sources)) as pool:
            objects = list(pool.map(compile_one, sources))
        run(sources[0][0], *flags, *linked, "-o", made.name, *objects, "-lm")
        digest = hashlib.sha256(made.read_bytes()).hexdigest()
        made.replace(target)
        target.with_suffix(".sha256").write_text(digest, encoding="ascii")
    except OSError as error:
        raise CompilerError(f"cannot write {target}: {error.strerror or error}") from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _is_whole(library: Path) -> bool:
    """Whether a library in the cache has the bytes that were compiled."""
    try:
        said = library.with_suffix(".sha256").read_text(encoding="ascii")
        return hashlib.sha256(library.read_bytes()).hexdigest() == said
    except (OSError, UnicodeDecodeError):
        return False


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Wait until no other process compiles the same library, where the system has file locks."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    with contextlib.ExitStack() as stack:
        try:
            stream = stack.enter_context(path.open("w"))
            fcntl.flock(stream, fcntl.LOCK_EX)
        except OSError:
            pass  # a file system without locks: two processes may compile the same
        yield


@cache
def _version(command: tuple[str, ...]) -> str:
    """What the compiler says of itself."""
    try:
        result = subprocess.run(
            [*command, "--version"], capture_output=True, text=True, check=False, timeout=60
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return result.stdout


def describe_machine() -> dict[str, str]:
    """Return what a measured figure depends on: processor, system, compiler."""
    processor = platform.processor() or platform.machine()
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        processor = next(x.split(": ")[1] for x in lines if x.startswith("model name"))
    return {
        "processor": processor,
        "system": f"{platform.system()}, Python {platform.python_version()}",
        "compiler": next(iter(_version(tuple(find_compiler())).splitlines()), ""),
    }


def _words(variable: str) -> list[str]:
    """An environment variable split as a shell splits words."""
    text = os.environ.get(variable, "").strip()
    try:
        return shlex.split(text)
    except ValueError as error:
        raise CompilerError(f"{variable}={text!r} cannot be read: {error}") from None
