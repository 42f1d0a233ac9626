"""Options of a step: names, defaults and ranges, once."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from signorini.runtime.arguments import number
from signorini.runtime.errors import RunError

ACTIVE_SETS = {"any_stage": 0, "end": 1}
SCALINGS = {"rows": 0, "none": 1}
EVENTS = {"captured": 0, "located": 1}
_MOST_EVENTS = 64  # of one located step, as the generated struct has it
_LARGEST_TOL = 2.0**-10  # as runtime/c has it: a step solved less exactly is none


@dataclass(frozen=True)
class RunOptions:
    """How steps are solved; `Stepper.simulate` says what each option means.

    Raises
    ------
    RunError
        For a value out of its range.
    """

    tol: float | None = None
    r: float | None = None
    active_set: str = "any_stage"
    scaling: str = "rows"
    max_halvings: int = 10
    max_iterations: int | None = None
    events: str = "captured"
    max_events: int | None = None
    error: float | None = None
    scale: Any = None

    def __post_init__(self) -> None:
        for name, known in (
            ("active_set", ACTIVE_SETS),
            ("scaling", SCALINGS),
            ("events", EVENTS),
        ):
            value = getattr(self, name)
            if not isinstance(value, str) or value not in known:
                choice = " or ".join(f'"{one}"' for one in known)
                raise RunError(f"{name} = {value!r}: choose {choice}")
        if self.tol is not None:
            tol = number("tol", self.tol)
            least = "0" if self.scaling == "rows" else "above 0"
            if not 0 <= tol <= _LARGEST_TOL or (tol == 0 and self.scaling == "none"):
                raise RunError(
                    f"tol = {self.tol!r}: give a tolerance from {least} to {_LARGEST_TOL:g}"
                )
        if self.r is not None and number("r", self.r) <= 0:
            raise RunError(f"r = {self.r!r}: give a prox parameter > 0, or none")
        if self.error is not None:
            if number("error", self.error) <= 0:
                raise RunError(f"error = {self.error!r}: give an error > 0, e.g. 1e-6")
            # a tolerance needs the order that only steps have that are cut at their events
            object.__setattr__(self, "events", "located")
        if self.scale is not None and self.error is None:
            raise RunError("scale is given without error: it says what 1 means of each coordinate")
        for name, low, top in (
            ("max_halvings", 0, 10),
            ("max_iterations", 1, 1_000_000),
            ("max_events", 1, _MOST_EVENTS),
        ):
            value = getattr(self, name)
            if value is None:
                continue
            whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
            if not whole or not low <= value <= top:
                raise RunError(f"{name} = {value!r}: give an integer from {low} to {top}")

    @classmethod
    def of(cls, options: dict[str, Any], *, chosen: bool = False) -> "RunOptions":
        """Options by name; `RunError` for a name that is none, or for `error` unless `chosen`."""
        known = [field.name for field in fields(cls)]
        for name in options:
            if name not in known:
                raise RunError(f"there is no option '{name}'; there are: {', '.join(known)}")
        if not chosen and (options.get("error") is not None or options.get("scale") is not None):
            raise RunError(
                "error and scale choose the sizes of steps in simulate and simulate_batch; a step "
                "taken here has the size that is given: leave them out"
            )
        return cls(**options)

    def given(self) -> dict[str, Any]:
        """Those that are not left to C, for records of a run."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        if isinstance(self.scale, np.ndarray):
            values["scale"] = self.scale.tolist()
        return {name: value for name, value in values.items() if value is not None}

    def fill(self, options: Any) -> None:
        """Set them in the struct of C, which holds its own defaults."""
        options.active_set = ACTIVE_SETS[self.active_set]
        options.scaling = SCALINGS[self.scaling]
        if hasattr(options, "events"):
            options.events = EVENTS[self.events]
            if self.max_events is not None:
                options.max_events = int(self.max_events)
        for name in ("tol", "r"):
            if getattr(self, name) is not None:
                setattr(options, name, float(getattr(self, name)))
        for name in ("max_halvings", "max_iterations"):
            if getattr(self, name) is not None:
                setattr(options, name, int(getattr(self, name)))


DEFAULTS = RunOptions()
