"""Every combination of contact states of one planar step, tried one by one.

For up to four contacts that can be reached in a step: each one is open, sticks, or slips one way or
the other at each stage. For each combination the equations of the step, linearised about free
flight, are solved; combinations that violate no inequality by more than the curvature of a step can
explain are solved as they are, by Newton's method. If none holds the step has no solution near its
start; that is the only proof of it.

What goes one way is open or holds. Friction that one row of a constraint presses sticks or slips
either way, and the row pulls or pushes. Friction that another contact presses, as rolling
resistance is, acts while that contact is closed. With either all combinations are solved as they
are.
"""

import ctypes
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from signorini.runtime.compile import compile_plain
from signorini.runtime.replay import FailedStep
from signorini.runtime.stepper import Stepper

OPEN, STICK, FORTH, BACK = range(4)
_MOST = 4**12  # combinations of one problem: four contacts at three stages
_MOST_PRESSED = 4**8  # the same with friction that another contact presses
_CHUNK = 4096  # combinations that are handed over at once
_LOOSE = 1e-2  # violation that the linearised equations may show
_TIGHT = 1e-8
_SOLVED = 1e-10
_SOFT = 1e-8  # relative compliance of dependent rows while combinations are sifted


@cache
def _library() -> ctypes.CDLL:
    """The compiled sift.c."""
    library = ctypes.CDLL(str(compile_plain(Path(__file__).with_name("sift.c"))))
    library.sift.restype = ctypes.c_long
    return library


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
    """Try all combinations of contact states of a failed step.

    Parameters
    ----------
    stepper : Stepper
        Of the model that the step failed with.
    step : FailedStep
        From ``StepError.step`` or a replay file.
    """
    m = stepper.manifest
    if len(m["parts"]) > 1:
        return Verdict("not examined: only models in one part are")
    if m["compliant"]:
        return Verdict("not examined: only rigid contacts are")
    if any(
        c["components"] > 1 or (c["normal"] < 0 and c["loads"] != 1 and c["pressing"] < 0)
        for c in m["contacts"]
    ):
        return Verdict("not examined: only contacts with planar friction are")
    return _Examination(stepper, step).run()


class _Examination:
    def __init__(self, stepper: Stepper, step: FailedStep) -> None:
        m, n = stepper.manifest, stepper.sizes
        self.stepper, self.step = stepper, step
        self.contacts = m["contacts"]
        self.n_R, self.normal = n["n_R"], n["n_g"] + n["n_gamma"]
        self.slip = self.normal + n["n_N"]
        self.position, self.velocity = m["kinds"][0]["problems"][:2]
        state = step.state
        q, par = np.array(state["q"]), step.parameters
        self.at = {
            "t": state["t"], "q": q, "v": np.array(state["v"]), "u": step.u, "parameters": par,
        }  # fmt: skip
        self.mu = stepper.evaluate("mu", **self.at)
        self.exists = np.ones(len(self.contacts), dtype=bool)
        if any(c["guarded"] for c in self.contacts):
            guard = stepper.evaluate("guard", state["t"], q, parameters=par)
            guarded = np.array([c["guarded"] for c in self.contacts])
            self.exists = ~guarded | (guard >= 0)
        M = stepper.evaluate("p_v", state["t"], q, self.at["v"], parameters=par)
        self.weight = np.sqrt(np.abs(np.diag(M)) / max(np.abs(np.diag(M)).max(), 1e-300))
        self.loaded = [k for k, c in enumerate(self.contacts) if c["loads"]]
        self.pressed = {
            k: c["presser"]
            for k, c in enumerate(self.contacts)
            if c["normal"] < 0 and c["pressing"] >= 0 and self.mu[k] > 0
        }
        self.pulls: dict[tuple[int, int], float] = {}  # by slot and element, the sign of its load
        self.tried = 0
        self.speed = float(np.abs(state["v"]).max())

    def run(self) -> Verdict:
        x, lam = self.free_flight()
        near = self.reachable(x, lam)
        slots = self.position["n_slots"]
        if 4 ** (len(near) * slots) > (_MOST if not self.pressed else _MOST_PRESSED):
            return Verdict(f"not examined: {len(near)} contacts within reach at {slots} stages")
        for at in self.solutions("position", x, lam, near):
            for x_end, lam_end in self.solutions("velocity", *at, self.active(*at, near)):
                return Verdict("solution found", self.tried, x_end, lam_end)
        return Verdict("no solution", self.tried)

    # --- the equations ---------------------------------------------------------------------------

    def residuals(self, name: str, x: np.ndarray, lam: np.ndarray) -> dict[str, np.ndarray]:
        return self.stepper.problem(name, x, lam, self.step.h, **self.at)

    def places(self, name: str) -> tuple[int, int, int, int]:
        """Numbers of smooth unknowns and slots, places of x and lambda among all unknowns."""
        if name == "position":
            return self.position["n_x"], self.position["n_slots"], 0, 0
        n_x, slots = self.velocity["n_x"], self.velocity["n_slots"]
        return n_x, slots, self.position["n_x"], self.position["n_slots"] * self.n_R

    def free_flight(self) -> tuple[np.ndarray, np.ndarray]:
        """The step without any contact percussion."""
        n, v = self.stepper.sizes, self.at["v"]
        x, lam = np.tile(v, n["n_x_total"] // v.size), np.zeros(n["n_rows_total"])
        for name in ("position", "velocity"):
            kinds = np.full((self.places(name)[1], len(self.contacts)), OPEN)
            solved = self.newton(name, x, lam, kinds)
            if solved is not None:
                x, lam = solved
        self.speed = max(self.speed, float(np.abs(x).max()))
        return x, lam

    def reachable(self, x: np.ndarray, lam: np.ndarray) -> list[int]:
        """Contacts that may close within the step: from its start twice the kinetic energy of free
        flight can do so, and from where free flight leaves them twice its speeds.
        """
        gaps = self.residuals("position", x, lam)["y"].reshape(-1, self.n_R)
        v, par = self.at["v"], self.at["parameters"]
        start = (self.at["t"], self.at["q"], v)
        W, M, rate = (
            self.stepper.evaluate(name, *start, parameters=par)
            for name in ("W_N", "p_v", "g_N_dot")
        )
        at_start = self.stepper.evaluate("g_N", *start[:2], parameters=par)
        flight = np.vstack([v, x.reshape(-1, v.size)])
        energy = np.einsum("ij,jk,ik->i", flight, M, flight).max()
        mobility = np.einsum("ik,ik->k", W, np.linalg.solve(M, W))
        drift = np.abs(rate - W.T @ v)
        far = self.step.h * (np.sqrt(2 * energy * mobility) + drift)
        near = 2 * self.step.h * (np.abs(W).T @ np.abs(flight).max(axis=0) + drift)
        close = {
            k
            for k, c in enumerate(self.contacts)
            if k in self.loaded
            or c["one_way"]
            or (
                c["normal"] >= 0
                and self.exists[k]
                and at_start[c["normal"]] <= far[c["normal"]]
                and gaps[:, self.normal + c["normal"]].min() <= near[c["normal"]]
            )
        }
        return self.with_pressed(close)

    def active(self, x: np.ndarray, lam: np.ndarray, near: list[int]) -> list[int]:
        """Contacts closed at any stage (67)."""
        y = self.residuals("position", x, lam)["y"].reshape(-1, self.n_R)
        R = lam[: y.size].reshape(y.shape)
        rows = [(k, self.normal + self.contacts[k]["normal"]) for k in near]
        floor = 1e-12 * (1 + np.abs(self.at["q"]).max())
        closed = {
            k
            for k, n in rows
            if k in self.loaded
            or self.contacts[k]["one_way"]
            or (k not in self.pressed and np.any((R[:, n] > 0) | (np.abs(y[:, n]) <= floor)))
        }
        return self.with_pressed(closed)

    def with_pressed(self, acting: set[int]) -> list[int]:
        """Contacts in their order, with the friction that they press."""
        return sorted(acting | {k for k, presser in self.pressed.items() if presser in acting})

    # --- combinations ----------------------------------------------------------------------------

    def solutions(
        self, name: str, x: np.ndarray, lam: np.ndarray, near: list[int]
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """All combinations of states of the contacts `near` that solve a problem."""
        slots = self.places(name)[1]
        spots = [(i, k) for i in range(slots) for k in near]
        choices = [
            (STICK, FORTH, BACK)
            if k in self.loaded
            else (OPEN, STICK, FORTH, BACK)
            if self.contacts[k]["components"] and self.mu[k] > 0
            else (OPEN, FORTH)
            for _, k in spots
        ]
        for combination in self.combinations(name, x, lam, spots, choices):
            kinds = np.full((slots, len(self.contacts)), OPEN)
            for (i, k), kind in zip(spots, combination, strict=True):
                kinds[i, k] = kind
            solved = self.newton(name, x, lam, kinds)
            if solved is not None and self.admissible(name, *solved, kinds, near):
                yield solved

    def combinations(
        self,
        name: str,
        x: np.ndarray,
        lam: np.ndarray,
        spots: list[tuple[int, int]],
        choices: Sequence[tuple[int, ...]],
    ) -> Iterator[tuple[int, ...]]:
        """Combinations to be solved: what is left of the linearised problem or, with friction under
        load or pressed by another contact, all, each for both signs of every load."""
        if not self.loaded and not self.pressed:
            yield from self.sift(name, x, lam, spots, choices)
            return
        places = [(i, k) for i, k in spots if k in self.loaded]
        for signs in product((1.0, -1.0), repeat=len(places)):
            self.pulls = dict(zip(places, signs, strict=True))
            for combination in product(*choices):
                open_at = {spot: c == OPEN for spot, c in zip(spots, combination, strict=True)}
                if all(
                    open_at[i, k] == open_at[i, presser]
                    for (i, k) in spots
                    if (presser := self.pressed.get(k)) is not None
                ):
                    self.tried += 1
                    yield combination

    def sift(
        self,
        name: str,
        x: np.ndarray,
        lam: np.ndarray,
        spots: list[tuple[int, int]],
        choices: Sequence[tuple[int, ...]],
    ) -> Iterator[tuple[int, ...]]:
        """Combinations that the linearised problem does not rule out."""
        total = int(np.prod([len(c) for c in choices]))
        self.tried += total
        if not spots:
            yield ()
            return
        D, y0 = self.reduced(name, x, lam, spots)
        n = len(spots)
        size = np.abs(np.diag(D))
        size[size == 0] = 1.0
        arrays = (
            np.ascontiguousarray(D),
            np.ascontiguousarray(y0),
            np.array([self.mu[k] for _, k in spots], dtype=float),
            np.array([self.contacts[k]["components"] > 0 for _, k in spots], dtype=np.intc),
            size,
        )
        count = np.array([len(c) for c in choices], dtype=np.intc)
        table = np.zeros((n, 4), dtype=np.intc)
        for row, states in zip(table, choices, strict=True):
            row[: len(states)] = states
        found = np.empty((_CHUNK, n), dtype=np.uint8)
        first, after = 0, ctypes.c_long()
        library = _library()
        while first < total:
            hits = library.sift(
                n,
                *(a.ctypes.data_as(ctypes.c_void_p) for a in arrays),
                ctypes.c_double(_SOFT),
                ctypes.c_double(_LOOSE),
                count.ctypes.data_as(ctypes.c_void_p),
                table.ctypes.data_as(ctypes.c_void_p),
                *(ctypes.c_long(k) for k in (first, total, _CHUNK)),
                found.ctypes.data_as(ctypes.c_void_p),
                ctypes.byref(after),
            )
            yield from (tuple(row) for row in found[:hits].tolist())
            first = after.value

    def reduced(
        self, name: str, x: np.ndarray, lam: np.ndarray, spots: list[tuple[int, int]]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Kinematic rows y0 + D R of the spots' normals and slips; the rest is eliminated."""
        _n_x, slots, _, offset = self.places(name)
        lam = lam.copy()
        lam[offset : offset + slots * self.n_R] = 0
        at = self.residuals(name, x, lam)
        rows = [i * self.n_R + self.normal + self.contacts[k]["normal"] for i, k in spots]
        slips = [
            i * self.n_R
            + (self.slip + self.contacts[k]["friction"] if self.contacts[k]["components"] else -1)
            for i, k in spots
        ]
        chosen = [*rows, *slips]
        fixed = [i * self.n_R + c for i in range(slots) for c in range(self.normal)]
        B, C = at["B"], at["C"]
        Z = np.linalg.solve(at["A"], np.column_stack([B, at["r"]]))
        y = at["y"] - C @ Z[:, -1]
        D = -C @ Z[:, :-1]
        if fixed:
            inner = np.linalg.pinv(D[np.ix_(fixed, fixed)], rcond=1e-11)
            y = y - D[:, fixed] @ inner @ y[fixed]
            D = D - D[:, fixed] @ inner @ D[fixed]
        D, y = D[np.ix_(chosen, chosen)], y[chosen]
        for j, (_, k) in enumerate(spots):
            if not self.contacts[k]["components"]:
                D[len(spots) + j] = D[:, len(spots) + j] = y[len(spots) + j] = 0
        return D, y

    # --- one combination -------------------------------------------------------------------------

    def newton(
        self, name: str, x: np.ndarray, lam: np.ndarray, kinds: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Solve the equations of one combination; least-norm steps where they are dependent."""
        n_x, slots, first, offset = self.places(name)
        n = slots * self.n_R
        x, lam = x.copy(), lam.copy()
        lam[offset : offset + n] = 0
        weight = np.tile(self.weight, n_x // self.weight.size)
        size = np.inf
        for k in range(12):
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
            before, size = size, float(np.abs(change[:n_x] * weight).max())
            if k >= 3 and size > 0.5 * before and size > 1e3 * _SOLVED * self.speed:
                return None  # does not converge to anything near
            speed = max(float(np.abs(x).max()), self.speed)
            if np.abs(change[:n_x]).max() <= _SOLVED * speed:
                left = np.abs(scaled @ (change * columns) + F / unit).max()
                self._open(lam[offset : offset + n], kinds)
                return (x, lam) if left <= 10 * _SOLVED * speed else None
        return None

    def _open(self, force: np.ndarray, kinds: np.ndarray) -> None:
        """Percussions of open contacts vanish exactly; least squares leave round-off."""
        for i, states in enumerate(kinds):
            for k, contact in enumerate(self.contacts):
                if states[k] == OPEN and contact["normal"] >= 0:
                    force[i * self.n_R + self.normal + contact["normal"]] = 0

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
            n, sign = self._pressing(i, k)
            if k not in self.loaded and contact["normal"] >= 0:
                (zero if kinds[k] == OPEN else kinematic)(n)
            if contact["components"]:
                f = self.slip + contact["friction"]
                if kinds[k] == STICK:
                    kinematic(f)
                else:
                    zero(f)
                    sign *= {OPEN: 0.0, FORTH: 1.0, BACK: -1.0}[int(kinds[k])]
                    rows[base + f, n_x + base + n] = sign * self.mu[k]
                    value[base + f] += sign * self.mu[k] * force[base + n]

    def _pressing(self, i: int, k: int) -> tuple[int, float]:
        """Row that presses friction k in a slot, and the sign with which it does."""
        if k in self.loaded:
            return self.contacts[k]["load"], self.pulls.get((i, k), 1.0)
        contact = self.contacts[k]
        return self.normal + max(contact["normal"], contact["pressing"]), 1.0

    def admissible(
        self, name: str, x: np.ndarray, lam: np.ndarray, kinds: np.ndarray, near: list[int]
    ) -> bool:
        """The inequalities of every contact, each in its own units."""
        _, slots, _, offset = self.places(name)
        y = self.residuals(name, x, lam)["y"].reshape(slots, self.n_R)
        R = lam[offset : offset + slots * self.n_R].reshape(slots, self.n_R)
        everyone = near if name == "velocity" else range(len(self.contacts))
        speed = max(float(np.abs(x).max()), self.speed)
        force = np.abs(R).max() + 1e-300
        length = speed * (self.step.h if name == "position" else 1)
        for i in range(slots):
            for k in everyone:
                contact = self.contacts[k]
                if not self.exists[k]:
                    continue
                (n, sign), f = self._pressing(i, k), self.slip + contact["friction"]
                unit = speed if contact["one_way"] else length
                if kinds[i, k] == OPEN and y[i, n] < -_TIGHT * unit:
                    return False
                if kinds[i, k] != OPEN and sign * R[i, n] < -_TIGHT * force:
                    return False
                if not contact["components"]:
                    continue
                radius = self.mu[k] * max(sign * R[i, n], 0)
                if kinds[i, k] == STICK and abs(R[i, f]) > radius + _TIGHT * force:
                    return False
                if kinds[i, k] == FORTH and self.mu[k] > 0 and y[i, f] < -_TIGHT * speed:
                    return False
                if kinds[i, k] == BACK and y[i, f] > _TIGHT * speed:
                    return False
        return True
