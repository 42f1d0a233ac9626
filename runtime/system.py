"""Operating systems: how each calls its libraries, and how they are compiled for it from here."""

import importlib.util
import platform
import sys
from dataclasses import dataclass

from signorini.runtime.errors import CompilerError

FLAGS = ("-std=c99", "-ffp-contract=off")


@dataclass(frozen=True)
class System:
    """A processor with an operating system.

    Attributes
    ----------
    name : str
        As FMI 3 calls it.
    folder_2 : str
        What FMI 2 calls it, whose names do not tell processors apart.
    ending : str
        Of a shared library.
    flags : tuple of str
        That a shared library needs.
    target : str
        What zig calls it; "" if this package does not compile for it from elsewhere.
    """

    name: str
    folder_2: str
    ending: str
    flags: tuple[str, ...]
    target: str = ""


_POSIX = ("-fPIC", "-pthread")
SYSTEMS = (
    System("x86_64-linux", "linux64", ".so", _POSIX, "x86_64-linux-gnu.2.17"),
    System("aarch64-linux", "linux64", ".so", _POSIX, "aarch64-linux-gnu.2.17"),
    System("x86_64-windows", "win64", ".dll", ("-pthread",), "x86_64-windows-gnu"),
    System("x86_64-darwin", "darwin64", ".dylib", _POSIX, "x86_64-macos"),
    System("aarch64-darwin", "darwin64", ".dylib", _POSIX, "aarch64-macos"),
)
_ENDINGS = {"darwin": ".dylib", "windows": ".dll"}
_PROCESSORS = {"amd64": "x86_64", "arm64": "aarch64"}


def here() -> System:
    """The system that runs this, whether it is one of the table or not."""
    machine = platform.machine().lower()
    word = "windows" if sys.platform == "win32" else sys.platform
    name = f"{_PROCESSORS.get(machine, machine)}-{word}"
    for system in SYSTEMS:
        if system.name == name:
            return system
    ending = _ENDINGS.get(word, ".so")
    flags = ("-pthread",) if ending == ".dll" else _POSIX
    return System(
        name, {".dll": "win64", ".dylib": "darwin64"}.get(ending, "linux64"), ending, flags
    )


def named(name: str) -> System:
    """A system that libraries are compiled for from elsewhere.

    Raises
    ------
    CompilerError
        For another name.
    """
    for system in SYSTEMS:
        if system.name == name:
            return system
    raise CompilerError(
        f"there is no system '{name}': choose among {', '.join(s.name for s in SYSTEMS)}"
    )


def compiler_for(system: System) -> list[str]:
    """The command of a compiler for another system: zig, which comes by pip.

    Raises
    ------
    CompilerError
        If it is not installed.
    """
    if importlib.util.find_spec("ziglang") is None:
        raise CompilerError(f"compiling for {system.name} needs zig: pip install 'signorini[cc]'")
    command = (sys.executable, "-m", "ziglang", "cc", "-target", system.target)
    # undefined behaviour would trap in what is not optimised
    return [*command, "-fno-sanitize=undefined"]
