"""Every emitted model function against the user's expressions by another route, to 50 digits."""

from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest
import signorini as sg
from signorini.models import bouncing_ball, box, slider_crank, slope
from signorini.verify.expressions import Expressions
from trap_models import TRAPS

MODELS = (*TRAPS, bouncing_ball.model, slope.model, slider_crank.model, box.model)


def draw(stepper: sg.Stepper, seed: int) -> dict[str, np.ndarray | float]:
    """A state near the initial one, with inputs and percussions."""
    rng = np.random.default_rng(seed)
    t, q, v = stepper.initial_state()
    n = stepper.sizes
    return {
        "t": t + rng.uniform(0.1, 1),
        "q": q + rng.normal(size=n["n_q"]) * 0.3,
        "v": v + rng.normal(size=n["n_q"]),
        "u": rng.normal(size=n["n_u"]),
        "R": rng.normal(size=n["n_R"]),
    }


def reference_values(model: sg.Model, at: dict, par: list[float]) -> dict[str, np.ndarray]:
    """Every public function from the user's expressions."""
    e = Expressions(model, high=True)
    with mp.workdps(50):
        state = (at["t"], at["q"], at["v"], at["u"], par)

        def slope_in(function: Callable[..., np.ndarray], which: int) -> np.ndarray:
            """Central difference of step 1e-15 in 50 digits."""
            step = mp.mpf(10) ** -15
            columns = []
            for k in range(e.n_q):
                plus, minus = [list(np.atleast_1d(s)) for s in state], None
                minus = [list(row) for row in plus]
                plus[which][k] = mp.mpf(plus[which][k]) + step
                minus[which][k] = mp.mpf(minus[which][k]) - step
                unpack = [[row[0][0], *row[1:]] for row in (plus, minus)]
                columns.append((function(*unpack[0]) - function(*unpack[1])) / (2 * step))
            return np.array(columns).T

        R = np.array([mp.mpf(x) for x in at["R"]])
        n_g, n_gamma, n_N = e.n["g"], e.n["gamma"], e.n["g_N"]
        W = e.W(*state)
        rest = (at["t"], at["q"], np.zeros(e.n_q), at["u"], par)
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
            "e_N": e.value("e_N", *state),
            "e_F": e.value("e_F", *state),
            "WR": W @ R,
            "WR_q": slope_in(lambda *a: e.W(*a) @ R, 1),
            "outputs": e.value("outputs", *state),
        }
        return {name: np.array(value, dtype=float) for name, value in values.items()}


@pytest.mark.parametrize(
    "model", MODELS, ids=lambda m: m.__module__.split(".")[-1] + "." + m.__name__
)
@pytest.mark.parametrize("seed", [0, 1])
def test_functions(
    model: Callable[[], sg.Model], seed: int, stepper: Callable[..., sg.Stepper]
) -> None:
    compiled = stepper(model)
    at = draw(compiled, seed)
    expected = reference_values(model(), at, list(compiled.parameters.values()))
    assert set(compiled.functions) <= set(expected)
    for name in compiled.functions:
        value = compiled.evaluate(name, at["t"], at["q"], at["v"], at["u"], R=at["R"])
        other = expected[name].reshape(np.shape(value))
        scale = max(1.0, np.max(np.abs(other), initial=0))
        np.testing.assert_allclose(value, other, rtol=0, atol=1e-13 * scale, err_msg=name)
