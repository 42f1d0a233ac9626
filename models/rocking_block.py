"""Block that rocks on its two lower corners.

Closed forms (Housner, 1963): with e_N = 0 and sticking, every impact multiplies the angular
velocity by 1 - 1.5 sin(alpha)^2, tan(alpha) = width / height; the period of a slender block
released at theta_0 is 4/p arcosh(1 / (1 - theta_0/alpha)), p^2 = 3 g / (4 R), R half the diagonal.
"""

import signorini as sg
from signorini.bodies import Planar, inertia


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("rocking_block")
    m.doc = "Block that rocks on two corners"
    mass, width, height, grav, mu, e_N = m.parameters(
        mass=sg.par(10.0, unit="kg", min=0, doc="mass"),
        width=sg.par(0.2, unit="m", min=0, doc="width"),
        height=sg.par(1.0, unit="m", min=0, doc="height"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.8, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
    )
    world = Planar(m, gravity=(0, -grav))
    block = world.body("block", mass, inertia.rectangle(mass, width, height), coordinates="x y phi")
    floor = world.plane()
    for name, side in (("left", -1), ("right", 1)):
        world.contact(name, block.point(side * width / 2, -height / 2), floor, mu=mu, e_N=e_N)
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    m.shape([block.point(i * width / 2, j * height / 2).position for i, j in corners], closed=True)
    # leans on its right corner by 0.1 rad
    c, s = world.algebra.cos, world.algebra.sin
    lean = -0.1
    m.initial_state(
        q=[
            width / 2 - (width / 2 * c(lean) + height / 2 * s(lean)),
            -(width / 2 * s(lean) - height / 2 * c(lean)),
            lean,
        ]
    )
    m.suggest(dt=2e-3, t_end=4)
    return m
