"""Atwood's machine: two weights on a rope over a pulley, the lighter one on a table at first.

Closed form: the heavy weight falls freely by the slack, both share its momentum when the rope is
taut, and go on with (m_2 - m_1) g / (m_1 + m_2). Seen: an impact of a rope around a disc.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Planar, Pulley


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("atwood")
    m.doc = "Two weights on a rope over a pulley, slack at first"
    light, heavy, R, slack, grav, e_N = m.parameters(
        light=sg.par(1.0, unit="kg", min=0, doc="mass on the table"),
        heavy=sg.par(2.5, unit="kg", min=0, doc="mass that falls"),
        R=sg.par(0.15, unit="m", min=0, doc="radius of the pulley"),
        slack=sg.par(0.2, unit="m", min=0, doc="slack of the rope at the start"),
        grav=sg.par(9.81, unit="m/s^2", min=0, doc="gravity"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution of the rope"),
    )
    world = Planar(m, gravity=(0, -grav))
    one, two = world.particle("one", light), world.particle("two", heavy)
    pulley = Pulley(world.ground.point(0, 0), R, over=(0, 1))
    world.rope("rope", [one, pulley, two], 1.0 + 0.4 + sp.pi * R + slack, e_N=e_N)
    world.contact("table", one, world.plane(world.ground.point(0, -1)), friction=False)
    m.constraint("guides", [one.position[0] + R, two.position[0] - R])
    m.initial_state(q={"one_x": -R, "one_y": -1, "two_x": R, "two_y": -0.4})
    m.suggest(dt=2e-3, t_end=0.45)
    return m
