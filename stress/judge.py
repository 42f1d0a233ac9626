"""Judge a run from its recorded states, stages and percussions alone.

Nothing here knows how a step was solved: gaps, slip velocities and energies are evaluated anew and
the laws (52), (56)-(58) are looked at one by one.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from signorini.runtime.trajectory import Trajectory
from signorini.verify import laws

_STICKING = 1e-9  # of the radius: nearer to its ball's boundary friction counts as slipping
_APPROACH = 1e-6  # of the largest speed


@dataclass
class Findings:
    """What a run showed; arrays have one entry a step.

    Attributes
    ----------
    counted : ndarray of bool
        Steps with a change of contact state or at least two closed contacts.
    gap : float
        Smallest gap at a stage time [m].
    complementarity, cone : float
        Worst violation of (52), (56) and of (57), (58), in units of the run's largest gap speed
        times h, speed, percussion.
    gain : float
        Largest energy above that of the start, relative to the largest kinetic energy.
    lost : int
        Stages with R_N > 0 in a step with Delta P_N = 0.
    pushing : int
        Contacts that approach for more than two steps while pushing although e_N = 0.
    """

    counted: np.ndarray
    gap: float
    complementarity: float
    cone: float
    gain: float
    lost: int
    pushing: int


def judge(traj: Trajectory, dt: float, passive: bool) -> Findings:
    """Look at every step of a run recorded with its stages."""
    contacts = _Contacts(traj, dt)
    states = contacts.states()
    changed = np.any(np.diff(states, axis=0, prepend=0) != 0, axis=1)
    closed = np.count_nonzero(contacts.closed, axis=1)
    return Findings(
        counted=changed | (closed >= 2),
        gap=contacts.smallest_gap(),
        complementarity=contacts.complementarity(),
        cone=contacts.cone(),
        gain=_gain(traj, contacts.kinetic) if passive else 0.0,
        lost=contacts.lost(),
        pushing=contacts.pushing(),
    )


def _gain(traj: Trajectory, floor: float) -> float:
    stepper = traj.stepper
    L = stepper.evaluate("L", traj.t, traj.q, traj.v, parameters=traj.parameters)
    kinetic = (traj.energy + L) / 2
    return float(np.max(traj.energy - traj.energy[0]) / max(np.max(kinetic), floor, 1e-300))


class _Contacts:
    """Kinematics and percussions of all contacts at all stages, shape (n, s, contact)."""

    def __init__(self, traj: Trajectory, dt: float) -> None:
        stepper, par = traj.stepper, traj.parameters
        m = stepper.manifest
        n, s = traj.Q.shape[:2]
        self.traj, self.n, self.s, self.h = traj, n, s, dt
        self.rows = m["contacts"]
        start = (traj.t[:-1], traj.q[:-1], traj.v[:-1], traj.u[:-1], par)
        flat = (traj.t_stage.reshape(-1), traj.Q.reshape(n * s, -1), traj.V.reshape(n * s, -1))
        u = np.repeat(traj.u[:-1], s, axis=0)

        def stages(name: str) -> np.ndarray:
            return stepper.evaluate(name, *flat, u, par).reshape(n, s, -1)

        self.g_N = stages("g_N")
        self.gamma_F = stages("gamma_F")
        self.exists = np.ones((n, len(self.rows)), dtype=bool)
        if any(c["guarded"] for c in self.rows):
            guard = stepper.evaluate("guard", *start)
            guarded = np.array([c["guarded"] for c in self.rows])
            self.exists = ~guarded | (guard >= 0)
        self.mu, self.e_N, self.e_F = (
            stepper.evaluate(name, *start) if self.rows else np.zeros((n, 0))
            for name in ("mu", "e_N", "e_F")
        )
        self.mu_F = np.ones(stepper.sizes["n_F"])
        if stepper.sizes["n_axes"]:
            self.mu_F = stepper.evaluate("mu_F", traj.t[0], traj.q[0], parameters=par)
        self.laws = [laws.find(c["law"]) for c in self.rows]
        self.bound = stages("bound") if any(c["bound"] >= 0 for c in self.rows) else None
        # A run at rest has the speed that its percussions would give.
        mobility = 0.0
        if self.rows:
            first = (traj.t[0], traj.q[0], traj.v[0])
            directions = "W_N" if stepper.sizes["n_N"] else "W_F"
            W, M = (stepper.evaluate(name, *first, parameters=par) for name in (directions, "p_v"))
            mobility = float(np.einsum("ik,ik->k", W, np.linalg.solve(M, W)).max())
        # Steps in several parts, and those that were cut at events, do not show their stages.
        self.whole = (traj.substeps[1:] == 0) & np.isfinite(traj.t_stage[:, 0])
        self.g_N[~self.whole] = np.inf
        speeds = [np.abs(traj.g_N_dot).max(initial=0), np.abs(traj.gamma_F).max(initial=0)]
        percussions = (traj.P_N, traj.P_F, traj.P_g, traj.P_gamma)
        self.P_top = max(*(np.abs(x).max(initial=0) for x in percussions), 1e-300)
        self.R_top = max(np.abs(traj.R_N[self.whole, :-1]).max(initial=0), self.P_top)
        self.speed = max(*speeds, self.P_top * mobility, 1e-300)
        self.kinetic = self.P_top**2 * mobility / 2
        normal = [c["normal"] for c in self.rows]
        unilateral = np.array([k >= 0 for k in normal], dtype=bool)
        self.closed = np.zeros((n, len(self.rows)), dtype=bool)
        pushed = (traj.R_N[:, :-1] > 0).any(axis=1) | (traj.P_N[1:] > 0)
        self.closed[:, unilateral] = pushed
        for k, c in enumerate(self.rows):
            if c["presser"] >= 0:
                self.closed[:, k] = self.closed[:, c["presser"]]
        self.unilateral = [int(k) for k in np.flatnonzero(unilateral)]
        self.yields = self._yielding(start)
        self.places = [
            k for k in self.unilateral if not self.rows[k]["one_way"] and k not in self.yields
        ]

    def _yielding(self, start: tuple[Any, ...]) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Compliance and relaxation in every step of the contacts that yield."""
        compliant = self.traj.stepper.manifest["compliant"]
        if not compliant:
            return {}
        c, tau = (self.traj.stepper.evaluate(name, *start) for name in ("compliance", "relaxation"))
        names = [row["name"] for row in self.rows]
        return {
            names.index(name): (c[:, j], tau[:, j])
            for j, name in enumerate(compliant)
            if name in names
        }

    def _gaps(self, k: int, at: np.ndarray) -> np.ndarray:
        """The gap of contact k at the stages 2 ... s, or what its compliance leaves of it (T20)."""
        n = self.rows[k]["normal"]
        gaps = self.g_N[at, 1:, n]
        if k not in self.yields:
            return gaps
        c, tau = (x[at, None] for x in self.yields[k])
        back = (self.traj.t_stage[at, 1:] - self.traj.t_stage[at, :1]) / tau.clip(1e-300)
        before = np.minimum(self.g_N[at, :1, n], 0)
        law = gaps + (gaps - before) / back + c * self.traj.R_N[at, :-1, n] / self.h
        return law / (1 + 1 / back)

    def _rates(self, k: int, at: np.ndarray) -> np.ndarray:
        """xi_N of contact k, or what its compliance makes of it (T21)."""
        n = self.rows[k]["normal"]
        before, after = self.traj.g_N_dot[:-1][at, n], self.traj.g_N_dot[1:][at, n]
        if self.rows[k]["one_way"]:
            before = np.minimum(before, 0)
        if k not in self.yields:
            return after + self.e_N[at, k] * before
        c, tau = (x[at] for x in self.yields[k])
        place = np.minimum(self.g_N[at, -1, n], 0) + c * self.traj.P_N[1:][at, n] / self.h
        return after + place / (tau + self.h / 2)

    def states(self) -> np.ndarray:
        """0 open, 1 sticks, 2 slips: at the end of every step."""
        states = self.closed.astype(int)
        for k, c in enumerate(self.rows):
            if c["components"]:
                f = slice(c["friction"], c["friction"] + c["components"])
                size = self.laws[k].size(self.traj.P_F[1:, f], self.mu_F[f])
                bound = self.h * self._mean_bound(c)
                if c["loads"]:
                    bound = self.mu[:, k] * self._load(c, self.traj.P_g[1:], self.traj.P_gamma[1:])
                radius = self._radius(k, self.mu, self.traj.P_N[1:], bound)
                slips = (size >= radius * (1 - _STICKING)) & (radius > 0)
                at = self.closed[:, k] if c["presser"] >= 0 else np.ones(self.n, dtype=bool)
                states[:, k] = np.where(at & slips, 2, np.where(at, 1, 0))
        return states

    def _mean_bound(self, contact: dict[str, int]) -> np.ndarray:
        if self.bound is None or contact["bound"] < 0:
            return np.zeros(self.n)
        return np.maximum(self.bound[..., contact["bound"]], 0) @ self._weights()

    @staticmethod
    def _load(contact: dict[str, int], P_g: np.ndarray, P_gamma: np.ndarray) -> np.ndarray:
        """Size of the bilateral percussions that press a friction element."""
        P = np.concatenate([P_g, P_gamma], axis=1)
        return np.linalg.norm(P[:, contact["load"] : contact["load"] + contact["loads"]], axis=1)

    def _weights(self) -> np.ndarray:
        c = self.traj.t_stage[0] - self.traj.t_stage[0, 0]
        c = c / c[-1]
        powers = np.vander(c, increasing=True).T
        return np.linalg.solve(powers, 1 / np.arange(1, self.s + 1))

    def _radius(self, k: int, mu: np.ndarray, P_N: np.ndarray, bound: np.ndarray) -> np.ndarray:
        normal = self.rows[k]["pressing"]
        return mu[:, k] * np.maximum(P_N[:, normal], 0) if normal >= 0 else bound

    def smallest_gap(self) -> float:
        """At the stages of all steps of contacts that exist."""
        rows = [self.rows[k]["normal"] for k in self.places]
        gaps = np.where(self.exists[:, None, self.places], self.g_N[..., rows], np.inf)
        return float(gaps[:, 1:].min(initial=np.inf))

    def complementarity(self) -> float:
        """(52) at the stages, (56) at the end."""
        worst = 0.0
        for k in self.unilateral:
            at = self.exists[:, k] & self.whole
            n = self.rows[k]["normal"]
            time = 1.0 if self.rows[k]["one_way"] else self.h
            gap = self._gaps(k, at) / (time * self.speed)
            R = self.traj.R_N[at, :-1, n] / self.R_top
            worst = max(worst, _complementary(gap, R))
            P = self.traj.P_N[1:][at, n]
            xi = self._rates(k, at) / self.speed
            worst = max(worst, _complementary(np.where(P > 0, xi, 1.0), P / self.P_top))
        return worst

    def cone(self) -> float:
        """(57) at the stages, (58) at the end: in the ball, the dissipation attained."""
        worst = 0.0
        for k, c in enumerate(self.rows):
            if not c["components"]:
                continue
            f = slice(c["friction"], c["friction"] + c["components"])
            at = self.exists[:, k] & self.whole
            for i in range(1, self.s):
                R_N = self.traj.R_N[at, i - 1]
                bound = np.zeros(np.count_nonzero(at))
                if self.bound is not None and c["bound"] >= 0:
                    bound = self.h * np.maximum(self.bound[at, i - 1, c["bound"]], 0)
                if c["loads"]:
                    R = self.traj.R_g[at, i - 1], self.traj.R_gamma[at, i - 1]
                    bound = self.mu[at, k] * self._load(c, *R)
                radius = self._radius(k, self.mu[at], R_N, bound)
                R_F, slip = self.traj.R_F[at, i - 1, f], self.gamma_F[at, i, f]
                worst = max(worst, self._in_cone(k, R_F, slip, radius, self.R_top))
            P = self.traj.P_N[1:][at]
            bound = (self.h * self._mean_bound(c))[at]
            if c["loads"]:
                both = self.traj.P_g[1:][at], self.traj.P_gamma[1:][at]
                bound = self.mu[at, k] * self._load(c, *both)
            radius = self._radius(k, self.mu[at], P, bound)
            before, after = self.traj.gamma_F[:-1][at, f], self.traj.gamma_F[1:][at, f]
            xi = after + self.e_F[at, k][:, None] * before
            P_F = self.traj.P_F[1:][at, f]
            worst = max(worst, self._in_cone(k, P_F, xi, radius, self.P_top))
        return worst

    def _in_cone(
        self, k: int, P: np.ndarray, slip: np.ndarray, radius: np.ndarray, force: float
    ) -> float:
        c = self.rows[k]
        mu_F = self.mu_F[c["friction"] : c["friction"] + c["components"]]
        size, rate = self.laws[k].size(P, mu_F), self.laws[k].rate(slip, mu_F)
        outside = np.maximum(size - radius, 0) / force
        power = np.abs(radius * rate + np.einsum("ij,ij->i", P, slip)) / (force * self.speed)
        return float(max(outside.max(initial=0), power.max(initial=0)))

    def lost(self) -> int:
        """Contacts that pushed at a stage and took no part in the impact equations."""
        pushed = (self.traj.R_N[:, :-1] > 1e-9 * self.R_top).any(axis=1)
        return int(np.count_nonzero(pushed & (self.traj.P_N[1:] == 0) & self.whole[:, None]))

    def pushing(self) -> int:
        """Runs of more than two steps in which a contact pushes and approaches, e_N = 0."""
        count = 0
        for k in self.unilateral:
            n = self.rows[k]["normal"]
            if np.any(self.e_N[:, k] > 0) or k in self.yields:
                continue
            rate = self.traj.g_N_dot[1:, n]
            bad = (self.traj.P_N[1:, n] > 0) & (rate < -_APPROACH * self.speed)
            count += int(np.count_nonzero(bad[2:] & bad[1:-1] & bad[:-2]))
        return count


def _complementary(a: np.ndarray, b: np.ndarray) -> float:
    """0 <= a, 0 <= b, a b = 0: the worst of -a, -b, min(a, b)."""
    return float(np.abs(np.minimum(a, b)).max(initial=0))
