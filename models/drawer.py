"""Drawer pulled off its middle: slides, or jams by its own friction.

Closed form: a drawer of length l in a narrow guide, pulled by a force at the distance e from its
axis, is held by two corners on opposite sides with N = F e / l each; friction 2 mu N beats F, the
drawer jams whatever the force, iff 2 mu e > l.
"""

import signorini as sg
from signorini.bodies import Planar, inertia


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("drawer")
    m.doc = "Drawer that jams when pulled off its middle"
    mass, length, width, play, mu, e_N, e, F = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass"),
        length=sg.par(0.3, unit="m", min=0, doc="length in the guide"),
        width=sg.par(0.2, unit="m", min=0, doc="width"),
        play=sg.par(1e-4, unit="m", min=0, doc="clearance on each side"),
        mu=sg.par(0.8, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
        e=sg.par(0.25, unit="m", doc="distance of the pull from the middle"),
        F=sg.par(10.0, unit="N", doc="pull"),
    )
    world = Planar(m)
    body = world.body("drawer", mass, inertia.rectangle(mass, length, width), coordinates="x y phi")
    guide = width / 2 + play
    walls = {
        -1: world.plane(world.ground.point(0, -guide), (0, 1)),
        1: world.plane(world.ground.point(0, guide), (0, -1)),
    }
    corners = ((-1, 1), (1, 1), (1, -1), (-1, -1))
    points = [body.point(i * length / 2, j * width / 2) for i, j in corners]
    for (i, j), point in zip(corners, points, strict=True):
        name = ("upper" if j > 0 else "lower") + ("_front" if i > 0 else "_back")
        world.contact(name, point, walls[j], mu=mu, e_N=e_N)
    world.force(body.point(length / 2, e), (F, 0))
    m.shape([p.position for p in points], closed=True)
    for j in (-1, 1):
        m.shape([(-length, j * guide), (length, j * guide)])
    m.initial_state(q=[0, 0, 0])
    m.suggest(dt=1e-3, t_end=0.5)
    return m
