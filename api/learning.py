"""Environments for reinforcement learning: a stepper behind Gymnasium's interface.

Needs the extra ``signorini[learning]``.
"""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from signorini.runtime.errors import RunError, StepError
from signorini.runtime.simulator import Simulator
from signorini.runtime.stepper import Stepper

Observe = Callable[[Simulator], Any]
Reward = Callable[[Simulator, np.ndarray], float]
Ends = Callable[[Simulator], bool]
Start = Callable[[np.random.Generator], Mapping[str, Any]]


def _state(sim: Simulator) -> np.ndarray:
    return np.concatenate([sim.q, sim.v])


class Task:
    """What is to be learned with a stepper.

    Parameters
    ----------
    stepper : Stepper
        A model with inputs: they are the actions.
    dt : float
        Step size [s].
    low, high : sequence of n_u numbers
        Bounds of the inputs.
    reward : callable (simulator, action) -> float
        After each action.
    steps : int
        Steps of size `dt` that an action is held.
    horizon : int
        Actions after which an episode is cut off.
    start : callable (generator) -> dict, optional
        Keywords of ``Simulator.reset`` drawn for an episode: q0, v0, t0, parameters. By default
        every episode starts from the model's initial state.
    observe : callable (simulator) -> array, optional
        By default q and v.
    ends : callable (simulator) -> bool, optional
        Whether an episode is over: fallen, arrived.
    failed : float
        Reward of a step that has no solution; the episode ends with it, and ``info["error"]`` says
        why.
    **options
        Of ``Stepper.start``.

    Raises
    ------
    RunError
        If the model has no inputs, or bounds do not fit them.
    """

    def __init__(
        self,
        stepper: Stepper,
        *,
        dt: float,
        low: Any,
        high: Any,
        reward: Reward,
        steps: int = 1,
        horizon: int = 1000,
        start: Start | None = None,
        observe: Observe = _state,
        ends: Ends | None = None,
        failed: float = 0.0,
        **options: Any,
    ) -> None:
        names = stepper.manifest["inputs"]
        if not names:
            raise RunError(f"model '{stepper.name}' has no inputs: declare them with m.inputs(...)")
        bounds = [np.asarray(x, dtype=np.float64).reshape(-1) for x in (low, high)]
        for what, bound in zip(("low", "high"), bounds, strict=True):
            if bound.shape != (len(names),):
                raise RunError(
                    f"{what} has {bound.size} entries: give {len(names)}, for {', '.join(names)}"
                )
        if not np.all(bounds[0] < bounds[1]):
            raise RunError("low must be below high for every input")
        if steps < 1 or horizon < 1:
            raise RunError(f"steps = {steps}, horizon = {horizon}: give at least one of each")
        self.stepper = stepper
        self.dt = dt
        self.action_space = spaces.Box(*bounds, dtype=np.float64)
        self.reward = reward
        self.steps = steps
        self.horizon = horizon
        self.draw = start
        self.look = observe
        self.ends = ends
        self.failed = failed
        self.options = options
        sample = np.asarray(observe(self.simulator()), dtype=np.float64)
        self.observation_space = spaces.Box(-np.inf, np.inf, sample.shape, np.float64)

    def simulator(self) -> Simulator:
        """A simulator at the model's initial state."""
        return self.stepper.start(dt=self.dt, **self.options)

    def observe(self, sim: Simulator) -> np.ndarray:
        """What is seen of a state."""
        return np.array(self.look(sim), dtype=np.float64)

    def restart(self, sim: Simulator, rng: np.random.Generator) -> None:
        """Begin an episode."""
        sim.reset(**(dict(self.draw(rng)) if self.draw is not None else {}))

    def act(self, sim: Simulator, action: Any) -> tuple[float, bool, dict[str, Any]]:
        """Hold an action; reward, whether the episode is over, and what went wrong."""
        space = self.action_space
        u = np.clip(np.asarray(action, dtype=np.float64), space.low, space.high)
        try:
            sim.step(u, self.steps)
        except StepError as error:
            return self.failed, True, {"error": str(error)}
        over = bool(self.ends(sim)) if self.ends is not None else False
        return float(self.reward(sim, u)), over, {}


class Environment(gymnasium.Env[np.ndarray, np.ndarray]):
    """One simulator as a `gymnasium.Env`.

    Parameters
    ----------
    task : Task

    Notes
    -----
    An action outside the bounds is clipped. A step that has no solution ends the episode as
    *terminated*; after ``task.horizon`` actions it is *truncated*.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}

    def __init__(self, task: Task) -> None:
        self.task = task
        self.simulator = task.simulator()
        self.action_space = task.action_space
        self.observation_space = task.observation_space
        self._actions = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; `options` may hold q0, v0, t0 and parameters of its start."""
        super().reset(seed=seed)
        if options:
            self.simulator.reset(**options)
        else:
            self.task.restart(self.simulator, self.np_random)
        self._actions = 0
        return self.task.observe(self.simulator), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold an action for the task's steps."""
        reward, over, info = self.task.act(self.simulator, action)
        self._actions += 1
        cut = not over and self._actions >= self.task.horizon
        return self.task.observe(self.simulator), reward, over, cut, info


class Environments(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """Several simulators as a `gymnasium.vector.VectorEnv`; an episode that is over starts again
    with the next action.

    Parameters
    ----------
    task : Task
    count : int
        How many.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "render_modes": [],
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(self, task: Task, count: int) -> None:
        if count < 1:
            raise RunError(f"count = {count}: give at least one")
        self.task = task
        self.num_envs = count
        self.simulators = [task.simulator() for _ in range(count)]
        self.single_action_space = task.action_space
        self.single_observation_space = task.observation_space
        self.action_space = batch_space(task.action_space, count)
        self.observation_space = batch_space(task.observation_space, count)
        self._actions = np.zeros(count, dtype=int)
        self._over = np.zeros(count, dtype=bool)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in each."""
        super().reset(seed=seed)
        for sim in self.simulators:
            if options:
                sim.reset(**options)
            else:
                self.task.restart(sim, self.np_random)
        self._actions[:] = 0
        self._over[:] = False
        return self._observations(), {}

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold an action in each; those whose episode was over start again instead."""
        rewards = np.zeros(self.num_envs)
        over = np.zeros(self.num_envs, dtype=bool)
        errors: dict[int, str] = {}
        for k, sim in enumerate(self.simulators):
            if self._over[k]:
                self.task.restart(sim, self.np_random)
                self._actions[k] = 0
                continue
            rewards[k], over[k], info = self.task.act(sim, actions[k])
            self._actions[k] += 1
            errors |= {k: info["error"]} if info else {}
        cut = ~over & (self._actions >= self.task.horizon)
        self._over = over | cut
        return self._observations(), rewards, over, cut, {"errors": errors} if errors else {}

    def _observations(self) -> np.ndarray:
        return np.stack([self.task.observe(sim) for sim in self.simulators])
