"""Derivatives of located runs: closed forms, differences of runs with more digits, honesty."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.models import (
    bead_on_hoop,
    bouncing_ball,
    box_in_space,
    coin,
    conveyor_oscillator,
    hopper,
    slope,
    vibrating_table,
    woodpecker,
)
from signorini.stress.campaign import case_of
from signorini.stress.corpus import SCENES as SCENES_OF_CORPUS
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


DRAWN = (
    *("box_drop", "box_rests_elastic", "box_large_steps", "groove", "groove_triangle"),
    *("groove_shaken", "painleve", "rocking", "wheel", "pendulum", "woodpecker", "vibrating"),
    *("belt", "ties", "grazing", "chute"),
)


def judged(made: sg.Stepper, wide: sg.Stepper, scene: str, number: int) -> str:
    """A drawn run along a drawn direction: good, flagged, or what else there is to say."""
    case = case_of(scene, 1, number)
    q, v = made.project(case.q, case.v, case.t, case.parameters)
    start = made.initial_state(case.parameters)[0] if case.t is None else case.t
    steps = min(SCENES_OF_CORPUS[scene].steps, 60)
    about: dict[str, Any] = {
        "t0": start, "t_end": start + steps * case.dt, "dt": case.dt, "events": "located",
        "tol": 0.0, "parameters": case.parameters,
    }  # fmt: skip
    try:
        traj = made.simulate(**about, q0=q, v0=v, derivatives="forward", of=("q0", "v0"))
    except sg.StepError:
        return "unsolved"
    if traj.differentiable is not True:
        return "flagged"
    slopes = [np.hstack([change["q0"][-1], change["v0"][-1]]) for change in (traj.dq, traj.dv)]
    slope = np.vstack(slopes)
    free = ~np.isnan(slope).any(axis=0)
    direction = np.where(free, np.random.default_rng(number).normal(size=len(free)), 0)
    if not free.any():
        return "no free direction"
    mine = slope[:, free] @ direction[free]
    errors, alike = [], True
    for power in (20, 24, 28, 34):
        ends = []
        for factor in (1.0, -1.0, 0.5, -0.5):
            moved = np.longdouble(2.0) ** -power * factor * direction
            try:
                run = wide.simulate(**about, q0=q + moved[: len(q)], v0=v + moved[len(q) :])
            except (sg.InconsistentStartError, sg.StepError):
                return "no run beside"
            alike &= [e.kind for e in run.events] == [e.kind for e in traj.events]
            ends.append(np.concatenate([run.q[-1], run.v[-1]]) * np.longdouble(2.0) ** power)
        found = (4 * (ends[2] - ends[3]) - (ends[0] - ends[1]) / 2) / 3
        errors.append(float(np.max(np.abs(found - mine))) / max(1.0, float(np.max(np.abs(mine)))))
    # in chaos the smallest difference is too large
    return "good" if min(errors) < 1e-6 else "bad" if alike else "other events beside"


@WIDE
@pytest.mark.slow
@pytest.mark.parametrize("scene", DRAWN)
def test_no_wrong_number_goes_unflagged(stepper: Build, scene: str) -> None:
    """Sixty drawn starts of a scene of the corpus."""
    model = SCENES_OF_CORPUS[scene].model
    made = stepper(model, 2, derivatives=True)
    wide = stepper(model, 2, events="located", precision="extended")
    found = [judged(made, wide, scene, number) for number in range(60)]
    assert "bad" not in found, found.index("bad")
    assert found.count("other events beside") <= 4
    assert "good" in found


# --- adjoint --------------------------------------------------------------------------------------


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
        ("records every step", {"derivatives": "adjoint", "every": 2}),
        ("choose among q0, v0, parameters, inputs, t0, dt", {"of": "q"}),
        ("of is empty", {"of": ()}),
        ('need events="located"', {"events": "captured"}),
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


# --- in optimisers --------------------------------------------------------------------------------


def test_a_step_as_a_function_of_casadi(stepper: Build) -> None:
    """Its derivatives are those of a run, chained by CasADi over four calls of ten steps each."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    step = sg.casadi_step(made, 1e-2, steps=10)
    assert (step.name_in(1), step.name_out(0), step.size_in(3)) == ("v", "q_next", (5, 1))
    q, v, par = ca.MX.sym("q", 3), ca.MX.sym("v", 3), ca.MX.sym("par", 5)
    where, speed = q, v
    for _ in range(5):
        where, speed = step(where, speed, ca.MX(0, 1), par)
    end = ca.vertcat(where, speed)
    of = ca.vertcat(q, v, par)
    slopes = ca.Function("slopes", [q, v, par], [end, ca.jacobian(end, of)])
    start = made.initial_state()[1:]
    values = list(made.parameters.values())
    found, slope_of = (np.array(x) for x in slopes(*start, values))
    traj = made.simulate(
        t_end=0.5, dt=1e-2, events="located", derivatives="forward", of=("q0", "v0", "parameters")
    )
    np.testing.assert_allclose(found[:, 0], [*traj.q[-1], *traj.v[-1]], atol=1e-12)
    mine = np.vstack([np.hstack(list(x.values())) for x in (
        {k: c[-1] for k, c in traj.dq.items()}, {k: c[-1] for k, c in traj.dv.items()})
    ])  # fmt: skip
    np.testing.assert_allclose(slope_of, mine, atol=1e-10)


def test_a_bounce_shot(stepper: Build) -> None:
    """IPOPT finds the throw whose third bounce is in a cup; closed form: vertical speed e^3 v."""
    m = sg.Model("shot")
    (_, y), (v, w) = m.coordinates("x y", units="m m"), m.velocities
    m.lagrangian = (v**2 + w**2) / 2 - sp.Rational(981, 100) * y
    m.contact("floor", g_N=y, e_N=sp.Rational(4, 5))
    m.initial_state(q=[0, 1])
    fly = sg.casadi_step(sg.build(m, stages=2, derivatives=True), 1.7 / 40, steps=40)
    throw = ca.MX.sym("throw", 2)
    end, _ = fly(ca.DM([0, 1]), throw, ca.MX(0, 1), ca.MX(0, 1))
    away = end - ca.DM([3, 0.3])
    problem = {"x": throw, "f": ca.sumsqr(throw), "g": away}
    quiet = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-11,
             "hessian_approximation": "limited-memory"}}  # fmt: skip
    solver = ca.nlpsol("solver", "ipopt", problem, quiet)
    found = np.array(solver(x0=[1, 0.5], lbg=0, ubg=0)["x"]).ravel()
    assert solver.stats()["success"]
    assert found[0] == pytest.approx(3 / 1.7, rel=1e-9)
    # three flights by hand
    place, speed, t = 1.0, found[1], 0.0
    bounces = 0
    while True:
        fall = (speed + np.sqrt(speed**2 + 2 * 9.81 * place)) / 9.81
        if t + fall > 1.7:
            rest = 1.7 - t
            place += speed * rest - 9.81 * rest**2 / 2
            break
        t, bounces = t + fall, bounces + 1
        place, speed = 0.0, -0.8 * (speed - 9.81 * fall)
    assert bounces >= 2 and place == pytest.approx(0.3, abs=1e-9)
