"""Kane's double pendulum strikes a rough floor with its tip.

With Newton's law e_N = 0.5 and friction it can leave the floor with more energy than it had, a
paradox (Kane 1984). With Poisson's law, compression and expansion, it had no more in any of 150
drawn impacts. Seen: what an impact law does where friction and restitution meet in a linkage.
"""

from math import pi

import signorini as sg
import sympy as sp
from signorini.bodies import Planar, inertia


def model(impact: str = "poisson") -> sg.Model:
    """Return the model with one of the two impact laws."""
    m = sg.Model("kanes_pendulum")
    m.doc = "Double pendulum that strikes a rough floor by Poisson's law"
    upper, lower = m.coordinates("upper lower", units="rad rad")
    mass, length, grav, mu, e_N = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass of a rod"),
        length=sg.par(1.0, unit="m", min=0, doc="length of a rod"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.7, min=0, doc="friction coefficient"),
        e_N=sg.par(0.5, min=0, max=1, doc="restitution"),
    )
    world = Planar(m, gravity=(0, -grav))
    J = inertia.rod(mass, length)
    joint = world.ground.point(0, 0)
    for name, angle in (("thigh", upper), ("shank", lower)):
        place = joint.position
        end = (length * sp.sin(angle), -length * sp.cos(angle))
        middle = (place[0] + end[0] / 2, place[1] + end[1] / 2)
        # its own axis y points up along the rod
        rod = world.frame(name, angle, middle)
        world.body(name, mass, J, frame=rod)
        joint = rod.point(0, -length / 2)
        m.shape([place, joint.position])
    depth = length * (sp.cos(sp.pi / 9) + sp.cos(sp.pi / 6))
    floor = world.plane(world.ground.point(0, -depth))
    world.contact("floor", joint, floor, mu=mu, e_N=e_N, impact=impact)
    m.initial_state(q=[pi / 9, -pi / 6 - 0.3], v=[0.1, 0.2])
    m.suggest(dt=1e-3, t_end=1)
    return m
