"""Ball that rolls and spins on a plane until resistance to both has stopped it.

Closed form, rolling without slip on a radius rho of rolling and sigma of drilling resistance: with
k = 1 + J / (m R^2) it decelerates by a = rho g / (R k) and runs v^2 / (2 a) far, straight on; the
spin about the normal, on its own, ends after J omega / (sigma m g). Seen: both rest exactly.
"""

import signorini as sg
from signorini.bodies import Round, Spatial, inertia


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("rolling_ball")
    m.doc = "Ball that rolls and spins until resistance to both stops it"
    mass, R, grav, mu, e_N, rho, sigma = m.parameters(
        mass=sg.par(0.3, unit="kg", min=0, doc="mass"),
        R=sg.par(0.04, unit="m", min=0, doc="radius"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.4, min=0, doc="friction coefficient"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
        rho=sg.par(0.001, unit="m", min=0, doc="radius of rolling resistance"),
        sigma=sg.par(0.0004, unit="m", min=0, doc="radius of drilling resistance"),
    )
    world = Spatial(m, gravity=(0, 0, -grav))
    ball = world.body("ball", mass, inertia.ball(mass, R), coordinates="x y z p0 p1 p2 p3")
    world.contact(
        *("plane", Round(ball.point(), R), world.plane()),
        **{"mu": mu, "e_N": e_N, "rolling": rho, "drilling": sigma},
    )
    m.output("omega_z", ball.spin[2])
    v_x, v_y = 0.6, 0.3
    world.initial_state(q={"z": R}, v={"x": v_x, "y": v_y}, spin={"ball": (-v_y / R, v_x / R, 20)})
    m.suggest(dt=5e-3, t_end=5)
    return m
