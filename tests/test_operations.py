"""Operations of a step: what the manifest states bounds what is counted.

The generated C is compiled as C++ with a real type that counts.
"""

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
import signorini as sg
from compilers import compiler
from signorini.models import (
    bouncing_ball,
    box_in_space,
    slider_crank,
    slope,
    table_with_legs,
    v_groove,
)
from trap_models import forms, mixed_contacts, only_constraints, rheonomic

SOURCES = Path(__file__).parent / "c"
thorough = pytest.mark.thorough


def count(folder: Path, iteration: int, step: int, located: int) -> tuple[float, float, float]:
    """Largest shares of the bounds for an iteration and for a step; most iterations."""
    header = (folder / "m.h").read_text()
    assert "typedef double m_real;" in header
    (folder / "m.h").write_text(header.replace("typedef double m_real;", "typedef counted m_real;"))
    for name in ("counted.hpp", "count_operations.cpp"):
        shutil.copy(SOURCES / name, folder)
    command = [compiler("g++"), "-O1", f"-DLOCATED={located}", "count_operations.cpp"]
    subprocess.run([*command, "-o", "count", "-lm"], cwd=folder, check=True)
    done = subprocess.run(
        ["./count", str(iteration), str(step)], cwd=folder, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    of_iteration, of_step, most = (float(x) for x in done.stdout.split())
    return of_iteration, of_step, most


@thorough
@pytest.mark.parametrize(("make", "stages"), [(slope.model, 3), (mixed_contacts, 2)])
def test_bounds_of_located_steps_hold(
    make: Callable[[], sg.Model], stages: int, tmp_path: Path
) -> None:
    folder = sg.generate(make(), tmp_path / "m", stages=stages, prefix="m", events="located")
    stated = json.loads((folder / "manifest.json").read_text())["footprint"]
    assert f"{stated['located']:,}" in (folder / "README.md").read_text()
    _, of_step, _ = count(folder, stated["iteration"], stated["located"], 1)
    assert 0 < of_step < 0.5


@pytest.mark.parametrize(
    ("make", "stages"),
    [
        (slope.model, 3),
        (box_in_space.model, 2),
        *(
            pytest.param(make, stages, marks=thorough)
            for make, stages in (
                (bouncing_ball.model, 3), (slider_crank.model, 3), (v_groove.model, 4),
                (table_with_legs.model, 3), (forms, 2), (mixed_contacts, 3), (rheonomic, 3),
                (only_constraints, 4),
            )
        ),
    ],
)  # fmt: skip
def test_bounds_hold(make: Callable[[], sg.Model], stages: int, tmp_path: Path) -> None:
    folder = sg.generate(make(), tmp_path / "m", stages=stages, prefix="m")
    stated = json.loads((folder / "manifest.json").read_text())["footprint"]
    assert f"{stated['step']:,}" in (folder / "README.md").read_text()
    assert stated["located"] == 0
    of_iteration, of_step, most = count(folder, stated["iteration"], stated["step"], 0)
    assert 0 < of_step < of_iteration <= 1
    assert 2 <= most <= 200
