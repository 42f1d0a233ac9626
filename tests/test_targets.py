"""Generated steppers on other machines, emulated, against the native ones step by step.

Cortex-M4F and M7 (newlib, semihosting), aarch64, big-endian s390x, WebAssembly (wasi-libc, node).
"""

import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from signorini.models import bouncing_ball, box_in_space, slider_crank, slope
from test_firmware import check_footprint
from test_generated_code import identify, run
from trap_models import rheonomic

pytestmark = pytest.mark.thorough

HERE = Path(__file__).parent / "targets"
# Model, step size, steps: through impacts and stick-slip, but not where rounding decides.
CASES: tuple[tuple[Callable[[], sg.Model], float, int], ...] = (
    (bouncing_ball.model, 1e-2, 100),
    (slope.model, 1e-2, 100),
    (slider_crank.model, 1e-4, 60),
    (box_in_space.model, 1e-3, 60),
    (rheonomic, 1e-2, 60),
)
_M = ("-mthumb", "-mfloat-abi=hard")
_BARE = ("-nostartfiles", "-T", str(HERE / "board.ld"), "--specs=rdimon.specs")


@dataclass(frozen=True)
class Target:
    """A machine: how its programs are compiled and run, from which packages."""

    name: str
    tools: tuple[str, ...]
    packages: str
    compile: tuple[str, ...]
    run: tuple[str, ...]
    same_libm: bool
    startup: bool = False

    def need(self) -> None:
        missing = [tool for tool in self.tools if shutil.which(tool) is None]
        if missing:
            how = f"{', '.join(missing)} not installed: apt-get install {self.packages}"
            if os.environ.get("CI"):
                pytest.fail(f"in continuous integration: {how}")
            pytest.skip(how)


def cortex(name: str, board: str, *cpu: str) -> Target:
    emulator = (
        *("qemu-system-arm", "-M", board, "-nographic", "-monitor", "none", "-serial", "none"),
        *("-semihosting-config", "enable=on,target=native", "-kernel"),
    )
    return Target(
        name,
        ("arm-none-eabi-gcc", "qemu-system-arm"),
        "gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm",
        ("arm-none-eabi-gcc", *_M, *cpu, *_BARE),
        emulator,
        False,
        True,
    )


M4F = cortex("M4F", "mps2-an386", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16")
M7 = cortex("M7", "mps2-an500", "-mcpu=cortex-m7", "-mfpu=fpv5-d16")
TARGETS = (
    M4F,
    M7,
    Target(
        "aarch64",
        ("aarch64-linux-gnu-gcc", "qemu-aarch64"),
        "gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user",
        ("aarch64-linux-gnu-gcc", "-static"),
        ("qemu-aarch64",),
        True,
    ),
    Target(
        "s390x",
        ("s390x-linux-gnu-gcc", "qemu-s390x"),
        "gcc-s390x-linux-gnu libc6-dev-s390x-cross qemu-user",
        ("s390x-linux-gnu-gcc", "-static"),
        ("qemu-s390x",),
        True,
    ),
    Target(
        "wasm",
        ("clang", "wasm-ld", "node"),
        "clang lld wasi-libc libclang-rt-14-dev-wasm32 nodejs",
        ("clang", "--target=wasm32-wasi", "--sysroot=/usr"),
        ("node", "--no-warnings", str(HERE / "run.mjs")),
        False,
    ),
)


def program(folder: Path, case: tuple[float, int], name: str, *cc: str) -> Path:
    h, steps = case
    flags = ("-std=c99", "-O2", "-ffp-contract=off", f"-DH={h!r}", f"-DSTEPS={steps}")
    sources = [str(HERE / "trajectory.c"), "m.c"]
    if "-nostartfiles" in cc:
        sources.append(str(HERE / "startup.c"))
    run(*cc, *flags, f"-I{folder}", "-o", name, *sources, "-lm", cwd=folder)
    return folder / name


def program_output(*command: object) -> list[list[float]]:
    result = subprocess.run(
        [str(c) for c in command],
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        timeout=120,
    )
    assert result.returncode == 42, (result.returncode, result.stdout[-500:], result.stderr)
    lines = result.stdout.splitlines()
    assert lines[-1] == "end"
    return [[float(x) for x in line.split()] for line in lines[:-1]]


@pytest.mark.parametrize("target", TARGETS, ids=lambda t: t.name)
@pytest.mark.parametrize(("make", "h", "steps"), CASES, ids=identify)
def test_same_trajectory(
    make: Callable[[], sg.Model], h: float, steps: int, target: Target, tmp_path: Path
) -> None:
    """Bit-equal within one libm; to 1e-9 of the largest value in a column across."""
    target.need()
    folder = sg.generate(make(), tmp_path / "m", stages=2, prefix="m")
    native = program_output(program(folder, (h, steps), "native", "gcc"))
    there = program_output(*target.run, program(folder, (h, steps), "there", *target.compile))
    if target.same_libm:
        assert there == native
    else:
        a, b = np.array(native)[:, 2:], np.array(there)[:, 2:]
        assert a.shape == b.shape
        assert np.all(np.abs(a - b) <= 1e-9 * (1e-6 + np.abs(a).max(axis=0)))


@pytest.mark.parametrize("target", [M4F, M7], ids=lambda t: t.name)
@pytest.mark.parametrize("precision", ["double", "float"])
def test_memory_on_a_microcontroller(precision: str, target: Target, tmp_path: Path) -> None:
    target.need()
    for make in (bouncing_ball.model, slider_crank.model, box_in_space.model, rheonomic):
        folder = sg.generate(
            make(), tmp_path / make.__module__, stages=2, prefix="m", precision=precision
        )
        check_footprint(folder, "m", *(f for f in target.compile if f not in _BARE))


@pytest.mark.parametrize("make", [case[0] for case in CASES], ids=identify)
def test_float_is_single_throughout(make: Callable[[], sg.Model], tmp_path: Path) -> None:
    """No call of software doubles on an M4F, no instruction on doubles on an M7; it runs."""
    M4F.need()
    folder = sg.generate(make(), tmp_path / "m", stages=2, prefix="m", precision="float")
    for target in (M4F, M7):
        cc = [f for f in target.compile if f not in _BARE]
        run(*cc, "-std=c99", "-O2", "-S", "-o", "m.s", "m.c", cwd=folder)
        text = (folder / "m.s").read_text()
        assert "__aeabi_d" not in text
        assert ".f64" not in text
    h, _ = next((case[1], case[2]) for case in CASES if case[0] is make)
    native = np.array(program_output(program(folder, (h, 20), "native", "gcc")))
    there = program_output(*M4F.run, program(folder, (h, 20), "there", *M4F.compile))
    size = np.abs(native[:, 2:]).max(axis=0)
    assert np.all(np.abs(np.array(there)[:, 2:] - native[:, 2:]) <= 2e-3 * (1e-2 + size))
