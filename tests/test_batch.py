"""Many runs at once: each is bit for bit the run alone, failures stay alone, errors have names."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from signorini.models import bouncing_ball, box, v_groove, vibrating_table
from trap_models import rheonomic

Build = Callable[..., sg.Stepper]


def differences(batch: sg.Batch, k: int, alone: sg.Trajectory) -> list[str]:
    """What run k of a batch and the same run alone do not have in common, bit for bit."""
    one = batch.trajectory(k)
    names = ("t", "q", "v", "P_N", "P_F", "residual", "smallest_gap", "iterations", "u")
    found = [n for n in names if not np.array_equal(getattr(one, n), getattr(alone, n))]
    return found if one.parameters == alone.parameters else [*found, "parameters"]


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_runs_are_those_alone(threads: int, stepper: Build) -> None:
    compiled = stepper(box.model, 3)
    rng = np.random.default_rng(1)
    n = 23
    e_N, phi = rng.uniform(size=n), rng.uniform(0.2, 1.2, n)
    q0, v0 = {"phi": phi, "y": 0.5}, rng.normal(size=(n, 3))
    batch = compiled.simulate_batch(
        t_end=0.6, dt=1e-2, q0=q0, v0=v0, parameters={"e_N": e_N, "mu": 0.3}, threads=threads
    )
    assert len(batch) == n
    assert batch.ok.all()
    assert batch.q.shape == (n, 61, 3)
    for k in range(n):
        about = {"e_N": float(e_N[k]), "mu": 0.3}
        start = {"q0": {"phi": phi[k], "y": 0.5}, "v0": v0[k]}
        assert not differences(
            batch, k, compiled.simulate(t_end=0.6, dt=1e-2, parameters=about, **start)
        )


def test_rows_and_times(stepper: Build) -> None:
    table = stepper(vibrating_table.model, 2)
    t0 = np.array([0.0, 0.1, 0.25])
    batch = table.simulate_batch(t_end=0.5, dt=1e-3, t0=t0, every=10)
    for k, t in enumerate(t0):
        assert not differences(batch, k, table.simulate(t_end=t + 0.5, dt=1e-3, t0=t, every=10))


def test_inputs_of_each_run(stepper: Build) -> None:
    compiled = stepper(rheonomic, 2)
    rng = np.random.default_rng(3)
    u = rng.normal(size=(4, 20, compiled.sizes["n_u"]))
    for shared in (True, False):
        batch = compiled.simulate_batch(t_end=0.2, dt=1e-2, inputs=u[0] if shared else u)
        for k in range(len(batch)):
            assert not differences(
                batch, k, compiled.simulate(t_end=0.2, dt=1e-2, inputs=u[0 if shared else k])
            )


def test_a_failed_run_ends_alone(stepper: Build) -> None:
    compiled = stepper(v_groove.model, 2)
    start, par = compiled.initial_state(), compiled.parameters
    q0 = np.tile(start[1], (6, 1))
    q0[2, 1] = -5.0  # far inside the groove
    rng = np.random.default_rng(4)
    v0 = np.tile(start[2], (6, 1)) + rng.normal(size=(6, start[2].size))
    mu = np.array([0.1, 0.1, 0.1, 1.5, 1.5, 0.2])
    assert "mu" in par
    batch = compiled.simulate_batch(
        t_end=1.0, dt=1e-2, q0=q0, v0=v0, parameters={"mu": mu}, max_halvings=0
    )
    assert batch.status[2] == "INCONSISTENT_START"
    assert batch.steps[2] == 0
    assert np.isnan(batch.q[2, 1:]).all()
    np.testing.assert_array_equal(batch.q[2, 0], q0[2])
    assert batch.ok.sum() >= 3
    for k in (0, 1, 3, 4, 5):
        about = {"parameters": {"mu": mu[k]}, "q0": q0[k], "v0": v0[k], "max_halvings": 0}
        try:
            alone = compiled.simulate(t_end=1.0, dt=1e-2, **about)
        except sg.StepError as error:
            assert batch.status[k] == error.status
            alone = error.trajectory
        assert not differences(batch, k, alone)


def test_progress_and_memory(stepper: Build) -> None:
    compiled = stepper(bouncing_ball.model, 3)
    seen: list[tuple[int, int]] = []
    batch = compiled.simulate_batch(
        t_end=0.1,
        dt=1e-2,
        parameters={"e_N": np.linspace(0, 1, 150)},
        threads=1,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen == [(64, 150), (128, 150), (150, 150)]
    assert batch.bytes_per_run == 11 * (8 * (1 + 3 + 3 + 2 + 2 + 2) + (10 + 1) * 4)
    assert batch.bytes_per_thread > 1000


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"q0": np.zeros((3, 2))}, "q0 has shape"),
        ({"q0": np.full((3, 3), np.nan)}, "q0 is not finite"),
        ({"q0": {"z": 0.0}}, "there is no coordinate 'z'"),
        ({"parameters": {"e_N": [0.1, 0.2], "mu": [1, 2, 3]}}, "for 3 runs but"),
        ({"parameters": {"e_N": np.zeros((2, 2))}}, "shape"),
        ({"parameters": {"e_N": [0.5, 2.0]}}, "e_N"),
        ({"parameters": {"nothing": 1.0}}, "nothing"),
        ({"parameters": {"e_N": []}}, "no run at all"),
        ({"threads": 0}, "threads = 0"),
        ({"every": 0}, "every = 0"),
        ({"inputs": lambda t, q, v: []}, "function"),
        ({"inputs": np.zeros((2, 10, 1))}, "inputs have shape"),
        ({"t0": [0.0, np.inf]}, "t0 is not finite"),
        ({"tol": -1.0}, "tol"),
        ({"nonsense": 1}, "there is no option 'nonsense'"),
    ],
)
def test_arguments(change: dict[str, object], words: str, stepper: Build) -> None:
    compiled = stepper(bouncing_ball.model, 2)
    arguments = {"t_end": 0.1, "dt": 1e-2, **change}
    with pytest.raises(sg.RunError, match=words):
        compiled.simulate_batch(**arguments)  # type: ignore[arg-type]


def test_a_changed_default_compiles_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SIGNORINI_CACHE", str(tmp_path))

    def falling(mass: float) -> sg.Model:
        m = sg.Model("falling")
        (y,) = m.coordinates("y")
        (v,) = m.velocities
        weight, grav = m.parameters(weight=mass, grav=9.81)
        m.lagrangian = weight / 2 * v**2 - weight * grav * y
        m.initial_state(q=[0], v=[1])
        return m

    for mass in (1.0, 3.0):
        compiled = sg.build(falling(mass))
        assert compiled.parameters["weight"] == mass
        assert compiled.evaluate("p", 0.0, [0.0], [2.0]) == 2 * mass
        assert compiled.simulate(t_end=0.1, dt=0.1).parameters["weight"] == mass
    assert len(list((tmp_path / "compiled").glob("*.so"))) == 1
    assert len(list((tmp_path / "generated").iterdir())) == 2
