"""Linear systems about equilibria in contact and about periodic motions; steps with derivatives."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.models import bouncing_ball, rimless_wheel, slope, vibrating_table, woodpecker
from signorini.verify.event_driven import EventDriven

Build = Callable[..., sg.Stepper]


def rolling_disc() -> sg.Model:
    """A disc on the floor, held by a spring and a damper, pushed and watched."""
    m = sg.Model("rolling_disc")
    x, y, _ = m.coordinates("x y phi", units="m m rad")
    v, w, omega = m.velocities
    mass, R, k, c = m.parameters(mass=2.0, R=0.3, k=50.0, c=1.0)
    m.lagrangian = mass / 2 * (v**2 + w**2 + R**2 / 2 * omega**2) - 10 * mass * y - k / 2 * x**2
    (push,) = m.inputs("push")
    m.force([push - c * v, 0, 0])
    m.contact("floor", g_N=y - R, gamma_F=v + R * omega, mu=sp.Rational(1, 2))
    m.output("place", x + push / 10)
    m.initial_state(q=[0, R, 0])
    return m


def test_a_disc_that_rolls_on_the_floor(stepper: Build) -> None:
    """Two states, (m + J/R^2) x'' + c x' + k x = push: poles, gain and rank in closed form."""
    made = stepper(rolling_disc, 3, derivatives=True)
    found = made.linearise(dt=1e-2)
    A, B, C, D = found.minimal
    assert A.shape == (3, 3)  # x, v; and the angle, which stays where it is
    mass, damping, stiffness = 3.0, 1.0, 50.0
    poles = np.roots([mass, damping, stiffness])
    rates = np.sort_complex(found.rates)
    np.testing.assert_allclose(rates, np.sort_complex([0, *poles]), atol=1e-6)
    # a constant push moves it by push / k in the end; the output adds a tenth of the push
    rest = np.linalg.lstsq(np.eye(3) - A, B, rcond=None)[0]
    assert (C @ rest + D)[0, 0] == pytest.approx(1 / stiffness + 0.1, rel=1e-9)


@pytest.mark.parametrize(("spokes", "slope"), [(8, 0.15), (10, 0.12)])
def test_the_multiplier_of_a_rimless_wheel(spokes: int, slope: float) -> None:
    """McGeer's wheel: {1, 1, eta^2}, which is cos^2 2 alpha without a rim; saltation and all."""
    made = sg.build(rimless_wheel.model(spokes), stages=4, derivatives=True)
    alpha = np.pi / spokes
    for J in (1e-3, 0.05):
        p = {**made.parameters, "J": J, "slope": slope, "mu": 3.0}
        length, point = p["length"], p["mass"] * p["length"] ** 2
        eta = (J + point * np.cos(2 * alpha)) / (J + point)
        pull = p["mass"] * p["grav"] * length / (J + point)
        after = np.sqrt(eta**2 / (1 - eta**2) * 4 * pull * np.sin(alpha) * np.sin(slope))
        # up to the middle of the step, where the place is that the motion comes back to
        middle = np.sqrt(after**2 + 2 * pull * (np.cos(alpha - slope) - np.cos(slope)))

        def travel(way: float, rate: float = middle, pull: float = pull) -> float:
            """Time from the middle on until the spoke has turned by `way`, by quadrature."""
            x, share = np.polynomial.legendre.leggauss(60)
            angle = way * (x + 1) / 2 + slope
            speed = np.sqrt(rate**2 + 2 * pull * (np.cos(slope) - np.cos(angle)))
            return float(abs(way) / 2 * share @ (1 / speed))

        found = made.linearise(
            dt=2e-3, period=travel(alpha) + travel(-alpha), parameters=p, q0=[0, length, 0],
            v0=[middle * length, 0, -middle], shift=[2 * length * np.sin(alpha), 0, -2 * alpha],
        )  # fmt: skip
        # one for where it is in the step, one for where the foot is on the floor
        np.testing.assert_allclose(found.multipliers.real, [1, 1, eta**2], atol=1e-8)


def test_a_bounce_on_a_shaken_table(stepper: Build) -> None:
    """Multipliers -1 and -e^2 where the bounce doubles its period (Luck, Mehta, 1993)."""
    made, e = stepper(vibrating_table.model, 3, derivatives=True), 0.5
    omega = 2 * np.pi * 20
    Gamma = np.hypot(np.pi * (1 - e) / (1 + e), 2 * (1 + e**2) / (1 + e) ** 2)
    phase = np.arccos(np.pi * (1 - e) / (1 + e) / Gamma)
    apex = Gamma * 9.81 / omega**2 * np.sin(phase) + (np.pi * 9.81 / omega) ** 2 / (2 * 9.81)
    period = 2 * np.pi / omega
    found = made.linearise(
        t0=(phase + np.pi) / omega, period=period, dt=period / 41, q0=[apex], v0=[0.0],
        parameters={"Gamma": Gamma, "omega": omega, "e_N": e},
    )  # fmt: skip
    np.testing.assert_allclose(np.sort(found.multipliers.real), [-1, -(e**2)], rtol=1e-6)


def test_what_cannot_be_linearised(stepper: Build) -> None:
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    with pytest.raises(sg.RunError, match="not on an equilibrium"):
        made.linearise(dt=1e-2)
    with pytest.raises(sg.RunError, match="not on a periodic motion"):
        made.linearise(dt=1e-2, period=0.5)
    with pytest.raises(sg.RunError, match="at most the period"):
        made.linearise(dt=1e-2, period=1e-3)


# --- step by step ---------------------------------------------------------------------------------


def test_a_run_step_by_step_has_the_derivatives_of_the_run(stepper: Build) -> None:
    """Also copied, pickled, recorded, and begun anew in the middle: then they multiply."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    of = ("q0", "v0")
    about: dict[str, Any] = {"dt": 1e-2, "events": "located", "derivatives": "forward", "of": of}
    run = made.simulate(t_end=1.0, **about)
    sim = made.start(**about)
    sim.step(n=30)
    other = pickle.loads(pickle.dumps(copy.copy(sim.copy())))
    recorded = made.start(**about, record=True)
    for one in (sim, other):
        one.step(n=70)
    recorded.step(n=100)
    for one in (sim, other, recorded):
        assert one.differentiable is True
        for name in of:
            np.testing.assert_array_equal(one.dq[name], run.dq[name][-1])
            np.testing.assert_array_equal(one.dv[name], run.dv[name][-1])
    half = made.start(**about)
    half.step(n=30)
    first = np.vstack([np.hstack([*half.dq.values()]), np.hstack([*half.dv.values()])])
    half.begin_derivatives()
    half.step(n=70)
    second = np.vstack([np.hstack([*half.dq.values()]), np.hstack([*half.dv.values()])])
    whole = np.vstack([np.hstack([*sim.dq.values()]), np.hstack([*sim.dv.values()])])
    np.testing.assert_allclose(second @ first, whole, rtol=1e-9, atol=1e-9)
    half.reset()
    assert np.array_equal(half.dq["q0"], np.eye(3))


def test_a_controller_learns_what_its_input_does(stepper: Build) -> None:
    """dq/du of one step against differences, in rolling contact."""
    made = stepper(rolling_disc, 3, derivatives=True)
    sim = made.start(dt=1e-2, events="located", derivatives="forward", of="inputs", tol=0.0)
    sim.step(np.array([3.0]), n=5)
    sim.begin_derivatives()
    ahead = [sim.copy() for _ in range(2)]
    sim.step(np.array([2.0]))
    for one, push in zip(ahead, (2.5, 1.5), strict=True):
        one.step(np.array([push]))
    np.testing.assert_allclose(
        sim.dq["inputs"][:, 0], ahead[0].q - ahead[1].q, rtol=1e-9, atol=1e-13
    )
    assert sim.dq["inputs"][0, 0] > 1e-6


def test_a_simulator_without_derivatives_says_so(stepper: Build) -> None:
    made = stepper(slope.model, 2, derivatives=True)
    with pytest.raises(sg.RunError, match="nothing is differentiated"):
        made.start(dt=1e-2).dq["q0"]
    with pytest.raises(sg.RunError, match="has no end"):
        made.start(dt=1e-2, events="located", derivatives="adjoint")


@pytest.mark.slow
def test_the_multipliers_of_a_woodpecker(stepper: Build) -> None:
    """Impacts, jamming, slip: {1, 1, lambda}, against motion by events and its differences."""
    made = stepper(woodpecker.model, 4, derivatives=True)
    long = made.simulate(t_end=2.0, dt=1e-3, events="located")
    begun, ended = ([e.t for e in long.events if (e.contact, e.kind) == ("lower", kind)]
                    for kind in ("stick", "slip"))  # fmt: skip
    k = int(np.searchsorted(long.t, (begun[-2] + next(t for t in ended if t > begun[-2])) / 2))
    q, v, period = long.q[k].copy(), long.v[k].copy(), begun[-1] - begun[-2]
    about: dict[str, Any] = {"dt": 1e-3, "events": "located"}
    for _ in range(8):  # sleeve at rest: rate of the bird where it stands, and the period
        n = round(period / 1e-3)
        run = made.simulate(
            t_end=period, dt=period / n, q0=q, v0=v, events="located", derivatives="forward",
            of="v0", project=True,
        )  # fmt: skip
        miss = np.array([run.q[-1, 2] - q[2], run.v[-1, 2] - v[2]])
        by_rate = np.array([run.dq["v0"][-1, 2, 2], run.dv["v0"][-1, 2, 2] - 1])
        beyond = made.step(period, run.q[-1], run.v[-1], 1e-6, events="located")
        by_time = np.array([run.v[-1, 2], (beyond.v[-1, 2] - run.v[-1, 2]) / 1e-6])
        change = np.linalg.solve(np.column_stack([by_rate, by_time]), -miss)
        v[2] += change[0]
        period += change[1]
    assert np.max(np.abs(miss)) < 1e-9
    way = [run.q[-1, 0] - q[0], 0, 0]
    found = made.linearise(period=period, q0=q, v0=v, shift=way, **about)
    values = found.multipliers.real
    np.testing.assert_allclose(values[:2], 1, atol=1e-6)
    motion, step = EventDriven(woodpecker.model(), 1e-6), 1e-4

    def end(sign: float, j: int) -> np.ndarray:
        state = np.array([q[2], v[2]])
        state[j] += sign * step
        at = (0.0, np.array([*q[:2], state[0]]), np.array([*v[:2], state[1]]), np.zeros(0),
              np.array(list(made.parameters.values())))  # fmt: skip
        there = motion.run(at, period, period / 150)
        return np.array([there[0][2], there[1][2]])

    columns = [(end(1, j) - end(-1, j)) / (2 * step) for j in range(2)]
    own = np.linalg.eigvals(np.array(columns).T).real
    assert sorted([*own, 1.0]) == pytest.approx(sorted(values), abs=1e-4)
    assert -1 < values[2] < -0.8
