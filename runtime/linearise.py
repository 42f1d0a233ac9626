"""Linear systems about equilibria, also in contact, and about periodic motions."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from signorini.runtime.arguments import number, shaped
from signorini.runtime.changes import Taken, forward, outputs
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError
from signorini.runtime.options import RunOptions


@dataclass(frozen=True, eq=False)
class Linearisation:
    """How small deviations (dq, dv) from a motion have changed after a time.

    Deviations keep the constraints, closed contacts and sticking that hold at the start: those of
    all (q, v) are first made so, nearest in the mass matrix.

    Attributes
    ----------
    period : float
        The time [s].
    A : ndarray, shape (2 n_q, 2 n_q)
        Deviation (dq, dv) after it, by that at the start: of a periodic motion its monodromy
        matrix, through impacts and changes of stick and slip.
    B : ndarray, shape (2 n_q, n_u)
        By the inputs, held all the time.
    C, D : ndarray, shape (n_outputs, 2 n_q), (n_outputs, n_u)
        Outputs at the start, by deviations and inputs.
    basis : ndarray, shape (2 n_q, m)
        Deviations that are possible, orthonormal; m is the number of states of the linear system.
    moved : float
        By how much the motion misses where it began, relative to its size.
    """

    period: float
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    basis: np.ndarray
    moved: float

    @property
    def minimal(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(A, B, C, D) of deviations in the basis: m states."""
        T = self.basis
        return T.T @ self.A @ T, T.T @ self.B, self.C @ T, self.D

    @property
    def multipliers(self) -> np.ndarray:
        """Eigenvalues of the map of possible deviations, the largest first.

        Of a periodic motion these are the Floquet multipliers; one is 1 where nothing depends on
        the time itself.
        """
        values = np.linalg.eigvals(self.minimal[0])
        return values[np.argsort(-np.abs(values))]

    @property
    def rates(self) -> np.ndarray:
        """Growth rates and angular frequencies log(multiplier) / period [1/s]."""
        with np.errstate(divide="ignore"):
            return np.log(self.multipliers.astype(complex)) / self.period

    def __repr__(self) -> str:
        largest = np.abs(self.multipliers[:1])
        size = f", largest multiplier {largest[0]:.6g}" if largest.size else ""
        return f"Linearisation({self.basis.shape[1]} states over {self.period:g} s{size})"


def linearise(
    stepper: Compiled,
    start: tuple[float, np.ndarray, np.ndarray],
    *,
    h: float,
    n_steps: int,
    parameters: dict[str, float],
    u: np.ndarray,
    shift: Any,
    tol: float,
    options: RunOptions,
) -> Linearisation:
    """Linearise; see `Stepper.linearise`."""
    t, q, v = start
    n, n_q = stepper.sizes, stepper.sizes["n_q"]
    away = np.zeros(n_q) if shift is None else shaped("shift", shift, (n_q,))
    values = [parameters[name] for name in stepper.parameters] or [0.0]
    taken = Taken(
        stepper, options, np.array([t]), q[None], v[None], np.array([values]),
        np.broadcast_to(u, (n_steps, n["n_u"]))[None], h, n_steps, np.array([n_steps]), n_steps, 1,
        True,
    )  # fmt: skip
    end_q, end_v = taken.end(0)
    size = max(1.0, float(np.max(np.abs([*q, *v]))))
    moved = float(np.max(np.abs([*(end_q - q - away), *(end_v - v)]))) / size
    if not moved <= number("tol", tol):
        what = "an equilibrium" if n_steps == 1 else "a periodic motion"
        raise RunError(
            f"model '{stepper.name}': the start is not on {what}: {n_steps * h:g} s later the "
            f"state is {moved:.3g} of its size away from it, more than tol = {tol:g}"
        )
    dq, dv, events = forward(taken, ("q0", "v0", "inputs"))
    if events[0]:
        e = events[0][0]
        raise RunError(
            f"model '{stepper.name}': the motion has no derivative at t = {e.t:g}"
            + (f", contact '{e.contact}'" if e.contact else "")
            + f": {e.why}"
        )
    first, last = (
        {name: np.vstack([dq[name][0, row], dv[name][0, row]]) for name in dq} for row in (0, -1)
    )
    project = np.hstack([first["q0"], first["v0"]])
    A = np.hstack([last["q0"], last["v0"]])
    unknown = np.isnan(A).any(axis=0)
    if unknown.any():
        names = [*stepper.manifest["coordinates"], *stepper.manifest["velocities"]]
        raise RunError(
            f"model '{stepper.name}': a deviation of {names[int(np.argmax(unknown))]} leaves what "
            "holds at the start, or the motion ends in an event: begin at another place of it"
        )
    left, sizes, _ = np.linalg.svd(project)
    basis = left[:, sizes > 1e-9 * max(1.0, float(sizes[0]))]
    rows = {"t": taken.t, "q": q[None], "v": v[None], "u": np.reshape(u, (1, -1))}
    unit, none = np.eye(n_q)[None], np.zeros((1, n_q, n_q))
    stays = np.zeros((1, n_q, n["n_u"]))
    y = outputs(
        taken, 0, rows, {"q0": unit, "v0": none, "inputs": stays},
        {"q0": none, "v0": unit, "inputs": stays},
    )  # fmt: skip
    C, D = np.hstack([y["q0"][0], y["v0"][0]]) @ project, y["inputs"][0]
    return Linearisation(n_steps * h, A, last["inputs"], C, D, basis, moved)
