"""The files of the C runtime, one by one: what each needs, what the checker leaves alone."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import signorini as sg
from compilers import compiler, run
from crowds import row_of_discs
from signorini.codegen.c.build import ALL, CONTRACT, SCRATCH, emit_spec, runtime_order
from signorini.codegen.c.emit import RUNTIME_BEGIN, TABLES_END, render
from signorini.codegen.c.memory import scratch
from signorini.codegen.frontend.validate import freeze
from signorini.models import box_in_space, slope
from signorini.runtime import compile as compiling

C = Path(__file__).resolve().parent.parent / "runtime" / "c"
FILES = sorted(path.name for path in C.iterdir())
SOURCES = [name for name in FILES if name.endswith(".c")]
# Those of models in which contacts join parts.
JOINED_SOURCES = (
    *("sg_member.c", "sg_graph.c", "sg_island.c", "sg_island_state.c", "sg_assemble.c"),
    *("sg_assemble_segment.c", "sg_large.c", "sg_join.c"),
)


def test_every_file_is_part_of_a_stepper() -> None:
    """Or stands beside it: in the files of the model functions and of the external function."""
    assert set(runtime_order(ALL)) == set(FILES)


def test_every_file_compiles_with_what_it_includes(tmp_path: Path) -> None:
    """Alone, with the contract and the tables of a model before it."""
    model = freeze(box_in_space.model())
    files = render(emit_spec(model, stages=2, prefix="m", derivatives=True))
    (tmp_path / "m.h").write_text(files["m.h"])
    head = files["m.c"].split(TABLES_END)[0]
    assert RUNTIME_BEGIN in head
    crowded = render(emit_spec(freeze(row_of_discs()), stages=2, prefix="n", events="located"))
    (tmp_path / "n.h").write_text(crowded["n.h"])
    known = set(runtime_order((CONTRACT,))) | set(SCRATCH)
    beside = {
        "sg_stable.c": files["m_model.c"].split(RUNTIME_BEGIN)[0],
        "sg_external.c": files["m_casadi.c"].split(RUNTIME_BEGIN)[0],
    }
    own = re.compile(r"#(pragma once|include \"sg_\w+\.[ch]\")")
    flags = ("-std=c99", "-Wall", "-Wextra", "-Werror=implicit-function-declaration")
    joined = crowded["n.c"].split(TABLES_END)[0]
    for name in SOURCES:
        text, there = (beside[name], set()) if name in beside else (head, known)
        if name in JOINED_SOURCES:
            text = joined
        needed = (other for other in runtime_order((name,)) if other not in there)
        text += "".join(own.sub("", (C / other).read_text()) for other in needed)
        (tmp_path / f"alone_{name}").write_text(text)
        run(compiler("gcc"), *flags, "-fsyntax-only", f"alone_{name}", cwd=tmp_path)


def test_the_checker_includes_nothing_of_the_laws() -> None:
    """It judges by its own formulas: only numbers, tables and scratch are shared."""
    shared = {
        *("sg_real.h", "sg_numbers.h", "sg_sparse.c", "sg_contract.h", "sg_work.h"),
        *("sg_part.h", "sg_response.c", "sg_limit.c"),
    }
    checker = {name for name in FILES if name.endswith("check.c")}
    assert len(checker) == 4
    assert set(runtime_order(("sg_check.c",))) == shared | checker


# A function may be longer for a reason, which stands beside its name.
LONGER: dict[str, str] = {}


@pytest.mark.parametrize("name", SOURCES)
def test_no_function_is_longer_than_sixty_lines(name: str) -> None:
    begin = None
    lines = (C / name).read_text().splitlines()
    for number, line in enumerate(lines):
        if begin is None and re.match(r"(static|real|int) [^;]*$", line) and "enum" not in line:
            begin = number
        elif line == "}" and begin is not None:
            title = re.search(r"(\w+|SG\(\w+\))\(", lines[begin])
            assert title, lines[begin]
            assert number - begin < 60 or title[1] in LONGER, f"{name}: {title[1]}"
            begin = None


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("    double x[SG_N_Q]; /* a type of its own */", "cannot read"),
        ("    real x[SG_N_Z]; /* a size that no model has */", "no size SG_N_Z"),
        ("    real x[SG_N_Q];", "cannot read"),
    ],
)
def test_scratch_that_cannot_be_read_is_refused(line: str, said: str) -> None:
    sizes = emit_spec(freeze(box_in_space.model()), stages=2).sizes
    text = (C / SCRATCH[0]).read_text()
    assert [s.name for s in scratch(text, sizes)][:2] == ["masses", "scales"]
    broken = text.replace("    int formed;", f"{line}\n    int formed;", 1)
    with pytest.raises(ValueError, match=said):
        scratch(broken, sizes)


def test_a_driver_of_batches_with_another_struct_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "batch.c"
    text = compiling._BATCH.read_text()
    other.write_text(text.replace("*counts, *contact, *status", "*contact, *counts, *status", 1))
    assert other.read_text() != text
    monkeypatch.setattr(compiling, "_BATCH", other)
    m = sg.Model("point")
    (x,) = m.coordinates("x")
    m.lagrangian = m.velocities[0] ** 2 / 2 - x**2
    m.initial_state(q=[1])
    with pytest.raises(sg.RunError, match="the driver 'batch' lays out its struct"):
        sg.build(m, stages=2)


@pytest.mark.parametrize("level", [0, 1])
def test_long_models_are_optimised_less_than_the_runtime(
    level: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Where the compiler is gcc; the steps are the same to the last bit."""
    monkeypatch.setenv("SIGNORINI_CACHE", str(tmp_path))
    monkeypatch.setenv("CC", compiler("gcc"))
    one = sg.build(slope.model(), stages=2).simulate(t_end=0.3, dt=1e-2)
    monkeypatch.setenv("SIGNORINI_CFLAGS", "")
    monkeypatch.setattr(compiling, "_LEVELS", ((0, level),))
    called: list[list[str]] = []
    plain = subprocess.run

    def listen(command: list[str], **more: Any) -> Any:
        called.append([str(x) for x in command])
        return plain(command, **more)

    monkeypatch.setattr(compiling.subprocess, "run", listen)
    m = slope.model()
    m.name = "slope_light"
    other = sg.build(m, stages=2).simulate(t_end=0.3, dt=1e-2)
    np.testing.assert_array_equal(one.q, other.q)
    (stepper,) = (c for c in called if "slope_light.c" in c)
    assert {"-O2", f"-DSIGNORINI_EVALUATION={level}"} <= set(stepper)
    (functions,) = (c for c in called if "slope_light_model.c" in c)
    assert f"-O{level}" in functions


_HASH = """
import hashlib, sys, signorini as sg
from signorini.locate import find_model
for name in sys.argv[1:]:
    traj = sg.build(find_model(name), stages=2).simulate(t_end=0.5, dt=2.5e-3)
    print(name, hashlib.sha256(traj.q.tobytes() + traj.v.tobytes()).hexdigest())
"""


@pytest.mark.parametrize(
    "names",
    [
        ("slope",),
        pytest.param(("bouncing_ball", "box", "box_in_space", "coin"), marks=pytest.mark.thorough),
    ],
)
def test_the_default_library_takes_the_same_steps(names: tuple[str, ...]) -> None:
    """The tests compile with -O0, users with -O2: to the last bit the same."""
    found = []
    for flags in ("-O0", ""):
        environment = os.environ | {"SIGNORINI_CFLAGS": flags}
        done = subprocess.run(
            [sys.executable, "-c", _HASH, *names],
            env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        found.append(done.stdout)
    assert found[0] == found[1]
    assert len(found[0].splitlines()) == len(names)
