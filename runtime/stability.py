"""Steps that are too large for the fastest oscillation of a model, noticed and said."""

import warnings
from math import floor, isfinite, log10
from typing import Any

import numpy as np
from signorini.runtime.compiled import Compiled

_MARGIN = 0.95  # of the limit, in the step size that is named
_GROWN = 2.0  # growth of the energy, by its own size, at which the step size is looked at again


def stable_step(
    stepper: Compiled,
    t: float,
    q: np.ndarray,
    v: np.ndarray,
    u: Any,
    par: dict[str, float],
    force: np.ndarray | None = None,
) -> float:
    """The largest stable step estimated at a state, infinite where nothing oscillates.

    Parameters
    ----------
    t, q, v, u, par
        State, inputs and parameters.
    force : ndarray, shape (n_R,), optional
        Constraint and contact forces; they add to the stiffness where directions turn.

    Returns
    -------
    float
        h [s] with h omega_max at the end of the scheme's first interval of stability.
    """
    lib = stepper.library
    n = stepper.sizes
    arrays = [lib.array(np.asarray(x).ravel()) for x in (q, v)]
    inputs = lib.array(np.zeros(max(n["n_u"], 1)) if u is None or not n["n_u"] else np.ravel(u))
    forces = None if force is None or not n["n_R"] else lib.array(force)
    scratch = lib.array(np.zeros(stepper.manifest["stable_scratch"]))
    h = lib.call["stable_step"](
        stepper.c_params(par),
        t,
        *(lib.pointer(a) for a in arrays),
        lib.pointer(inputs),
        None if forces is None else lib.pointer(forces),
        lib.pointer(scratch),
    )
    return float(h) if h < lib.largest else float("inf")


def two_digits(h: float) -> str:
    """A step size below `h` as text of two digits."""
    exponent = floor(log10(h)) - 1
    return f"{floor(h / 10.0**exponent) * 10.0**exponent:.2g}"


class Watch:
    """Looks at the step size at the start of a run, and again when its energy grows."""

    def __init__(
        self, stepper: Compiled, par: dict[str, float], h: float, *, explicit: bool
    ) -> None:
        self.stepper, self.par, self.h = stepper, par, h
        # with inputs or explicit time the energy may grow by right
        self.closed = not explicit and not stepper.manifest["explicit_time"]
        self.warned = False
        self.energy = self.speed = 0.0

    def look_at_start(self, t: float, q: np.ndarray, v: np.ndarray) -> None:
        """Warn if the step is too large for the oscillations about the start."""
        self.energy = self._energy(t, q, v)
        self._warn(t, q, v)

    def look(self, state: Any, done: int) -> None:
        """Look again where the energy has grown."""
        if self.warned or not self.closed or not done:
            return
        lib = self.stepper.library
        t, q, v = float(state.t), lib.kept(state.q), lib.kept(state.v)
        energy = self._energy(t, q, v)
        kinetic = abs(
            0.5 * float(np.dot(v, self.stepper.evaluate("p", t, q, v, parameters=self.par)))
        )
        if not energy - self.energy <= _GROWN * max(abs(self.energy), 1e-3 * kinetic):
            self._warn(t, q, v)
            self.energy = max(energy, self.energy) if isfinite(energy) else self.energy

    def hint(self, t: float, q: np.ndarray, v: np.ndarray, u: Any) -> str:
        """What an error says where the step is the likely cause."""
        h = stable_step(self.stepper, t, q, v, u, self.par)
        if not _MARGIN * h < self.h:
            return ""
        return (
            f"the likely cause is the step: at dt = {self.h:g} the fastest oscillation grows, with "
            f"dt = {two_digits(_MARGIN * h)} it would not"
        )

    def _energy(self, t: float, q: np.ndarray, v: np.ndarray) -> float:
        return float(self.stepper.evaluate("energy", t, q, v, parameters=self.par))

    def _warn(self, t: float, q: np.ndarray, v: np.ndarray) -> None:
        h = stable_step(self.stepper, t, q, v, None, self.par)
        if self.warned or not h < self.h:
            return
        self.warned = True
        period = 2 * np.pi * h / self.stepper.manifest["stable_phase"]
        warnings.warn(
            f"model '{self.stepper.name}': the step is too large for the stiffness at t = {t:g}: "
            f"the fastest oscillation has a period of {period:.2g}, and its amplitude may grow. "
            f"With dt = {two_digits(_MARGIN * h)} it is stable",
            stacklevel=6,
        )
