"""Bodies at rest, or nearly: forces that are the only ones, contacts that touch, percussions that
dependent rows leave open."""

from collections.abc import Callable

import numpy as np
import pytest
import signorini as sg
from signorini.bodies import Planar, Round, inertia
from signorini.models import box_in_space

Build = Callable[..., sg.Stepper]


def servo() -> sg.Model:
    """A mass driven onto a stop by friction of bound 10 N against a surface that runs away."""
    m = sg.Model("servo")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = v**2 / 4
    m.friction("servo", gamma_F=v + 3, bound=10.0)
    m.contact("stop", g_N=x)
    m.initial_state(q=[0.05], v=[-3])
    return m


def slot() -> sg.Model:
    """Two opposite walls without play, friction on both."""
    m = sg.Model("slot")
    _x, y = m.coordinates("x y")
    u, w = m.velocities
    m.lagrangian = (u**2 + w**2) / 2
    (push,) = m.parameters(push=5.0)
    m.force([push, -10])
    m.contact("bottom", g_N=y, gamma_F=u, mu=0.3)
    m.contact("top", g_N=-y, gamma_F=u, mu=0.3)
    m.initial_state(q=[0, 0], v=[-0.5, 0])
    return m


def braked_arm() -> sg.Model:
    """Two joints with dry friction and nothing else."""
    import sympy as sp

    m = sg.Model("braked_arm")
    a, b = m.coordinates("a b")
    wa, wb = m.velocities
    m.lagrangian = wa**2 + wb**2 / 2 + wa * wb * sp.cos(a - b) / 2
    m.friction("shoulder", gamma_F=wa, bound=0.4)
    m.friction("elbow", gamma_F=wb - wa, bound=0.1)
    m.initial_state(q=[0, 0.3], v=[1.0, -0.7])
    return m


def disc_by_a_wall() -> sg.Model:
    """A frictionless disc on the floor that touches a wall without pressing it."""
    m = sg.Model("disc_by_a_wall")
    world = Planar(m, gravity=(0, -9.81))
    (place,) = m.parameters(place=0.75)
    disc = Round(world.body("d", 1.0, inertia.disc(1.0, 0.1)).point(), 0.1)
    world.contact("floor", disc, world.plane())
    world.contact("wall", disc, world.plane(world.ground.point(place, 0), (-1, 0)))
    m.initial_state(q=[0.65, 0.1, 0])
    return m


def pyramid_between_walls() -> sg.Model:
    """Two discs and one on top, which touch each other and two walls; the walls carry nothing."""
    m = sg.Model("pyramid_between_walls")
    world = Planar(m, gravity=(0, -9.81))
    r = 0.1
    discs = [Round(world.body(n, 1.0, inertia.disc(1.0, r)).point(), r) for n in "abc"]
    for name, disc in zip("ab", discs, strict=False):
        world.contact(f"floor_{name}", disc, world.plane(), mu=0.6)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        world.contact(f"pair_{i}{j}", discs[i], discs[j], mu=0.6)
    world.contact("left", discs[0], world.plane(world.ground.point(-r, 0), (1, 0)))
    world.contact("right", discs[1], world.plane(world.ground.point(3 * r, 0), (-1, 0)))
    top = r + 3**0.5 * r
    m.initial_state(q=[0, r, 0, 2 * r, r, 0, r, top, 0])
    return m


def test_contacts_that_touch_without_force_cost_nothing(stepper: Build) -> None:
    """Their percussions are round-off of either sign, which Newton and the checker both let be."""
    traj = stepper(pyramid_between_walls, 2).simulate(t_end=1e-2, dt=1e-4)
    assert np.abs(traj.v).max() < 1e-10
    assert traj["floor_a.force_N"][-1] == pytest.approx(1.5 * 9.81, rel=1e-6)
    assert traj.iterations.sum() < 100  # 946 where the checker has no floor


@pytest.mark.parametrize("stages", [2, 3])
def test_a_bound_is_a_force(stages: int, stepper: Build) -> None:
    """The stop carries the whole bound, wherever in a step it is reached."""
    compiled = stepper(servo, stages)
    for x in np.linspace(0.0301, 0.0331, 7):
        traj = compiled.simulate(t_end=0.03, dt=1e-3, q0=[x])
        assert [traj.q[-1, 0], traj.v[-1, 0]] == pytest.approx([0, 0], abs=1e-12)
        assert traj["stop.force_N"][-1] == pytest.approx(10, rel=1e-9)
        assert traj["servo.force_F"][-1] == pytest.approx(-10, rel=1e-9)


@pytest.mark.parametrize("mass", [1.0, 1e-9])
def test_joints_coast_to_rest_and_stay(mass: float, stepper: Build) -> None:
    """Dry joints stop the arm; after that nothing acts, and velocities are zero for good."""
    compiled = stepper(braked_arm, 2)
    for v in np.random.default_rng(5).uniform(-2, 2, (6, 2)):
        traj = compiled.simulate(t_end=20, dt=0.01, v0=v * mass)
        assert np.abs(traj.v[-500:]).max() < 1e-12 * np.abs(v * mass).max()
        assert traj.energy[-1] <= 1e-20 * traj.energy[0]
        assert np.all(np.diff(traj.energy) <= 1e-13 * traj.energy[0])


@pytest.mark.parametrize("dt", [2e-3, 1e-4])
def test_a_wall_that_is_touched_does_not_stop_the_run(dt: float, stepper: Build) -> None:
    compiled = stepper(disc_by_a_wall, 3)
    for k in range(11, 66, 9):
        place = round(0.3 + 0.01 * k, 2)
        for x in (place - 0.1, np.nextafter(place - 0.1, 9)):
            traj = compiled.simulate(
                t_end=10 * dt, dt=dt, q0={"d_x": x}, parameters={"place": place}
            )
            assert np.abs(traj.q[-1] - traj.q[0]).max() < 1e-12
            assert traj["floor.force_N"][-1] == pytest.approx(9.81, rel=1e-9)
            assert np.abs(traj["wall.force_N"]).max() < 1e-6


@pytest.mark.parametrize("push", [0.5, 2.9, -2.5])
def test_a_body_that_sticks_in_a_slot(push: float, stepper: Build) -> None:
    """The least percussions in their cones: the lower wall carries weight and push."""
    traj = stepper(slot, 2).simulate(t_end=0.1, dt=1e-2, v0=[0, 0], parameters={"push": push})
    assert traj.P_N[1:] == pytest.approx(np.tile([0.1, 0], (10, 1)), abs=1e-12)
    assert traj.P_F[1:] == pytest.approx(np.tile([-push * 1e-2, 0], (10, 1)), abs=1e-12)
    assert np.all(traj.percussions[1:] == 1)


@pytest.mark.parametrize("stages", [2, 3])
def test_a_slot_presses_one_wall(stages: int, stepper: Build) -> None:
    """v = -0.5 stops at t = 0.0625 (8 m/s^2), a point of the grid; then 2 m/s^2.

    Of the two walls without play the lower one carries the weight, the upper one nothing: the
    least percussions that press. An internal stress would brake, too.
    """
    traj = stepper(slot, stages).simulate(t_end=1, dt=2.5e-3)
    assert traj["x"][-1] == pytest.approx(-0.015625 + 0.9375**2, abs=1e-12)
    assert traj.P_N[1:] / 2.5e-3 == pytest.approx(np.tile([10.0, 0.0], (400, 1)), abs=1e-9)
    both = traj["top.state"] != "open"
    assert both.sum() > 390
    assert set(traj.percussions[1:][both[1:]]) == {1}  # of least norm, and said so


def test_rest_costs_the_same_for_ever(stepper: Build) -> None:
    """Redundant percussions of a box on four corners do not creep: no step needs an iteration."""
    compiled = stepper(box_in_space.model, 2)
    fallen = compiled.simulate(t_end=3, dt=1e-3, every=100)
    traj = compiled.simulate(t_end=20, dt=1e-3, q0=fallen.q[-1], v0=fallen.v[-1], every=1000)
    assert np.all(traj.iterations[2:] == 0)
    share = 9.81 / 4 * compiled.parameters.get("mass", 1.0)
    floor = traj.P_N[2:] / np.diff(traj.t)[1:, None]
    assert floor[:, :4] == pytest.approx(np.full((len(floor), 4), share), rel=1e-9)
    assert traj.q[-1] == pytest.approx(traj.q[2], abs=1e-13)
