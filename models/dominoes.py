"""Dominoes: each pushes over the next one.

Closed form: a block of width w and height h tips over iff it leans by more than atan(w/h). Seen:
the toppling runs through the row, the dominoes come to rest leaning on each other.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Edge, Planar, inertia


def model(count: int = 3) -> sg.Model:
    """Return the model with any number of dominoes."""
    m = sg.Model("dominoes")
    m.doc = "Dominoes topple one another"
    mass, w, h, apart, lean, grav, mu, e_N = m.parameters(
        mass=sg.par(0.01, unit="kg", min=0, doc="mass of a domino"),
        w=sg.par(0.008, unit="m", min=0, doc="thickness"),
        h=sg.par(0.048, unit="m", min=0, doc="height"),
        apart=sg.par(0.016, unit="m", min=0, doc="free distance"),
        lean=sg.par(0.2, unit="rad", min=0, doc="angle of the first one at the start"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.3, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
    )
    world = Planar(m, gravity=(0, -grav))
    start: dict[str, object] = {}
    before = None
    for k in range(count):
        body = world.body(f"d{k}", mass, inertia.rectangle(mass, w, h))
        clockwise = ((-1, 1), (1, 1), (1, -1), (-1, -1))
        corners = [body.point(i * w / 2, j * h / 2) for i, j in clockwise]
        m.shape([c.position for c in corners], closed=True)
        for i, corner in enumerate(corners):
            world.contact(f"floor{k}_{i}", corner, world.plane(), mu=mu, e_N=e_N)
        if before is not None:
            # shallow: a corner that comes from above is not pushed out sideways
            left = Edge(corners[3], corners[0], w / 20)
            right = Edge(before[1], before[2], w / 20)
            world.contact(f"push{k}", before[1], left, mu=mu, e_N=e_N)
            world.contact(f"over{k}", corners[0], right, mu=mu, e_N=e_N)
            world.contact(f"foot{k}", corners[3], right, mu=mu, e_N=e_N)
        start |= {f"d{k}_x": k * (w + apart), f"d{k}_y": h / 2}
        before = corners
    # the first one leans to the right about its lower right corner
    c, s = sp.cos(lean), sp.sin(lean)
    start |= {
        "d0_x": w / 2 - w / 2 * c + h / 2 * s,
        "d0_y": w / 2 * s + h / 2 * c,
        "d0_phi": -lean,
    }
    m.initial_state(q=start)
    m.suggest(dt=1e-3, t_end=0.6)
    return m
