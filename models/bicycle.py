"""The benchmark bicycle: four rigid bodies, two wheels that roll without slip, no rider's hand.

Meijaard, Papadopoulos, Ruina, Schwab, "Linearized dynamics equations for the balance and steer of a
bicycle", Proc. R. Soc. A 463 (2007), table 1. Closed form: the eigenvalues of its upright motion,
table 2; at 5 m/s all decay. Seen: a bicycle that a push makes steer, and that rights itself.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Ellipsoid, Spatial


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("bicycle")
    m.doc = "The benchmark bicycle rolls without hands"
    names = "x y z yaw lean pitch steer rear front"
    x, y, z, yaw, lean, pitch, steer, rear, front = m.coordinates(
        names, units="m m m rad rad rad rad rad rad"
    )
    speed, push, grav = m.parameters(
        speed=sg.par(5.0, unit="m/s", doc="forward speed"),
        push=sg.par(1.0, unit="rad/s", doc="rate of lean at the start"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
    )
    w, trail, R, R_front = 1.02, 0.08, 0.3, 0.35
    tilt = sp.pi / 10
    world = Spatial(m, gravity=(0, 0, -grav))
    heading = world.frame("heading", angle=yaw, at=(x, y, z))
    leaning = world.frame("leaning", (1, 0, 0), lean, parent=heading)
    trunk = world.frame("trunk", (0, 1, 0), pitch, parent=leaning)  # in the rear wheel's centre
    # the head's axis meets the ground behind the front contact by the trail
    hinge = world.frame("hinge", at=(w + trail, 0, -R), parent=trunk)
    fork = world.frame("fork", (-sp.sin(tilt), 0, sp.cos(tilt)), steer, parent=hinge)
    rider = world.frame("rider", at=(0.3, 0, 0.9 - R), parent=trunk)
    bar = world.frame("bar", at=(0.9 - w - trail, 0, 0.7), parent=fork)
    hub = world.frame("hub", at=(-trail, 0, R_front), parent=fork)
    rear_wheel = world.frame("rear_wheel", (0, 1, 0), rear, parent=trunk)
    front_wheel = world.frame("front_wheel", (0, 1, 0), front, parent=hub)
    # the tensors as printed, with z up
    B = ((9.2, 0, -2.4), (0, 11, 0), (-2.4, 0, 2.8))
    H = ((0.05892, 0, 0.00756), (0, 0.06, 0), (0.00756, 0, 0.00708))
    world.body("rider", 85, B, frame=rider)
    world.body("bar", 4, H, frame=bar)
    world.body("rear_wheel", 2, (0.0603, 0.12, 0.0603), frame=rear_wheel)
    world.body("front_wheel", 3, (0.1405, 0.28, 0.1405), frame=front_wheel)
    floor = world.plane()
    for name, wheel, r in (("rear", rear_wheel, R), ("front", front_wheel, R_front)):
        disc = Ellipsoid(wheel, (r, 0, r))
        world.touching(f"{name}_touches", disc, floor)
        world.rolling(f"{name}_rolls", disc, floor)
    head = fork.point(-0.9 * sp.tan(tilt), 0, 0.9).position
    saddle = trunk.point(0.15, 0, 0.55).position
    m.shape([trunk.origin, saddle, head, hub.origin])
    m.shape([trunk.origin, head])
    m.initial_state(
        q={"z": R},
        v={"x": speed, "rear": speed / R, "front": speed / R_front, "lean": push, "y": -R * push},
    )
    m.suggest(dt=1e-2, t_end=2)
    return m
