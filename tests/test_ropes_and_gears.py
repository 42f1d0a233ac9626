"""Ropes over pulleys, gears with play, pivots, tensors of inertia: against closed forms."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.bodies import Planar, Pulley, Spatial
from signorini.bodies.algebra import algebra_of
from signorini.bodies.ropes import way
from signorini.models import atwood, rattling_gears, string_pendulum

Build = Callable[..., sg.Stepper]
G = 9.81


def test_a_string_goes_slack_and_taut(stepper: Build) -> None:
    """With v^2 = 3.5 g l at the bottom it goes slack at 120 degrees, flies on a parabola, and loses
    the radial part of its velocity where the string is taut again."""
    run = stepper(string_pendulum.model, 3, events="located").simulate(
        events="located", dt=2e-3, t_end=1.2
    )
    slack = next(e for e in run.events if e.kind == "open")
    k = np.searchsorted(run.t, slack.t)
    angle = np.arctan2(run.q[k - 1, 0], -run.q[k - 1, 1])
    after = (run.v[k - 1, 0] * np.cos(angle) + run.v[k - 1, 1] * np.sin(angle)) / 0.7
    assert angle + after * (slack.t - run.t[k - 1]) == pytest.approx(2 * np.pi / 3, abs=3e-5)
    # the parabola from there, by hand: it is at the distance l again after t = 4 sin(120) v / g
    v = np.sqrt(0.5 * G * 0.7)
    taut = next(e for e in run.events if e.kind == "impact")
    assert taut.t - slack.t == pytest.approx(4 * np.sin(2 * np.pi / 3) * v / G, rel=1e-9)
    t = taut.t - slack.t
    start = 0.7 * np.array([np.sin(2 * np.pi / 3), -np.cos(2 * np.pi / 3)])
    place = start + v * np.array([-0.5, np.sin(2 * np.pi / 3)]) * t - np.array([0, G * t**2 / 2])
    speed = v * np.array([-0.5, np.sin(2 * np.pi / 3)]) - np.array([0, G * t])
    radial = speed @ place / 0.7
    assert pytest.approx(0.3 * radial, rel=1e-9) == taut.P_N
    assert taut.energy == pytest.approx(-0.3 * radial**2 / 2, rel=1e-9)


def tackle() -> sg.Model:
    """A load on a moving pulley, hauled by a weight over a fixed one."""
    m = sg.Model("tackle")
    world = Planar(m, gravity=(0, -G))
    load, weight = world.particle("load", 3.0), world.particle("weight", 1.8)
    r = 0.1
    path = [
        world.ground.point(-r, 0), Pulley(load, r, (0, -1), crossed=True),
        Pulley(world.ground.point(2 * r, 0.3), r, (0, 1)), weight,
    ]  # fmt: skip
    # down from the anchor, around below, up, around above, down: two half turns
    world.rope("rope", path, 1.0 + (1.0 + 0.3) + (0.3 + 0.5) + 2 * sp.pi * r)
    m.constraint("guides", [load.position[0], weight.position[0] - 3 * r])
    m.initial_state(q={"load_y": -1, "weight_y": -0.5, "weight_x": 3 * r})
    return m


def test_block_and_tackle(stepper: Build) -> None:
    """2 y_load + y_weight stays: a_load = (2 m_w - m_l) g / (m_l + 4 m_w)."""
    run = stepper(tackle, 2).simulate(dt=1e-2, t_end=0.3)
    a = (2 * 1.8 - 3.0) * G / (3.0 + 4 * 1.8)
    y = dict(zip(run.stepper.manifest["coordinates"], run.q[-1], strict=True))
    assert y["load_y"] == pytest.approx(-1 + a * 0.3**2 / 2, abs=1e-12)
    assert y["weight_y"] == pytest.approx(-0.5 - a * 0.3**2, abs=1e-12)
    tension = 3.0 * (G + a) / 2
    assert run["rope.force_N"][1:] == pytest.approx(tension, rel=1e-10)


def test_atwoods_machine_becomes_taut(stepper: Build) -> None:
    """The heavy one falls by the slack; both share its momentum, then the difference of weights."""
    run = stepper(atwood.model, 2, events="located").simulate(events="located", dt=1e-2, t_end=0.4)
    fall, t = np.sqrt(2 * G * 0.2), np.sqrt(0.4 / G)
    struck = next(e for e in run.events if e.kind == "impact")
    assert (struck.contact, struck.t) == ("rope", pytest.approx(t, abs=1e-12))
    assert pytest.approx(2.5 * 1.0 / 3.5 * fall, rel=1e-12) == struck.P_N
    v = 2.5 / 3.5 * fall + 1.5 / 3.5 * G * (0.4 - t)
    assert run.v[-1] == pytest.approx([0, v, 0, -v], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("crossed", [False, True])
def test_a_way_around_discs(crossed: bool) -> None:
    """Against straight parts that are at right angles to the radii where they end, found by
    solving for the four angles, and arcs between these."""
    from scipy.optimize import fsolve

    m = sg.Model("m")
    world = Planar(m)
    centers, radii = np.array([(0.0, 0.0), (1.3, 0.4)]), [0.3, 0.5]
    ends = np.array([(-1.0, -0.4), (2.1, 1.5) if crossed else (2.1, -0.9)])
    side = [1, -1 if crossed else 1]
    discs = [
        Pulley(world.ground.point(*centers[k]), radii[k], (0, side[k]), crossed and k == 0)
        for k in range(2)
    ]
    path = [world.ground.point(*ends[0]), *discs, world.ground.point(*ends[1])]
    length, corners = way(algebra_of(m), path)

    def corner(k: int, turn: float) -> np.ndarray:
        """On disc k, from `over` against the way by an angle."""
        at = side[k] * (np.pi / 2 + turn)
        return centers[k] + radii[k] * np.array([np.cos(at), np.sin(at)])

    def parts(turns: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        a, b, c, d = (corner(k // 2, turn) for k, turn in enumerate(turns))
        return [(ends[0], a), (b, c), (d, ends[1])]

    def slant(turns: np.ndarray) -> list[float]:
        (_, a), (b, c), (d, _) = lines = parts(turns)
        rays = [a - centers[0], b - centers[0], c - centers[1], d - centers[1]]
        ways = [lines[k][1] - lines[k][0] for k in (0, 1, 1, 2)]
        return [float(x @ y) for x, y in zip(rays, ways, strict=True)]

    turns = fsolve(slant, [0.6, -0.6, 0.6, -0.6], xtol=1e-14)
    assert np.max(np.abs(slant(turns))) < 1e-12
    arcs = radii[0] * (turns[0] - turns[1]) + radii[1] * (turns[2] - turns[3])
    straight = sum(np.linalg.norm(b - a) for a, b in parts(turns))
    assert arcs > 0
    assert float(length) == pytest.approx(straight + arcs, rel=1e-12)
    found = np.array([[float(x) for x in place] for place in corners])
    assert found == pytest.approx(np.array([x for part in parts(turns) for x in part]), abs=1e-12)


def test_gears_rattle_for_ever(stepper: Build) -> None:
    """250 elastic impacts of the flanks keep energy and momentum to round-off, and their time."""
    run = stepper(rattling_gears.model, 2, events="located").simulate(
        events="located", dt=1e-2, t_end=26
    )
    struck = [e.t for e in run.events if e.kind == "impact"]
    assert len(struck) >= 250
    assert np.diff(struck) == pytest.approx(0.01 / 0.1, rel=1e-9)  # the relative speed stays
    momentum = run.v[:, 0] / 0.1 - 4 * run.v[:, 1] / 0.25
    assert np.abs(momentum - 10).max() < 2e-14
    assert run.energy == pytest.approx(run.energy[0], rel=1e-13)


def test_couplings_without_play_are_constraints() -> None:
    m = sg.Model("m")
    x, phi = m.coordinates("x phi")
    m.coupling("rack", x - 0.2 * phi)
    assert [name for name, _ in m.constraints] == ["rack"]


@pytest.mark.thorough
def test_a_tensor_of_inertia_is_that_of_turned_axes(stepper: Build) -> None:
    """Free flight with principal moments, and the same body with its axes turned by 0.7 rad: the
    same motion of the fixed frame, angular velocity and momentum among the outputs."""
    c, s = np.cos(0.7), np.sin(0.7)
    A = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])  # body axes in components of principal ones
    J = np.diag([1.0, 2.0, 2.5])
    runs = []
    for tensor, turned in ((J.diagonal().tolist(), 0.0), ((A.T @ J @ A).round(14), 0.7)):

        def model(tensor: Any = tensor, turned: float = turned) -> sg.Model:
            m = sg.Model("free")
            world = Spatial(m)
            body = world.body("body", 1.0, tensor)
            world.outputs(body)
            spin = np.array([0.3, 2.0, 0.1])
            world.initial_state(
                q={}, attitude={"body": ((0, 0, 1), turned)},
                spin={"body": list(A.T @ spin if turned else spin)},
            )  # fmt: skip
            return m

        runs.append(sg.build(model(), stages=4).simulate(dt=1e-2, t_end=5))
    for letter in "xyz":
        for name in (f"body_omega_{letter}", f"body_L_{letter}"):
            assert runs[0][name] == pytest.approx(runs[1][name], abs=1e-7)
        L = runs[0][f"body_L_{letter}"]
        assert pytest.approx(L[0], abs=1e-7) == L


@pytest.mark.parametrize(
    ("tensor", "message"),
    [
        ([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]], "not symmetric"),
        ([[1, 0, 0], [0, 1, 0], [0, 0, 3]], r"principal moments \[1.0, 1.0, 3.0\]"),
        ([[1, 2, 0], [2, 1, 0], [0, 0, 1]], "must be positive"),
        ([[1, 0], [0, 1], [0, 0]], "2 components"),
    ],
)
def test_tensors_that_no_body_has(tensor: Any, message: str) -> None:
    with pytest.raises(sg.ModelError, match=message):
        Spatial(sg.Model("m")).body("body", 1.0, tensor)


def test_pins_and_paths_are_checked() -> None:
    m = sg.Model("m")
    world = Planar(m)
    bar = world.body("bar", 1.0, 0.1)
    world.pin("pivot", bar.point(-0.5, 0), (0, 0))
    assert [name for name, _ in m.constraints] == ["pivot"]
    with pytest.raises(sg.ModelError, match=r"rope 'r': its path is"):
        world.rope("r", [bar.point()], 1)
    with pytest.raises(sg.ModelError, match=r"radius of a pulley"):
        world.rope("r", [bar.point(), Pulley(world.ground.point(), -1, (0, 1))], 1)
    with pytest.raises(sg.ModelError, match=r"outputs.*'ground' is no body"):
        space = Spatial(sg.Model("s"))
        space.outputs(space.ground)
