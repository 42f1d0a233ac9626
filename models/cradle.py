"""Three equal balls in a row, the first one hits the others.

With e_N = 1 and touching balls Newton's impact law applied to all contacts at once gives the
velocities (-1/3, 2/3, 2/3) of the incoming one (Glocker, 2004); separated balls collide one after
the other and only the last one moves on. Both are right answers of their own model.
"""

import signorini as sg
from signorini.bodies import Planar, Round


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("cradle")
    m.doc = "Three balls in a row: simultaneous and sequential impacts"
    mass, R, apart, e_N = m.parameters(
        mass=sg.par(0.1, unit="kg", min=0, doc="mass of a ball"),
        R=sg.par(0.02, unit="m", min=0, doc="radius"),
        apart=sg.par(0.0, unit="m", min=0, doc="distance of the second and third ball"),
        e_N=sg.par(1.0, min=0, max=1, doc="restitution"),
    )
    x = m.coordinates("x_1 x_2 x_3", units="m m m")
    world = Planar(m)
    balls = []
    for k, place in enumerate(x, start=1):
        frame = world.frame(f"ball_{k}", at=(place, 0))
        world.particle(f"ball_{k}", mass, frame.point())
        balls.append(Round(frame.point(), R))
        m.shape([frame.origin], radius=R)
    for k in range(2):
        gap = x[k + 1] - x[k] - 2 * R
        m.contact(f"c_{k + 1}", g_N=gap, e_N=e_N, at=(x[k] + R, 0), normal=(1, 0))
    m.initial_state(q=[0, 0.05, 0.05 + 2 * R + apart], v=[1, 0, 0])
    m.suggest(dt=1e-3, t_end=0.1)
    return m
