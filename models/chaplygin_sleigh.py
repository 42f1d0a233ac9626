"""Chaplygin sleigh: a body on a knife edge behind its centre of mass.

Closed form (Neimark and Fufaev, Dynamics of Nonholonomic Systems): it turns until it runs straight;
from pure rotation it turns by pi/2 sqrt(1 + J / (m a^2)) and ends with the speed
omega_0 sqrt(a^2 + J/m). Energy is conserved although the motion has an attractor.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("chaplygin_sleigh")
    m.doc = "Sleigh on a knife edge: turns until it runs straight"
    x, y, phi = m.coordinates("x y phi")
    v_x, v_y, omega = m.velocities
    mass, J, a, omega_0 = m.parameters(
        mass=sg.par(2.0, unit="kg", min=0, doc="mass"),
        J=sg.par(0.03, unit="kg m^2", min=0, doc="inertia"),
        a=sg.par(0.15, unit="m", doc="edge behind the centre of mass"),
        omega_0=sg.par(4.0, unit="rad/s", doc="initial rate"),
    )
    m.lagrangian = mass / 2 * (v_x**2 + v_y**2) + J / 2 * omega**2
    m.velocity_constraint("edge", -v_x * sp.sin(phi) + v_y * sp.cos(phi) - a * omega)
    c, s = sp.cos(phi), sp.sin(phi)
    m.shape([(x - a * c, y - a * s), (x + a * c, y + a * s)])
    m.shape([(x, y)], radius=a / 4)
    m.initial_state(q=[0, 0, 0], v=[0, a * omega_0, omega_0])
    m.suggest(dt=5e-3, t_end=4)
    return m
