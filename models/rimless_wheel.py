"""Rimless wheel that walks down a slope: the simplest passive walker.

Closed forms (McGeer, 1990): each impact multiplies the rate by
eta = (J + m l^2 cos(2 alpha)) / (J + m l^2), 2 alpha the angle between spokes; on a slope gamma
the limit cycle starts each step with omega^2 = eta^2/(1 - eta^2) 4 m g l sin(alpha) sin(gamma) /
(J + m l^2). Gravity is tilted instead of the slope.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Planar


def model(spokes: int = 8) -> sg.Model:
    """Return the model with any number of spokes."""
    m = sg.Model("rimless_wheel")
    m.doc = "Rimless wheel on a slope: a walking limit cycle"
    mass, J, length, grav, slope, mu = m.parameters(
        mass=sg.par(2.0, unit="kg", min=0, doc="mass"),
        J=sg.par(0.05, unit="kg m^2", min=0, doc="inertia"),
        length=sg.par(0.3, unit="m", min=0, doc="length of a spoke"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        slope=sg.par(0.15, unit="rad", doc="inclination"),
        mu=sg.par(1.0, min=0, doc="friction coefficient"),
    )
    world = Planar(m, gravity=(grav * sp.sin(slope), -grav * sp.cos(slope)))
    wheel = world.body("wheel", mass, J, coordinates="x y phi")
    ground = world.plane()
    for k in range(spokes):
        angle = 2 * sp.pi * k / spokes
        foot = wheel.point(-length * sp.sin(angle), -length * sp.cos(angle))
        world.contact(f"foot_{k}", foot, ground, mu=mu)
        m.shape([wheel.origin, foot.position])
    # stands on spoke 0, just past the impact, and moves to the right
    alpha = sp.pi / spokes
    omega = -2
    m.initial_state(
        q=[-length * sp.sin(alpha), length * sp.cos(alpha), alpha],
        v=[-omega * length * sp.cos(alpha), -omega * length * sp.sin(alpha), omega],
    )
    m.suggest(dt=1e-3, t_end=6)
    return m
