"""Polygon in a V-shaped groove that may shake: wedged between two walls.

Closed form: without friction both walls carry m g / (2 cos(alpha)). With mu tan(alpha) > 1 friction
alone can hold a body between the walls: it locks. Seen: rests flat on both walls, rattles when the
groove shakes.
"""

from math import cos, pi, sin

import signorini as sg
import sympy as sp
from signorini.bodies import Planar


def model(corners: int = 4) -> sg.Model:
    """Return the model with a regular polygon of any number of corners."""
    m = sg.Model("v_groove")
    m.doc = "Polygon wedged in a groove"
    mass, R, alpha, grav, mu, e_N, e_F, A, omega = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass"),
        R=sg.par(0.1, unit="m", min=0, doc="distance of the corners from the centre"),
        alpha=sg.par(pi / 4, unit="rad", doc="slope of the walls"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.5, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
        e_F=sg.par(0.0, min=0, max=1, doc="tangential restitution"),
        A=sg.par(0.0, unit="m", doc="amplitude of the shaking"),
        omega=sg.par(50.0, unit="rad/s", doc="rate of the shaking"),
    )
    turn = 2 * pi / corners
    # second moment of a regular polygon about its centre
    J = mass * R**2 * (2 + cos(turn)) / 6
    world = Planar(m, gravity=(0, -grav))
    body = world.body("body", mass, J, coordinates="x y phi")
    groove = world.frame("groove", at=(0, A * sp.sin(omega * m.time)))
    bottom = groove.point()
    c, s = sp.cos(alpha), sp.sin(alpha)
    walls = {"left": world.plane(bottom, (s, c)), "right": world.plane(bottom, (-s, c))}
    points = [body.point(R * cos(k * turn), R * sin(k * turn)) for k in range(corners)]
    for k, point in enumerate(points):
        for side, wall in walls.items():
            world.contact(f"{side}_{k}", point, wall, mu=mu, e_N=e_N, e_F=e_F)
    m.shape([p.position for p in points], closed=True)
    left, right = (groove.point(i * 2 * R * c, 2 * R * s) for i in (-1, 1))
    m.shape([p.position for p in (left, bottom, right)])
    m.initial_state(q={"y": 3 * R, "phi": 0.3})
    m.suggest(dt=5e-3, t_end=1)
    return m
