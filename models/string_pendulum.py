"""Stone on a string: swings, flies where the string is slack, and jerks it taut.

Closed form: with v^2 = 3.5 g l at the lowest place the string goes slack at 120 degrees, the stone
flies on a parabola for 4 sin(120) v / g with v^2 = g l / 2, and loses the radial part of its
velocity when the string is taut again. Seen: a rope pulls and cannot push.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Planar


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("string_pendulum")
    m.doc = "Stone on a string that goes slack and taut"
    mass, length, grav, e_N = m.parameters(
        mass=sg.par(0.3, unit="kg", min=0, doc="mass"),
        length=sg.par(0.7, unit="m", min=0, doc="length of the string"),
        grav=sg.par(9.81, unit="m/s^2", min=0, doc="gravity"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution of the string"),
    )
    world = Planar(m, gravity=(0, -grav))
    stone = world.particle("stone", mass)
    world.rope("string", [world.ground.point(), stone], length, e_N=e_N)
    m.initial_state(q={"stone_y": -length}, v={"stone_x": sp.sqrt(3.5 * grav * length)})
    m.suggest(dt=2e-3, t_end=2)
    return m
