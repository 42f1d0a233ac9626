"""Roller on a floor with rolling resistance: rolls out, or is thrown and bounces to rest.

Closed form: where it rolls without slip, m r^2 + J takes the torque rho m g, so that the roller
decelerates by a = rho g / (r (1 + J / (m r^2))) and stops after v^2 / (2 a); it stays at rest on
every slope below rho / r. Seen: the contact torque is set-valued as friction is.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Planar, Round, inertia


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("roller")
    m.doc = "Roller with rolling resistance: stops, and stays at rest on a slight slope"
    mass, R, grav, alpha, mu, rho, e_N = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass"),
        R=sg.par(0.1, unit="m", min=0, doc="radius"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        alpha=sg.par(0.0, unit="rad", doc="slope of the floor"),
        mu=sg.par(0.5, min=0, doc="friction coefficient"),
        rho=sg.par(0.004, unit="m", min=0, doc="radius of rolling resistance"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
    )
    world = Planar(m, gravity=(grav * sp.sin(alpha), -grav * sp.cos(alpha)))
    wheel = world.body("wheel", mass, inertia.disc(mass, R), coordinates="x y phi")
    world.contact("floor", Round(wheel.point(), R), world.plane(), mu=mu, e_N=e_N, rolling=rho)
    m.initial_state(q={"y": R}, v={"x": 1, "phi": -1 / R})
    m.suggest(dt=1e-2, t_end=5)
    return m
