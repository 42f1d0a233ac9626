"""Planar box on a plane: four corners in contact, two of them redundant at rest.

Rigid rectangle, contacts of all four corners with the floor. Seen: rocking, slipping, rest on two
corners with equal percussions.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("box")
    m.doc = "Planar box dropped on its corners"
    x, y, phi = m.coordinates("x y phi", units="m m rad")
    vx, vy, omega = m.velocities
    mass, a, b, grav, mu, e_N, e_F = m.parameters(
        mass=sg.par(1.0, unit="kg", doc="mass"),
        a=sg.par(0.2, unit="m", doc="half width"),
        b=sg.par(0.1, unit="m", doc="half height"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.3, min=0, doc="friction coefficient"),
        e_N=sg.par(0.2, min=0, max=1, doc="restitution"),
        e_F=sg.par(0.0, min=0, max=1, doc="tangential restitution"),
    )
    inertia = mass * (a**2 + b**2) / 3
    m.lagrangian = mass / 2 * (vx**2 + vy**2) + inertia / 2 * omega**2 - mass * grav * y
    corners = []
    for name, c_x, c_y in (("A", -a, -b), ("B", a, -b), ("C", a, b), ("D", -a, b)):
        # Corner relative to the centre of mass, in the directions of the plane.
        r_x = c_x * sp.cos(phi) - c_y * sp.sin(phi)
        r_y = c_x * sp.sin(phi) + c_y * sp.cos(phi)
        corner = (x + r_x, y + r_y)
        laws = {"mu": mu, "e_N": e_N, "e_F": e_F}
        m.contact(name, g_N=y + r_y, gamma_F=vx - omega * r_y, at=corner, normal=(0, 1), **laws)
        m.output(f"{name}_x", x + r_x)
        corners.append(corner)
    m.shape(corners, closed=True)
    m.shape([(0, 0)], normal=(0, 1))
    m.initial_state(q=[0, 0.5, 0.4], v=[0.5, 0, 1])
    m.suggest(dt=1e-2, t_end=2)
    return m
