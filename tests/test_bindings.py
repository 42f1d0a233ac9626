"""Generated folders that are a Rust crate or an Arduino library as well."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from compilers import run
from machines import HERE, M7, program_output
from signorini.models import bouncing_ball, slider_crank
from signorini.workflow import drift

ARDUINO = """
#include <math.h>
#include <stdio.h>
static void delay(int) {}
struct Printer {
    void begin(long) {}
    void print(char c) { printf("%c", c); }
    void print(double x, int digits) { printf("%.*f", digits, x); }
    void println() { printf("\\n"); }
    void println(const char *text) { printf("%s\\n", text); }
} Serial;
"""


def files_of(folder: Path) -> dict[str, bytes]:
    return {
        p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()
    }


def test_a_folder_is_a_crate_and_a_library(tmp_path: Path) -> None:
    """The plain folder and a few files more, the same each time; without them they go, and what a
    user has beside them stays."""
    plain = files_of(sg.generate(bouncing_ball.model(), tmp_path / "plain"))
    folder = sg.generate(bouncing_ball.model(), tmp_path / "m", bind=["rust", "arduino"])
    both = files_of(folder)
    more = {"Cargo.toml", "build.rs", "lib.rs", "run.rs", "library.properties"}
    assert set(both) - set(plain) == {*more, "examples/run/run.ino"}
    assert {name: both[name] for name in plain} == plain
    assert drift(bouncing_ball.model(), folder) == ""
    for mine in (folder / "examples/run/mine.txt", folder / "examples/own/own.ino"):
        mine.parent.mkdir(exist_ok=True)
        mine.write_text("of the user")
    sg.generate(bouncing_ball.model(), folder, bind=["rust", "arduino"])
    kept = {"examples/run/mine.txt": b"of the user", "examples/own/own.ino": b"of the user"}
    assert files_of(folder) == both | kept
    (folder / "run.rs").write_text(both["run.rs"].decode().replace("% 10", "% 20"))
    assert "run.rs" in drift(bouncing_ball.model(), folder)
    sg.generate(bouncing_ball.model(), folder)
    assert files_of(folder) == plain | kept


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(sg.GenerationError, match="Rust has no extended precision"):
        sg.generate(bouncing_ball.model(), tmp_path / "m", precision="extended", bind=["rust"])
    with pytest.raises(sg.GenerationError, match="choose among rust, arduino"):
        sg.generate(bouncing_ball.model(), tmp_path / "m", bind=["cobol"])
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "build.rs").write_text("fn main() {}")
    with pytest.raises(sg.GenerationError, match=r"holds build\.rs"):
        sg.generate(bouncing_ball.model(), tmp_path / "m", bind=["rust"])
    assert [p.name for p in tmp_path.iterdir()] == ["m"]


@pytest.mark.thorough
@pytest.mark.parametrize("precision", ["double", "float"])
def test_a_sketch_runs_on_a_board(precision: str, tmp_path: Path) -> None:
    """On an emulated Cortex-M7, with every C file that the library holds: as the loaded stepper."""
    M7.need()
    model = bouncing_ball.model()
    folder = sg.generate(model, tmp_path / "m", bind=["arduino"], precision=precision)
    sketch = (folder / "examples/run/run.ino").read_text()
    main = """int main() {
        setup();
        for (int k = 0; k < 60; ++k) loop();
        printf("end\\n");
        return 42;
    }"""
    (tmp_path / "sketch.cpp").write_text(ARDUINO + sketch + main)
    shutil.copy(HERE / "startup.c", tmp_path)
    sources = [*sorted(folder.glob("*.c")), tmp_path / "startup.c", tmp_path / "sketch.cpp"]
    objects = [f"{source.stem}.o" for source in sources]
    compiler, *flags = M7.compile
    for source, name in zip(sources, objects, strict=True):
        language = ("-std=c99",) if source.suffix == ".c" else ("-fno-exceptions", "-fno-rtti")
        more = ("-O2", "-ffp-contract=off", "-DARDUINO=10800", f"-I{folder}")
        run(compiler, *flags, *language, *more, "-c", str(source), "-o", name, cwd=tmp_path)
    run(compiler, *flags, "-o", "sketch.elf", *objects, "-lm", cwd=tmp_path)
    rows = np.array(program_output(*M7.run, tmp_path / "sketch.elf"))
    traj = sg.build(model, stages=3).simulate(t_end=0.6, dt=1e-2)
    assert rows.shape == (6, 4)
    exact = np.column_stack([traj.t, traj.q])[10::10]
    np.testing.assert_allclose(rows, exact, atol=1e-6 if precision == "double" else 2e-4)


@pytest.mark.slow
@pytest.mark.parametrize("make", [bouncing_ball.model, slider_crank.model])
def test_a_crate_steps_as_the_stepper_does(make: Callable[[], sg.Model], tmp_path: Path) -> None:
    """bindgen and cc come from crates.io, libclang from the system."""
    if shutil.which("cargo") is None:
        pytest.skip("cargo is missing: install Rust")
    model = make()
    folder = sg.generate(model, tmp_path / "m", bind=["rust"])
    text = run("cargo", "run", "-q", "--example", "run", cwd=folder)
    names, *lines = text.splitlines()
    rows = np.array([[float(x) for x in line.split()] for line in lines])
    stepper = sg.build(model, stages=3)
    assert names.split() == ["t", *stepper.manifest["coordinates"]]
    dt = model.suggested["dt"]
    traj = stepper.simulate(t_end=10 * len(rows) * dt, dt=dt)
    assert len(rows) > 10
    np.testing.assert_array_equal(rows, np.column_stack([traj.t, traj.q])[10::10])
