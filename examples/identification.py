"""Restitution, friction and inertia of a ball, from a noisy film of one throw.

A ball is thrown with spin and bounces twice on the floor; its place and angle are seen 100 times a
second, with a noise of one millimetre and ten milliradians. Least squares by SciPy, with exact
derivatives of the run by its parameters, impacts and slip included.
Run it: python identification.py
"""

from dataclasses import dataclass

import numpy as np
import signorini as sg
import sympy as sp
from scipy.optimize import least_squares


def model() -> sg.Model:
    """A ball of which the inertia, as a share of m R^2, is not known."""
    m = sg.Model("thrown_ball")
    _, y, _ = m.coordinates("x y phi", units="m m rad")
    v, w, omega = m.velocities
    mass, R = sp.Rational(3, 5), sp.Rational(1, 10)
    e_N, mu, share = m.parameters(
        e_N=sg.par(0.5, min=0, max=1, doc="restitution"),
        mu=sg.par(0.3, min=0, doc="friction"),
        share=sg.par(0.4, min=0, doc="inertia over m R^2"),
    )
    m.lagrangian = mass * (v**2 + w**2 + share * R**2 * omega**2) / 2
    m.lagrangian += -mass * sp.Rational(981, 100) * y
    m.contact("floor", g_N=y - R, gamma_F=v + R * omega, mu=mu, e_N=e_N)
    m.initial_state(q=[0, 1, 0], v=[2, 0, 70])
    return m


@dataclass
class Identified:
    """What was found, with its standard deviation, and what was to be found."""

    found: np.ndarray
    deviation: np.ndarray
    true: np.ndarray
    evaluations: int


def identify(seed: int = 1) -> Identified:
    """Make a film, and find the parameters from it."""
    stepper = sg.build(model(), stages=3, derivatives=True)
    about = {"t_end": 1.5, "dt": 1e-2, "events": "located"}
    noise = np.array([1e-3, 1e-3, 1e-2])
    true = np.array([0.82, 0.24, 0.56])
    names = list(stepper.parameters)

    def run(values: np.ndarray) -> sg.Trajectory:
        parameters = dict(zip(names, values, strict=True))
        return stepper.simulate(
            **about, parameters=parameters, derivatives="forward", of="parameters"
        )

    film = run(true).q + noise * np.random.default_rng(seed).normal(size=(151, 3))

    def misfit(values: np.ndarray) -> np.ndarray:
        return ((run(values).q - film) / noise).ravel()

    def slopes(values: np.ndarray) -> np.ndarray:
        by = run(values).dq["parameters"] / noise[:, None]
        return by.reshape(-1, 3)

    fit = least_squares(
        misfit, [0.7, 0.35, 0.4], jac=slopes, bounds=([0.6, 0, 0.05], [1, 1, 1]), x_scale="jac"
    )
    deviation = np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)))
    return Identified(fit.x, deviation, true, fit.nfev)


if __name__ == "__main__":
    result = identify()
    for name, value, deviation, true in zip(
        ("e_N", "mu", "share"), result.found, result.deviation, result.true, strict=True
    ):
        print(f"{name:6s} {value:.5f} +- {deviation:.5f}   (made with {true})")
    print(f"{result.evaluations} runs")
