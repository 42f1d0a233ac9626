"""Derivatives of a run: its steps once more, with directions that they carry along."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from signorini.runtime.compiled import SUCCESS, Compiled
from signorini.runtime.errors import RunError
from signorini.runtime.options import RunOptions

_OF = ("q0", "v0", "parameters", "inputs", "t0", "dt")
# In the order of the numbers that C gives.
_REASONS = (
    "",
    "the step, or its rest, was captured",
    "the contact closes too slowly: its time is too sensitive",
    "two events at one time: which comes first decides",
    "the contact was brought to rest after an accumulation of impacts",
    "a percussion or a direction of slip is where its law has a corner",
    "a linear system is singular",
)


@dataclass(frozen=True)
class NotDifferentiable:
    """An event that has no derivative.

    Attributes
    ----------
    t : float
        Its time, or the start of its segment [s].
    contact : str
        The contact, "" if it is none's.
    why : str
        The reason.
    """

    t: float
    contact: str
    why: str


def check_derivatives(
    stepper: Compiled, kind: str | None, of: Sequence[str], options: RunOptions, asked: bool
) -> tuple[str, ...]:
    """With respect to what a run is to be differentiated; nothing if it is not.

    Raises
    ------
    RunError
        If that is not possible.
    """
    if kind is None:
        return ()
    if kind not in ("forward", "adjoint"):
        raise RunError(f'derivatives = {kind!r}: choose "forward" or "adjoint"')
    chosen = (of,) if isinstance(of, str) else tuple(of)
    for name in chosen:
        if name not in _OF:
            raise RunError(f"of = {name!r}: choose among {', '.join(_OF)}")
    if not chosen:
        raise RunError(f"of is empty: choose among {', '.join(_OF)}")
    if options.events != "located":
        raise RunError(
            'derivatives need events="located": the map of captured steps is a staircase wherever '
            "there is an impact, and its derivative not that of the motion"
        )
    if asked:
        raise RunError(
            "derivatives need inputs that are given as an array: a function of the state has a "
            "derivative of its own"
        )
    return chosen


def adjoin(
    traj: Any,
    start: tuple[float, np.ndarray, np.ndarray],
    u: np.ndarray,
    h: float,
    every: int,
    options: RunOptions,
) -> None:
    """Give a trajectory its ``gradient`` and ``differentiable``."""
    if every != 1:
        raise RunError("an adjoint run records every step: leave `every` out")
    traj.gradient = Gradient(traj, start, u, h, options)
    traj.differentiable = traj.gradient.found or True


def differentiate(
    traj: Any,
    start: tuple[float, np.ndarray, np.ndarray],
    u: np.ndarray,
    h: float,
    every: int,
    options: RunOptions,
    of: tuple[str, ...],
) -> None:
    """Give a trajectory its derivatives ``dq``, ``dv`` and ``differentiable``."""
    walk = Directions(traj.stepper, traj.parameters, options, start, of)
    rows = len(traj.t)
    changes = {name: np.full((2, rows, *shape), np.nan) for name, shape in walk.shapes.items()}
    for k in range(traj.steps + 1):
        if k:
            walk.step(u[k - 1] if u.size else u, h)
        if k % every == 0 or k == traj.steps:
            for which, found in enumerate(walk.changes()):
                for name, change in found.items():
                    changes[name][which, -(-k // every)] = change
    traj.dq = {name: change[0] for name, change in changes.items()}
    traj.dv = {name: change[1] for name, change in changes.items()}
    traj.differentiable = walk.found or True


class Gradient:
    """Gradients of functions of the recorded states, from the derivatives of every step.

    Call it with cotangents, see `Stepper.simulate`.
    """

    def __init__(
        self,
        traj: Any,
        start: tuple[float, np.ndarray, np.ndarray],
        u: np.ndarray,
        h: float,
        options: RunOptions,
    ) -> None:
        of = ("q0", "v0", "late", "parameters", "inputs")
        walk = Directions(traj.stepper, traj.parameters, options, start, of)
        self.edges = np.cumsum([columns for _, columns in walk.shapes.values()])
        self.n_q = traj.stepper.sizes["n_q"]
        self.slopes = np.empty((traj.steps, 2 * self.n_q + 1, int(self.edges[-1])))
        self.leaves = np.zeros(int(self.edges[-1]), dtype=bool)
        for k in range(traj.steps):
            walk.seed()
            walk.step(u[k] if u.size else u, h)
            self.slopes[k] = np.nan if walk.lost else walk.slopes()
            walk.lost = False
            if k == 0:
                self.leaves = walk.leaves()
        self.found = walk.found

    def __call__(self, q_bar: Any, v_bar: Any = None) -> dict[str, np.ndarray]:
        """Gradients of the sum of q_bar * q + v_bar * v.

        Parameters
        ----------
        q_bar, v_bar : array, shape (n_q,) or (n+1, n_q)
            Cotangents of the end, or of every row; zero by default.

        Returns
        -------
        dict
            "q0", "v0" of shape (n_q,), "parameters" (number of them,), "inputs" (n, n_u).

        Raises
        ------
        RunError
            If a cotangent has another shape.
        """
        n, n_q = len(self.slopes), self.n_q
        bars = np.zeros((n + 1, 2 * n_q + 1))
        for first, name, given in ((0, "q_bar", q_bar), (n_q, "v_bar", v_bar)):
            if given is None:
                continue
            bar = np.asarray(given, dtype=float)
            if bar.shape not in ((n_q,), (n + 1, n_q)):
                raise RunError(
                    f"{name} has the shape {bar.shape}: give ({n_q},) for the end or "
                    f"({n + 1}, {n_q}) for all rows"
                )
            bars[(-1 if bar.ndim == 1 else slice(None)), first : first + n_q] = bar
        parameters = np.zeros(int(self.edges[3] - self.edges[2]))
        inputs = np.zeros((n, int(self.edges[4] - self.edges[3])))
        now = bars[n]
        for k in range(n - 1, -1, -1):
            back = now @ self.slopes[k]
            parameters += back[self.edges[2] : self.edges[3]]
            inputs[k] = back[self.edges[3] :]
            now = back[: self.edges[2]] + bars[k]
        now = np.where(self.leaves[: self.edges[2]], np.nan, now)
        return {
            "q0": now[:n_q], "v0": now[n_q : 2 * n_q], "parameters": parameters, "inputs": inputs,
        }  # fmt: skip


class Directions:
    """A state and its changes, step by step.

    `fresh`: directions are compared with what holds at the start.
    """

    def __init__(
        self,
        stepper: Compiled,
        par: dict[str, float],
        options: RunOptions,
        start: tuple[float, np.ndarray, np.ndarray],
        of: tuple[str, ...],
        fresh: bool = True,
    ) -> None:
        lib = stepper.library
        self.stepper, self.lib = stepper, lib
        n, n_q = stepper.sizes, stepper.sizes["n_q"]
        self.work, self.info = (lib.structs[x]() for x in ("work", "info"))
        self.params, self.options = stepper.c_params(par), stepper.c_options(options)
        t, q, v = start
        self.state = stepper.c_state(t, q, v)
        counts = {
            "q0": n_q, "v0": n_q, "parameters": n["n_par"], "inputs": n["n_u"], "t0": 1, "dt": 1,
            "late": 1,  # of the time of the state alone, behind an event that ends a step
        }  # fmt: skip
        self.shapes = {name: (n_q, counts[name]) for name in of}
        self.directions = d = lib.structs["directions"]()
        d.count, d.fresh = sum(counts[name] for name in of), int(fresh)
        self.found: list[NotDifferentiable] = []
        self.lost = False
        self.seed()

    def seed(self) -> None:
        """Begin with changes of one, each along its own direction."""
        d = self.directions
        fields = {
            "q0": "q", "v0": "v", "late": "t", "parameters": "par", "inputs": "u", "t0": "t",
            "dt": "h",
        }  # fmt: skip
        for name in {*fields.values(), "grid"}:
            self.lib.view(getattr(d, name))[:] = 0
        first = 0
        for name, (_, count) in self.shapes.items():
            seeds = self.lib.view(getattr(d, fields[name]))
            for k in range(count):
                seeds[(first + k) * count + k] = 1
            if name == "t0":
                self.lib.view(d.grid)[first] = 1
            first += count

    def step(self, u: np.ndarray, h: float) -> None:
        d = self.directions
        inputs = self.lib.array(u)
        status = self.lib.call["step_forward"](
            self.state, self.work, self.info, self.params, self.options,
            self.lib.pointer(inputs) if inputs.size else None, h, d,
        )  # fmt: skip
        if status > SUCCESS:
            raise RunError(
                f"model '{self.stepper.name}': a step that was taken cannot be differentiated, "
                f"{self.lib.status_texts[status]}"
            )
        if d.lost:
            contacts = self.stepper.manifest["contacts"]
            name = contacts[d.contact]["name"] if d.contact >= 0 else ""
            self.found.append(NotDifferentiable(float(d.at), name, _REASONS[d.lost]))
            d.lost, self.lost = 0, True

    @property
    def q(self) -> np.ndarray:
        """Coordinates, shape (n_q,)."""
        return self.lib.kept(self.state.q)

    @property
    def v(self) -> np.ndarray:
        """Velocities, shape (n_q,)."""
        return self.lib.kept(self.state.v)

    def leaves(self) -> np.ndarray:
        """Which directions leave what holds at the start."""
        return np.frombuffer(self.directions.leaves, np.intc)[: self.directions.count] != 0

    def slopes(self) -> np.ndarray:
        """Changes of q, v and of the time by which the state is late, a column a direction."""
        d, n_q = self.directions, self.stepper.sizes["n_q"]
        q, v = (self.lib.view(x).reshape(-1, n_q)[: d.count].T for x in (d.q, d.v))
        late = (self.lib.view(d.t) - self.lib.view(d.grid))[: d.count]
        return np.vstack([q, v, late])

    def changes(self) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Changes of q and of v, with respect to each that was asked for; NaN where none are."""
        d, n_q = self.directions, self.stepper.sizes["n_q"]
        moved = self.lib.view(d.grid) - self.lib.view(d.t)
        # a direction that leaves the start; an event that ends the step in which it is
        unknown = self.leaves() | (moved[: d.count] != 0) | self.lost
        found = []
        for values in (d.q, d.v):
            change = self.lib.kept(values).reshape(-1, n_q)[: d.count].T
            change[:, unknown] = np.nan
            edges = np.cumsum([columns for _, columns in self.shapes.values()])[:-1]
            found.append(dict(zip(self.shapes, np.split(change, edges, axis=1), strict=True)))
        return found[0], found[1]
