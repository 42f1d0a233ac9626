"""Two gears with play between their teeth.

Closed form: with elastic flanks the pitch lines part at the speed at which they met, so that
impacts follow each other after play / |R_1 omega_1 + R_2 omega_2|, and energy and angular momenta
J_1 omega_1 / R_1 - J_2 omega_2 / R_2 stay. Seen: backlash as a pair of contacts.
"""

import signorini as sg


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("rattling_gears")
    m.doc = "Two gears that rattle in their play"
    one, two = m.coordinates("one two", units="rad rad")
    omega_1, omega_2 = m.velocities
    R_1, R_2, J_1, J_2, play, e_N = m.parameters(
        R_1=sg.par(0.1, unit="m", min=0, doc="pitch radius of the first gear"),
        R_2=sg.par(0.25, unit="m", min=0, doc="pitch radius of the second gear"),
        J_1=sg.par(1.0, unit="kg m^2", min=0, doc="inertia of the first gear"),
        J_2=sg.par(4.0, unit="kg m^2", min=0, doc="inertia of the second gear"),
        play=sg.par(0.01, unit="m", min=0, doc="play at the pitch line"),
        e_N=sg.par(1.0, min=0, max=1, doc="restitution of the flanks"),
    )
    m.lagrangian = J_1 * omega_1**2 / 2 + J_2 * omega_2**2 / 2
    m.coupling("teeth", R_1 * one + R_2 * two, play=play, e_N=e_N)
    m.output("momentum", J_1 * omega_1 / R_1 - J_2 * omega_2 / R_2)
    m.initial_state(q=[0, 0], v=[1, 0])
    m.suggest(dt=1e-2, t_end=2)
    return m
