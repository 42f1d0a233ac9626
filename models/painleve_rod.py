"""Rod that slides on rough ground: Painleve's paradox, an impact without collision.

A slender rod slides with its tip ahead; for mu (3 sin(theta) cos(theta)) > 1 + 3 cos(theta)^2 the
contact force of sliding would pull the tip into the ground (Painleve, 1895). No smooth motion
exists where it also accelerates downwards; the step answers with an impact that stops the slip,
although the normal velocity is zero (Genot and Brogliato, 1999). Its percussion does not depend on
the step size.
"""

from math import sin

import signorini as sg
from signorini.bodies import Planar, inertia


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("painleve_rod")
    m.doc = "Painleve's rod: an impact without collision"
    mass, half, grav, mu, e_N = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass"),
        half=sg.par(0.5, unit="m", min=0, doc="half length"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(1.8, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
    )
    world = Planar(m, gravity=(0, -grav))
    rod = world.body("rod", mass, inertia.rod(mass, 2 * half), coordinates="x y theta")
    tip, end = rod.point(-half, 0), rod.point(half, 0)
    floor = world.plane()
    world.contact("tip", tip, floor, mu=mu, e_N=e_N)
    world.contact("end", end, floor, mu=mu, e_N=e_N)
    m.shape([tip.position, end.position])
    # the tip slides to the left of the centre, towards the left
    theta = 0.9
    m.initial_state(q=[0, half * sin(theta), theta], v=[-1, 0, 0])
    m.suggest(dt=1e-3, t_end=1)
    return m
