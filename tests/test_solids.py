"""Solids in space: distances that MuJoCo measures, rates of gaps, bodies that come to rest."""

import itertools
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
import signorini as sg
from signorini.bodies import Box, Capsule, Cylinder, Ellipsoid, Frame, Round, Spatial, inertia
from signorini.codegen.composition import compose
from signorini.codegen.frontend.validate import freeze

Build = Callable[..., sg.Stepper]
INERTIA = (0.01, 0.02, 0.015)
SOLIDS: dict[str, tuple[Callable[[Frame], Any], str]] = {
    "ball": (
        lambda f: Round(f.point(0.02, 0.01, 0.03), 0.1),
        'type="sphere" pos=".02 .01 .03" size=".1"',
    ),
    "capsule": (
        lambda f: Capsule(f.point(0.01, 0, -0.2), f.point(0.01, 0, 0.2), 0.05),
        'type="capsule" pos=".01 0 0" size=".05 .2"',
    ),
    "box": (
        lambda f: Box(f.point(0, 0.02, 0.01), (0.2, 0.15, 0.1)),
        'type="box" pos="0 .02 .01" size=".2 .15 .1"',
    ),
    "cylinder": (
        lambda f: Cylinder(f.point(0, 0.02, 0.01), 0.1, 0.2),
        'type="cylinder" pos="0 .02 .01" size=".1 .2"',
    ),
}  # fmt: skip
PAIRS = (
    ("ball", "capsule"),
    ("capsule", "ball"),
    ("ball", "box"),
    ("box", "ball"),
    ("ball", "cylinder"),
    ("capsule", "capsule"),
    ("capsule", "box"),
    ("box", "capsule"),
)
RIGID = (*PAIRS, ("box", "box"))


def two(one: str, other: str, **laws: Any) -> tuple[sg.Model, Spatial]:
    model = sg.Model("two", symbols="casadi")
    world = Spatial(model, (0, 0, -9.81))
    frames = [world.body(name, 1.0, INERTIA) for name in "fg"]
    world.solids("c", *(SOLIDS[k][0](f) for k, f in zip((one, other), frames, strict=True)), **laws)
    return model, world


def poses(count: int, apart: float) -> np.ndarray:
    """Coordinates of two bodies, turned anyhow."""
    rng = np.random.default_rng(3)
    q = np.zeros((count, 14))
    q[:, 7:10] = rng.normal(size=(count, 3))
    q[:, 7:10] *= (
        apart * rng.uniform(0.2, 1, (count, 1)) / np.linalg.norm(q[:, 7:10], axis=1)[:, None]
    )
    for k in (3, 10):
        p = rng.normal(size=(count, 4))
        q[:, k : k + 4] = p / np.linalg.norm(p, axis=1)[:, None]
    return q


def kinematics(model: sg.Model) -> ca.Function:
    """Gaps, guards, rates of gaps, slips and their directions of all contacts."""
    q, v = ca.vertcat(*model.q), ca.vertcat(*model.velocities)
    gaps = ca.vertcat(*(ca.SX(c.g_N) for c in model.contacts))
    guards = ca.vertcat(*(ca.SX(1 if c.guard is None else c.guard) for c in model.contacts))
    rates = ca.jtimes(gaps, q, v)
    slips = ca.vertcat(*(ca.SX(x) for c in model.contacts for x in c.gamma_F))
    return ca.Function(
        "f", [q, v], [gaps, guards, rates, ca.jacobian(slips, v), ca.jacobian(gaps, q)]
    )


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_distances_are_those_of_mujoco(one: str, other: str) -> None:
    """The smallest gap of what exists is the distance, or the depth where a rule has one."""
    mujoco = pytest.importorskip("mujoco", reason="pip install 'signorini[robots]'")
    model, _ = two(one, other, mu=0.3)
    bodies = "".join(
        f'<body><freejoint/><geom {SOLIDS[k][1]} mass="1"/></body>' for k in (one, other)
    )
    m = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    d = mujoco.MjData(m)
    f = kinematics(model)
    seen = np.zeros(len(model.contacts), dtype=int)
    for q in poses(300 if len(seen) < 10 else 1500, 0.6):
        d.qpos[:] = q
        mujoco.mj_kinematics(m, d)
        distance = mujoco.mj_geomDistance(m, d, 0, 1, 2.0, None)
        gaps, guards, *_ = (np.asarray(x).ravel() for x in f(q, np.zeros(14)))
        there = np.where(guards >= 0, gaps, np.inf)
        if distance > 1e-3:  # iterations of MuJoCo's end early in depth
            assert there.min() == pytest.approx(distance, abs=2e-6)
            seen[there.argmin()] += 1
        elif -0.04 < distance < -1e-3:  # axes of capsules are outside
            assert there.min() < 0
    assert np.all(seen > 0)


def test_boxes_overlap_where_a_contact_of_theirs_is_closed() -> None:
    """As MuJoCo says, and nothing is closed where they are apart."""
    mujoco = pytest.importorskip("mujoco", reason="pip install 'signorini[robots]'")
    model, _ = two("box", "box", mu=0.3)
    bodies = f'<body><freejoint/><geom {SOLIDS["box"][1]} mass="1"/></body>' * 2
    m = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    d = mujoco.MjData(m)
    f = kinematics(model)
    overlaps = apart = 0
    for q in poses(1500, 0.6):
        d.qpos[:] = q
        mujoco.mj_kinematics(m, d)
        distance = mujoco.mj_geomDistance(m, d, 0, 1, 2.0, None)
        gaps, guards, *_ = (np.asarray(x).ravel() for x in f(q, np.zeros(14)))
        smallest = np.where(guards >= 0, gaps, np.inf).min()
        if -0.03 < distance < -1e-3:
            assert smallest < 0
            overlaps += 1
        elif distance > 1e-3:
            assert smallest > 0
            apart += 1
    assert min(overlaps, apart) > 50


@pytest.mark.parametrize(("one", "other"), [*RIGID, *((k, "plane") for k in SOLIDS)])
def test_slip_is_perpendicular_and_gaps_move_as_they_say(one: str, other: str) -> None:
    """Motions that leave the solids' common place alone: turned together they do not slip, moved
    along the normal the gap changes by that, along slip directions it does not."""
    if other == "plane":
        model = sg.Model("one", symbols="casadi")
        world = Spatial(model)
        world.body("f", 1.0, INERTIA)
        world_2 = SOLIDS[one][0](world.body("g", 1.0, INERTIA))
        world.solids("c", world_2, world.plane(), mu=0.3)
    else:
        model, world = two(one, other, mu=0.3)
    f = kinematics(model)
    rng = np.random.default_rng(5)
    for q in poses(40, 0.6):
        if other == "plane":
            q[9] += 1
        # both bodies turn and move as one
        omega, v0 = rng.normal(size=(2, 3))
        v = np.zeros(14)
        for k in (0, 7):
            p0, p1, p2, p3 = q[k + 3 : k + 7]
            E = np.array([[-p1, p0, -p3, p2], [-p2, p3, p0, -p1], [-p3, -p2, p1, p0]])
            v[k : k + 3] = v0 + np.cross(omega, q[k : k + 3])
            v[k + 3 : k + 7] = E.T @ omega / 2
        gaps, _, rates, W_F, g_q = (np.array(x) for x in f(q, v))
        n_rows = len(gaps)
        if other != "plane":
            np.testing.assert_allclose(rates, 0, atol=1e-11)
            np.testing.assert_allclose(W_F @ v, 0, atol=1e-11)
        # translations of the second body, and of the first against it
        normals, slips = g_q[:, 7:10], W_F[:, 7:10].reshape(n_rows, 2, 3)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=1e-10)
        np.testing.assert_allclose(np.einsum("ki,kdi->kd", normals, slips), 0, atol=1e-10)
        gram = np.einsum("kdi,kei->kde", slips, slips)
        np.testing.assert_allclose(gram, np.broadcast_to(np.eye(2), gram.shape), atol=1e-10)
        if other != "plane":
            np.testing.assert_allclose(g_q[:, :3], -normals, atol=1e-10)


@pytest.mark.parametrize(("one", "other"), RIGID)
def test_rates_follow_from_the_material_that_touches(one: str, other: str) -> None:
    """The normal component of what slips is the rate of the gap: of both bodies' spins, too."""
    f = kinematics(two(one, other, mu=0.3)[0])
    rng = np.random.default_rng(7)
    seen = 0
    for q in poses(20, 0.6):
        # a spin of one body about the normal through its contact changes no gap to first order;
        # a spin about an axis along a slip direction through the contact neither
        v = np.zeros(14)
        omega = rng.normal(size=3)
        p0, p1, p2, p3 = q[10:14]
        E = np.array([[-p1, p0, -p3, p2], [-p2, p3, p0, -p1], [-p3, -p2, p1, p0]])
        v[10:14] = E.T @ omega / 2
        gaps, guards, _, _, g_q = (np.array(x) for x in f(q, v))
        for k in np.flatnonzero(guards.ravel() >= 0):
            # edges of boxes are where they say as soon as they touch
            touching = q.copy()
            touching[7:10] -= float(gaps[k, 0]) * g_q[k, 7:10]
            closed, there, rates, W_F, directions = (np.array(x) for x in f(touching, v))
            if abs(closed[k, 0]) > 1e-9 or there[k, 0] < 0:
                continue  # other parts are nearest there
            seen += 1
            # place of the contact on the second body, from what spins do: omega x r
            n, slip = directions[k, 7:10], W_F[2 * k : 2 * k + 2, 7:10]
            found = [float(rates[k, 0]), *(W_F[2 * k : 2 * k + 2] @ v)]
            axes = np.vstack([n, slip])
            # components of omega x r in the frame of the contact; r follows from three spins
            rows, right = [], []
            for axis in np.eye(3):
                v_axis = np.zeros(14)
                v_axis[10:14] = E.T @ axis / 2
                moved = np.array([directions[k] @ v_axis, *(W_F[2 * k : 2 * k + 2] @ v_axis)])
                rows.append(axes @ np.cross(axis, np.eye(3)).T)
                right.append(moved)
            A, b = np.vstack(rows), np.concatenate(right)
            r, *_ = np.linalg.lstsq(A, b, rcond=None)
            np.testing.assert_allclose(A @ r, b, atol=1e-9)
            np.testing.assert_allclose(axes @ np.cross(omega, r), found, atol=1e-9)
    assert seen >= 10


def test_what_has_no_rule_is_refused() -> None:
    model = sg.Model("two", symbols="casadi")
    world = Spatial(model)
    f, g = (world.body(name, 1.0, INERTIA) for name in "fg")
    box, other = Box(f.point(), (0.1, 0.1, 0.1)), Cylinder(g.point(), 0.1, 0.1)
    with pytest.raises(sg.ModelError, match="no rule for Box with Cylinder"):
        world.solids("c", box, other)
    with pytest.raises(sg.ModelError, match=r"size in solids 'c': is -0\.1"):
        world.solids("c", Capsule(f.point(0, 0, 0), f.point(0, 0, 1), -0.1), world.plane())
    with pytest.raises(sg.ModelError, match="no rule for Ellipsoid with Round"):
        world.solids("c", Ellipsoid(f, (1, 1, 1)), Round(g.point(), 0.1))
    assert not model.contacts


def crossed() -> sg.Model:
    """A capsule on the ground, along y, and one above it, along x."""
    model = sg.Model("capsules", symbols="casadi")
    world = Spatial(model, (0, 0, -9.81))
    one, other = (world.body(name, 1.0, (0.02, 0.02, 0.001)) for name in "ab")
    lies, falls = (Capsule(f.point(0, 0, -0.2), f.point(0, 0, 0.2), 0.05) for f in (one, other))
    for name, body in (("low", lies), ("high", falls)):
        world.solids(name, body, world.plane(), mu=0.5)
    world.solids("pair", falls, lies, mu=0.5)
    world.initial_state(
        {"a_z": 0.05, "b_x": 0.05, "b_z": 0.2},
        attitude={"a": ((1, 0, 0), np.pi / 2), "b": ((0, 1, 0), np.pi / 2)},
    )
    return model


@pytest.mark.thorough
def test_a_capsule_comes_to_rest_across_another(stepper: Build) -> None:
    """It tips over the other until an end is on the ground: nothing penetrates, energy grows by no
    more than the error of rolling on (of order h^2 a step), and at rest the ground carries both."""
    traj = stepper(crossed, stages=2).simulate(t_end=3.0, dt=2e-3)
    assert traj.energy.max() < traj.energy[0] + 1e-9
    assert np.diff(traj.energy).max() < 1e-5
    assert traj.smallest_gap[1:].min() > -1e-8
    assert traj["pair_sides.P_N"].max() > 0
    ends = [f"{name}_{end}" for name in ("low", "high") for end in ("start", "end")]
    assert sum(traj[f"{e}.force_N"][-1] for e in ends) == pytest.approx(2 * 9.81, rel=1e-3)
    assert np.abs(traj.v[-1]).max() < 1e-3


def on_box() -> sg.Model:
    """A ball above a box on the ground."""
    model = sg.Model("on_box", symbols="casadi")
    world = Spatial(model, (0, 0, -9.81))
    base, ball = world.body("base", 2.0, INERTIA), world.body("ball", 1.0, INERTIA)
    box = Box(base.point(), (0.2, 0.15, 0.1))
    world.solids("floor", box, world.plane(), mu=0.5)
    world.solids("ball", Round(ball.point(), 0.05), box, mu=0.5)
    world.initial_state({"base_z": 0.1, "ball_z": 0.3, "ball_x": 0.02})
    return model


def test_a_ball_rests_on_a_box(stepper: Build) -> None:
    """Heights, and the forces of both contacts."""
    traj = stepper(on_box, stages=2).simulate(t_end=0.5, dt=5e-3)
    assert traj["ball_z"][-1] == pytest.approx(0.25, abs=1e-9)
    assert traj["ball.force_N"][-1] == pytest.approx(9.81, rel=1e-6)
    floor = sum(traj[f"floor_{k}.force_N"][-1] for k in range(8))
    assert floor == pytest.approx(3 * 9.81, rel=1e-6)


def on_each_other() -> sg.Model:
    """A turned box above a box on the ground."""
    model = sg.Model("on_each_other", symbols="casadi")
    world = Spatial(model, (0, 0, -9.81))
    base = world.body("base", 2.0, inertia.cuboid(2.0, 0.4, 0.3, 0.2))
    falls = world.body("falls", 1.0, inertia.cuboid(1.0, 0.2, 0.24, 0.18))
    low, high = Box(base.point(), (0.2, 0.15, 0.1)), Box(falls.point(), (0.1, 0.12, 0.09))
    world.solids("floor", low, world.plane(), mu=0.5)
    world.solids("ground", high, world.plane(), mu=0.5)
    world.solids("c", high, low, mu=0.5)
    world.initial_state(
        {"base_z": 0.1, "falls_z": 0.36, "falls_x": 0.03},
        attitude={"falls": ((0.3, 0.2, 0.9), 0.5)},
    )
    return model


def test_contacts_of_boxes_are_few_kinds() -> None:
    """Forty contacts of a pair, each a coupling of its own: four kinds, whatever the sizes."""
    found = compose(freeze(on_each_other()))
    kinds = [kind for part, kind in zip(found.parts, found.kind_of, strict=True) if part.couples]
    assert [kinds.count(k) for k in sorted(set(kinds))] == [8, 8, 12, 12]
    assert [part.name for part in found.parts if not part.couples] == ["base", "falls"]
    assert {len(part.contacts) for part in found.parts if part.couples} == {1}


@pytest.mark.thorough
def test_a_box_comes_to_rest_on_another(stepper: Build) -> None:
    """A corner strikes, it turns, and lies flat: what it presses with is its weight."""
    model = stepper(on_each_other, stages=2)
    traj = model.simulate(t_end=1.0, dt=2e-3)
    assert np.diff(traj.energy).max() < 1e-12
    assert traj.smallest_gap.min() > -1e-12
    assert np.abs(traj.v[-1]).max() < 1e-12
    assert traj["falls_z"][-1] == pytest.approx(0.29, abs=1e-9)
    force = {c: traj[f"{c}.force_N"][-1] for c in traj.contacts}
    between = sum(f for name, f in force.items() if name.startswith("c_"))
    assert between == pytest.approx(9.81, rel=1e-9)
    floor = sum(f for name, f in force.items() if name.startswith("floor"))
    assert floor == pytest.approx(3 * 9.81, rel=1e-9)


def pile() -> sg.Model:
    """Four boxes of other sizes, each turned anyhow, one above the other."""
    model = sg.Model("pile", symbols="casadi")
    world = Spatial(model, (0, 0, -9.81))
    rng = np.random.default_rng(1)
    boxes: list[Box] = []
    start, attitude = {}, {}
    for k in range(4):
        a, b, c = (float(x) for x in rng.uniform(0.08, 0.15, 3))
        mass = 8000 * a * b * c
        body = world.body(f"b{k}", mass, inertia.cuboid(mass, 2 * a, 2 * b, 2 * c))
        box = Box(body.point(), (a, b, c))
        world.solids(f"floor{k}", box, world.plane(), mu=0.5)
        for j, other in enumerate(boxes):
            world.solids(f"c{j}_{k}", other, box, mu=0.5)
        boxes.append(box)
        start |= {f"b{k}_x": 0.03 * (k % 3), f"b{k}_y": 0.02 * (k % 2), f"b{k}_z": 0.2 + 0.32 * k}
        attitude[f"b{k}"] = (tuple(rng.normal(size=3)), 0.3)
    world.initial_state(start, attitude=attitude)
    return model


@pytest.mark.slow
def test_a_pile_of_boxes_falls_down(stepper: Build) -> None:
    """It comes to rest on the ground without penetration, and no energy is gained."""
    traj = stepper(pile, stages=2).simulate(t_end=3.0, dt=2e-3)
    assert traj.smallest_gap.min() > -1e-9
    assert np.diff(traj.energy).max() < 1e-6 * traj.energy[0]
    assert np.abs(traj.v[-1]).max() < 1e-6
    assert traj.energy[-1] < 0.6 * traj.energy[0]


def test_pairs_are_all_there() -> None:
    """Every pair either has a rule, in both orders, or is refused in both."""
    for one, other in itertools.product(SOLIDS, repeat=2):
        outcomes = []
        for pair in ((one, other), (other, one)):
            try:
                outcomes.append(len(two(*pair)[0].contacts))
            except sg.ModelError:
                outcomes.append(0)
        assert outcomes[0] == outcomes[1]
        known = {*RIGID, ("ball", "ball")}
        assert (outcomes[0] > 0) == bool({(one, other), (other, one)} & known)
