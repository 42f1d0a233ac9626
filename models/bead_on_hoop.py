"""Bead on a hoop that is spun up about its vertical diameter: the Lagrangian depends on time.

The hoop's rate rises as Omega (1 - exp(-t/tau)). Closed form: with damping the bead settles at the
relative equilibrium cos(theta) = g / (R Omega^2), a pitchfork at Omega^2 = g / R.
Seen: the bead lies on a peg near the bottom and leaves it once the hoop is fast enough.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Spatial


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("bead_on_hoop")
    m.doc = "Bead on a rotating hoop that is spun up; equilibrium angle"
    mass, R, grav, Omega, tau, c, stop, e_N = m.parameters(
        mass=sg.par(0.1, unit="kg", min=0, doc="mass of the bead"),
        R=sg.par(0.3, unit="m", min=0, doc="radius of the hoop"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        Omega=sg.par(8.0, unit="rad/s", doc="final rate of the hoop"),
        tau=sg.par(0.5, unit="s", min=0, doc="time constant of the run-up"),
        c=sg.par(0.02, unit="N m s", min=0, doc="damping"),
        stop=sg.par(0.05, unit="rad", doc="angle of the peg"),
        e_N=sg.par(0.5, min=0, max=1, doc="restitution at the peg"),
    )
    (theta,) = m.coordinates("theta")
    (theta_dot,) = m.velocities
    t = m.time
    world = Spatial(m, gravity=(0, 0, -grav))
    hoop = world.frame("hoop", (0, 0, 1), Omega * (t - tau * (1 - sp.exp(-t / tau))))
    bead = world.frame("bead", at=(R * sp.sin(theta), 0, -R * sp.cos(theta)), parent=hoop)
    world.particle("bead", mass, bead.point())
    m.force([-c * theta_dot])
    m.contact("peg", g_N=theta - stop, e_N=e_N)
    around = [2 * sp.pi * k / 36 for k in range(36)]
    m.shape([hoop.point(R * sp.sin(a), 0, -R * sp.cos(a)).position for a in around], closed=True)
    m.shape([hoop.point().position, bead.origin])
    m.output("height", bead.origin[2])
    m.initial_state(q=[0.1])
    m.suggest(dt=1e-2, t_end=12)
    return m
