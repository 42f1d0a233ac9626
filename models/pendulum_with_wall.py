"""Chain of rods that swings against a wall.

Rods of equal length and mass in absolute angles, hinged in a row, their ends against a wall.
Closed forms: one rod released from the horizontal hits a wall below its hinge with
omega = sqrt(3 g / l); small vibrations have the frequencies of det(K - omega^2 M) = 0.
Seen: the ends rebound from the wall, the chain folds.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Planar, inertia


def model(links: int = 3) -> sg.Model:
    """Return the model with any number of links."""
    m = sg.Model("pendulum_with_wall")
    m.doc = "Chain of rods that swings against a wall"
    length, mass, grav, wall, mu, e_N = m.parameters(
        length=sg.par(0.4, unit="m", min=0, doc="length of a rod"),
        mass=sg.par(0.5, unit="kg", min=0, doc="mass of a rod"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        wall=sg.par(0.1, unit="m", doc="distance of the wall from the hinge"),
        mu=sg.par(0.2, min=0, doc="friction coefficient"),
        e_N=sg.par(0.5, min=0, max=1, doc="restitution"),
    )
    phi = m.coordinates(" ".join(f"phi_{k}" for k in range(1, links + 1)))
    world = Planar(m, gravity=(0, -grav))
    obstacle = world.plane(world.ground.point(-wall, 0), (1, 0))
    hinge = world.ground.point()
    for k, angle in enumerate(phi, start=1):
        # angle from the downward vertical, counter-clockwise
        at = hinge.position
        down = (at[0] + length / 2 * sp.sin(angle), at[1] - length / 2 * sp.cos(angle))
        rod = world.frame(f"rod_{k}", angle, down)
        world.body(f"rod_{k}", mass, inertia.rod(mass, length), frame=rod)
        hinge = rod.point(0, -length / 2)
        m.shape([rod.point(0, length / 2).position, hinge.position])
        world.contact(f"end_{k}", hinge, obstacle, mu=mu, e_N=e_N)
    m.shape([(-wall, -links * length), (-wall, 0)])
    m.initial_state(q=[sp.pi / 3] * links)
    m.suggest(dt=2e-3, t_end=2)
    return m
