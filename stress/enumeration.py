"""Every combination of contact states of one planar step, tried one by one.

For up to four contacts that can be reached in a step: each one is open, sticks, or slips one way or
the other at each stage. For each combination the equations of the step are smooth; Newton's method
solves them, and the inequalities decide. Nothing found means that the step has no solution near its
start; that is the only proof of it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from signorini.runtime.replay import FailedStep
from signorini.runtime.stepper import Stepper

OPEN, STICK, FORTH, BACK = range(4)
_LIMIT = 5_000  # combinations
_TOLERANCE = 1e-8
_SOLVED = 1e-10


@dataclass
class Verdict:
    """What the enumeration found.

    Attributes
    ----------
    text : str
        "no solution", "solution found", or why nothing can be said.
    combinations : int
        Combinations of contact states tried.
    x, lam : ndarray or None
        A solution: the unknowns of all problems.
    """

    text: str
    combinations: int = 0
    x: np.ndarray | None = None
    lam: np.ndarray | None = None

    @property
    def proven(self) -> bool:
        """No combination solves the step."""
        return self.text == "no solution"


def examine(stepper: Stepper, step: FailedStep) -> Verdict:
    """Try all combinations of contact states of a failed step."""
    m = stepper.manifest
    if any(c["components"] > 1 or c["normal"] < 0 for c in m["contacts"]):
        return Verdict("not examined: only contacts with planar friction are")
    return _Examination(stepper, step).run()


class _Examination:
    def __init__(self, stepper: Stepper, step: FailedStep) -> None:
        m, n = stepper.manifest, stepper.sizes
        self.stepper, self.step = stepper, step
        self.contacts = m["contacts"]
        self.n_R, self.normal = n["n_R"], n["n_g"] + n["n_gamma"]
        self.slip = self.normal + n["n_N"]
        self.position, self.velocity = m["problems"]
        self.n_lam = n["n_lambda_total"]
        state = step.state
        self.at = {
            "t": state["t"], "q": state["q"], "v": state["v"], "u": step.u,
            "parameters": step.parameters,
        }  # fmt: skip
        q, par = np.array(state["q"]), step.parameters
        self.mu = stepper.evaluate("mu", state["t"], q, parameters=par)
        self.exists = np.ones(len(self.contacts), dtype=bool)
        if any(c["guarded"] for c in self.contacts):
            guard = stepper.evaluate("guard", state["t"], q, parameters=par)
            guarded = np.array([c["guarded"] for c in self.contacts])
            self.exists = ~guarded | (guard >= 0)
        self.tried = 0
        self.speed = np.abs(state["v"]).max()

    def residuals(self, name: str, x: np.ndarray, lam: np.ndarray) -> dict[str, np.ndarray]:
        return self.stepper.problem(name, x, lam, self.step.h, **self.at)

    def run(self) -> Verdict:
        x0, lam0 = self.free_flight()
        near = self.reachable(x0, lam0)
        slots = self.position["n_slots"]
        if len(near) > 4 or 4 ** (len(near) * slots) > _LIMIT:
            return Verdict(f"not examined: {len(near)} contacts at {slots} stages")
        for x, lam in self.solutions("position", x0, lam0, near, slots):
            active = self.active(x, lam, near)
            for x_end, lam_end in self.solutions("velocity", x, lam, active, 1):
                return Verdict("solution found", self.tried, x_end, lam_end)
        return Verdict("no solution", self.tried)

    def free_flight(self) -> tuple[np.ndarray, np.ndarray]:
        """The step without any contact percussion."""
        x = np.tile(self.at["v"], self.stepper.sizes["n_x_total"] // len(self.at["v"]))
        lam = np.zeros(self.n_lam)
        for name in ("position", "velocity"):
            kinds = np.full((self.size(name)[1], len(self.contacts)), OPEN)
            solved = self.newton(name, x, lam, kinds)
            if solved is not None:
                x, lam = solved
        self.speed = max(self.speed, np.abs(x).max())
        return x, lam

    def size(self, name: str) -> tuple[int, int, int, int]:
        p = self.position if name == "position" else self.velocity
        first = 0 if name == "position" else self.position["n_x"]
        offset = 0 if name == "position" else self.position["n_slots"] * self.n_R
        return p["n_x"], p["n_slots"], first, offset

    def reachable(self, x: np.ndarray, lam: np.ndarray) -> list[int]:
        """Contacts that close in free flight, or nearly."""
        y = self.residuals("position", x, lam)["y"].reshape(-1, self.n_R)
        q, v = np.array(self.at["q"]), np.array(self.at["v"])
        rate = self.stepper.evaluate(
            "g_N_dot", self.at["t"], q, v, parameters=self.at["parameters"]
        )
        reach = self.step.h * (np.abs(rate).max() + np.abs(v).max()) + 1e-12
        near = []
        for k, c in enumerate(self.contacts):
            if self.exists[k] and y[:, self.normal + c["normal"]].min() < 2 * reach:
                near.append(k)
        return near

    def active(self, x: np.ndarray, lam: np.ndarray, near: list[int]) -> list[int]:
        """Contacts closed at any stage (67)."""
        y = self.residuals("position", x, lam)["y"].reshape(-1, self.n_R)
        R = lam[: y.size].reshape(y.shape)
        rows = [(k, self.normal + self.contacts[k]["normal"]) for k in near]
        floor = 1e-12 * (1 + np.abs(self.at["q"]).max())
        return [k for k, n in rows if np.any((R[:, n] > 0) | (np.abs(y[:, n]) <= floor))]

    def solutions(
        self, name: str, x: np.ndarray, lam: np.ndarray, near: list[int], slots: int
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """All combinations whose solution satisfies the inequalities."""
        choices = []
        for _ in range(slots):
            for k in near:
                sliding = self.contacts[k]["components"] and self.mu[k] > 0
                choices.append((OPEN, STICK, FORTH, BACK) if sliding else (OPEN, FORTH))
        for combination in product(*choices):
            kinds = np.full((slots, len(self.contacts)), OPEN)
            kinds[:, near] = np.array(combination, dtype=int).reshape(slots, len(near))
            self.tried += 1
            solved = self.newton(name, x, lam, kinds)
            if solved is not None and self.admissible(name, *solved, kinds, near):
                yield solved

    def newton(
        self, name: str, x: np.ndarray, lam: np.ndarray, kinds: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Solve the equations of one combination; least-norm steps where they are dependent."""
        n_x, slots, first, offset = self.size(name)
        n = slots * self.n_R
        x, lam = x.copy(), lam.copy()
        lam[offset : offset + n] = 0
        for _ in range(12):
            at = self.residuals(name, x, lam)
            force = lam[offset : offset + n]
            rows, value = np.zeros((n, n_x + n)), np.zeros(n)
            for i in range(slots):
                self._rows(i, kinds[i], at, force, rows, value)
            J = np.vstack([np.hstack([at["A"], at["B"]]), rows])
            F = np.concatenate([at["r"], value])
            unit = np.maximum(np.abs(J).max(axis=1), 1e-300)
            columns = np.maximum(np.abs(J / unit[:, None]).max(axis=0), 1e-300)
            scaled = J / unit[:, None] / columns
            change = np.linalg.lstsq(scaled, -F / unit, rcond=1e-11)[0] / columns
            x[first : first + n_x] += change[:n_x]
            lam[offset : offset + n] += change[n_x:]
            if not np.all(np.isfinite(change)):
                return None
            speed = max(np.abs(x).max(), self.speed)
            if np.abs(change[:n_x]).max() <= _SOLVED * speed:
                left = np.abs(scaled @ (change * columns) + F / unit).max()
                return (x, lam) if left <= 10 * _SOLVED * speed else None
        return None

    def _rows(
        self,
        i: int,
        kinds: np.ndarray,
        at: dict[str, np.ndarray],
        force: np.ndarray,
        rows: np.ndarray,
        value: np.ndarray,
    ) -> None:
        n_x = at["A"].shape[0]
        base = i * self.n_R

        def kinematic(c: int) -> None:
            rows[base + c, :n_x] = at["C"][base + c]
            value[base + c] = at["y"][base + c]

        def zero(c: int) -> None:
            rows[base + c, n_x + base + c] = 1
            value[base + c] = force[base + c]

        for c in range(self.normal):
            kinematic(c)
        for k, contact in enumerate(self.contacts):
            n = self.normal + contact["normal"]
            (zero if kinds[k] == OPEN else kinematic)(n)
            if contact["components"]:
                f = self.slip + contact["friction"]
                if kinds[k] == STICK:
                    kinematic(f)
                else:
                    zero(f)
                    sign = {OPEN: 0.0, FORTH: 1.0, BACK: -1.0}[int(kinds[k])]
                    rows[base + f, n_x + base + n] = sign * self.mu[k]
                    value[base + f] += sign * self.mu[k] * force[base + n]

    def admissible(
        self, name: str, x: np.ndarray, lam: np.ndarray, kinds: np.ndarray, near: list[int]
    ) -> bool:
        """The inequalities of every contact, each in its own units."""
        _, slots, _, offset = self.size(name)
        y = self.residuals(name, x, lam)["y"].reshape(slots, self.n_R)
        R = lam[offset : offset + slots * self.n_R].reshape(slots, self.n_R)
        everyone = near if name == "velocity" else range(len(self.contacts))
        speed = max(np.abs(x).max(), self.speed)
        force = np.abs(R).max() + 1e-300
        for i in range(slots):
            length = speed * (self.step.h if name == "position" else 1)
            for k in everyone:
                contact = self.contacts[k]
                if not self.exists[k]:
                    continue
                n, f = self.normal + contact["normal"], self.slip + contact["friction"]
                if kinds[i, k] == OPEN and y[i, n] < -_TOLERANCE * length:
                    return False
                if kinds[i, k] != OPEN and R[i, n] < -_TOLERANCE * force:
                    return False
                if not contact["components"]:
                    continue
                radius = self.mu[k] * max(R[i, n], 0)
                if kinds[i, k] == STICK and abs(R[i, f]) > radius + _TOLERANCE * force:
                    return False
                if kinds[i, k] == FORTH and self.mu[k] > 0 and y[i, f] < -_TOLERANCE * speed:
                    return False
                if kinds[i, k] == BACK and y[i, f] > _TOLERANCE * speed:
                    return False
        return True
