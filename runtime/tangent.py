"""Which changes of a start keep what holds there: constraints, closed contacts, sticking."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from signorini.runtime.compiled import Compiled

_SMALL = 1e-9  # gaps and velocities that count as none, in the units of the model
_NOISE = 1e-13  # of a change of one
_AWAY = 1e-6  # share of a row's largest derivative by which a direction leaves it

# How many rows, and the names of their derivatives by v and, at rest, of what is left.
_OF_ROWS = {
    "g": ("n_g", "W_g", "chi_g"),
    "gamma": ("n_gamma", "W_gamma", "chi_gamma"),
    "g_N": ("n_N", "W_N", "chi_N"),
    "gamma_F": ("n_F", "W_F", "chi_F"),
}


class Tangent:
    """The rows that hold at a start, with their derivatives by t, q, v and the parameters.

    Parameters
    ----------
    contacts : sequence of str
        States of the contacts after the first step, "" where that is unknown: those that are
        closed at the start and stay so hold there, too.
    """

    def __init__(
        self,
        stepper: Compiled,
        start: tuple[float, np.ndarray, np.ndarray],
        parameters: Mapping[str, float],
        contacts: Sequence[str] = (),
    ) -> None:
        self.stepper, self.start, self.parameters = stepper, start, dict(parameters)
        self.n_q, self.n_par = stepper.sizes["n_q"], stepper.sizes["n_par"]
        blocks = [self._rows("g", at_place=True), self._rows("g_dot"), self._rows("gamma")]
        blocks += self._held(contacts)
        self.rows = np.vstack([np.zeros((0, 1 + 2 * self.n_q + self.n_par)), *blocks])

    def _get(self, name: str, columns: int) -> np.ndarray | float:
        """A derivative by its name; zero where the model has none."""
        if columns and name in self.stepper.functions:
            t, q, v = self.start
            value = self.stepper.evaluate(name, t, q, v, parameters=self.parameters)
            return np.asarray(value, dtype=float).reshape(-1, columns)
        return 0.0

    def _rows(self, name: str, at_place: bool = False) -> np.ndarray:
        """Derivatives of the rows of a function by (t, q, v, par)."""
        n, n_q = self.stepper.sizes, self.n_q
        count_of, W_of, chi_of = _OF_ROWS[name.removesuffix("_dot")]
        count = n[count_of]
        found = np.zeros((count, 1 + 2 * n_q + self.n_par))
        if not count:
            return found
        W = np.asarray(self._get(W_of, count)).T
        if at_place:
            found[:, :1] = self._get(chi_of, 1)
            found[:, 1 : 1 + n_q] = W
        else:
            found[:, :1] = self._get(f"{name}_t", 1)
            found[:, 1 : 1 + n_q] = self._get(f"{name}_q", n_q)
            found[:, 1 + n_q : 1 + 2 * n_q] = W
        found[:, 1 + 2 * n_q :] = self._get(f"{name}_par", self.n_par)
        return found

    def _held(self, contacts: Sequence[str]) -> list[np.ndarray]:
        """Rows of the contacts that are closed, and of those that stick."""
        t, q, v = self.start
        value = {
            name: self.stepper.evaluate(name, t, q, v, parameters=self.parameters)
            for name in ("g_N", "g_N_dot", "gamma_F")
        }
        slopes = {name: self._rows(name, name == "g_N") for name in value}
        found = []
        for contact, state in zip(self.stepper.manifest["contacts"], contacts, strict=False):
            n, f, m = contact["normal"], contact["friction"], contact["components"]
            if state in ("", "unknown", "open"):
                continue
            if n >= 0:
                if max(abs(value["g_N"][n]), abs(value["g_N_dot"][n])) > _SMALL:
                    continue
                found += [slopes["g_N"][n : n + 1], slopes["g_N_dot"][n : n + 1]]
            slip = slice(f, f + m)
            if m and np.max(np.abs(value["gamma_F"][slip])) <= _SMALL:
                found.append(slopes["gamma_F"][slip])
        return found

    def leaving(self) -> dict[str, np.ndarray]:
        """Which unit changes of q0, v0, t0 and of the parameters leave what holds."""
        size = np.max(np.abs(self.rows), axis=1, keepdims=True, initial=0.0)
        away = (np.abs(self.rows) > _AWAY * size).any(axis=0)
        return self._by_name(away)

    def directions(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Changes of q and of v that go with unit changes, nearest to them and tangent.

        Nearest is measured with the mass matrix; parameters and time change by one, and the state
        follows.

        Returns
        -------
        dict from name to (ndarray, ndarray), shapes (n_q, number)
        """
        n_q = self.n_q
        total = self.rows.shape[1]
        t, q, v = self.start
        M = self.stepper.evaluate("p_v", t, q, v, parameters=self.parameters).astype(float)
        root = np.linalg.inv(np.linalg.cholesky((M + M.T) / 2)).T
        weight = np.kron(np.eye(2), root)
        unit = np.eye(total)
        G = self.rows[:, 1 : 1 + 2 * n_q] @ weight
        back = weight @ np.linalg.lstsq(G, -(self.rows @ unit), rcond=1e-10)[0]
        change = unit[1 : 1 + 2 * n_q] + back
        change[np.abs(change) < _NOISE] = 0.0  # a direction that is none is not to be one
        q_by, v_by = self._by_name(change[:n_q]), self._by_name(change[n_q:])
        return {name: (q_by[name], v_by[name]) for name in q_by}

    def _by_name(self, columns: np.ndarray) -> dict[str, Any]:
        n_q = self.n_q
        return {
            "t0": columns[..., :1],
            "q0": columns[..., 1 : 1 + n_q],
            "v0": columns[..., 1 + n_q : 1 + 2 * n_q],
            "parameters": columns[..., 1 + 2 * n_q :],
        }
