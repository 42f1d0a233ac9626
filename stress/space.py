"""Scenes drawn without the solver in mind, most of them in space.

Rough friction, masses that differ up to 1000 times, any pair of coefficients of restitution, closed
loops at their stops, moving walls.
"""

from itertools import product
from math import cos, pi, sin, sqrt
from typing import Any

import casadi as ca
import numpy as np
import signorini as sg
from signorini.bodies import Ellipsoid, Planar, Point, Round, Spatial, inertia
from signorini.codegen.frontend.model import Model
from signorini.stress.crowds import PYRAMID, standing
from signorini.stress.scene import Case, Scene

G = 9.81
Rng = np.random.Generator


def _laws(m: Model) -> dict[str, Any]:
    mu, e_N, e_F = m.parameters(
        mu=sg.par(0.3, min=0), e_N=sg.par(0.2, min=0, max=1), e_F=sg.par(0.0, min=0, max=1)
    )
    return {"mu": mu, "e_N": e_N, "e_F": e_F}


def _law_values(rng: Rng) -> dict[str, float]:
    """Friction up to 2, both coefficients of restitution anywhere, in a third of the runs equal."""
    e_N = float(rng.choice([0.0, 0.0, rng.uniform(), 1.0]))
    return {
        "mu": float(rng.choice([0.0, *rng.uniform(0, 2, 4)])),
        "e_N": e_N,
        "e_F": float(rng.choice([e_N, 0.0, rng.uniform() if e_N else 0.0])),
    }


def _passive(par: dict[str, float]) -> bool:
    return (par["e_N"] == 0 and par["e_F"] == 0) or par["mu"] == 0


def _dt(rng: Rng, low: float = 1e-4, high: float = 2e-2) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _masses(m: Model, count: int) -> list[Any]:
    given = m.parameters(**{f"m{k}": sg.par(1.0, min=0) for k in range(count)})
    return list(given)


def _mass_values(rng: Rng, count: int) -> dict[str, float]:
    """Masses that differ up to a thousand times, in half of the runs not at all."""
    spread = float(rng.choice([0.0, 1.5]))
    return {f"m{k}": float(10 ** rng.uniform(-spread, spread)) for k in range(count)}


def _attitude(rng: Rng, body: str) -> dict[str, float]:
    p = rng.normal(size=4)
    p /= np.linalg.norm(p)
    return {f"{body}_p{i}": float(p[i]) for i in range(4)}


def _thrown(rng: Rng, names: list[str], speed: float, spin: float) -> dict[str, float]:
    still = float(rng.choice([0.0, 1.0]))
    v = {f"{b}_{c}": still * speed * rng.normal() for b in names for c in "xyz"}
    return v | {f"{b}_p{i}": still * spin * rng.normal() for b in names for i in (1, 2, 3)}


# --- balls ----------------------------------------------------------------------------------------


def _balls(
    m: Model, world: Spatial, radii: tuple[float, ...], laws: dict[str, Any], masses: list[Any]
) -> list[Round]:
    balls = []
    for k, (R, mass) in enumerate(zip(radii, masses, strict=True)):
        balls.append(Round(world.body(f"b{k}", mass, inertia.ball(mass, R)).point(), R))
        for j in range(k):
            world.contact(f"pair{j}_{k}", balls[j], balls[k], **laws)
    return balls


def graded_trough() -> Model:
    """Three balls of two sizes and any masses in a V."""
    m = sg.Model("graded_balls_in_a_v", symbols="casadi")
    laws, masses = _laws(m), _masses(m, 3)
    (alpha,) = m.parameters(alpha=sg.par(0.6, unit="rad", doc="slope of the walls"))
    world = Spatial(m, gravity=(0, 0, -G))
    balls = _balls(m, world, (0.1, 0.1, 0.07), laws, masses)
    for name, side in (("left", 1), ("right", -1)):
        wall = world.plane(world.ground.point(0, 0, 0), (0, side * ca.sin(alpha), ca.cos(alpha)))
        for k, ball in enumerate(balls):
            world.contact(f"{name}{k}", ball, wall, **laws)
    world.initial_state(q=standing([(0.25 * k, 0, 0.3) for k in range(3)]))
    return m


def in_the_trough(rng: Rng) -> Case:
    alpha = float(rng.uniform(0.3, 1.2))
    par = _law_values(rng) | _mass_values(rng, 3) | {"alpha": alpha}
    height = 0.1 / cos(alpha) + rng.uniform(0.0, 0.05, 3)
    places = [(0.205 * k, rng.uniform(-0.01, 0.01), float(height[k])) for k in range(3)]
    if rng.random() < 0.5:  # one above the others
        places[2] = (0.1, 0.0, float(height[2]) + 0.2)
    v = _thrown(rng, ["b0", "b1", "b2"], 0.5, 3)
    return Case(_dt(rng), standing(places), v, par, passive=_passive(par))


def graded_pyramid() -> Model:
    """Four balls of any masses as a pyramid."""
    m = sg.Model("graded_pyramid", symbols="casadi")
    laws, masses = _laws(m), _masses(m, 4)
    world = Spatial(m, gravity=(0, 0, -G))
    balls = _balls(m, world, (0.1,) * 4, laws, masses)
    for k, ball in enumerate(balls):
        world.contact(f"floor{k}", ball, world.plane(), **laws)
    world.initial_state(q=standing(PYRAMID))
    return m


def on_a_pyramid(rng: Rng) -> Case:
    par = _law_values(rng) | _mass_values(rng, 4)
    q = standing(PYRAMID)
    q["b3_z"] += float(rng.choice([0.0, rng.uniform(0, 0.2)]))
    v = _thrown(rng, ["b0", "b1", "b2", "b3"], 0.3, 1)
    return Case(_dt(rng), q, v, par, passive=_passive(par))


# --- boxes ----------------------------------------------------------------------------------------


def _corners(body: Any, a: float, b: float, c: float) -> list[Point]:
    return [body.point(i * a, j * b, k * c) for i, j, k in product((-1, 1), repeat=3)]


def stacked_boxes() -> Model:
    """A box on a box: corners touch the ground, corners of the upper one the lower one's top."""
    m = sg.Model("stacked_boxes", symbols="casadi")
    laws, (below, above) = _laws(m), _masses(m, 2)
    world = Spatial(m, gravity=(0, 0, -G))
    a, b, c = 0.2, 0.15, 0.05
    lower = world.body("b0", below, inertia.cuboid(below, 2 * a, 2 * b, 2 * c))
    upper = world.body("b1", above, inertia.cuboid(above, a, b, 2 * c))
    for k, corner in enumerate(_corners(lower, a, b, c)):
        world.contact(f"floor0_{k}", corner, world.plane(), **laws)
    for k, corner in enumerate(_corners(upper, a / 2, b / 2, c)):
        world.contact(f"floor1_{k}", corner, world.plane(), **laws)
        apart = [x - y for x, y in zip(corner.position, lower.point().position, strict=True)]
        x, y, z = (sum(d * e for d, e in zip(axis, apart, strict=True)) for axis in lower.axes)
        inside = ca.fmin(ca.fmin(a - ca.fabs(x), b - ca.fabs(y)), z)
        top = world.plane(lower.point(0, 0, c), (0, 0, 1))
        world.contact(f"on{k}", corner, top, guard=inside, **laws)
    world.initial_state(q=standing([(0, 0, c), (0, 0, 3 * c)]))
    return m


def boxes_stack(rng: Rng) -> Case:
    par = _law_values(rng) | _mass_values(rng, 2)
    drop = float(rng.choice([0.0, rng.uniform(0, 0.1)]))
    q = standing([(0, 0, 0.05), (rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 0.15 + drop)])
    half = rng.uniform(-pi, pi) / 2
    q |= {"b1_p0": cos(half), "b1_p3": sin(half)}
    v = _thrown(rng, ["b0", "b1"], 0.5, 1)
    return Case(_dt(rng), q, v, par, passive=_passive(par))


def pushed_box() -> Model:
    """A box on the ground beside a wall that moves to and fro, and a second wall that stands."""
    m = sg.Model("box_between_walls", symbols="casadi")
    laws = _laws(m)
    stroke, omega = m.parameters(
        stroke=sg.par(0.1, unit="m", doc="amplitude"), omega=sg.par(6.0, unit="rad/s", doc="rate")
    )
    world = Spatial(m, gravity=(0, 0, -G))
    a, b, c = 0.1, 0.08, 0.12
    box = world.body("b0", 2.0, inertia.cuboid(2.0, 2 * a, 2 * b, 2 * c))
    corners = _corners(box, a, b, c)
    wall = world.plane(world.ground.point(-0.3 + stroke * ca.sin(omega * m.time), 0, 0), (1, 0, 0))
    stands = world.plane(world.ground.point(0.5, 0, 0), (-1, 0, 0))
    for word, plane in (("floor", world.plane()), ("wall", wall), ("end", stands)):
        for k, corner in enumerate(corners):
            world.contact(f"{word}{k}", corner, plane, **laws)
    world.initial_state(q=standing([(0, 0, c)]))
    return m


def box_is_pushed(rng: Rng) -> Case:
    par = _law_values(rng)
    par |= {"stroke": float(rng.uniform(0.02, 0.25)), "omega": float(rng.uniform(2, 20))}
    q = standing([(0, 0, 0.12)])
    if rng.random() < 0.7:
        q |= _attitude(rng, "b0") | {"b0_z": float(rng.uniform(0.2, 0.5))}
    v = _thrown(rng, ["b0"], 1.0, 3)
    return Case(_dt(rng), q, v, par, t=0.0)


# --- coins, tables, linkages ----------------------------------------------------------------------


def coin_in_a_v() -> Model:
    """A coin between two walls and a floor."""
    m = sg.Model("coin_in_a_v", symbols="casadi")
    laws = _laws(m)
    (alpha,) = m.parameters(alpha=sg.par(0.8, unit="rad", doc="slope of the walls"))
    world = Spatial(m, gravity=(0, 0, -G))
    R, b, mass = 0.1, 0.02, 1.0
    coin = world.body("b0", mass, inertia.cylinder(mass, R, 2 * b))
    shape = Ellipsoid(coin, (R, R, b))
    world.contact("floor", shape, world.plane(), **laws)
    for name, side in (("left", 1), ("right", -1)):
        wall = world.plane(
            world.ground.point(0, -side * 0.06, 0), (0, side * ca.sin(alpha), ca.cos(alpha))
        )
        world.contact(name, shape, wall, **laws)
    world.initial_state(q=standing([(0, 0, 0.4)]))
    return m


def coin_falls(rng: Rng) -> Case:
    par = _law_values(rng) | {"alpha": float(rng.uniform(0.2, 1.45))}
    q = standing([(0, rng.uniform(-0.03, 0.03), 0.4)]) | _attitude(rng, "b0")
    v = _thrown(rng, ["b0"], 1.0, 5)
    return Case(_dt(rng), q, v, par, passive=_passive(par))


def jointed_table() -> Model:
    """A plate on four legs with hinges; each leg ends in a foot, hinges have stops."""
    m = sg.Model("jointed_table", symbols="casadi")
    laws = _laws(m)
    world = Spatial(m, gravity=(0, 0, -G))
    plate = world.body("b0", 5.0, inertia.cuboid(5.0, 0.8, 0.6, 0.04))
    length = 0.5
    for k, (i, j) in enumerate(product((-1, 1), repeat=2), 1):
        leg = world.body(f"b{k}", 0.5, inertia.cuboid(0.5, 0.04, 0.04, length))
        world.revolute(
            f"hinge{k}", plate.point(0.4 * i, 0.3 * j, 0), leg.point(0, 0, length / 2), (0, 1, 0)
        )
        world.contact(f"foot{k}", leg.point(0, 0, -length / 2), world.plane(), **laws)
        # the leg turns by no more than 0.3 rad either way
        along = leg.axes[2]
        aside = sum(x * y for x, y in zip(plate.axes[0], along, strict=True))
        m.contact(f"out{k}", g_N=sin(0.3) - aside, e_N=laws["e_N"])
        m.contact(f"in{k}", g_N=sin(0.3) + aside, e_N=laws["e_N"])
    for k, (i, j) in enumerate(product((-1, 1), repeat=2)):
        world.contact(f"edge{k}", plate.point(0.4 * i, 0.3 * j, 0), world.plane(), **laws)
    places = [(0.0, 0.0, length)]
    places += [(0.4 * i, 0.3 * j, length / 2) for i, j in product((-1, 1), repeat=2)]
    world.initial_state(q=standing(places))
    return m


def table_lands(rng: Rng) -> Case:
    par = _law_values(rng)
    lift = float(rng.choice([0.0, rng.uniform(0, 0.2)]))
    places = [(0.0, 0.0, 0.5 + lift)]
    places += [(0.4 * i, 0.3 * j, 0.25 + lift) for i, j in product((-1, 1), repeat=2)]
    push = rng.normal(size=3) * [1, 1, 0.2] * rng.choice([0.0, 1.0])
    v = {f"b{k}_{c}": float(x) for k in range(5) for c, x in zip("xyz", push, strict=True)}
    return Case(_dt(rng), standing(places), v, par, passive=_passive(par))


def loop_at_its_stops() -> Model:
    """A four-bar of three rods in the plane that falls between stops; its crank has two stops."""
    m = sg.Model("loop_at_its_stops", symbols="casadi")
    laws, masses = _laws(m), _masses(m, 3)
    world = Planar(m, gravity=(0, -G))
    lengths = (0.2, 0.5, 0.4)
    rods = [
        world.body(f"r{k}", mass, inertia.rod(mass, length))
        for k, (mass, length) in enumerate(zip(masses, lengths, strict=True))
    ]
    ends = [
        (rod.point(-h / 2, 0), rod.point(h / 2, 0)) for rod, h in zip(rods, lengths, strict=True)
    ]
    world.revolute("crank", ends[0][0], world.ground.point(0, 0))
    world.revolute("knee", ends[1][0], ends[0][1])
    world.revolute("elbow", ends[2][0], ends[1][1])
    world.revolute("pivot", ends[2][1], world.ground.point(0.5, 0))
    low = world.plane(world.ground.point(0, -0.12), (0, 1))
    high = world.plane(world.ground.point(0, 0.45), (0, -1))
    for name, point in (("knee", ends[0][1]), ("elbow", ends[2][0])):
        world.contact(f"{name}_low", point, low, **laws)
        world.contact(f"{name}_high", point, high, **laws)
    m.initial_state(q=_closed(1.0))
    return m


def _closed(crank: float) -> dict[str, float]:
    a, b, c, d = 0.2, 0.5, 0.4, 0.5
    knee = np.array([a * cos(crank), a * sin(crank)])
    pivot = np.array([d, 0.0])
    away = pivot - knee
    far = float(np.hypot(*away))
    along = (b**2 - c**2 + far**2) / (2 * far)
    across = sqrt(b**2 - along**2)
    unit = away / far
    elbow = knee + along * unit + across * np.array([-unit[1], unit[0]])
    q: dict[str, float] = {}
    pairs = ((np.zeros(2), knee), (knee, elbow), (elbow, pivot))
    for k, (start, end) in enumerate(pairs):
        x, y = (start + end) / 2
        way = end - start
        q |= {f"r{k}_x": x, f"r{k}_y": y, f"r{k}_phi": float(np.arctan2(way[1], way[0]))}
    return q


def loop_falls(rng: Rng) -> Case:
    par = _law_values(rng) | _mass_values(rng, 3)
    q = _closed(float(rng.uniform(-0.5, 1.5)))
    return Case(
        _dt(rng, high=1e-2), q, {"r0_phi": float(rng.normal() * 6)}, par, passive=_passive(par)
    )


SPACE = (
    Scene(
        "graded_trough", "three balls of any masses in a V", graded_trough, in_the_trough, 300, 2
    ),
    Scene("graded_pyramid", "four of them", graded_pyramid, on_a_pyramid, 200, 2),
    Scene("boxes_stack", "a box on a box", stacked_boxes, boxes_stack, 200, 1),
    Scene("box_pushed", "a box between walls, one moves", pushed_box, box_is_pushed, 300, 1),
    Scene("coin_in_v", "a coin between walls", coin_in_a_v, coin_falls, 300, 2),
    Scene("jointed_table", "a table with hinged legs", jointed_table, table_lands, 200, 1),
    Scene("loop_stops", "a four-bar at its stops", loop_at_its_stops, loop_falls, 300, 2),
)
