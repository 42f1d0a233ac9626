"""Polygons and edges: rest, no penetration, no energy from nothing, whatever the widths are."""

from collections.abc import Sequence

import numpy as np
import pytest
import signorini as sg
from hypothesis import given, settings
from hypothesis import strategies as st
from signorini.bodies import Edge, Planar, inertia
from signorini.bodies.polygons import outline

G = 9.81


def rectangle(body: object, width: float, height: float, clockwise: bool = True) -> list[object]:
    corners = [(-1, -1), (-1, 1), (1, 1), (1, -1)]
    if not clockwise:
        corners.reverse()
    return [body.point(i * width / 2, j * height / 2) for i, j in corners]  # type: ignore[attr-defined]


def stack(widths: Sequence[float], offsets: Sequence[float], drop: float) -> sg.Model:
    """Boxes of the given widths on the floor and on each other, each dropped a little."""
    m = sg.Model("stack", symbols="casadi")
    world = Planar(m, gravity=(0, -G))
    start: dict[str, float] = {}
    below = None
    for k, (width, offset) in enumerate(zip(widths, offsets, strict=True)):
        mass = 2.0 * width
        body = world.body(f"b{k}", mass, inertia.rectangle(mass, width, 0.2))
        corners = rectangle(body, width, 0.2, clockwise=bool(k % 2))
        if below is None:
            for i, corner in enumerate(corners):
                world.contact(f"floor{i}", corner, world.plane(), mu=0.5)
        else:
            world.polygons(f"pair{k}", below, corners, mu=0.5)
        start |= {f"b{k}_x": offset, f"b{k}_y": 0.1 + k * (0.2 + drop)}
        below = corners
    m.initial_state(q=start)
    return m


def depth(lower: np.ndarray, upper: np.ndarray, w_lower: float, w_upper: float) -> np.ndarray:
    """How deep two rectangles of height 0.2 overlap, pose by pose: by separating axes in NumPy."""
    found = []
    for (x, y, a), (u, v, b) in zip(lower, upper, strict=True):
        shapes = []
        for (c, d, angle), w in (((x, y, a), w_lower), ((u, v, b), w_upper)):
            R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            local = np.array([[-w, -0.2], [w, -0.2], [w, 0.2], [-w, 0.2]]) / 2
            shapes.append((local @ R.T + [c, d], R))
        gaps = []
        for _, R in shapes:
            for axis in R.T:
                one, other = (corners @ axis for corners, _ in shapes)
                gaps.append(max(one.min() - other.max(), other.min() - one.max()))
        found.append(-max(gaps))
    return np.array(found)


@pytest.mark.parametrize(
    ("seed", "stages"),
    [(0, 2), *(pytest.param(k, 2 + k % 2, marks=pytest.mark.slow) for k in range(1, 24))],
)
def test_random_stacks_come_to_rest(seed: int, stages: int) -> None:
    """Widths that are nearly or exactly equal among them; the centre of mass above each support."""
    rng = np.random.default_rng(seed)
    first = rng.uniform(0.5, 1.5)
    widths = [first]
    offsets = [0.0]
    for _ in range(2):
        share = rng.choice([1.0, 1 - 1e-9, 0.97, rng.uniform(0.4, 1.6)])
        widths.append(widths[-1] * share)
        reach = 0.2 * min(widths[-1], widths[-2])
        offsets.append(offsets[-1] + rng.choice([0.0, rng.uniform(-reach, reach)]))
    traj = sg.build(stack(widths, offsets, 0.01), stages=stages).simulate(t_end=1.0, dt=2e-3)
    poses = [traj.q[:, 3 * k : 3 * k + 3] for k in range(3)]
    for k in (1, 2):
        assert depth(poses[k - 1], poses[k], widths[k - 1], widths[k]).max() < 1e-5
    assert np.all(traj.energy <= traj.energy[0] + 1e-9)
    assert np.abs(traj.v[-1]).max() < 1e-6
    for k in range(3):
        assert traj.q[-1, 3 * k + 1] == pytest.approx(0.1 + 0.2 * k, abs=1e-5)
        assert traj.q[-1, 3 * k] == pytest.approx(offsets[k], abs=2e-3)


@pytest.mark.parametrize("dt", [1e-2, 3e-2])
def test_a_tilted_box_lands_on_a_ledge(dt: float) -> None:
    """It overhangs: the end of the lower edge meets its face in the step that turns it flat."""
    stepper = sg.build(stack((0.5, 0.5), (0, 0.2), 0.01), stages=2)
    for tilt in (0.1, -0.1, 0.02, -0.02):
        q = stepper.initial_state()[1]
        q[4] += 0.3 * abs(tilt)
        q[5] = tilt
        traj = stepper.simulate(t_end=1.0, dt=dt, q0=q)
        assert depth(traj.q[:, :3], traj.q[:, 3:], 0.5, 0.5).max() < 1e-9
        assert traj.q[-1, [4, 5]] == pytest.approx([0.3, 0], abs=2e-3)


def test_a_point_near_the_rim_stays_on_the_table() -> None:
    """The side face does not claim a point on top that is nearer to the rim than its depth."""
    m = sg.Model("table")
    world = Planar(m, gravity=(0, -G))
    ground, p = world.ground, world.particle("p", 1.0)
    world.contact("top", p, Edge(ground.point(-1, 1), ground.point(0, 1), 0.1))
    world.contact("side", p, Edge(ground.point(0, 1), ground.point(0, 0), 0.1))
    m.initial_state(q={"p_x": -0.08, "p_y": 1.05})
    compiled = sg.build(m, stages=2)
    traj = compiled.simulate(t_end=1, dt=1e-3)
    assert traj.q[-1] == pytest.approx([-0.08, 1], abs=1e-9)
    assert set(traj["side.state"][1:]) == {"open"}
    # in front of the side face a point that flies against it is stopped there
    traj = compiled.simulate(t_end=0.1, dt=1e-3, q0=[0.05, 0.5], v0=[-2, 0])
    assert traj["p_x"].min() > -1e-9
    assert traj["p_x"][-1] == pytest.approx(0, abs=1e-9)


def test_a_notch_stays_on_its_peg() -> None:
    """A hanger with a notch, not convex, hangs on a peg: three contacts, none outside the notch."""
    m = sg.Model("hanger", symbols="casadi")
    world = Planar(m, gravity=(0, -G))
    hanger = world.body("h", 1.0, 0.1)
    outer = (
        (-0.3, 0.2),
        (0.3, 0.2),
        (0.3, -0.2),
        (0.1, -0.2),
        (0.1, 0.0),
        (-0.1, 0.0),
        (-0.1, -0.2),
    )
    corners = [hanger.point(*c) for c in (*outer, (-0.3, -0.2))]
    peg = [world.ground.point(*c) for c in ((-0.08, -0.3), (-0.08, 0.0), (0.08, 0.0), (0.08, -0.3))]
    world.polygons("peg", corners, peg, mu=0.4)
    m.initial_state(q={"h_y": 0.02, "h_x": 0.01})
    traj = sg.build(m, stages=2).simulate(t_end=1, dt=2e-3)
    assert traj["h_y"][-1] == pytest.approx(0, abs=1e-6)
    assert traj["h_phi"][-1] == pytest.approx(0, abs=1e-6)
    assert traj["h_y"].min() > -1e-6
    assert np.all(traj.energy <= traj.energy[0] + 1e-9)


def star(radii: list[float]) -> list[tuple[float, float]]:
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    return [(r * np.cos(a), r * np.sin(a)) for r, a in zip(radii, angles, strict=True)]


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.3, 2.0), min_size=3, max_size=9), st.booleans())
def test_convex_pieces_make_up_the_polygon(radii: list[float], turned: bool) -> None:
    """Star-shaped polygons in either order: pieces are convex, and their areas add up."""
    places = star(radii)
    m = sg.Model("star", symbols="casadi")
    body = Planar(m).body("b", 1.0, 1.0)
    corners = [body.point(*c) for c in (places[::-1] if turned else places)]
    shape = outline(m, "star", corners)

    def area(points: Sequence[Sequence[float]]) -> float:
        x, y = np.array(points, dtype=float).T
        return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2

    own = [c.place for c in shape.corners]
    total = 0.0
    for piece in shape.pieces:
        points = [own[k] for k in piece]
        total += area(points)
        for k in range(len(points)):
            assert area([points[k - 2], points[k - 1], points[k]]) >= -1e-9
    assert total == pytest.approx(abs(area(places)), rel=1e-9)
    assert sorted({k for piece in shape.pieces for k in piece}) == sorted(range(len(radii)))


def test_corners_that_bound_no_polygon() -> None:
    m = sg.Model("wrong")
    world = Planar(m)
    body, other = world.body("a", 1.0, 1.0), world.body("b", 1.0, 1.0)
    cases = (
        ([body.point(0, 0), body.point(1, 0)], "2 corners"),
        ([body.point(0, 0), body.point(1, 0), other.point(0, 1)], "several frames"),
        ([body.point(0, 0), body.point(1, 0), body.point(2, 0)], "no area"),
        ([body.point(0, 0), body.point(1, 1), body.point(1, 0), body.point(0, 1)], "cross"),
        ([body.point(0, 0), body.point(m.q[0], 0), body.point(0, 1)], "depends on"),
    )
    for corners, words in cases:
        with pytest.raises(sg.ModelError, match=words):
            outline(m, "polygon", corners)
