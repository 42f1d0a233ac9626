"""Slider-crank with clearance: four corners of the slider against two walls.

Capobianco, Harsch, Leyendecker, section 6.2; data of Flores, Leine, Glocker (2010),
doi:10.1007/s11044-009-9178-y. Seen: no penetration, several corners closing at once, slider
aligned after t = 0.01.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("slider_crank")
    m.doc = "Slider-crank whose slider has clearance between two walls"
    q = m.coordinates("x_1 y_1 phi_1 x_2 y_2 phi_2 x_3 y_3 phi_3", units=3 * "m m rad ")
    x_1, y_1, phi_1, x_2, y_2, phi_2, x_3, y_3, phi_3 = q
    v = m.velocities
    l_1, l_2, a, b, d, m_1, m_2, m_3, J_1, J_2, J_3, grav, mu, e_N = m.parameters(
        l_1=sg.par(0.153, unit="m", doc="length of the crank"),
        l_2=sg.par(0.306, unit="m", doc="length of the rod"),
        a=sg.par(0.05, unit="m", doc="half length of the slider"),
        b=sg.par(0.025, unit="m", doc="half height of the slider"),
        d=sg.par(0.052, unit="m", doc="distance of the walls"),
        m_1=sg.par(0.038, unit="kg", doc="mass of the crank"),
        m_2=sg.par(0.038, unit="kg", doc="mass of the rod"),
        m_3=sg.par(0.076, unit="kg", doc="mass of the slider"),
        J_1=sg.par(7.4e-5, unit="kg m^2", doc="inertia of the crank"),
        J_2=sg.par(5.9e-4, unit="kg m^2", doc="inertia of the rod"),
        J_3=sg.par(2.7e-6, unit="kg m^2", doc="inertia of the slider"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.01, min=0, doc="friction coefficient"),
        e_N=sg.par(0.4, min=0, max=1, doc="restitution"),
    )
    bodies = ((m_1, J_1, 0), (m_2, J_2, 3), (m_3, J_3, 6))
    T = sum(
        mass / 2 * (v[k] ** 2 + v[k + 1] ** 2) + inertia / 2 * v[k + 2] ** 2
        for mass, inertia, k in bodies
    )
    V = sum(mass * grav * q[k + 1] for mass, _, k in bodies)
    m.lagrangian = T - V
    c_1, s_1, c_2, s_2 = sp.cos(phi_1), sp.sin(phi_1), sp.cos(phi_2), sp.sin(phi_2)
    m.constraint("crank_pivot", [x_1 - l_1 / 2 * c_1, y_1 - l_1 / 2 * s_1])
    m.constraint(
        "crank_rod",
        [x_1 + l_1 / 2 * c_1 - x_2 + l_2 / 2 * c_2, y_1 + l_1 / 2 * s_1 - y_2 + l_2 / 2 * s_2],
    )
    m.constraint("rod_slider", [x_2 + l_2 / 2 * c_2 - x_3, y_2 + l_2 / 2 * s_2 - y_3])
    m.shape([(0, 0), (l_1 * c_1, l_1 * s_1)])
    m.shape([(x_2 - l_2 / 2 * c_2, y_2 - l_2 / 2 * s_2), (x_3, y_3)])
    outline = ((-a, b), (a, b), (a, -b), (-a, -b))
    c_3, s_3 = sp.cos(phi_3), sp.sin(phi_3)
    m.shape([(x_3 + i * c_3 - j * s_3, y_3 + i * s_3 + j * c_3) for i, j in outline], closed=True)
    for side in (-d / 2, d / 2):
        m.shape([(l_2 - l_1 - a, side), (l_2 + l_1 + a, side)])
    corners = (("P_1", -a, b), ("P_2", a, b), ("P_3", -a, -b), ("P_4", a, -b))
    for name, c_x, c_y in corners:
        height = c_x * sp.sin(phi_3) + c_y * sp.cos(phi_3)
        upper = name in ("P_1", "P_2")
        m.contact(
            name,
            g_N=d / 2 - (y_3 + height) if upper else d / 2 + (y_3 + height),
            gamma_F=v[6] - v[8] * height,
            mu=mu,
            e_N=e_N,
            at=(x_3 + c_x * c_3 - c_y * s_3, y_3 + c_x * s_3 + c_y * c_3),
            normal=(0, -1 if upper else 1),
        )
    m.initial_state(
        q=[0.0765, 0, 0, 0.306, 0, 0, 0.459, 0, 0.017],
        v=[0, 11.475, 150, 0, 11.475, -75, 0, 0, 0],
    )
    m.suggest(dt=1e-4, t_end=0.1466)
    return m
