"""Derived functions of a model, each requested by name.

A name is a base quantity with derivative suffixes: ``g_N_q`` is the Jacobian of ``g_N`` in q,
``p_v`` the mass matrix, ``W_N`` the force directions, ``F_q`` the derivative of the stage force.
"""

from dataclasses import dataclass

import casadi as ca
from signorini.codegen.derive.magnitude import magnitude
from signorini.codegen.frontend import table
from signorini.codegen.frontend.model_data import ModelData


@dataclass(frozen=True)
class Quantity:
    """A base quantity: what it is, for headers and documentation."""

    equation: str
    doc: str


QUANTITIES: dict[str, Quantity] = {
    "L": Quantity("L(t, q, v) = T - V", "Lagrangian"),
    "energy": Quantity("E = p^T v - L", "energy"),
    "p": Quantity("p = (dL/dv)^T  (6)", "generalized momenta"),
    "L_q": Quantity("(dL/dq)^T", "generalized forces contained in L"),
    "force_size": Quantity(
        "|(dL/dq)^T| + |f| + |W_F| bound, term by term",
        "size of all forces that can act in a row, before they cancel",
    ),
    "bound_force": Quantity("|W_F| max(bound, 0)", "largest forces of the friction elements"),
    "force": Quantity(
        "dL/dq + f - p_q v - p_t", "what changes the velocities, with p_v dv/dt on the other side"
    ),
    "f": Quantity("f(t, q, v, u)", "generalized forces that L does not contain"),
    "g": Quantity("g(t, q) = 0  (13)", "position constraints"),
    "g_dot": Quantity("g_dot = W_g^T v + dg/dt", "velocities of the position constraints"),
    "g_rate": Quantity("dg_dot/dq v + dg_dot/dt", "part of g's second derivative without dv/dt"),
    "gamma_rate": Quantity("dgamma/dq v + dgamma/dt", "part of dgamma/dt without dv/dt"),
    "g_N_rate": Quantity(
        "dg_N_dot/dq v + dg_N_dot/dt", "part of g_N's second derivative without dv/dt"
    ),
    "gamma_F_rate": Quantity("dgamma_F/dq v + dgamma_F/dt", "part of dgamma_F/dt without dv/dt"),
    "gamma": Quantity("gamma = W_gamma^T v + chi_gamma = 0  (13)", "velocity constraints"),
    "g_N": Quantity("g_N(t, q) >= 0", "gaps"),
    "g_N_dot": Quantity("g_N_dot = W_N^T v + dg_N/dt", "normal velocities"),
    "gamma_F": Quantity("gamma_F = W_F^T v + chi_F", "slip velocities"),
    "bound": Quantity("bound(t, q, u)", "largest forces of the friction elements"),
    "outputs": Quantity("outputs", "the model's named outputs"),
    "shapes": Quantity("shapes(t, q)", "points of what is drawn, a row each"),
    "W_g": Quantity("W_g = (dg/dq)^T  (14)", "force directions of the position constraints"),
    "W_gamma": Quantity("W_gamma = (dgamma/dv)^T  (14)", "directions of the velocity constraints"),
    "W_N": Quantity("W_N = (dg_N/dq)^T", "normal force directions"),
    "W_F": Quantity("W_F = (dgamma_F/dv)^T", "friction force directions"),
    "chi_g": Quantity("chi_g = dg/dt", "part of g_dot without v"),
    "chi_gamma": Quantity("chi_gamma = gamma(t, q, 0)", "part of gamma without v"),
    "chi_N": Quantity("chi_N = dg_N/dt", "part of g_N_dot without v"),
    "chi_F": Quantity("chi_F = gamma_F(t, q, 0)", "part of gamma_F without v"),
    "W": Quantity("W = (W_g W_gamma W_N W_F)  (12)", "all force directions"),
    "WR": Quantity("W(t, q) R", "force of given percussions"),
    "F": Quantity("F = h (dL/dq)^T + h f + W R  (63)", "percussion of all forces at a stage"),
    "rho": Quantity("rho = h max(bound, 0)", "radii of the friction elements"),
    "mu": Quantity("mu", "friction coefficients"),
    "mu_F": Quantity("mu_F", "friction coefficient of every slip component, if some differ"),
    "e_N": Quantity("e_N", "normal restitution"),
    "e_F": Quantity("e_F", "tangential restitution"),
    "compliance": Quantity("compliance", "compliances of the rows that yield"),
    "relaxation": Quantity("relaxation", "damping over stiffness of the rows that yield"),
    "slack": Quantity("g, g_N", "of the rows that yield"),
    "guard": Quantity("guard(t, q) >= 0", "whether a contact exists"),
}

# The others are columns.
MATRICES = frozenset({"W_g", "W_gamma", "W_N", "W_F", "W", "shapes"})


class Derivation:
    """The derived functions of one model, computed once each, as SX.

    Attributes
    ----------
    h : SX
        Symbol of the step size.
    R : SX, shape (n_g + n_gamma + n_N + n_F, 1)
        Symbols of the percussions of one stage: R_g, R_gamma, R_N, R_F.
    """

    def __init__(self, data: ModelData) -> None:
        self.data = data
        self.h = ca.SX.sym("h")
        n_R = data.n_g + data.n_gamma + data.n_N + data.n_F
        self.R = ca.vertcat(ca.SX(0, 1), *(ca.SX.sym(f"R[{k}]") for k in range(n_R)))
        self._cache: dict[str, ca.SX] = {}

    def __getitem__(self, name: str) -> ca.SX:
        """Return a quantity or any derivative of one, e.g. ``"g_N_q"``, sparsity kept."""
        if name not in self._cache:
            self._cache[name] = self._derive(name)
        return self._cache[name]

    @property
    def with_bound(self) -> list[int]:
        """Indices of the contacts that are friction elements with a given bound."""
        return [k for k, c in enumerate(self.data.contacts) if c.bound is not None]

    def _derive(self, name: str) -> ca.SX:
        if name in QUANTITIES:
            value: ca.SX = getattr(self, f"_{name}")()
            return value
        stem, _, variable = name.rpartition("_")
        variables = {
            "q": self.data.q,
            "v": self.data.v,
            "t": self.data.t,
            "u": self.data.u,
            "par": self.data.par,
        }
        if not stem or variable not in variables:
            raise KeyError(f"no derived function '{name}'")
        return ca.sparsify(table.without_rates(ca.jacobian(self[stem], variables[variable])))

    # --- base quantities -------------------------------------------------------------------------

    def _column(self, rows: list[ca.SX]) -> ca.SX:
        return ca.vertcat(ca.SX(0, 1), *rows)

    def _L(self) -> ca.SX:
        return self.data.L

    def _energy(self) -> ca.SX:
        return ca.dot(self["p"], self.data.v) - self.data.L

    def _gradient(self, x: ca.SX) -> ca.SX:
        return ca.densify(table.without_rates(ca.gradient(self.data.L, x)))

    def _p(self) -> ca.SX:
        return self._gradient(self.data.v)

    def _L_q(self) -> ca.SX:
        return self._gradient(self.data.q)

    def _force_size(self) -> ca.SX:
        size = magnitude(self["L_q"]) + magnitude(ca.densify(self["f"]))
        return size + self["bound_force"]

    def _bound_force(self) -> ca.SX:
        # friction with a given bound may be the only force there is
        size = ca.SX.zeros(self.data.n_q, 1)
        first = bound = 0
        for c in self.data.contacts:
            if c.bound is not None:
                radius = self["bound"][bound]
                directions = ca.fabs(ca.densify(self["W_F"][:, first : first + c.n_F]))
                size += ca.sum2(directions) * ca.if_else(radius > 0, radius, 0)
                bound += 1
            first += c.n_F
        return size

    def _force(self) -> ca.SX:
        return ca.densify(self["L_q"] + self["f"] - self["p_q"] @ self.data.v - self["p_t"])

    def _f(self) -> ca.SX:
        return self.data.f

    def _g(self) -> ca.SX:
        return self.data.g

    def _g_dot(self) -> ca.SX:
        return self["g_q"] @ self.data.v + self["chi_g"]

    def _g_rate(self) -> ca.SX:
        return ca.densify(self["g_dot_q"] @ self.data.v + self["g_dot_t"])

    def _gamma_rate(self) -> ca.SX:
        return ca.densify(self["gamma_q"] @ self.data.v + self["gamma_t"])

    def _g_N_rate(self) -> ca.SX:
        return ca.densify(self["g_N_dot_q"] @ self.data.v + self["g_N_dot_t"])

    def _gamma_F_rate(self) -> ca.SX:
        return ca.densify(self["gamma_F_q"] @ self.data.v + self["gamma_F_t"])

    def _gamma(self) -> ca.SX:
        return self.data.gamma

    def _g_N(self) -> ca.SX:
        return self._column([c.g_N for c in self.data.contacts if c.g_N is not None])

    def _g_N_dot(self) -> ca.SX:
        if self.one_way:
            return ca.densify(self["W_N"].T @ self.data.v + self["chi_N"])
        return self["g_N_q"] @ self.data.v + self["chi_N"]

    @property
    def one_way(self) -> list[bool]:
        """Which normal rows are velocities; empty if none is."""
        rows = [c.one_way for c in self.data.contacts if c.g_N is not None]
        return rows if any(rows) else []

    def _gamma_F(self) -> ca.SX:
        return self._column([c.gamma_F for c in self.data.contacts])

    def _bound(self) -> ca.SX:
        return self._column([c.bound for c in self.data.contacts if c.bound is not None])

    def _shapes(self) -> ca.SX:
        return self.data.places

    def _outputs(self) -> ca.SX:
        return self._column([expr for _, expr in self.data.outputs])

    def _W_g(self) -> ca.SX:
        return self["g_q"].T

    def _W_gamma(self) -> ca.SX:
        return self._at_rest(self["gamma_v"]).T

    def _W_N(self) -> ca.SX:
        if not self.one_way:
            return self["g_N_q"].T
        places, velocities = self["g_N_q"], self._at_rest(self["g_N_v"])
        rows = [velocities[k, :] if x else places[k, :] for k, x in enumerate(self.one_way)]
        return ca.sparsify(ca.vertcat(*rows)).T

    def _W_F(self) -> ca.SX:
        return self._at_rest(self["gamma_F_v"]).T

    def _chi_g(self) -> ca.SX:
        return ca.densify(self["g_t"])

    def _chi_gamma(self) -> ca.SX:
        return self._at_rest(self["gamma"])

    def _chi_N(self) -> ca.SX:
        rows = ca.densify(self["g_N_t"])
        for k, is_velocity in enumerate(self.one_way):
            if is_velocity:
                rows[k] = self._at_rest(self["g_N"][k])
        return rows

    def _chi_F(self) -> ca.SX:
        return self._at_rest(self["gamma_F"])

    def _at_rest(self, expr: ca.SX) -> ca.SX:
        v = self.data.v
        return ca.sparsify(ca.substitute(expr, v, ca.SX.zeros(v.numel(), 1)))

    def _W(self) -> ca.SX:
        return ca.horzcat(self["W_g"], self["W_gamma"], self["W_N"], self["W_F"])

    def _WR(self) -> ca.SX:
        if not self.R.numel():
            return ca.SX.zeros(self.data.n_q, 1)
        return ca.densify(self["W"] @ self.R)

    def _F(self) -> ca.SX:
        return self.h * (self["L_q"] + self["f"]) + self["WR"]

    def _rho(self) -> ca.SX:
        bound = self["bound"]
        given = [self.h * ca.if_else(bound[k] > 0, bound[k], 0) for k in range(bound.numel())]
        varying = [x for c in self.data.contacts if c.varies for x in (c.mu, ca.SX(0))]
        return self._column([*given, *varying])

    @property
    def varying(self) -> list[tuple[int, int, int]]:
        """Contact, its place in rho, and the normal row that presses it, of coefficients that are
        taken at the stages."""
        place = sum(c.bound is not None for c in self.data.contacts)
        found, normal = [], 0
        for k, c in enumerate(self.data.contacts):
            if c.varies:
                found.append((k, place, normal))
                place += 2
            normal += c.g_N is not None
        return found

    def _mu(self) -> ca.SX:
        return self._column([c.mu for c in self.data.contacts])

    def _mu_F(self) -> ca.SX:
        contacts = self.data.contacts
        if all(c.mu_F is None for c in contacts):
            return ca.SX(0, 1)
        each = [c.mu if c.mu_F is None else c.mu_F[d] for c in contacts for d in range(c.n_F)]
        return self._column(each)

    def _e_N(self) -> ca.SX:
        return self._column([c.e_N for c in self.data.contacts])

    def _e_F(self) -> ca.SX:
        return self._column([c.e_F for c in self.data.contacts])

    @property
    def rigid_directions(self) -> ca.SX:
        """W_g and W_gamma, without those of rows that yield."""
        W = ca.densify(ca.horzcat(self["W_g"], self["W_gamma"]))
        for c in self.data.compliances:
            if not c.normal:
                W[:, c.row] = 0
        return W

    def _compliance(self) -> ca.SX:
        return self._column([c.compliance for c in self.data.compliances])

    def _slack(self) -> ca.SX:
        gaps = ca.vertcat(ca.SX(0, 1), self["g_N"])
        first = self.data.n_g + self.data.n_gamma
        return self._column(
            [gaps[c.row - first] if c.normal else self.data.g[c.row] for c in self.data.compliances]
        )

    def _relaxation(self) -> ca.SX:
        return self._column([c.relaxation for c in self.data.compliances])

    def _guard(self) -> ca.SX:
        return self._column([ca.SX(0) if c.guard is None else c.guard for c in self.data.contacts])
