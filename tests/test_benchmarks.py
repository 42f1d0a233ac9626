"""The paper's benchmarks against closed forms and orders."""

from collections.abc import Callable

import numpy as np
import pytest
import signorini as sg
from signorini.models import bouncing_ball, slider_crank, slope

Build = Callable[..., sg.Stepper]
STAGES = [2, 3, 4, 5]
GRAV, MU, R = 9.81, 0.2, 0.1


@pytest.mark.parametrize("s", STAGES)
def test_ball_slides_then_rolls(s: int, stepper: Build) -> None:
    """Case 2. Rolling: the angular momentum about the contact point, I omega - m R v_x, stays, and
    v_x = -R omega; with I = 2/5 m R^2 and omega(0) = 50 this is v_x = -10/7."""
    traj = stepper(bouncing_ball.model, s).simulate(t_end=2, dt=1e-2)
    np.testing.assert_allclose(traj.v[-1], [-10 / 7, 0, 100 / 7], atol=1e-9)
    assert traj.smallest_gap.min() >= -1e-12
    # Slip at rate mu g (1 + m R^2 / I) = 7/2 mu g after the impact percussion mu sqrt(2 * 0.9 g).
    impact = np.sqrt(2 * 0.9 / GRAV)
    slip = 50 * R - 3.5 * MU * np.sqrt(2 * 0.9 * GRAV)
    transition = impact + slip / (3.5 * MU * GRAV)
    assert transition == pytest.approx(0.72812, abs=1e-5)
    friction, normal = traj["floor.P_F"], traj["floor.P_N"]
    slides = (np.abs(friction) > MU * normal * (1 - 1e-9)) & (normal > 0)
    assert np.all(friction[slides] < 0)
    assert abs(traj.t[np.flatnonzero(slides)[-1]] - transition) <= 1e-2
    rolling = traj.t > transition + 0.02
    assert np.max(np.abs(friction[rolling])) < 1e-12
    np.testing.assert_allclose(normal[rolling], 9.81e-2, rtol=1e-10)
    # Sum of percussions: momentum balance over the whole run.
    assert normal.sum() == pytest.approx(GRAV * 2, rel=1e-12)
    assert friction.sum() == pytest.approx(-10 / 7, rel=1e-12)


@pytest.mark.parametrize("n", [40, 43])
def test_ball_positions_in_closed_form(n: int, stepper: Build) -> None:
    """The impact lies on the grid. Case 3 rolls from there on; case 2 slides first, and the end of
    sliding lies within a step: its place is off by less than mu g dt^2, as the law holds per step.
    """
    t_impact = np.sqrt(2 * 0.9 / GRAV)
    dt, rest = t_impact / n, 4 * t_impact
    compiled = stepper(bouncing_ball.model, 3)
    rolls = compiled.simulate(t_end=5 * t_impact, dt=dt, v0={"phi": 10})
    place = [-2 / 7 * rest, 0.1, 10 * t_impact + 20 / 7 * rest]
    np.testing.assert_allclose(rolls.q[-1], place, atol=1e-12)
    slides = compiled.simulate(t_end=5 * t_impact, dt=dt)
    # after the impact percussion mu sqrt(2 g h): velocities, then mu g until they roll
    v_x, omega = -MU * GRAV * t_impact, 50 - 2.5 * MU * GRAV * t_impact / R
    sliding = (omega * R + v_x) / (3.5 * MU * GRAV)
    x = v_x * sliding - MU * GRAV * sliding**2 / 2 - 10 / 7 * (rest - sliding)
    phi = 50 * t_impact + omega * sliding - 2.5 * MU * GRAV / R * sliding**2 / 2
    phi += 100 / 7 * (rest - sliding)
    assert slides.q[-1, 0] == pytest.approx(x, abs=MU * GRAV * dt**2)
    assert slides.q[-1, 2] == pytest.approx(phi, abs=2.5 * MU * GRAV * dt**2 / R)


@pytest.mark.parametrize("s", STAGES)
def test_ball_sticks_at_once(s: int, stepper: Build) -> None:
    """Case 3."""
    traj = stepper(bouncing_ball.model, s).simulate(t_end=2, dt=1e-2, v0=[0, 0, 10])
    np.testing.assert_allclose(traj.v[-1], [-2 / 7, 0, 20 / 7], atol=1e-9)
    impact = int(np.flatnonzero(traj["floor.P_N"])[0])
    assert np.max(np.abs(traj["floor.P_F"][impact + 1 :])) < 1e-12
    # The friction percussion that stops the slip: R omega I / (I + m R^2) = 2/7.
    assert traj["floor.P_F"][impact] == pytest.approx(-2 / 7, rel=1e-9)


@pytest.mark.parametrize("active_set", ["any_stage", "end"])
@pytest.mark.parametrize("s", STAGES)
def test_ball_passes_its_accumulation_point(s: int, active_set: str, stepper: Build) -> None:
    """Case 1: every flight ends in a tie; at rest after t = 1.285."""
    traj = stepper(bouncing_ball.model, s).simulate(
        t_end=3, dt=1e-2, v0=[0, 0, 0], parameters={"e_N": 0.5}, active_set=active_set
    )
    assert traj.smallest_gap.min() >= -1e-12
    rest = traj.t > 1.5
    assert np.max(np.abs(traj["y"][rest] - R)) < 1e-9
    assert np.max(np.abs(traj.v[rest])) < 1e-9
    # The apex after the first bounce: 0.9 / 4, up to the impact's smearing over a step.
    first = (traj.t > 0.45) & (traj.t < 0.85)
    assert traj["y"][first].max() - R == pytest.approx(0.9 / 4, abs=0.02)
    assert traj.substeps.sum() == 0


@pytest.mark.parametrize(("s", "phi_1"), [(2, 13.43422), (3, 13.43327), (4, 13.434)])
def test_slider_crank(s: int, phi_1: float, stepper: Build) -> None:
    traj = stepper(slider_crank.model, s).simulate(t_end=0.1466, dt=1e-4)
    assert len(traj) == 1467
    assert traj.smallest_gap.min() > -1e-12
    assert np.max(np.abs(traj.g)) < 1e-10
    assert np.max(np.abs(traj.g_dot)) < 1e-8
    assert np.max(np.abs(traj["phi_3"][traj.t > 0.02])) < 1e-10
    assert np.max(np.count_nonzero(np.diff(traj.P_N > 0, axis=0) > 0, axis=1)) >= 2
    # Trial implementation; s = 4 ends between the independent codes' 13.431 and 13.438.
    assert traj["phi_1"][-1] == pytest.approx(phi_1, abs=1e-5 if s < 4 else 4e-3)
    assert traj.substeps.sum() == 0


@pytest.mark.parametrize(
    ("s", "coarse", "fine", "error"),
    [(2, 5, 0, 4.6e-6), (3, 5, 1, 4.8e-11), (4, 6, 3, 9.0e-13), (5, 7, 5, 3.2e-12)],
)
def test_slope_has_order_2s_minus_2(
    s: int, coarse: int, fine: int, error: float, stepper: Build
) -> None:
    compiled = stepper(slope.model, s)
    reference = stepper(slope.model, 5).simulate(t_end=1.6384, dt=8e-4, tol=0)
    errors = {}
    for k in (coarse, fine):
        dt = 3.2e-3 * 2**k
        traj = compiled.simulate(t_end=1.6384, dt=dt, tol=0)
        errors[k] = dt * np.sum(np.abs(traj.q - reference.q[:: 4 * 2**k]))
        assert traj.smallest_gap.min() > -1e-13
    order = np.log2(errors[coarse] / errors[fine]) / (coarse - fine)
    # At the coarsest steps the order is approached from above.
    assert 2 * s - 2 - 0.15 < order < 2 * s - 2 + (0.15 if s < 5 else 1.2)
    assert errors[fine] == pytest.approx(error, rel=0.05 if s < 4 else 0.3)


def test_slope_comes_to_rest(stepper: Build) -> None:
    traj = stepper(slope.model, 3).simulate(t_end=2.5, dt=1e-2)
    assert np.max(np.abs(traj.v[-1])) < 1e-12
    assert traj["x"][-1] == pytest.approx(2.84920, abs=2e-5)
    falls = stepper(slope.model, 3).simulate(t_end=2.5, dt=1e-2, q0={"y": 1.5})
    assert falls["x"][-1] == pytest.approx(3.16434, abs=2e-5)
