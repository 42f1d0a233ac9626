"""Gymnasium environments: their contract, and that they are the very runs of the stepper."""

from collections.abc import Callable

import numpy as np
import pytest
import signorini as sg
from signorini.models import hopper
from signorini.runtime.errors import RunError

pytest.importorskip("gymnasium", reason="pip install 'signorini[learning]'")

from gymnasium.utils.env_checker import check_env
from signorini.learning import Environment, Environments, Task

Build = Callable[..., sg.Stepper]


def height(sim: sg.Simulator, action: np.ndarray) -> float:
    return float(sim.q[1]) - 1e-3 * float(action @ action)


def somewhere(rng: np.random.Generator) -> dict:
    return {"q0": {"y": rng.uniform(0.7, 0.9)}}


@pytest.fixture(scope="module")
def task(stepper: Build) -> Task:
    return Task(
        stepper(hopper.model),
        dt=1e-3,
        low=[-30, -20],
        high=[30, 20],
        reward=height,
        steps=10,
        horizon=60,
        start=somewhere,
        ends=lambda sim: abs(sim.q[2]) > 1,
    )


def test_the_contract(task: Task) -> None:
    check_env(Environment(task), skip_render_check=True)


def test_an_episode_is_a_run(task: Task) -> None:
    """Held actions, one step after another, are the run of the stepper with these inputs."""
    env = Environment(task)
    rng = np.random.default_rng(5)
    actions = rng.uniform(env.action_space.low, env.action_space.high, (40, 2))
    first, _ = env.reset(options={"q0": {"y": 0.75}})
    seen = [env.step(a) for a in actions]
    u = np.repeat(actions, 10, axis=0)
    traj = task.stepper.simulate(t_end=0.4, dt=1e-3, q0={"y": 0.75}, inputs=u)
    rows = np.hstack([traj.q, traj.v])[::10]
    np.testing.assert_array_equal(first, rows[0])
    np.testing.assert_allclose([s[0] for s in seen], rows[1:], atol=1e-9)
    rewards = traj.q[10::10, 1] - 1e-3 * (actions**2).sum(axis=1)
    assert [s[1] for s in seen] == pytest.approx(rewards.tolist(), abs=1e-9)


def test_seeds_and_ends(task: Task) -> None:
    env = Environment(task)
    starts = [env.reset(seed=s)[0][1] for s in (1, 1, 2)]
    assert starts[0] == starts[1] != starts[2]
    assert all(0.7 < y < 0.9 for y in starts)
    env.reset(options={"v0": {"phi": 9.0}})
    flags = [env.step(np.zeros(2))[2:4] for _ in range(12)]
    assert flags[-1][0]  # turned by more than one radian
    env.reset(seed=1)
    flags = [env.step(np.zeros(2))[2:4] for _ in range(60)]
    assert flags[-1] == (False, True)
    assert not any(cut for _, cut in flags[:-1])


def test_several_are_as_many_single_ones(task: Task) -> None:
    """Until an episode is over; then the next action starts it again."""
    several = Environments(task, 3)
    several.reset(options={"q0": {"y": 0.8}})
    single = Environment(task)
    single.reset(options={"q0": {"y": 0.8}})
    rng = np.random.default_rng(7)
    for _ in range(60):
        action = rng.uniform(-10, 10, 2)
        seen, rewards, over, cut, _ = several.step(np.tile(action, (3, 1)))
        alone = single.step(action)
        assert seen.shape == (3, 10)
        np.testing.assert_array_equal(seen, np.tile(alone[0], (3, 1)))
        assert rewards.tolist() == [alone[1]] * 3
    assert cut.all()
    assert not over.any()
    seen, rewards, over, cut, _ = several.step(np.zeros((3, 2)))
    assert len(set(seen[:, 1])) == 3  # drawn anew
    assert not cut.any()
    assert rewards.tolist() == [0, 0, 0]


def test_actions_are_clipped(task: Task) -> None:
    one, other = Environment(task), Environment(task)
    for env, action in ((one, [1e9, -1e9]), (other, [30, -20])):
        env.reset(options={})
        env.simulator.reset()
        env.step(np.array(action, dtype=float))
    np.testing.assert_array_equal(one.simulator.v, other.simulator.v)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"low": [0]}, "low has 1 entries: give 2, for thrust, hip"),
        ({"low": [30, 0]}, "low must be below high"),
        ({"steps": 0}, "at least one"),
    ],
)
def test_what_does_not_fit_is_refused(task: Task, change: dict, words: str) -> None:
    given = {"dt": 1e-3, "low": [-1, -1], "high": [1, 1], "reward": height} | change
    with pytest.raises(RunError, match=words):
        Task(task.stepper, **given)
