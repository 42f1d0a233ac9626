"""What an installation has and lacks: packages, compiler, cache, a stepper that runs."""

import importlib.metadata
import importlib.util
import os
import platform
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from signorini.runtime.compile import (
    cache_root,
    describe_machine,
    find_compiler,
    find_wasm_compiler,
)
from signorini.runtime.errors import CompilerError, RunError
from signorini.version import __version__

NEEDED = ("numpy", "sympy", "casadi", "jinja2", "mpmath", "matplotlib", "rich", "cyclopts")
EXTRAS = {
    "cc": ("ziglang",),
    "data": ("pandas", "xarray", "pyarrow", "h5netcdf"),
    "sweep": ("distributed", "zarr"),
    "view": ("viser", "imageio_ffmpeg"),
    "docs": ("sphinx", "myst_parser", "furo"),
    "learning": ("gymnasium",),
    "robots": ("mujoco",),
    "peers": ("mujoco", "exudyn", "pydrake"),
}


@dataclass(frozen=True)
class Finding:
    """One thing looked at.

    Attributes
    ----------
    name : str
        What it is.
    ok : bool or None
        Whether it is as it should be; None where that does not matter.
    text : str
        What was found, or what to do.
    """

    name: str
    ok: bool | None
    text: str


def examine() -> Iterator[Finding]:
    """Look at everything that a first run needs, and at what is optional."""
    place = Path(__file__).resolve().parent
    yield Finding("signorini", True, f"{__version__} in {place}")
    yield Finding("Python", True, f"{platform.python_version()} in {sys.prefix}")
    for name in NEEDED:
        yield _package(name)
    yield _compiler()
    yield _wasm_compiler()
    flags = os.environ.get("SIGNORINI_CFLAGS", "").strip()
    if flags:
        yield Finding("SIGNORINI_CFLAGS", None, flags)
    yield _cache()
    yield _stepper()
    for extra, names in EXTRAS.items():
        missing = [name for name in names if importlib.util.find_spec(name) is None]
        text = (
            "all there"
            if not missing
            else f"lacks {', '.join(missing)}: pip install 'signorini[{extra}]'"
        )
        yield Finding(f"extra [{extra}]", None, text)


def _package(name: str) -> Finding:
    try:
        return Finding(name, True, importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        return Finding(name, False, f"is missing: pip install {name}")


def _compiler() -> Finding:
    try:
        command = " ".join(find_compiler())
        return Finding("C compiler", True, f"{command}: {describe_machine()['compiler']}")
    except CompilerError as error:
        return Finding("C compiler", False, str(error))


def _wasm_compiler() -> Finding:
    """What makes pages in which models run."""
    try:
        return Finding("compiler of pages", None, " ".join(find_wasm_compiler()))
    except CompilerError as error:
        return Finding("compiler of pages", None, str(error))


def _cache() -> Finding:
    root = cache_root()
    try:
        root.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=root):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        return Finding("cache", False, f"{root}: {reason}; name another one in SIGNORINI_CACHE")
    size = sum(path.stat().st_size for path in root.rglob("*") if path.is_file())
    return Finding("cache", True, f"{root}, {size / 1e6:.1f} MB; it may be deleted at any time")


def _stepper() -> Finding:
    """A small model through everything: derivation, C, compiler, ten steps."""
    from signorini.codegen.frontend.errors import GenerationError, ModelError
    from signorini.models import bouncing_ball
    from signorini.workflow import build

    try:
        traj = build(bouncing_ball.model(), stages=2).simulate(t_end=0.1, dt=1e-2)
    except (CompilerError, RunError, ModelError, GenerationError, OSError) as error:
        return Finding("a stepper", False, str(error))
    fallen = 1 - float(traj["y"][-1])
    right = abs(fallen - 9.81 / 2 * 0.01) < 1e-12
    return Finding("a stepper", right, f"falls {fallen:.5f} m in 0.1 s")
