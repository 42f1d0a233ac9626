"""Rotating ball that bounces on a plane: impact, slip, rolling.

Capobianco, Harsch, Leyendecker, section 6.1, case 2 (omega = 50, e_N = 0); cases 1 and 3 are
``e_N=0.5, omega=0`` and ``omega=10``. Seen: impact at t = sqrt(2*0.9/g), sliding until
t = 0.72812, then rolling with v = (-10/7, 0, 100/7).
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("bouncing_ball")
    m.doc = "Rotating ball that bounces on a plane: impact, slip, rolling"
    x, y, phi = m.coordinates("x y phi", units="m m rad")
    vx, vy, omega = m.velocities
    mass, R, grav, mu, e_N = m.parameters(
        mass=sg.par(1.0, unit="kg", doc="mass"),
        R=sg.par(0.1, unit="m", doc="radius"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.2, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
    )
    m.lagrangian = (
        mass / 2 * (vx**2 + vy**2) + sp.Rational(1, 5) * mass * R**2 * omega**2 - mass * grav * y
    )
    m.contact(
        "floor",
        g_N=y - R,
        gamma_F=vx + R * omega,
        mu=mu,
        e_N=e_N,
        at=(x, y - R),
        normal=(0, 1),
    )
    m.shape([(0, 0)], normal=(0, 1))
    m.shape([(x, y)], radius=R)
    m.shape([(x, y), (x + R * sp.cos(phi), y + R * sp.sin(phi))])
    m.initial_state(q=[0, 1, 0], v=[0, 0, 50])
    m.suggest(dt=1e-2, t_end=2)
    return m
