"""Freewheel driven by a sine torque against a brake: goes forward in steps.

Closed form: it lets go when T sin(Omega t) exceeds the brake torque M, turns with
J omega = T (cos(Omega t_1) - cos(Omega t)) / Omega - M (t - t_1) until that is zero again, and is
held until the next period. Seen: a velocity that goes one way only.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("freewheel")
    m.doc = "Freewheel that a sine torque turns forward in steps"
    (phi,) = m.coordinates("phi", units="rad")
    (omega,) = m.velocities
    J, T, M, Omega, e_N = m.parameters(
        J=sg.par(0.2, unit="kg m^2", min=0, doc="inertia"),
        T=sg.par(3.0, unit="N m", doc="amplitude of the torque"),
        M=sg.par(1.0, unit="N m", doc="torque against it"),
        Omega=sg.par(10.0, unit="rad/s", doc="frequency of the torque"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution"),
    )
    m.lagrangian = J * omega**2 / 2 - M * phi
    m.force({"phi": T * sp.sin(Omega * m.time)})
    m.one_way("clutch", omega, e_N=e_N)
    m.shape([(0, 0), (sp.cos(phi), sp.sin(phi))])
    m.shape([(0, 0)], radius=1)
    m.initial_state(q=[0])
    m.suggest(dt=1e-3, t_end=2)
    return m
