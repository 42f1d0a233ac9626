"""Checks a declared model and freezes it; every error names equation, symbol and remedy."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
from signorini.codegen.frontend import table
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import ContactDeclaration, Model
from signorini.codegen.frontend.model_data import Contact, ModelData, Parameter
from signorini.codegen.frontend.operations import BY_NUMBER, PLUMBING
from signorini.codegen.frontend.symbols import is_number
from signorini.codegen.frontend.table import Table

# Operations of CasADi without a counterpart in C99.
_NOT_IN_C = {ca.OP_ERFINV: "erfinv", ca.OP_PRINTME: "printme", ca.OP_LIFT: "lift"}
_SINGULAR = 1e-11  # reciprocal condition of an equilibrated Hessian below which it is singular
_PROBES = 8


def freeze(model: Model) -> ModelData:
    """Check `model` and return it as frozen `ModelData`.

    Raises
    ------
    ModelError
        Naming the model, the equation, the symbol or value, and what to do.
    """
    if not isinstance(model, Model):
        raise ModelError(
            getattr(model, "__name__", str(model)),
            "what was given as a model",
            f"is of type {type(model).__name__}",
            "Give a signorini.Model, e.g. what the function model() returns",
        )
    return _Freezer(model).freeze()


class _Freezer:
    def __init__(self, model: Model) -> None:
        self.model = model
        self.name = model.name
        self.t = self._symbols([model.time])
        self.q = self._symbols(model.q)
        self.v = self._symbols(model.v)
        self.par = self._symbols(model.par)
        self.u = self._symbols(model.u)
        self.slips: list[tuple[str, ca.SX]] = []
        self.tables: list[tuple[str, Table]] = []

    def _symbols(self, symbols: list[Any]) -> ca.SX:
        world = self.model.world
        column = [world.to_sx(self.name, "declared symbols", s) for s in symbols]
        return ca.vertcat(ca.SX(0, 1), *column)

    def freeze(self) -> ModelData:
        model = self.model
        if not model.q:
            raise ModelError(
                self.name, "coordinates", "there are none", 'Declare them: m.coordinates("x y")'
            )
        if model.L is None:
            raise ModelError(
                self.name, "lagrangian", "it is missing", "Assign m.lagrangian = T - V"
            )
        L = self.scalar("the Lagrangian L", model.L, "tqvp", smooth=True)
        shapes, places = self.drawing()
        data = ModelData(
            name=self.name,
            symbols=model.world.name,
            t=self.t,
            q=self.q,
            v=self.v,
            u=self.u,
            par=self.par,
            coordinates=tuple(model.coordinate_names),
            velocities=tuple(model.velocity_names),
            units=tuple(model.coordinate_units),
            inputs=tuple(model.input_names),
            parameters=tuple(
                Parameter(
                    name,
                    float(p.default),
                    p.unit,
                    None if p.min is None else float(p.min),
                    None if p.max is None else float(p.max),
                    p.doc,
                )
                for name, p in model.parameter_table.items()
            ),
            L=L,
            f=self.force(),
            g=self.blocks("constraint", model.constraints),
            gamma=self.blocks("velocity_constraint", model.velocity_constraints),
            g_blocks=tuple((name, len(e)) for name, e in model.constraints),
            gamma_blocks=tuple((name, len(e)) for name, e in model.velocity_constraints),
            contacts=tuple(self.contact(c) for c in model.contacts),
            outputs=tuple(
                (name, self.scalar(f"output '{name}'", e, "tqvup")) for name, e in model.outputs
            ),
            shapes=shapes,
            places=places,
            tables=(),
            doc=model.doc,
            dt=model.suggested.get("dt", 1e-3),
            t_end=model.suggested.get("t_end", 1.0),
            **self.start(),
        )
        data = replace(data, tables=tuple(self.tables))
        for equation, sx in self.slips:
            _check_affine(data, equation, sx)
        _check_mass_matrix(data)
        _check_start_values(data)
        _check_constraints(data)
        return data

    # --- pieces ----------------------------------------------------------------------------------

    def scalar(self, equation: str, expr: Any, depends: str, smooth: bool = False) -> ca.SX:
        """Translate one expression; `depends` lists what it may depend on (t, q, v, u, p)."""
        world = self.model.world
        sx = world.to_sx(self.name, equation, expr)
        self._check_numbers(equation, sx)
        for letter, column, what, remedy in (
            ("t", self.t, "time", "It must not depend on time"),
            ("q", self.q, "coordinate", "It must not depend on coordinates"),
            ("v", self.v, "velocity", _REMEDY_GAP if "g_N" in equation else _REMEDY_V),
            ("u", self.u, "input", "Only forces, bounds and outputs may depend on inputs"),
        ):
            if letter not in depends and ca.depends_on(sx, column):
                names = [x.name() for x in ca.vertsplit(column) if ca.depends_on(sx, x)]
                raise ModelError(self.name, equation, f"depends on the {what} '{names[0]}'", remedy)
        if smooth:
            part = world.nonsmooth_part(expr, self.model.par)
            if part is not None:
                raise ModelError(
                    self.name,
                    equation,
                    f"contains {part}, which is not twice continuously differentiable",
                    "Rewrite it, or vouch for two continuous derivatives with sg.smooth(...)",
                )
        return sx

    def _check_numbers(self, equation: str, sx: ca.SX) -> None:
        f = ca.Function("f", [ca.vertcat(*ca.symvar(sx))], [sx])
        for k in range(f.n_instructions()):
            op = f.instruction_id(k)
            if op == ca.OP_CALL:
                called = table.known(f.instructions_sx()[k].which_function().name())
                if called is not None:
                    self._take_table(equation, called)
                    continue
                raise ModelError(
                    self.name,
                    equation,
                    "contains the call of a CasADi function that is not made of elementary "
                    "operations, an interpolant for example",
                    "Expand it into SX with f.expand() where that is possible, or write the "
                    "function out; values between measured points come from sg.table",
                )
            if op not in BY_NUMBER and op not in PLUMBING:
                raise ModelError(
                    self.name,
                    equation,
                    f"contains {_NOT_IN_C.get(op, f'the operation {op} of CasADi')}",
                    "C99 has no such function: write it with elementary ones",
                )
            if op == ca.OP_CONST and not np.isfinite(f.instruction_constant(k)):
                raise ModelError(
                    self.name,
                    equation,
                    f"contains the number {f.instruction_constant(k)}",
                    "Every number must be finite",
                )

    def _take_table(self, equation: str, taken: Table) -> None:
        if any(t is taken or t.function == taken.function for _, t in self.tables):
            return
        name = taken.name or f"table_{len(self.tables) + 1}"
        if any(name == other for other, _ in self.tables):
            raise ModelError(
                self.name,
                equation,
                f"contains a second table called '{name}'",
                "Give every table a name of its own",
            )
        self.tables.append((name, taken))

    def drawing(self) -> tuple[tuple[tuple[str, str, int], ...], ca.SX]:
        """What is drawn: kinds, names and counts, and all points in rows."""
        things = self.model.drawing.wanted()
        points = [(thing, point) for thing in things for point in thing.points]
        dimensions = sorted({len(point) for _, point in points})
        rows = []
        for thing, point in points:
            what = f"the drawing of '{thing.name}'" if thing.name else "shape"
            if len(point) not in (2, 3) or len(dimensions) > 1:
                raise ModelError(
                    self.name,
                    what,
                    f"has points of {' and '.join(map(str, dimensions))} components",
                    "Give all points of a model two components, or all three",
                )
            rows.append(ca.horzcat(*(self.scalar(what, x, "tqp") for x in point)))
        shapes = tuple((thing.kind, thing.name, len(thing.points)) for thing in things)
        return shapes, ca.vertcat(*rows) if rows else ca.SX(0, 2)

    def force(self) -> ca.SX:
        total = ca.SX.zeros(len(self.model.q), 1)
        for entries in self.model.forces:
            for k, (name, entry) in enumerate(
                zip(self.model.coordinate_names, entries, strict=True)
            ):
                total[k] += self.scalar(f"the force on '{name}'", entry, "tqvup")
        return total

    def blocks(self, kind: str, blocks: list[tuple[str, list[Any]]]) -> ca.SX:
        rows = []
        for name, expressions in blocks:
            if not expressions:
                raise ModelError(
                    self.name, f"{kind} '{name}'", "has no equation", "Give at least one"
                )
            for k, expr in enumerate(expressions):
                equation = f"{kind} '{name}'" + (f" [{k}]" if len(expressions) > 1 else "")
                if kind == "constraint":
                    rows.append(self.scalar(equation, expr, "tqp", smooth=True))
                    self._check_depends(equation, rows[-1], self.q, "coordinate")
                else:
                    rows.append(self.affine(equation, expr))
        return ca.vertcat(ca.SX(0, 1), *rows)

    def affine(self, equation: str, expr: Any) -> ca.SX:
        sx = self.scalar(equation, expr, "tqvp")
        self.slips.append((equation, sx))
        self._check_depends(equation, sx, self.v, "velocity")
        return sx

    def _check_depends(self, equation: str, sx: ca.SX, column: ca.SX, what: str) -> None:
        if not ca.depends_on(sx, column):
            raise ModelError(
                self.name,
                equation,
                f"contains no {what}",
                "It restricts nothing: leave it out or correct it",
            )

    def contact(self, c: ContactDeclaration) -> Contact:
        where = f"{c.kind} '{c.name}'"
        g_N = bound = guard = None
        if c.g_N is not None:
            if isinstance(c.g_N, (list, tuple)):
                raise ModelError(
                    self.name, f"g_N of {where}", "is a list", "Give one gap for each contact"
                )
            g_N = self.scalar(f"g_N of {where}", c.g_N, "tqp", smooth=True)
            self._check_depends(f"g_N of {where}", g_N, self.q, "coordinate")
        else:
            bound = self.scalar(f"bound of {where}", c.bound, "tqup")
            if is_number(c.bound) and float(c.bound) < 0:
                raise ModelError(
                    self.name, f"bound of {where}", f"is {c.bound}", "A friction bound is >= 0"
                )
        if c.guard is not None:
            guard = self.scalar(f"guard of {where}", c.guard, "tqp")
        rows = [
            self.affine(f"gamma_F of {where}" + (f" [{k}]" if len(c.gamma_F) > 1 else ""), e)
            for k, e in enumerate(c.gamma_F)
        ]
        laws = {
            law: self.coefficient(f"{law} of {where}", value, 1.0)
            for law, value in (("e_N", c.e_N), ("e_F", c.e_F))
        }
        mu_F = None
        if isinstance(c.mu, (list, tuple)) and len(c.mu) == 1:
            raise ModelError(
                self.name,
                f"mu of {where}",
                f"is a tuple of one, ({c.mu[0]},)",
                "Write (mu,) = m.parameters(mu=...), with the comma: parameters come as a tuple",
            )
        if isinstance(c.mu, (list, tuple)):
            mu_F = self.coefficients(f"mu of {where}", c.mu, len(rows))
            laws["mu"] = ca.fmax(mu_F[0], mu_F[1])
        else:
            laws["mu"] = self.coefficient(f"mu of {where}", c.mu, None)
        return Contact(
            name=c.name,
            g_N=g_N,
            gamma_F=ca.vertcat(ca.SX(0, 1), *rows),
            bound=bound,
            guard=guard,
            mu_F=mu_F,
            **laws,
        )

    def coefficient(self, equation: str, value: Any, top: float | None) -> ca.SX:
        """A coefficient of a law: at least zero, at most `top`."""
        if is_number(value):
            number = float(value)
            if not number >= 0 or (top is not None and number > top):
                allowed = "a friction coefficient is >= 0" if top is None else "it lies in [0, 1]"
                raise ModelError(self.name, equation, f"is {number:g}", allowed.capitalize())
            if np.isfinite(number):
                return ca.SX(number)
        return self.scalar(equation, value, "p")

    def coefficients(self, equation: str, pair: Sequence[Any], n_F: int) -> ca.SX:
        """Friction coefficients of both slip components."""
        if len(pair) != 2 or n_F != 2:
            raise ModelError(
                self.name,
                equation,
                f"has {len(pair)} entries for {n_F} slip component{'' if n_F == 1 else 's'}",
                "Give one coefficient, or a pair for a slip velocity of two components",
            )
        if any(is_number(value) and float(value) == 0 for value in pair) and not all(
            is_number(value) and float(value) == 0 for value in pair
        ):
            raise ModelError(
                self.name,
                equation,
                "is zero for one component alone",
                "Give positive coefficients; where one direction slides freely, leave its slip "
                "component out of gamma_F",
            )
        return ca.vertcat(*(self.coefficient(equation, value, None) for value in pair))

    def start(self) -> dict[str, ca.SX]:
        start = self.model.start
        if start is None:
            raise ModelError(
                self.name,
                "initial_state",
                "it is missing",
                "Call m.initial_state(q=[...], v=[...])",
            )
        columns = {}
        for key, letter, names in (
            ("q", "q0", self.model.coordinate_names),
            ("v", "v0", self.model.velocity_names),
        ):
            if len(start[key]) != len(names):
                raise ModelError(
                    self.name,
                    f"initial_state({key}=...)",
                    f"has {len(start[key])} entries for {len(names)} coordinates",
                    "Call initial_state after all coordinates are declared",
                )
            columns[letter] = ca.vertcat(
                ca.SX(0, 1),
                *(
                    self.scalar(f"the initial value of '{name}'", entry, "p")
                    for name, entry in zip(names, start[key], strict=True)
                ),
            )
        columns["t0"] = self.scalar("the initial time", start["t"], "p")
        return columns


_REMEDY_GAP = "A gap holds coordinates and time only; a velocity goes into gamma_F"
_REMEDY_V = "Gaps and position constraints hold coordinates only: use a velocity_constraint"


def _check_affine(data: ModelData, equation: str, sx: ca.SX) -> None:
    """Raise unless `sx` is affine in v where the model lives: at its start and around it."""
    curvature = ca.hessian(sx, data.v)[0]
    if curvature.nnz() == 0:
        return
    # Structure alone cannot see (v + 1)^2 - v^2; numbers can.
    f = ca.Function("f", [data.t, data.q, data.v, data.par], [curvature, ca.jacobian(sx, data.v)])
    par = np.array([p.default for p in data.parameters])
    t0, q0, v0 = _numbers(data, par)
    rng = np.random.default_rng(0)
    reach = np.maximum(np.abs(q0), 1.0)
    seen = False
    for k in range(4 * _PROBES):
        # narrow and wide around the start, then anywhere near one
        q = q0 + (0.1 if k % 2 else 1.0) * reach * rng.uniform(-1, 1, q0.size)
        v = v0 + rng.uniform(-1, 1, v0.size)
        if k >= 3 * _PROBES:
            q, v = (rng.uniform(0.3, 1.7, x.size) for x in (q0, v0))
        draw = (t0, q0, v, par) if k == 0 else (t0 + rng.uniform(0, 1), q, v, par)
        H, W = (np.asarray(x) for x in f(*draw))
        if not (np.all(np.isfinite(H)) and np.all(np.isfinite(W))):
            continue
        seen = True
        scale = np.max(np.abs(W), initial=0.0)
        if np.max(np.abs(H), initial=0.0) > 1e-9 * max(scale, 1e-300):
            i, _j = np.unravel_index(int(np.argmax(np.abs(H))), H.shape)
            raise ModelError(
                data.name,
                equation,
                f"is not affine in the velocity '{data.velocities[int(i)]}'",
                "Write it as W(t, q)^T v + chi(t, q)",
            )
    if not seen:
        raise ModelError(
            data.name,
            equation,
            "could not be tested for being affine in the velocities: it is no number at the "
            "initial state and wherever tried around it",
            "Write it as W(t, q)^T v + chi(t, q), without powers or functions of velocities",
        )


def _check_constraints(data: ModelData) -> None:
    """Raise if the initial state breaks a constraint or penetrates a contact, before generation."""
    par = np.array([p.default for p in data.parameters])
    t0, q0, v0 = _numbers(data, par)
    g_q, gamma_v = ca.jacobian(data.g, data.q), ca.jacobian(data.gamma, data.v)
    chi = ca.jacobian(data.g, data.t)
    rest = ca.substitute(data.gamma, data.v, ca.SX.zeros(data.n_q, 1))
    at = [data.t, data.q, data.v, data.par]
    f = ca.Function("f", at, [data.g, g_q, chi, data.gamma, gamma_v, rest])
    g, W_g, g_t, gamma, W_gamma, chi_gamma = (np.asarray(x) for x in f(t0, q0, v0, par))
    names = [(n, "g") for n in _row_names(data.g_blocks)]
    rows = [
        *zip(names, g.ravel(), np.abs(W_g) @ np.abs(q0), strict=True),
        *zip(
            [(n, "its velocity g_dot") for n, _ in names],
            (W_g @ v0 + g_t.ravel()) if names else [],
            (np.abs(W_g) @ np.abs(v0) + np.abs(g_t.ravel())) if names else [],
            strict=True,
        ),
        *zip(
            [(n, "gamma") for n in _row_names(data.gamma_blocks)],
            gamma.ravel(),
            np.abs(W_gamma) @ np.abs(v0) + np.abs(chi_gamma.ravel()),
            strict=True,
        ),
    ]
    for c in data.contacts:
        if c.g_N is None:
            continue
        exists = c.guard if c.guard is not None else ca.SX(1)
        gap, W, there = (
            np.asarray(x).ravel()
            for x in ca.Function("f", at, [c.g_N, ca.jacobian(c.g_N, data.q), exists])(
                t0, q0, v0, par
            )
        )
        if there[0] >= 0 and gap[0] < 0:
            rows.append(((c.name, "the gap g_N"), gap[0], float(np.abs(W) @ np.abs(q0))))
    for (name, what), value, size in rows:
        if not abs(value) <= 2.0**-11 * size + 2.0**-17:
            raise ModelError(
                data.name,
                "initial_state",
                f"{what} of '{name}' is {value:.6g} there, with the default parameters",
                "Give a state that satisfies all constraints and does not penetrate; for a state "
                "near one, stepper.project(q0, v0) finds it",
            )


def _row_names(blocks: tuple[tuple[str, int], ...]) -> list[str]:
    return [name if n == 1 else f"{name}[{k}]" for name, n in blocks for k in range(n)]


def _check_mass_matrix(data: ModelData) -> None:
    """Raise if the Hessian of L in v is singular at the initial state or wherever probed."""
    M = ca.Function("M", [data.t, data.q, data.v, data.par], [ca.hessian(data.L, data.v)[0]])
    equation = "the Lagrangian L"
    present = set(M.sparsity_out(0).row())
    for k, name in enumerate(data.velocities):
        if k not in present:
            raise ModelError(
                data.name,
                equation,
                f"its Hessian in v is singular: L does not contain the square of '{name}'",
                "Give every coordinate a mass or an inertia",
            )
    par = np.array([p.default for p in data.parameters])
    t0, q0, v0 = _numbers(data, par)
    rng = np.random.default_rng(1)
    draws = [(q0, v0)] + [
        (q0 + rng.uniform(-0.5, 0.5, q0.size), v0 + rng.uniform(-0.5, 0.5, v0.size))
        for _ in range(_PROBES)
    ]
    singular = [_singular_direction(np.asarray(M(t0, q, v, par))) for q, v in draws]
    if singular[0] is None:
        _check_sign(data, np.asarray(M(t0, q0, v0, par)))
        return
    names = [data.velocities[k] for k in singular[0]]
    where = (
        "at every state tried" if all(s is not None for s in singular) else "at the initial state"
    )
    raise ModelError(
        data.name,
        equation,
        f"its Hessian in v (the mass matrix) is singular {where}, in the directions of "
        + ", ".join(f"'{n}'" for n in names),
        "Give these velocities inertia; for a unit quaternion p add c*(p.p_dot)^2 with c of the "
        "size of the inertia to T, a term that vanishes on the constraint",
    )


def _check_sign(data: ModelData, M: np.ndarray) -> None:
    """Raise if the kinetic energy falls with a velocity."""
    for k, name in enumerate(data.velocities):
        if M[k, k] < 0:
            negative = [p for p in data.parameters if p.default < 0]
            because = f": {negative[0].name} = {negative[0].default:g}" if negative else ""
            raise ModelError(
                data.name,
                "the Lagrangian L",
                f"its Hessian in v is negative for '{name}'{because}",
                "Give masses and inertias > 0, and check the sign of T in L = T - V",
            )


def _singular_direction(M: np.ndarray) -> list[int] | None:
    """Indices that take part in the null space of M, or None if M is regular."""
    if not np.all(np.isfinite(M)):
        return None  # reported with its value by the check of the initial values
    d = np.sqrt(np.abs(np.diag(M)))
    d[d == 0] = np.sqrt(np.max(np.abs(M), initial=0.0)) or 1.0
    scaled = M / np.outer(d, d)
    _, sigma, vt = np.linalg.svd(scaled)
    if sigma[-1] > _SINGULAR * sigma[0]:
        return None
    return [int(k) for k in np.flatnonzero(np.abs(vt[-1]) > 0.1)]


def _numbers(data: ModelData, par: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    f = ca.Function("start", [data.par], [data.t0, data.q0, data.v0])
    t0, q0, v0 = f(par)
    return float(t0), np.asarray(q0).ravel(), np.asarray(v0).ravel()


def _check_start_values(data: ModelData) -> None:
    """Raise if an expression is not finite at the initial state with the default parameters."""
    par = np.array([p.default for p in data.parameters])
    t0, q0, v0 = _numbers(data, par)
    u = np.zeros(len(data.inputs))
    for name, value in zip(data.coordinates, q0, strict=True):
        if not np.isfinite(value):
            raise ModelError(data.name, f"the initial value of '{name}'", f"is {value}", _FINITE)
    H = ca.hessian(data.L, data.v)[0]
    checks: list[tuple[str, ca.SX]] = [
        ("the Lagrangian L", data.L),
        ("the gradient of L in q", ca.jacobian(data.L, data.q)),
        ("the Hessian of L in v", H),
        ("the force f", data.f),
        ("the constraints g", data.g),
        ("the gradient of g", ca.jacobian(data.g, data.q)),
        ("the velocity constraints gamma", data.gamma),
    ]
    for c in data.contacts:
        if c.g_N is not None:
            checks.append((f"g_N of contact '{c.name}'", c.g_N))
            checks.append(
                (f"the gradient of g_N of contact '{c.name}'", ca.jacobian(c.g_N, data.q))
            )
        checks.append((f"gamma_F of '{c.name}'", c.gamma_F))
    _check_coefficients(data, par)
    at = [data.t, data.q, data.v, data.u, data.par]
    column = ca.vertcat(*(ca.vec(ca.densify(expr)) for _, expr in checks))
    found = np.asarray(ca.Function("f", at, [column])(t0, q0, v0, u, par)).ravel()
    first = 0
    for equation, expr in checks:
        values = found[first : first + expr.numel()]
        first += expr.numel()
        if not np.all(np.isfinite(values)):
            raise ModelError(
                data.name,
                equation,
                f"is {values[~np.isfinite(values)][0]} at the initial state with the default "
                "parameters",
                _FINITE,
            )


def _check_coefficients(data: ModelData, par: np.ndarray) -> None:
    """Raise if a coefficient of a law is out of its range with the default parameters."""
    rows: list[tuple[str, str, ca.SX, float]] = []
    for c in data.contacts:
        rows += [(c.name, "mu", c.mu, np.inf), (c.name, "e_N", c.e_N, 1.0)]
        rows.append((c.name, "e_F", c.e_F, 1.0))
        if c.mu_F is not None:
            rows += [(c.name, "mu", c.mu_F[d], np.inf) for d in range(c.n_F)]
    column = ca.vertcat(ca.SX(0, 1), *(value for _, _, value, _ in rows))
    numbers = np.asarray(ca.Function("laws", [data.par], [column])(par)).ravel()
    for (name, law, _, top), number in zip(rows, numbers, strict=True):
        if not 0 <= number <= top:
            raise ModelError(
                data.name,
                f"{law} of contact '{name}'",
                f"is {number:g} with the default parameters",
                "It must lie in [0, 1]" if top == 1.0 else "It must be >= 0",
            )
    for c in data.contacts:
        if c.mu_F is None:
            continue
        pair = np.asarray(ca.Function("mu", [data.par], [c.mu_F])(par)).ravel()
        if np.any(pair == 0) and np.any(pair > 0):
            raise ModelError(
                data.name,
                f"mu of contact '{c.name}'",
                f"is ({pair[0]:g}, {pair[1]:g}) with the default parameters",
                "Both coefficients are positive, or both zero",
            )


_FINITE = "Change the initial state, the parameters or the expression"
