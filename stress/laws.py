"""Scenes of the laws beyond Coulomb's, where these can jam or catch."""

from math import cos, pi, sin, tan

import numpy as np
import signorini as sg
import sympy as sp
from signorini.bodies import Planar, Round, Spatial, inertia
from signorini.models import (
    atwood,
    bungee,
    freewheel,
    rattling_gears,
    roller,
    rolling_ball,
    screw_jack,
    stribeck_oscillator,
    string_pendulum,
)
from signorini.stress.scene import Case, Scene

G = 9.81
Rng = np.random.Generator


def _power(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _e(rng: Rng) -> float:
    return float(rng.choice([0.0, 0.0, rng.uniform(), 1.0]))


# --- rolling and drilling resistance --------------------------------------------------------------


def roller_falls(rng: Rng) -> Case:
    par = {
        "alpha": rng.uniform(-0.3, 0.3), "mu": rng.uniform(0, 1.2), "rho": rng.uniform(0, 0.05),
        "e_N": _e(rng),
    }  # fmt: skip
    v = rng.normal(size=3) * [2, 1, 20]
    return Case(_power(rng, 1e-3, 2e-2), [0, rng.uniform(0.1, 0.5), 0], v, par)


def groove() -> sg.Model:
    """A roller in a groove, with resistance to rolling on both walls."""
    m = sg.Model("roller_in_groove")
    R, alpha, mu, rho, e_N = m.parameters(R=0.1, alpha=pi / 4, mu=0.5, rho=0.01, e_N=0.0)
    world = Planar(m, gravity=(0, -G))
    wheel = world.body("wheel", 1.0, inertia.disc(1.0, R), coordinates="x y phi")
    s, c = sp.sin(alpha), sp.cos(alpha)
    for name, n in (("left", (s, c)), ("right", (-s, c))):
        wall = world.plane(world.ground.point(0, 0), n)
        laws = {"mu": mu, "e_N": e_N, "rolling": rho}
        world.contact(name, Round(wheel.point(), R), wall, **laws)
    m.initial_state(q={"y": 0.5})
    return m


def roller_wedged(rng: Rng) -> Case:
    alpha = rng.uniform(0.3, 1.3)
    par = {
        "alpha": alpha, "mu": rng.uniform(0, 1.5), "rho": float(rng.choice([0, 0.01, 0.08])),
        "e_N": _e(rng),
    }  # fmt: skip
    q = [rng.uniform(-0.1, 0.1), 0.1 / cos(alpha) + rng.uniform(0.12, 0.4) * tan(alpha), 0]
    return Case(_power(rng, 1e-3, 1e-2), q, rng.normal(size=3) * [0.5, 1, 20], par)


def _quaternion_case(rng: Rng, par: dict[str, float], height: float, dt: float) -> Case:
    q = [0, 0, height, 1, 0, 0, 0]
    v = rng.normal(size=7) * [1, 1, 0.5, 0, 8, 8, 8]
    return Case(dt, q, v, par)


def ball_rolls(rng: Rng) -> Case:
    par = {
        "mu": rng.uniform(0, 1), "rho": rng.uniform(0, 0.02), "sigma": rng.uniform(0, 0.02),
        "e_N": _e(rng),
    }  # fmt: skip
    return _quaternion_case(rng, par, rng.uniform(0.04, 0.3), _power(rng, 1e-3, 1e-2))


def trough() -> sg.Model:
    """A ball in a trough, with resistance to rolling and drilling on both walls."""
    m = sg.Model("ball_in_trough")
    mu, rho, sigma, e_N = m.parameters(mu=0.4, rho=0.004, sigma=0.002, e_N=0.0)
    world = Spatial(m, gravity=(0, 0.5, -G))
    ball = world.body("ball", 0.3, inertia.ball(0.3, 0.04), coordinates="x y z p0 p1 p2 p3")
    for name, i in (("left", 1), ("right", -1)):
        wall = world.plane(world.ground.point(0, 0, 0), (i * 0.6, 0, 0.8))
        laws = {"mu": mu, "e_N": e_N, "rolling": rho, "drilling": sigma}
        world.contact(name, Round(ball.point(), 0.04), wall, **laws)
    world.initial_state(q={"z": 0.06})
    return m


def ball_in_trough(rng: Rng) -> Case:
    par = {
        "mu": rng.uniform(0, 1), "rho": rng.uniform(0, 0.02), "sigma": rng.uniform(0, 0.01),
        "e_N": _e(rng),
    }  # fmt: skip
    return _quaternion_case(rng, par, rng.uniform(0.05, 0.15), _power(rng, 1e-3, 5e-3))


# --- sliding that spins ---------------------------------------------------------------------------


def rink() -> sg.Model:
    """A spinning puck between two boards, sliding and drilling coupled."""
    m = sg.Model("puck_on_a_rink")
    _x, y, z, _phi = m.coordinates("x y z phi")
    v_x, v_y, v_z, omega = m.velocities
    mu, sigma, e_N = m.parameters(mu=0.3, sigma=0.01, e_N=0.3)
    m.lagrangian = 0.15 * (v_x**2 + v_y**2 + v_z**2) + 1e-4 * omega**2 - 0.3 * G * z
    m.contact(
        *("ice",),
        **{"g_N": z, "gamma_F": [v_x, v_y], "mu": mu, "drilling": (sigma, omega)},
        coupling="contensou",
    )
    for name, i in (("near", 1), ("far", -1)):
        slip = v_x + i * sp.Rational(1, 20) * omega
        m.contact(name, g_N=sp.Rational(1, 10) + i * y, gamma_F=slip, mu=mu, e_N=e_N)
    m.initial_state(q=[0, 0, 0, 0])
    return m


def puck(rng: Rng) -> Case:
    par = {"mu": rng.uniform(0.01, 1), "sigma": _power(rng, 1e-3, 0.1), "e_N": _e(rng)}
    v = rng.normal(size=4) * [1, 1, 0, 40]
    return Case(_power(rng, 1e-3, 1e-2), None, v, par)


# --- friction under load --------------------------------------------------------------------------


def screw_at_its_limit(rng: Rng) -> Case:
    alpha = rng.uniform(0.05, 0.9)
    near = 1 + float(rng.choice([-1, 1])) * _power(rng, 1e-6, 0.9)
    par = {"alpha": alpha, "mu": tan(alpha) * near, "F": rng.normal() * 100}
    v = rng.normal() * float(rng.choice([0, 1]))
    return Case(_power(rng, 1e-4, 1e-2), None, [v * sin(alpha), v * cos(alpha) / 0.02], par)


def ladder() -> sg.Model:
    """A ladder whose upper end slides in a rough rail, its lower end on a rough floor."""
    m = sg.Model("ladder")
    _x, y, phi = m.coordinates("x y phi")
    v_x, v_y, omega = m.velocities
    mu_rail, mu, e_N = m.parameters(mu_rail=0.4, mu=0.4, e_N=0.0)
    m.lagrangian = (v_x**2 + v_y**2) / 2 + omega**2 / 24 - G * y
    s, c = sp.sin(phi) / 2, sp.cos(phi) / 2
    m.constraint("rail", m.q[0] - c)
    m.friction("upper", gamma_F=v_y + c * omega, bound=mu_rail * m.reaction("rail"))
    m.contact("floor", g_N=y - s, gamma_F=v_x - s * omega, mu=mu, e_N=e_N)
    m.initial_state(q=[cos(1.0) / 2, sin(1.0) / 2, 1.0])
    return m


def _ladder(rng: Rng, top: float) -> Case:
    par = {"mu_rail": rng.uniform(0, top), "mu": rng.uniform(0, top), "e_N": _e(rng)}
    phi = rng.uniform(0.4, 2.6)
    q = [cos(phi) / 2, sin(phi) / 2 + float(rng.choice([0, 0.05])), phi]
    return Case(_power(rng, 5e-4, 5e-3), q, [0, 0, rng.normal() * 3], par)


def ladder_slides(rng: Rng) -> Case:
    return _ladder(rng, 0.7)


def ladder_locks(rng: Rng) -> Case:
    return _ladder(rng, 1.2)


# --- one way --------------------------------------------------------------------------------------


def freewheel_driven(rng: Rng) -> Case:
    par = {
        "T": _power(rng, 0.1, 30), "M": rng.uniform(-1, 3), "Omega": _power(rng, 1, 100),
        "e_N": _e(rng),
    }  # fmt: skip
    return Case(_power(rng, 1e-4, 2e-2), None, [rng.normal() * 3], par)


def shuttle() -> sg.Model:
    """A sledge on one-way runners, shaken before an oblique wall."""
    m = sg.Model("shuttle")
    x, y = m.coordinates("x y")
    v_x, v_y = m.velocities
    mu, e_N, push = m.parameters(mu=0.3, e_N=0.2, push=30.0)
    m.lagrangian = (v_x**2 + v_y**2) / 2 - G * y
    m.force([push * sp.sin(20 * m.time), -push * sp.cos(33 * m.time) / 4])
    m.one_way("runner", v_x)
    m.contact("floor", g_N=y, gamma_F=v_x, mu=mu, e_N=e_N)
    wall = sp.Rational(3, 10) - sp.Rational(3, 5) * x - sp.Rational(4, 5) * y
    m.contact("wall", g_N=wall, gamma_F=(4 * v_x - 3 * v_y) / 5, mu=mu)
    m.initial_state(q=[0, 0])
    return m


def shuttle_caught(rng: Rng) -> Case:
    par = {"mu": rng.uniform(0, 1.5), "e_N": _e(rng), "push": _power(rng, 3, 100)}
    return Case(_power(rng, 5e-4, 1e-2), None, rng.normal(size=2) * [1, 0], par)


# --- ropes and gears ------------------------------------------------------------------------------


def string_thrown(rng: Rng) -> Case:
    angle, out = rng.uniform(-pi, pi), rng.uniform(0.3, 0.7)
    q = [out * sin(angle), -out * cos(angle)]
    return Case(_power(rng, 1e-3, 1e-2), q, rng.normal(size=2) * 3, {"e_N": _e(rng)})


def atwood_jerks(rng: Rng) -> Case:
    par = {
        "light": _power(rng, 1e-2, 10), "heavy": _power(rng, 1e-2, 10),
        "slack": float(rng.choice([0, rng.uniform(0, 0.3)])), "e_N": _e(rng),
    }  # fmt: skip
    return Case(_power(rng, 1e-3, 5e-3), None, None, par)


def swing() -> sg.Model:
    """A seat on two ropes, which become taut one after the other."""
    m = sg.Model("swing")
    (e_N,) = m.parameters(e_N=0.0)
    world = Planar(m, gravity=(0, -G))
    seat = world.body("seat", 1.0, inertia.rectangle(1.0, 0.4, 0.1), coordinates="x y phi")
    for name, i in (("left", -1), ("right", 1)):
        hook = world.ground.point(i * 0.3, 1)
        world.rope(name, [hook, seat.point(i * 0.2, 0.05)], 0.9, e_N=e_N)
    world.contact("floor", seat.point(0, -0.05), world.plane(world.ground.point(0, -0.2)), mu=0.4)
    m.initial_state(q={"y": 0.3})
    return m


def seat_falls(rng: Rng) -> Case:
    q = [rng.uniform(-0.3, 0.3), rng.uniform(0.2, 0.8), rng.uniform(-0.5, 0.5)]
    return Case(_power(rng, 1e-3, 1e-2), q, rng.normal(size=3) * [1, 1, 2], {"e_N": _e(rng)})


def gears_rattle(rng: Rng) -> Case:
    par = {"play": _power(rng, 1e-4, 1e-2), "J_1": _power(rng, 1e-3, 1e3), "e_N": _e(rng)}
    return Case(_power(rng, 1e-4, 1e-2), None, rng.normal(size=2) * [5, 2], par)


def train() -> sg.Model:
    """Three gears with play, the last one braked."""
    m = sg.Model("gear_train")
    one, two, three = m.coordinates("one two three")
    w_1, w_2, w_3 = m.velocities
    play, hold, e_N = m.parameters(play=1e-3, hold=1.0, e_N=0.3)
    m.lagrangian = (w_1**2 + 2 * w_2**2 + w_3**2 / 2) / 2
    m.force([3 * sp.sin(7 * m.time), 0, 0])
    m.coupling("first", sp.Rational(1, 10) * one + sp.Rational(1, 5) * two, play=play, e_N=e_N)
    m.coupling("second", sp.Rational(1, 5) * two + sp.Rational(1, 20) * three, play=play, e_N=e_N)
    m.friction("brake", gamma_F=w_3, bound=hold)
    m.initial_state(q=[0, 0, 0])
    return m


def train_braked(rng: Rng) -> Case:
    par = {"play": _power(rng, 1e-5, 1e-2), "hold": rng.uniform(0, 3), "e_N": _e(rng)}
    return Case(_power(rng, 5e-4, 1e-2), None, rng.normal(size=3) * [1, 0, 0], par)


def squeal(rng: Rng) -> Case:
    par = {
        "speed": rng.normal() * 0.3, "mu_s": rng.uniform(0.1, 1.5), "mu_d": rng.uniform(0, 1),
        "v_s": _power(rng, 1e-3, 1), "k": _power(rng, 1, 1e4),
    }  # fmt: skip
    return Case(_power(rng, 1e-4, 1e-2), None, [rng.normal(), 0], par)


# --- contacts and joints that yield ---------------------------------------------------------------


def crate() -> sg.Model:
    """A crate with compliant feet slides on a floor and against a compliant wall."""
    m = sg.Model("crate")
    a, b, mu, c, c_wall, tau = m.parameters(a=0.3, b=0.2, mu=0.5, c=1e-5, c_wall=1e-4, tau=0.0)
    world = Planar(m, gravity=(0, -G))
    body = world.body("crate", 2.0, (a**2 + b**2) / 6 * 2, coordinates="x y phi")
    floor = world.plane(world.ground.point(0, 0))
    wall = world.plane(world.ground.point(1, 0), (-1, 0))
    laws = {"mu": mu, "relaxation": tau}
    for name, side in (("left", -1), ("right", 1)):
        foot = body.point(side * a / 2, -b / 2)
        world.contact(f"{name}_foot", foot, floor, compliance=c * (2 + side), **laws)
    for name, side in (("lower", -1), ("upper", 1)):
        corner = body.point(a / 2, side * b / 2)
        world.contact(f"{name}_corner", corner, wall, compliance=c_wall, **laws)
    m.initial_state(q={"y": 0.1})
    return m


def crate_thrown(rng: Rng) -> Case:
    par = {
        "mu": rng.uniform(0, 2), "c": _power(rng, 1e-12, 1e-2), "c_wall": _power(rng, 1e-12, 1e-2),
        "tau": float(rng.choice([0.0, _power(rng, 1e-5, 1)])),
    }  # fmt: skip
    q = [rng.uniform(0, 0.8), rng.uniform(0.1, 0.4), rng.normal() * 0.3]
    return Case(_power(rng, 1e-3, 2e-2), q, rng.normal(size=3) * [3, 2, 6], par)


def jump(rng: Rng) -> Case:
    par = {
        "mass": _power(rng, 1e-2, 1e3), "compliance": _power(rng, 1e-9, 1e-1),
        "relaxation": float(rng.choice([0.0, _power(rng, 1e-4, 1)])), "length": 2.0,
    }  # fmt: skip
    return Case(_power(rng, 5e-3, 3e-2), None, rng.normal(size=2) * [5, 2], par)


LAWS = (
    Scene("roller_falls", "rolling resistance on a slope", roller.model, roller_falls, 200, 2),
    Scene("roller_wedged", "rolling resistance on two walls", groove, roller_wedged, 200, 2),
    Scene("ball_rolls", "rolling and drilling in space", rolling_ball.model, ball_rolls, 150),
    Scene("ball_in_trough", "the same on two walls", trough, ball_in_trough, 150),
    Scene("puck", "sliding that spins, between boards", rink, puck, 150, 2),
    Scene("screw", "about self-locking", screw_jack.model, screw_at_its_limit, 60, 4),
    Scene("ladder", "rail under load, and a floor", ladder, ladder_slides, 150, 3),
    Scene("freewheel", "driven, loaded, struck", freewheel.model, freewheel_driven, 200, 2),
    Scene("shuttle", "one way, against a wall", shuttle, shuttle_caught, 200, 2),
    Scene("string", "slack and taut", string_pendulum.model, string_thrown, 200, 2),
    Scene("atwood", "mass ratios to 1000 on a rope", atwood.model, atwood_jerks, 150, 2),
    Scene("swing", "a seat on two ropes falls", swing, seat_falls, 200, 2),
    Scene("gears", "play, inertias 1e-3 ... 1e3", rattling_gears.model, gears_rattle, 200, 2),
    Scene("gear_train", "three gears with play and a brake", train, train_braked, 200, 2),
    Scene("squeal", "friction that falls with the slip", stribeck_oscillator.model, squeal, 200, 2),
    Scene("crate", "compliant feet and wall, c 1e-12 ... 1e-2", crate, crate_thrown, 200, 2),
    Scene("bungee", "elastic rope, c 1e-9 ... 1e-1", bungee.model, jump, 200, 2),
)
# Self-locking between a rail and a floor.
LOCKED = (
    Scene("ladder_locked", "rail and floor, about self-locking", ladder, ladder_locks, 150, 3),
)
