"""Other operating systems: names; C compiled by zig for Windows, run by wine, and for macOS."""

import platform
import struct
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from compilers import run
from machines import HERE, Target, program, program_output
from signorini.fmu import write_fmu
from signorini.models import bouncing_ball, box_in_space, slider_crank
from signorini.runtime import compile as compiling
from signorini.runtime import system
from signorini.runtime.errors import CompilerError, RunError

CASES = (
    (bouncing_ball.model, 1e-2, 100),
    (slider_crank.model, 1e-4, 60),
    (box_in_space.model, 1e-3, 60),
)


@pytest.mark.parametrize(
    ("machine", "word", "name", "ending"),
    [
        ("x86_64", "linux", "x86_64-linux", ".so"),
        ("AMD64", "win32", "x86_64-windows", ".dll"),
        ("ARM64", "win32", "aarch64-windows", ".dll"),
        ("arm64", "darwin", "aarch64-darwin", ".dylib"),
        ("riscv64", "linux", "riscv64-linux", ".so"),
    ],
)
def test_the_system_at_hand(
    machine: str, word: str, name: str, ending: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(platform, "machine", lambda: machine)
    monkeypatch.setattr(sys, "platform", word)
    found = system.here()
    assert (found.name, found.ending) == (name, ending)
    assert ("-fPIC" in found.flags) == (word != "win32")


def test_what_cannot_be_compiled_for_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with monkeypatch.context() as without:
        without.setattr("importlib.util.find_spec", lambda name: None)
        with pytest.raises(CompilerError, match=r"needs zig: pip install 'signorini\[cc\]'"):
            system.compiler_for(system.named("x86_64-windows"))
    with pytest.raises(CompilerError, match="no system 'plan9': choose among x86_64-linux"):
        system.named("plan9")
    ball = sg.build(bouncing_ball.model())
    path = tmp_path / "b.fmu"
    with pytest.raises(RunError, match="it is that of this machine"):
        write_fmu(ball, path, systems=[system.here().name])
    assert list(tmp_path.iterdir()) == []


def windows() -> Target:
    """Windows by wine; zig makes its libraries at the first use, which takes minutes."""
    pytest.importorskip("ziglang", reason="pip install 'signorini[cc]'")
    command = system.compiler_for(system.named("x86_64-windows"))
    target = Target("windows", ("wine",), "wine", tuple(command), ("wine",), same_libm=False)
    target.need()
    return target


def close(there: list[list[float]], native: list[list[float]], first: int) -> None:
    """To 1e-9 of the largest value in a column, from column `first` on."""
    a, b = np.array(native)[:, first:], np.array(there)[:, first:]
    assert a.shape == b.shape
    assert np.all(np.abs(a - b) <= 1e-9 * (1e-6 + np.abs(a).max(axis=0)))


@pytest.mark.slow
def test_windows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs, and the library that the loader would load there."""
    target = windows()
    monkeypatch.setenv("WINEDEBUG", "-all")
    monkeypatch.setenv("WINEPREFIX", str(tmp_path / "wine"))
    monkeypatch.setenv("CC", " ".join(target.compile))
    for make, h, steps in CASES:
        folder = sg.generate(make(), tmp_path / make.__module__, stages=2, prefix="m")
        native = program_output(program(folder, (h, steps), "native", "gcc"))
        there = program(folder, (h, steps), "there.exe", *target.compile)
        close(program_output(*target.run, there), native, 2)
        with monkeypatch.context() as here:
            here.setattr(compiling, "here", lambda: system.named("x86_64-windows"))
            library = compiling.compile_library(folder / "m.c", "m")
        assert library.suffix == ".dll"
        flags = (f'-DLIBRARY="{library.name}"', f"-DH={h!r}", f"-DSTEPS={steps}")
        sources = ("-I.", f"-I{HERE}", HERE / "library.c")
        run(*target.compile, *flags, *sources, "-o", library.with_name("loads.exe"), cwd=folder)
        monkeypatch.chdir(library.parent)
        close(program_output(*target.run, library.with_name("loads.exe")), native, 2)


@pytest.mark.slow
def test_a_unit_for_windows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its binary, called as a program of Windows does, takes the steps of that of this machine."""
    target = windows()
    fmpy = pytest.importorskip("fmpy", reason="pip install fmpy")
    monkeypatch.setenv("WINEDEBUG", "-all")
    monkeypatch.setenv("WINEPREFIX", str(tmp_path / "wine"))
    ball = sg.build(bouncing_ball.model(), events="located")
    unit = write_fmu(ball, tmp_path / "b.fmu", systems=["x86_64-windows", "aarch64-darwin"])
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path / "unit")
    about = fmpy.read_model_description(str(unit))
    names = [v.name for v in about.modelVariables]
    columns = ["x", "y", "phi", "x_dot", "y_dot", "phi_dot"]
    first = about.modelVariables[names.index("x")].valueReference
    place = tmp_path / "unit" / "binaries" / "x86_64-windows"
    flags = (
        f'-DLIBRARY="{about.coSimulation.modelIdentifier}.dll"',
        f'-DTOKEN="{about.instantiationToken}"',
        f"-DFIRST={first}", f"-DN_VALUES={len(columns)}", "-DH=0.01", "-DSTEPS=120",
    )  # fmt: skip
    headers = f"-I{Path(fmpy.__file__).parent / 'c-code'}"
    run(*target.compile, *flags, headers, HERE / "unit.c", "-o", place / "unit.exe", cwd=tmp_path)
    monkeypatch.chdir(place)
    there = program_output(*target.run, place / "unit.exe")
    result = fmpy.simulate_fmu(
        str(unit), stop_time=1.2, step_size=0.01, output_interval=0.01, output=columns
    )
    native = np.column_stack([result[name] for name in columns])[1:]
    close(there, native.tolist(), 0)
    assert native[:, 4].min() < -4  # it fell
    assert abs(native[-1, 4]) < 1e-9  # it landed
    library = (tmp_path / "unit/binaries/aarch64-darwin/bouncing_ball.dylib").read_bytes()
    magic, processor, _, kind = struct.unpack("<4I", library[:16])
    assert (magic, processor, kind) == (0xFEEDFACF, 0x0100000C, 6)  # a library for arm64
    assert b"_fmi3DoStep\0" in library


@pytest.mark.slow
def test_macos(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library that the loader would load there, for both processors; it cannot be run here."""
    pytest.importorskip("ziglang", reason="pip install 'signorini[cc]'")
    folder = sg.generate(slider_crank.model(), tmp_path / "m", stages=2, prefix="m")
    for name, number in (("x86_64-darwin", 0x01000007), ("aarch64-darwin", 0x0100000C)):
        chosen = system.named(name)
        monkeypatch.setenv("CC", " ".join(system.compiler_for(chosen)))
        monkeypatch.setattr(compiling, "here", lambda chosen=chosen: chosen)
        library = compiling.compile_library(folder / "m.c", "m")
        assert library.suffix == ".dylib"
        text = library.read_bytes()
        assert struct.unpack("<4I", text[:16])[::3] == (0xFEEDFACF, 6)
        assert struct.unpack("<4I", text[:16])[1] == number
        for word in (b"_m_step\0", b"_m_simulate\0", b"_m_run_batch\0"):
            assert word in text
