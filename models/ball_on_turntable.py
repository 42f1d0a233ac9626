"""Ball that rolls without slip on a turning table: a velocity constraint with chi != 0.

Closed form (Earnshaw, 1844): the centre moves on a circle with 2/7 of the table's rate for a solid
ball. A ball is a ball in every frame, so its angular velocity can stand in a Lagrangian by itself;
the angles belonging to it have no meaning. Seen: the circle; orders s - 1 with the paper's form of
velocity constraints.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("ball_on_turntable")
    m.doc = "Ball rolling on a turntable: circles at 2/7 of its rate"
    x, y, *_ = m.coordinates("x y a_x a_y a_z", velocities="v_x v_y w_x w_y w_z")
    v_x, v_y, w_x, w_y, w_z = m.velocities
    mass, R, Omega = m.parameters(
        mass=sg.par(0.5, unit="kg", min=0, doc="mass"),
        R=sg.par(0.05, unit="m", min=0, doc="radius of the ball"),
        Omega=sg.par(3.0, unit="rad/s", doc="rate of the table"),
    )
    J = sp.Rational(2, 5) * mass * R**2
    m.lagrangian = mass / 2 * (v_x**2 + v_y**2) + J / 2 * (w_x**2 + w_y**2 + w_z**2)
    # velocity of the touching point less that of the table, Omega e_z x r
    m.velocity_constraint("rolling", [v_x - R * w_y + Omega * y, v_y + R * w_x - Omega * x])
    m.shape([(x, y)], radius=R)
    # starts so that the circle has its centre at the origin: v = 2/7 Omega e_z x r
    v_0 = sp.Rational(2, 7) * Omega * sp.Rational(3, 10)
    m.initial_state(
        q=[sp.Rational(3, 10), 0, 0, 0, 0],
        v=[0, v_0, (Omega * sp.Rational(3, 10) - v_0) / R, 0, 0],
    )
    m.suggest(dt=1e-2, t_end=7.5)
    return m
