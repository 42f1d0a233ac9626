"""Anisotropic friction: the elliptic cone of two coefficients."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import signorini as sg
from signorini.bodies import Spatial, inertia
from signorini.models import ribbed_floor
from signorini.verify import laws

ALONG, ACROSS, G = 0.1, 0.4, 9.81


def block(mu: Any, share: float = 1.0) -> sg.Model:
    """A box with a contact at each corner; slip across counts `share` times."""
    m = sg.Model("ribbed_box")
    world = Spatial(m, gravity=(0, 0, -G))
    size = (0.2, 0.14, 0.1)
    box = world.body("box", 1.3, inertia.cuboid(1.3, *size), coordinates="x y z p0 p1 p2 p3")
    for k in range(8):
        at = [s * (1 - 2 * (k >> i & 1)) / 2 for i, s in enumerate(size)]
        corner = box.point(*at)
        v = corner.velocity
        slip = [v[0], share * v[1]]
        m.contact(f"corner_{k}", g_N=corner.position[2], gamma_F=slip, mu=mu, e_N=0.2)
    world.initial_state(
        q={"z": 0.3, "p0": 0.8, "p1": 0.36, "p2": 0.48},
        v={"x": 1.5, "y": -0.7, "p0": 0.72, "p1": -1.6},
    )
    m.suggest(dt=2e-3, t_end=0.6)
    return m


def slide(t_end: float) -> np.ndarray:
    """Velocities of the sliding block by Runge and Kutta's method, from (1, 1)."""
    mu = np.array([ALONG, ACROSS])

    def rate(v: np.ndarray) -> np.ndarray:
        return -G * mu**2 * v / np.linalg.norm(mu * v)

    v, n = np.ones(2), 4000
    h = t_end / n
    for _ in range(n):
        a = rate(v)
        b = rate(v + h / 2 * a)
        c = rate(v + h / 2 * b)
        v = v + h / 6 * (a + 2 * b + 2 * c + rate(v + h * c))
    return v


@pytest.mark.parametrize("stages", [2, 3])
def test_the_path_bends_towards_the_ribs(stepper: Callable[..., sg.Stepper], stages: int) -> None:
    """v_x^(mu_y^2) / v_y^(mu_x^2) stays, to the order of the step; the limit is that of the ODE."""
    drift, end = [], []
    for dt in (4e-3, 2e-3):
        traj = stepper(ribbed_floor.model, stages).simulate(t_end=0.2, dt=dt)
        vx, vy = traj.v[-1, :2]
        drift.append(abs(ACROSS**2 * np.log(vx) - ALONG**2 * np.log(vy)))
        end.append(traj.v[-1, :2])
        P_x, P_y = traj.P_F[1:].T
        size = np.hypot(P_x / ALONG, P_y / ACROSS)
        np.testing.assert_allclose(size, traj.P_N[1:, 0], rtol=1e-9)
    assert 1.9 < drift[0] / drift[1] < 2.1
    np.testing.assert_allclose(2 * end[1] - end[0], slide(0.2), atol=1e-5)


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_it_sticks_within_the_ellipse(stepper: Callable[..., sg.Stepper], share: float) -> None:
    """On an incline, iff |(F_x / mu_x, F_y / mu_y)| is at most the normal force."""
    low, high = 0.0, 1.0
    for _ in range(60):
        k = (low + high) / 2
        x, y = np.arcsin(k * ALONG * np.cos(0.7)), np.arcsin(k * ACROSS * np.sin(0.7))
        size = np.hypot(np.sin(x) / ALONG, np.sin(y) / ACROSS) / (np.cos(x) * np.cos(y))
        low, high = (k, high) if size < share else (low, k)
    traj = stepper(ribbed_floor.model, 2).simulate(
        t_end=0.5, dt=1e-2, v0=[0, 0, 0], parameters={"slope_x": x, "slope_y": y}
    )
    moved = np.abs(traj.v[-1, :2]).max() > 1e-9
    assert moved == (share > 1)


def test_the_ellipse_is_a_disc_in_scaled_slip() -> None:
    """Friction (mu_1, mu_2) of (g_1, g_2) is friction mu_1 of (g_1, mu_2 / mu_1 g_2), exactly.

    A box tumbles and comes to rest, rescues included.
    """

    one, other = (
        sg.build(m, stages=2).simulate(t_end=0.5, dt=2e-3)
        for m in (block((0.2, 0.5)), block(0.2, share=2.5))
    )
    np.testing.assert_allclose(one.q, other.q, atol=1e-7)
    np.testing.assert_allclose(one.P_N, other.P_N, atol=1e-6)
    np.testing.assert_allclose(one.P_F[:, 1::2], 2.5 * other.P_F[:, 1::2], atol=1e-6)


def test_equal_coefficients_are_coulomb() -> None:
    one, other = (
        sg.build(block(mu), stages=2).simulate(t_end=0.3, dt=2e-3) for mu in (0.3, (0.3, 0.3))
    )
    np.testing.assert_array_equal(one.q, other.q)
    np.testing.assert_array_equal(one.P_F, other.P_F)


def test_the_reference_projects_onto_the_ellipse() -> None:
    """Nearest points: on the boundary, and z - x is normal to it."""
    law, rng = laws.find("elliptic"), np.random.default_rng(3)
    for _ in range(200):
        mu = rng.uniform(0.05, 2, 2)
        P, slip, radius = rng.normal(size=2), rng.normal(size=2), rng.uniform(0.1, 2)
        r = rng.uniform(0.1, 3)
        z = r * slip - P
        x = law.residual(P, slip, radius, r, mu) - P
        axes = radius * mu / mu.max()
        if np.sum((z / axes) ** 2) <= 1:
            np.testing.assert_array_equal(x, z)
            continue
        assert np.sum((x / axes) ** 2) == pytest.approx(1, abs=1e-12)
        normal = x / axes**2
        across = (z - x)[0] * normal[1] - (z - x)[1] * normal[0]
        assert across == pytest.approx(0, abs=1e-9 * np.linalg.norm(normal))
        assert (z - x) @ normal > 0


def test_check_knows_the_law() -> None:
    assert sg.check(ribbed_floor.model(), stages=[2]).passed


@pytest.mark.parametrize(
    ("mu", "gamma", "said"),
    [
        ((0.1, 0.2), 1, "mu of contact 'c': has 2 entries for 1 slip component"),
        ((0.1, 0.2, 0.3), 2, "has 3 entries for 2 slip components"),
        ((0.1, 0.0), 2, "is zero for one component alone"),
        ((0.1, -0.2), 2, "is -0.2"),
        ((0.1, 0.2), 0, "has no slip velocity gamma_F"),
    ],
)
def test_pairs_that_mean_nothing(mu: tuple[float, ...], gamma: int, said: str) -> None:
    m = sg.Model("pairs")
    _x, _y, z = m.coordinates("x y z")
    vx, vy, vz = m.velocities
    m.lagrangian = (vx**2 + vy**2 + vz**2) / 2 - 9.81 * z
    m.initial_state(q=[0, 0, 0])
    with pytest.raises(sg.ModelError, match=said):
        m.contact("c", g_N=z, gamma_F=[vx, vy][:gamma] or None, mu=mu)
        sg.build(m, stages=2)


def test_a_parameter_makes_one_coefficient_vanish(stepper: Callable[..., sg.Stepper]) -> None:
    with pytest.raises(sg.RunError, match=r"mu of contact 'ribs' is \(0, 0.4\).*both must be pos"):
        stepper(ribbed_floor.model, 2).simulate(t_end=0.1, dt=1e-2, parameters={"mu_along": 0})
    both = stepper(ribbed_floor.model, 2).simulate(
        t_end=0.1, dt=1e-2, parameters={"mu_along": 0, "mu_across": 0}
    )
    np.testing.assert_allclose(both.v[-1], [1, 1, 0], atol=1e-14)
