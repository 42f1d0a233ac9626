"""Derivatives of located runs: closed forms, differences of runs with more digits, honesty."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.models import (
    andrews_squeezer,
    bead_on_hoop,
    bouncing_ball,
    box_in_space,
    chaplygin_sleigh,
    coin,
    conveyor_oscillator,
    hopper,
    slope,
    vibrating_table,
    woodpecker,
)
from test_located import sled

Build = Callable[..., sg.Stepper]
WIDE = pytest.mark.skipif(
    np.finfo(np.longdouble).eps >= np.finfo(float).eps, reason="long double is double here"
)


def two_balls() -> sg.Model:
    """Two equal elastic balls on a line."""
    m = sg.Model("two_balls")
    x, y = m.coordinates("x y", units="m m")
    v, w = m.velocities
    m.lagrangian = (v**2 + w**2) / 2
    m.contact("hit", g_N=y - x - sp.Rational(1, 5), e_N=1)
    m.initial_state(q=[0, 1], v=[1, 0])
    return m


def test_an_elastic_ball_comes_back_by_what_it_was_raised(stepper: Build) -> None:
    """Without gravity z(3) falls by what z(0) rises, and by three times what it flew up faster."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    for z in np.random.default_rng(7).uniform(0.6, 2.6, 100):
        traj = made.simulate(
            t_end=3, dt=1e-2, q0={"y": z}, v0={"y": -1.0, "phi": 0.0}, events="located",
            parameters={"e_N": 1.0, "grav": 0.0}, derivatives="forward", of=("q0", "v0"),
        )  # fmt: skip
        assert traj.differentiable is True
        assert traj.dq["q0"][-1, 1, 1] == pytest.approx(-1, abs=1e-12)
        assert traj.dq["v0"][-1, 1, 1] == pytest.approx(-3, abs=1e-12)


def test_a_struck_ball_takes_over_place_and_speed(stepper: Build) -> None:
    """(1, 0, 1, 0): the other ball's place and speed decide, its own do not."""
    made = stepper(two_balls, 2, derivatives=True)
    rng = np.random.default_rng(3)
    for _ in range(100):
        v = rng.uniform(0.8, 2.5), rng.uniform(-1.0, -0.3)
        x = rng.uniform(0, 0.2), rng.uniform(0.7, 1.0)
        traj = made.simulate(
            t_end=1, dt=1e-2, q0=x, v0=v, events="located", derivatives="forward", of=("q0", "v0")
        )
        assert traj.differentiable is True
        np.testing.assert_allclose(traj.dq["q0"][-1, 1], [1, 0], atol=1e-12)
        np.testing.assert_allclose(traj.dq["v0"][-1, 1], [1, 0], atol=1e-12)


def test_the_start_and_the_steps_of_a_fall(stepper: Build) -> None:
    """A mass that falls and bounces once: y = -e v_0^2 ... in closed form of all that moves it."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    of = ("q0", "parameters", "t0", "dt")
    traj = made.simulate(
        t_end=0.7, dt=0.07, v0={"phi": 0.0}, parameters={"e_N": 0.8}, events="located",
        derivatives="forward", of=of,
    )  # fmt: skip
    y0, R, g, e, T = sp.symbols("y0 R g e T")
    fall = sp.sqrt(2 * (y0 - R) / g)
    y = R + e * g * fall * (T - fall) - g * (T - fall) ** 2 / 2
    at = {y0: 1.0, R: 0.1, g: 9.81, e: 0.8, T: 0.7}
    slopes = {x: float(sp.diff(y, x).subs(at)) for x in (y0, R, g, e, T)}
    assert traj.q[-1, 1] == pytest.approx(float(y.subs(at)), abs=1e-13)
    assert traj.dq["q0"][-1, 1, 1] == pytest.approx(slopes[y0], rel=1e-11)
    names = list(made.parameters)
    for name, symbol in (("R", R), ("grav", g), ("e_N", e)):
        found = traj.dq["parameters"][-1, 1, names.index(name)]
        assert found == pytest.approx(slopes[symbol], rel=1e-11)
    # ten steps, each longer by that; nothing depends on the time itself
    assert traj.dq["dt"][-1, 1, 0] == pytest.approx(10 * slopes[T], rel=1e-11)
    assert traj.dq["t0"][-1, 1, 0] == pytest.approx(0, abs=1e-11)


def test_steps_are_those_of_a_run_without(stepper: Build) -> None:
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    plain = stepper(bouncing_ball.model, 3, events="located")
    about: dict[str, Any] = {"t_end": 1.0, "dt": 1e-2, "events": "located"}
    one, other = made.simulate(**about, derivatives="forward", every=3), plain.simulate(**about)
    np.testing.assert_array_equal(one.q[-1], other.q[-1])
    assert one.dq["q0"].shape == (35, 3, 3)
    np.testing.assert_array_equal(one.dq["q0"][0], np.eye(3))


# --- against differences of runs with more digits ------------------------------------------------

SCENES: dict[str, tuple[Callable[[], sg.Model], float, float, int]] = {
    "impacts": (bead_on_hoop.model, 0.8, 0.02, 3),
    "impact, slip, rolling": (bouncing_ball.model, 1.0, 0.02, 2),
    "knife edge against a wall": (sled, 1.0, 0.02, 3),
    "stick, slip, stick": (conveyor_oscillator.model, 11.0, 0.044, 3),
    "slides and lands": (slope.model, 1.2, 0.01, 2),
    "all kinds of events": (woodpecker.model, 0.3, 1e-3, 3),
    "tumbles in space": (box_in_space.model, 0.3, 2e-3, 2),
    "lands and takes off": (hopper.model, 0.5, 5e-3, 3),
    "falls and turns": (coin.model, 0.3, 1e-2, 3),
}


@WIDE
@pytest.mark.parametrize(
    "scene",
    [
        scene if scene == "impact, slip, rolling"
        else pytest.param(scene, marks=pytest.mark.thorough if k < 5 else pytest.mark.slow)
        for k, scene in enumerate(SCENES)
    ],
)  # fmt: skip
def test_differences(stepper: Build, scene: str) -> None:
    """To 1e-8 of the largest entry, along every direction that the start allows."""
    model, t_end, dt, s = SCENES[scene]
    made = stepper(model, s, derivatives=True)
    wide = stepper(model, s, events="located", precision="extended")
    about: dict[str, Any] = {"t_end": t_end, "dt": dt, "events": "located", "tol": 0.0}
    traj = made.simulate(**about, derivatives="forward", of=("q0", "v0", "parameters"))
    assert traj.differentiable is True
    _, q, v = wide.initial_state()
    compared = 0

    def end(q: np.ndarray, v: np.ndarray, **parameters: float) -> np.ndarray:
        run = wide.simulate(**about, q0=q, v0=v, parameters=parameters)
        return np.concatenate([run.q[-1], run.v[-1]])

    def difference(name: str, k: int, step: float) -> np.ndarray:
        if name == "parameters":
            own = list(made.parameters)[k]
            value = made.parameters[own]
            high, low = value + step * value, value - step * value
            ends = end(q, v, **{own: high}), end(q, v, **{own: low})
            return (ends[0] - ends[1]) / (np.longdouble(high) - np.longdouble(low))
        change = np.zeros(len(q), np.longdouble)
        change[k] = step
        where = (change, 0 * change) if name == "q0" else (0 * change, change)
        ends = end(q + where[0], v + where[1]), end(q - where[0], v - where[1])
        return (ends[0] - ends[1]) / (2 * np.longdouble(step))

    for name in ("q0", "v0", "parameters"):
        mine = np.concatenate([traj.dq[name][-1], traj.dv[name][-1]])
        for k in range(mine.shape[1]):
            fixed = name == "parameters" and list(made.parameters.values())[k] == 0
            if fixed or np.isnan(mine[:, k]).any():
                continue
            try:
                coarse, fine = (difference(name, k, 2.0**-e) for e in (20, 21))
            except sg.RunError:
                continue  # a change by so much is no start
            expected = (4 * fine - coarse) / 3
            size = max(1.0, float(np.max(np.abs(mine[:, k]))))
            error = float(np.max(np.abs(mine[:, k] - expected))) / size
            assert error < 1e-8, (name, k, error)
            compared += 1
    assert compared >= len(q)


# --- stability ------------------------------------------------------------------------------------


@pytest.mark.parametrize("e", [0.3, 0.5, 0.8])
def test_where_a_bounce_doubles_its_period(stepper: Build, e: float) -> None:
    """Ball on a shaken table (Luck, Mehta, 1993): multipliers -1 and -e^2 at the doubling."""
    made = stepper(vibrating_table.model, 3, derivatives=True)
    omega = 2 * np.pi * 20
    Gamma = np.hypot(np.pi * (1 - e) / (1 + e), 2 * (1 + e**2) / (1 + e) ** 2)
    phase = np.arccos(np.pi * (1 - e) / (1 + e) / Gamma)  # of the table at the impact
    size = Gamma * 9.81 / omega**2
    apex = size * np.sin(phase) + (np.pi * 9.81 / omega) ** 2 / (2 * 9.81)
    t0, period = (phase + np.pi) / omega, 2 * np.pi / omega
    traj = made.simulate(
        t0=t0, t_end=t0 + period, dt=period / 41, q0=[apex], v0=[0.0], events="located", tol=0.0,
        parameters={"Gamma": Gamma, "omega": omega, "e_N": e}, derivatives="forward",
        of=("q0", "v0"),
    )  # fmt: skip
    assert traj.differentiable is True
    assert traj.q[-1, 0] == pytest.approx(apex, rel=1e-8)  # the orbit closes
    monodromy = np.block(
        [[traj.dq["q0"][-1], traj.dq["v0"][-1]], [traj.dv["q0"][-1], traj.dv["v0"][-1]]]
    )
    assert np.linalg.det(monodromy) == pytest.approx(e**2, rel=1e-7)
    np.testing.assert_allclose(sorted(np.linalg.eigvals(monodromy).real), [-1, -(e**2)], rtol=1e-6)


# --- honesty --------------------------------------------------------------------------------------


def test_an_input_that_jumps_begins_a_slip(stepper: Build) -> None:
    """A block that is pulled harder at t = 0.2: x = (u - mu g) (T - 0.2)^2 / 2 from there on."""
    m = sg.Model("pulled")
    (_, y), (v, w) = m.coordinates("x y", units="m m"), m.velocities
    (mu,) = m.parameters(mu=0.5)
    (pull,) = m.inputs("pull")
    m.lagrangian = (v**2 + w**2) / 2 - 10 * y
    m.force([pull, 0])
    m.contact("floor", g_N=y, gamma_F=[v], mu=mu)
    m.initial_state(q=[0, 0])
    made = sg.build(m, stages=2, derivatives=True)
    u = np.where(np.arange(50) < 20, 3.0, 8.0)[:, None]
    about: dict[str, Any] = {"t_end": 0.5, "dt": 0.01, "events": "located", "inputs": u}
    traj = made.simulate(**about, derivatives="adjoint")
    assert [(e.kind, e.t) for e in traj.events] == [("slip", pytest.approx(0.2))]
    assert traj.differentiable is True
    found = traj.gradient([1.0, 0.0])
    assert traj.q[-1, 0] == pytest.approx((8 - 5) * 0.3**2 / 2, rel=1e-10)
    assert found["parameters"][0] == pytest.approx(-10 * 0.3**2 / 2, rel=1e-9)
    # a push in step k moves it by dt v at its end, as long as is left
    later = 0.01 * (0.5 - (np.arange(50) + 0.5) * 0.01) * (np.arange(50) >= 20)
    np.testing.assert_allclose(found["inputs"][:, 0], later, atol=1e-12)
    # at its limit a block may go or stay
    u[20:] = 5.0 + 1e-7
    traj = made.simulate(**about, derivatives="adjoint")
    assert traj.differentiable is not True


def test_directions_that_leave_the_start_have_none(stepper: Build) -> None:
    """A ball that lies on the floor may lie elsewhere and turned, but not higher, nor move."""
    traj = stepper(bouncing_ball.model, 3, derivatives=True).simulate(
        t_end=0.1, dt=1e-2, q0={"y": 0.1}, v0=[0, 0, 0], parameters={"e_N": 0.0},
        events="located", derivatives="forward", of=("q0", "v0"),
    )  # fmt: skip
    assert traj.differentiable is True
    for name, known in (("q0", [True, False, True]), ("v0", [False] * 3)):
        for change in (traj.dq[name], traj.dv[name]):
            assert (~np.isnan(change[-1]).any(axis=0)).tolist() == known
    np.testing.assert_allclose(traj.dq["q0"][-1][:, [0, 2]], np.eye(3)[:, [0, 2]], atol=1e-14)


def lost(made: sg.Stepper, **about: Any) -> list[Any]:
    traj = made.simulate(events="located", derivatives="forward", of="v0", **about)
    assert traj.differentiable is not True
    first = traj.differentiable[0]
    before, behind = traj.t < first.t - 1e-9, traj.t > first.t + about["dt"]
    assert np.isnan(traj.dq["v0"][behind]).all()
    assert np.isfinite(traj.dq["v0"][before]).any()
    return list(traj.differentiable)


def test_a_grazing_contact_has_none() -> None:
    """A ceiling a hair below the apex of a throw."""
    m = sg.Model("ceiling")
    (y,), (v,) = m.coordinates("y", units="m"), m.velocities
    m.lagrangian = v**2 / 2 - 10 * y
    m.contact("ceiling", g_N=sp.Rational(1, 5) - sp.Float(1e-12) - y, e_N=1)
    m.initial_state(q=[0], v=[2])
    found = lost(sg.build(m, stages=3, derivatives=True), t_end=0.4, dt=1e-2)
    assert found[0].contact == "ceiling" and found[0].t == pytest.approx(0.2, abs=1e-6)
    assert "slowly" in found[0].why


def test_two_contacts_at_once_have_none() -> None:
    """A bar that falls flat on both of its ends: which of them is first decides."""
    m = sg.Model("bar")
    (y, phi), (v, omega) = m.coordinates("y phi", units="m rad"), m.velocities
    m.lagrangian = (v**2 + omega**2 / 3) / 2 - 10 * y
    for name, side in (("left", -1), ("right", 1)):
        m.contact(name, g_N=y + side * sp.sin(phi), e_N=sp.Rational(1, 2))
    m.initial_state(q=[0.2, 0])
    found = lost(sg.build(m, stages=2, derivatives=True), t_end=0.3, dt=1e-2)
    assert found[0].t == pytest.approx(0.2, abs=1e-12)
    assert "at one time" in found[0].why


def test_an_impact_that_slides_on_an_ellipse_has_none() -> None:
    """Its axes are not differentiated; nothing but the impact happens."""
    m = sg.Model("skate")
    (_, _, z), (v_x, v_y, v_z) = m.coordinates("x y z", units="m m m"), m.velocities
    m.lagrangian = (v_x**2 + v_y**2 + v_z**2) / 2 - 10 * z
    mu = m.parameters(mu_1=0.1, mu_2=0.3)
    m.contact("ice", g_N=z, gamma_F=[v_x, v_y], mu=mu, e_N=sp.Rational(1, 2))
    m.initial_state(q=[0, 0, 0.2], v=[3, 2, 0])
    found = lost(sg.build(m, stages=2, derivatives=True), t_end=0.3, dt=1e-2)
    assert [(f.contact, f.why.split(" is ")[-1]) for f in found] == [
        ("ice", "where its law has a corner")
    ]


def test_a_contact_brought_to_rest_has_none(stepper: Build) -> None:
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    found = lost(made, t_end=2.0, dt=1e-2, v0={"phi": 0.0}, parameters={"e_N": 0.5})
    assert [f.why.split(" after")[0] for f in found] == ["the contact was brought to rest"]


def test_a_captured_step_has_none(stepper: Build) -> None:
    """Room for one event, where a bar has two."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    found = lost(made, t_end=1.0, dt=0.5, v0={"phi": 0.0}, parameters={"e_N": 0.1}, max_events=1)
    assert found[0].why == "the step, or its rest, was captured"


@pytest.mark.parametrize(
    ("words", "about"),
    [
        ('choose "forward" or "adjoint"', {"derivatives": "backward"}),
        ("choose among q0, v0, parameters, inputs, t0, dt", {"of": "q"}),
        ("of is empty", {"of": ()}),
        ("inputs that are given as an array", {"inputs": lambda t, q, v: []}),
    ],
)
def test_refusals(stepper: Build, words: str, about: dict[str, Any]) -> None:
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    wanted = {"derivatives": "forward", "events": "located", **about}
    with pytest.raises(sg.RunError, match=words):
        made.simulate(t_end=0.1, dt=1e-2, **wanted)


def test_a_folder_without_derivatives_says_so(stepper: Build) -> None:
    loaded = sg.load(stepper(bouncing_ball.model, 3).folder)
    with pytest.raises(sg.RunError, match="generated without derivatives: generate it again"):
        loaded.simulate(t_end=0.1, dt=1e-2, events="located", derivatives="forward")


# --- without events, and captured -----------------------------------------------------------------


def wide_slope(
    wide: sg.Stepper, about: dict[str, Any], q: np.ndarray, v: np.ndarray, way: np.ndarray
) -> np.ndarray:
    """How the end changes along a direction, by Richardson differences in extended precision."""

    def end(step: float) -> np.ndarray:
        moved = np.longdouble(step) * way
        run = wide.simulate(**about, q0=q + moved[: len(q)], v0=v + moved[len(q) :])
        return np.concatenate([run.q[-1], run.v[-1]])

    coarse, fine = ((end(h) - end(-h)) / (2 * np.longdouble(h)) for h in (2.0**-20, 2.0**-21))
    return (4 * fine - coarse) / 3


@WIDE
@pytest.mark.parametrize("model", [chaplygin_sleigh.model, andrews_squeezer.model])
def test_models_without_contacts(stepper: Build, model: Callable[[], sg.Model]) -> None:
    """Velocity and position constraints: along projected directions, by all that a start has."""
    made, wide = stepper(model, 2, derivatives=True), stepper(model, 2, precision="extended")
    dt = 1e-2 if made.name == "chaplygin_sleigh" else 1e-4
    about: dict[str, Any] = {"t_end": 20 * dt, "dt": dt, "tol": 0.0}
    _, q, v = made.initial_state()
    q, v = made.project(q, v)
    traj = made.simulate(**about, q0=q, v0=v, derivatives="forward", of=("q0", "v0"), project=True)
    assert traj.differentiable is True
    raw = made.simulate(**about, q0=q, v0=v, derivatives="forward", of="v0")
    assert np.isnan(raw.dq["v0"][-1]).any()
    mine = np.vstack([np.hstack([c["q0"][-1], c["v0"][-1]]) for c in (traj.dq, traj.dv)])
    start = np.vstack([np.hstack([c["q0"][0], c["v0"][0]]) for c in (traj.dq, traj.dv)])
    # the nearest in the mass matrix: symmetric in it, and projected twice is projected once
    M = np.kron(np.eye(2), made.evaluate("p_v", 0.0, q, v))
    np.testing.assert_allclose(M @ start, start.T @ M, atol=1e-12)
    np.testing.assert_allclose(start @ start, start, atol=1e-12)
    for k in range(0, mine.shape[1], 3):
        size = max(1.0, float(np.max(np.abs(mine[:, k]))))
        expected = wide_slope(wide, about, q, v, start[:, k])
        np.testing.assert_allclose(mine[:, k], expected.astype(float), atol=1e-8 * size)


@WIDE
def test_captured_steps_have_that_of_their_map(stepper: Build) -> None:
    """Through an impact, slip and rest; a flight that comes back by where it began: 0, not -1."""
    made = stepper(bouncing_ball.model, 2, derivatives=True)
    wide = stepper(bouncing_ball.model, 2, events="located", precision="extended")
    about: dict[str, Any] = {"t_end": 0.6, "dt": 0.03, "tol": 0.0}
    _, q, v = made.initial_state()
    with pytest.warns(UserWarning, match="captured steps are those of their map") as told:
        traj = made.simulate(**about, derivatives="forward", of=("q0", "v0"))
    assert told[0].filename == __file__
    assert [e.kind for e in traj.events] == ["impact"]
    assert [x.why for x in traj.differentiable] == [
        "steps are captured: derivatives are those of their map, not of the motion"
    ]
    mine = np.vstack([np.hstack([c["q0"][-1], c["v0"][-1]]) for c in (traj.dq, traj.dv)])
    for k in range(6):
        expected = wide_slope(wide, about, q, v, np.eye(6)[k])
        np.testing.assert_allclose(mine[:, k], expected.astype(float), atol=1e-9)
    flight: dict[str, Any] = {
        "t_end": 3, "dt": 1e-2, "q0": {"y": 1.0}, "v0": {"y": -1.0, "phi": 0.0}, "of": "q0",
        "parameters": {"e_N": 1.0, "grav": 0.0}, "derivatives": "forward",
    }  # fmt: skip
    with pytest.warns(UserWarning):
        steps = made.simulate(**flight)
    motion = made.simulate(**flight, events="located")
    # the step of the impact ends on the floor, wherever the ball comes from
    assert steps.dq["q0"][-1, 1, 1] == 0
    assert motion.dq["q0"][-1, 1, 1] == pytest.approx(-1, abs=1e-12)


def test_the_start_follows_when_it_is_projected(stepper: Build) -> None:
    """A ball that lies on the floor: it lies higher on a larger radius, whatever was asked."""
    traj = stepper(bouncing_ball.model, 3, derivatives=True).simulate(
        t_end=0.1, dt=1e-2, q0={"y": 0.1}, v0=[0, 0, 0], parameters={"e_N": 0.0},
        events="located", derivatives="forward", of=("q0", "v0", "parameters"), project=True,
    )  # fmt: skip
    names = list(traj.parameters)
    assert traj.differentiable is True
    for row in (0, -1):
        np.testing.assert_allclose(traj.dq["q0"][row], np.diag([1, 0, 1]), atol=1e-12)
        np.testing.assert_allclose(traj.dq["parameters"][row][:, names.index("R")], [0, 1, 0],
                                   atol=1e-12)  # fmt: skip
        assert np.all(np.abs(traj.dv["v0"][row][1]) < 1e-12)


def test_outputs_change_with_what_they_are_of(stepper: Build) -> None:
    """y = a x^2 + t u + v by a, x_0, v_0, u, t_0 and dt, of a mass that nothing moves."""
    m = sg.Model("watched")
    (x,), (v,) = m.coordinates("x", units="m"), m.velocities
    (a,) = m.parameters(a=2.0)
    (u,) = m.inputs("u")
    m.lagrangian = v**2 / 2
    m.output("y", a * x**2 + m.time * u + v)
    m.initial_state(q=[1.5], v=[0.5])
    made = sg.build(m, stages=2, derivatives=True)
    about: dict[str, Any] = {
        "t0": 1.0, "t_end": 2.0, "dt": 0.1, "inputs": np.full((10, 1), 0.3), "every": 3,
        "derivatives": "forward", "of": ("q0", "v0", "parameters", "inputs", "t0", "dt"),
    }  # fmt: skip
    traj = made.simulate(**about)
    y = {name: change[-1, 0, 0] for name, change in traj.doutputs.items()}
    expected = {
        "q0": 2 * 2 * 2.0, "v0": 2 * 2 * 2.0 + 1, "parameters": 4.0, "inputs": 2.0, "t0": 0.3,
        "dt": 10 * (2 * 2 * 2.0 * 0.5 + 0.3),
    }  # fmt: skip
    assert y == pytest.approx(expected, rel=1e-12)
    batch = made.simulate_batch(**about, q0={"x": [1.5, 2.5]})
    for name, change in traj.doutputs.items():
        np.testing.assert_array_equal(batch.doutputs[name][0], change)
    assert batch.doutputs["q0"][1, -1, 0, 0] == pytest.approx(2 * 2 * 3.0)


def test_a_motion_that_spreads_has_none(stepper: Build) -> None:
    """Two balls that bounce on each other and the floor: rounding decides, and that is said."""
    made = stepper(two_masses_that_meet, 2, derivatives=True)
    about: dict[str, Any] = {"t_end": 60.0, "dt": 0.05, "events": "located"}
    traj = made.simulate(**about, derivatives="forward", of="v0")
    assert traj.differentiable is not True
    found = traj.differentiable[0]
    assert found.why.startswith("the motion spreads")
    before = np.flatnonzero(traj.t < found.t - 0.1)[-1]
    assert 1e6 < np.nanmax(np.abs(traj.dq["v0"][before])) < 1e9
    assert np.isnan(traj.dq["v0"][-1]).all()
    back = made.simulate(**about, derivatives="adjoint")
    assert back.differentiable[0].why == found.why
    assert np.isnan(back.gradient([1.0, 0.0])["q0"]).all()


def two_masses_that_meet() -> sg.Model:
    """Two balls over each other in gravity, the upper one lighter: chaotic."""
    m = sg.Model("two_masses_that_meet")
    (x, y), (v, w) = m.coordinates("x y", units="m m"), m.velocities
    m.lagrangian = v**2 / 2 + 3 * w**2 / 2 - 10 * x - 30 * y
    m.contact("floor", g_N=y, e_N=1)
    m.contact("ball", g_N=x - y, e_N=1)
    m.initial_state(q=[1.7, 1.0])
    return m
