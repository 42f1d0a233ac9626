"""Redundant contacts, units, scratch memory, determinism."""

import ctypes
from collections.abc import Callable

import numpy as np
import pytest
import signorini as sg
from signorini.models import bouncing_ball, box, box_in_space, chaplygin_sleigh, slider_crank
from signorini.runtime.options import RunOptions
from signorini.runtime.run import Run
from signorini.stress.campaign import case_of, stepper_of
from signorini.stress.corpus import SEED
from trap_models import rheonomic

Build = Callable[..., sg.Stepper]


@pytest.mark.parametrize("s", [2, 3, 4])
def test_two_hundred_box_drops(s: int, stepper: Build) -> None:
    compiled = stepper(box.model, s)
    rng = np.random.default_rng(s)
    substeps = steps = 0
    for _ in range(200):
        traj = compiled.simulate(
            t_end=1.5,
            dt=1e-2,
            q0=[0, rng.uniform(0.25, 0.6), rng.uniform(-3, 3)],
            v0=rng.normal(size=3) * [1, 1, 5],
            parameters={"mu": rng.uniform(0, 1.5), "e_N": rng.choice([0, rng.uniform()])},
        )
        assert traj.smallest_gap.min() > -1e-11
        assert np.all(traj.P_N >= -1e-12)
        substeps += np.count_nonzero(traj.substeps)
        steps += len(traj) - 1
    assert steps == 200 * 150
    assert substeps <= steps / 1000


def test_box_drops_in_space(stepper: Build) -> None:
    compiled = stepper(box_in_space.model, 2)
    rng = np.random.default_rng(0)
    for _ in range(10):
        p = rng.normal(size=4)
        p /= np.linalg.norm(p)
        q0 = [0, 0, rng.uniform(0.3, 0.6), *p]
        _, v0 = compiled.project(q0, rng.normal(size=7))
        traj = compiled.simulate(t_end=1.5, dt=1e-2, q0=q0, v0=v0, parameters={"mu": rng.uniform()})
        assert traj.smallest_gap.min() > -1e-11
        assert np.max(np.abs(traj.g)) < 1e-11
        assert np.max(np.abs(traj.g_dot)) < 1e-9


def test_equal_percussions_at_rest(stepper: Build) -> None:
    """Hyperstatic rest: the percussions of least norm are the symmetric ones."""
    planar = stepper(box.model, 3).simulate(t_end=0.2, dt=1e-2, q0=[0, 0.1, 0], v0=[0, 0, 0])
    np.testing.assert_allclose(planar["A.P_N"][1:], 9.81e-2 / 2, rtol=1e-9)
    np.testing.assert_allclose(planar["B.P_N"][1:], 9.81e-2 / 2, rtol=1e-9)
    space = stepper(box_in_space.model, 2).simulate(
        t_end=0.2, dt=1e-2, q0=[0, 0, 0.1, 1, 0, 0, 0], v0=np.zeros(7)
    )
    np.testing.assert_allclose(space.P_N[1:, :4], 9.81e-2 / 4, rtol=1e-9)
    assert np.all(space.P_N[:, 4:] == 0)
    assert np.max(np.abs(space.P_F)) < 1e-14


@pytest.mark.parametrize(
    "model",
    [slider_crank.model, box.model, box_in_space.model, rheonomic, chaplygin_sleigh.model],
)
def test_scratch_memory_carries_nothing(model: Callable[[], sg.Model], stepper: Build) -> None:
    """NaN in every byte of p_work before each step changes no bit."""
    compiled = stepper(model, 3)
    dt = 1e-4 if model is slider_crank.model else 1e-2
    lib = compiled.library
    u = lib.array(np.full(max(1, compiled.sizes["n_u"]), 0.3))
    states = []
    for fill in (False, True):
        start = compiled.initial_state()
        run = Run(compiled, compiled.parameters, RunOptions(), *start, dt, 120, 1, False)
        trace = []
        for _ in range(120):
            if fill:
                ctypes.memset(ctypes.byref(run.work), 0xFF, ctypes.sizeof(run.work))
            status = lib.call["step"](
                run.state, run.work, run.info, run.params, run.options, lib.pointer(u), dt
            )
            assert status <= 2
            trace.append(bytes(run.state))
        states.append(trace)
    assert states[0] == states[1]


def test_no_stress_is_left_between_sticking_corners(stepper: Build) -> None:
    """A box that tilts onto its base: of all friction at rest the least is none."""
    traj = stepper(box.model, 3).simulate(
        t_end=2, dt=1e-2, q0=[0, 0.2, 0.3], v0=[0.3, 0, 0], parameters={"e_N": 0, "mu": 0.8}
    )
    assert np.max(np.abs(traj.v[-1])) < 1e-10
    assert np.max(np.abs(traj.P_F[-1])) < 1e-10
    np.testing.assert_allclose(traj.P_N[-1, :2], 9.81e-2 / 2, rtol=1e-8)


LENGTH, MASS, INERTIA, ACCELERATION = (1, 0, 0), (0, 1, 0), (2, 1, 0), (1, 0, -2)
UNITS = {
    box.model: (
        {"mass": MASS, "a": LENGTH, "b": LENGTH, "grav": ACCELERATION},
        (1, 1, 0),
        1e-2,
        250,
    ),
    box_in_space.model: (
        {"mass": MASS, "a": LENGTH, "b": LENGTH, "c": LENGTH, "grav": ACCELERATION},
        (1, 1, 1, 0, 0, 0, 0),
        1e-2,
        120,
    ),
    slider_crank.model: (
        dict.fromkeys(("l_1", "l_2", "a", "b", "d"), LENGTH)
        | dict.fromkeys(("m_1", "m_2", "m_3"), MASS)
        | dict.fromkeys(("J_1", "J_2", "J_3"), INERTIA)
        | {"grav": ACCELERATION},
        (1, 1, 0) * 3,
        1e-4,
        600,
    ),
    bouncing_ball.model: ({"mass": MASS, "R": LENGTH, "grav": ACCELERATION}, (1, 1, 0), 1e-2, 200),
}


@pytest.mark.parametrize("powers", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (5, -9, 3)], ids=str)
@pytest.mark.parametrize("model", UNITS, ids=lambda m: m.__module__.split(".")[-1])
def test_units_by_powers_of_two_change_no_bit(
    model: Callable[[], sg.Model], powers: tuple[int, int, int], stepper: Build
) -> None:
    dimensions, lengths, dt, n = UNITS[model]
    compiled = stepper(model, 3)
    length, _, time = (2.0**k for k in powers)
    scaled = {
        name: compiled.parameters[name]
        * float(np.prod([2.0 ** (k * d) for k, d in zip(powers, dims, strict=True)]))
        for name, dims in dimensions.items()
    }
    factor = length ** np.array(lengths)
    _, q, v = compiled.initial_state()
    plain = compiled.simulate(t_end=n * dt, dt=dt)
    other = compiled.simulate(
        t_end=n * dt * time, dt=dt * time, q0=q * factor, v0=v * factor / time, parameters=scaled
    )
    assert np.array_equal(plain.q * factor, other.q)
    assert np.array_equal(plain.v * factor / time, other.v)
    assert np.array_equal(plain.iterations, other.iterations)


@pytest.mark.parametrize("powers", [(4, 0, 0), (0, 4, 0), (0, 0, 4)], ids=str)
def test_units_change_no_bit_of_a_rescue(powers: tuple[int, int, int]) -> None:
    """Bodies wedged in a groove: steps that need paths, held contacts, substeps."""
    compiled = stepper_of("groove", 3)
    length, mass, time = (2.0**k for k in powers)
    units = np.array([length, length, 1.0])
    rescued = 0
    for number in range(12):
        case = case_of("groove", SEED, number)
        q, v = compiled.project(case.q, case.v, case.t, case.parameters)
        par = compiled.check_parameters(case.parameters)
        scaled = par | {
            "mass": par["mass"] * mass, "R": par["R"] * length, "A": par["A"] * length,
            "grav": par["grav"] * length / time**2, "omega": par["omega"] / time,
        }  # fmt: skip
        runs = []
        for factor, dt, values in ((1.0, case.dt, par), (units, case.dt * time, scaled)):
            pace = factor / (dt / case.dt)
            try:
                runs.append(
                    compiled.simulate(
                        t_end=120 * dt, dt=dt, q0=q * factor, v0=v * pace, parameters=values
                    )
                )
            except sg.StepError as error:
                runs.append(error.trajectory)
        plain, other = runs
        assert np.array_equal(plain.q * units, other.q)
        assert np.array_equal(plain.iterations, other.iterations)
        rescued += int(np.count_nonzero(plain.rescues))
    assert rescued >= 5


@pytest.mark.parametrize("mass", [1e-6, 1e-3, 1e3, 1e6])
def test_any_mass_without_tuning(mass: float, stepper: Build) -> None:
    """The motion of the box does not depend on its mass."""
    compiled = stepper(box.model, 2)
    plain = compiled.simulate(t_end=0.5, dt=1e-2)
    other = compiled.simulate(t_end=0.5, dt=1e-2, parameters={"mass": mass})
    np.testing.assert_allclose(other.q, plain.q, atol=1e-8)


def test_a_wall_sets_a_resting_mass_in_motion() -> None:
    """Scales from the start of the step alone would be zero here."""
    m = sg.Model("pushed")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2
    m.contact("wall", g_N=x - m.time**2)
    m.initial_state(q=[0])
    traj = sg.build(m, stages=3).simulate(t_end=1, dt=0.1)
    np.testing.assert_allclose(traj["x"], traj.t**2, atol=1e-12)
    np.testing.assert_allclose(traj.P_N[1:, 0], 0.2, rtol=1e-9)


def test_same_run_same_bits(stepper: Build) -> None:
    compiled = stepper(box.model, 3)
    first, second = (compiled.simulate(t_end=1, dt=1e-2) for _ in range(2))
    assert first.q.tobytes() == second.q.tobytes()
    assert first.P_F.tobytes() == second.P_F.tobytes()
