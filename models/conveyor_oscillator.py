"""Mass on a conveyor belt, held by a spring: a stick-slip limit cycle.

Leine, van Campen, de Kraker, van den Steen, "Stick-slip vibrations induced by alternate friction
models", Nonlinear Dynamics 16 (1998): m = k = F_s = 1, belt at 0.2, friction force
F_s / (1 + delta |slip|) while slipping. Set-valued Coulomb friction F_s, and the falling rest as an
ordinary force that vanishes at stick. Seen: sticks with the belt, tears off, swings back, sticks.
"""

import signorini as sg
import sympy as sp


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("conveyor_oscillator")
    m.doc = "Mass on a conveyor belt: stick-slip limit cycle"
    (x,) = m.coordinates("x", units="m")
    (v,) = m.velocities
    mass, k, F_s, v_belt, delta = m.parameters(
        mass=sg.par(1.0, unit="kg", min=0, doc="mass"),
        k=sg.par(1.0, unit="N/m", min=0, doc="stiffness"),
        F_s=sg.par(1.0, unit="N", min=0, doc="largest sticking force"),
        v_belt=sg.par(0.2, unit="m/s", doc="speed of the belt"),
        delta=sg.par(3.0, unit="s/m", min=0, doc="fall of friction with slip"),
    )
    m.lagrangian = mass / 2 * v**2 - k / 2 * x**2
    slip = v - v_belt
    m.force([F_s * delta * slip / (1 + delta * sp.Abs(slip))])
    m.friction("belt", gamma_F=slip, bound=F_s)
    half = sp.Rational(1, 5)
    m.shape([(x + i * half, j * half) for i, j in ((-1, 0), (1, 0), (1, 2), (-1, 2))], closed=True)
    m.shape([(-3, 0), (-3, 2 * half)])
    m.shape([(-3, half), (x - half, half)])
    m.shape([(0, 0)], normal=(0, 1))
    m.initial_state(q=[0], v=[v_belt])
    m.suggest(dt=1e-2, t_end=40)
    return m
