"""Block on a ribbed floor: anisotropic friction, an ellipse of (mu_along, mu_across).

Closed form on the level: each velocity loses g mu_d^2 v_d / |(mu_x v_x, mu_y v_y)|,
so that v_x^(mu_across^2) / v_y^(mu_along^2) stays while both slide: the path bends to the ribs.
On an incline it sticks iff |(F_x / mu_along, F_y / mu_across)| is at most the normal force.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("ribbed_floor")
    m.doc = "Block on a ribbed floor: its path bends to the ribs"
    x, y, z = m.coordinates("x y z")
    vx, vy, vz = m.velocities
    mass, grav, along, across, slope_x, slope_y, e_N = m.parameters(
        mass=sg.par(2.0, unit="kg", min=0, doc="mass"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu_along=sg.par(0.1, min=0, doc="friction coefficient along the ribs"),
        mu_across=sg.par(0.4, min=0, doc="friction coefficient across the ribs"),
        slope_x=sg.par(0.0, unit="rad", doc="inclination along the ribs"),
        slope_y=sg.par(0.0, unit="rad", doc="inclination across the ribs"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
    )
    height = -sp.sin(slope_x) * x - sp.sin(slope_y) * y + sp.cos(slope_x) * sp.cos(slope_y) * z
    m.lagrangian = mass * (vx**2 + vy**2 + vz**2) / 2 - mass * grav * height
    m.contact("ribs", g_N=z, gamma_F=[vx, vy], mu=(along, across), e_N=e_N)
    for k in range(-1, 5):  # ribs, seen from above
        m.shape([(-0.05, 0.04 * k), (0.4, 0.04 * k)])
    m.shape([(x, y)], radius=0.015)
    m.initial_state(q=[0, 0, 0], v=[1.0, 1.0, 0])
    m.suggest(dt=1e-3, t_end=0.4)
    return m
