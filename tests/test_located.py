"""Steps that are cut at their events, against closed forms and motion by events."""

import ctypes
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.models import (
    bead_on_hoop,
    bouncing_ball,
    box,
    conveyor_oscillator,
    cradle,
    painleve_rod,
    rimless_wheel,
    rocking_block,
    slope,
    sphere_on_incline,
)
from signorini.verify.check import Checker
from signorini.verify.event_driven import EventDriven

Build = Callable[..., sg.Stepper]
G = 9.81
DROP = np.sqrt(2 * 0.9 / G)  # a ball of radius 0.1 falls from 1


@pytest.fixture
def ball(stepper: Build) -> sg.Stepper:
    return stepper(bouncing_ball.model, 3, events="located")


def bounce(ball: sg.Stepper, t_end: float, dt: float = 1e-2, **parameters: float) -> sg.Trajectory:
    return ball.simulate(t_end=t_end, dt=dt, v0={"phi": 0}, parameters=parameters, events="located")


# --- closed forms: the ball -----------------------------------------------------------------------


def test_impact_slip_and_rolling_of_the_ball(ball: sg.Stepper) -> None:
    """v after the impact, until friction has made it roll: all rational, steps of 1e-2."""
    traj = ball.simulate(t_end=1.0, dt=1e-2, events="located")
    impact, stick = traj.events
    v = np.sqrt(2 * G * 0.9)
    assert (impact.kind, stick.kind) == ("impact", "stick")
    assert impact.t == pytest.approx(DROP, abs=1e-15)
    assert pytest.approx(v, rel=1e-14) == impact.P_N
    assert impact.P_F[0] == pytest.approx(-0.2 * v, rel=1e-14)
    # slips at 5 m/s less 7/2 times what the impact took, and loses 7/2 mu g a second
    rolls = DROP + (5 - 3.5 * 0.2 * v) / (3.5 * 0.2 * G)
    assert stick.t == pytest.approx(rolls, abs=1e-13)
    np.testing.assert_allclose(traj.v[-1], [-10 / 7, 0, 100 / 7], atol=1e-13)
    slips = rolls - DROP
    x = -0.2 * v * slips - 0.2 * G * slips**2 / 2 - 10 / 7 * (1 - rolls)
    phi = 50 * DROP + (50 - 2.5 * 0.2 * v / 0.1) * slips - 2.5 * 0.2 * G / 0.1 * slips**2 / 2
    np.testing.assert_allclose(traj.q[-1], [x, 0.1, phi + 100 / 7 * (1 - rolls)], atol=2e-13)
    assert not traj.captured.any()
    assert traj.P_N.sum() == pytest.approx(v + G * (1 - DROP), rel=1e-12)


def test_an_accumulation_of_impacts_ends_and_rests(ball: sg.Stepper) -> None:
    """e_N = 1/2: flights halve, and end at three times the first half."""
    traj = bounce(ball, 2.0, e_N=0.5)
    times = [e.t for e in traj.events if e.kind == "impact"]
    flights = 2 * DROP * 0.5 ** np.arange(1, len(times))
    np.testing.assert_allclose(np.diff(times), flights, rtol=1e-9)
    assert 3 * DROP - 1.5e-4 < times[-1] < 3 * DROP
    np.testing.assert_array_equal(traj.v[-1], np.zeros(3))
    assert traj.q[-1, 1] == pytest.approx(0.1, abs=1e-15)
    assert not traj.captured.any()


def test_ninety_per_cent_accumulate_too(ball: sg.Stepper) -> None:
    traj = bounce(ball, 9.0, e_N=0.9)
    last = [e.t for e in traj.events if e.kind == "impact"][-1]
    assert last == pytest.approx(DROP * (1 + 2 * 0.9 / 0.1), abs=2e-3)
    assert np.all(traj.v[-1] == 0)
    assert not traj.captured.any()


@pytest.mark.parametrize("bounces", [1_000, pytest.param(100_000, marks=pytest.mark.thorough)])
def test_an_elastic_ball_keeps_energy_and_time(ball: sg.Stepper, bounces: int) -> None:
    period = 2 * DROP
    t_end = period * (bounces - 0.25)
    traj = ball.simulate(
        t_end=np.ceil(t_end * 100) / 100, dt=1e-2, v0={"phi": 0}, parameters={"e_N": 1.0},
        events="located", every=1000,
    )  # fmt: skip
    impacts = [e.t for e in traj.events]
    assert len(impacts) == bounces
    energy = traj.energy - G * 0.1
    assert np.ptp(energy) <= 1e-9 * energy[0]
    expected = DROP + period * np.arange(bounces)
    np.testing.assert_allclose(impacts, expected, rtol=1e-8)
    assert impacts[-1] == pytest.approx(expected[-1], rel=1e-8)


def test_the_map_of_an_elastic_ball_is_smooth(ball: sg.Stepper) -> None:
    """Without gravity z(3) falls by what z(0) rises; the captured map is a staircase there."""

    def end(z: float) -> float:
        return ball.simulate(
            t_end=3.0, dt=1e-2, q0={"y": z}, v0={"y": -1.0, "phi": 0},
            parameters={"e_N": 1.0, "grav": 0.0}, events="located",
        ).q[-1, 1]  # fmt: skip

    for z in np.random.default_rng(3).uniform(0.9, 2.0, 5):
        assert (end(z + 1e-3) - end(z - 1e-3)) / 2e-3 == pytest.approx(-1.0, abs=1e-10)


def test_between_the_rows_the_ball_flies_on_a_parabola(ball: sg.Stepper) -> None:
    traj = bounce(ball, 1.1, dt=0.1, e_N=1.0)
    t = np.linspace(0, 1.1, 331)
    q, v = traj(t)
    phase = np.abs((t + DROP) % (2 * DROP) - DROP)  # since the last apex
    np.testing.assert_allclose(q[:, 1], 1 - G / 2 * phase**2, atol=1e-13)
    assert np.min(q[:, 1]) >= 0.1 - 1e-15
    np.testing.assert_allclose(np.abs(v[:, 1]), G * phase, atol=1e-12)
    np.testing.assert_array_equal(traj(traj.t[3])[0], traj.q[3])
    with pytest.raises(sg.RunError, match=r"t = 1.2 is outside the run, which goes from 0 to 1.1"):
        traj(1.2)


def test_rows_that_stand_for_many_steps_are_walked_through(ball: sg.Stepper) -> None:
    about: dict[str, Any] = {"t_end": 1.0, "dt": 1e-2, "events": "located"}
    one, many = ball.simulate(**about), ball.simulate(**about, every=7)
    t = np.linspace(0, 1, 57)
    np.testing.assert_allclose(many(t)[0], one(t)[0], atol=1e-12)


def test_all_ways_of_running_take_the_same_steps(ball: sg.Stepper) -> None:
    about: dict[str, Any] = {"dt": 1e-2, "parameters": {"e_N": 0.4}, "events": "located"}
    traj = ball.simulate(t_end=1.5, **about)
    sim = ball.start(**about, record=True)
    sim.step(n=150)
    np.testing.assert_array_equal(sim.trajectory().q, traj.q)
    assert sim.trajectory().events == traj.events
    batch = ball.simulate_batch(t_end=1.5, q0={"y": [1.0, 1.2]}, **about)
    np.testing.assert_array_equal(batch.q[0], traj.q)
    assert batch.trajectory(1).events != traj.events
    assert batch.trajectory(0).events == traj.events


def test_captured_steps_are_what_they_were(ball: sg.Stepper, stepper: Build) -> None:
    """With the code of located steps beside them, to the last bit."""
    about: dict[str, Any] = {"t_end": 1.5, "dt": 1e-2, "parameters": {"e_N": 0.4}}
    one, other = ball.simulate(**about), stepper(bouncing_ball.model, 3).simulate(**about)
    np.testing.assert_array_equal(one.q, other.q)
    np.testing.assert_array_equal(one.P_F, other.P_F)
    assert one.events == other.events


@pytest.mark.parametrize("fill", [0xFF, 0x3C])
def test_nothing_survives_in_the_scratch(ball: sg.Stepper, fill: int) -> None:
    """Whatever the work struct holds before a step, the step is the same: no number, or 1e-17."""
    about: dict[str, Any] = {"dt": 1e-2, "parameters": {"e_N": 0.4}, "events": "located"}
    sim = ball.start(**about)
    for _ in range(120):
        ctypes.memset(ctypes.byref(sim._work), fill, ctypes.sizeof(sim._work))
        sim.step()
    traj = ball.simulate(t_end=1.2, **about)
    np.testing.assert_array_equal(sim.q, traj.q[-1])
    np.testing.assert_array_equal(sim.v, traj.v[-1])


def test_a_file_keeps_what_was_captured(ball: sg.Stepper, stepper: Build, tmp_path: Path) -> None:
    traj = bounce(ball, 0.5, e_N=0.5)
    path = traj.save(tmp_path / "run.npz")
    again = sg.Trajectory.load(path, ball)
    np.testing.assert_array_equal(again.captured, traj.captured)
    assert again.events == traj.events
    np.testing.assert_array_equal(again(0.47)[0], traj(0.47)[0])
    plain = sg.Trajectory.load(path, stepper(bouncing_ball.model, 3))
    np.testing.assert_array_equal(plain(0.47)[0], traj(0.47)[0])


# --- against motion by events ---------------------------------------------------------------------


def error(
    made: sg.Stepper, motion: np.ndarray, t_end: float, n: int, **more: Any
) -> tuple[float, sg.Trajectory]:
    traj = made.simulate(t_end=t_end, dt=t_end / n, events="located", tol=0.0, **more)
    assert not traj.captured.any()
    return float(np.max(np.abs(np.concatenate([traj.q[-1], traj.v[-1]]) - motion))), traj


def motion_of(
    made: sg.Stepper, model: sg.Model, t_end: float, rest: float, **start: Any
) -> tuple[np.ndarray, EventDriven]:
    par = made.check_parameters(start.get("parameters"))
    t, q, v = made.start_of(start.get("q0"), start.get("v0"), None, par)
    motion = EventDriven(model, rest)
    at = (t, q, v, np.zeros(made.sizes["n_u"]), list(par.values()))
    return np.concatenate(motion.run(at, t + t_end, t_end / 20)), motion


def sled() -> sg.Model:
    """A knife edge with its mass in front of it runs into a rough wall."""
    m = sg.Model("sled")
    x, y, phi = m.coordinates("x y phi", units="m m rad")
    v_x, v_y, omega = m.velocities
    ahead = sp.Rational(1, 5)
    aside = -sp.sin(phi) * v_x + sp.cos(phi) * v_y
    m.lagrangian = (v_x**2 + v_y**2 + (sp.Rational(1, 10) + ahead**2) * omega**2) / 2
    m.lagrangian += ahead * omega * aside - 2 * y
    m.velocity_constraint("edge", [aside])
    m.contact("wall", g_N=1 - x, gamma_F=v_y, mu=sp.Rational(1, 5), e_N=sp.Rational(1, 2))
    m.initial_state(q=[0, 0, 0.3], v=[2 * np.cos(0.3), 2 * np.sin(0.3), 0.7])
    return m


SCENES = {
    "two impacts": (bead_on_hoop.model, 0.8, {}),
    "lift-off": (bead_on_hoop.model, 1.2, {"parameters": {"e_N": 0.0}}),
    "knife edge against a wall": (sled, 1.0, {}),
    "rocking": (rocking_block.model, 0.7, {}),
    "slip and stick": (slope.model, 1.4, {}),
    "steps of a wheel": (rimless_wheel.model, 0.6, {}),
    "slides in space": (sphere_on_incline.model, 0.3, {}),
    "three corners": (box.model, 0.4, {"q0": {"phi": 0.4}, "v0": {"x": 1.0, "phi": 2.0}}),
    "stick, slip, stick": (conveyor_oscillator.model, 4.0, {}),
}


ALWAYS = [("two impacts", 3), ("lift-off", 3), ("knife edge against a wall", 2)]


@pytest.mark.parametrize(
    ("scene", "s"),
    [
        *ALWAYS,
        *(
            pytest.param(scene, s, marks=pytest.mark.thorough if s == 3 else pytest.mark.slow)
            for scene in SCENES
            for s in (2, 3, 4)
            if (scene, s) not in ALWAYS
        ),
    ],
)
def test_order_through_events(stepper: Build, scene: str, s: int) -> None:
    """Order 2 s - 2, measured against an integration of the equations of motion by events."""
    model, t_end, start = SCENES[scene]
    made = stepper(model, s, events="located")
    exact, motion = motion_of(made, model(), t_end, 1e-9, **start)
    n = 40 if s < 4 else 20
    (coarse, _), (fine, traj) = (error(made, exact, t_end, k, **start) for k in (n, 2 * n))
    assert fine < 1e-11 or np.log2(coarse / fine) > 2 * s - 2 - 0.5
    assert fine < {2: 2e-2, 3: 2e-4, 4: 1e-6}[s]
    assert traj.smallest_gap.min() > -1e-12
    mine = [(e.t, e.kind) for e in traj.events if e.kind in ("impact", "stick", "slip")]
    other = [(t, kind) for t, _, kind in motion.events if kind in ("impact", "stick", "slip")]
    assert [kind for _, kind in mine] == [kind for _, kind in other]
    if mine:
        apart = np.abs(np.array([t for t, _ in mine]) - [t for t, _ in other])
        assert np.max(apart) < {2: 1e-2, 3: 1e-4, 4: 1e-6}[s]


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 12))]
)
def test_boxes_fall_as_they_must(stepper: Build, seed: int) -> None:
    """Impacts with friction at corners; flights of a box are parabolas, so that steps are exact."""
    rng = np.random.default_rng(seed)
    made = stepper(box.model, 3, events="located")
    start = {
        "q0": {"y": 0.6, "phi": rng.uniform(0, np.pi)},
        "v0": {"x": rng.normal(), "phi": 3 * rng.normal()},
        "parameters": {"mu": rng.uniform(0.1, 0.9), "e_N": rng.uniform(0.2, 0.7)},
    }
    exact, motion = motion_of(made, box.model(), 0.36, 1e-4, **start)
    assert motion.events
    wrong, traj = error(made, exact, 0.36, 36, **start)
    assert wrong < 1e-10
    assert len(traj.events) == len(motion.events)


def test_all_problems_are_those_of_the_reference(stepper: Build) -> None:
    """Rows and Jacobians of segments, forces and impacts, too, against 50 digits."""
    checker = Checker(box.model(), lambda model, s: stepper(box.model, s, events="located"))
    checker.jacobians(stepper(box.model, 3, events="located"))
    items = checker.report.items
    assert {i.name.split()[0] for i in items} == {
        *("position", "velocity", "segment", "accelerations", "impact")
    }
    assert all(i.worst <= i.tolerance for i in items)


# --- obstacles, refusals, falling back ------------------------------------------------------------


def test_a_small_corner_is_not_passed_through() -> None:
    """A point that passes a corner of radius 1 mm in one step of 0.1 m is thrown off it."""
    m = sg.Model("corner")
    x, y = m.coordinates("x y", units="m m")
    m.lagrangian = (m.velocities[0] ** 2 + m.velocities[1] ** 2) / 2
    m.contact("corner", g_N=sp.sqrt(x**2 + y**2) - sp.Rational(1, 1000), e_N=1)
    m.initial_state(q=[-0.2612, 0.0005], v=[1, 0])
    traj = sg.build(m, stages=2, events="located").simulate(t_end=0.6, dt=0.1, events="located")
    (event,) = traj.events
    assert event.t == pytest.approx(0.2612 - np.sqrt(1e-6 - 0.0005**2), abs=1e-13)
    normal = np.array([-np.sqrt(0.75), 0.5])
    np.testing.assert_allclose(traj.v[-1], [1, 0] - 2 * normal[0] * normal, atol=1e-13)
    q, _ = traj(np.linspace(0, 0.6, 385))
    assert np.min(np.hypot(*q.T)) >= 1e-3 - 1e-15


def lift() -> sg.Model:
    """A mass on the floor is pulled up, or aside, by a force that grows, or up by an input."""
    m = sg.Model("lift")
    _, y = m.coordinates("x y", units="m m")
    v_x, v_y = m.velocities
    (pull,) = m.inputs("pull")
    up, aside, mu = m.parameters(
        up=sg.par(0.0, unit="N/s"), aside=sg.par(0.0, unit="N/s"), mu=sg.par(0.0, min=0)
    )
    m.lagrangian = (v_x**2 + v_y**2) / 2 - sp.Rational(981, 100) * y
    m.force([aside * m.time, pull + up * m.time])
    m.contact("floor", g_N=y, gamma_F=v_x, mu=mu)
    m.initial_state(q=[0, 0])
    return m


def test_a_contact_opens_when_its_force_ends(stepper: Build) -> None:
    made = stepper(lift, 3, events="located")
    grows = made.simulate(t_end=2.0, dt=0.1, parameters={"up": 7.0}, events="located")
    (event,) = grows.events
    assert (event.kind, event.t) == ("open", pytest.approx(G / 7, abs=1e-13))
    assert grows.q[-1, 1] == pytest.approx(7 * (2 - G / 7) ** 3 / 6, abs=1e-13)
    assert grows.P_N.sum() == pytest.approx(G * G / 7 / 2, rel=1e-12)
    jumps = made.simulate(t_end=1.0, dt=0.1, inputs=[[0.0]] * 5 + [[20.0]] * 5, events="located")
    (event,) = jumps.events
    assert (event.kind, event.t) == ("open", pytest.approx(0.5, abs=1e-15))
    assert jumps.q[-1, 1] == pytest.approx((20 - G) / 8, abs=1e-14)
    assert not grows.captured.any()
    assert not jumps.captured.any()


def test_what_sticks_slips_when_its_friction_ends(stepper: Build) -> None:
    """Pulled by 3 t the mass slips from mu g = 3 t on, with the acceleration 3 t - mu g."""
    made = stepper(lift, 3, events="located")
    traj = made.simulate(t_end=2.0, dt=0.1, parameters={"aside": 3.0, "mu": 0.4}, events="located")
    (event,) = traj.events
    begins = 0.4 * G / 3
    assert (event.kind, event.t) == ("slip", pytest.approx(begins, abs=1e-13))
    assert np.max(np.abs(traj.q[traj.t < begins])) < 1e-15
    assert traj.q[-1, 0] == pytest.approx(3 * (2 - begins) ** 3 / 6, abs=1e-13)
    assert traj.P_F.sum() == pytest.approx(-3 * begins**2 / 2 - 0.4 * G * (2 - begins), rel=1e-12)
    assert not traj.captured.any()


def test_what_slides_over_an_edge_falls() -> None:
    """The table ends at x = 1: its guard turns within a step, and the mass falls from there on."""
    m = sg.Model("table_edge")
    x, y = m.coordinates("x y", units="m m")
    v_x, v_y = m.velocities
    m.lagrangian = (v_x**2 + v_y**2) / 2 - sp.Rational(981, 100) * y
    m.contact("table", g_N=y, gamma_F=v_x, mu=sp.Rational(1, 5), guard=1 - x)
    m.initial_state(q=[0, 0], v=[3, 0])
    made = sg.build(m, stages=3, events="located")
    traj = made.simulate(t_end=1.0, dt=0.1, events="located")
    (event,) = traj.events
    falls = (3 - np.sqrt(9 - 0.4 * G)) / (0.2 * G)
    assert (event.kind, event.t) == ("guard", pytest.approx(falls, abs=1e-14))
    assert traj.q[-1, 1] == pytest.approx(-G / 2 * (1 - falls) ** 2, abs=1e-13)
    assert traj.v[-1, 0] == pytest.approx(3 - 0.2 * G * falls, abs=1e-13)
    assert not traj.captured.any()


def test_three_balls_pass_on_the_impact(stepper: Build) -> None:
    """Apart they hand over all of it; touching, one impact problem gives (-1/3, 2/3, 2/3)."""
    made = stepper(cradle.model, 3, events="located")
    for apart, end in ((1e-3, [0, 0, 1]), (0.0, [-1 / 3, 2 / 3, 2 / 3])):
        traj = made.simulate(t_end=0.05, dt=1e-2, parameters={"apart": apart}, events="located")
        np.testing.assert_allclose(traj.v[-1], end, atol=1e-14)
        assert not traj.captured.any()


@pytest.mark.thorough
def test_where_it_cannot_be_decided_a_step_is_captured(stepper: Build) -> None:
    """Painleve's rod begins where no accelerations exist."""
    made = stepper(painleve_rod.model, 3, events="located")
    traj = made.simulate(t_end=0.3, dt=1e-3, events="located")
    assert traj.captured[1] == 1
    assert traj.captured.sum() < 5


def test_at_most_so_many_events_in_a_step(ball: sg.Stepper) -> None:
    about: dict[str, Any] = {"t_end": 1.5, "dt": 0.5, "parameters": {"e_N": 0.5}}
    many = ball.simulate(**about, events="located")
    assert not many.captured.any()
    few = ball.simulate(**about, events="located", max_events=2)
    assert few.captured.tolist() == [0, 0, 0, 1]
    with pytest.raises(sg.RunError, match="max_events = 65: give an integer from 1 to 64"):
        ball.simulate(**about, events="located", max_events=65)


@pytest.mark.thorough
def test_the_command_line_locates_events(tmp_path: Path) -> None:
    """run, sweep and stress with --events located; the sweep takes the steps of a run."""
    command = (sys.executable, "-m", "signorini")

    def call(*words: str) -> str:
        done = subprocess.run([*command, *words], capture_output=True, text=True, check=True)
        return done.stdout

    page = call("run", "bouncing_ball", "--t-end", "1.1", "--events", "located")
    assert "located; 0 of 110 rows hold captured steps" in page
    assert "0.428353" in page
    about = ("--t-end", "1.5", "--dt", "0.05", "--events", "located", "--out", str(tmp_path / "s"))
    call("sweep", "bouncing_ball", "--over", "e_N=0.4,0.5", *about)
    made = sg.build(bouncing_ball.model(), events="located")
    traj = made.simulate(t_end=1.5, dt=0.05, parameters={"e_N": 0.5}, events="located")
    end = sg.open_sweep(tmp_path / "s")["q"].to_numpy().reshape(2, -1, 3)[1, -1]
    np.testing.assert_array_equal(end, traj.q[-1])
    table = call("stress", "--scenes", "box_drop", "--runs", "1", "--stages", "2",
                 "--events", "located")  # fmt: skip
    assert "box_drop" in table


def test_a_stepper_without_located_events_makes_them_or_says_so(stepper: Build) -> None:
    plain = stepper(bouncing_ball.model, 3)
    assert plain.simulate(t_end=0.5, dt=1e-2, events="located").events[0].t == pytest.approx(DROP)
    loaded = sg.load(plain.folder)
    with pytest.raises(sg.RunError, match="was generated without located events: generate it"):
        loaded.simulate(t_end=0.5, dt=1e-2, events="located")


def test_other_schemes_refuse() -> None:
    with pytest.raises(sg.GenerationError, match="scheme 'moreau' has no located events"):
        sg.build(bouncing_ball.model(), scheme="moreau", events="located")
    with pytest.raises(sg.GenerationError, match="located steps have them at full order"):
        sg.build(bouncing_ball.model(), velocity_constraints="paper", events="located")
    with pytest.raises(sg.GenerationError, match="their impacts need events='located'"):
        sg.build(bouncing_ball.model(), velocity_constraints="full_order")
    with pytest.raises(sg.GenerationError, match="events 'later' is unknown"):
        sg.build(bouncing_ball.model(), events="later")
