"""Screw jack under load: holds by its own friction, or runs down.

Closed form: on a thread of mean radius R and lead angle alpha the load F runs down iff
mu < tan(alpha), then with a = F / (m s + (J / R^2) c (c + mu s) / (s - mu c)) along the thread,
s = sin(alpha), c = cos(alpha). Seen: friction under the reaction of a constraint.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("screw_jack")
    m.doc = "Screw that holds its load, or runs down"
    z, phi = m.coordinates("z phi", units="m rad")
    v, omega = m.velocities
    mass, J, R, alpha, mu, F = m.parameters(
        mass=sg.par(2.0, unit="kg", min=0, doc="mass that moves along the axis"),
        J=sg.par(1e-3, unit="kg m^2", min=0, doc="inertia of the screw"),
        R=sg.par(0.02, unit="m", min=0, doc="mean radius of the thread"),
        alpha=sg.par(0.25, unit="rad", doc="lead angle"),
        mu=sg.par(0.1, min=0, doc="friction coefficient of the thread"),
        F=sg.par(100.0, unit="N", doc="load down the axis"),
    )
    m.lagrangian = mass * v**2 / 2 + J * omega**2 / 2
    m.force({"z": -F})
    # across and along the thread, z against the way R phi around it
    across = sp.cos(alpha) * z - sp.sin(alpha) * R * phi
    along = sp.sin(alpha) * v + sp.cos(alpha) * R * omega
    m.constraint("thread", across)
    m.friction("flank", gamma_F=along, bound=mu * m.reaction("thread"))
    m.shape([(-0.03, z), (0.03, z), (0.03, z + 0.02), (-0.03, z + 0.02)], closed=True)
    m.shape([(0, z + 0.02), (0.02 * sp.cos(phi), z + 0.03), (0, z + 0.04)])
    m.shape([(0, -0.3), (0, 0.3)])
    m.initial_state(q=[0, 0])
    m.suggest(dt=1e-3, t_end=0.3)
    return m
