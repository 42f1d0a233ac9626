"""Generated folders that are a Rust crate, an Arduino library, a function of Octave as well."""

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
    bind = ["rust", "arduino", "octave"]
    folder = sg.generate(bouncing_ball.model(), tmp_path / "m", bind=bind)
    both = files_of(folder)
    more = {"Cargo.toml", "build.rs", "lib.rs", "run.rs", "library.properties"}
    more |= {"bouncing_ball_mex.c", "make_mex.m", "run_mex.m"}
    assert set(both) - set(plain) == {*more, "examples/run/run.ino"}
    assert {name: both[name] for name in plain} == plain
    assert drift(bouncing_ball.model(), folder) == ""
    for mine in (folder / "examples/run/mine.txt", folder / "examples/own/own.ino"):
        mine.parent.mkdir(exist_ok=True)
        mine.write_text("of the user")
    sg.generate(bouncing_ball.model(), folder, bind=bind)
    kept = {"examples/run/mine.txt": b"of the user", "examples/own/own.ino": b"of the user"}
    assert files_of(folder) == both | kept
    (folder / "run.rs").write_text(both["run.rs"].decode().replace("% 10", "% 20"))
    assert "run.rs" in drift(bouncing_ball.model(), folder)
    sg.generate(bouncing_ball.model(), folder)
    assert files_of(folder) == plain | kept


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(sg.GenerationError, match="Rust has no extended precision"):
        sg.generate(bouncing_ball.model(), tmp_path / "m", precision="extended", bind=["rust"])
    with pytest.raises(sg.GenerationError, match="choose among rust, arduino, octave"):
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


def octave(folder: Path, program: str) -> str:
    (folder / "program.m").write_text(program)
    return run("octave-cli", "--no-history", "--quiet", "program.m", cwd=folder)


@pytest.mark.thorough
@pytest.mark.parametrize("precision", ["double", "float"])
def test_octave_steps_as_the_stepper_does(precision: str, tmp_path: Path) -> None:
    """Whole runs, runs that go on, changed starts and parameters: bit for bit."""
    if shutil.which("octave-cli") is None or shutil.which("mkoctfile") is None:
        pytest.skip("Octave is missing: install octave and octave-dev")
    model = slider_crank.model()
    folder = sg.generate(model, tmp_path / "a folder", bind=["octave"], precision=precision)
    first = octave(folder, "run_mex").splitlines()
    stepper = sg.build(model, stages=3, precision=precision)
    traj = stepper.simulate(t_end=1e-3 * (len(first) - 1), dt=1e-4)
    assert first[0].split() == ["t", *stepper.manifest["coordinates"]]
    rows = np.array([[float(x) for x in line.split()] for line in first[1:]])
    assert len(rows) > 10
    np.testing.assert_array_equal(rows, np.column_stack([traj.t, traj.q])[10::10])

    program = """
        about = struct('parameters', struct('mu', 0.1), 'v0', 0.5 * START);
        about.options = struct('max_iterations', 150);
        whole = slider_crank(300, 1e-4, about);
        one = slider_crank(100, 1e-4, about);
        about = rmfield(about, 'v0');
        about.state = one.state;
        rest = slider_crank(200, 1e-4, about);
        assert(whole.q, [one.q; rest.q(2:end, :)]);
        assert(whole.P_N, [one.P_N; rest.P_N(2:end, :)]);
        assert(whole.ok && strcmp(whole.text, 'solved'));
        all = [whole.t, whole.q, whole.v, whole.P_g, whole.P_N, whole.P_F, whole.contact];
        printf([repmat('%.17g ', 1, columns(all)), '\\n'], all');
    """
    v0 = np.array([traj.v[0][k] for k in range(9)])
    start = "[" + " ".join(repr(float(x)) for x in v0) + "]"
    text = octave(folder, program.replace("START", start).replace("\\\\n", "\\n"))
    got = np.array([[float(x) for x in line.split()] for line in text.splitlines()])
    other = stepper.simulate(
        t_end=0.03, dt=1e-4, v0=0.5 * v0, parameters={"mu": 0.1}, max_iterations=150
    )
    assert np.count_nonzero(other.P_N) > 3
    t_to_v = 1 + 2 * 9
    np.testing.assert_array_equal(got[:, :t_to_v], np.column_stack([other.t, other.q, other.v]))
    P = np.column_stack([other.P_g, other.P_N, other.P_F])
    np.testing.assert_array_equal(got[:, t_to_v:-4], P)
    numbers = {"open": [0], "stick": [2], "slip": [3, 4]}
    for k, contact in enumerate(stepper.manifest["contacts"]):
        states = other[f"{contact['name']}.state"]
        for state, row in zip(states[1:], got[1:, k - 4], strict=True):
            assert row in numbers[state]


@pytest.mark.thorough
def test_octave_is_told_what_is_wrong(tmp_path: Path) -> None:
    if shutil.which("octave-cli") is None or shutil.which("mkoctfile") is None:
        pytest.skip("Octave is missing: install octave and octave-dev")
    folder = sg.generate(bouncing_ball.model(), tmp_path / "m", bind=["octave"])
    wrong = {
        "bouncing_ball(0, 1e-2)": "give the number of steps",
        "bouncing_ball(2.5, 1e-2)": "give the number of steps",
        "bouncing_ball(10)": "call it as run",
        "bouncing_ball(3, 1e-2, 5)": "give a struct",
        "bouncing_ball(3, 1e-2, struct('q0', [1 2]))": "has 2 numbers, and should have 3",
        "bouncing_ball(3, 1e-2, struct('q0', 'abc'))": "give real numbers",
        "bouncing_ball(3, 1e-2, struct('q0', [0; -1; 0]))": "penetrates a contact",
        "bouncing_ball(3, 1e-2, struct('u', 1))": "has no inputs",
        "bouncing_ball(3, 1e-2, struct('nu', 1))": "is not one of t0, q0",
        "bouncing_ball(3, 1e-2, struct('parameters', struct('nu', 1)))": "is not one of",
        "bouncing_ball(3, 1e-2, struct('options', struct('max_halvings', 1.5)))": "no value of",
        "bouncing_ball(3, 1e-2, struct('state', uint8(1:9)))": "state of an earlier run",
    }
    calls = "".join(f"try, {call}; disp('none'), catch e, disp(e.message), end\n" for call in wrong)
    failed = "run = bouncing_ball(3, -1); disp(run.ok), disp(run.text), disp(size(run.q))"
    lines = octave(folder, f"make_mex\n{calls}{failed}").splitlines()
    assert len(lines) == len(wrong) + 3
    for (call, part), line in zip(wrong.items(), lines, strict=False):
        assert part in line, (call, line)
    assert lines[-3] == "0"
    assert "out of its range" in lines[-2]
    assert lines[-1].split() == ["1", "3"]
