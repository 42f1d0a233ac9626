"""Planar hopper with a springy leg, driven by a feedback controller.

Raibert, Legged Robots That Balance (1986): body and foot on a sliding leg; inputs are the thrust of
the leg and the torque of the hip. `controller` keeps the hopping height and the forward speed.
Seen: hops towards its speed, the body level.
"""

from collections.abc import Callable
from math import cos

import numpy as np
import signorini as sg
import sympy as sp
from signorini.bodies import Planar


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("hopper")
    m.doc = "Planar hopper with a feedback controller"
    M, J, m_f, J_l, k, d, l_0, grav, mu = m.parameters(
        M=sg.par(5.0, unit="kg", min=0, doc="mass of the body"),
        J=sg.par(1.0, unit="kg m^2", min=0, doc="inertia of the body"),
        m_f=sg.par(0.1, unit="kg", min=0, doc="mass of the foot"),
        J_l=sg.par(0.01, unit="kg m^2", min=0, doc="inertia of the leg"),
        k=sg.par(2500.0, unit="N/m", min=0, doc="stiffness of the leg"),
        d=sg.par(8.0, unit="N s/m", min=0, doc="damping of the leg"),
        l_0=sg.par(0.5, unit="m", min=0, doc="free length"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        mu=sg.par(0.8, min=0, doc="friction coefficient"),
    )
    thrust, hip = m.inputs("thrust hip")
    world = Planar(m, gravity=(0, -grav))
    body = world.body("body", M, J, coordinates="x y phi")
    # leg: absolute angle from the vertical and length from hip to foot
    psi, length = m.coordinates("psi length")
    psi_dot, length_dot = m.velocities[3:]
    x, y = body.origin
    leg = world.frame("leg", psi, (x + length * sp.sin(psi), y - length * sp.cos(psi)))
    foot = leg.point()
    world.particle("foot", m_f, foot)
    world.add_energy(J_l / 2 * psi_dot**2, k / 2 * (length - l_0) ** 2)
    m.force({"length": thrust - d * length_dot, "psi": hip, "phi": -hip})
    world.contact("ground", foot, world.plane(), mu=mu)
    m.shape([body.point(-0.25, 0).position, body.point(0.25, 0).position])
    m.shape([(x, y), foot.position])
    m.initial_state(q={"y": l_0 + sp.Rational(3, 10), "length": l_0})
    m.suggest(dt=1e-3, t_end=6, inputs=controller())
    return m


def controller(
    speed: float = 0.5,
) -> Callable[[float, np.ndarray, np.ndarray], np.ndarray]:
    """Raibert's three parts: thrust while the leg extends, attitude in stance, foot placement.

    Parameters
    ----------
    speed : float
        Forward speed to keep [m/s].

    Returns
    -------
    callable (t, q, v) -> (thrust, hip)
        For ``Stepper.simulate(inputs=...)``.
    """
    stance = 0.15  # duration of a stance [s]

    def inputs(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        _x, y, phi, psi, length = q
        v_x, _v_y, omega, psi_dot, length_dot = v
        if y - length * cos(psi) < 2e-3:
            # the hip's torque acts on the leg; its reaction levels the body
            return np.array([30.0 if length_dot > 0 else 0.0, 60.0 * phi + 10.0 * omega])
        forward = v_x * stance / 2 + 0.1 * (v_x - speed)
        wanted = float(np.arcsin(np.clip(forward / length, -0.5, 0.5)))
        return np.array([0.0, -20.0 * (psi - wanted) - psi_dot])

    return inputs
