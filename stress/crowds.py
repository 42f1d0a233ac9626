"""Scenes of many bodies, in the plane and in space: piles, walls, chains, pyramids, a bowl."""

from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import signorini as sg
from signorini.bodies import Planar, Point, Round, Spatial, inertia
from signorini.codegen.frontend.model import Model
from signorini.models import dominoes
from signorini.stress.scene import Case, Scene

G = 9.81
Rng = np.random.Generator


def _laws(m: Model) -> tuple[object, object]:
    mu, e_N = m.parameters(mu=sg.par(0.3, min=0), e_N=sg.par(0.2, min=0, max=1))
    return mu, e_N


def _law_values(rng: Rng, top: float = 1.5) -> dict[str, float]:
    return {
        "mu": float(rng.choice([0.0, *rng.uniform(0, top, 4)])),
        "e_N": float(rng.choice([0.0, 0.0, rng.uniform(), 1.0])),
    }


def _passive(par: dict[str, float]) -> bool:
    return par["e_N"] == 0 or par["mu"] == 0


# --- in the plane ---------------------------------------------------------------------------------


def discs_in_a_box(count: int) -> Model:
    """Discs whose radii differ up to three times, their masses ten times, in a container."""
    m = sg.Model(f"discs_in_a_box_{count}", symbols="casadi")
    mu, e_N = _laws(m)
    world = Planar(m, gravity=(0, -G))
    across = max(4, round(sqrt(count)))
    walls = (
        world.plane(),
        world.plane(world.ground.point(-0.15, 0), (1, 0)),
        world.plane(world.ground.point(0.3 * across, 0), (-1, 0)),
    )
    discs: list[Round] = []
    start: dict[str, float] = {}
    for k in range(count):
        R = (0.05, 0.1, 0.14)[k % 3]
        mass = 100 * R**2
        discs.append(Round(world.body(f"d{k}", mass, inertia.disc(mass, R)).point(), R))
        for name, wall in zip(("floor", "left", "right"), walls, strict=True):
            world.contact(f"{name}{k}", discs[k], wall, mu=mu, e_N=e_N)
        for j in range(k):
            world.contact(f"pair{j}_{k}", discs[j], discs[k], mu=mu, e_N=e_N)
        start |= {f"d{k}_x": 0.3 * (k % across), f"d{k}_y": 0.15 + 0.3 * (k // across)}
    m.initial_state(q=start)
    return m


def ten_discs() -> Model:
    return discs_in_a_box(10)


def thirty_discs() -> Model:
    return discs_in_a_box(30)


def discs_fall(rng: Rng, count: int = 10) -> Case:
    par = _law_values(rng)
    across = max(4, round(sqrt(count)))
    q = {}
    for k in range(count):
        q[f"d{k}_x"] = 0.3 * (k % across) + rng.uniform(-5e-3, 5e-3)
        q[f"d{k}_y"] = 0.15 + 0.3 * (k // across) + rng.uniform(0, 0.01)
    v = rng.normal(size=3 * count) * np.tile([0.5, 0.5, 3], count) * rng.choice([0.0, 1.0])
    return Case(float(rng.choice([1e-3, 5e-3])), q, v, par, passive=_passive(par))


def thirty_fall(rng: Rng) -> Case:
    return discs_fall(rng, 30)


def _add_box(
    world: Planar,
    outlines: list[list[Point]],
    half: tuple[float, float],
    mass: float,
    **laws: Any,
) -> None:
    """One more box, which touches the floor and all boxes before it."""
    k, (a, b) = len(outlines), half
    box = world.body(f"b{k}", mass, inertia.rectangle(mass, 2 * a, 2 * b))
    corners = [box.point(i * a, j * b) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    for i, corner in enumerate(corners):
        world.contact(f"floor{k}_{i}", corner, world.plane(), **laws)
    for j, other in enumerate(outlines):
        world.polygons(f"pair{j}_{k}", other, corners, **laws)
    outlines.append(corners)


def boxes_in_a_pile(count: int = 4) -> Model:
    """Boxes of two sizes that fall on each other and on a floor."""
    m = sg.Model("boxes_in_a_pile", symbols="casadi")
    mu, e_N = _laws(m)
    world = Planar(m, gravity=(0, -G))
    outlines: list[list[Point]] = []
    start: dict[str, float] = {}
    for k in range(count):
        a, b = ((0.2, 0.1), (0.1, 0.08))[k % 2]
        mass = 100 * a * b
        _add_box(world, outlines, (a, b), mass, mu=mu, e_N=e_N)
        start |= {f"b{k}_x": 0.05 * (k % 2), f"b{k}_y": 0.12 + 0.3 * k}
    m.initial_state(q=start)
    return m


def boxes_fall(rng: Rng) -> Case:
    par = _law_values(rng)
    q = {}
    for k in range(4):
        q[f"b{k}_x"] = rng.uniform(-0.15, 0.15)
        q[f"b{k}_y"] = 0.3 + 0.5 * k
        q[f"b{k}_phi"] = rng.uniform(-pi, pi)
    v = rng.normal(size=12) * np.tile([0.5, 0.5, 3], 4) * rng.choice([0.0, 1.0])
    return Case(float(rng.choice([1e-3, 5e-3])), q, v, par, passive=_passive(par))


def wall_of_blocks() -> Model:
    """Two columns of two blocks side by side, and a heavier block that flies into them."""
    m = sg.Model("wall_of_blocks", symbols="casadi")
    mu, e_N = _laws(m)
    world = Planar(m, gravity=(0, -G))
    outlines: list[list[Point]] = []
    start: dict[str, float] = {}
    places = [(0, 0.05), (0.21, 0.05), (0, 0.15), (0.21, 0.15), (-0.8, 0.12)]
    for k, (x, y) in enumerate(places):
        a, b = (0.1, 0.05) if k < 4 else (0.08, 0.08)
        mass = 1.0 if k < 4 else 4.0
        _add_box(world, outlines, (a, b), mass, mu=mu, e_N=e_N)
        start |= {f"b{k}_x": x, f"b{k}_y": y}
    m.initial_state(q=start)
    return m


def wall_hit(rng: Rng) -> Case:
    par = _law_values(rng, 1.0) | {"e_N": float(rng.choice([0.0, rng.uniform()]))}
    q = {"b4_x": rng.uniform(-0.5, -0.25), "b4_y": rng.uniform(0.09, 0.2)}
    q["b4_phi"] = float(rng.choice([0.0, rng.uniform(-pi, pi)]))
    if q["b4_phi"]:
        q["b4_y"] += 0.05
    v = {"b4_x": rng.uniform(1, 6), "b4_phi": rng.normal() * 3}
    return Case(2e-3, q, v, par, passive=_passive(par))


def links_of_a_chain(count: int = 8) -> Model:
    """A chain of rods in the plane that is thrown on a floor; its rods are bodies with joints."""
    m = sg.Model("chain_on_a_floor", symbols="casadi")
    mu, e_N = _laws(m)
    world = Planar(m, gravity=(0, -G))
    start: dict[str, float] = {}
    before = None
    for k in range(count):
        rod = world.body(f"r{k}", 0.1, inertia.rod(0.1, 0.2))
        if before is not None:
            world.revolute(f"joint{k}", before.point(0.1, 0), rod.point(-0.1, 0))
        ends = (("a", -0.1), ("b", 0.1)) if k == 0 else (("b", 0.1),)
        for word, x in ends:
            end = Round(rod.point(x, 0), 0.01)
            world.contact(f"floor{k}{word}", end, world.plane(), mu=mu, e_N=e_N)
        start |= {f"r{k}_x": 0.2 * k, f"r{k}_y": 0.5}
        before = rod
    m.initial_state(q=start)
    return m


def chain_lands(rng: Rng) -> Case:
    par = _law_values(rng)
    turn, height = rng.uniform(-0.5, 0.5), 0.02
    low = min(0.0, 1.6 * sin(turn))
    q: dict[str, float] = {}
    x, y = 0.0, height - low + rng.uniform(0, 0.2)
    for k in range(8):
        q |= {f"r{k}_x": x + 0.1 * cos(turn), f"r{k}_y": y + 0.1 * sin(turn), f"r{k}_phi": turn}
        x, y = x + 0.2 * cos(turn), y + 0.2 * sin(turn)
    v = np.tile([rng.normal(), rng.normal(), 0.0], 8)
    return Case(float(rng.choice([1e-3, 5e-3])), q, v, par, passive=_passive(par))


def eight_dominoes() -> Model:
    return dominoes.model(8)


def long_row(rng: Rng) -> Case:
    par = {
        "lean": rng.uniform(0.05, 0.4), "apart": rng.uniform(0.008, 0.025),
        "mu": rng.uniform(0, 0.8), "e_N": float(rng.choice([0.0, 0.0, rng.uniform(0, 0.6)])),
    }  # fmt: skip
    return Case(1e-3, None, {"d0_phi": -rng.uniform(0, 3)}, par)


# --- in space -------------------------------------------------------------------------------------


def _balls(m: Model, world: Spatial, radii: tuple[float, ...]) -> list[Round]:
    """Balls that touch each other."""
    mu, e_N = _laws(m)
    balls = []
    for k, R in enumerate(radii):
        mass = 1000 * R**3
        balls.append(Round(world.body(f"b{k}", mass, inertia.ball(mass, R)).point(), R))
        for j in range(k):
            world.contact(f"pair{j}_{k}", balls[j], balls[k], mu=mu, e_N=e_N)
    return balls


def standing(places: list[tuple[float, float, float]]) -> dict[str, float]:
    """Places of bodies b0, b1, ... that are not turned."""
    named = zip(range(len(places)), places, strict=True)
    q = {f"b{k}_{c}": x for k, place in named for c, x in zip("xyz", place, strict=True)}
    return q | {f"b{k}_p0": 1.0 for k in range(len(places))}


def _thrown(rng: Rng, count: int, speed: float = 0.5) -> dict[str, float]:
    still = rng.choice([0.0, 1.0])
    v = {f"b{k}_{c}": still * speed * rng.normal() for k in range(count) for c in "xyz"}
    spin = {f"b{k}_p{i}": still * rng.normal() * 2 for k in range(count) for i in (1, 2, 3)}
    return v | spin


PYRAMID = [
    *((0.1155 * cos(a), 0.1155 * sin(a), 0.1) for a in (0, 2 * pi / 3, 4 * pi / 3)),
    (0.0, 0.0, 0.1 + sqrt(0.04 - 0.1155**2)),
]


def pyramid_of_balls() -> Model:
    """Three balls on the ground and one on them."""
    m = sg.Model("pyramid_of_balls", symbols="casadi")
    world = Spatial(m, gravity=(0, 0, -G))
    balls = _balls(m, world, (0.1,) * 4)
    mu, e_N = m.par
    for k, ball in enumerate(balls):
        world.contact(f"floor{k}", ball, world.plane(), mu=mu, e_N=e_N)
    world.initial_state(q=standing(PYRAMID))
    return m


def pyramid(rng: Rng) -> Case:
    par = _law_values(rng)
    q = standing(PYRAMID)
    q["b3_z"] += float(rng.choice([0.0, rng.uniform(0, 0.2)]))
    v = _thrown(rng, 4, 0.3)
    return Case(float(rng.choice([1e-3, 5e-3])), q, v, par, passive=_passive(par))


def balls_in_a_trough() -> Model:
    """Three balls of two sizes in a V."""
    m = sg.Model("balls_in_a_v", symbols="casadi")
    world = Spatial(m, gravity=(0, 0, -G))
    balls = _balls(m, world, (0.1, 0.1, 0.07))
    mu, e_N = m.par
    for name, i in (("left", 1), ("right", -1)):
        wall = world.plane(world.ground.point(0, 0, 0), (0, i * 0.6, 0.8))
        for k, ball in enumerate(balls):
            world.contact(f"{name}{k}", ball, wall, mu=mu, e_N=e_N)
    world.initial_state(q=standing([(0.25 * k, 0, 0.2) for k in range(3)]))
    return m


def trough(rng: Rng) -> Case:
    par = _law_values(rng)
    places = [(0.21 * k + rng.uniform(0, 0.1), rng.uniform(-0.03, 0.03), 0.2) for k in range(3)]
    v = _thrown(rng, 3)
    return Case(float(rng.choice([1e-3, 5e-3])), standing(places), v, par, passive=_passive(par))


_BOWL = (0.1, 0.06, 0.08, 0.1, 0.06, 0.08)


def balls_in_a_bowl() -> Model:
    """Six balls of three sizes whose middles stay above a bowl."""
    m = sg.Model("balls_in_a_bowl", symbols="casadi")
    world = Spatial(m, gravity=(0, 0, -G))
    bowl = world.graph(lambda x, y: 0.5 * (x**2 + y**2))
    balls = _balls(m, world, _BOWL)
    mu, e_N = m.par
    for k, ball in enumerate(balls):
        world.contact(f"bowl{k}", ball.center, bowl, mu=mu, e_N=e_N)
    world.initial_state(q=standing(_above()))
    return m


def _above(rng: Rng | None = None) -> list[tuple[float, float, float]]:
    aside = np.zeros((6, 2)) if rng is None else rng.uniform(-0.02, 0.02, size=(6, 2))
    return [
        (0.3 * cos(pi * k / 3) + a, 0.3 * sin(pi * k / 3) + b, 0.25 + 0.05 * k)
        for k, (a, b) in enumerate(aside)
    ]


def bowl(rng: Rng) -> Case:
    par = _law_values(rng)
    q = standing(_above(rng))
    v = _thrown(rng, 6)
    return Case(float(rng.choice([1e-3, 5e-3])), q, v, par, passive=_passive(par))


def balls_on_rods() -> Model:
    """Four balls, neighbours joined by rods between their middles, that fall on the ground."""
    m = sg.Model("balls_on_rods", symbols="casadi")
    world = Spatial(m, gravity=(0, 0, -G))
    balls = _balls(m, world, (0.1, 0.08, 0.1, 0.08))
    mu, e_N = m.par
    for k, ball in enumerate(balls):
        world.contact(f"floor{k}", ball, world.plane(), mu=mu, e_N=e_N)
    for k in range(3):
        apart = [
            a - b
            for a, b in zip(balls[k].center.position, balls[k + 1].center.position, strict=True)
        ]
        m.constraint(f"rod{k}", apart[0] ** 2 + apart[1] ** 2 + apart[2] ** 2 - 0.09)
    world.initial_state(q=standing([(0.3 * k, 0, 0.3) for k in range(4)]))
    return m


def rods(rng: Rng) -> Case:
    par = _law_values(rng)
    places, turn = [(0.0, 0.0, rng.uniform(0.3, 0.5))], 0.0
    for _ in range(3):
        turn += rng.uniform(-1.2, 1.2)
        x, y, z = places[-1]
        places.append((x + 0.3 * cos(turn), y + 0.3 * sin(turn), z))
    v = {f"b{k}_x": 0.0 for k in range(4)} | {"b0_z": -rng.uniform(0, 1)}
    return Case(float(rng.choice([1e-3, 5e-3])), standing(places), v, par, passive=_passive(par))


CROWDS = (
    Scene("discs", "ten discs of three sizes fall into a box", ten_discs, discs_fall, 300, 1),
    Scene("discs_30", "thirty of them", thirty_discs, thirty_fall, 200, 0.1),
    Scene("boxes", "four boxes fall on each other", boxes_in_a_pile, boxes_fall, 300, 1),
    Scene("wall", "a block flies into a wall of blocks", wall_of_blocks, wall_hit, 300, 1),
    Scene("chain_lands", "a chain of eight rods lands", links_of_a_chain, chain_lands, 300, 1),
    Scene("long_row", "eight dominoes", eight_dominoes, long_row, 500, 1),
    Scene("pyramid", "four balls as a pyramid", pyramid_of_balls, pyramid, 200, 2),
    Scene("trough", "three balls in a V", balls_in_a_trough, trough, 300, 2),
    Scene("bowl", "six balls in a bowl", balls_in_a_bowl, bowl, 300, 1),
    Scene("rods", "four balls joined by rods fall", balls_on_rods, rods, 300, 2),
)
