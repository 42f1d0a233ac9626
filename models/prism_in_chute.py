"""Prism in an inclined V-shaped chute: slides along it, turns about its axis, wedges between walls.

Closed form: flat on both walls it slides iff tan(beta) > mu / cos(alpha), with the acceleration
g (sin(beta) - mu cos(beta) / cos(alpha)): walls that carry m g cos(beta) / (2 cos(alpha)) each.
With mu tan(alpha) > 1 friction can hold it between the walls. Gravity is tilted instead of the
chute.
"""

from math import cos, pi

import signorini as sg
import sympy as sp


def model(corners: int = 4) -> sg.Model:
    """Return the model with a regular polygon as section, of any number of corners."""
    m = sg.Model("prism_in_chute")
    m.doc = "Prism in a chute: slides iff tan(beta) > mu / cos(alpha)"
    x, y, z, phi = m.coordinates("x y z phi", units="m m m rad")
    u_x, u_y, u_z, spin = m.velocities
    mass, R, alpha, beta, grav, mu, e_N, e_F = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass"),
        R=sg.par(0.1, unit="m", min=0, doc="distance of the edges from the axis"),
        alpha=sg.par(pi / 4, unit="rad", doc="slope of the walls"),
        beta=sg.par(0.6, unit="rad", doc="inclination of the chute"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.3, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
        e_F=sg.par(0.0, min=0, max=1, doc="tangential restitution"),
    )
    turn = 2 * pi / corners
    # second moment of a regular polygon about its centre
    J = mass * R**2 * (2 + cos(turn)) / 6
    weight = mass * grav
    m.lagrangian = (
        mass / 2 * (u_x**2 + u_y**2 + u_z**2)
        + J / 2 * spin**2
        - weight * (sp.cos(beta) * y - sp.sin(beta) * z)
    )
    c, s = sp.cos(alpha), sp.sin(alpha)
    section = []
    for k in range(corners):
        # edge k and its velocity, in the section and along the chute
        r_x, r_y = R * sp.cos(phi + k * turn), R * sp.sin(phi + k * turn)
        v_x, v_y = u_x - spin * r_y, u_y + spin * r_x
        for side, sign in (("left", 1), ("right", -1)):
            m.contact(
                f"{side}_{k}",
                g_N=sign * s * (x + r_x) + c * (y + r_y),
                gamma_F=[c * v_x - sign * s * v_y, u_z],
                mu=mu,
                e_N=e_N,
                e_F=e_F,
                at=(x + r_x, y + r_y),
                normal=(sign * s, c),
            )
        section.append((x + r_x, y + r_y))
    m.shape(section, closed=True)
    m.shape([(-2 * R * c, 2 * R * s), (0, 0), (2 * R * c, 2 * R * s)])
    m.initial_state(q={"y": 3 * R, "phi": 0.3})
    m.suggest(dt=5e-3, t_end=1)
    return m
