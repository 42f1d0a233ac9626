"""Ball on an inclined plane: rolls or slips.

Closed form: it sticks iff tan(alpha) <= 7/2 mu and then has the acceleration 5/7 g sin(alpha);
otherwise g (sin(alpha) - mu cos(alpha)). Gravity is tilted instead of the plane.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Round, Spatial, inertia


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("sphere_on_incline")
    m.doc = "Ball on an incline: sticks iff tan(alpha) <= 3.5 mu"
    mass, R, grav, alpha, mu, e_N = m.parameters(
        mass=sg.par(0.3, unit="kg", min=0, doc="mass"),
        R=sg.par(0.04, unit="m", min=0, doc="radius"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        alpha=sg.par(0.6, unit="rad", doc="inclination"),
        mu=sg.par(0.2, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
    )
    world = Spatial(m, gravity=(grav * sp.sin(alpha), 0, -grav * sp.cos(alpha)))
    ball = world.body("ball", mass, inertia.ball(mass, R), coordinates="x y z p0 p1 p2 p3")
    world.contact("plane", Round(ball.point(), R), world.plane(), mu=mu, e_N=e_N)
    m.output("omega_y", ball.spin[1])
    world.initial_state(q={"z": R})
    m.suggest(dt=5e-3, t_end=1)
    return m
