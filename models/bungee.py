"""A jumper on an elastic rope, which is slack at first.

Closed form of a jump straight down: with the fall l - y_0 before the rope is taut and the sag
m g c of the jumper at rest, the rope is stretched by m g c + sqrt((m g c)^2 + 2 m g c (l - y_0)) at
most, and the jumper comes back to where the jump began. Seen: a rope that is slack or taut, with a
compliance in place of an impact.
"""

import signorini as sg
from signorini.bodies import Planar


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("bungee")
    m.doc = "A jumper on an elastic rope"
    mass, length, compliance, relaxation, push, grav = m.parameters(
        mass=sg.par(75.0, unit="kg", min=0, doc="mass of the jumper"),
        length=sg.par(20.0, unit="m", min=0, doc="length of the slack rope"),
        compliance=sg.par(5e-3, unit="m/N", min=0, doc="inverse of the rope's stiffness"),
        relaxation=sg.par(0.0, unit="s", min=0, doc="damping of the rope over its stiffness"),
        push=sg.par(5.0, unit="m/s", doc="velocity away from the bridge"),
        grav=sg.par(9.81, unit="m/s^2", min=0, doc="gravity"),
    )
    world = Planar(m, gravity=(0, -grav))
    jumper = world.particle("jumper", mass)
    bridge = world.ground.point(0, 0)
    world.rope("rope", [bridge, jumper], length, compliance=compliance, relaxation=relaxation)
    m.initial_state(q={"jumper_y": -1}, v={"jumper_x": push})
    m.suggest(dt=5e-3, t_end=9)
    return m
