"""Semicircular arch of wedge-shaped blocks: stands if it is thick enough.

Milankovitch (1907): a semicircular arch of infinitely many blocks carries its own weight iff its
thickness is at least 0.1075 of its mean radius (Makris and Alexakis, 2013, for radial joints); a
few large blocks need a little less. Joints have friction and no tension: two contacts each.
"""

from math import cos, pi, sin

import signorini as sg
from signorini.bodies import Edge, Planar


def model(blocks: int = 5) -> sg.Model:
    """Return the model with any number of blocks."""
    m = sg.Model("arch")
    m.doc = "Arch of blocks: stands if thick enough"
    density, R, thick, grav, mu = m.parameters(
        density=sg.par(100.0, unit="kg/m^2", min=0, doc="mass per area"),
        R=sg.par(1.0, unit="m", min=0, doc="mean radius"),
        thick=sg.par(0.13, unit="m", min=0, doc="thickness"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.8, min=0, doc="friction coefficient"),
    )
    world = Planar(m, gravity=(0, -grav))
    outer, inner = R + thick / 2, R - thick / 2
    half = pi / (2 * blocks)  # half the angle of a block
    # sector of a ring: area, distance of its centroid, inertia about the centroid
    area = half * (outer**2 - inner**2)
    reach = 2 * sin(half) / (3 * half) * (outer**3 - inner**3) / (outer**2 - inner**2)
    J = density * (half * (outer**4 - inner**4) / 2 - area * reach**2)
    mass = density * area
    start: dict[str, object] = {}
    springing = [world.ground.point(inner, 0), world.ground.point(outer, 0)]
    for k in range(blocks):
        middle = (2 * k + 1) * half
        block = world.body(f"b{k}", mass, J)
        start |= {
            f"b{k}_x": reach * cos(middle),
            f"b{k}_y": reach * sin(middle),
            f"b{k}_phi": middle,
        }

        lower, upper = (
            [block.point(r * cos(a) - reach, r * sin(a)) for r in (inner, outer)]
            for a in (-half, half)
        )
        m.shape([p.position for p in (*lower, *reversed(upper))], closed=True)
        # Shallow: a corner that comes from the side is not pushed out through the joint.
        edge = Edge(springing[0], springing[1], thick / 50, thick / 4)
        for name, corner in zip(("i", "o"), lower, strict=True):
            world.contact(f"j{k}_{name}", corner, edge, mu=mu)
        springing = upper
    edge = Edge(world.ground.point(-outer, 0), world.ground.point(-inner, 0), thick / 50, thick / 4)
    for name, corner in zip(("i", "o"), springing, strict=True):
        world.contact(f"j{blocks}_{name}", corner, edge, mu=mu)
    m.initial_state(q=start)
    m.suggest(dt=5e-3, t_end=1)
    return m
