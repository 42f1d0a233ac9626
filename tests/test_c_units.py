"""Unit tests of the C runtime, compiled as it is, with sanitizers and branch counts."""

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import branch_coverage
import pytest
import signorini as sg
from signorini.models import (
    bead_on_hoop,
    bouncing_ball,
    box,
    box_in_space,
    conveyor_oscillator,
    slope,
    woodpecker,
)
from trap_models import (
    anisotropic,
    forms,
    jammed,
    laws,
    mixed_contacts,
    one_coordinate,
    only_constraints,
    pressed,
    ratchet,
    rheonomic,
    sticking_incline,
    unconstrained,
    yielding,
)

ROOT = Path(__file__).resolve().parent.parent
# Where branches are counted, those that the sanitizer adds to every division by the rows of a slot
# are no branches of the runtime; `SANITIZE` alone tests divisions in all other builds.
FLAGS = (
    *("-O0", "--coverage"),
    "-fno-sanitize=integer-divide-by-zero,signed-integer-overflow",
)
SANITIZE = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
# Model, stages, whether parameters that are all zero make its mass matrix vanish.
MODELS: tuple[tuple[Callable[[], sg.Model], int, bool], ...] = (
    (rheonomic, 3, False),
    (mixed_contacts, 3, True),
    (mixed_contacts, 2, True),
    (only_constraints, 4, False),
    (sticking_incline, 2, True),
    (unconstrained, 3, False),
    (box.model, 3, True),
    (one_coordinate, 4, False),
    (forms, 2, False),
    (laws, 3, True),
    (ratchet, 3, True),
    (yielding, 2, True),
    (anisotropic, 2, True),
    (pressed, 2, True),
    (jammed, 3, True),
)
# Redundant contacts, masses that vanish, time in every function; anisotropic friction, pressed
# friction, friction under load.
QUICK = (MODELS[0], MODELS[2], *MODELS[-3:])


def build_and_run(source: Path, include: Path, folder: Path, *flags: str) -> str:
    """What the unit tests print; they say how many things did not hold."""
    gcc = shutil.which("gcc")
    if gcc is None:
        if os.environ.get("CI"):
            pytest.fail("gcc is missing in continuous integration")
        pytest.skip("gcc is not installed: apt-get install gcc")
    command = [
        *(gcc, "-std=c99", "-g", "-Wall", "-Wextra", *SANITIZE, *flags, f"-I{include}"),
        *("-o", "units", str(source), "-lm"),
    ]
    build = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert build.returncode == 0, build.stderr
    assert "warning" not in build.stderr, build.stderr
    result = subprocess.run(
        [folder / "units"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def all_hold(said: str) -> bool:
    """Whether the last line says that nothing failed."""
    return said.splitlines()[-1] == "0 failed"


def test_kernels(tmp_path: Path) -> None:
    source = ROOT / "tests" / "c" / "test_runtime.c"
    assert all_hold(build_and_run(source, ROOT / "runtime" / "c", tmp_path, "-O1"))


def units(make: Callable[[], sg.Model], stages: int, prefix: str, folder: Path) -> Path:
    """A generated stepper whose branches are attributed to the files of runtime/c."""
    # the unit tests know the unknowns of the paper's form
    folder = sg.generate(make(), folder, stages=stages, prefix=prefix, velocity_constraints="paper")
    for source in (folder / f"{prefix}.c", folder / f"{prefix}_model.c"):
        source.write_text(branch_coverage.with_lines(source.read_text()))
    return folder


def step_units(folder: Path) -> str:
    """The unit tests that know the numbers of one model, the ball."""
    folder = units(bouncing_ball.model, 3, "ball", folder)
    return build_and_run(ROOT / "tests" / "c" / "test_step.c", folder, folder, *FLAGS)


def model_units(make: Callable[[], sg.Model], stages: int, vanishing: bool, folder: Path) -> str:
    """The unit tests that hold for every model."""
    folder = units(make, stages, "m", folder)
    masses = f"-DM_MASSES={int(vanishing)}"
    return build_and_run(ROOT / "tests" / "c" / "test_model.c", folder, folder, *FLAGS, masses)


def full_units(folder: Path) -> str:
    """The unit tests of the velocity constraints of full order."""
    folder = sg.generate(only_constraints(), folder, stages=3, prefix="f")
    (folder / "f.c").write_text(branch_coverage.with_lines((folder / "f.c").read_text()))
    return build_and_run(ROOT / "tests" / "c" / "test_full.c", folder, folder, *FLAGS)


def test_step(tmp_path: Path) -> None:
    assert all_hold(step_units(tmp_path / "c"))


def test_located(tmp_path: Path) -> None:
    """Dense output, brackets, the separate check of a segment, refusals."""
    folder = sg.generate(
        bouncing_ball.model(), tmp_path / "c", stages=3, prefix="ball", events="located"
    )
    source = ROOT / "tests" / "c" / "test_located.c"
    assert all_hold(build_and_run(source, folder, folder, "-O0"))


def test_full_order(tmp_path: Path) -> None:
    assert all_hold(full_units(tmp_path / "c"))


@pytest.mark.parametrize(("make", "stages", "vanishing"), QUICK)
def test_models(make: Callable[[], sg.Model], stages: int, vanishing: bool, tmp_path: Path) -> None:
    said = model_units(make, stages, vanishing, tmp_path / "c")
    assert all_hold(said)
    # it took steps, and looked at directions of the Newton matrix
    assert int(re.search(r"directions (\d+)", said)[1]) > 0
    assert int(re.search(r"steps (\d+)", said)[1]) > 0


def located_units(
    make: Callable[[], sg.Model], stages: int, folder: Path, starts: int, derivatives: bool = False
) -> str:
    """Located steps of any model from drawn starts."""
    folder = sg.generate(
        make(), folder, stages=stages, prefix="m", events="located", derivatives=derivatives
    )
    for source in (folder / "m.c", folder / "m_model.c"):
        source.write_text(branch_coverage.with_lines(source.read_text()))
    source = ROOT / "tests" / "c" / "run_located.c"
    return build_and_run(source, folder, folder, *FLAGS, f"-DSTARTS={starts}")


@pytest.mark.thorough
@pytest.mark.parametrize("make", [mixed_contacts, rheonomic, anisotropic])
def test_located_steps_of_any_model(make: Callable[[], sg.Model], tmp_path: Path) -> None:
    """Redundant contacts, guards, friction elements, time everywhere: what a step leaves in the
    scratch is nothing to the next, it ends at its time, without penetration, and alike where it is
    differentiated."""
    assert all_hold(located_units(make, 2, tmp_path / "m", 20, derivatives=True))


LOCATED = (
    *(rheonomic, mixed_contacts, sticking_incline, box.model, one_coordinate, forms, anisotropic),
    pressed,
    *(slope.model, conveyor_oscillator.model, woodpecker.model, bead_on_hoop.model),
    box_in_space.model,
)
LOCATED_FILES = (
    *("sg_modes.c", "sg_accelerations.c", "sg_dense.c", "sg_segment.c", "sg_events.c"),
    *("sg_force_events.c", "sg_impact.c", "sg_located.c", "sg_notes.c"),
)


@pytest.mark.slow
def test_branches_of_located_steps(tmp_path: Path) -> None:
    """Drawn starts of many models take nine of ten branches of the files of located steps."""
    counts: branch_coverage.Branches = {}
    for k, make in enumerate(LOCATED):
        starts = 8 if make is box_in_space.model else 60
        assert all_hold(located_units(make, 3 - k % 2, tmp_path / str(k), starts))
        branch_coverage.collect(tmp_path / str(k), counts)
    totals, missing = branch_coverage.summary(counts)
    totals = {name: totals[name] for name in LOCATED_FILES}
    missing = [line for line in missing if line.split(":")[0] in LOCATED_FILES]
    taken, existing = (sum(column) for column in zip(*totals.values(), strict=True))
    assert taken >= 0.9 * existing, branch_coverage.table(totals, missing)


@pytest.mark.thorough
def test_branches(tmp_path: Path) -> None:
    """Every unit test on every model holds; together they take 95 % of all branches."""
    counts: branch_coverage.Branches = {}
    said = [step_units(tmp_path / "ball"), full_units(tmp_path / "full")]
    folders = [tmp_path / "ball", tmp_path / "full"]
    for k, (make, stages, vanishing) in enumerate(MODELS):
        folders.append(tmp_path / str(k))
        said.append(model_units(make, stages, vanishing, folders[-1]))
    assert all(map(all_hold, said))
    for folder in folders:
        branch_coverage.collect(folder, counts)
    totals, missing = branch_coverage.summary(counts)
    report = branch_coverage.table(totals, missing)
    branch_coverage.REPORT.parent.mkdir(exist_ok=True)
    branch_coverage.REPORT.write_text(report)
    taken, existing = (sum(column) for column in zip(*totals.values(), strict=True))
    assert taken >= 0.95 * existing, report
    assert all(a >= 0.9 * b for a, b in totals.values()), report


_REJECTING = r"""
static int sg_check_problem(const SG(work) * w, const SG(options) * opt, int problem) {
    static int asked;
    return ++asked % 2 == 0 && sg_really_check_problem(w, opt, problem);
}
"""
_RUN = r"""
#include <stdio.h>
#include "ball.c"
static ball_work work;
int main(void) {
    const ball_params par = ball_default_params();
    ball_options opt = ball_default_options();
    ball_state state;
    ball_info info;
    ball_real t[1], q[3], v[3];
    int k, status, failed = 0;
    opt.max_halvings = 0;
    ball_initial_state(&par, t, q, v);
    status = ball_init(&state, &par, &opt, t[0], q, v);
    for (k = 0; k < 100; ++k) {
        status = ball_step(&state, &work, &info, &par, &opt, NULL, 1e-2);
        failed += status != BALL_OK_RESCUED || info.iterations > 40;
    }
    printf("%d failed, y = %.9f\n", failed, state.q[1]);
    return failed;
}
"""


def test_what_the_checker_rejects_is_tried_anew(tmp_path: Path) -> None:
    """A checker that says no every other time makes every step a rescued one, and loses none."""
    folder = sg.generate(bouncing_ball.model(), tmp_path / "c", stages=2, prefix="ball")
    source = folder / "ball.c"
    head = "static int sg_check_problem("
    begin = source.read_text().index(head)
    end = source.read_text().index("\n}\n", begin) + 3
    text = source.read_text()
    text = text[:end] + _REJECTING + text[end:]
    source.write_text(text.replace(head, "static int sg_really_check_problem(", 1))
    (folder / "units.c").write_text(_RUN)
    build_and_run(folder / "units.c", folder, tmp_path)


_LEFT_OUT = r"""
#include <stdio.h>
#include "ball.c"
static ball_work w;
/* Failures where percussions before and after are not those expected. */
static int look(int problem, int exists, int active, ball_real expected) {
    ball_real *R = &w.R[sg_problems[problem].R];
    int k, failed = 0;
    w.found.exists[0] = exists;
    w.found.active[0] = active;
    for (k = 0; k < SG_N_R; ++k) {
        R[k] = 1.5;
    }
    sg_leave_out(&w, problem);
    for (k = 0; k < SG_N_R; ++k) {
        failed += R[k] != expected;
    }
    return failed;
}
int main(void) {
    /* the position problem takes every contact that exists, the velocity problem the closed ones */
    const int failed = look(0, 1, 0, 1.5) + look(0, 0, 0, 0.0) + look(1, 1, 1, 1.5) +
                       look(1, 1, 0, 0.0) + look(1, 0, 1, 0.0);
    printf("%d failed\n", failed);
    return failed;
}
"""


def test_contacts_left_out_have_no_percussion(tmp_path: Path) -> None:
    """Whatever an iteration left there: the checker asks for zero to the last bit."""
    folder = sg.generate(bouncing_ball.model(), tmp_path / "c", stages=2, prefix="ball")
    (folder / "units.c").write_text(_LEFT_OUT)
    build_and_run(folder / "units.c", folder, tmp_path)
