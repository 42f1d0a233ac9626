"""Models of many bodies between which contacts may act."""

import numpy as np
import signorini as sg
from signorini.bodies import Edge, Planar, Round, inertia

RADIUS = 0.1


def row_of_discs(count: int = 6) -> sg.Model:
    """Equal discs in the plane, without weight; a floor below the last one alone."""
    m = sg.Model("row_of_discs", symbols="casadi")
    mu, e_N, e_floor, grav = m.parameters(
        mu=sg.par(0.0, min=0),
        e_N=sg.par(1.0, min=0, max=1),
        e_floor=sg.par(0.5, min=0, max=1),
        grav=sg.par(0.0),
    )
    world = Planar(m, gravity=(0, -grav))
    discs = []
    start = {}
    for k in range(count):
        body = world.body(f"d{k}", 1.0, inertia.disc(1.0, RADIUS))
        discs.append(Round(body.point(), RADIUS))
        start |= {f"d{k}_x": k * 1.0, f"d{k}_y": 1.0}
    for i in range(count):
        for j in range(i):
            world.contact(f"c{j}_{i}", discs[j], discs[i], mu=mu, e_N=e_N)
    world.contact("floor", discs[-1], world.plane(), mu=mu, e_N=e_floor)
    m.initial_state(q=start)
    return m


RADII = (0.1, 0.1, 0.14, 0.1, 0.14)


def crowd(count: int = 5) -> sg.Model:
    """Discs of two sizes, a box beside them, a linkage of two bodies that reaches them, on a floor;
    a hinge that rubs, and a motor."""
    m = sg.Model("crowd", symbols="casadi")
    mu, e_N = m.parameters(mu=sg.par(0.3, min=0), e_N=sg.par(0.2, min=0, max=1))
    world = Planar(m, gravity=(0, -9.81))
    (push,) = m.inputs("push")
    start: dict[str, float] = {}
    discs = []
    for k, R in enumerate(RADII[:count]):
        body = world.body(f"d{k}", 2.0 * R, inertia.disc(2.0 * R, R))
        discs.append(Round(body.point(), R))
        world.contact(f"floor{k}", discs[-1], world.plane(), mu=mu, e_N=e_N)
        start |= {f"d{k}_x": 2.0 + 0.27 * k, f"d{k}_y": 0.3 + 0.25 * (k % 2)}
    box = world.body("box", 1.0, inertia.rectangle(1.0, 0.4, 0.2))
    corners = [box.point(x, y) for x, y in ((-0.2, -0.1), (0.2, -0.1), (0.2, 0.1), (-0.2, 0.1))]
    for j, corner in enumerate(corners):
        world.contact(f"box_floor{j}", corner, world.plane(), mu=mu, e_N=0)
    start |= {"box_x": 1.6, "box_y": 0.3, "box_phi": 0.2}
    upper = world.body("upper", 0.5, inertia.rod(0.5, 0.4))
    lower = world.body("lower", 0.5, inertia.rod(0.5, 0.4))
    pivot = zip(upper.point(-0.2, 0).position, (3.4, 1.0), strict=True)
    m.constraint("pivot", [a - b for a, b in pivot])
    hinge = zip(upper.point(0.2, 0).position, lower.point(-0.2, 0).position, strict=True)
    m.constraint("hinge", [a - b for a, b in hinge])
    rates = dict(zip(m.coordinate_names, m.velocities, strict=True))
    m.friction("rub", gamma_F=rates["lower_phi"] - rates["upper_phi"], bound=0.05)
    m.force({"upper_phi": push})
    start |= {"upper_x": 3.4, "upper_y": 0.8, "upper_phi": -np.pi / 2}
    start |= {"lower_x": 3.4, "lower_y": 0.4, "lower_phi": -np.pi / 2}
    for i, one in enumerate(discs):
        for j in range(i):
            world.contact(f"pair{j}_{i}", one, discs[j], mu=mu, e_N=e_N)
        for j in (1, 2):
            world.contact(f"side{i}_{j}", Round(corners[j], 0.01), one, mu=mu, e_N=e_N)
        world.contact(f"swing{i}", Round(lower.point(0.2, 0), 0.02), one, mu=mu, e_N=e_N)
    edge = Edge(corners[1], corners[2], 0.05)
    world.contact("reach", lower.point(0.2, 0), edge, mu=mu, e_N=e_N)
    m.initial_state(q=start)
    return m


def balls_in_a_bowl(count: int = 5) -> sg.Model:
    """Balls in space that fall into a bowl."""
    from signorini.bodies import Spatial

    m = sg.Model("balls_in_a_bowl", symbols="casadi")
    world = Spatial(m, gravity=(0, 0, -9.81))
    bowl = world.graph(lambda x, y: 0.4 * (x**2 + y**2))
    balls = []
    start = {}
    for k in range(count):
        body = world.body(f"b{k}", 1.0, inertia.ball(1.0, RADIUS))
        balls.append(Round(body.point(), RADIUS))
        world.contact(f"bowl{k}", body.point(), bowl, mu=0.3, e_N=0.3)
        start |= {f"b{k}_x": 0.3 * np.cos(2 * k), f"b{k}_y": 0.3 * np.sin(2 * k)}
        start |= {f"b{k}_z": 0.3 + 0.15 * k}
    for i in range(count):
        for j in range(i):
            world.contact(f"c{j}_{i}", balls[j], balls[i], mu=0.3, e_N=0.3)
    world.initial_state(q=start)
    return m
