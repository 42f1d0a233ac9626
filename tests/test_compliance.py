"""Compliance as an inclusion: contacts and joints that yield, at any step size."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.models import bungee
from signorini.runtime.stability import stable_step
from trap_models import yielding

Build = Callable[..., sg.Stepper]
G = 9.81


def buffer() -> sg.Model:
    """A mass against a buffer, mirrored by a mass on a spring that also pulls."""
    m = sg.Model("buffer")
    x, z = m.coordinates("x z")
    v_x, v_z = m.velocities
    mass, c, tau = m.parameters(mass=2.0, c=1e-5, tau=0.0)
    m.lagrangian = mass * (v_x**2 + v_z**2) / 2
    m.contact("stop", g_N=x, compliance=c, relaxation=tau)
    m.constraint("spring", z, compliance=c, relaxation=tau)
    m.initial_state(q=[0, 0], v=[-1, -1])
    m.suggest(dt=1e-4, t_end=1e-2)
    return m


@pytest.mark.parametrize("stages", [2, pytest.param(4, marks=pytest.mark.thorough)])
def test_hookes_contact(stepper: Build, stages: int) -> None:
    """It lasts pi sqrt(m c), is compressed by v sqrt(m c), and gives the velocity back."""
    made = stepper(buffer, stages)
    time = np.pi * np.sqrt(2e-5)
    found = []
    for n in (200, 400):
        run = made.simulate(dt=time / n, t_end=2 * time)
        left = np.flatnonzero(run.q[:, 0] > 0)[0]
        over = run.q[left, 0] / run.v[left, 0]
        found.append([run.v[-1, 0], -run.q[:, 0].min(), run.t[left] - over])
        assert run.smallest_gap.min() == np.inf  # no rigid contact
    exact = np.array([1, np.sqrt(2e-5), time])
    errors = np.array(found) / exact - 1
    # velocity and compression are of first order, the time even of second
    assert errors[0] / errors[1] == pytest.approx([2, 2, 4], rel=0.02)
    assert np.abs(2 * errors[1] - errors[0])[:2].max() < 3e-4
    assert np.abs(errors[1]).max() < 1.5e-2


def test_a_damped_spring(stepper: Build) -> None:
    """v = -e^(-d t) (cos(w t) - d / w sin(w t)) with d = tau / (2 m c), w^2 = 1 / (m c) - d^2."""
    made = stepper(buffer, 2)
    k, tau = 1 / 2e-5, 2e-3
    d = tau * k / 2
    w, t = np.sqrt(k - d * d), 0.02
    exact = -np.exp(-d * t) * (np.cos(w * t) - d / w * np.sin(w * t))
    errors = [
        made.simulate(dt=t / n, t_end=t, parameters={"tau": tau}).v[-1, 1] - exact
        for n in (500, 1000, 2000)
    ]
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.05)
    assert abs(2 * errors[2] - errors[1]) < 1e-4


@pytest.mark.parametrize("stages", [2, pytest.param(5, marks=pytest.mark.thorough)])
def test_no_step_is_too_large(stepper: Build, stages: int) -> None:
    """The spring alone dies down whatever the step, the compliance and the relaxation."""
    made = stepper(buffer, stages)
    for c in (0.0, 1e-12, 1e-6, 1.0, 1e3):
        for tau in (0.0, 1e-4, 10.0):
            for dt in (1e-4, 1e-2, 3.0):
                run = made.simulate(
                    dt=dt, t_end=400 * dt, parameters={"c": c, "tau": tau}, q0=[1, 0], v0=[0, -1]
                )
                size = np.hypot(run.q[:, 1] / np.sqrt(2 * c + 0.25 * dt * dt), run.v[:, 1])
                assert size[-1] <= size.max() <= 3, (c, tau, dt)
                stiff = 2 * c < dt * dt and tau < dt
                assert size[-1] < (1e-12 if stiff else 1.1), (c, tau, dt, size)


def table(compliance: float | None = None) -> sg.Model:
    """A plate on four feet that are not equally stiff, with friction; one foot is shorter."""
    m = sg.Model("table")
    y, a, b, _ = m.coordinates("y a b x")
    v_y, v_a, v_b, v_x = m.velocities
    where, c = m.parameters(where=0.1, c=1.0)
    m.lagrangian = (10 * (v_y**2 + v_x**2) + v_a**2 + v_b**2) / 2 - 10 * G * (y + where * a)
    for k, (i, j) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        gap = y + i * a + j * b
        soft = {} if compliance is None else {"compliance": c * (k + 1) * compliance}
        m.contact(f"foot_{k}", g_N=gap, gamma_F=v_x, mu=0.3, **soft)
    m.initial_state(q=[0, 0, 0, 0], v=[0, 0, 0, 1])
    return m


def test_four_feet_share_the_weight_by_their_compliances() -> None:
    """Statically indeterminate: places and forces from three balances and four springs."""
    made = sg.build(table(1e-6), stages=2)
    run = made.simulate(dt=0.05, t_end=4)
    signs = np.array([[1, 1, 1], [1, -1, 1], [1, -1, -1], [1, 1, -1]])
    stiffness = np.diag(1 / (np.arange(1, 5) * 1e-6))
    weight = 10 * G * np.array([1, 0.1, 0])
    place = np.linalg.solve(signs.T @ stiffness @ signs, -weight)
    force = [run[f"foot_{k}.force_N"][-1] for k in range(4)]
    assert run.q[-1, :3] == pytest.approx(place, rel=1e-9)
    assert force == pytest.approx(-stiffness @ signs @ place, rel=1e-9)
    assert sum(force) == pytest.approx(10 * G, rel=1e-12)
    assert run["foot_0.state"][-1] == "stick"
    # friction is that of the weight, whoever carries it
    slides = run.v[:, 3] > 0
    assert run.v[slides, 3] == pytest.approx(1 - 0.3 * G * run.t[slides], abs=2e-3)


def test_the_rigid_limit() -> None:
    """c = 0 is the rigid contact and joint, impacts too; what is left of c falls with it."""
    rigid = sg.build(table(), stages=3).simulate(dt=1e-2, t_end=0.3, q0=[0.02, 0, 0, 0])
    made = sg.build(table(1e-6), stages=3)
    none = made.simulate(dt=1e-2, t_end=0.3, q0=[0.02, 0, 0, 0], parameters={"c": 0.0})
    assert none.q == pytest.approx(rigid.q, abs=1e-12)
    assert none.v == pytest.approx(rigid.v, abs=1e-11)
    apart = [
        np.abs(
            made.simulate(dt=1e-2, t_end=0.3, q0=[0.02, 0, 0, 0], parameters={"c": c}).q - rigid.q
        ).max()
        for c in (1e-2, 1e-4)
    ]
    assert apart[1] == pytest.approx(apart[0] / 100, rel=0.05)


def test_a_bungee_jump(stepper: Build) -> None:
    """The rope is stretched by m g c + sqrt((m g c)^2 + 2 m g c (l - y_0)) at most."""
    made = stepper(bungee.model, 2)
    sag = 75 * G * 5e-3
    deepest = 20 + sag + np.sqrt(sag**2 + 2 * sag * 19)
    down = {"push": 0.0}
    errors = [
        -made.simulate(dt=dt, t_end=6, parameters=down).q[:, 1].min() - deepest
        for dt in (4e-3, 2e-3)
    ]
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.05)
    assert abs(2 * errors[1] - errors[0]) < 1e-3
    run = made.simulate(dt=1e-3, t_end=8, parameters=down)
    taut = run["rope.state"] == "closed"
    pull = run["rope.force_N"]
    assert pull[1:][~taut[1:] & ~taut[:-1]].max() == 0
    assert pull.max() == pytest.approx((deepest - 20) / 5e-3, rel=2e-3)


def clamped(kind: str) -> sg.Model:
    """A mass between two springs that press against each other; they do as an input says."""
    m = sg.Model("clamped")
    (x,), (v,) = m.coordinates("x"), m.velocities
    c, tau = m.parameters(c=1e-6, tau=0.0)
    (stiffer,) = m.inputs("stiffer")
    m.lagrangian = v**2 / 2
    laws = {"compliance": c / (1 + stiffer), "relaxation": tau}
    if kind == "joint":
        m.constraint("one", x - 0.1, **laws)
        m.constraint("two", x + 0.1, **laws)
    else:
        m.contact("one", g_N=x - 1e-3, **laws)
        m.contact("two", g_N=-1e-3 - x, **laws)
    m.initial_state(q=[1e-4])
    return m


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["joint", "contact"])
def test_what_is_clamped_comes_to_rest(kind: str) -> None:
    """Nothing but two forces that cancel: no step fails on round-off, whatever its size; at rest
    each spring has what its place says, as stiff as the input makes it."""
    made = sg.build(clamped(kind), stages=2)
    apart = 0.2 if kind == "joint" else 2e-3
    for dt in (1e-1, 1e-2, 1e-3, 1e-4):
        for c in (1e-3, 1e-6, 1e-9):
            for stiffer in (0.0, 3.0):
                run = made.simulate(
                    dt=dt, t_end=400 * dt, parameters={"c": c, "tau": dt}, inputs=[stiffer]
                )
                assert abs(run.q[-1, 0]) < 1e-4
                name = "one.force" if kind == "joint" else "one.force_N"
                force = abs(float(np.ravel(run[name][-1])[0]))
                place = (apart / 2 - (run.q[-1, 0] + dt / 2 * run.v[-1, 0])) * (1 + stiffer) / c
                assert force == pytest.approx(place, rel=0.05)


@pytest.mark.thorough
@pytest.mark.parametrize("stages", [3, 4, 5])
def test_no_compliance_is_the_rigid_law(stages: int) -> None:
    """Boxes fall on their corners; contacts that close at an inner stage alone, too."""

    def falling(**soft: float) -> sg.Stepper:
        m = sg.Model("falling")
        _, y, phi = m.coordinates("x y phi")
        v_x, v_y, omega = m.velocities
        m.lagrangian = (v_x**2 + v_y**2) / 2 + omega**2 / 120 - G * y
        s, c = sp.sin(phi), sp.cos(phi)
        for k, (a, b) in enumerate(((0.2, -0.1), (-0.2, -0.1), (0.2, 0.1), (-0.2, 0.1))):
            gap = y + s * a + c * b
            m.contact(f"corner_{k}", g_N=gap, gamma_F=v_x - (s * a + c * b) * omega, mu=0.3, **soft)
        m.initial_state(q=[0, 0.5, 0.3])
        return sg.build(m, stages=stages)

    rigid, soft = falling(), falling(compliance=0.0)
    rng = np.random.default_rng(1)
    for _ in range(12):
        start = {"q0": [0, 0.3, rng.normal()], "v0": rng.normal(size=3)}
        one, other = (made.simulate(dt=1e-2, t_end=0.5, **start) for made in (rigid, soft))
        assert one.v == pytest.approx(other.v, abs=1e-9)


@pytest.mark.thorough
def test_a_joint_that_yields_does_not_hide_an_oscillation() -> None:
    """A stiff potential along a compliant row limits the step, along a rigid one it does not."""
    for compliance, limit in ((1e-9, 2 / np.sqrt(5e4)), (None, np.inf)):
        m = sg.Model("m")
        x, y = m.coordinates("x y")
        m.lagrangian = sum(v**2 for v in m.velocities) / 2 - 2.5e4 * x**2
        m.constraint("joint", x - 0 * y, compliance=compliance)
        m.initial_state(q=[0, 0])
        made = sg.build(m, stages=2)
        h = stable_step(made, *made.initial_state(), None, {})
        assert h == pytest.approx(limit, rel=1e-3)


def test_batches_and_parameters(stepper: Build) -> None:
    made = stepper(buffer, 2)
    few = made.simulate_batch(dt=1e-4, t_end=1e-2, parameters={"c": np.array([1e-5, 1e-6])})
    for k, c in enumerate((1e-5, 1e-6)):
        alone = made.simulate(dt=1e-4, t_end=1e-2, parameters={"c": c})
        assert np.array_equal(few.q[k, -1], alone.q[-1])
    for law, name in (("c", "compliance"), ("tau", "relaxation")):
        with pytest.raises(sg.RunError, match=rf"{name} of 'spring' is -1.*>= 0"):
            made.simulate(dt=1e-4, t_end=1e-2, parameters={law: -1.0})
    wrong = {"c": np.array([1e-5, -1e-3]), "tau": np.array([0.0, -1.0])}
    few = made.simulate_batch(dt=1e-4, t_end=1e-2, parameters=wrong)
    assert few.status == ["OK", "BAD_ARGUMENT"]


def test_what_compliance_does_not_go_with() -> None:
    m = sg.Model("m")
    x, y = m.coordinates("x y")
    m.lagrangian = sum(v**2 for v in m.velocities) / 2
    for laws in ({"e_N": 0.5}, {"impact": "poisson"}):
        with pytest.raises(sg.ModelError, match="leave restitution out"):
            m.contact("floor", g_N=y, compliance=1e-3, **laws)
    with pytest.raises(sg.ModelError, match="without a compliance"):
        m.constraint("rail", x, relaxation=0.1)
    with pytest.raises(sg.ModelError, match=r"compliance of 'rod'.*A compliance is >= 0"):
        m.constraint("rod", x, compliance=-1)
        m.initial_state(q=[0, 0])
        sg.build(m)
    for options, words in (
        ({"events": "located"}, "captured steps alone"),
        ({"derivatives": True}, "captured steps alone|not differentiated"),
        ({"scheme": "moreau"}, "captured steps alone"),
    ):
        with pytest.raises(sg.GenerationError, match=words):
            sg.build(buffer(), stages=2, **options)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("make", "stages", "options"),
    [(yielding, (2, 3), {}), (buffer, (2,), {"precision": "float"}), (bungee.model, (2,), {})],
)
def test_compliance_is_checked(
    make: Callable[[], sg.Model], stages: tuple[int, ...], options: dict[str, Any]
) -> None:
    report = sg.check(make(), stages=stages, **options)
    assert report.passed, str(report)
