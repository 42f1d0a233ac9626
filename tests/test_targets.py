"""Generated steppers on other machines, emulated, against the native ones step by step.

Cortex-M4F and M7 (newlib, semihosting), aarch64, big-endian s390x, WebAssembly (wasi-libc, node).
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from compilers import identify, run
from footprints import check_footprint
from machines import BARE, M4F, M7, TARGETS, Target, program, program_output
from signorini.models import bouncing_ball, box_in_space, slider_crank, slope
from trap_models import rheonomic

pytestmark = pytest.mark.thorough

# Model, step size, steps: through impacts and stick-slip, but not where rounding decides.
CASES: tuple[tuple[Callable[[], sg.Model], float, int], ...] = (
    (bouncing_ball.model, 1e-2, 100),
    (slope.model, 1e-2, 100),
    (slider_crank.model, 1e-4, 60),
    (box_in_space.model, 1e-3, 60),
    (rheonomic, 1e-2, 60),
)


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
        check_footprint(folder, "m", *(f for f in target.compile if f not in BARE))


@pytest.mark.parametrize("make", [case[0] for case in CASES], ids=identify)
def test_float_is_single_throughout(make: Callable[[], sg.Model], tmp_path: Path) -> None:
    """No call of software doubles on an M4F, no instruction on doubles on an M7; it runs."""
    M4F.need()
    folder = sg.generate(make(), tmp_path / "m", stages=2, prefix="m", precision="float")
    for target in (M4F, M7):
        cc = [f for f in target.compile if f not in BARE]
        run(*cc, "-std=c99", "-O2", "-S", "-o", "m.s", "m.c", cwd=folder)
        text = (folder / "m.s").read_text()
        assert "__aeabi_d" not in text
        assert ".f64" not in text
    h, _ = next((case[1], case[2]) for case in CASES if case[0] is make)
    native = np.array(program_output(program(folder, (h, 20), "native", "gcc")))
    there = program_output(*M4F.run, program(folder, (h, 20), "there", *M4F.compile))
    size = np.abs(native[:, 2:]).max(axis=0)
    assert np.all(np.abs(np.array(there)[:, 2:] - native[:, 2:]) <= 2e-3 * (1e-2 + size))
