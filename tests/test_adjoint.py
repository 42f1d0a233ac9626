"""Gradients carried back over runs and batches: transposes, differences, states that are kept."""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.models import bead_on_hoop, bouncing_ball, chaplygin_sleigh
from signorini.runtime.options import RunOptions

Build = Callable[..., sg.Stepper]


def test_the_adjoint_is_the_transpose(stepper: Build) -> None:
    """Of a run through an impact, slip and rolling, with cotangents of the end and of all rows."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    about: dict[str, Any] = {"t_end": 1.0, "dt": 1e-2, "events": "located"}
    one = made.simulate(**about, derivatives="forward", of=("q0", "v0", "parameters"))
    other = made.simulate(**about, derivatives="adjoint")
    assert other.differentiable is True
    rng = np.random.default_rng(2)
    for shape in ((3,), (101, 3)):
        q_bar, v_bar = rng.normal(size=shape), rng.normal(size=shape)
        found = other.gradient(q_bar, v_bar)
        for name in ("q0", "v0", "parameters"):
            dq, dv = one.dq[name], one.dv[name]
            if len(shape) == 1:
                expected = q_bar @ dq[-1] + v_bar @ dv[-1]
            else:
                expected = np.einsum("ki,kij->j", q_bar, dq) + np.einsum("ki,kij->j", v_bar, dv)
            np.testing.assert_allclose(found[name], expected, rtol=1e-11, atol=1e-10)


def test_gradients_of_inputs(stepper: Build) -> None:
    """A pushed mass that bounces off a wall: each step's push against differences."""
    m = sg.Model("pushed")
    (x,), (v,) = m.coordinates("x", units="m"), m.velocities
    m.lagrangian = v**2 / 2 - x**4 / 4
    (push,) = m.inputs("push")
    m.force([push])
    m.contact("wall", g_N=1 - x, e_N=sp.Rational(7, 10))
    m.initial_state(q=[0], v=[1.5])
    made = sg.build(m, stages=3, derivatives=True)
    rng = np.random.default_rng(4)
    u = rng.normal(size=(40, 1))
    about: dict[str, Any] = {"t_end": 2.0, "dt": 0.05, "events": "located", "tol": 0.0}
    traj = made.simulate(**about, inputs=u, derivatives="adjoint")
    assert [e.kind for e in traj.events] == ["impact"]
    found = traj.gradient([1.0], [-0.5])["inputs"]
    assert found.shape == (40, 1)
    for k in (0, 11, 27, 39):
        ends = []
        for change in (1e-4, -1e-4, 5e-5, -5e-5):
            moved = u.copy()
            moved[k] += change
            run = made.simulate(**about, inputs=moved)
            ends.append(run.q[-1, 0] - 0.5 * run.v[-1, 0])
        wide, near = (ends[0] - ends[1]) / 2e-4, (ends[2] - ends[3]) / 1e-4
        assert found[k, 0] == pytest.approx((4 * near - wide) / 3, rel=1e-7, abs=1e-10)


@pytest.mark.thorough
def test_a_long_adjoint(stepper: Build) -> None:
    """Ten thousand steps, more than ten impacts: to 1e-7 of its norm against the forward run."""
    made = stepper(bead_on_hoop.model, 3, derivatives=True)
    about: dict[str, Any] = {
        "t_end": 10.0, "dt": 1e-3, "events": "located", "q0": [1.0],
        "parameters": {"Omega": 0.0, "e_N": 0.97, "c": 0.0},
    }  # fmt: skip
    one = made.simulate(**about, derivatives="forward", of=("q0", "v0", "parameters"))
    other = made.simulate(**about, derivatives="adjoint")
    assert sum(e.kind == "impact" for e in other.events) > 10
    found = other.gradient([1.0], [0.3])
    for name in ("q0", "v0", "parameters"):
        expected = one.dq[name][-1, 0] + 0.3 * one.dv[name][-1, 0]
        np.testing.assert_allclose(
            found[name], expected, atol=1e-7 * max(1, np.linalg.norm(expected))
        )


def test_rows_that_are_recorded_and_what_else_it_is_of(stepper: Build) -> None:
    """Cotangents of every seventh row, gradients by start time and step size."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    about: dict[str, Any] = {"t_end": 1.0, "dt": 1e-2, "events": "located", "every": 7}
    of = ("q0", "v0", "parameters", "t0", "dt")
    one = made.simulate(**about, derivatives="forward", of=of)
    found = made.simulate(**about, derivatives="adjoint")
    q_bar = np.random.default_rng(5).normal(size=one.q.shape)
    gradient = found.gradient(q_bar)
    for name in of:
        expected = np.einsum("ki,kij->j", q_bar, one.dq[name])
        np.testing.assert_allclose(gradient[name], np.squeeze(expected), rtol=1e-10, atol=1e-9)


def test_a_batch_has_those_of_its_runs(stepper: Build) -> None:
    """Forward and back, on threads, with starts, parameters and lengths of their own."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    about: dict[str, Any] = {"t_end": 1.0, "dt": 1e-2, "events": "located", "every": 10}
    y, e = np.array([0.8, 1.0, 1.3]), np.array([0.2, 0.6, 0.0])
    batch = made.simulate_batch(
        **about, q0={"y": y}, parameters={"e_N": e}, derivatives="forward", threads=2
    )
    back = made.simulate_batch(
        **about, q0={"y": y}, parameters={"e_N": e}, derivatives="adjoint", threads=2
    )
    q_bar = np.random.default_rng(6).normal(size=batch.q.shape)
    gradient = back.gradient(q_bar)
    assert batch.dq["v0"].shape == (3, 11, 3, 3)
    for k in range(3):
        one = made.simulate(
            **about, q0={"y": y[k]}, parameters={"e_N": e[k]}, derivatives="forward"
        )
        assert batch.differentiable[k] == one.differentiable
        assert back.differentiable[k] == one.differentiable
        for name in ("q0", "v0", "parameters"):
            np.testing.assert_array_equal(batch.dq[name][k], one.dq[name])
            np.testing.assert_array_equal(batch.dv[name][k], one.dv[name])
            expected = np.einsum("ki,kij->j", q_bar[k], one.dq[name])
            np.testing.assert_allclose(gradient[name][k], expected, rtol=1e-10, atol=1e-9)


def test_projected_gradients_are_those_of_projected_directions(stepper: Build) -> None:
    made = stepper(chaplygin_sleigh.model, 2, derivatives=True)
    about: dict[str, Any] = {"t_end": 0.5, "dt": 1e-2, "project": True}
    one = made.simulate(**about, derivatives="forward", of=("q0", "v0", "parameters"))
    bar = np.array([1.0, -2.0, 0.5])
    found = made.simulate(**about, derivatives="adjoint").gradient(bar, -bar)
    for name in ("q0", "v0", "parameters"):
        expected = bar @ one.dq[name][-1] - bar @ one.dv[name][-1]
        np.testing.assert_allclose(found[name], expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("kept", [2, 3, 7, 101])
def test_states_that_are_kept_change_nothing(stepper: Build, kept: int) -> None:
    """Whatever room there is for them, to the last bit; what is left of it stays as it was."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    lib = made.library
    gradients = []
    for room in (kept, 60):
        d, a = (lib.structs[x]() for x in ("directions", "adjoint"))
        work, info = (lib.structs[x]() for x in ("work", "info"))
        a.q[1], a.v[1] = 1.0, -0.5
        options = made.c_options(RunOptions(events="located"))
        places = (lib.structs["checkpoint"] * (room + 1))()
        places[room].step = 4711
        state = made.c_state(*made.initial_state())
        status = lib.dll[f"{lib.prefix}_run_adjoint"](
            ctypes.byref(state), places, room, *map(ctypes.byref, (work, info)),
            ctypes.byref(made.c_params(made.parameters)), ctypes.byref(options), None,
            ctypes.c_double(1e-2), 100, None, None, ctypes.byref(d), ctypes.byref(a), None,
        )  # fmt: skip
        assert (status, d.lost, places[room].step) == (0, 0, 4711)
        gradients.append([*a.q, *a.v, *a.par, a.t, a.h])
    assert gradients[0] == gradients[1]
    assert any(gradients[0])


def test_what_happens_before_an_event_without_derivative(stepper: Build) -> None:
    """A ball that comes to rest: cotangents up to there have gradients, later ones have none."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    traj = made.simulate(
        t_end=2.0, dt=1e-2, v0={"phi": 0.0}, parameters={"e_N": 0.5}, events="located",
        derivatives="adjoint",
    )  # fmt: skip
    assert [x.contact for x in traj.differentiable] == ["floor"]
    early, late = np.zeros_like(traj.q), np.zeros_like(traj.q)
    early[100, 1] = late[-1, 0] = 1
    assert traj.t[100] < traj.differentiable[0].t < traj.t[-1]
    assert np.isfinite(traj.gradient(early)["q0"]).all()
    assert traj.gradient(early)["q0"][1] != 0
    assert np.isnan(traj.gradient(late)["q0"]).all()


@pytest.mark.parametrize(
    ("words", "bar"), [(r"give \(3,\) for the end", np.zeros(2)), ("not finite", [np.nan, 0, 0])]
)
def test_cotangents_that_do_not_fit(stepper: Build, words: str, bar: Any) -> None:
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    traj = made.simulate(t_end=0.1, dt=1e-2, events="located", derivatives="adjoint")
    with pytest.raises(sg.RunError, match=words):
        traj.gradient(bar)


@pytest.mark.parametrize("events", ["captured", "located"])
def test_what_stood_in_the_scratch_does_not_matter(stepper: Build, events: str) -> None:
    """One step from a start with a contact that sticks, with scratch of zeros and of ones."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    lib, ends = made.library, []
    for byte in (0x00, 0x01, 0xFF):
        work, info = (lib.structs[x]() for x in ("work", "info"))
        ctypes.memset(ctypes.byref(work), byte, ctypes.sizeof(work))
        state = made.c_state(0.0, np.array([0.0, 0.1, 0.0]), np.array([1.0, -0.5, 0.3]))
        status = lib.call["step"](
            state, work, info, made.c_params(made.parameters),
            made.c_options(RunOptions(events=events)), None, 1e-2,
        )  # fmt: skip
        assert status == 0
        ends.append(bytes(state))
    assert ends[0] == ends[1] == ends[2]
