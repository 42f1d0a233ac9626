"""Every model of the collection: runs at s = 2, 3, 4, and meets a number from elsewhere.

Tolerances are such that a change of a parameter by 20 % breaks the test.
"""

import importlib
from collections.abc import Callable
from math import acosh, atan, atan2, cos, pi, sin, sqrt

import mpmath
import numpy as np
import pytest
import signorini as sg
from signorini.locate import shipped
from signorini.models import (
    andrews_squeezer,
    arch,
    ball_on_turntable,
    bead_on_hoop,
    block_stack,
    box_in_space,
    chaplygin_sleigh,
    coin,
    conveyor_oscillator,
    cradle,
    dominoes,
    drawer,
    falling_chain,
    four_bar,
    hopper,
    painleve_rod,
    pendulum_with_wall,
    prism_in_chute,
    rimless_wheel,
    rocking_block,
    sphere_on_incline,
    table_with_legs,
    v_groove,
    vibrating_table,
    woodpecker,
)

G = 9.81
Build = Callable[..., sg.Stepper]


# Behind markers, for their compilation: all but a few at two stages, all at three and four.
FEW = {"bouncing_ball", "box", "coin", "four_bar", "slope", "table_with_legs"}


def marks(name: str, stages: int) -> list[pytest.MarkDecorator]:
    if stages > 2:
        return [pytest.mark.slow]
    return [] if stages == 2 and name in FEW else [pytest.mark.thorough]


HORIZONS = [pytest.param(name, s, marks=marks(name, s)) for name in shipped() for s in (2, 3, 4)]


@pytest.mark.parametrize(("name", "stages"), HORIZONS)
def test_runs_to_its_horizon(name: str, stages: int) -> None:
    """No step fails, no rigid contact that exists is penetrated."""
    module = importlib.import_module(f"signorini.models.{name}")
    model = module.model()
    traj = sg.build(model, stages=stages).simulate(**model.suggested)
    assert traj.t[-1] == pytest.approx(model.suggested["t_end"])
    assert np.all(np.isfinite(traj.q)) and np.all(np.isfinite(traj.v))
    assert np.abs(traj.g).max(initial=0) < 1e-9
    assert np.abs(traj.g_dot).max(initial=0) < 1e-8
    assert traj.smallest_gap.min() > -1e-9 or traj.stepper.manifest["compliant"] == ["rope"]


def test_pendulum_hits_the_wall(stepper: Build) -> None:
    """One rod from the horizontal: omega = sqrt(3 g / l) at the bottom, there reversed by e_N."""
    one = sg.build(pendulum_with_wall.model(links=1), stages=3)
    par = {"wall": 0.0, "mu": 0.0, "length": 0.4}
    traj = one.simulate(t_end=0.5, dt=1e-4, q0=[pi / 2], parameters=par)
    k = int(np.argmax(traj["end_1.P_N"] > 0))
    omega = sqrt(3 * G / 0.4)
    assert traj.v[k - 1, 0] == pytest.approx(-omega, rel=1e-4)
    assert traj.v[k, 0] == pytest.approx(0.5 * omega, rel=1e-3)


def test_pendulum_vibrates(stepper: Build) -> None:
    """Lowest frequency of three hanging rods from det(K - w^2 M) = 0, M and K written by hand."""
    n, length, mass = 3, 0.4, 0.5
    M, K = np.zeros((n, n)), np.zeros((n, n))
    for k in range(n):
        # centre of rod k: full lengths of the rods above, half of its own
        arm = length * np.array([1.0] * k + [0.5] + [0.0] * (n - k - 1))
        M += mass * np.outer(arm, arm)
        M[k, k] += mass * length**2 / 12
        K += mass * G * np.diag(arm)
    square, shapes = np.linalg.eig(np.linalg.solve(M, K))
    low = int(np.argmin(square))
    model = stepper(pendulum_with_wall.model)
    start = 1e-4 * shapes[:, low] / np.abs(shapes[:, low]).max()
    traj = model.simulate(t_end=6, dt=1e-2, q0=start, parameters={"wall": 10.0})
    zeros = crossings(traj.t, traj.q[:, -1])
    assert np.diff(zeros).mean() == pytest.approx(pi / sqrt(square[low]), rel=1e-6)


def crossings(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Times of sign changes, interpolated."""
    k = np.flatnonzero(x[:-1] * x[1:] < 0)
    return t[k] - x[k] * (t[k + 1] - t[k]) / (x[k + 1] - x[k])


@pytest.mark.parametrize("Omega", [8.0, 6.5])
def test_bead_settles(stepper: Build, Omega: float) -> None:
    traj = stepper(bead_on_hoop.model).simulate(
        t_end=25, dt=2e-2, parameters={"Omega": Omega, "c": 0.03}
    )
    assert traj.q[-1, 0] > 0
    assert cos(traj.q[-1, 0]) == pytest.approx(G / (0.3 * Omega**2), abs=2e-5)


def test_turntable_circle() -> None:
    """2/7 of the table's rate, and order s - 1 with the velocity constraint in the paper's form."""
    rate = 2 / 7 * 3.0
    errors = []
    steps = 40, 80, 160
    for stages in (3, 4):
        for n in steps:
            paper = sg.build(ball_on_turntable.model(), stages=stages, velocity_constraints="paper")
            traj = paper.simulate(t_end=2.0, dt=2.0 / n)
            exact = 0.3 * np.array([cos(rate * 2), sin(rate * 2)])
            errors.append(float(np.abs(traj.q[-1, :2] - exact).max()))
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert orders[[0, 1]] == pytest.approx([2, 2], abs=0.2)
    assert orders[[3, 4]] == pytest.approx([3, 3], abs=0.4)
    assert errors[-1] < 1e-6


def test_sleigh_runs_straight(stepper: Build) -> None:
    traj = stepper(chaplygin_sleigh.model).simulate(t_end=8, dt=2e-3)
    a, J, mass, omega = 0.15, 0.03, 2.0, 4.0
    assert traj["phi"][-1] == pytest.approx(pi / 2 * sqrt(1 + J / (mass * a**2)), rel=1e-4)
    assert np.hypot(*traj.v[-1, :2]) == pytest.approx(omega * sqrt(a**2 + J / mass), rel=1e-4)
    assert np.ptp(traj.energy) < 1e-4 * traj.energy[0]


@pytest.mark.parametrize("ratio", [0.95, 1.05])
def test_sphere_sticks_or_slips(stepper: Build, ratio: float) -> None:
    """The limit tan(alpha) = 7/2 mu is bracketed to 5 %; both accelerations are met."""
    mu = 0.2
    alpha = atan(3.5 * mu * ratio)
    traj = stepper(sphere_on_incline.model, 2).simulate(
        t_end=1, dt=1e-2, parameters={"alpha": alpha, "mu": mu}
    )
    sticks = 5 / 7 * G * sin(alpha)
    slips = G * (sin(alpha) - mu * cos(alpha))
    assert traj["x_dot"][-1] == pytest.approx(sticks if ratio < 1 else slips, rel=1e-6)
    slip = traj["x_dot"][-1] - 0.04 * traj["omega_y"][-1]
    assert abs(slip) < 1e-9 if ratio < 1 else slip > 0.05


def steady_rolling(lean: float, rate: float) -> tuple[float, float, float]:
    """Spin about the axis, speed and height of a spheroid that rolls steadily.

    e_3 the axis at the angle `lean` to the vertical k, e_1 perpendicular to it in the vertical
    plane; the frame turns with `rate` Omega about k. With omega = omega_3 e_3 + Omega sin e_1 and
    the touching point c = -(R^2 sin e_1 + b^2 cos e_3) / h, h^2 = R^2 sin^2 + b^2 cos^2, rolling
    gives the speed V = -(sin/h) (omega_3 R^2 - Omega b^2 cos); the horizontal force is m Omega V,
    and c x F = Omega k x L gives one linear equation for omega_3.
    """
    mass, R, b = 0.008, 0.012, 0.0015
    s, c = sin(lean), cos(lean)
    J_1, J_3 = mass * (3 * R**2 + 4 * b**2) / 12, mass * R**2 / 2
    h = sqrt(R**2 * s**2 + b**2 * c**2)
    # -m Omega s (omega_3 R^2 - Omega b^2 c) - m g s c (R^2 - b^2) / h
    #     = Omega s (J_3 omega_3 - J_1 Omega c)
    left = -mass * rate * s * R**2 - rate * s * J_3
    right = mass * G * s * c * (R**2 - b**2) / h - mass * rate**2 * s * b**2 * c
    right -= rate**2 * s * J_1 * c
    omega_3 = right / left
    return omega_3, -(s / h) * (omega_3 * R**2 - rate * b**2 * c), h


def test_coin_rolls_steadily(stepper: Build) -> None:
    lean, rate = 1.1, 12.0
    omega_3, V, h = steady_rolling(lean, rate)
    # axis e_3 = (sin, 0, cos): turned about y by `lean`; e_1 = (-cos, 0, sin); V along y = k x x
    q = [0, 0, h, cos(lean / 2), 0, sin(lean / 2), 0]
    omega = [-rate * sin(lean), 0, omega_3]  # in the body's axes: e_1 is -x
    p0, _, p2, _ = q[3:]
    H = np.array([[0, p0, 0, -p2], [-p2, 0, p0, 0], [0, p2, 0, p0]])
    p_dot = H.T @ omega / 2
    traj = stepper(coin.model).simulate(
        t_end=2 * pi / rate,
        dt=2 * pi / rate / 400,
        q0=q,
        v0=[0, V, 0, *p_dot],
        parameters={"M_roll": 0, "M_bore": 0},
    )
    assert traj["lean"] == pytest.approx(np.full(401, lean), abs=2e-3)
    # after one turn the centre is where it was; half a turn before it was a diameter away
    assert np.hypot(*(traj.q[-1, :2])) < 0.01 * abs(2 * V / rate)
    assert np.hypot(*(traj.q[200, :2])) == pytest.approx(abs(2 * V / rate), rel=5e-3)


def test_coin_comes_to_rest(stepper: Build) -> None:
    traj = stepper(coin.model).simulate(t_end=2, dt=1e-3)
    assert np.abs(traj.v[-1]).max() < 1e-9
    assert traj["z"][-1] == pytest.approx(0.0015, rel=1e-2)


def test_box_rests_on_four_corners(stepper: Build) -> None:
    traj = stepper(box_in_space.model, 2).simulate(
        t_end=0.5, dt=1e-2, q0=[0, 0, 0.1, 1, 0, 0, 0], v0=[0] * 7
    )
    P = np.array([traj[f"C{k}.P_N"][-1] for k in range(8)])
    assert P[:4] == pytest.approx(np.full(4, 9.81 * 1e-2 / 4), rel=1e-9)
    assert P[4:] == pytest.approx(np.zeros(4), abs=1e-15)


def test_rocking_block_impact(stepper: Build) -> None:
    alpha = atan2(0.2, 1.0)
    traj = stepper(rocking_block.model).simulate(t_end=1.0, dt=1e-4)
    k = int(np.argmax(traj["left.P_N"] > 0))
    ratio = traj["phi_dot"][k + 1] / traj["phi_dot"][k - 1]
    assert ratio == pytest.approx(1 - 1.5 * sin(alpha) ** 2, rel=2e-3)


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_rocking_block_period(stepper: Build, share: float) -> None:
    """Time from the lean theta_0 to upright: a quadrature of the exact pendulum, and Housner's."""
    width, height = 0.1, 1.0
    alpha, R = atan2(width, height), sqrt(width**2 + height**2) / 2
    lean = share * alpha
    # leans to the right by `lean`, its lower right corner on the floor
    c, s = cos(lean), sin(lean)
    q = [width / 2 + height / 2 * s - width / 2 * c, width / 2 * s + height / 2 * c, -lean]
    traj = stepper(rocking_block.model).simulate(
        t_end=2.0, dt=1e-3, q0=q, parameters={"width": width, "mu": 2.0}
    )
    k = int(np.argmax(traj["left.P_N"] > 0))
    rate = lambda x: sqrt(3 * G / (2 * R) * (cos(alpha - lean) - cos(alpha - x)))  # noqa: E731
    with mpmath.workdps(15):
        # substitution x = lean - y^2 takes the square root's singularity away
        quarter = float(mpmath.quad(lambda y: 2 * y / rate(lean - y**2), [1e-6, sqrt(lean)]))
    housner = acosh(1 / (1 - share)) / sqrt(3 * G / (4 * R))
    assert traj.t[k] == pytest.approx(quarter, abs=2e-3)
    assert quarter == pytest.approx(housner, rel=0.02)


@pytest.mark.parametrize(("side", "periods"), [(0.97, 1), (1.03, 2)])
def test_table_doubles_the_period(stepper: Build, side: float, periods: int) -> None:
    e = 0.5
    limit = sqrt((pi * (1 - e) / (1 + e)) ** 2 + (2 * (1 + e**2) / (1 + e) ** 2) ** 2)
    T = 1 / 20
    traj = stepper(vibrating_table.model, 2).simulate(
        t_end=200 * T, dt=T / 2000, parameters={"Gamma": side * limit}
    )
    hits = np.flatnonzero(traj["table.P_N"] > 0)[-9:]
    # phases of the bounces, in steps within a period
    phase = hits % 2000
    spread = np.ptp(phase[::2]), abs(np.mean(phase[::2]) - np.mean(phase[1::2]))
    assert np.diff(hits).mean() == pytest.approx(2000, rel=1e-3)
    assert spread[0] <= 6
    assert (spread[1] > 40) == (periods == 2)


@pytest.mark.parametrize("stages", [2, 3, 4])
def test_cradle(stepper: Build, stages: int) -> None:
    """Touching: all at once. Separated: one after the other. Any phase within the step."""
    model = stepper(cradle.model, stages)
    for phase in np.linspace(0, 1, 21):
        q = np.array([-1e-3 * phase, 0.05, 0.09])
        together = model.simulate(t_end=0.1, dt=1e-3, q0=q)
        assert together.v[-1] == pytest.approx([-1 / 3, 2 / 3, 2 / 3], abs=1e-12)
        apart = model.simulate(t_end=0.1, dt=1e-3, q0=q + np.array([0, 0, 0.01]))
        assert apart.v[-1] == pytest.approx([0, 0, 1], abs=1e-12)


def test_woodpecker_limit_cycle(stepper: Build) -> None:
    """Leine, Glocker, van Campen: the start (phi_M, phi_S) = (-0.1036, -0.2788), speeds
    (-0.3411, 0, -7.4583) lies on the limit cycle; each period has a beak impact and jams below
    and above."""
    traj = stepper(woodpecker.model).simulate(t_end=1.2, dt=2e-5)
    hits = traj.t[np.flatnonzero(np.diff((traj["beak.P_N"] > 0).astype(int)) == 1)]
    hits = hits[np.flatnonzero(np.diff(hits, prepend=-1) > 0.05)]
    period = np.diff(hits)
    assert len(period) >= 6
    assert period == pytest.approx(np.full(len(period), period.mean()), rel=5e-3)
    # one period after a passage of the paper's state the state comes back
    near = np.abs(traj.q[:, 2] + 0.2788) + np.abs(traj.v[:, 2] + 7.4583) / 30
    later = np.flatnonzero(traj.t > 0.5)
    k = later[int(np.argmin(near[later]))]
    assert traj.q[k, 1:] == pytest.approx([-0.1036, -0.2788], abs=4e-3)
    assert traj.v[k] == pytest.approx([-0.3411, 0, -7.4583], abs=0.08)
    # sequence within one period: beak, upper edge, lower edge
    window = (traj.t > hits[2]) & (traj.t <= hits[3])
    order = [name for name in ("beak", "upper", "lower") if (traj[f"{name}.P_N"][window] > 0).any()]
    assert order == ["beak", "upper", "lower"]
    first = {n: traj.t[window][np.argmax(traj[f"{n}.P_N"][window] > 0)] for n in ("upper", "lower")}
    assert hits[2] < first["upper"] < first["lower"] < hits[3]


def test_rimless_wheel_walks(stepper: Build) -> None:
    mass, J, length, slope, alpha = 2.0, 0.05, 0.3, 0.15, pi / 8
    inertia = J + mass * length**2
    eta = (J + mass * length**2 * cos(2 * alpha)) / inertia
    traj = stepper(rimless_wheel.model, 2).simulate(t_end=8, dt=5e-4)
    omega = traj["phi_dot"]
    jumps = np.flatnonzero(np.abs(np.diff(omega)) > 0.1 * np.abs(omega[:-1]))
    jumps = jumps[np.flatnonzero(np.diff(jumps, prepend=-9) > 2)][-5:]
    before, after = omega[jumps - 1], omega[jumps + 2]
    assert after / before == pytest.approx(np.full(len(jumps), eta), rel=5e-3)
    gain = 4 * mass * G * length * sin(alpha) * sin(slope) / inertia
    assert after**2 == pytest.approx(np.full(len(jumps), eta**2 / (1 - eta**2) * gain), rel=1e-2)


@pytest.mark.parametrize("stages", [2, 3])
def test_painleve_impact_without_collision(stepper: Build, stages: int) -> None:
    """The percussion that stops slip and normal velocity of the tip at once, for any step size."""
    mass, half, theta, speed = 1.0, 0.5, 0.9, 1.0
    J = mass * half**2 / 3
    r = np.array([-half * cos(theta), -half * sin(theta)])
    # velocity of the tip per percussion: G = 1/m + J^-1 (r_perp)(r_perp)^T
    perp = np.array([-r[1], r[0]])
    Gram = np.eye(2) / mass + np.outer(perp, perp) / J
    mu = 1.8
    sliding = Gram[1] @ [mu, 1]  # percussion (mu, 1) opposes slip to the left
    assert sliding < 0  # Painleve's condition
    P = np.linalg.solve(Gram, [speed, 0])
    for h in (1e-3, 1e-4, 1e-5):
        traj = stepper(painleve_rod.model, stages).simulate(t_end=h, dt=h)
        assert traj["tip.P_N"][1] == pytest.approx(P[1], rel=0.02)
        assert traj["tip.P_F"][1] == pytest.approx(P[0], rel=0.02)
    assert abs(P[0]) < mu * P[1]


@pytest.mark.parametrize(("share", "stands"), [(0.95, True), (1.05, False)])
def test_block_stack(stepper: Build, share: float, stands: bool) -> None:
    traj = stepper(block_stack.model, 2).simulate(t_end=1.5, dt=5e-3, parameters={"share": share})
    assert (np.abs(traj["b2_phi"][-1]) < 1e-9) == stands
    if stands:
        weight = traj["floor0_2.P_N"][-1] + traj["floor0_3.P_N"][-1]
        assert weight == pytest.approx(3 * G * 5e-3, rel=1e-9)


def least_thickness(blocks: int) -> float:
    """Thinnest arch (R = 1) with a thrust line inside every joint: limit analysis by hand.

    The right springing pushes with (-H, V), V half the weight, at x_0. Moments of it and of the
    weights up to a joint about its inner corner must be >= 0, about its outer corner <= 0: linear
    in H and V x_0, feasible iff a vertex of the inequalities is.
    """
    half = pi / (2 * blocks)

    def feasible(thick: float) -> bool:
        outer, inner = 1 + thick / 2, 1 - thick / 2
        reach = 2 * sin(half) / (3 * half) * (outer**3 - inner**3) / (outer**2 - inner**2)
        centre = reach * np.cos((2 * np.arange(blocks) + 1) * half)
        V = blocks / 2  # weight of a block: 1
        rows, limits = [], []  # rows . (H, V x_0) <= limits
        for k in range(blocks + 1):
            for radius, sign in ((inner, -1), (outer, 1)):
                x, y = radius * cos(2 * k * half), radius * sin(2 * k * half)
                # moment about (x, y): (x_0 - x) V - (0 - y)(-H) - sum (x_j - x)
                constant = -x * V - float(np.sum(centre[:k] - x))
                rows.append([-sign * y, sign * 1.0])
                limits.append(-sign * constant)
        A, b = np.array(rows), np.array(limits)
        for i in range(len(b)):
            for j in range(i):
                if abs(np.linalg.det(A[[i, j]])) > 1e-12:
                    point = np.linalg.solve(A[[i, j]], b[[i, j]])
                    if np.all(A @ point <= b + 1e-12):
                        return True
        return False

    low, high = 0.01, 0.5
    while high - low > 1e-5:
        middle = (low + high) / 2
        low, high = (low, middle) if feasible(middle) else (middle, high)
    return high


def test_least_thickness_of_many_blocks() -> None:
    """Milankovitch's 0.1075 in the limit of many blocks."""
    assert least_thickness(60) == pytest.approx(0.1075, abs=1e-3)


@pytest.mark.parametrize(("share", "stands"), [(1.05, True), (0.95, False)])
def test_arch(stepper: Build, share: float, stands: bool) -> None:
    traj = stepper(arch.model, 2).simulate(
        t_end=1.0, dt=5e-3, parameters={"thick": share * least_thickness(5)}
    )
    moved = np.abs(traj.q[-1] - traj.q[0]).max()
    assert moved < 1e-9 if stands else moved > 1e-3


def falling_oscillator() -> float:
    """Period of the stick-slip cycle by its own integration: stick in closed form, slip by RK4."""
    delta, belt = 3.0, 0.2
    # slip starts at x = F_s / k = 1 with the belt's speed and ends when the speed is back
    x, v, t, h = 1.0, belt, 0.0, 1e-4

    def rate(x: float, v: float) -> tuple[float, float]:
        slip = min(v - belt, 0.0)
        return v, -x + 1 / (1 + delta * abs(slip))

    while t < 30:
        k1 = rate(x, v)
        k2 = rate(x + h / 2 * k1[0], v + h / 2 * k1[1])
        k3 = rate(x + h / 2 * k2[0], v + h / 2 * k2[1])
        k4 = rate(x + h * k3[0], v + h * k3[1])
        x_new = x + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        v_new = v + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        if t > 0.1 and v_new >= belt:
            part = (belt - v) / (v_new - v)
            return t + part * h + (1 - (x + part * (x_new - x))) / belt
        x, v, t = x_new, v_new, t + h
    raise AssertionError("the mass never sticks again")


def test_conveyor_limit_cycle(stepper: Build) -> None:
    traj = stepper(conveyor_oscillator.model).simulate(t_end=80, dt=5e-3)
    # the belt tears off where x falls below its largest value
    tops = crossings(traj.t, traj["x_dot"])
    falling = tops[np.interp(tops + 0.05, traj.t, traj["x_dot"]) < 0]
    assert np.diff(falling[2:]).mean() == pytest.approx(falling_oscillator(), rel=2e-3)


def test_andrews_squeezer(stepper: Build) -> None:
    """Reference solution of the Test Set for IVP Solvers at t = 0.03."""
    reference = [
        *(15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948),
        *(0.5244099658805304, 0.5347301163226948, 1.048080741042263),
    ]
    traj = stepper(andrews_squeezer.model, 4).simulate(t_end=0.03, dt=5e-5)
    assert traj.q[-1] == pytest.approx(reference, rel=1e-8)


def test_hopper_keeps_its_speed(stepper: Build) -> None:
    """Set points of the controller: forward speed, level body, the same height in every hop."""
    for speed in (0.5, 0.8):
        traj = stepper(hopper.model, 2).simulate(
            t_end=12, dt=1e-3, inputs=hopper.controller(speed=speed)
        )
        last = traj.t > 8
        mean = np.ptp(traj["x"][last]) / np.ptp(traj.t[last])
        assert mean == pytest.approx(speed, rel=0.1)
        assert np.abs(traj["phi"][last]).max() < 0.03
        y = traj["y"][last]
        tops = y[1:-1][(y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:])]
        assert len(tops) > 5
        assert np.ptp(tops) < 0.03 * tops.mean()


def test_groove_carries_the_weight(stepper: Build) -> None:
    """Without friction each wall carries m g / (2 cos(alpha))."""
    alpha, dt = pi / 4, 5e-3
    traj = stepper(v_groove.model).simulate(
        t_end=0.1, dt=dt, q0=[0, 0.1, 0], v0=[0, 0, 0], parameters={"mu": 0, "alpha": alpha}
    )
    walls = {side: sum(traj[f"{side}_{k}.P_N"][-1] for k in range(4)) for side in ("left", "right")}
    assert walls["left"] == pytest.approx(G * dt / (2 * cos(alpha)), rel=1e-9)
    assert walls["right"] == pytest.approx(walls["left"], rel=1e-9)


@pytest.mark.parametrize(("beta", "slides"), [(0.35, False), (0.45, True)])
def test_prism_slides_along_the_chute(stepper: Build, beta: float, slides: bool) -> None:
    """Slides iff tan(beta) > mu / cos(alpha) = 0.424, as fast as both walls allow."""
    alpha, mu, t_end = pi / 4, 0.3, 0.2
    traj = stepper(prism_in_chute.model).simulate(
        t_end=t_end, dt=5e-3, q0=[0, 0.1, 0, 0], v0=[0, 0, 0, 0], parameters={"beta": beta}
    )
    speed = G * (sin(beta) - mu * cos(beta) / cos(alpha)) * t_end if slides else 0.0
    np.testing.assert_allclose(traj.v[-1], [0, 0, speed, 0], rtol=0, atol=1e-8)


def test_drawer_jams(stepper: Build) -> None:
    """Jams iff 2 mu e > l, whatever the force."""
    mu, length = 0.8, 0.3
    limit = length / (2 * mu)
    for factor, jams in ((0.95, False), (1.05, True)):
        for F in (1.0, 1e3):
            traj = stepper(drawer.model).simulate(
                t_end=0.1,
                dt=1e-4,
                parameters={"mu": mu, "length": length, "e": factor * limit, "F": F, "play": 1e-6},
            )
            moved = abs(traj["x"][-1]) > 1e-4 * F
            assert moved != jams


def test_domino_tips(stepper: Build) -> None:
    """One domino falls iff it leans by more than atan(w/h)."""
    one = sg.build(dominoes.model(count=1), stages=3)
    critical = atan(0.008 / 0.048)
    for factor, angle in ((0.95, 0.0), (1.05, -pi / 2)):
        par = {"lean": factor * critical, "mu": 2.0}
        traj = one.simulate(t_end=4.0, dt=1e-3, parameters=par)
        assert traj["d0_phi"][-1] == pytest.approx(angle, abs=1e-8)


def test_chain_presses_threefold(stepper: Build) -> None:
    """With k beads on the table at the time t the percussion so far is k m g t."""
    traj = stepper(falling_chain.model).simulate(t_end=0.3, dt=1e-3, parameters={"x": 0})
    landed = np.sqrt(2 * 0.1 * np.arange(1, 6) / G)
    total = np.cumsum(sum(traj[f"table{k}.P_N"] for k in range(5)))
    for t, pressed in zip(traj.t, total, strict=True):
        if np.abs(landed - t).min() < 2e-3:
            continue
        assert pressed == pytest.approx(np.sum(landed < t) * 0.01 * G * t, abs=1e-12)


def test_chain_does_not_stretch(stepper: Build) -> None:
    """Hanging from nothing but pulled apart, beads stay within a string's length."""
    traj = stepper(falling_chain.model).simulate(
        t_end=0.2, dt=1e-3, v0={"b0_x": -1.0, "b4_x": 1.0}, parameters={"x": 0.3}
    )
    points = traj.q.reshape(len(traj), 5, 2)
    apart = np.linalg.norm(np.diff(points, axis=1), axis=2)
    assert apart.max() < 0.1 + 1e-12
    assert traj.P_N.max() > 0


def test_table_shares_its_weight(stepper: Build) -> None:
    """Equal legs in the middle; off it, of all percussions in balance those of least norm."""
    model, dt = stepper(table_with_legs.model, 2), 5e-3
    rest = {"q0": {"z": 0.7}, "v0": np.zeros(7), "t_end": 0.05, "dt": dt}
    even = model.simulate(**rest)
    np.testing.assert_allclose(even.P_N[-1], 10 * G * dt / 5, rtol=1e-9)
    aside = 0.1
    odd = model.simulate(**rest, parameters={"aside": aside, "mu": 0})
    angles = 2 * pi * np.arange(5) / 5
    place = np.array([0.5 * np.cos(angles) - aside, 0.5 * np.sin(angles)])
    balance = np.vstack([np.ones(5), place])
    np.testing.assert_allclose(balance @ odd.P_N[-1], [10 * G * dt, 0, 0], atol=1e-10)
    # Effective masses of the legs, J about the horizontal axes; the last term is the mobility in
    # the direction of the quaternion's length, with the mass 2 tr(J) of (p . p_dot)^2.
    J = 10 * (3 * 0.5**2 + 0.04**2) / 12
    stretch = (2 * 0.7) ** 2 / (2 * (2 * J + 10 * 0.5**2 / 2))
    root = np.sqrt(1 / (1 / 10 + (place**2).sum(axis=0) / J + stretch))
    least = root * (np.linalg.pinv(balance * root) @ np.array([10 * G * dt, 0, 0]))
    np.testing.assert_allclose(odd.P_N[-1], least, rtol=1e-8)


def test_four_bar_swings(stepper: Build) -> None:
    """Period of the equivalent pendulum; redundant constraints do not drift."""
    traj = stepper(four_bar.model, 3).simulate(t_end=3.0, dt=1e-2, parameters={"phi": 0.01})
    length = 0.3 * (2 / 3 * 0.2 + 0.5) / 0.7
    period = 2 * np.diff(crossings(traj.t, traj["angle"])).mean()
    assert period == pytest.approx(2 * pi * sqrt(length / G), rel=1e-4)
    assert np.abs(traj.g).max() < 1e-14
    assert np.abs(traj.g_dot).max() < 1e-13
    assert np.all(traj.percussions[1:] >= 1)
