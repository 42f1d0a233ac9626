"""Models built to catch faults: every feature of the front end in an inconvenient place."""

import casadi as ca
import numpy as np
import signorini as sg
import sympy as sp
from signorini.models import ribbed_floor


def rheonomic() -> sg.Model:
    """Time in L, f, g, gamma, g_N, gamma_F, bound; chi != 0 everywhere; L not separable."""
    m = sg.Model("rheonomic")
    x, y, z, phi, psi = m.coordinates("x y z phi psi")
    vx, vy, vz, w, wp = m.velocities
    t = m.time
    m1, k, a, mu, e_N, e_F, om = m.parameters(
        m1=1.3, k=2.0, a=0.4, mu=0.35, e_N=0.3, e_F=0.2, om=1.7
    )
    u1, u2 = m.inputs("u1 u2")
    m.lagrangian = (
        m1 / 2 * (vx**2 + vy**2 + vz**2) * (1 + sp.Rational(1, 5) * sp.sin(x) * sp.cos(t))
        + a**2 / 2 * w**2 * (2 + sp.cos(phi))
        + wp**2 / 5
        + wp * w / 10 * sp.cos(psi - t)
        + sp.Rational(1, 3) * vx * w * sp.cos(phi + t)
        + vy * x * sp.sin(om * t)
        - m1 * 9.81 * y
        - k / 2 * (z - sp.sin(t)) ** 2
    )
    m.force([u1 - 0.1 * vx * vy, 0.2 * u2 * x, -0.3 * vz + u1 * sp.cos(t), -0.05 * w**3, u2 / 9])
    m.force({"phi": u2 * sp.sin(phi)})
    m.constraint("link", z - a * sp.sin(phi) - sp.Rational(1, 10) * sp.sin(2 * t))
    m.velocity_constraint(
        "roll", vx - a * w * sp.cos(phi) - sp.Rational(1, 5) * sp.cos(t) * (1 + x)
    )
    m.contact(
        "table",
        g_N=y - sp.Rational(1, 10) * sp.sin(om * t) - sp.Rational(1, 20) * sp.cos(x),
        gamma_F=[vx + a * w - sp.Rational(1, 2) * sp.cos(t), vz * (1 + x**2) + wp / 4 + sp.sin(t)],
        mu=mu,
        e_N=e_N,
        e_F=e_F,
    )
    m.output("height", y + u1 * sp.Abs(x))
    m.initial_state(
        q=[0.1, 0.6, a * sp.sin(0.2), 0.2, 0.4],
        v=[
            a * 0.5 * sp.cos(0.2) + sp.Rational(1, 5) * sp.Rational(11, 10),
            -0.4,
            a * sp.cos(0.2) * 0.5 + sp.Rational(1, 5),
            0.5,
            -0.7,
        ],
    )
    return m


def mixed_contacts() -> sg.Model:
    """Frictionless, planar, spatial contacts, a guard; friction with a bound or pressed by them."""
    m = sg.Model("mixed_contacts", symbols="casadi")
    x, y, z, s = m.coordinates("x y z s", velocities="u v w r")
    vx, vy, vz, vs = m.velocities
    t = m.time
    mass, c, mu, e = m.parameters(mass=sg.par(0.7, unit="kg"), c=0.3, mu=0.4, e=0.6)
    (push,) = m.inputs("push")
    m.lagrangian = (
        0.5 * mass * (vx**2 + vy**2 + vz**2)
        + 0.5 * c * vs**2
        + 0.1 * vs * vx * ca.cos(s)
        - mass * 9.81 * z
        - 0.5 * (s - x) ** 2
    )
    m.force(
        [
            push,
            0.3 * ca.sin(3 * t) + 0.1 * ca.cos((-x) * y),
            ca.if_else(vz > 0, -0.1 * vz, -0.2 * vz),
            0,
        ]
    )
    m.contact("ground", g_N=z - 0.1 * ca.sin(x), gamma_F=[vx, vy + 0.1 * vx * y], mu=mu, e_N=e)
    m.contact("wall", g_N=1 - x + 0.05 * y**2, gamma_F=vy + 0.2 * ca.cos(t), mu=2 * mu, e_N=0.1)
    m.contact("stop", g_N=s + 0.3 + 0.02 * t, e_N=e / 2)
    m.contact("ledge", g_N=z - 0.25, gamma_F=[vx, vy], mu=0.2, e_N=0, guard=y - 0.2)
    m.friction(
        "brake", gamma_F=vs - 0.5 * vx, bound=0.4 + 0.2 * ca.sin(t) + 0.1 * x**2 + 0.1 * push
    )
    m.friction("plate", gamma_F=[vx - 0.1, vy * ca.cos(x)], bound=0.2)
    m.friction("shoe", gamma_F=vs + 0.2 * vy, mu=0.15, pressed_by="ground")
    m.friction("pad", gamma_F=[vs - 0.3, vx + 0.2 * vs], mu=0.1, pressed_by="ledge")
    m.initial_state(q=[0.1, 0.1, 0.6, 0.0], v=[0.8, 0.3, 0, -0.5])
    return m


def pressed() -> sg.Model:
    """A ball above two planes, each of which presses sliding, rolling and spinning friction."""
    m = sg.Model("pressed", symbols="casadi")
    _x, y, z, *_turns = m.coordinates("x y z a b c")
    v_x, v_y, v_z, a, b, c = m.velocities
    mass, mu, rho = m.parameters(mass=0.7, mu=0.4, rho=0.1)
    m.lagrangian = 0.5 * mass * (v_x**2 + v_y**2 + v_z**2 + 0.4 * (a**2 + b**2 + c**2)) - 7 * z
    m.contact(
        *("ground",),
        **{"g_N": z, "gamma_F": [v_x - b, v_y + a], "mu": mu, "e_N": 0.3},
        rolling=(rho, [a, b]),
        drilling=(0.5 * rho, c),
    )
    m.contact("wall", g_N=y + 0.05, gamma_F=[v_x + c, v_z], mu=0.3, rolling=(rho, [a + 0.1, c]))
    m.initial_state(q=[0, 0, 0.005, 0, 0, 0], v=[0.5, -1, -1, 0.3, 0.2, 1.0])
    return m


def every_row() -> sg.Model:
    """A row of every kind: constraints, contacts without friction, in the plane, in space, given
    bounds."""
    m = sg.Model("every_row", symbols="casadi")
    x, y, z, s = m.coordinates("x y z s", velocities="u v w r")
    vx, vy, vz, vs = m.velocities
    m.lagrangian = (
        0.5 * (vx**2 + vy**2 + vz**2 + vs**2)
        + 0.3 * vs * vx * ca.cos(s)
        - 9.81 * z
        - 0.5 * (s - x) ** 2
    )
    m.constraint("guide", [s - 0.1 * y**2])
    m.velocity_constraint("wheel", [vx - 0.2 * vy * ca.cos(s)])
    m.contact("ground", g_N=z - 0.1 * ca.sin(x), gamma_F=[vx, vy], mu=0.3, e_N=0.5)
    m.contact("wall", g_N=1 - x, gamma_F=vy, mu=0.5)
    m.contact("stop", g_N=s + 0.3)
    m.friction("brake", gamma_F=vs, bound=0.4 + 0.1 * x**2)
    m.friction("plate", gamma_F=[vx - 0.1, vy], bound=0.2)
    m.initial_state(q={"z": 0.6})
    return m


def unconstrained() -> sg.Model:
    """No constraint at all: a double pendulum in absolute angles."""
    m = sg.Model("unconstrained")
    q, h = m.coordinates("q h")
    qd, hd = m.velocities
    (g,) = m.parameters(g=9.81)
    m.lagrangian = qd**2 + hd**2 / 2 + qd * hd * sp.cos(q - h) + 2 * g * sp.cos(q) + g * sp.cos(h)
    m.initial_state(q=[1.0, 0.5], v=[0.1, -0.3])
    return m


def only_constraints() -> sg.Model:
    """A Chaplygin sleigh on a driven rail: position and velocity constraints, no contact."""
    m = sg.Model("only_constraints", symbols="casadi")
    x, _y, th, b = m.coordinates("x y th b")
    vx, vy, om, vb = m.velocities
    t = m.time
    m.lagrangian = 0.5 * (vx**2 + vy**2) + 0.1 * om**2 + 0.2 * vb**2 + 0.05 * vb * om
    m.velocity_constraint("blade", -ca.sin(th) * vx + ca.cos(th) * vy - 0.3 * om)
    m.constraint("drive", b - 0.2 * ca.sin(t) - 0.1 * x**2)
    m.initial_state(q=[0, 0, 0.3, 0], v=[ca.cos(0.3), ca.sin(0.3), 0, 0.2])
    return m


def one_coordinate() -> sg.Model:
    """The smallest model: a ball on a moving table."""
    m = sg.Model("one_coordinate")
    (y,) = m.coordinates("y")
    (vy,) = m.velocities
    m.lagrangian = vy**2 / 2 - 10 * y
    m.contact("table", g_N=y - sp.sin(5 * m.time) / 20, e_N=0.5)
    m.initial_state(q=[0.3])
    return m


def sticking_incline() -> sg.Model:
    """Spatial friction with tangential restitution, frozen Lagrangian parameters."""
    m = sg.Model("sticking_incline")
    x, y, z = m.coordinates("x y z")
    vx, vy, vz = m.velocities
    mass, mu, e_F = m.parameters(mass=2.0, mu=0.6, e_F=0.4)
    m.lagrangian = mass / 2 * (vx**2 + vy**2 + vz**2) - mass * (9.81 * z + 3 * x)
    m.contact(
        "plane",
        g_N=z + sp.Rational(1, 10) * x * y,
        gamma_F=[vx + vz / 10, vy - y * vz / 5],
        mu=mu,
        e_N=sp.Rational(1, 4),
        e_F=e_F,
    )
    m.initial_state(q=[0, 0, 0.3], v=[1, -0.5, 0])
    return m


def forms() -> sg.Model:
    """Every form of expression that translation, graph and printing treat in a way of their own."""
    m = sg.Model("forms")
    x, y, z = m.coordinates("x y z")
    vx, vy, vz = m.velocities
    t = m.time
    a, b = m.parameters(a=1.7, b=0.6)
    r = x**2 + y**2 + sp.Rational(6, 5)
    m.lagrangian = (
        vx**2 / 2
        + vy**2 * sp.sqrt(r) / 3
        - sp.Rational(7, 3) * -(vz**2)
        + a / (b / (r + z**2))
        - x / (y * z + 9) / (a + 2)
        - (x - (y - (z - b * x)))
        - sp.Rational(5, 2) * r ** sp.Rational(3, 2) / 9
        + r ** sp.Rational(-1, 2)
        + 2 / r**3
        + r ** sp.Rational(-5, 2)
        + sp.cos(-x * y) * sp.sin(-z)
        - sp.exp(-x) * sp.log(r, 10) * sp.cos(y - x)
        + (x / 4) / (y / 8 + 3)
        + sp.pi * sp.E * x / 123456789.123456789
    )
    m.force(
        [
            sp.Piecewise((x, x > t), (2 * y, sp.And(y < 1, z >= -5)), (z**3, True)),
            sp.Max(x, y, 2 * z) - sp.Min(x, y) * sp.Abs(z) + sp.sign(x - y) * a,
            sp.atan2(y, x + 3)
            + sp.tanh(x) * sp.asinh(y)
            - sp.sec(z / 4)
            + sp.floor(3 * x) / 7
            + sp.Piecewise((2, z > sp.Rational(1, 2)), (-1, True))
            + sp.Piecewise((vx, sp.Or(vx <= 0, sp.Not(vy > 0))), (vy**2, True)),
        ]
    )
    m.contact("c", g_N=z + 4 - (x - y) / 9, gamma_F=vx - (vy - vz), mu=a - b, e_N=b)
    m.output("angle", sp.acos(x / 9) - sp.asin(y / 9) * sp.atan(z) + sp.sinh(x) / sp.cosh(y))
    m.initial_state(q=[0.3, 0.2, 0.5], v=[0.1, 0.2, 0.3])
    return m


def chain(links: int = 10) -> sg.Model:
    """Planar chain of `links` rods in absolute angles, a wall at the tip."""
    m = sg.Model(f"chain_{links}")
    phi = m.coordinates(" ".join(f"phi_{k}" for k in range(links)))
    w = m.velocities
    (grav,) = m.parameters(grav=9.81)
    T: sp.Expr = sp.Integer(0)
    V: sp.Expr = sp.Integer(0)
    x_dot = y_dot = x = y = sp.Integer(0)
    for k in range(links):
        half_x, half_y = sp.sin(phi[k]) / 2, -sp.cos(phi[k]) / 2
        vx, vy = x_dot + w[k] * sp.cos(phi[k]) / 2, y_dot + w[k] * sp.sin(phi[k]) / 2
        T += (vx**2 + vy**2) / 2 + w[k] ** 2 / 24
        V += grav * (y + half_y)
        x, y = x + 2 * half_x, y + 2 * half_y
        x_dot, y_dot = x_dot + w[k] * sp.cos(phi[k]), y_dot + w[k] * sp.sin(phi[k])
    m.lagrangian = T - V
    m.contact("wall", g_N=sp.Rational(1, 2) + x, gamma_F=y_dot, mu=0.3, e_N=0.5)
    m.initial_state(q=[0.3 + 0.05 * k for k in range(links)])
    return m


def forty_coordinates() -> sg.Model:
    """A net of twenty particles: stiff cubic springs, a rod, a driven node, floor and walls."""
    m = sg.Model("forty_coordinates")
    q = m.coordinates(" ".join(f"x_{k} y_{k}" for k in range(20)))
    v = m.velocities
    k_1, k_3, grav, c, mu, e = m.parameters(k_1=80.0, k_3=5.0, grav=9.81, c=0.1, mu=0.3, e=0.5)
    (wind,) = m.inputs("wind")
    x, y = q[0::2], q[1::2]
    # Mass grows along the net; neighbours share some inertia, so that M is not diagonal.
    T: sp.Expr = sum(((1 + sp.Rational(k, 40)) * v[k] ** 2 / 2 for k in range(40)), sp.Integer(0))
    V: sp.Expr = sum((grav * (1 + sp.Rational(k, 20)) * y[k] for k in range(20)), sp.Integer(0))
    links = [(k, k + 1) for k in range(19) if k % 5 != 4] + [(k, k + 5) for k in range(15)]
    for a, b in links:
        stretch = (x[a] - x[b]) ** 2 + (y[a] - y[b]) ** 2 - 1
        V += k_1 / 8 * stretch**2 + k_3 / 4 * (x[a] - x[b]) ** 4
        T += (v[2 * a] + v[2 * b] + x[a] * v[2 * b + 1] / 5) ** 2 / 20
    m.lagrangian = T - V
    m.force([wind * (1 + y[k // 2]) if k % 2 == 0 else -c * v[k] ** 3 for k in range(40)])
    m.constraint("rod", (x[0] - x[6]) ** 2 + (y[0] - y[6]) ** 2 - 2)
    m.constraint("drive", y[15] - 4 - sp.sin(3 * m.time) / 10)
    for k in (0, 2, 4):
        m.contact(
            f"floor_{k}",
            g_N=y[k] - sp.cos(x[k]) / 10,
            gamma_F=v[2 * k] - sp.Rational(k, 10),
            mu=mu,
            e_N=e,
        )
    m.contact("wall", g_N=x[10] + (7 - y[10]) / 20, gamma_F=v[21], mu=2 * mu, e_N=0)
    m.initial_state(
        q=[value for k in range(20) for value in (k % 5, k // 5 + 1)],
        v=[sp.Rational(3, 10) if k == 31 else 0 for k in range(40)],
    )
    return m


# A force, a gap and a potential from tables in one and two dimensions.
DRAG = sg.table([-3.0, -1.0, 0.0, 1.0, 2.0, 5.0], [-4.0, -1.0, 0.0, 1.0, 3.0, 9.0], name="drag")
GROUND = sg.table(
    np.linspace(-1, 3, 9),
    [0.1, 0.3, 0.0, -0.2, 0.1, 0.2, 0.15, 0.1, 0.1],
    ends="periodic",
    name="ground",
)
BUMPS = sg.table(
    ([-1.0, 0.0, 1.0, 2.5], [0.0, 0.5, 1.0]),
    [[0.0, 0.3, 0.1], [0.2, 0.7, 0.4], [0.0, 0.1, 0.6], [0.5, 0.2, 0.1]],
    ends=("not-a-knot", "natural"),
)


def tabulated(symbols: str = "sympy") -> sg.Model:
    """Tables in a force, a gap, a slip velocity and the Lagrangian."""
    m = sg.Model("tabulated", symbols=symbols)
    x, y = m.coordinates("x y")
    vx, vy = m.velocities
    m.lagrangian = (vx**2 + vy**2) / 2 - 9.81 * y - BUMPS(x, y) / 10
    m.force([-DRAG(vx) / 10, 0])
    m.contact("floor", g_N=y - GROUND(x), gamma_F=vx + vy * GROUND(x), mu=0.3, e_N=0.5)
    m.initial_state(q=[0, 1], v=[1, 0])
    return m


TRAPS = (
    rheonomic,
    mixed_contacts,
    unconstrained,
    only_constraints,
    one_coordinate,
    sticking_incline,
)


def anisotropic() -> sg.Model:
    """A block on ribs, with a belt that rubs it by a given bound, and a frictionless side."""
    m = ribbed_floor.model()
    (x, y, _z), (vx, vy, _vz) = m.q, m.velocities
    m.friction("belt", gamma_F=[vx - vy / 4], bound=0.7)
    m.contact("side", g_N=y + 2 + x / 8, e_N=0.5)
    return m


def laws() -> sg.Model:
    """Friction pressed by the percussions of a joint, a coefficient of the stages, restitution of
    percussions."""
    m = sg.Model("laws", symbols="casadi")
    x, y, z, s = m.coordinates("x y z s", velocities="u v w r")
    vx, vy, vz, vs = m.velocities
    mass, mu = m.parameters(mass=1.2, mu=0.3)
    m.lagrangian = (
        0.5 * mass * (vx**2 + vy**2 + vz**2 + 0.5 * vs**2) - 9.81 * mass * z - 0.5 * (s - x) ** 2
    )
    m.constraint("guide", [y - 0.1 * ca.sin(x), s - 0.2 * y**2 - 0.5 * x])
    m.friction("rub", gamma_F=[vx, vs], bound=mu * m.reaction("guide"))
    m.friction("seal", gamma_F=vz, bound=0.2 * m.reaction("guide", 1))
    m.contact(
        *("floor",),
        **{"g_N": z - 0.05 * x, "gamma_F": [vx, vy], "e_N": 0.6, "impact": "poisson"},
        **{"mu": 0.2 + 0.2 / (1 + vx**2 + vy**2), "mu_at": "stages"},
    )
    m.contact("wall", g_N=0.3 - x, e_N=0.5, impact="poisson")
    m.contact("stop", g_N=0.4 - z, gamma_F=vx, mu=mu, e_N=0.2)
    m.initial_state(q={"z": 0.02}, v=[0.3, 0.03, -0.5, 0.15])
    return m


def ratchet() -> sg.Model:
    """A wheel that turns one way beside a slider with a stop: velocities and gaps among the normal
    rows."""
    m = sg.Model("ratchet", symbols="casadi")
    phi, x = m.coordinates("phi x")
    w, u = m.velocities
    J, k = m.parameters(J=0.7, k=4.0)
    m.lagrangian = J * (w**2 + u**2 + 0.3 * w * u * ca.cos(phi)) / 2 - k * (phi - x) ** 2 / 2
    m.contact("stop", g_N=0.3 - x + 0.05 * ca.sin(phi), gamma_F=w, mu=0.3, e_N=0.4)
    m.one_way("pawl", w + 0.1 * ca.sin(x) * u)
    m.contact("wall", g_N=0.4 + x, e_N=0.5)
    m.initial_state(q=[0.0, 0.1], v=[0.5, 0.8])
    return m


def yielding() -> sg.Model:
    """A box that lands on compliant corners, on a compliant tether, before a rigid wall."""
    m = sg.Model("yielding")
    x, y, phi = m.coordinates("x y phi")
    v_x, v_y, omega = m.velocities
    a, b, mu, c, tau, c_rope = m.parameters(a=0.2, b=0.1, mu=0.3, c=1e-4, tau=1e-3, c_rope=1e-3)
    m.lagrangian = (v_x**2 + v_y**2) / 2 + (a**2 + b**2) / 6 * omega**2 - 9.81 * y
    s, k = sp.sin(phi), sp.cos(phi)
    for name, side in (("right", 1), ("left", -1)):
        gap = y + s * side * a - k * b
        slip = v_x + (k * b - s * side * a) * omega
        m.contact(name, g_N=gap, gamma_F=slip, mu=mu, compliance=c, relaxation=tau)
    m.contact("wall", g_N=1 - x, e_N=0.5)
    m.constraint("tether", sp.sqrt((x - 0.5) ** 2 + (y - 1) ** 2) - 0.9, compliance=c_rope)
    m.initial_state(q=[0, 0.2, 0.1], v=[2, 0, 0])
    return m


def jammed() -> sg.Model:
    """A cart in a rough rail, in the plane: its feet roll and rub, a strip rubs by itself."""
    m = sg.Model("jammed", symbols="casadi")
    x, y, phi = m.coordinates("x y phi")
    vx, vy, omega = m.velocities
    mass, mu = m.parameters(mass=0.8, mu=0.3)
    m.lagrangian = 0.5 * mass * (vx**2 + vy**2 + 0.1 * omega**2) - 9.81 * mass * y - x * y
    m.constraint("rail", x - 0.2 * ca.sin(phi))
    m.friction("upper", gamma_F=vy + 0.3 * omega, bound=mu * m.reaction("rail"))
    m.friction("strip", gamma_F=vx - 0.1, bound=0.3)
    m.contact("foot", g_N=y - 0.1 * phi, gamma_F=vx - omega, mu=mu, e_N=0.3, rolling=(0.05, omega))
    m.contact("roof", g_N=0.2 - y + 0.1 * x)
    m.initial_state(q=[0, 0.02, 0], v=[0.1, -0.6, 0.5])
    return m
