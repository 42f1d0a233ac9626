"""Model functions that a user gets, whatever the target."""

import casadi as ca
from signorini.codegen.frontend.model_data import ModelData

# Name of each and its arguments besides the parameters; those without entries are left out.
PUBLIC: tuple[tuple[str, str], ...] = (
    ("L", "tqv"),
    ("energy", "tqv"),
    ("p", "tqv"),
    ("p_q", "tqv"),
    ("p_v", "tqv"),
    ("L_q", "tqv"),
    ("L_q_q", "tqv"),
    ("L_q_v", "tqv"),
    ("f", "tqvu"),
    ("f_q", "tqvu"),
    ("f_v", "tqvu"),
    ("g", "tq"),
    ("g_dot", "tqv"),
    ("W_g", "tq"),
    ("chi_g", "tq"),
    ("gamma", "tqv"),
    ("gamma_q", "tqv"),
    ("W_gamma", "tq"),
    ("chi_gamma", "tq"),
    ("g_N", "tq"),
    ("g_N_dot", "tqv"),
    ("W_N", "tq"),
    ("chi_N", "tq"),
    ("gamma_F", "tqv"),
    ("gamma_F_q", "tqv"),
    ("W_F", "tq"),
    ("chi_F", "tq"),
    ("bound", "tqu"),
    ("guard", "tq"),
    ("mu", ""),
    ("mu_F", ""),
    ("e_N", ""),
    ("e_F", ""),
    ("compliance", ""),
    ("relaxation", ""),
    ("WR", "tqR"),
    ("WR_q", "tqR"),
    ("outputs", "tqvu"),
    ("shapes", "tq"),
)


def arguments_of(declared: str, value: ca.SX, data: ModelData) -> tuple[str, ...]:
    """Arguments of a public function: those declared, and what else of t, q, v, u it depends on."""
    symbols = {"t": data.t, "q": data.q, "v": data.v, "u": data.u}
    needed = {name for name, column in symbols.items() if ca.depends_on(value, column)}
    return tuple(name for name in "tqvuR" if name in declared or name in needed)


# Where steps are differentiated: how what holds at a start changes, and what the model puts out.
SLOPES: tuple[tuple[str, str], ...] = (
    ("g_par", "tq"),
    *((f"{name}_{by}", "tqv") for name in ("g_dot", "g_N_dot") for by in ("t", "q", "par")),
    *((f"{name}_{by}", "tqv") for name in ("gamma", "gamma_F") for by in ("t", "par")),
    ("g_N_par", "tq"),
    *((f"outputs_{by}", "tqvu") for by in ("t", "q", "v", "u", "par")),
)
