"""Ball on a vibrating table: the first period doubling.

Closed form (Luck and Mehta, 1993): one bounce a period exists for
Gamma = A omega^2 / g >= pi (1 - e) / (1 + e) and doubles its period at
Gamma^2 = pi^2 ((1 - e) / (1 + e))^2 + (2 (1 + e^2) / (1 + e)^2)^2.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("vibrating_table")
    m.doc = "Ball on a vibrating table: period doubling"
    (y,) = m.coordinates("y", units="m")
    (v,) = m.velocities
    mass, grav, Gamma, omega, e_N = m.parameters(
        mass=sg.par(0.05, unit="kg", min=0, doc="mass"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        Gamma=sg.par(1.3, min=0, doc="amplitude of the acceleration over gravity"),
        omega=sg.par(2 * 3.141592653589793 * 20, unit="rad/s", min=0, doc="rate"),
        e_N=sg.par(0.5, min=0, max=1, doc="restitution"),
    )
    table = Gamma * grav / omega**2 * sp.sin(omega * m.time)
    m.lagrangian = mass / 2 * v**2 - mass * grav * y
    m.contact("table", g_N=y - table, e_N=e_N, at=(0, y), normal=(0, 1))
    size = Gamma * grav / omega**2
    m.shape([(0, table)], normal=(0, 1))
    m.shape([(0, y + size / 2)], radius=size / 2)
    m.output("table_height", table)
    m.initial_state(q=[0], v=[grav / omega * sp.pi])
    m.suggest(dt=1e-4, t_end=3)
    return m
