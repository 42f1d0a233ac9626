"""Derivatives of steps: what they are of, and directions that they carry along."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError
from signorini.runtime.library import SUCCESS
from signorini.runtime.options import RunOptions

OF = ("q0", "v0", "parameters", "inputs", "t0", "dt")
# In the order of the numbers that C gives; the seventh says nothing against a derivative.
_REASONS = (
    "",
    "the step, or its rest, was captured",
    "the contact closes too slowly: its time is too sensitive",
    "two events at one time: which comes first decides",
    "the contact was brought to rest after an accumulation of impacts",
    "a percussion or a direction of slip is where its law has a corner",
    "a linear system is singular",
    "steps are captured: derivatives are those of their map, not of the motion",
    "the motion spreads: rounding of its start decides what the derivative is",
)
_OF_MAP, SPREADS = 7, 8


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


def reason(stepper: Compiled, why: int, t: float, contact: int) -> NotDifferentiable:
    """What C says of an event that has no derivative, by the user's names."""
    contacts = stepper.manifest["contacts"]
    name = contacts[contact]["name"] if contact >= 0 else ""
    return NotDifferentiable(float(t), name, _REASONS[why])


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
        if name not in OF:
            raise RunError(f"of = {name!r}: choose among {', '.join(OF)}")
    if not chosen:
        raise RunError(f"of is empty: choose among {', '.join(OF)}")
    if options.events == "captured" and stepper.manifest["contacts"]:
        warnings.warn(
            f"model '{stepper.name}': derivatives of captured steps are those of their map, which "
            "is a staircase wherever there is an impact, and not those of the motion: choose "
            'events="located"',
            stacklevel=4,
        )
    if asked:
        raise RunError(
            "derivatives need inputs that are given as an array: a function of the state has a "
            "derivative of its own"
        )
    return chosen


Tangents = Mapping[str, tuple[np.ndarray, np.ndarray]]


class Seeds:
    """Directions at a start: a change of one along each number that is asked for.

    Parameters
    ----------
    of : tuple of str
        What is asked for.
    fresh : bool
        Whether directions are compared with what holds at the start.
    tangents : mapping, optional
        Changes of q and v that go with them instead; see `Tangent.directions`.

    Attributes
    ----------
    directions : struct
        As C takes it.
    shapes : dict from name to (int, int)
        Of the changes of q, and of v.
    """

    def __init__(
        self,
        stepper: Compiled,
        of: tuple[str, ...],
        fresh: bool = True,
        tangents: Tangents | None = None,
    ) -> None:
        self.lib, n, n_q = stepper.library, stepper.sizes, stepper.sizes["n_q"]
        counts = {
            "q0": n_q, "v0": n_q, "parameters": n["n_par"], "inputs": n["n_u"], "t0": 1, "dt": 1,
        }  # fmt: skip
        self.n_q, self.tangents = n_q, tangents or {}
        self.shapes = {name: (n_q, counts[name]) for name in of}
        self.edges = np.cumsum([counts[name] for name in of])[:-1]
        self.directions = d = self.lib.structs["directions"]()
        d.count = sum(counts[name] for name in of)
        self.begin(fresh)

    def begin(self, fresh: bool) -> None:
        """Changes of one, each along its own direction."""
        d = self.directions
        fields = {"q0": "q", "v0": "v", "parameters": "par", "inputs": "u", "t0": "t", "dt": "h"}
        for name in {*fields.values(), "grid"}:
            self.lib.view(getattr(d, name))[:] = 0
        d.fresh, d.lost = int(fresh), 0
        first = 0
        for name, (n_q, count) in self.shapes.items():
            seeds = self.lib.view(getattr(d, fields[name]))
            for k in range(count):
                seeds[(first + k) * count + k] = 1
            if name == "t0":
                self.lib.view(d.grid)[first] = 1
            if name in self.tangents:
                here = slice(first * n_q, (first + count) * n_q)
                for values, change in zip((d.q, d.v), self.tangents[name], strict=True):
                    self.lib.view(values)[here] = change.T.ravel()
            first += count

    def leave(self, leaving: Mapping[str, np.ndarray]) -> None:
        """Say which directions leave what holds at the start."""
        first = 0
        for name, (_, count) in self.shapes.items():
            if name in leaving:
                for k in np.flatnonzero(leaving[name]):
                    self.directions.leaves[first + int(k)] = 1
            first += count

    def by_name(self, columns: np.ndarray) -> dict[str, np.ndarray]:
        """Columns in the order of the directions, by what they are of."""
        return dict(zip(self.shapes, np.split(columns, self.edges, axis=-1), strict=True))


class Walk:
    """A state and its changes, step by step."""

    def __init__(
        self,
        stepper: Compiled,
        par: dict[str, float],
        options: RunOptions,
        start: tuple[float, np.ndarray, np.ndarray],
        seeds: Seeds,
    ) -> None:
        self.stepper, self.lib, self.seeds = stepper, stepper.library, seeds
        self.work, self.info = (self.lib.structs[x]() for x in ("work", "info"))
        self.params, self.options = stepper.c_params(par), stepper.c_options(options)
        self.state = stepper.c_state(*start)
        self.captured = options.events == "captured"
        self.found: list[NotDifferentiable] = []
        self.lost = False

    def step(self, u: np.ndarray, h: float) -> None:
        """One step of size h with inputs u.

        Raises
        ------
        RunError
            If it cannot be taken.
        """
        d, inputs = self.seeds.directions, self.lib.array(u)
        status = self.lib.call["step_forward"](
            self.state, self.work, self.info, self.params, self.options,
            self.lib.pointer(inputs) if inputs.size else None, h, d,
        )  # fmt: skip
        if status > SUCCESS:
            raise RunError(
                f"model '{self.stepper.name}': the step cannot be taken, "
                f"{self.lib.status_texts[status]}"
            )
        self.note()

    def note(self) -> None:
        """Take note of what has no derivative in the step just taken."""
        d = self.seeds.directions
        if d.lost:
            if d.lost != _OF_MAP or not self.found:
                self.found.append(reason(self.stepper, d.lost, d.at, d.contact))
            d.lost, self.lost = 0, not self.captured

    @property
    def q(self) -> np.ndarray:
        """Coordinates, shape (n_q,)."""
        return self.lib.kept(self.state.q)

    @property
    def v(self) -> np.ndarray:
        """Velocities, shape (n_q,)."""
        return self.lib.kept(self.state.v)

    def changes(self) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Changes of q and of v, with respect to each that was asked for; NaN where none are."""
        d, n_q = self.seeds.directions, self.seeds.n_q
        moved = self.lib.view(d.grid) - self.lib.view(d.t)
        leaves = np.frombuffer(d.leaves, np.intc)[: d.count] != 0
        # a direction that leaves the start; an event that ends the step in which it is
        unknown = leaves | (moved[: d.count] != 0) | self.lost
        found = []
        for values in (d.q, d.v):
            change = self.lib.kept(values).reshape(-1, n_q)[: d.count].T
            change[:, unknown] = np.nan
            found.append(self.seeds.by_name(change))
        return found[0], found[1]
