"""Contact and force laws beyond Coulomb's, each against a closed form or an own integration."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.bodies import Planar, Round, inertia
from signorini.codegen.frontend.validate import freeze
from signorini.models import (
    freewheel,
    roller,
    rolling_ball,
    screw_jack,
    servo,
    stribeck_oscillator,
)

Build = Callable[..., sg.Stepper]
G = 9.81


def kinds(traj: sg.Trajectory) -> list[tuple[str, str, float]]:
    return [(e.kind, e.contact, e.t) for e in traj.events]


# --- rolling and drilling resistance -------------------------------------------------------------


@pytest.mark.parametrize("stages", [2, 3])
def test_a_roller_stops_where_it_must(stepper: Build, stages: int) -> None:
    """a = rho g / (R (1 + J / m R^2)), distance v^2 / (2 a), both exact by located events."""
    run = stepper(roller.model, stages, events="located").simulate(
        events="located", dt=0.05, t_end=6
    )
    a = 0.004 * G / (0.1 * 1.5)
    assert run.q[-1, 0] == pytest.approx(1 / (2 * a), abs=1e-11)
    (stop,) = kinds(run)
    assert stop[:2] == ("stick", "floor_rolling")
    assert stop[2] == pytest.approx(1 / a, abs=1e-11)
    assert not run.captured.any()


def test_a_captured_stop_is_off_by_what_its_step_moves(stepper: Build) -> None:
    """The step in which it stops ends at rest: the distance is off by less than v h there."""
    a = 0.004 * G / (0.1 * 1.5)
    for dt in (2e-2, 1e-3):
        run = stepper(roller.model, 2).simulate(dt=dt, t_end=5)
        assert abs(run.q[-1, 0] - 1 / (2 * a)) < a * dt**2
        assert np.abs(run.v[-1]).max() < 1e-15


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_roller_rests_on_a_slope_below_rho_over_r(stepper: Build, share: float) -> None:
    """It stays exactly where it is, or rolls with a = (g sin - rho g cos / R) / (1 + J / m R^2)."""
    alpha = float(np.arctan(share * 0.04))
    run = stepper(roller.model, 2).simulate(
        dt=1e-2, t_end=1, parameters={"alpha": alpha}, v0=[0, 0, 0]
    )
    a = max(G * np.sin(alpha) - 0.04 * G * np.cos(alpha), 0) / 1.5
    assert run.v[-1, 0] == pytest.approx(a, rel=1e-9, abs=1e-15)
    assert run["floor_rolling.state"][-1] == ("stick" if share < 1 else "slip")


def test_resistance_acts_in_an_impact(stepper: Build) -> None:
    """The wheel falls without spin on a floor that it slips on: friction mu P spins it up against
    rho P, so that its spin behind the impact is (mu R - rho) P / J."""
    run = stepper(roller.model, 2, events="located").simulate(
        **{"q0": [0, 0.3, 0], "v0": [9, 0, 0], "parameters": {"mu": 0.1, "rho": 0.004}},
        **{"events": "located", "dt": 1e-2, "t_end": 0.25},
    )
    fall = np.sqrt(2 * G * 0.2)
    struck = next(e for e in run.events if e.kind == "impact")
    spin = run.v[np.searchsorted(run.t, struck.t), 2]
    after = run.t[np.searchsorted(run.t, struck.t)] - struck.t
    assert pytest.approx(fall, rel=1e-12) == struck.P_N
    rate = (0.1 * 0.1 - 0.004) / (0.5 * 0.1**2)
    assert -spin == pytest.approx(rate * (fall + G * after), rel=1e-9)


def test_a_ball_rolls_out_and_spins_out(stepper: Build) -> None:
    """Distance, time, and the end of the spin about the normal, in space."""
    run = stepper(rolling_ball.model, 2, events="located").simulate(
        events="located", dt=2e-2, t_end=5
    )
    speed = np.hypot(0.6, 0.3)
    a = 0.001 * G / (0.04 * 1.4)
    ends = {name: t for kind, name, t in kinds(run) if kind == "stick"}
    assert ends["plane_rolling"] == pytest.approx(speed / a, abs=1e-6)
    assert ends["plane_drilling"] == pytest.approx(0.4 * 0.04**2 * 20 / (4e-4 * G), abs=1e-6)
    assert run.q[-1, :2] == pytest.approx(
        np.array([0.6, 0.3]) / speed * speed**2 / (2 * a), abs=1e-6
    )


def shoe() -> sg.Model:
    """A block on two surfaces of one pad, one of which is a belt."""
    m = sg.Model("shoe")
    _x, y = m.coordinates("x y")
    v_x, v_y = m.velocities
    mu_1, mu_2, speed = m.parameters(mu_1=0.3, mu_2=0.2, speed=5.0)
    m.lagrangian = (v_x**2 + v_y**2) / 2 - G * y
    m.contact("pad", g_N=y, gamma_F=v_x, mu=mu_1)
    m.friction("belt", gamma_F=v_x - speed, mu=mu_2, pressed_by="pad")
    m.initial_state(q=[0, 0], v=[1, 0])
    return m


def test_one_contact_presses_two_surfaces(stepper: Build) -> None:
    """Slower than the belt: -mu_1 g + mu_2 g; at rest the pad holds against the belt."""
    run = stepper(shoe, 2, events="located").simulate(events="located", dt=0.1, t_end=2)
    a = (0.3 - 0.2) * G
    assert run.q[-1, 0] == pytest.approx(1 / (2 * a), abs=1e-12)
    assert kinds(run)[0] == ("stick", "pad", pytest.approx(1 / a, abs=1e-12))
    assert run["belt.force_F"][-1] == pytest.approx(0.2 * G)
    assert run["pad.force_F"][-1] == pytest.approx(-0.2 * G)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "options",
    [
        {"events": "located"}, {"scheme": "moreau"}, {"precision": "float"}, {},
    ],
    ids=["located", "moreau", "float", "captured"],
)  # fmt: skip
def test_pressed_friction_is_checked_in_every_form(options: dict[str, Any]) -> None:
    report = sg.check(roller.model(), stages=(2,), **options)
    assert report.passed, str(report)


def test_derivatives_of_a_roll(stepper: Build) -> None:
    """How far it rolls, by v and by rho: 2 x / v and -x / rho, over the stop at the end. Of a
    change of v or of the spin alone only the part is left that goes on rolling."""
    run = stepper(roller.model, 2, events="located", derivatives=True).simulate(
        **{"events": "located", "dt": 0.05, "t_end": 5, "derivatives": "forward"},
        of=("v0", "parameters"),
        project=True,
    )
    x = run.q[-1, 0]
    assert run.differentiable is True
    assert run.dq["v0"][-1][0] == pytest.approx(np.array([1, 0, -0.05]) / 1.5 * 2 * x, rel=1e-8)
    names = [p["name"] for p in run.stepper.manifest["parameters"]]
    rho = names.index("rho")
    assert run.dq["parameters"][-1][0, rho] == pytest.approx(-x / 0.004, rel=1e-8)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m, v: m.friction("b", gamma_F=v), r"friction 'b'.*either a bound, or"),
        (lambda m, v: m.friction("b", gamma_F=v, mu=1), r"either a bound, or"),
        (lambda m, v: m.friction("b", gamma_F=v, bound=1, pressed_by="a"), r"either a bound, or"),
        (lambda m, v: m.friction("b", gamma_F=v, mu=1, pressed_by="c"), r"pressed_by is 'c'.*: a"),
        (lambda m, v: m.contact("b", g_N=m.q[0], rolling=1), r"rolling of contact 'b'.*a pair"),
        (lambda m, v: m.contact("b", g_N=m.q[0], drilling=(1, [v, v])), r"2 angular velocities"),
        (lambda m, v: m.contact("b", g_N=m.q[0], rolling=(-1, v)), r"mu of friction 'b_rolling'"),
    ],
)
def test_what_is_refused(call: Callable[[sg.Model, Any], None], message: str) -> None:
    m = sg.Model("m")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2
    m.contact("a", g_N=x)
    m.initial_state(q=[1])
    with pytest.raises(sg.ModelError, match=message):
        call(m, v)
        freeze(m)


def test_no_drilling_in_the_plane() -> None:
    m = sg.Model("m")
    world = Planar(m)
    wheel = world.body("wheel", 1, inertia.disc(1, 1), coordinates="x y phi")
    with pytest.raises(sg.ModelError, match=r"drilling of contact 'floor'.*plane"):
        world.contact("floor", Round(wheel.point(), 1), world.plane(), drilling=1)


# --- commanded slip ------------------------------------------------------------------------------


def command(t: float, q: np.ndarray, v: np.ndarray) -> list[float]:
    return [1.0 if t < 1 - 1e-9 else -1.0]


def test_a_servo_runs_into_its_limit(stepper: Build) -> None:
    """At the commanded speed after 0.1 s, at the stop at 0.55 s, held at 10 N, away at 1 s."""
    run = stepper(servo.model, 2, events="located").simulate(
        events="located", dt=1e-2, t_end=1.5, inputs=command
    )
    assert not run.captured.any()
    assert kinds(run) == [
        ("stick", "motor", pytest.approx(0.1, abs=1e-12)),
        ("impact", "stop", pytest.approx(0.55, abs=1e-12)),
        ("slip", "motor", pytest.approx(0.55, abs=1e-12)),
        ("reverse", "motor", pytest.approx(1.0, abs=1e-12)),
        ("open", "stop", pytest.approx(1.0, abs=1e-12)),
        ("stick", "motor", pytest.approx(1.1, abs=1e-12)),
    ]
    held = (run.t > 0.57) & (run.t < 0.99)
    assert run["stop.force_N"][held] == pytest.approx(10, abs=1e-9)


def test_a_captured_servo_with_a_law_in_c(stepper: Build, tmp_path: Any) -> None:
    """The same from a controller in C and from one in Python, step for step."""
    slide = stepper(servo.model, 2)
    law = tmp_path / "law.c"
    law.write_text(
        "void control(double t, const double q[], const double v[], double u[], double m[]) {\n"
        "    (void)q; (void)v; (void)m;\n    u[0] = t < 1 - 1e-9 ? 1.0 : -1.0;\n}\n"
    )
    runs = [
        slide.simulate(dt=1e-3, t_end=1.5, inputs=inputs)
        for inputs in (command, slide.controller(law))
    ]
    assert np.array_equal(runs[0].q, runs[1].q)
    state = runs[0]["stop.state"][1:] != "open"
    assert runs[0].t[1:][state][0] == pytest.approx(0.55, abs=1.1e-3)
    assert runs[0].t[1:][state][-1] == pytest.approx(1.0, abs=1.1e-3)


def test_where_an_input_may_not_stand() -> None:
    m = sg.Model("m")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    (u,) = m.inputs("u")
    m.lagrangian = v**2 / 2
    m.velocity_constraint("drive", v - u)
    m.initial_state(q=[x * 0])
    with pytest.raises(sg.ModelError, match=r"'drive': depends on the input 'u'.*A servo is"):
        freeze(m)


# --- coefficients that vary -----------------------------------------------------------------------

MU_S, MU_D, V_S, BELT, K = 0.5, 0.3, 0.05, 0.2, 100.0


@cache
def limit_cycle() -> tuple[float, float]:
    """Period and turning point of the stick-slip cycle, by Runge and Kutta's method."""

    def rate(s: np.ndarray) -> np.ndarray:
        mu = MU_D + (MU_S - MU_D) * np.exp(-(((s[1] - BELT) / V_S) ** 2))
        return np.array([s[1], mu * G - K * s[0]])

    tear = MU_S * G / K
    s, h, t, lowest = np.array([tear, BELT * (1 - 1e-9)]), 1e-5, 0.0, tear
    while True:
        a = rate(s)
        b = rate(s + h / 2 * a)
        c = rate(s + h / 2 * b)
        after = s + h / 6 * (a + 2 * b + 2 * c + rate(s + h * c))
        lowest = min(lowest, after[0])
        if after[1] >= BELT and t > 0.1:
            share = (BELT - s[1]) / (after[1] - s[1])
            t += share * h
            return t + (tear - (s[0] + share * (after[0] - s[0]))) / BELT, lowest
        s, t = after, t + h


def test_stick_and_slip_with_falling_friction(stepper: Build) -> None:
    """Period and amplitude of the limit cycle tend to those of the differential equation with the
    first order of coefficients that are taken at the start of a step."""
    period, lowest = limit_cycle()
    errors = []
    for dt in (1e-3, 5e-4):
        run = stepper(stribeck_oscillator.model, 2, events="located").simulate(
            events="located", dt=dt, t_end=2
        )
        tears = [t for kind, _, t in kinds(run) if kind == "slip"]
        errors.append((tears[-1] - tears[-2] - period, run.q[:, 0].min() - lowest))
    order = np.log2(np.array(errors[0]) / np.array(errors[1]))
    assert np.all((order > 0.9) & (order < 1.1)), errors
    assert abs(errors[1][0]) < 1e-3 * period


def belt(mu_at: str = "stages") -> sg.Model:
    """The same block; on a rail with the same law as a force where `mu_at` is empty."""
    m = sg.Model("belt")
    x, y = m.coordinates("x y")
    v_x, v_y = m.velocities
    slip = v_x - BELT
    mu = MU_D + (MU_S - MU_D) * sp.exp(-((slip / V_S) ** 2))
    m.lagrangian = (v_x**2 + v_y**2) / 2 - K * x**2 / 2 - G * y
    if mu_at:
        m.contact("belt", g_N=y, gamma_F=slip, mu=mu, mu_at=mu_at)
    else:
        m.force({"x": mu * G})
        m.constraint("rail", y)
    m.initial_state(q=[0, 0], v=[BELT, 0])
    m.suggest(dt=1e-3, t_end=1)
    return m


@pytest.mark.parametrize(
    ("stages", "options"),
    [
        (2, {}),
        pytest.param(3, {}, marks=pytest.mark.thorough),
        pytest.param(2, {"events": "located"}, marks=pytest.mark.thorough),
        (3, {"events": "located"}),
    ],
)
def test_coefficients_at_the_stages_have_the_order_of_the_scheme(
    stepper: Build, stages: int, options: dict[str, Any]
) -> None:
    """While it slides one way, friction that falls with the slip is a smooth force."""
    # about V_S the coefficient changes most
    start = {"q0": [0.03, 0], "v0": [BELT - 0.08, 0], "t_end": 0.04}
    exact = sg.build(belt(""), stages=4).simulate(dt=5e-4, **start)
    made = stepper(belt, stages, **options)
    errors = [
        np.abs(made.simulate(dt=dt, **start, **options).q[-1, 0] - exact.q[-1, 0])
        for dt in (4e-3, 2e-3)
    ]
    assert np.log2(errors[0] / errors[1]) > 2 * stages - 2.2, errors


def test_the_limit_cycle_at_the_order_of_the_scheme(stepper: Build) -> None:
    """Located events and coefficients at the stages, s = 3: the period to nine digits."""
    period, _ = limit_cycle()
    run = stepper(belt, 3, events="located").simulate(events="located", dt=2e-3, t_end=2)
    tears = [t for kind, _, t in kinds(run) if kind == "slip"]
    assert tears[-1] - tears[-2] == pytest.approx(period, abs=2e-8)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "options", [{}, {"events": "located"}, {"scheme": "moreau"}, {"precision": "float"}]
)
def test_coefficients_at_the_stages_are_checked(options: dict[str, Any]) -> None:
    report = sg.check(belt(), stages=(2,), **options)
    assert report.passed, str(report)


def test_where_coefficients_cannot_be_taken() -> None:
    m = sg.Model("m")
    (y,) = m.coordinates("y")
    with pytest.raises(sg.ModelError, match=r"mu_at of contact 'a': is 'end'"):
        m.contact("a", g_N=y, mu_at="end")
    with pytest.raises(sg.GenerationError, match=r"coefficient of 'belt' is taken at the stages"):
        sg.build(belt(), stages=2, derivatives=True)


def ramp() -> sg.Model:
    """A block that slides onto a rough floor, and under an input that loads its coefficient."""
    m = sg.Model("ramp")
    x, y = m.coordinates("x y")
    v_x, v_y = m.velocities
    (u,) = m.inputs("u")
    (c,) = m.parameters(c=0.2)
    m.lagrangian = (v_x**2 + v_y**2) / 2 - G * y
    m.contact("floor", g_N=y, gamma_F=v_x, mu=c * sp.Max(x, 0) + u, e_N=0)
    m.initial_state(q=[-0.5, 0], v=[2, 0])
    return m


def test_friction_that_depends_on_the_place(stepper: Build) -> None:
    """mu = c x from 0 on: v^2 / 2 = c g x^2 / 2 at the end of the way."""
    run = stepper(ramp, 2, events="located").simulate(events="located", dt=1e-4, t_end=2)
    assert run.q[-1, 0] == pytest.approx(2 / np.sqrt(0.2 * G), rel=2e-4)
    # with an input instead: a = -u g
    u = np.full((100, 1), 0.3)
    held = stepper(ramp, 2).simulate(dt=1e-2, t_end=1, inputs=u, parameters={"c": 0.0}, q0=[-9, 0])
    assert held.v[50, 0] == pytest.approx(2 - 0.3 * G * 0.5, rel=1e-12)


def test_a_coefficient_that_leaves_its_range_is_named(stepper: Build) -> None:
    with pytest.raises(sg.StepError, match=r"mu of contact 'floor' is -1 .*it must be >= 0"):
        stepper(ramp, 2).simulate(
            dt=1e-2, t_end=1, inputs=lambda t, q, v: [0.3 if t < 0.2 else -1.0],
            parameters={"c": 0.0}, q0=[-9, 0],
        )  # fmt: skip


def hard_or_soft() -> sg.Model:
    """A ball whose restitution falls with the speed at which it comes."""
    m = sg.Model("hard_or_soft")
    (y,) = m.coordinates("y")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2 - G * y
    m.contact("floor", g_N=y, e_N=1 / (1 + sp.Abs(v) / 2))
    m.initial_state(q=[1])
    return m


def test_restitution_of_the_approach_speed(stepper: Build) -> None:
    """Located: each impact has the coefficient of the velocity before it."""
    run = stepper(hard_or_soft, 2, events="located").simulate(events="located", dt=1e-2, t_end=1.5)
    v, t = np.sqrt(2 * G), np.sqrt(2 / G)
    for _, _, struck in kinds(run)[:3]:
        assert struck == pytest.approx(t, abs=1e-12)
        v = v / (1 + v / 2)
        t += 2 * v / G


# --- one way -------------------------------------------------------------------------------------


def steps_forward() -> tuple[float, float]:
    """Period and advance of the freewheel in one, from its closed form."""
    from scipy.optimize import brentq

    J, T, M, Omega = 0.2, 3.0, 1.0, 10.0
    t_1 = np.arcsin(M / T) / Omega

    def omega(t: float) -> float:
        return (T * (np.cos(Omega * t_1) - np.cos(Omega * t)) / Omega - M * (t - t_1)) / J

    t_2 = brentq(omega, t_1 + 0.1, t_1 + 2 * np.pi / Omega)
    turned = T * np.cos(Omega * t_1) * (t_2 - t_1) / Omega
    turned -= T * (np.sin(Omega * t_2) - np.sin(Omega * t_1)) / Omega**2
    return 2 * np.pi / Omega, float((turned - M * (t_2 - t_1) ** 2 / 2) / J)


def test_a_freewheel_goes_forward_in_steps(stepper: Build) -> None:
    """The advance of three periods, to second order; it never turns back, and holds by what the
    brake and the torque ask for."""
    period, advance = steps_forward()
    errors = []
    for n in (157, 628):
        run = stepper(freewheel.model, 2).simulate(dt=period / n, t_end=3 * period * (1 + 1e-12))
        errors.append(abs(run.q[-1, 0] - 3 * advance))
        assert run.v.min() > -1e-14
    assert errors[1] < min(2e-5, errors[0] / 4)
    held = np.flatnonzero(run["clutch.state"] == "closed")
    torque = 1 - 3 * np.sin(10 * (run.t[held] - period / n / 2))
    inside = np.diff(held, prepend=-9) == 1  # but for the step in which it is caught
    assert run["clutch.force_N"][held][inside][5:] == pytest.approx(torque[inside][5:], abs=0.02)


def test_a_freewheel_is_struck_backwards(stepper: Build) -> None:
    """Newton's law at once: omega_+ = -e omega_-."""
    run = stepper(freewheel.model, 2).simulate(
        dt=1e-4, t_end=1e-3, v0=[-2], parameters={"e_N": 0.5, "M": 0.0, "T": 0.0}
    )
    assert run.v[1:, 0] == pytest.approx(1)
    assert run["clutch.force_N"][1] * 1e-4 == pytest.approx(0.2 * 3)
    # forwards it runs out against the brake, and restitution is nothing to it
    run = stepper(freewheel.model, 2).simulate(
        dt=7e-3, t_end=0.7, v0=[2], parameters={"e_N": 0.9, "M": 1.0, "T": 0.0}
    )
    assert run.v[50, 0] == pytest.approx(2 - 5 * 50 * 7e-3)
    assert run.v.min() >= 0
    assert run.v[-1, 0] == 0


def ratchets() -> sg.Model:
    """Velocities that go one way, along directions that turn with the place and the time, next to
    a contact."""
    m = sg.Model("ratchets")
    x, y = m.coordinates("x y")
    v_x, v_y = m.velocities
    mass, e = m.parameters(mass=0.8, e=0.3)
    m.lagrangian = mass * (v_x**2 + 2 * v_y**2) / 2 + v_x * v_y * sp.cos(x) / 4 - 3 * y
    m.one_way("slope", v_x * sp.cos(y) + v_y * sp.sin(x) + sp.sin(m.time) / 5, e_N=e)
    m.contact("floor", g_N=y + sp.cos(x) / 10, gamma_F=v_x, mu=0.4, e_N=0.2)
    m.one_way("late", -v_x, guard=x - sp.Rational(1, 10))
    m.initial_state(q=[0.1, 0.2], v=[0.3, 0])
    m.suggest(dt=1e-3, t_end=1)
    return m


@pytest.mark.thorough
@pytest.mark.parametrize("options", [{}, {"scheme": "moreau"}, {"precision": "float"}])
def test_one_way_velocities_are_checked(options: dict[str, Any]) -> None:
    report = sg.check(ratchets(), stages=(2, 3) if not options else (2,), **options)
    assert report.passed, str(report)


@pytest.mark.parametrize("make", [freewheel.model, screw_jack.model])
def test_what_cannot_be_located_says_so(make: Callable[[], sg.Model]) -> None:
    with pytest.raises(sg.GenerationError, match=r"Use events='captured'"):
        sg.build(make(), stages=2, events="located")


# --- sliding that spins --------------------------------------------------------------------------


def puck() -> sg.Model:
    """A disc that slides and spins on a table, on a ring of contact."""
    m = sg.Model("puck")
    _x, _y, z, _phi = m.coordinates("x y z phi")
    v_x, v_y, v_z, omega = m.velocities
    mass, J, mu, sigma = m.parameters(mass=0.3, J=2e-4, mu=0.3, sigma=0.01)
    m.lagrangian = mass * (v_x**2 + v_y**2 + v_z**2) / 2 + J * omega**2 / 2 - mass * G * z
    m.contact(
        *("table",),
        **{"g_N": z, "gamma_F": [v_x, v_y], "mu": mu, "drilling": (sigma, omega)},
        coupling="contensou",
    )
    m.initial_state(q=[0, 0, 0, 0], v=[0.6, 0.2, 0, 40])
    m.suggest(dt=5e-3, t_end=0.5)
    return m


def sliding_and_spinning(t_end: float) -> np.ndarray:
    """Place, velocity and spin of the puck by Runge and Kutta's method."""

    def rate(u: np.ndarray) -> np.ndarray:
        size = np.sqrt(0.3**2 * (u[2] ** 2 + u[3] ** 2) + 0.01**2 * u[4] ** 2)
        return np.array(
            [
                *u[2:4], *(-G * 0.3**2 * u[2:4] / size), -0.3 * G * 0.01**2 * u[4] / (2e-4 * size),
            ]
        )  # fmt: skip

    u, n = np.array([0, 0, 0.6, 0.2, 40.0]), 4000
    h = t_end / n
    for _ in range(n):
        a = rate(u)
        b = rate(u + h / 2 * a)
        c = rate(u + h / 2 * b)
        u = u + h / 6 * (a + 2 * b + 2 * c + rate(u + h * c))
    return u


def test_a_spinning_disc_slides_further(stepper: Build) -> None:
    """The path of Contensou's coupled law, and both motions that end at one instant."""
    run = stepper(puck, 3, events="located").simulate(events="located", dt=5e-3, t_end=0.5)
    k = np.searchsorted(run.t, 0.2 - 1e-9)
    wanted = sliding_and_spinning(0.2)
    assert run.q[k, :2] == pytest.approx(wanted[:2], rel=1e-8)
    assert run.v[k, [0, 1, 3]] == pytest.approx(wanted[2:], rel=1e-8)
    (stop,) = kinds(run)
    assert stop[:2] == ("stick", "table")
    assert np.abs(run.v[-1]).max() < 1e-15
    # a disc that does not spin stops sooner
    assert stop[2] > 1.5 * np.hypot(0.6, 0.2) / (0.3 * G)


@pytest.mark.thorough
@pytest.mark.parametrize("options", [{}, {"scheme": "moreau"}, {"events": "located"}])
def test_coupled_laws_are_checked(options: dict[str, Any]) -> None:
    report = sg.check(puck(), stages=(2,), **options)
    assert report.passed, str(report)


def test_couplings_that_there_are_not() -> None:
    m = sg.Model("m")
    (z,) = m.coordinates("z")
    (v,) = m.velocities
    for arguments, message in (
        ({"coupling": "coulomb"}, r"coupling of contact 'a': is 'coulomb'"),
        ({"coupling": "contensou", "drilling": (1, v)}, "one of them is missing"),
        ({"coupling": "contensou", "gamma_F": [v, v]}, "one of them is missing"),
    ):
        with pytest.raises(sg.ModelError, match=message):
            m.contact("a", g_N=z, **arguments)


# --- wheels that slide freely one way ------------------------------------------------------------


def mecanum() -> sg.Model:
    """A platform on four mecanum wheels: friction along the axes of the rollers alone."""
    m = sg.Model("mecanum")
    _x, _y, phi, *_wheels = m.coordinates("x y phi w1 w2 w3 w4")
    v_x, v_y, omega, *spins = m.velocities
    torques = m.inputs("T1 T2 T3 T4")
    m.lagrangian = 10 * (v_x**2 + v_y**2) / 2 + omega**2 / 2 + sum(w**2 for w in spins) / 100
    m.force([0, 0, 0, *torques])
    ahead = sp.cos(phi) * v_x + sp.sin(phi) * v_y
    aside = sp.cos(phi) * v_y - sp.sin(phi) * v_x
    for k, (i, j) in enumerate([(1, 1), (1, -1), (-1, 1), (-1, -1)]):
        # the place of the wheel, and its roller axis at 45 degrees, mirrored from wheel to wheel
        u = ahead - omega * j * sp.Rational(3, 10) - sp.Rational(1, 20) * spins[k]
        w = aside + omega * i * sp.Rational(2, 5)
        m.friction(f"wheel_{k + 1}", gamma_F=(u - i * j * w) / sp.sqrt(2), bound=20)
    m.initial_state(q=[0] * 7)
    return m


def test_mecanum_wheels_roll_as_the_textbook_says(stepper: Build) -> None:
    """v = r/4 (sum, -1 1 1 -1, ...) of the wheels' speeds, without slip."""
    u = np.array([0.3, -0.1, 0.2, 0.4])
    run = stepper(mecanum, 2).simulate(dt=1e-2, t_end=2, inputs=np.tile(u, (200, 1)))
    v_x, v_y, omega, *w = run.v[-1]
    c, s = np.cos(run.q[-1, 2]), np.sin(run.q[-1, 2])
    ahead, aside = c * v_x + s * v_y, c * v_y - s * v_x
    assert np.abs(w).min() > 0.5
    assert np.abs(run.gamma_F).max() < 1e-14
    assert ahead == pytest.approx(0.05 / 4 * (w[0] + w[1] + w[2] + w[3]), rel=1e-12)
    assert aside == pytest.approx(0.05 / 4 * (-w[0] + w[1] + w[2] - w[3]), rel=1e-12)
    assert omega == pytest.approx(0.05 / (4 * 0.7) * (-w[0] + w[1] - w[2] + w[3]), rel=1e-12)
