"""Poisson's impact law: compression and expansion over all contacts."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import signorini as sg
from signorini.models import kanes_pendulum

Build = Callable[..., sg.Stepper]
G = 9.81


def struck(stepper: sg.Stepper, v: np.ndarray, par: dict[str, float]) -> sg.Trajectory:
    """One step across an impact, so short that weight does nothing."""
    q = np.array([np.pi / 9, np.pi / 6])
    return stepper.simulate(q0=q, v0=v, dt=1e-9, t_end=1e-9, parameters=par)


def compress_and_expand(
    G: np.ndarray, rate: np.ndarray, mu: float, e_N: float
) -> tuple[np.ndarray, np.ndarray]:
    """Percussions (P_N, P_F) of one planar contact by trying its states, in both phases.

    `G` is the response of (gamma_N, gamma_F), `rate` their velocities before.
    """

    def phase(rate: np.ndarray, back: float) -> np.ndarray:
        """0 <= g_N, P_N >= back; Coulomb's law with P_N."""
        for state in ("open", "stick", 1.0, -1.0):
            P = np.array([back, 0.0])
            if state == "stick":
                if np.linalg.det(G) > 0:
                    P = -np.linalg.solve(G, rate)
                fits = P[0] >= back and abs(P[1]) <= mu * P[0]
                if fits:
                    return P
                continue
            signs = (1.0, -1.0, 0.0) if state == "open" else (state,)
            for sign in signs:
                if state == "open":
                    # pressed by what is given back alone, sliding or sticking
                    P = np.array([back, -sign * mu * back])
                    if sign == 0.0:
                        P[1] = -(rate[1] + G[1, 0] * back) / G[1, 1]
                        if abs(P[1]) > mu * back:
                            continue
                    after = rate + G @ P
                    if after[0] >= -1e-14 and sign * after[1] >= -1e-14:
                        return P
                else:
                    P_N = -rate[0] / (G[0, 0] - sign * mu * G[0, 1])
                    P = np.array([P_N, -sign * mu * P_N])
                    if back <= P_N and sign * (rate + G @ P)[1] >= -1e-14:
                        return P
        raise AssertionError("no state fits")

    C = phase(rate, 0.0)
    return C, phase(rate + G @ C, e_N * C[0])


def test_poissons_law_is_compression_and_expansion(stepper: Build) -> None:
    """Percussions of drawn impacts of Kane's pendulum, phase by phase; energy is not gained, as
    it is with Newton's law on the same draws."""
    made = stepper(kanes_pendulum.model, 2)
    newton = sg.build(kanes_pendulum.model("newton"), stages=2)
    rng = np.random.default_rng(5)
    gained = [-np.inf, -np.inf]
    for _ in range(150):
        v = rng.normal(size=2) * [1, 2]
        par = {"mu": rng.uniform(0, 1.5), "e_N": rng.uniform(), "grav": 0.0}
        run = struck(made, v, par)
        at = (0.0, np.array([np.pi / 9, np.pi / 6]), v)
        W = np.hstack([made.evaluate(name, *at[:2], parameters=par) for name in ("W_N", "W_F")])
        M = made.evaluate("p_v", *at, parameters=par)
        rate = W.T @ v
        gained[0] = max(gained[0], np.diff(run.energy)[0])
        gained[1] = max(gained[1], np.diff(struck(newton, v, par).energy)[0])
        if rate[0] >= 0:
            assert run.P_N[1, 0] == 0
            continue
        C, E = compress_and_expand(W.T @ np.linalg.solve(M, W), rate, par["mu"], par["e_N"])
        assert run.P_N[1, 0] == pytest.approx(C[0] + E[0], rel=1e-6)
        assert run.P_F[1, 0] == pytest.approx(C[1] + E[1], rel=1e-5, abs=1e-7)
    assert gained[0] < 1e-13
    assert gained[1] > 1


def pile() -> sg.Model:
    """Two balls on top of each other."""
    m = sg.Model("pile")
    a, b = m.coordinates("a b")
    v_a, v_b = m.velocities
    m.lagrangian = (v_a**2 + v_b**2) / 2 - G * (a + b)
    m.contact("floor", g_N=a, e_N=0.9, impact="poisson")
    m.contact("between", g_N=b - a, e_N=0.9, impact="poisson")
    m.initial_state(q=[0, 0])
    return m


def test_what_rests_by_poissons_law_goes_on_resting(stepper: Build) -> None:
    """The weight of a step is no compression."""
    run = stepper(pile, 2).simulate(dt=1e-2, t_end=1)
    assert np.abs(run.v).max() < 1e-13
    assert run["floor.force_N"][1:] == pytest.approx(2 * G)


def cradle(impact: str) -> sg.Model:
    """Four balls in a row, touching but for the first."""
    m = sg.Model("cradle_of_four")
    x = m.coordinates("a b c d")
    v = m.velocities
    m.lagrangian = sum(w**2 for w in v) / 2
    for k in range(3):
        m.contact(f"gap_{k}", g_N=x[k + 1] - x[k], e_N=1, impact=impact)
    m.initial_state(q=[-0.01, 0, 0, 0], v=[1, 0, 0, 0])
    return m


def test_a_cradle_of_equal_balls_has_one_answer_in_both_laws() -> None:
    """Compression to 1/4 each, expansion by as much: (-1/2, 1/2, 1/2, 1/2), as Newton says."""
    for impact in ("newton", "poisson"):
        run = sg.build(cradle(impact), stages=2, events="located").simulate(
            events="located", dt=1e-3, t_end=0.02
        )
        assert run.v[-1] == pytest.approx([-0.5, 0.5, 0.5, 0.5], abs=1e-12)


@pytest.mark.thorough
@pytest.mark.parametrize("options", [{}, {"events": "located"}, {"scheme": "moreau"}])
def test_what_check_says_of_poissons_law(options: dict[str, Any]) -> None:
    report = sg.check(kanes_pendulum.model(), stages=(2,), **options)
    assert report.passed, str(report)
    assert "impacts by Poisson's law (floor)" in str(report)


def test_poissons_law_is_refused_where_it_is_not_known() -> None:
    m = sg.Model("m")
    (y,) = m.coordinates("y")
    (v,) = m.velocities
    with pytest.raises(sg.ModelError, match=r"impact of contact 'a': is 'moreau'"):
        m.contact("a", g_N=y, impact="moreau")
    with pytest.raises(sg.ModelError, match=r"e_F of contact 'a': is 0.5"):
        m.contact("a", g_N=y, gamma_F=v, e_F=0.5, impact="poisson")
    with pytest.raises(sg.GenerationError, match=r"derivatives=True.*'floor' are Poisson's"):
        sg.build(kanes_pendulum.model(), stages=2, derivatives=True)
