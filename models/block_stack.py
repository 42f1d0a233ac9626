"""Stack of blocks with overhang: stands or topples.

Closed form: with equal blocks each may overhang the one below by at most half its length divided by
the number of blocks it carries, itself included (the harmonic series). Seen: below the limit the
stack rests with the weight of all blocks on the floor; above it the top tips over.
"""

import signorini as sg
from signorini.bodies import Edge, Planar, inertia


def model(blocks: int = 3) -> sg.Model:
    """Return the model with any number of blocks."""
    m = sg.Model("block_stack")
    m.doc = "Stack of overhanging blocks: stands or topples"
    mass, length, height, grav, mu, e_N, share, grading = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass of the lowest block"),
        length=sg.par(0.4, unit="m", min=0, doc="length"),
        height=sg.par(0.1, unit="m", min=0, doc="height"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.6, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
        share=sg.par(0.9, min=0, doc="overhang over its limit"),
        grading=sg.par(1.0, min=0, doc="mass of a block over that of the block below"),
    )
    world = Planar(m, gravity=(0, -grav))
    start: dict[str, object] = {}
    below = None
    place = 0 * length
    for k in range(blocks):
        weight = mass * grading**k
        block = world.body(f"b{k}", weight, inertia.rectangle(weight, length, height))
        clockwise = ((-1, 1), (1, 1), (1, -1), (-1, -1))
        corners = [block.point(i * length / 2, j * height / 2) for i, j in clockwise]
        m.shape([c.position for c in corners], closed=True)
        upper, lower = corners[:2], corners[2:]
        for i, corner in enumerate(corners):
            world.contact(f"floor{k}_{i}", corner, world.plane(), mu=mu, e_N=e_N)
        if below is not None:
            place = place + share * length / (2 * (blocks - k))
            # corners of each block on the edge of the other
            for name, ends, edge in (("down", lower, below), ("up", below, lower)):
                # shallow: a corner that comes from the side is not pushed out through the top
                face = Edge(edge[0], edge[1], height / 20)
                for i, corner in enumerate(ends):
                    world.contact(f"{name}{k}_{i}", corner, face, mu=mu, e_N=e_N)
        start |= {f"b{k}_x": place, f"b{k}_y": (2 * k + 1) * height / 2}
        below = upper
    m.initial_state(q=start)
    m.suggest(dt=5e-3, t_end=2)
    return m
