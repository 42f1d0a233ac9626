"""Block on a spring and a belt, with friction that falls with the slip (Stribeck).

Between integrations: period and turning point of the stick-slip cycle are those of the differential
equation of the slip with mu_d + (mu_s - mu_d) exp(-(gamma / v_s)^2), to the first order of a
coefficient that is taken at the start of each step. Seen: self-excited oscillation.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("stribeck_oscillator")
    m.doc = "Block on a belt, with friction that falls with the slip"
    x, y = m.coordinates("x y", units="m m")
    v_x, v_y = m.velocities
    mass, k, grav, speed, mu_s, mu_d, v_s = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass"),
        k=sg.par(100.0, unit="N/m", min=0, doc="stiffness of the spring"),
        grav=sg.par(9.81, unit="m/s^2", min=0, doc="gravity"),
        speed=sg.par(0.2, unit="m/s", doc="speed of the belt"),
        mu_s=sg.par(0.5, min=0, doc="friction coefficient without slip"),
        mu_d=sg.par(0.3, min=0, doc="friction coefficient of fast slip"),
        v_s=sg.par(0.05, unit="m/s", min=0, doc="slip over which friction falls"),
    )
    slip = v_x - speed
    m.lagrangian = mass * (v_x**2 + v_y**2) / 2 - k * x**2 / 2 - mass * grav * y
    m.contact("belt", g_N=y, gamma_F=slip, mu=mu_d + (mu_s - mu_d) * sp.exp(-((slip / v_s) ** 2)))
    m.shape([(x - 0.04, y), (x + 0.04, y), (x + 0.04, y + 0.05), (x - 0.04, y + 0.05)], closed=True)
    m.shape([(-0.2, 0), (0.2, 0)])
    m.initial_state(q=[0, 0], v=[speed, 0])
    m.suggest(dt=1e-3, t_end=3)
    return m
