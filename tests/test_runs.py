"""The Python side: grids, inputs, records, files, bad arguments."""

import json
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.models import bead_on_hoop, bouncing_ball, slider_crank, slope
from trap_models import mixed_contacts, one_coordinate, only_constraints, rheonomic, unconstrained

Build = Callable[..., sg.Stepper]


def test_time_grid_has_no_running_sum(stepper: Build) -> None:
    traj = stepper(bouncing_ball.model, 3).simulate(t_end=3, dt=0.1, t0=1.0)
    assert np.array_equal(traj.t, 1.0 + np.arange(21) * 0.1)


def test_a_step_that_does_not_divide_the_time_is_noted(stepper: Build) -> None:
    with pytest.warns(UserWarning, match="does not divide"):
        traj = stepper(bouncing_ball.model, 3).simulate(t_end=1, dt=0.3)
    assert traj.t[-1] == pytest.approx(0.9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(stepper(bouncing_ball.model, 3).simulate(t_end=0.3, dt=0.1)) == 4


@pytest.mark.parametrize("stages", [2, 3])
def test_a_lift_carries_its_load(stages: int, stepper: Build) -> None:
    """A load on a floor that rises evenly: y = t at every stage, and P_N = m g h."""

    def lift() -> sg.Model:
        m = sg.Model("lift")
        (y,) = m.coordinates("y")
        (v,) = m.velocities
        m.lagrangian = v**2 / 2 - 10 * y
        m.contact("floor", g_N=y - m.time)
        m.initial_state(q=[0.0], v=[1.0])
        return m

    traj = stepper(lift, stages).simulate(t_end=1, dt=0.1, record="stages")
    np.testing.assert_allclose(traj.q[:, 0], traj.t, rtol=0, atol=1e-13)
    np.testing.assert_allclose(traj.Q[..., 0], traj.t_stage, rtol=0, atol=1e-13)
    np.testing.assert_allclose(traj.P_N[1:, 0], 1.0, rtol=0, atol=1e-12)


def test_trajectory_fields(stepper: Build) -> None:
    compiled = stepper(mixed_contacts, 3)
    traj = compiled.simulate(t_end=0.2, dt=1e-2, inputs=[0.5], record="stages")
    n = compiled.sizes
    rows = len(traj)
    assert rows == 21
    shapes = {
        "t": (rows,), "q": (rows, 4), "v": (rows, 4), "P_g": (rows, 0), "P_gamma": (rows, 0),
        "P_N": (rows, n["n_N"]), "P_F": (rows, n["n_F"]), "g": (rows, 0), "g_dot": (rows, 0),
        "gamma": (rows, 0), "g_N": (rows, 4), "g_N_dot": (rows, 4), "gamma_F": (rows, 11),
        "energy": (rows,), "outputs": (rows, 0), "iterations": (rows,), "residual": (rows,),
        "status": (rows,), "substeps": (rows,), "t_stage": (20, 3), "Q": (20, 3, 4),
        "V": (20, 3, 4), "R_N": (20, 3, 4), "R_F": (20, 3, 11),
    }  # fmt: skip
    for name, shape in shapes.items():
        assert getattr(traj, name).shape == shape, name
    assert np.all(traj.P_N[0] == 0)
    assert traj["x"].shape == (rows,)
    assert np.array_equal(traj["u"], traj.v[:, 0])
    assert traj["plate.P_F"].shape == (rows, 2)
    assert traj["brake.gamma_F"].shape == (rows,)
    assert traj.contacts["stop"] == {"P_N": 2, "P_F": []}
    with pytest.raises(KeyError, match="no column 'nothing'"):
        traj["nothing"]
    weights = [1 / 6, 2 / 3, 1 / 6]
    np.testing.assert_allclose(np.einsum("s,nsk->nk", weights, traj.R_F), traj.P_F[1:], atol=1e-13)


def test_outputs_and_inputs(stepper: Build) -> None:
    compiled = stepper(rheonomic, 2)
    u = np.column_stack([np.linspace(0, 1, 10), np.ones(10)])
    traj = compiled.simulate(t_end=0.1, dt=0.01, inputs=u)
    assert np.array_equal(traj.u[:10], u)
    expected = traj["y"] + traj["u1"] * np.abs(traj["x"])
    np.testing.assert_allclose(traj["height"], expected, rtol=1e-15)

    asked = []

    def feedback(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        asked.append((t, q, v))
        return u[len(asked) - 1]

    again = compiled.simulate(t_end=0.1, dt=0.01, inputs=feedback)
    assert np.array_equal(again.q, traj.q)
    assert np.array_equal([t for t, _, _ in asked], traj.t[:-1])
    assert np.array_equal([q for _, q, _ in asked], traj.q[:-1])


@pytest.mark.parametrize("record", ["steps", "stages"])
@pytest.mark.parametrize("every", [1, 3, 7, 100])
def test_every(every: int, record: str, stepper: Build) -> None:
    compiled = stepper(slope.model, 3)
    full = compiled.simulate(t_end=0.5, dt=1e-2, record=record)
    thin = compiled.simulate(t_end=0.5, dt=1e-2, every=every, record=record)
    asked = compiled.simulate(
        t_end=0.5, dt=1e-2, every=every, record=record, inputs=lambda t, q, v: []
    )
    ends = [*range(0, 50, every), 50]  # the last row holds what is left
    first = [k + 1 for k in ends[:-1]]
    for other in (thin, asked):
        assert np.array_equal(other.q, full.q[ends])
        assert np.array_equal(other.t, full.t[ends])
        sums = np.add.reduceat(full.P_N, first)
        assert other.P_N[1:] == pytest.approx(sums, rel=1e-14)
        assert np.array_equal(other.iterations[1:], np.add.reduceat(full.iterations, first))
        assert np.array_equal(other.energy_range[1:, 0], np.minimum.reduceat(full.energy, first))
        assert np.array_equal(other.energy_range[1:, 1], np.maximum.reduceat(full.energy, first))
        assert np.array_equal(other.smallest_gap[1:], np.minimum.reduceat(full.smallest_gap, first))
        assert other.events == full.events
        assert other.steps == full.steps == 50
        if record == "stages":
            assert np.array_equal(other.Q, full.Q[[k - 1 for k in ends[1:]]])


def test_long_runs_are_recorded_across_chunks(stepper: Build) -> None:
    compiled = stepper(one_coordinate, 2)
    full = compiled.simulate(t_end=9.5, dt=1e-3)
    thin = compiled.simulate(t_end=9.5, dt=1e-3, every=7)
    assert np.array_equal(thin.q, full.q[[*range(0, 9500, 7), 9500]])
    seen = []
    compiled.simulate(t_end=9.5, dt=1e-3, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (9500, 9500)
    assert len(seen) > 1


def test_step_is_one_step_of_a_run(stepper: Build) -> None:
    compiled = stepper(slope.model, 3)
    run = compiled.simulate(t_end=0.1, dt=1e-2, tol=0)
    one = compiled.step(run.t[5], run.q[5], run.v[5], 1e-2, tol=0)
    np.testing.assert_allclose(one.q[1], run.q[6], atol=1e-14)
    np.testing.assert_allclose(one.P_N[1], run.P_N[6], atol=1e-14)


def test_save_and_load(tmp_path: Path, stepper: Build) -> None:
    compiled = stepper(rheonomic, 3)
    traj = compiled.simulate(t_end=0.2, dt=1e-2, inputs=[0.1, 0.2], record="stages")
    path = traj.save(tmp_path / "run.npz")
    again = sg.Trajectory.load(path, compiled)
    for name in ("t", "q", "v", "P_g", "P_N", "P_F", "energy", "iterations", "Q", "outputs"):
        assert np.array_equal(getattr(again, name), getattr(traj, name)), name
    assert again.parameters == traj.parameters
    with pytest.raises(sg.RunError, match="another version"):
        sg.Trajectory.load(path, stepper(slope.model, 3))
    with pytest.raises(sg.RunError, match="no file"):
        sg.Trajectory.load(tmp_path / "none.npz", compiled)
    path.write_bytes(path.read_bytes()[:-400])
    with pytest.raises(sg.RunError):
        sg.Trajectory.load(path, compiled)
    path.write_bytes(b"nonsense")
    with pytest.raises(sg.RunError):
        sg.Trajectory.load(path, compiled)


def test_a_generated_folder_needs_neither_sympy_nor_casadi(tmp_path: Path, stepper: Build) -> None:
    folder = sg.generate(slope.model(), tmp_path / "slope_c", stages=3)
    code = (
        "import sys\n"
        "for name in ('sympy', 'casadi', 'jinja2', 'mpmath', 'matplotlib'):\n"
        "    sys.modules[name] = None\n"
        "import signorini as sg\n"
        f"traj = sg.load({str(folder)!r}).simulate(t_end=0.5, dt=1e-2)\n"
        "print(traj.q[-1, 0].hex())\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    expected = stepper(slope.model, 3).simulate(t_end=0.5, dt=1e-2).q[-1, 0].hex()
    assert result.stdout.strip() == expected


def test_files_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    folder = sg.generate(slope.model(), tmp_path / "a")
    manifest = json.loads((folder / "manifest.json").read_text())
    with pytest.raises(sg.RunError, match="no generated folder"):
        sg.load(tmp_path)
    for key, value, message in (
        ("stages", 4, "was changed"),
        ("coordinates", ["x", "z"], "was changed"),
        ("model_hash", "0" * 64, "do not belong together"),
        ("prefix", "../x", "prefix"),
    ):
        (folder / "manifest.json").write_text(json.dumps(manifest | {key: value}))
        with pytest.raises(sg.RunError, match=message):
            sg.load(folder)
    manifest["structs"]["state"].pop()
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(sg.RunError, match="was changed"):
        sg.load(folder)
    (folder / "manifest.json").write_text("{")
    with pytest.raises(sg.RunError, match="cannot be read"):
        sg.load(folder)


BAD: list[tuple[dict, str]] = [
    ({"dt": 0}, "dt = 0"),
    ({"dt": -1}, "step size > 0"),
    ({"dt": float("nan")}, "finite"),
    ({"t_end": -1}, "before the start"),
    ({"t_end": float("inf")}, "finite"),
    ({"dt": 1e-12}, "at most"),
    ({"q0": [1, 2]}, "shape"),
    ({"q0": [1, float("nan"), 2]}, r"q0\[1\]"),
    ({"v0": {"foo": 1}}, "'foo'"),
    ({"v0": "abc"}, "v0"),
    ({"parameters": {"foo": 1}}, "no parameter 'foo'"),
    ({"parameters": {"mu": "x"}}, "give a number"),
    ({"parameters": {"mu": float("inf")}}, "finite"),
    ({"parameters": {"mu": -0.1}}, "outside its bounds"),
    ({"parameters": {"e_N": 1.5}}, "outside its bounds"),
    ({"inputs": [1.0]}, "no inputs"),
    ({"tol": -1}, "tol"),
    ({"tol": 0, "scaling": "none"}, "tol"),
    ({"r": 0}, "r = 0"),
    ({"active_set": "all"}, "active_set"),
    ({"record": "everything"}, "record"),
    ({"every": 0}, "every"),
    ({"max_halvings": 11}, "max_halvings"),
    ({"max_iterations": 0}, "max_iterations"),
    ({"scaling": "columns"}, "scaling"),
    ({"parameters": [1]}, "mapping"),
    ({"parameters": {"mu": True}}, "give a number"),
    ({"active_set": []}, "active_set"),
    ({"progress": 3}, "progress"),
    ({"q0": [1j, 0, 0]}, "real numbers"),
    ({"q0": {"y": 0.05}}, "gap g_N of 'floor' is -0.05"),
]


@pytest.mark.parametrize(("spoiled", "message"), BAD, ids=[m for _, m in BAD])
def test_bad_arguments_are_named(spoiled: dict, message: str, stepper: Build) -> None:
    with pytest.raises(sg.RunError, match=message):
        stepper(bouncing_ball.model, 3).simulate(**({"t_end": 1, "dt": 0.1} | spoiled))


def test_bad_arguments_of_other_calls_are_named(tmp_path: Path, stepper: Build) -> None:
    compiled = stepper(bouncing_ball.model, 3)
    q, v = np.array([0.0, 1.0, 0.0]), np.zeros(3)
    traj = compiled.simulate(t_end=0.1, dt=0.1, record="stages")
    for call in (
        lambda: compiled.evaluate("g_N", "a", q),
        lambda: compiled.evaluate("g_N", [0, 1], q),
        lambda: compiled.evaluate("g_N", [0, 1, 2], np.zeros((2, 3))),
        lambda: compiled.evaluate("g_N", 0, {"x": 1}),
        lambda: compiled.evaluate(["g_N"], 0, q),
        lambda: compiled.step(0, q, v, 0.1, foo=1),
        lambda: compiled.step(0, q, v, 0.1, u="a"),
        lambda: compiled.step(0, q, None, 0.1),
        lambda: compiled.problem("end", [0], [0], 0.1),
        lambda: compiled.problem("position", [0], [0], 0.1),
        lambda: traj.save(tmp_path),
        lambda: traj.save(""),
        lambda: traj.save(tmp_path / "no" / "run.npz"),
        lambda: sg.Trajectory.load(5, compiled),
        lambda: sg.load(None),
        lambda: sg.load("a\0b"),
    ):
        with pytest.raises(sg.RunError):
            call()
    for key in (5, None):
        with pytest.raises(KeyError):
            traj[key]
    with pytest.raises(sg.GenerationError):
        sg.generate(slope.model(), "a\0b")
    path = traj.save(tmp_path / "run.npz")
    with np.load(path) as data:
        arrays = dict(data)
    for name, value in (("Q", arrays["Q"][:0]), ("t", np.array(1.0)), ("about", np.array("{}"))):
        np.savez(path, **(arrays | {name: value}))
        with pytest.raises(sg.RunError):
            sg.Trajectory.load(path, compiled)
    np.save(tmp_path / "run.npy", q)
    with pytest.raises(sg.RunError):
        sg.Trajectory.load(tmp_path / "run.npy", compiled)


def test_a_force_with_a_half_integer_power_at_zero() -> None:
    """Hertz' law: its derivative at 0 is 0, not 0 * inf."""
    m = sg.Model("hertz")
    (y,) = m.coordinates("y")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2 - 9.81 * y
    m.force(
        [1e4 * sp.Max(0, -y) ** sp.Rational(3, 2) - sp.sign(v) * sp.Abs(v) ** sp.Rational(3, 2)]
    )
    m.initial_state(q=[0.1])
    traj = sg.build(m, stages=3).simulate(t_end=1, dt=1e-3)
    assert traj["y"].min() < 0
    assert np.all(np.isfinite(traj.q))


def test_a_jacobian_that_is_not_finite_is_called_so() -> None:
    m = sg.Model("root")
    (y,) = m.coordinates("y")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2
    m.force([1 - sp.sqrt(y)])
    m.initial_state(q=[0])
    with pytest.raises(sg.StepError) as caught:
        sg.build(m).simulate(t_end=1, dt=0.1)
    assert caught.value.status == "NONFINITE"


def test_bad_inputs_are_named(stepper: Build) -> None:
    compiled = stepper(rheonomic, 2)
    with pytest.raises(sg.RunError, match=r"give \(10, 2\)"):
        compiled.simulate(t_end=0.1, dt=0.01, inputs=np.zeros((3, 2)))
    with pytest.raises(sg.RunError, match="step 4"):
        u = np.zeros((10, 2))
        u[4, 1] = np.nan
        compiled.simulate(t_end=0.1, dt=0.01, inputs=u)
    with pytest.raises(sg.RunError, match="returned"):
        compiled.simulate(t_end=0.1, dt=0.01, inputs=lambda t, q, v: [1])
    with pytest.raises(sg.RunError, match="no function 'g_M'"):
        compiled.evaluate("g_M", 0, np.zeros(4))


def test_inconsistent_start_is_named_and_projected(stepper: Build) -> None:
    compiled = stepper(slider_crank.model, 3)
    _, q, v = compiled.initial_state()
    q[0] += 1e-3
    with pytest.raises(sg.InconsistentStartError, match="crank_pivot") as caught:
        compiled.simulate(t_end=0.01, dt=1e-4, q0=q, v0=v)
    assert "project" in str(caught.value)
    q1, v1 = compiled.project(q, v)
    assert np.max(np.abs(compiled.evaluate("g", 0, q1))) < 1e-14
    assert np.max(np.abs(compiled.evaluate("g_dot", 0, q1, v1))) < 1e-12
    # The projection moves along M^-1 W only: nearest in the norm of the mass matrix.
    M, W = compiled.evaluate("p_v", 0, q1), compiled.evaluate("W_g", 0, q1)
    left = M @ (v - v1)
    residual = left - W @ np.linalg.lstsq(W, left, rcond=None)[0]
    assert np.max(np.abs(residual)) < 1e-8 * np.max(np.abs(left))
    assert len(compiled.simulate(t_end=0.01, dt=1e-4, q0=q1, v0=v1)) == 101


def test_velocity_constraints_of_the_start(stepper: Build) -> None:
    compiled = stepper(only_constraints, 3)
    with pytest.raises(sg.InconsistentStartError, match="gamma of 'blade'"):
        compiled.simulate(t_end=0.1, dt=0.01, v0={"y": 3})
    q, v = compiled.project(None, {"y": 3})
    assert len(compiled.simulate(t_end=0.1, dt=0.01, q0=q, v0=v)) == 11


def test_a_failed_step_keeps_what_was_done(stepper: Build) -> None:
    m = sg.Model("blows_up", symbols="casadi")
    (_x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = 0.5 * v**2
    m.force([1 / (0.5 - m.time) ** 0.5])  # not a number after t = 0.5
    m.initial_state(q=[0])
    with pytest.raises(sg.StepError) as caught:
        sg.build(m, stages=2).simulate(t_end=1, dt=0.03)
    assert caught.value.status == "NONFINITE"
    assert len(caught.value.trajectory) == 17
    assert np.all(np.isfinite(caught.value.trajectory.q))


def test_energy_of_a_smooth_system_stays(stepper: Build) -> None:
    """Bounded oscillation without drift: s = 3 over 2000 steps."""
    traj = stepper(unconstrained, 3).simulate(t_end=40, dt=0.02)
    error = traj.energy - traj.energy[0]
    assert np.max(np.abs(error)) < 1e-5 * abs(traj.energy[0])
    assert abs(np.mean(error[1000:]) - np.mean(error[:1000])) < np.max(np.abs(error))


def test_initial_state_follows_the_parameters() -> None:
    m = sg.Model("standing")
    (y,) = m.coordinates("y")
    (v,) = m.velocities
    (height,) = m.parameters(height=0.5)
    m.lagrangian = v**2 / 2 - y
    m.contact("floor", g_N=y - height)
    m.initial_state(q=[height])
    compiled = sg.build(m)
    traj = compiled.simulate(t_end=0.1, dt=0.05, parameters={"height": 0.75})
    assert np.array_equal(traj["y"], [0.75, 0.75, 0.75])


def test_single_precision_runs() -> None:
    compiled = sg.build(bouncing_ball.model(), stages=3, precision="float")
    traj = compiled.simulate(t_end=2, dt=1e-2)
    np.testing.assert_allclose(traj.v[-1], [-10 / 7, 0, 100 / 7], atol=2e-4)
    assert traj.substeps.sum() == 0


@pytest.mark.skipif(
    np.finfo(np.longdouble).eps >= np.finfo(float).eps, reason="long double is double here"
)
def test_extended_precision_from_the_start_to_the_result() -> None:
    """A bead that strikes its peg twice: what double rounds away stays."""
    compiled = sg.build(bead_on_hoop.model(), stages=5, precision="extended", events="located")
    ends = {}
    for n in (10, 20, 40):
        traj = compiled.simulate(t_end=0.8, dt=0.8 / n, events="located", tol=0.0)
        ends[n] = traj.q[-1]
    assert traj.q.dtype == np.longdouble and len(traj.events) == 2
    errors = [float(np.max(np.abs(ends[n] - ends[40]))) for n in (10, 20)]
    assert errors[1] < 5e-13 and 7.7 < np.log2(errors[0] / errors[1]) < 8.5
    # a start that double does not hold
    t, q, v = compiled.initial_state()
    moved = q + np.longdouble(2.0) ** -60
    one, other = (compiled.simulate(q0=x, t_end=0.01, dt=0.01).q[-1] for x in (q, moved))
    assert np.all(np.abs((other - one) * 2.0**60 - 1) < 0.1)
    assert np.array_equal(compiled.step(t, moved, v, 0.01).q[-1], other)
    batch = compiled.simulate_batch(q0=np.array([q, moved]), t_end=0.01, dt=0.01)
    assert np.array_equal(batch.q[:, -1], [one, other])
    sim = compiled.start(q0=moved, dt=0.01)
    sim.step()
    assert np.array_equal(sim.q, other) and sim.q.dtype == np.longdouble


def test_explicit_prox_parameter_and_absolute_tolerance(stepper: Build) -> None:
    """The paper's settings: r = 0.5, tolerance 1e-8."""
    compiled = stepper(bouncing_ball.model, 3)
    paper = compiled.simulate(t_end=1.1, dt=1e-2, r=0.5, tol=1e-8, scaling="none", active_set="end")
    plain = compiled.simulate(t_end=1.1, dt=1e-2)
    np.testing.assert_allclose(paper.q, plain.q, atol=1e-7)


def falling() -> sg.Model:
    """A particle above a ledge of which only the part x >= 0 exists."""
    m = sg.Model("ledge")
    x, y = m.coordinates("x y")
    vx, vy = m.velocities
    m.lagrangian = (vx**2 + vy**2) / 2 - 10 * y
    m.contact("ledge", g_N=y, guard=x)
    m.initial_state(q=[1, 0.3], v=[0, 0])
    return m


def test_a_guard_decides_whether_a_contact_exists() -> None:
    compiled = sg.build(falling(), stages=3)
    lands = compiled.simulate(t_end=1, dt=1e-2)
    assert abs(lands["y"][-1]) < 1e-12
    falls = compiled.simulate(t_end=1, dt=1e-2, q0={"x": -1})
    assert falls["y"][-1] == pytest.approx(0.3 - 5, abs=1e-9)
    # Over the edge: at rest on the ledge until x < 0, then free.
    leaves = compiled.simulate(t_end=1, dt=1e-2, q0={"x": 0.505, "y": 0}, v0={"x": -1})
    assert leaves["y"][50] == pytest.approx(0, abs=1e-12)
    assert leaves["y"][-1] == pytest.approx(-5 * 0.49**2, abs=1e-9)


@pytest.mark.parametrize(("bound", "stop"), [(2.0, True), (-2.0, False), (0.0, False)])
def test_friction_with_a_bound(bound: float, stop: bool) -> None:
    """A brake of bound 2 stops unit mass from unit speed in 0.5; a negative bound counts as 0."""
    m = sg.Model("brake")
    m.coordinates("x")
    (v,) = m.velocities
    (limit,) = m.parameters(limit=bound)
    m.lagrangian = v**2 / 2
    m.friction("brake", gamma_F=v, bound=limit)
    m.initial_state(q=[0], v=[1])
    traj = sg.build(m, stages=3).simulate(t_end=1, dt=1e-2)
    assert traj.v[-1, 0] == pytest.approx(0.0 if stop else 1.0, abs=1e-12)
    assert traj["x"][-1] == pytest.approx(0.25 if stop else 1.0, abs=1e-9)
    if stop:
        np.testing.assert_allclose(traj["brake.P_F"][1:50], -2e-2, rtol=1e-9)


def test_a_guard_that_is_no_number_is_an_error() -> None:
    """At the start, and when the motion gets there: log(1 - x) is none from x = 1 on."""
    m = sg.Model("no_guard")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2
    m.contact("stop", g_N=10 - x, guard=sp.log(1 - x))
    m.initial_state(q=[0.5], v=[1])
    stepper = sg.build(m, stages=2)
    with pytest.raises(sg.StepError, match="guard") as caught:
        stepper.simulate(t_end=1, dt=1e-2)
    assert caught.value.status == "NONFINITE"
    assert caught.value.trajectory.q[-1, 0] == pytest.approx(1, abs=0.011)
    with pytest.raises((sg.StepError, sg.RunError), match="guard"):
        stepper.simulate(t_end=1, dt=1e-2, q0=[2.0])


def test_messages_of_runs_say_of_which_model_they_speak(stepper: Build) -> None:
    made = stepper(bouncing_ball.model, 2)
    about: dict[str, Any] = {"t_end": 1.0, "dt": 0.1}
    for wrong in ({"dt": -1}, {"q0": [1]}, {"parameters": {"x": 1}}, {"every": 0}, {"tol": -1}):
        for run in (made.simulate, made.simulate_batch):
            with pytest.raises(sg.RunError, match="model 'bouncing_ball'"):
                run(**(about | wrong))
