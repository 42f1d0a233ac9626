"""Random states of a model in which its contacts do everything that contacts can do."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from signorini.runtime.errors import RunError
from signorini.runtime.stepper import Stepper
from signorini.runtime.trajectory import Trajectory
from signorini.verify import laws

_CLOSED = 1e-9


@dataclass(frozen=True)
class State:
    """A consistent state with inputs, parameters and a step size."""

    t: float
    q: np.ndarray
    v: np.ndarray
    u: np.ndarray
    parameters: dict[str, float]
    dt: float


class Drawer:
    """Draws consistent states; some contacts are closed, with velocities of every kind.

    Parameters
    ----------
    stepper : Stepper
        The compiled model.
    seed : int
        Seed of the random numbers.
    """

    def __init__(self, stepper: Stepper, seed: int) -> None:
        self.stepper = stepper
        self.rng = np.random.default_rng(seed)
        self.contacts = stepper.manifest["contacts"]
        start = stepper.initial_state()
        reach = max(1.0, float(np.max(np.abs(start[2]), initial=0)))
        self.speed = reach

    def draw(self) -> State | None:
        """One state, or None if this try found no consistent one."""
        rng, stepper = self.rng, self.stepper
        parameters = self.parameters()
        t0, q0, v0 = stepper.initial_state(parameters)
        t = t0 + rng.choice([0.0, rng.uniform(0, 2)])
        spread = rng.choice([0.02, 0.3, 1.0])
        q = q0 + spread * rng.normal(size=q0.size)
        v = v0 * rng.choice([0.0, 1.0]) + rng.choice([0.1, 1.0]) * self.speed * rng.normal(
            size=v0.size
        )
        u = rng.normal(size=stepper.sizes["n_u"])
        dt = float(10 ** rng.uniform(-3, -1.7)) / max(1.0, self.speed / 10)
        places = [c for c in self.contacts if c["normal"] >= 0 and not c["one_way"]]
        closed = [c for c in places if rng.uniform() < 0.5]
        try:
            q = self._close(t, q, v, parameters, closed)
            q, v = stepper.project(q, v, t, parameters)
            v = self._steer(t, q, v, parameters)
            q, v = stepper.project(q, v, t, parameters)
        except (RunError, np.linalg.LinAlgError):
            return None
        if not np.all(np.isfinite(q)) or np.max(np.abs(v), initial=0) > 50 * self.speed:
            return None
        return State(t, q, v, u, parameters, dt)

    def parameters(self) -> dict[str, float]:
        values = {}
        for p in self.stepper.manifest["parameters"]:
            value = p["default"] * self.rng.uniform(0.9, 1.1)
            low = -np.inf if p["min"] is None else p["min"]
            top = np.inf if p["max"] is None else p["max"]
            values[p["name"]] = float(np.clip(value, low, top))
        return values

    def _close(
        self, t: float, q: np.ndarray, v: np.ndarray, par: Any, closed: list[dict[str, Any]]
    ) -> np.ndarray:
        """Move to the surface of the chosen contacts, keeping g = 0."""
        rows = [c["normal"] for c in closed]
        at = self.stepper.evaluate
        n_g = self.stepper.sizes["n_g"]
        for _ in range(20):
            value, W = [], []
            if n_g:
                value.append(at("g", t, q, parameters=par))
                W.append(at("W_g", t, q, parameters=par))
            if rows:
                value.append(at("g_N", t, q, parameters=par)[rows])
                W.append(at("W_N", t, q, parameters=par)[:, rows])
            if not value:
                break
            residual = np.concatenate(value)
            q = q - np.linalg.lstsq(np.hstack(W).T, residual, rcond=1e-10)[0]
            if np.max(np.abs(residual)) < 1e-13:
                break
        return q

    def _steer(self, t: float, q: np.ndarray, v: np.ndarray, par: Any) -> np.ndarray:
        """Give closed contacts a normal velocity of chosen sign, and slip or none."""
        rng, at, n = self.rng, self.stepper.evaluate, self.stepper.sizes
        W: list[np.ndarray] = []
        goal: list[Any] = []
        now: list[np.ndarray] = []
        gaps = at("g_N", t, q, parameters=par)
        for c in self.contacts:
            is_closed = c["normal"] < 0 or c["one_way"] or abs(gaps[c["normal"]]) < _CLOSED
            if not is_closed or rng.uniform() < 0.3:
                continue
            if c["normal"] >= 0:
                W.append(at("W_N", t, q, parameters=par)[:, [c["normal"]]])
                now.append(at("g_N_dot", t, q, v, parameters=par)[[c["normal"]]])
                goal.append([rng.choice([0.0, 0.0, -1.0, 1.0]) * self.speed * rng.uniform()])
            if c["components"] and rng.uniform() < 0.6:
                rows = list(range(c["friction"], c["friction"] + c["components"]))
                W.append(at("W_F", t, q, parameters=par)[:, rows])
                now.append(at("gamma_F", t, q, v, parameters=par)[rows])
                slip = rng.normal(size=len(rows)) * self.speed
                goal.append(slip * rng.choice([0.0, 1.0]))
        if not W:
            return v
        if n["n_g"]:
            W.append(at("W_g", t, q, parameters=par))
            now.append(at("g_dot", t, q, v, parameters=par))
            goal.append(np.zeros(n["n_g"]))
        if n["n_gamma"]:
            W.append(at("W_gamma", t, q, parameters=par))
            now.append(at("gamma", t, q, v, parameters=par))
            goal.append(np.zeros(n["n_gamma"]))
        change = np.concatenate([np.asarray(x, float) for x in goal]) - np.concatenate(now)
        return v + np.linalg.lstsq(np.hstack(W).T, change, rcond=1e-10)[0]


def wanted(stepper: Stepper, parameters: dict[str, float]) -> dict[str, list[str]]:
    """What each contact must be seen doing: contact name -> kinds of motion."""
    mu = []
    if stepper.manifest["contacts"]:
        t, q, v = stepper.initial_state(parameters)
        mu = list(stepper.evaluate("mu", t, q, v, parameters=parameters))
    kinds = {}
    for k, c in enumerate(stepper.manifest["contacts"]):
        list_of = []
        if c["normal"] >= 0:
            list_of = (
                ["open", "persisting"]
                if c["one_way"]
                else [
                    *("open", "impacting", "separating"),
                ]
            )
        if c["bound"] >= 0 or mu[k] > 0:
            if c["components"] == 1:
                list_of += ["sticking", "slipping +", "slipping -"]
            elif c["components"] == 2:
                list_of += ["sticking", *(f"slipping {x}" for x in ("++", "+-", "-+", "--"))]
            elif c["components"] == 3:
                list_of += ["sticking", "slipping"]
        elif c["normal"] >= 0 and not c["one_way"]:
            list_of += ["persisting"]
        if c["has_guard"]:
            list_of += ["guard on", "guard off"]
        kinds[c["name"]] = list_of
    return kinds


def seen(stepper: Stepper, traj: Trajectory, state: State) -> list[tuple[str, str]]:
    """What the contacts did in one step, as (contact, kind of motion)."""
    found: list[tuple[str, str]] = []
    par = state.parameters
    if not stepper.manifest["contacts"]:
        return found
    guard = None
    if any(c["has_guard"] for c in stepper.manifest["contacts"]):
        guard = stepper.evaluate("guard", state.t, state.q, parameters=par)
    mu = stepper.evaluate("mu", state.t, state.q, state.v, state.u, par)
    mu_F = np.ones(stepper.sizes["n_F"])
    if stepper.sizes["n_axes"]:
        mu_F = stepper.evaluate("mu_F", state.t, state.q, state.v, state.u, par)
    bounds = np.zeros(0)
    if any(c["bound"] >= 0 for c in stepper.manifest["contacts"]):
        bounds = stepper.evaluate("bound", state.t, state.q, u=state.u, parameters=par)
    for k, c in enumerate(stepper.manifest["contacts"]):
        name = c["name"]
        if c["has_guard"] and guard is not None:
            found.append((name, "guard on" if guard[k] >= 0 else "guard off"))
            if guard[k] < 0:
                continue
        P_F = traj.P_F[1, c["friction"] : c["friction"] + c["components"]]
        slip = traj.gamma_F[1, c["friction"] : c["friction"] + c["components"]]
        if c["normal"] >= 0:
            P_N = traj.P_N[1, c["normal"]]
            before, after = traj.g_N[:, c["normal"]]
            rate = traj.g_N_dot[0, c["normal"]]
            if P_N == 0:
                found.append((name, "open"))
                if before < _CLOSED < after and not c["one_way"]:
                    found.append((name, "separating"))
                continue
            if c["one_way"]:
                found.append((name, "persisting"))
            elif rate < -1e-6 and (before > _CLOSED or abs(rate) > 1e-3):
                found.append((name, "impacting"))
            elif before < _CLOSED:
                found.append((name, "persisting"))
        if c["bound"] >= 0:
            radius = state.dt * max(bounds[c["bound"]], 0.0)
        elif c["loads"]:
            P = np.concatenate([traj.P_g[1], traj.P_gamma[1]])
            radius = mu[k] * np.linalg.norm(P[c["load"] : c["load"] + c["loads"]])
        else:
            radius = mu[k] * traj.P_N[1, c["pressing"]]
        own = mu_F[c["friction"] : c["friction"] + c["components"]]
        size = float(laws.find(c["law"]).size(P_F, own))
        if c["components"] and radius > 0:
            if size < radius * (1 - 1e-6):
                found.append((name, "sticking"))
            else:
                signs = "".join("+" if x > 0 else "-" for x in slip)
                found.append((name, f"slipping {signs}" if len(slip) < 3 else "slipping"))
    return found
