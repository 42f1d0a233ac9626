"""The rigid-body layer: joints, forces and contacts against closed forms and other coordinates."""

from collections.abc import Callable
from math import cos, pi, sin, sqrt
from typing import Any

import casadi as ca
import numpy as np
import pytest
import signorini as sg
from hypothesis import given, settings
from hypothesis import strategies as st
from signorini.bodies import Edge, Ellipsoid, Planar, Plane, Round, Spatial, inertia
from signorini.bodies.algebra import algebra_of
from signorini.bodies.shapes import tangents, touch
from signorini.models import box, box_in_space

WORLDS = pytest.mark.parametrize("symbols", ["sympy", "casadi"])
G = 9.81


def numeric(model: sg.Model, expressions: Any) -> Callable[..., np.ndarray]:
    """Values of expressions at (q, v)."""
    column = [model.world.to_sx(model.name, "test", e) for e in expressions]
    symbols = [
        ca.vertcat(ca.SX(0, 1), *(model.world.to_sx(model.name, "test", s) for s in part))
        for part in (model.q, model.v)
    ]
    f = ca.Function("f", symbols, [ca.vertcat(*column)])
    return lambda q, v: np.asarray(f(q, v)).ravel()


@WORLDS
def test_the_same_boxes(symbols: str) -> None:
    """The boxes of the collection, written by hand there, in a few lines here: the same steps."""
    m = sg.Model("box", symbols=symbols)
    world = Planar(m, gravity=(0, -G))
    block = world.body("box", 1.0, inertia.rectangle(1.0, 0.4, 0.2), coordinates="x y phi")
    for name, i, j in (("A", -1, -1), ("B", 1, -1), ("C", 1, 1), ("D", -1, 1)):
        world.contact(name, block.point(0.2 * i, 0.1 * j), world.plane(), mu=0.3, e_N=0.2)
    m.initial_state(q=[0, 0.5, 0.4], v=[0.5, 0, 1])
    mine = sg.build(m).simulate(t_end=1, dt=1e-2)
    theirs = sg.build(box.model()).simulate(t_end=1, dt=1e-2)
    assert mine.q == pytest.approx(theirs.q, abs=1e-12)

    if symbols == "sympy":
        return  # the joints below are in space with both
    m = sg.Model("box_3", symbols=symbols)
    space = Spatial(m, gravity=(0, 0, -G))
    body = space.body("box", 1.0, inertia.cuboid(1.0, 0.4, 0.3, 0.2))
    for k in range(8):
        i, j, n = (1 if k >> bit & 1 else -1 for bit in range(3))
        corner = body.point(0.2 * i, 0.15 * j, 0.1 * n)
        space.contact(f"C{k}", corner, space.plane(), mu=0.3, e_N=0.1)
    space.initial_state(q={"box_z": 0.5}, v={"box_x": 0.3}, attitude={"box": ((0.6, 0.8, 0), 0.4)})
    mine = sg.build(m, stages=2).simulate(t_end=0.4, dt=5e-3)
    theirs = sg.build(box_in_space.model(), stages=2).simulate(t_end=0.4, dt=5e-3)
    assert mine.q == pytest.approx(theirs.q, abs=1e-9)


def pendulum_angle(length: float, J: float, start: float, t_end: float) -> float:
    """Angle of a physical pendulum of mass 1 by Runge-Kutta, its centre at `length`."""
    w2 = G * length / (J + length**2)
    x, v, n = start, 0.0, 4000
    h = t_end / n
    for _ in range(n):
        k1 = v, -w2 * sin(x)
        k2 = v + h / 2 * k1[1], -w2 * sin(x + h / 2 * k1[0])
        k3 = v + h / 2 * k2[1], -w2 * sin(x + h / 2 * k2[0])
        k4 = v + h * k3[1], -w2 * sin(x + h * k3[0])
        x += h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        v += h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
    return x


@WORLDS
def test_planar_joints(symbols: str) -> None:
    """Two welded rods on a hinge and a slider are one compound pendulum; no drift."""
    m = sg.Model("joints", symbols=symbols)
    world = Planar(m, gravity=(0, -G))
    one = world.body("one", 0.5, inertia.rod(0.5, 0.4))
    two = world.body("two", 0.5, inertia.rod(0.5, 0.4))
    cart = world.body("cart", 3.0, 0.1)
    world.prismatic("rail", cart.point(), world.ground.point(), (1, 0))
    world.rigid("stop", cart.point(), world.ground.point())  # doubles the rail: redundant
    world.revolute("hinge", one.point(0, 0.2), cart.point())
    world.rigid("weld", two.point(0, 0.2), one.point(0, -0.2))
    a = 0.8
    s, c = sin(a), cos(a)
    m.initial_state(
        q={
            "one_x": 0.2 * s,
            "one_y": -0.2 * c,
            "one_phi": a,
            "two_x": 0.6 * s,
            "two_y": -0.6 * c,
            "two_phi": a,
        }
    )
    traj = sg.build(m, stages=3).simulate(t_end=1.0, dt=5e-3)
    # together a rod of length 0.8, mass 1
    assert traj["one_phi"][-1] == pytest.approx(
        pendulum_angle(0.4, inertia.rod(1.0, 0.8), a, 1.0), abs=1e-7
    )
    assert np.abs(traj.g).max() < 1e-12


@WORLDS
def test_spatial_joints(symbols: str) -> None:
    """A hinge about a skew axis is a pendulum under the component of gravity across the axis."""
    m = sg.Model("hinge", symbols=symbols)
    tilt = 0.5
    world = Spatial(m, gravity=(0, G * sin(tilt), -G * cos(tilt)))
    rod = world.body("rod", 0.5, (inertia.rod(0.5, 0.4), inertia.rod(0.5, 0.4), 1e-3))
    tip = world.body("tip", 0.5, (inertia.rod(0.5, 0.4), inertia.rod(0.5, 0.4), 1e-3))
    # the axis y carries the component of gravity along it
    world.revolute("hinge", rod.point(0, 0, 0.2), world.ground.point(), (0, 1, 0))
    world.rigid("weld", tip.point(0, 0, 0.2), rod.point(0, 0, -0.2))
    a = 0.8
    # turned about -y by a: the rod's lower end moves to +x
    world.initial_state(
        q={
            "rod_x": 0.2 * sin(a),
            "rod_z": -0.2 * cos(a),
            "tip_x": 0.6 * sin(a),
            "tip_z": -0.6 * cos(a),
        },
        attitude={"rod": ((0, -1, 0), a), "tip": ((0, -1, 0), a)},
    )
    traj = sg.build(m, stages=3).simulate(t_end=1.0, dt=1e-2)
    angle = np.arctan2(traj["tip_x"][-1], -traj["tip_z"][-1])
    # slower by sqrt(cos(tilt)): the same angle after a shorter time
    expected = pendulum_angle(0.4, inertia.rod(1.0, 0.8), a, sqrt(cos(tilt)))
    assert angle == pytest.approx(expected, abs=1e-6)
    assert np.abs(traj.g).max() < 1e-12


@WORLDS
def test_top_in_two_sets_of_coordinates(symbols: str) -> None:
    """Heavy top: quaternion and ball joint against Euler angles and no constraint."""
    mass, length, J = 0.2, 0.1, (1e-3, 1e-3, 4e-4)
    m = sg.Model("top_quaternion", symbols=symbols)
    world = Spatial(m, gravity=(0, 0, -G))
    top = world.body("top", mass, J)
    world.spherical("foot", top.point(0, 0, -length), world.ground.point())
    lean, spin = 0.4, 60.0
    world.initial_state(
        q={"top_x": length * sin(lean), "top_z": length * cos(lean)},
        attitude={"top": ((0, 1, 0), lean)},
        spin={"top": (0, 0, spin)},
    )
    heavy = sg.build(m, stages=3).simulate(t_end=0.5, dt=2e-3)

    m = sg.Model("top_angles", symbols=symbols)
    precession, nutation, roll = m.coordinates("precession nutation roll")
    world = Spatial(m, gravity=(0, 0, -G))
    first = world.frame("first", (0, 0, 1), precession)
    second = world.frame("second", (0, 1, 0), nutation, parent=first)
    body = world.frame("body", (0, 0, 1), roll, at=(0, 0, length), parent=second)
    world.body("top", mass, J, frame=body)
    m.initial_state(q={"nutation": lean}, v={"roll": spin})
    m.output("x", body.origin[0])
    m.output("y", body.origin[1])
    light = sg.build(m, stages=3).simulate(t_end=0.5, dt=2e-3)
    assert heavy["top_x"] == pytest.approx(light["x"], abs=2e-6)
    assert heavy["top_y"] == pytest.approx(light["y"], abs=2e-6)
    assert abs(light["y"][-1]) > 0.01  # it did precess


def test_cardan_joint() -> None:
    """Shafts at the angle beta: omega_2 = omega_1 cos(beta) / (1 - sin(beta)^2 sin(theta)^2)."""
    beta = 0.6
    m = sg.Model("cardan")
    world = Spatial(m)
    drive = world.body("drive", 1.0, (0.01, 0.01, 0.5))
    out = world.body("out", 1.0, (1e-4, 1e-4, 1e-5))
    # each shaft turns about its own z; that of the second is turned about x by beta
    tilted = world.frame("tilted", (1, 0, 0), beta)
    world.revolute("bearing_1", drive.point(), world.ground.point(), (0, 0, 1))
    world.revolute("bearing_2", out.point(), tilted.point(), (0, 0, 1))
    cross = drive.direction(1, 0, 0), out.direction(0, 1, 0)
    m.constraint("cross", sum(a * b for a, b in zip(*cross, strict=True)))
    # at theta = 0 the first arm lies on the axis of the angle, the second across it
    omega = 5.0
    world.initial_state(
        q={},
        attitude={"out": ((1, 0, 0), beta)},
        spin={"drive": (0, 0, omega), "out": (0, 0, omega * cos(beta))},
    )
    traj = sg.build(m, stages=3).simulate(t_end=0.6, dt=1e-3)
    f = numeric(m, [drive.spin[2], *out.components(out.spin), *drive.axes[0], *drive.axes[1]])
    for row in range(0, 601, 50):
        w_1, _, _, w_2, a, _, _, b, _, _ = f(traj.q[row], traj.v[row])
        theta = np.arctan2(b, a)
        assert w_2 == pytest.approx(w_1 * cos(beta) / (1 - (sin(beta) * sin(theta)) ** 2), rel=1e-9)
    # the same joint by its name: one equation more than the three of the point
    m = sg.Model("cardan_by_name")
    world = Spatial(m)
    one, two = world.body("one", 1.0, (1, 1, 1)), world.body("two", 1.0, (1, 1, 1))
    world.universal("joint", one.point(0, 0, 1), two.point(0, 0, -1), (1, 0, 0), (0, 1, 0))
    world.prismatic("slide", one.point(), world.ground.point(), (0, 0, 1))
    assert [len(g) for name, g in m.constraints if name in ("joint", "slide")] == [4, 5]


@WORLDS
def test_springs_dampers_actuators(symbols: str) -> None:
    """Power of every force element equals the loss of energy; torques have reactions."""
    m = sg.Model("elements", symbols=symbols)
    world = Planar(m, gravity=(0, -G))
    a, b = world.body("a", 1.2, 0.1), world.body("b", 0.7, 0.2)
    (push,) = m.inputs("push")
    world.spring(a.point(0.1, 0), b.point(0, 0.2), 30.0, 0.4, 2.0)
    world.spring(a.point(), world.ground.point(0, 1), 10.0)
    world.actuator(a.point(0.1, 0), b.point(0, 0.2), push)
    world.force(b.point(0.3, 0), (1.0, 2.0), local=True)
    world.torque(a, 3.0, against=b)
    world.torsion_spring(m.q[2] - m.q[5], m.v[2] - m.v[5], 4.0, 0.1, 0.5)
    m.initial_state(q=[0, 0, 0, 1, 0, 0])
    stepper = sg.build(m, stages=2)
    rng = np.random.default_rng(0)
    ends = numeric(
        m,
        [
            *(x for p in (a.point(0.1, 0), b.point(0, 0.2)) for x in (*p.position, *p.velocity)),
            *b.point(0.3, 0).velocity,
            *b.direction(1.0, 2.0),
        ],
    )
    for _ in range(5):
        q, v = rng.uniform(-1, 1, (2, 6))
        f = stepper.evaluate("f", t=0, q=q, v=v, u=[0.7])
        x = ends(q, v)
        r, r_dot = x[:2] - x[4:6], x[2:4] - x[6:8]
        along = r @ r_dot / np.linalg.norm(r)
        expected = (
            -2.0 * along**2
            + 0.7 * along
            + x[8:10] @ x[10:12]
            + 3.0 * (v[2] - v[5])
            - 0.5 * (v[2] - v[5]) ** 2
        )
        assert f @ v == pytest.approx(expected, rel=1e-12)
        energy = float(stepper.evaluate("energy", t=0, q=q, v=v))
        T = 1.2 * v[:2] @ v[:2] / 2 + 0.1 * v[2] ** 2 / 2
        T += 0.7 * v[3:5] @ v[3:5] / 2 + 0.2 * v[5] ** 2 / 2
        V = 1.2 * G * q[1] + 0.7 * G * q[4] + 15 * (np.linalg.norm(r) - 0.4) ** 2
        V += 5 * (q[0] ** 2 + (q[1] - 1) ** 2) + 2 * (q[2] - q[5] - 0.1) ** 2
        assert energy == pytest.approx(T + V, rel=1e-12)


@WORLDS
def test_contact_kinematics(symbols: str) -> None:
    """Every pair: the gap's rate is the normal velocity of the touching points."""
    m = sg.Model("pairs", symbols=symbols)
    world = Planar(m)
    a, b = world.body("a", 1.0, 1.0), world.body("b", 1.0, 1.0)
    pairs = {
        "point_plane": (a.point(0.2, 0.1), world.plane(b.point(0.1, 0), (0.6, 0.8))),
        "round_plane": (Round(a.point(0.1, 0), 0.3), world.plane(b.point(), (0, 1))),
        "round_round": (Round(a.point(0.1, 0), 0.3), Round(b.point(0, 0.2), 0.2)),
        "edge": (a.point(0.2, 0.1), Edge(b.point(-0.2, 0.1), b.point(0.3, 0.2), 0.1)),
    }
    gaps, rates = [], []
    for one, other in pairs.values():
        found = touch(world.algebra, one, other)
        assert found is not None
        gaps.append(found.gap)
        rates.append(found.normal[0] * found.velocity[0] + found.normal[1] * found.velocity[1])
    check_rates(m, gaps, rates)


@WORLDS
def test_contact_kinematics_in_space(symbols: str) -> None:
    m = sg.Model("pairs_3", symbols=symbols)
    world = Spatial(m)
    x = m.coordinates("x1 x2 x3 x4 x5 x6 x7")
    f = world.frame("f", (0, 0, 1), x[0], (x[1], x[2], 2 + x[3]))
    a = world.frame("a", (1, 0, 0), x[4], (0, 0.1, 0), f)
    b = world.frame("b", (0, 1, 0), x[5], (x[6], 0, 0))
    pairs = [
        (a.point(0.2, 0.1, 0.3), world.plane(b.point(0.1, 0, 0.2), (0.6, 0, 0.8))),
        (Round(a.point(0.1, 0, 0), 0.3), world.plane(b.point())),
        (Round(a.point(0.1, 0, 0), 0.3), Round(b.point(0, 0.2, 0), 0.2)),
        (Ellipsoid(a, (0.3, 0.2, 0.1)), world.plane(b.point())),
        (a.point(0.1, 0, 0), world.graph(lambda x, y: 0.3 * x**2 - 0.1 * x * y)),
    ]
    gaps, rates = [], []
    for k, (one, other) in enumerate(pairs):
        found = touch(world.algebra, one, other)
        assert found is not None
        rate: Any = sum(n * v for n, v in zip(found.normal, found.velocity, strict=True))
        if k == 4:
            # g = phi / |grad phi|: on the surface only; compare phi itself
            height = one.position[2] - 0.3 * one.position[0] ** 2
            height = height + 0.1 * one.position[0] * one.position[1]
            size = world.algebra.sqrt(
                1
                + (0.6 * one.position[0] - 0.1 * one.position[1]) ** 2
                + (0.1 * one.position[0]) ** 2
            )
            gaps.append(height)
            rates.append(rate * size)
            value = numeric(m, [found.gap - height / size])
            assert abs(value([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7], np.zeros(7))[0]) < 1e-15
        else:
            gaps.append(found.gap)
            rates.append(rate)
    check_rates(m, gaps, rates)


def check_rates(m: sg.Model, gaps: list[Any], rates: list[Any]) -> None:
    g, rate = numeric(m, gaps), numeric(m, rates)
    rng = np.random.default_rng(1)
    n = len(m.q)
    for _ in range(10):
        q, v = rng.uniform(-1, 1, (2, n))
        h = 1e-6
        difference = (g(q + h * v, v) - g(q - h * v, v)) / (2 * h)
        assert rate(q, v) == pytest.approx(difference, abs=1e-8)


def test_gears_roll() -> None:
    """Round on round without slip: R_1 omega_1 = -R_2 omega_2."""
    m = sg.Model("gears")
    world = Planar(m)
    a, b = world.body("a", 1.0, 0.02), world.body("b", 2.0, 0.3)
    world.revolute("axle_a", a.point(), world.ground.point(0, 0))
    world.revolute("axle_b", b.point(), world.ground.point(0.5, 0))
    world.rolling("mesh", Round(a.point(), 0.2), Round(b.point(), 0.3))
    world.torque(a, 0.4)
    m.initial_state(q={"b_x": 0.5})
    traj = sg.build(m, stages=2).simulate(t_end=1, dt=1e-2)
    ratio = 0.2 / 0.3
    assert traj["b_phi_dot"][-1] == pytest.approx(-ratio * traj["a_phi_dot"][-1], rel=1e-10)
    assert traj["a_phi_dot"][-1] == pytest.approx(0.4 / (0.02 + 0.3 * ratio**2), rel=1e-10)


def test_belt_drags() -> None:
    """A block on a running belt: accelerated by mu g up to the belt's speed."""
    m = sg.Model("belt")
    world = Planar(m, gravity=(0, -G))
    block = world.body("block", 2.0, 0.05)
    for name, i in (("left", -1), ("right", 1)):
        world.contact(name, block.point(0.2 * i, -0.1), world.plane(belt=(1.5, 0)), mu=0.25)
    m.initial_state(q={"block_y": 0.1})
    traj = sg.build(m, stages=2).simulate(t_end=1.0, dt=1e-2)
    assert traj["block_x_dot"][40] == pytest.approx(0.25 * G * 0.4, rel=1e-9)
    assert traj["block_x_dot"][-1] == pytest.approx(1.5, rel=1e-12)


def test_two_polygons_collide() -> None:
    """A block falls flat onto another: corners meet edges, momentum is shared, nothing overlaps."""
    m = sg.Model("two_blocks")
    world = Planar(m)
    sides = ((-1, 1), (1, 1), (1, -1), (-1, -1))
    shapes = []
    for name in ("a", "b"):
        body = world.body(name, 1.0, 0.01)
        half = 0.2 if name == "a" else 0.15
        shapes.append([body.point(half * i, 0.1 * j) for i, j in sides])
    world.polygons("pair", shapes[0], shapes[1], e_N=0.0)
    m.initial_state(q={"b_y": 0.5}, v={"b_y": -2})
    traj = sg.build(m, stages=2).simulate(t_end=0.5, dt=5e-3)
    assert traj["a_y_dot"][-1] == pytest.approx(-1, abs=1e-12)
    assert traj["b_y_dot"][-1] == pytest.approx(-1, abs=1e-12)
    assert np.min(traj["b_y"] - traj["a_y"]) > 0.2 - 1e-12


@settings(max_examples=200, deadline=None)
@given(st.floats(0, pi), st.floats(-pi, pi))
def test_tangents_stay_defined(polar: float, azimuth: float) -> None:
    """For every normal, poles included: unit, perpendicular, right-handed."""
    n = FRAMES([sin(polar) * cos(azimuth), sin(polar) * sin(azimuth), cos(polar)])
    normal, first, second = np.asarray(n).T
    assert np.linalg.norm(first) == pytest.approx(1, abs=1e-9)
    assert np.cross(first, second) == pytest.approx(normal, abs=1e-9)


def _frames() -> ca.Function:
    m = sg.Model("normal", symbols="casadi")
    n = m.coordinates("n_x n_y n_z")
    columns = [ca.vertcat(*n), *(ca.vertcat(*t) for t in tangents(algebra_of(m), n))]
    return ca.Function("frames", [ca.vertcat(*n)], [ca.horzcat(*columns)])


FRAMES = _frames()


def test_errors_say_what_to_do() -> None:
    m = sg.Model("wrong")
    world = Planar(m)
    body = world.body("a", 1.0, 1.0)
    with pytest.raises(sg.ModelError, match="no rule for Plane with Point"):
        world.contact("c", world.plane(), body.point())
    with pytest.raises(sg.ModelError, match="gravity: has 3 components"):
        Planar(sg.Model("g"), gravity=(0, 0, 1))
    with pytest.raises(ValueError, match="3 components given for a frame of dimension 2"):
        body.point(1, 2, 3)
    space = Spatial(sg.Model("s"))
    with pytest.raises(sg.ModelError, match="no body 'b' with a quaternion"):
        space.initial_state(q={}, spin={"b": (0, 0, 1)})
    one = space.body("one", 1.0, (1, 1, 1))
    with pytest.raises(sg.ModelError, match="Give three numbers"):
        space.revolute("r", one.point(), space.ground.point(), (space.model.q[0], 0, 1))
    assert isinstance(space.plane(), Plane)


def test_the_spin_of_a_body_is_that_of_its_axes() -> None:
    """dA/dt = spin x A for quaternions of length one and rates at right angles to them."""
    m = sg.Model("body", symbols="casadi")
    body = Spatial(m).body("body", 1.0, (1.0, 2.0, 2.5))
    q, v = ca.vertcat(*m.q), ca.vertcat(*m.velocities)
    axes = ca.vertcat(*(ca.horzcat(*row) for row in body.axes))
    rate = ca.reshape(ca.jacobian(ca.vec(axes), q) @ v, 3, 3)
    f = ca.Function("f", [q, v], [rate, ca.skew(ca.vertcat(*body.spin)) @ axes])
    rng = np.random.default_rng(5)
    for _ in range(20):
        p, p_dot = rng.normal(size=4), rng.normal(size=4)
        p /= np.linalg.norm(p)
        p_dot -= p * (p @ p_dot)
        found, expected = f(np.r_[0, 0, 0, p], np.r_[0, 0, 0, p_dot])
        np.testing.assert_allclose(np.array(found), np.array(expected), atol=1e-13)
