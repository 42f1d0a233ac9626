"""Andrews' squeezing mechanism: seven bodies, closed loops, a fast drive.

Hairer and Wanner, Solving Ordinary Differential Equations II, section VII.7 (after Schiehlen,
1990); data and reference solution at t = 0.03 of the Test Set for IVP Solvers. Six position
constraints in seven relative angles; no contact.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Planar


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("andrews_squeezer")
    m.doc = "Andrews' squeezer: seven bodies in closed loops"
    beta, theta, gamma, phi, delta, omega, epsilon = m.coordinates(
        "beta theta gamma phi delta omega epsilon"
    )
    mom, c_0, l_0 = m.parameters(
        mom=sg.par(0.033, unit="N m", doc="driving torque"),
        c_0=sg.par(4530.0, unit="N/m", doc="stiffness"),
        l_0=sg.par(0.07785, unit="m", doc="rest length of the spring"),
    )
    R = sp.Rational
    d, da, e, ea = R(28, 1000), R(115, 10000), R(2, 100), R(1421, 100000)
    rr, ra, ss, sa, sb, sc, sd = (R(k, 100000) for k in (700, 92, 3500, 1874, 1043, 1800, 2000))
    ta, tb, u, ua, ub = (R(k, 100000) for k in (2308, 916, 4000, 1228, 449))
    zf, zt, fa = R(2, 100), R(4, 100), R(1421, 100000)
    xa, ya, xb, yb = R(-6934, 100000), R(-227, 100000), R(-3635, 100000), R(3273, 100000)
    xc, yc = R(14, 1000), R(72, 1000)
    masses = (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498)
    inertias = (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
    sin, cos = sp.sin, sp.cos
    world = Planar(m)
    bt = beta + theta
    pw, ed = phi + delta, epsilon + omega
    # Centres of mass and absolute angles, as the reference gives them.
    poses = (
        (ra * cos(beta), ra * sin(beta), beta),
        (rr * cos(beta) - da * cos(bt), rr * sin(beta) - da * sin(bt), bt),
        (xb + sa * sin(gamma) + sb * cos(gamma), yb - sa * cos(gamma) + sb * sin(gamma), gamma),
        (xa + zt * cos(delta) + (e - ea) * sin(pw), ya + zt * sin(delta) - (e - ea) * cos(pw), pw),
        (xa + ta * cos(delta) - tb * sin(delta), ya + ta * sin(delta) + tb * cos(delta), delta),
        (
            xa + u * sin(epsilon) + (zf - fa) * cos(ed),
            ya - u * cos(epsilon) + (zf - fa) * sin(ed),
            ed,
        ),
        (
            xa + ua * sin(epsilon) - ub * cos(epsilon),
            ya - ua * cos(epsilon) - ub * sin(epsilon),
            epsilon,
        ),
    )
    for k, (x, y, angle) in enumerate(poses, start=1):
        frame = world.frame(f"K{k}", angle, (x, y))
        world.body(f"K{k}", masses[k - 1], inertias[k - 1], frame=frame)
    P = (rr * cos(beta) - d * cos(bt), rr * sin(beta) - d * sin(bt))
    B = (xb + ss * sin(gamma), yb - ss * cos(gamma))
    E = (xa + zt * cos(delta) + e * sin(pw), ya + zt * sin(delta) - e * cos(pw))
    F = (xa + u * sin(epsilon) + zf * cos(ed), ya - u * cos(epsilon) + zf * sin(ed))
    m.constraint("P_on_K3", [P[0] - B[0], P[1] - B[1]])
    m.constraint("P_on_K4", [P[0] - E[0], P[1] - E[1]])
    m.constraint("P_on_K6", [P[0] - F[0], P[1] - F[1]])
    D = world.frame("D", gamma, (xb, yb)).point(sd, -sc)
    world.spring(D, world.ground.point(xc, yc), c_0, l_0)
    m.force({"beta": mom})
    m.shape([(0, 0), (rr * cos(beta), rr * sin(beta)), P, (xb, yb)])
    m.shape([P, (xa + zt * cos(delta), ya + zt * sin(delta)), (xa, ya)])
    m.shape([P, (xa + u * sin(epsilon), ya - u * cos(epsilon)), (xa, ya)])
    m.initial_state(
        q=[
            -0.0617138900142764496358948458001,
            0,
            0.455279819163070380255912382449,
            0.222668390165885884674473185609,
            0.487364979543842550225598953530,
            -0.222668390165885884674473185609,
            1.23054744454982119249735015568,
        ]
    )
    m.suggest(dt=1e-4, t_end=0.03)
    return m
