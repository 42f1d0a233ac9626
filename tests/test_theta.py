"""The theta-method: a scheme in one file, against closed forms, orders and its reference."""

from collections.abc import Callable

import numpy as np
import pytest
import signorini as sg
from signorini.models import bouncing_ball
from trap_models import rheonomic, unconstrained


def oscillator() -> sg.Model:
    m = sg.Model("oscillator")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    k, c = m.parameters(k=40.0, c=0.3)
    m.lagrangian = v**2 / 2 - k * x**2 / 2
    m.force([-c * v])
    m.initial_state(q=[1.0], v=[0.5])
    return m


@pytest.mark.parametrize("theta", [0.5, 0.7, 1.0])
def test_a_linear_oscillator_is_a_matrix(theta: float) -> None:
    """(1 - h theta A) y_{n+1} = (1 + h (1 - theta) A) y_n, A of the first-order system."""
    stepper = sg.build(oscillator(), scheme=f"theta={theta}")
    h = 0.3  # h omega = 1.9
    A = np.array([[0.0, 1.0], [-40.0, -0.3]])
    step = np.linalg.solve(np.eye(2) - h * theta * A, np.eye(2) + h * (1 - theta) * A)
    y = np.array([1.0, 0.5])
    trajectory = stepper.simulate(t_end=20 * h, dt=h)
    for k in range(1, 21):
        y = step @ y
        np.testing.assert_allclose([trajectory.q[k, 0], trajectory.v[k, 0]], y, rtol=1e-9)


def test_no_step_is_too_large() -> None:
    """Without damping the amplitude stays, at h omega = 190."""
    stepper = sg.build(oscillator(), scheme="theta")
    energy = stepper.simulate(t_end=3000.0, dt=30.0, parameters={"c": 0.0}).energy
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)


@pytest.mark.parametrize(("theta", "order"), [("0.5", 2), ("1", 1)])
def test_orders(theta: str, order: int, stepper: Callable[..., sg.Stepper]) -> None:
    """A mass matrix and forces that depend on everything, against the scheme of order six."""
    scheme = sg.build(unconstrained(), scheme=f"theta={theta}")
    exact = stepper(unconstrained, 4).simulate(dt=5e-3, t_end=1.0).q[-1]
    errors = [
        np.max(np.abs(scheme.simulate(dt=h, t_end=1.0).q[-1] - exact)) for h in (0.02, 0.01, 0.005)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, order, atol=0.1)


def test_a_ball_bounces() -> None:
    """The force is constant: velocities of Moreau's scheme, and P_N = m (1 + e_N) |v|."""
    stepper = sg.build(bouncing_ball.model(), scheme="theta")
    h, g, e_N, R = 1e-2, 9.81, 0.5, 0.1
    trajectory = stepper.simulate(t_end=1.0, dt=h, parameters={"e_N": e_N})
    y, v = 1.0, 0.0
    for k in range(100):
        free = v - h * g
        new = max(free, -e_N * v) if y + h / 2 * v - R <= 0 else free
        y, v = y + h / 2 * (v + new), new
        assert trajectory.v[k + 1, 1] == pytest.approx(v, abs=1e-10)
        assert trajectory.q[k + 1, 1] == pytest.approx(y, abs=1e-10)
    assert np.max(trajectory["floor.P_N"]) > 1


def test_the_check_passes_with_any_theta() -> None:
    report = sg.check(rheonomic(), stages=(2,), build=lambda m, s: sg.build(m, scheme="theta=0.7"))
    assert report, str(report)
    assert "(T9), (T10)" in str(report)


@pytest.mark.parametrize(
    ("scheme", "says"),
    [
        ("theta=0.3", "give theta=number from 0.5 to 1"),
        ("theta=half", "give theta=number from 0.5 to 1"),
        ("moreau=1", "moreau has no option"),
        ("euler", r"there is: lobatto, moreau, theta\[=number\]"),
    ],
)
def test_options_are_checked(scheme: str, says: str) -> None:
    with pytest.raises(sg.GenerationError, match=says):
        sg.build(oscillator(), scheme=scheme)
