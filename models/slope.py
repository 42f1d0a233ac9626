"""Point mass on the slope f(x) = (x, exp(-x)): persistent contact, sliding, rest.

Capobianco, Harsch, Leyendecker, section 6.3, case 1; case 2 starts at y = 1.5 and falls.
Seen: comes to rest between t = 2 and 2.5.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("slope")
    m.doc = "Point mass that slides down the slope y = exp(-x)"
    x, y = m.coordinates("x y", units="m m")
    vx, vy = m.velocities
    mass, grav, mu = m.parameters(
        mass=sg.par(1.0, unit="kg", doc="mass"),
        grav=sg.par(10.0, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.3, min=0, doc="friction coefficient"),
    )
    m.lagrangian = mass / 2 * (vx**2 + vy**2) - mass * grav * y
    length = sp.sqrt(1 + sp.exp(-2 * x))
    t_x, t_y = 1 / length, -sp.exp(-x) / length
    m.contact(
        "slope",
        g_N=t_x * (y - sp.exp(-x)),
        gamma_F=t_x * vx + t_y * vy,
        mu=mu,
        at=(x, y),
        normal=(-t_y, t_x),
    )
    # what it slid along
    m.shape([(x * k / 20, sp.exp(-x * k / 20)) for k in range(21)])
    m.shape([(x, y)], radius=sp.Rational(1, 30))
    m.initial_state(q=[0, 1])
    m.suggest(dt=1e-2, t_end=3)
    return m
