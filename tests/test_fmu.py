"""Functional mock-up units: valid by the standard, the same as the stepper, safe in any order."""

import os
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import signorini as sg
from signorini.fmu import variables, write_fmu
from signorini.models import bouncing_ball, slider_crank
from signorini.runtime.compile import find_compiler
from signorini.runtime.errors import RunError

Build = Callable[..., sg.Stepper]
HERE = Path(__file__).parent


def driven() -> sg.Model:
    """A ball that an input lifts, with an output, two names of space and friction in two rows."""
    m = sg.Model("driven_ball")
    _, _, z = m.coordinates("x y z", units="m m m")
    vx, vy, vz = m.velocities
    (lift,) = m.inputs("lift")
    (mu,) = m.parameters(mu=sg.par(0.3, unit="", min=0))
    m.lagrangian = (vx**2 + vy**2 + vz**2) / 2 - 9.81 * z
    m.force([0, 0, lift])
    m.contact("floor", g_N=z, gamma_F=[vx, vy], mu=mu, e_N=0.4)
    m.output("height", 2 * z)
    m.initial_state(q=[0, 0, 0.1], v=[1, 0.5, 0])
    m.suggest(dt=5e-3, t_end=1.0)
    return m


@pytest.fixture(scope="module")
def ball(stepper: Build) -> sg.Stepper:
    return stepper(bouncing_ball.model, 3, events="located")


def test_equal_units_are_equal_bytes(ball: sg.Stepper, tmp_path: Path) -> None:
    """Nothing of the place or the time goes into a unit."""
    units = [
        write_fmu(ball, tmp_path / f"{k}.fmu", fmi=2, binary=False).read_bytes() for k in (1, 2)
    ]
    assert units[0] == units[1]
    names = zipfile.ZipFile(tmp_path / "1.fmu").namelist()
    assert {"modelDescription.xml", "sources/fmi2.c", "sources/bouncing_ball.c"} <= set(names)
    assert not any(name.startswith("binaries") for name in names)


def test_variables_are_the_columns_of_a_run(ball: sg.Stepper) -> None:
    found, places = variables(ball, 1e-2)
    names = [v.name for v in found]
    assert [v.number for v in found] == list(range(len(found)))
    for name in (
        "x",
        "phi_dot",
        "floor.g_N",
        "floor.force_N",
        "floor.force_F",
        "floor.state",
        "mu",
    ):
        assert name in names
    by_name = {v.name: v for v in found}
    assert by_name["y"].start == 1.0
    assert by_name["y"].unit == "m"
    assert by_name["mu"].causality == "parameter"
    assert dict(places)["Q"] == names.index("x")


def test_what_is_no_unit_is_refused(ball: sg.Stepper, tmp_path: Path) -> None:
    for arguments, words in (
        ({"fmi": 1}, "choose 2 or 3"),
        ({"dt": 0.0}, "step size > 0"),
        ({"dt": 1.0, "t_end": 0.5}, "later end"),
    ):
        with pytest.raises(RunError, match=words):
            write_fmu(ball, tmp_path / "x.fmu", **arguments)
    with pytest.raises(RunError, match=r"ends in \.fmu"):
        write_fmu(ball, tmp_path / "x.zip")
    assert list(tmp_path.iterdir()) == []


def _columns(result: Any, *names: str) -> np.ndarray:
    return np.column_stack([result[name] for name in names])


@pytest.mark.thorough
@pytest.mark.parametrize("fmi", [2, 3])
def test_units_are_valid_and_the_same_as_the_stepper(
    stepper: Build, tmp_path: Path, fmi: int
) -> None:
    """FMPy finds no problem, and its runs are ours: located impacts, inputs, parameters, starts."""
    fmpy = pytest.importorskip("fmpy", reason="pip install fmpy")
    from fmpy.validation import validate_fmu

    made = stepper(driven, 3, events="located")
    unit = write_fmu(made, tmp_path / "d.fmu", fmi=fmi, dt=5e-3, t_end=1.0)
    assert validate_fmu(str(unit)) == []
    columns = ("x", "y", "z", "x_dot", "height", "floor.g_N", "floor.force_N", "floor.state")
    lift = np.array(
        [(0.0, 0.0), (0.4, 0.0), (0.4, 12.0), (1.0, 12.0)], [("time", float), ("lift", float)]
    )
    result = fmpy.simulate_fmu(
        str(unit), stop_time=1.0, step_size=5e-3, output_interval=5e-3, output=columns,
        start_values={"mu": 0.1, "y": -0.5, "x_dot": 2.0}, input=lift,
    )  # fmt: skip
    u = np.where(np.arange(200) * 5e-3 + 1e-9 < 0.4, 0.0, 12.0)
    traj = made.simulate(
        t_end=1.0, dt=5e-3, events="located", q0={"y": -0.5}, v0={"x": 2.0},
        parameters={"mu": 0.1}, inputs=u,
    )  # fmt: skip
    # the client rounds its times, and its inputs may jump one step apart
    before = 80
    q = _columns(result, "x", "y", "z")
    assert np.abs(q - traj.q)[: before + 1].max() < 1e-14
    assert np.abs(q - traj.q).max() < 0.1
    for name, own in (("height", traj.outputs), ("floor.g_N", traj.g_N)):
        assert np.abs(result[name] - own[:, 0])[: before + 1].max() < 1e-14
    force = traj["floor.force_N"][1 : before + 1]
    assert np.allclose(result["floor.force_N"][1 : before + 1], force, rtol=1e-9, atol=1e-9)
    states = [s.lower() for s in made.manifest["contact_states"]]
    named = np.array(states)[result["floor.state"][1 : before + 1].astype(int)]
    assert [n.replace("slip_back", "slip") for n in named] == traj["floor.state"][
        1 : before + 1
    ].tolist()


@pytest.mark.thorough
def test_a_tolerance_in_a_unit(ball: sg.Stepper, tmp_path: Path) -> None:
    """With solver.error communication steps may be long, and ends are exact."""
    fmpy = pytest.importorskip("fmpy", reason="pip install fmpy")
    unit = write_fmu(ball, tmp_path / "b.fmu", fmi=3)
    result = fmpy.simulate_fmu(
        str(unit), stop_time=1.0, output_interval=0.25, step_size=0.25, output=("y", "x"),
        start_values={"solver.error": 1e-9, "e_N": 0.5, "phi_dot": 0.0},
    )  # fmt: skip
    traj = ball.simulate(t_end=1.0, error=1e-11, v0={"phi": 0.0}, parameters={"e_N": 0.5})
    assert abs(result["y"][-1] - traj.q[-1, 1]) < 1e-9


@pytest.mark.thorough
@pytest.mark.parametrize("fmi", [2, 3])
def test_units_compile_from_their_sources(ball: sg.Stepper, tmp_path: Path, fmi: int) -> None:
    pytest.importorskip("fmpy", reason="pip install fmpy")
    from fmpy import simulate_fmu
    from fmpy.build import build_platform_binary

    plain = write_fmu(ball, tmp_path / "s.fmu", fmi=fmi, binary=False)
    folder = tmp_path / "unzipped"
    with zipfile.ZipFile(plain) as archive:
        archive.extractall(folder)
    build_platform_binary(folder)
    whole = write_fmu(ball, tmp_path / "w.fmu", fmi=fmi)
    ends = [
        simulate_fmu(str(f), stop_time=1.0, step_size=1e-2, output_interval=1e-2, output=("x", "y"))
        for f in (folder, whole)
    ]
    assert np.abs(_columns(ends[0], "x", "y") - _columns(ends[1], "x", "y")).max() < 1e-12


@pytest.mark.parametrize(
    ("fmi", "model"),
    [
        (3, bouncing_ball.model),
        pytest.param(2, bouncing_ball.model, marks=pytest.mark.thorough),
        pytest.param(2, slider_crank.model, marks=pytest.mark.slow),
    ],
)
def test_calls_in_any_order_do_no_harm(
    stepper: Build, tmp_path: Path, fmi: int, model: Any
) -> None:
    """Under the sanitizers; afterwards a fresh instance takes the step that it always takes."""
    made = stepper(model, 3, events="located")
    with zipfile.ZipFile(write_fmu(made, tmp_path / "x.fmu", fmi=fmi, binary=False)) as archive:
        archive.extractall(tmp_path)
    folder, name = tmp_path / "sources", made.manifest["prefix"]
    all_in_one = f'#include "fmi{fmi}.c"\n#include "{HERE / "c" / "fuzz_fmu.c"}"\n'
    (folder / "all.c").write_text(all_in_one)
    command = [
        *find_compiler(), "-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-Werror", f"-DFMI={fmi}",
        "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-ffp-contract=off", "-o",
        "fuzz", "all.c", *(["fmi3_absent.c"] if fmi == 3 else []), "fmu.c", f"{name}.c",
        f"{name}_model.c", "-lm",
    ]  # fmt: skip
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:3000]
    ran = subprocess.run(
        ["./fuzz", "10000"], cwd=folder, capture_output=True, text=True, check=False, timeout=120,
        env=os.environ | {"ASAN_OPTIONS": "detect_leaks=1"},
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout + ran.stderr[:3000]
