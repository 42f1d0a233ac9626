"""Coin that falls, rolls and comes to rest.

A flat spheroid on a plane with spatial friction; rolling and boring friction are friction elements
with constant torques that bring it to rest in finite time. Closed form without them: steady rolling
at constant lean satisfies
h m Omega V - m g sin(theta) cos(theta) (R^2 - b^2) / h = Omega sin(theta) (J_3 omega_3 - J_1 Omega
cos(theta)), derived in tests/test_collection.py. Seen: rolls in a narrowing spiral, lies flat.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Ellipsoid, Spatial, inertia


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("coin")
    m.doc = "Coin that rolls, falls and comes to rest"
    mass, R, b, grav, mu, e_N, M_roll, M_bore = m.parameters(
        mass=sg.par(0.008, unit="kg", min=0, doc="mass"),
        R=sg.par(0.012, unit="m", min=0, doc="radius"),
        b=sg.par(0.0015, unit="m", min=0, doc="half thickness"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.4, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
        M_roll=sg.par(4e-5, unit="N m", min=0, doc="rolling friction"),
        M_bore=sg.par(4e-5, unit="N m", min=0, doc="boring friction"),
    )
    world = Spatial(m, gravity=(0, 0, -grav))
    coin = world.body(
        "coin", mass, inertia.cylinder(mass, R, 2 * b), coordinates="x y z p0 p1 p2 p3"
    )
    world.contact("table", Ellipsoid(coin, (R, R, b)), world.plane(), mu=mu, e_N=e_N)
    m.friction("rolling", gamma_F=list(coin.spin[:2]), bound=M_roll)
    m.friction("boring", gamma_F=coin.spin[2], bound=M_bore)
    m.output("lean", sp.acos(coin.axes[2][2]))
    world.initial_state(
        q={"z": R},
        v={"x": -30 * R},
        attitude={"coin": ((1, 0, 0), sp.pi / 2 - sp.Rational(1, 5))},
        spin={"coin": (0, 0, 30)},
    )
    m.suggest(dt=1e-3, t_end=2)
    return m
