"""Chain that falls on a table: presses three times as hard as what lies there weighs.

Beads on inextensible strings: a string is a contact that pulls, open when slack. Closed form: a
chain let go above a table presses with three times the weight of its fallen part (Love, 1897): as
k beads have landed by the time t, the percussion so far is k m g t.
"""

import signorini as sg
from signorini.bodies import Planar
from signorini.bodies.algebra import dot, subtract


def model(beads: int = 5) -> sg.Model:
    """Return the model with any number of beads."""
    m = sg.Model("falling_chain")
    m.doc = "Chain that falls on a table"
    mass, length, grav, mu, e_N, x = m.parameters(
        mass=sg.par(0.01, unit="kg", min=0, doc="mass of a bead"),
        length=sg.par(0.1, unit="m", min=0, doc="length of a string"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.4, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
        x=sg.par(0.3, doc="how far the chain leans at the start, per length"),
    )
    world = Planar(m, gravity=(0, -grav))
    points = [world.particle(f"b{k}", mass) for k in range(beads)]
    for k, point in enumerate(points):
        world.contact(f"table{k}", point, world.plane(), mu=mu, e_N=e_N)
        if k > 0:
            apart = subtract(point.position, points[k - 1].position)
            # (l^2 - r^2) / 2 l: the slack, and smooth where beads meet
            m.contact(f"string{k}", g_N=(length**2 - dot(apart, apart)) / (2 * length), e_N=e_N)
    m.shape([p.position for p in points])
    c = (1 - x**2) ** 0.5
    start = {f"b{k}_x": k * x * length for k in range(beads)}
    start |= {f"b{k}_y": (k + 1) * c * length for k in range(beads)}
    m.initial_state(q=start)
    m.suggest(dt=1e-3, t_end=0.5)
    return m
