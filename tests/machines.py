"""Other machines, emulated: how programs for them are compiled and run."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
from compilers import run

HERE = Path(__file__).parent / "targets"
_M = ("-mthumb", "-mfloat-abi=hard")
BARE = ("-nostartfiles", "-T", str(HERE / "board.ld"), "--specs=rdimon.specs")


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
        ("arm-none-eabi-gcc", *_M, *cpu, *BARE),
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
