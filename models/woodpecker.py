"""Woodpecker toy: a bird pecks its way down a pole.

Leine, Glocker, van Campen, "Nonlinear dynamics of the woodpecker toy", ASME DETC 2001/VIB-21608;
data there and in Glocker's dissertation, 1995: sleeve on a pole, bird on a torsion spring; the beak
hits the pole, the sleeve jams at its upper and lower edge. The start lies on the limit cycle of
the paper. Seen: jam below, beak impact, jam above, slip, and again.
"""

import signorini as sg
import sympy as sp

_AROUND = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("woodpecker")
    m.doc = "Woodpecker toy: a limit cycle of jamming and impacts"
    y, phi_M, phi_S = m.coordinates("y phi_M phi_S", units="m rad rad")
    v, w_M, w_S = m.velocities
    m_M, m_S, J_M, J_S, c, grav, r_0, r_M, h_M, l_M, l_G, h_S, l_S, mu, e_N = m.parameters(
        m_M=sg.par(3e-4, unit="kg", doc="mass of the sleeve"),
        m_S=sg.par(4.5e-3, unit="kg", doc="mass of the bird"),
        J_M=sg.par(5e-9, unit="kg m^2", doc="inertia of the sleeve"),
        J_S=sg.par(7e-7, unit="kg m^2", doc="inertia of the bird"),
        c=sg.par(5.6e-3, unit="N m/rad", doc="stiffness of the spring"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        r_0=sg.par(2.5e-3, unit="m", doc="radius of the pole"),
        r_M=sg.par(3.1e-3, unit="m", doc="inner radius of the sleeve"),
        h_M=sg.par(5.8e-3, unit="m", doc="half height of the sleeve"),
        l_M=sg.par(0.010, unit="m", doc="sleeve to spring"),
        l_G=sg.par(0.015, unit="m", doc="spring to bird"),
        h_S=sg.par(0.02, unit="m", doc="height of the beak"),
        l_S=sg.par(0.0201, unit="m", doc="length of the beak"),
        mu=sg.par(0.3, min=0, doc="friction coefficient"),
        e_N=sg.par(0.5, min=0, max=1, doc="restitution of the beak"),
    )
    T = (
        (m_S + m_M) / 2 * v**2
        + (J_M + m_S * l_M**2) / 2 * w_M**2
        + (J_S + m_S * l_G**2) / 2 * w_S**2
        + m_S * (l_M * v * w_M + l_G * v * w_S + l_M * l_G * w_M * w_S)
    )
    V = (m_S + m_M) * grav * y + m_S * grav * (l_M * phi_M + l_G * phi_S)
    m.lagrangian = T - V - c / 2 * (phi_M - phi_S) ** 2
    # Small angles, as in the paper: places relative to the sleeve's middle and the spring's end.
    spring = (l_M, y + l_M * phi_M)
    bird = (l_M + l_G, spring[1] + l_G * phi_S)
    beak = (l_M + l_G - l_S - h_S * phi_S, spring[1] + (l_G - l_S) * phi_S + h_S)
    edges = [(i * r_M - j * h_M * phi_M, y + j * h_M + i * r_M * phi_M) for i, j in _AROUND]
    m.shape(edges, closed=True)
    m.shape([(r_M, y + r_M * phi_M), spring, bird, (bird[0] - h_S * phi_S, bird[1] + h_S), beak])
    m.shape([bird], radius=sp.Rational(1, 250))
    m.shape([(r_0, 0)], normal=(1, 0))
    m.shape([(-r_0, 0)], normal=(-1, 0))
    m.contact(
        "beak",
        g_N=l_M + l_G - l_S - r_0 - h_S * phi_S,
        gamma_F=v + l_M * w_M + (l_G - l_S) * w_S,
        mu=mu,
        e_N=e_N,
        at=beak,
        normal=(1, 0),
    )
    for name, j in (("lower", -1), ("upper", 1)):
        m.contact(
            name,
            g_N=r_M - r_0 - j * h_M * phi_M,
            gamma_F=v + r_M * w_M,
            mu=mu,
            at=(r_M - j * h_M * phi_M, y + j * h_M + r_M * phi_M),
            normal=(1, 0),
        )
    # lower edge touching: the first two digits of the paper's -0.1036
    m.initial_state(q=[0, -(r_M - r_0) / h_M, -0.2788], v=[-0.3411, 0, -7.4583])
    m.suggest(dt=1e-4, t_end=0.6)
    return m
