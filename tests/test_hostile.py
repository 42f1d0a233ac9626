"""Whatever a user or a file gives: a named error or a solved step, never a crash."""

import ctypes
import os
import shutil
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import signorini as sg
from hypothesis import given, settings
from hypothesis import strategies as st
from signorini.models import box, v_groove
from signorini.runtime.options import RunOptions
from signorini.runtime.replay import FailedStep
from signorini.runtime.replay import replay as take_again
from signorini.runtime.run import Run
from signorini.stress.campaign import case_of
from trap_models import mixed_contacts

WHOLE = RunOptions(max_halvings=0)  # no substeps

ROOT = Path(__file__).resolve().parent.parent
Build = Callable[..., sg.Stepper]
EXPECTED = (sg.RunError, sg.StepError)

anything = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5),
    st.lists(st.floats(), max_size=4), st.complex_numbers(), st.binary(max_size=3),
    st.dictionaries(st.text(max_size=5), st.floats(), max_size=2),
)  # fmt: skip


# --- from Python ----------------------------------------------------------------------------------


@settings(max_examples=150, deadline=None)
@given(
    name=st.sampled_from(
        ["q0", "v0", "t0", "t_end", "dt", "parameters", "inputs", "tol", "r", "active_set",
         "record", "every", "scaling", "max_halvings", "max_iterations", "progress"]
    ),
    value=anything,
)  # fmt: skip
def test_any_argument_of_a_run(name: str, value: Any, stepper: Build) -> None:
    """A run with one argument out of anything ends, or with an error that the package names."""
    arguments: dict[str, Any] = {"t_end": 0.05, "dt": 1e-2, name: value}
    if name == "t_end" and isinstance(value, (int, float)) and not abs(value) < 10:
        arguments["dt"] = max(abs(float(value)) / 50, 1e-2) if np.isfinite(float(value)) else 1e-2
    if name == "dt" and isinstance(value, (int, float)) and 0 < value < 1e-3:
        arguments["t_end"] = float(value) * 5
    try:
        traj = stepper(box.model, 2).simulate(**arguments)
    except EXPECTED as error:
        assert str(error)
        return
    assert np.all(np.isfinite(traj.q))


@settings(max_examples=100, deadline=None)
@given(
    q=st.lists(st.floats(), min_size=3, max_size=3),
    v=st.lists(st.floats(), min_size=3, max_size=3),
    dt=st.floats(),
    mass=st.floats(),
    mu=st.floats(),
)
def test_any_numbers_in_a_step(
    q: list[float], v: list[float], dt: float, mass: float, mu: float, stepper: Build
) -> None:
    try:
        traj = stepper(box.model, 2).step(0.0, q, v, dt, parameters={"mass": mass, "mu": mu})
    except EXPECTED as error:
        assert str(error)
        return
    assert np.all(np.isfinite(traj.q)) and np.all(np.isfinite(traj.v))


def test_negative_friction_and_restitution_at_run_time(stepper: Build) -> None:
    """The C code refuses what the Python surface would not let through either."""
    compiled = stepper(box.model, 2)
    lib = compiled.library
    for name, value in (("mu", -0.1), ("e_N", 1.5), ("e_N", -1.0), ("e_F", 2.0), ("mu", np.nan)):
        with pytest.raises(sg.RunError, match=name):
            compiled.simulate(t_end=0.1, dt=1e-2, parameters={name: value})
        state = compiled.c_state(0.0, np.array([0, 0.5, 0]), np.zeros(3))
        work, info = lib.structs["work"](), lib.structs["info"]()
        params = compiled.c_params(compiled.parameters | {name: value})
        before = bytes(state)
        status = lib.call["step"](
            state, work, info, params, compiled.c_options(RunOptions(max_halvings=0)), None, 1e-2
        )
        assert lib.statuses[status] == "BAD_ARGUMENT"
        assert bytes(state) == before


@pytest.mark.parametrize(
    "name",
    ['a"; system("x"); "', "a*/int x;/*", "a\nb", "../a", "a b", "if", "é", "", "$(x)", "a;b"],
)
def test_hostile_names_do_not_get_out(name: str, tmp_path: Path) -> None:
    """Model, coordinate, parameter, contact and prefix names: refused, or harmless in C."""
    makers: tuple[Callable[[], object], ...] = (
        lambda: _ball(model=name), lambda: _ball(coordinate=name), lambda: _ball(parameter=name),
        lambda: _ball(contact=name),
    )  # fmt: skip
    for make in makers:
        try:
            model = make()
            folder = sg.generate(model, tmp_path / "out", prefix="p")  # type: ignore[arg-type]
        except (sg.ModelError, sg.GenerationError):
            assert not (tmp_path / "out").exists()
            continue
        assert sorted(p.name for p in tmp_path.iterdir()) == ["out"]
        sg.load(folder).simulate(t_end=0.1, dt=1e-2)
        shutil.rmtree(folder)
    if not name.isidentifier() or not name.isascii():
        with pytest.raises(sg.GenerationError):
            sg.generate(_ball(), tmp_path / "out", prefix=name)
        assert not (tmp_path / "out").exists()


def _ball(
    model: str = "ball", coordinate: str = "y", parameter: str = "m", contact: str = "floor"
) -> sg.Model:
    m = sg.Model(model)
    y, *more = m.coordinates(coordinate)
    v = m.velocities
    (mass,) = m.parameters(**{parameter: 1.0})
    m.lagrangian = mass * (sum(each**2 for each in v) / 2 - 9.81 * y)
    m.doc = model
    m.contact(contact, g_N=y)
    m.initial_state(q=[1] * (1 + len(more)))
    return m


def test_a_model_that_divides_by_zero(tmp_path: Path) -> None:
    """Named where it happens: at the start, or in the step that gets there."""
    m = sg.Model("pole")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2 + 1 / x
    m.contact("floor", g_N=x, e_N=1)
    m.initial_state(q=[0])
    with pytest.raises(sg.ModelError, match="model 'pole', the Lagrangian"):
        sg.build(m, stages=2)
    m.initial_state(q=[1])
    built = sg.build(m, stages=2)
    with pytest.raises(EXPECTED, match="pole"):
        built.simulate(t_end=1, dt=0.1, q0=[0])
    # whatever it does near the pole, it stays finite or says that it stopped
    try:
        traj = built.simulate(t_end=10, dt=0.01)
    except sg.StepError as error:
        traj = error.trajectory
    assert len(traj) > 50
    assert np.all(np.isfinite(traj.q))


# --- units, threads, compilers --------------------------------------------------------------------


def test_any_units_step_by_step(stepper: Build) -> None:
    """mm, g, ms against m, kg, s: from the same states the same steps to 1e-10."""
    compiled = stepper(box.model, 3)
    traj = compiled.simulate(t_end=1.5, dt=1e-2, parameters={"mu": 0.4, "e_N": 0.3})
    small = {"mass": 1e3, "a": 200.0, "b": 100.0, "grav": 9.81e-3, "mu": 0.4, "e_N": 0.3}
    length = np.array([1e3, 1e3, 1.0])
    worst = 0.0
    for k in range(len(traj) - 1):
        one = compiled.step(
            0.0, traj.q[k], traj.v[k], 1e-2, parameters={"mu": 0.4, "e_N": 0.3}
        )  # fmt: skip
        other = compiled.step(
            0.0, traj.q[k] * length, traj.v[k] * length / 1e3, 10.0, parameters=small
        )
        for mine, theirs, unit in ((one.q, other.q, length), (one.v, other.v, length / 1e3)):
            worst = max(worst, float(np.abs(mine[1] - theirs[1] / unit).max()))
    assert worst < 1e-10


def test_threads_do_not_disturb_each_other(stepper: Build) -> None:
    compiled = stepper(box.model, 3)
    starts = [case_of("box_drop", 1, k) for k in range(6)]

    def go(k: int) -> bytes:
        case = starts[k]
        return compiled.simulate(
            t_end=200 * case.dt, dt=case.dt, q0=case.q, v0=case.v, parameters=case.parameters
        ).q.tobytes()

    alone = [go(k) for k in range(6)]
    together: dict[int, bytes] = {}
    threads = [
        threading.Thread(target=lambda k=k: together.update({k: go(k)})) for k in range(6)
    ]  # fmt: skip
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [together[k] for k in range(6)] == alone


@pytest.mark.parametrize(
    ("scene", "make"),
    [
        ("box_drop", box.model),
        pytest.param("groove", v_groove.model, marks=pytest.mark.thorough),
    ],
)
def test_compilers_and_contraction(
    scene: str, make: Callable[[], sg.Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    """-O0, -O3 and contraction take the same step from 500 states each, but where a tie decides."""
    steppers = []
    for flags in ("-O0", "-O3", "-O3 -march=native -ffp-contract=fast"):
        monkeypatch.setenv("SIGNORINI_CFLAGS", flags)
        steppers.append(sg.build(make(), stages=2))
    first = steppers[0]
    compared = ties = number = 0
    while compared + ties < 500:
        case = case_of(scene, 7, number)
        number += 1
        par = first.check_parameters(case.parameters)
        q, v = first.project(case.q, case.v, parameters=par)
        run = Run(first, par, RunOptions(), 0.0, q, v, case.dt, 200, 1, False)
        for done in range(0, 195, 8):
            if run._chunk(np.zeros((200, 0)), done, 8)[1] < 8 or compared + ties >= 500:
                break
            step = run.failed("OK", [])
            ends = [take_again(each, step) for each in steppers]
            assert all(end["status"].startswith("OK") for end in ends)
            speed = max(1.0, float(np.abs(ends[0]["v"]).max()))
            gaps = [
                max(np.abs(np.subtract(e["q"], ends[0]["q"])).max(),
                    np.abs(np.subtract(e["v"], ends[0]["v"])).max()) for e in ends[1:]
            ]  # fmt: skip
            if max(gaps) > 1e-10 * speed:
                ties += 1
            else:
                compared += 1
    assert ties <= 2, f"{ties} of {compared + ties} steps differ"


# --- memory ---------------------------------------------------------------------------------------


def tool(name: str, package: str) -> str:
    found = shutil.which(name)
    if found is None:
        if os.environ.get("CI"):
            pytest.fail(f"{name} is missing in continuous integration")
        pytest.skip(f"{name} is not installed: apt-get install {package}")
    return found


def test_valgrind_finds_nothing(tmp_path: Path) -> None:
    valgrind = tool("valgrind", "valgrind")
    folder = sg.generate(mixed_contacts(), tmp_path / "c", stages=3)
    subprocess.run(["make", "-C", str(folder)], check=True, capture_output=True)
    result = subprocess.run(
        [valgrind, "-q", "--error-exitcode=9", "--leak-check=full", folder / "example"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert result.returncode != 9, result.stderr


def fuzzer(make: Callable[[], sg.Model], stages: int, folder: Path) -> Path:
    """The fuzz target for one model."""
    clang = tool("clang", "clang libclang-rt-dev")
    source = sg.generate(make(), folder, stages=stages, prefix="m")
    target = folder / "fuzz"
    result = subprocess.run(
        [clang, "-std=c99", "-g", "-O1", "-fsanitize=fuzzer,address,undefined",
         "-fno-sanitize-recover=all", '-DSTEPPER="m.c"', f"-I{source}", "-o", str(target),
         str(ROOT / "tests" / "c" / "fuzz_step.c"), "-lm"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if "cannot find" in result.stderr and not os.environ.get("CI"):
        pytest.skip("the fuzzer's library is not installed: apt-get install libclang-rt-dev")
    assert result.returncode == 0, result.stderr
    return target


def test_fuzz(tmp_path: Path) -> None:
    """A short run from a fixed seed; ten minutes of it behind the marker below."""
    target = fuzzer(mixed_contacts, 2, tmp_path / "c")
    result = subprocess.run(
        [target, "-runs=1500", "-seed=1", "-max_len=400"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr[-4000:]


@pytest.mark.slow
@pytest.mark.parametrize(("make", "stages"), [(mixed_contacts, 3), (v_groove.model, 2)])
def test_fuzz_for_ten_minutes(make: Callable[[], sg.Model], stages: int, tmp_path: Path) -> None:
    target = fuzzer(make, stages, tmp_path / "c")
    result = subprocess.run(
        [target, "-max_total_time=600", "-max_len=400"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr[-4000:]


def test_a_foreign_state_is_refused(stepper: Build) -> None:
    """A step of another model does not reach the C code."""
    compiled, other = stepper(box.model, 2), stepper(v_groove.model, 2)
    run = Run(compiled, compiled.parameters, WHOLE, *compiled.initial_state(), 1e-2, 1, 1, False)
    step = run.failed("OK", [])
    assert isinstance(step, FailedStep)
    with pytest.raises(sg.RunError, match="build the stepper"):
        take_again(other, step)
    assert ctypes.sizeof(compiled.library.structs["state"]) != ctypes.sizeof(
        other.library.structs["state"]
    )


# --- files ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run_file(stepper: Build, tmp_path_factory: pytest.TempPathFactory) -> Path:
    traj = stepper(box.model, 2).simulate(t_end=0.05, dt=1e-2, record="stages")
    return traj.save(tmp_path_factory.mktemp("files") / "run.npz")


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_any_damage_to_a_run_file(data: st.DataObject, stepper: Build, run_file: Path) -> None:
    """Bytes changed, cut out or put in: the run that was saved, or a named error."""
    compiled = stepper(box.model, 2)
    content = bytearray(run_file.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        how = data.draw(st.sampled_from(["change", "cut", "insert", "end"]))
        if how == "change":
            content[at] = data.draw(st.integers(0, 255))
        elif how == "cut":
            del content[at : at + data.draw(st.integers(1, 200))]
        elif how == "insert":
            content[at:at] = data.draw(st.binary(min_size=1, max_size=50))
        else:
            del content[at:]
        if not content:
            break
    damaged = run_file.with_name("damaged.npz")
    damaged.write_bytes(bytes(content))
    try:
        loaded = sg.Trajectory.load(damaged, compiled)
    except sg.RunError:
        return
    np.testing.assert_array_equal(loaded.q, sg.Trajectory.load(run_file, compiled).q)


@settings(max_examples=120, deadline=None)
@given(data=st.data())
def test_any_damage_to_a_replay_file(data: st.DataObject, stepper: Build, run_file: Path) -> None:
    compiled = stepper(box.model, 2)
    run = Run(compiled, compiled.parameters, WHOLE, *compiled.initial_state(), 1e-2, 1, 1, False)
    path = run.failed("OK", []).save(run_file.with_name("step.json"))
    text = path.read_text()
    at = data.draw(st.integers(0, len(text) - 1))
    new = data.draw(st.text(alphabet='0123456789.-+e,[]{}:" nulltrefasNI', max_size=6))
    path.write_text(text[:at] + new + text[at + data.draw(st.integers(0, 30)) :])
    try:
        take_again(compiled, FailedStep.load(path))
    except sg.RunError as error:
        assert str(error)


# --- constraints that contradict each other -------------------------------------------------------


def test_contradictory_constraints_are_named(tmp_path: Path) -> None:
    """Duplicated rows are solved; rows that part from each other end the run with their names."""
    m = sg.Model("parting")
    x, y = m.coordinates("x y")
    vx, vy = m.velocities
    (rate,) = m.parameters(rate=0.0)
    m.lagrangian = (vx**2 + vy**2) / 2 - y
    m.constraint("rail", x - 2 * y)
    m.constraint("again", 3 * x - 6 * y)
    m.constraint("other", x - 2 * y - rate * m.time**2)
    m.initial_state(q=[0, 0])
    compiled = sg.build(m, stages=3)
    assert len(compiled.simulate(t_end=0.5, dt=0.05)) == 11
    with pytest.raises(sg.StepError, match=r"'rail'.*'other'|'other'.*'rail'"):
        compiled.simulate(t_end=0.5, dt=0.05, parameters={"rate": 1.0})

    m = sg.Model("parting_rates")
    x, y = m.coordinates("x y")
    vx, vy = m.velocities
    m.lagrangian = (vx**2 + vy**2) / 2
    m.velocity_constraint("slow", vx + vy - m.time)
    m.velocity_constraint("fast", 2 * vx + 2 * vy - 5 * m.time)
    m.initial_state(q=[0, 0])
    for form in ("paper", "full_order"):
        with pytest.raises(sg.StepError, match=r"'slow'.*contradict"):
            sg.build(m, stages=2, velocity_constraints=form).simulate(t_end=0.5, dt=0.05)
