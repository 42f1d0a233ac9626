"""Slide with a servo that is given a velocity and has a largest force, before a stop.

Closed form: with 10 N and 1 kg it has the commanded 1 m/s after 0.1 s, meets the stop at 0.5 m
after 0.55 s, presses it with 10 N, and leaves it at 1 s, when it is told to go back. Seen: a motor
is friction against the commanded velocity, with its force as the bound.
"""

import signorini as sg


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("servo")
    m.doc = "Slide with a velocity servo of limited force before a stop"
    (x,) = m.coordinates("x", units="m")
    (v,) = m.velocities
    (command,) = m.inputs("command")
    mass, force, limit, e_N = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass"),
        force=sg.par(10.0, unit="N", min=0, doc="largest force of the motor"),
        limit=sg.par(0.5, unit="m", doc="place of the stop"),
        e_N=sg.par(0.0, min=0, max=1, doc="restitution of the stop"),
    )
    m.lagrangian = mass * v**2 / 2
    m.friction("motor", gamma_F=v - command, bound=force)
    m.contact("stop", g_N=limit - x, e_N=e_N)
    m.shape([(x, 0.05)], radius=0.05)
    m.shape([(limit + 0.05, 0), (limit + 0.05, 0.12)])
    m.shape([(-0.2, 0), (limit + 0.05, 0)])
    m.initial_state(q=[0])
    m.suggest(dt=1e-2, t_end=1.5, inputs=lambda t, q, v: [1.0 if t < 1 - 1e-9 else -1.0])
    return m
