"""Box in space on a plane: eight corners, spatial friction, unit quaternion.

The quaternion p keeps its length by g = |p|^2 - 1; the term c (p . p_dot)^2 in T, zero on the
constraint, makes the mass matrix regular. Seen: tumbling, rest on four corners with equal
percussions.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("box_in_space")
    m.doc = "Box in space that tumbles onto a plane"
    r = sp.Matrix(m.coordinates("x y z", units="m m m"))
    p = sp.Matrix(m.coordinates("p0 p1 p2 p3", units="quaternion " * 4))
    velocities = m.velocities
    v, p_dot = sp.Matrix(velocities[:3]), sp.Matrix(velocities[3:])
    mass, a, b, c, grav, mu, e_N = m.parameters(
        mass=sg.par(1.0, unit="kg", doc="mass"),
        a=sg.par(0.2, unit="m", doc="half length"),
        b=sg.par(0.15, unit="m", doc="half width"),
        c=sg.par(0.1, unit="m", doc="half height"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.3, min=0, doc="friction coefficient"),
        e_N=sg.par(0.1, min=0, max=1, doc="restitution"),
    )
    inertia = sp.diag(b**2 + c**2, a**2 + c**2, a**2 + b**2) * mass / 3
    p0, p1, p2, p3 = p
    # Angular velocity in the body's frame: omega = 2 H(p) p_dot.
    H = sp.Matrix([[-p1, p0, p3, -p2], [-p2, -p3, p0, p1], [-p3, p2, -p1, p0]])
    omega = 2 * H * p_dot
    stretch = 2 * mass * (a**2 + b**2 + c**2) / 3
    T = mass / 2 * v.dot(v) + omega.dot(inertia * omega) / 2 + stretch * p.dot(p_dot) ** 2
    m.lagrangian = T - mass * grav * r[2]
    m.constraint("unit", p.dot(p) - 1)
    A = sp.Matrix(
        [
            [p0**2 + p1**2 - p2**2 - p3**2, 2 * (p1 * p2 - p0 * p3), 2 * (p1 * p3 + p0 * p2)],
            [2 * (p1 * p2 + p0 * p3), p0**2 - p1**2 + p2**2 - p3**2, 2 * (p2 * p3 - p0 * p1)],
            [2 * (p1 * p3 - p0 * p2), 2 * (p2 * p3 + p0 * p1), p0**2 - p1**2 - p2**2 + p3**2],
        ]
    )
    corners = []
    for k in range(8):
        signs = [1 if k >> j & 1 else -1 for j in range(3)]
        corner = sp.Matrix([signs[0] * a, signs[1] * b, signs[2] * c])
        place = tuple(r + A * corner)
        slip = v + A * omega.cross(corner)
        m.contact(
            f"C{k}",
            g_N=place[2],
            gamma_F=[slip[0], slip[1]],
            mu=mu,
            e_N=e_N,
            at=place,
            normal=(0, 0, 1),
        )
        corners.append(place)
    m.shape(corners, convex=True)
    m.shape([(0, 0, 0)], normal=(0, 0, 1))
    m.initial_state(
        q=[0, 0, 0.5, sp.cos(0.2), sp.sin(0.2) * 0.6, sp.sin(0.2) * 0.8, 0],
        v=[0.3, 0, 0, 0, 0, 0, 0],
    )
    m.suggest(dt=5e-3, t_end=1.5)
    return m
