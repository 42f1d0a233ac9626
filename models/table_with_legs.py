"""Table with any number of legs: which leg carries how much is not determined.

On rigid ground more than three legs are one too many; of all percussions that solve a step the one
of least norm is taken. Closed form: with its mass in the middle the table stands with m g / n on
each of n legs.
"""

from math import cos, pi, sin

import signorini as sg
from signorini.bodies import Spatial, inertia


def model(legs: int = 5) -> sg.Model:
    """Return the model with any number of legs."""
    m = sg.Model("table_with_legs")
    m.doc = "Table on more legs than needed"
    mass, R, thick, height, aside, grav, mu, e_N = m.parameters(
        mass=sg.par(10.0, unit="kg", min=0, doc="mass of the plate"),
        R=sg.par(0.5, unit="m", min=0, doc="radius of the circle of legs"),
        thick=sg.par(0.04, unit="m", min=0, doc="thickness of the plate"),
        height=sg.par(0.7, unit="m", min=0, doc="height of the centre of mass"),
        aside=sg.par(0.0, unit="m", doc="how far the centre of mass is off the middle"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.4, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
    )
    world = Spatial(m, gravity=(0, 0, -grav))
    plate = world.body(
        "plate", mass, inertia.cylinder(mass, R, thick), coordinates="x y z p0 p1 p2 p3"
    )
    floor = world.plane()
    rim = []
    for k in range(legs):
        a = 2 * pi * k / legs
        x, y = R * cos(a) - aside, R * sin(a)
        foot, top = plate.point(x, y, -height), plate.point(x, y, 0)
        world.contact(f"leg{k}", foot, floor, mu=mu, e_N=e_N)
        m.shape([foot.position, top.position])
        rim.append(top.position)
    m.shape(rim, closed=True)
    world.initial_state(q={"z": height}, v={"x": 1.5})
    m.suggest(dt=5e-3, t_end=1)
    return m
