"""Every emitted model function from the user's expressions, with 50 digits."""

from collections.abc import Callable, Sequence
from typing import Any

import mpmath as mp
import numpy as np
from signorini.verify.expressions import DIGITS, Expressions

_STEP = 15  # digits of the central differences: their error is about 1e-30


def reference_values(
    e: Expressions, t: float, q: Any, v: Any, u: Any, R: Any, par: Sequence[float]
) -> dict[str, np.ndarray]:
    """Values of all public functions at one state.

    Parameters
    ----------
    e : Expressions
        Of the model, made with ``high=True``.
    t, q, v, u, R, par
        Time, coordinates, velocities, inputs, percussions of one stage, parameters.
    """
    with mp.workdps(DIGITS):
        state = (t, q, v, u, par)

        def slope_in(function: Callable[..., np.ndarray], which: int) -> np.ndarray:
            step = mp.mpf(10) ** -_STEP
            columns = []
            for k in range(e.n_q):
                ends = []
                for sign in (1, -1):
                    parts: list[Any] = [t, *(list(part) for part in (q, v, u, par))]
                    parts[which][k] = mp.mpf(parts[which][k]) + sign * step
                    ends.append(function(*parts))
                columns.append((ends[0] - ends[1]) / (2 * step))
            return np.array(columns).T

        force = np.array([mp.mpf(x) for x in R])
        n_g, n_gamma, n_N = e.n["g"], e.n["gamma"], e.n["g_N"]
        W = e.W(*state)
        rest = (t, q, np.zeros(e.n_q), u, par)
        values = {
            "L": e.value("L", *state),
            "energy": np.array([e.energy(*state)]),
            "p": e.p(*state),
            "L_q": e.L_q(*state),
            "p_q": slope_in(e.p, 1),
            "p_v": slope_in(e.p, 2),
            "L_q_q": slope_in(e.L_q, 1),
            "L_q_v": slope_in(e.L_q, 2),
            "f": e.value("f", *state),
            "f_q": slope_in(lambda *a: e.value("f", *a), 1),
            "f_v": slope_in(lambda *a: e.value("f", *a), 2),
            "g": e.value("g", *state),
            "g_dot": e.dot("g", *state),
            "W_g": W[:, :n_g],
            "chi_g": e.dot("g", *rest),
            "gamma": e.value("gamma", *state),
            "gamma_q": slope_in(lambda *a: e.value("gamma", *a), 1),
            "W_gamma": W[:, n_g : n_g + n_gamma],
            "chi_gamma": e.value("gamma", *rest),
            "g_N": e.value("g_N", *state),
            "g_N_dot": e.dot("g_N", *state),
            "W_N": W[:, n_g + n_gamma : n_g + n_gamma + n_N],
            "chi_N": e.dot("g_N", *rest),
            "gamma_F": e.value("gamma_F", *state),
            "gamma_F_q": slope_in(lambda *a: e.value("gamma_F", *a), 1),
            "W_F": W[:, n_g + n_gamma + n_N :],
            "chi_F": e.value("gamma_F", *rest),
            "bound": e.value("bound", *state),
            "guard": e.value("guard", *state),
            "mu": e.value("mu", *state),
            "mu_F": e.value("mu_F", *state),
            "e_N": e.value("e_N", *state),
            "e_F": e.value("e_F", *state),
            "compliance": e.value("compliance", *state),
            "relaxation": e.value("relaxation", *state),
            "WR": W @ force,
            "WR_q": slope_in(lambda *a: e.W(*a) @ force, 1),
            "outputs": e.value("outputs", *state),
            "shapes": e.value("shapes", *state),
        }
        return {name: np.array(value, dtype=float) for name, value in values.items()}
