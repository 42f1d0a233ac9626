"""Checks a declared model and freezes it; every error names equation, symbol and remedy."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
from signorini.codegen.frontend import table
from signorini.codegen.frontend.declarations import ContactDeclaration, Reaction
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import Model
from signorini.codegen.frontend.model_data import Compliance, Contact, ModelData, Parameter
from signorini.codegen.frontend.operations import BY_NUMBER, PLUMBING
from signorini.codegen.frontend.probes import (
    check_affine,
    check_constraints,
    check_mass_matrix,
    check_start_values,
)
from signorini.codegen.frontend.symbols import is_number
from signorini.codegen.frontend.table import Table

# Operations of CasADi without a counterpart in C99.
_NOT_IN_C = {ca.OP_ERFINV: "erfinv", ca.OP_PRINTME: "printme", ca.OP_LIFT: "lift"}


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
        columns = (("t", self.t), ("q", self.q), ("v", self.v), ("u", self.u))
        self.letter_of = {
            symbol.element_hash(): letter
            for letter, column in columns
            for symbol in ca.vertsplit(column)
            if column.numel()
        }
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
            bodies=tuple(model.bodies),
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
            contacts=tuple(self.contact(k, c) for k, c in enumerate(model.contacts)),
            compliances=self.compliances(),
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
            check_affine(data, equation, sx)
        check_mass_matrix(data)
        check_start_values(data)
        check_constraints(data)
        return data

    # --- pieces ----------------------------------------------------------------------------------

    def scalar(self, equation: str, expr: Any, depends: str, smooth: bool = False) -> ca.SX:
        """Translate one expression; `depends` lists what it may depend on (t, q, v, u, p)."""
        world = self.model.world
        sx = world.to_sx(self.name, equation, expr)
        if sx.is_constant() and np.isfinite(float(sx)):
            return sx
        symbols = ca.symvar(sx)
        self._check_numbers(equation, sx, symbols)
        found = {self.letter_of.get(s.element_hash()) for s in symbols}
        for letter, column, what, remedy in (
            ("t", self.t, "time", "It must not depend on time"),
            ("q", self.q, "coordinate", "It must not depend on coordinates"),
            ("v", self.v, "velocity", _REMEDY_GAP if "g_N" in equation else _REMEDY_V),
            ("u", self.u, "input", _REMEDY_U),
        ):
            if letter not in depends and letter in found:
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

    def _check_numbers(self, equation: str, sx: ca.SX, symbols: list[ca.SX]) -> None:
        f = ca.Function("f", [ca.vertcat(ca.SX(0, 1), *symbols)], [sx])
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
            rows.append([(what, x) for x in point])
        shapes = tuple((thing.kind, thing.name, len(thing.points)) for thing in things)
        return shapes, self._points(rows) if rows else ca.SX(0, 2)

    def _points(self, rows: list[list[tuple[str, Any]]]) -> ca.SX:
        """Points in rows; looked at together, and one by one only to say which is wrong."""
        world = self.model.world
        found = ca.vertcat(
            *(ca.horzcat(*(world.to_sx(self.name, what, x) for what, x in row)) for row in rows)
        )
        symbols = ca.symvar(found)
        letters = {self.letter_of.get(s.element_hash()) for s in symbols}
        try:
            self._check_numbers("shape", ca.vec(found), symbols)
        except ModelError:
            letters.add("u")
        if letters & {"u", "v"}:
            for row in rows:
                for what, x in row:
                    self.scalar(what, x, "tqp")
        return found

    def force(self) -> ca.SX:
        total = ca.SX.zeros(len(self.model.q), 1)
        for entries in self.model.forces:
            # coordinates that were declared later get no part of it
            for k, (name, entry) in enumerate(
                zip(self.model.coordinate_names, entries, strict=False)
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

    def affine(self, equation: str, expr: Any, depends: str = "tqvp") -> ca.SX:
        sx = self.scalar(equation, expr, depends)
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

    def contact(self, k: int, c: ContactDeclaration) -> Contact:
        where = f"{c.kind} '{c.name}'"
        g_N = bound = guard = None
        presser: int | None = k
        if c.g_N is not None:
            if isinstance(c.g_N, (list, tuple)):
                raise ModelError(
                    self.name, f"g_N of {where}", "is a list", "Give one gap for each contact"
                )
            if c.one_way:
                g_N = self.affine(f"gamma of one_way '{c.name}'", c.g_N)
            else:
                g_N = self.scalar(f"g_N of {where}", c.g_N, "tqp", smooth=True)
                self._check_depends(f"g_N of {where}", g_N, self.q, "coordinate")
        elif c.load is not None:
            presser = None
        elif c.pressed_by:
            presser = [d.name for d in self.model.contacts].index(c.pressed_by)
            c = replace(c, guard=self.model.contacts[presser].guard)
        else:
            presser = None
            bound = self.scalar(f"bound of {where}", c.bound, "tqup")
            if is_number(c.bound) and float(c.bound) < 0:
                raise ModelError(
                    self.name, f"bound of {where}", f"is {c.bound}", "A friction bound is >= 0"
                )
        if c.guard is not None:
            guard = self.scalar(f"guard of {where}", c.guard, "tqp")
        rows = [
            self.affine(
                f"gamma_F of {where}" + (f" [{k}]" if len(c.gamma_F) > 1 else ""), e, "tqvup"
            )
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
            laws["mu"] = _largest(mu_F)
        else:
            laws["mu"] = self.coefficient(f"mu of {where}", c.mu, None)
        return Contact(
            name=c.name,
            g_N=g_N,
            gamma_F=ca.vertcat(ca.SX(0, 1), *rows),
            bound=bound,
            guard=guard,
            mu_F=mu_F,
            presser=presser,
            load=None if c.load is None else self.load(where, c.load),
            one_way=c.one_way,
            poisson=c.impact == "poisson",
            varies=c.mu_at == "stages",
            **laws,
        )

    def compliances(self) -> tuple[Compliance, ...]:
        """The rows that yield: of constraints, then of contacts."""
        found, row, declared = [], 0, self.model.compliances
        blocks = [(name, len(rows), False) for name, rows in self.model.constraints]
        blocks += [(name, len(rows), False) for name, rows in self.model.velocity_constraints]
        blocks += [(c.name, 1, True) for c in self.model.contacts if c.g_N is not None]
        for name, count, normal in blocks:
            if name in declared:
                laws = (
                    self.coefficient(f"{law} of '{name}'", value, None)
                    for law, value in zip(("compliance", "relaxation"), declared[name], strict=True)
                )
                yields = tuple(laws)
                found += [Compliance(name, row + k, normal, *yields) for k in range(count)]
            row += count
        return tuple(found)

    def load(self, where: str, reaction: Reaction) -> tuple[int, int]:
        """First bilateral row and number of rows of a reaction."""
        first = 0
        model = self.model
        for name, rows in (*model.constraints, *model.velocity_constraints):
            if name == reaction.name:
                count = len(rows) - reaction.first if reaction.count is None else reaction.count
                if not 0 <= reaction.first < reaction.first + count <= len(rows):
                    raise ModelError(
                        self.name,
                        f"reaction of '{name}' in {where}",
                        f"counts rows {reaction.first} to {reaction.first + count - 1} of "
                        f"{len(rows)}",
                        "Give rows that the constraint has",
                    )
                return first + reaction.first, count
            first += len(rows)
        raise AssertionError(reaction.name)

    def coefficient(self, equation: str, value: Any, top: float | None) -> ca.SX:
        """A coefficient of a law: at least zero, at most `top`."""
        if is_number(value):
            number = float(value)
            if not number >= 0 or (top is not None and number > top):
                kind = equation.split(" of ", maxsplit=1)[0].replace("mu", "friction coefficient")
                allowed = f"a {kind} is >= 0" if top is None else "it lies in [0, 1]"
                raise ModelError(self.name, equation, f"is {number:g}", allowed.capitalize())
            if np.isfinite(number):
                return ca.SX(number)
        return self.scalar(equation, value, "tqvup")

    def coefficients(self, equation: str, pair: Sequence[Any], n_F: int) -> ca.SX:
        """Friction coefficients of both slip components."""
        if len(pair) != n_F or n_F not in (2, 3):
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


def _largest(column: ca.SX) -> ca.SX:
    top = column[0]
    for k in range(1, column.numel()):
        top = ca.fmax(top, column[k])
    return top


_REMEDY_GAP = "A gap holds coordinates and time only; a velocity goes into gamma_F"
_REMEDY_U = (
    "An input may jump, and a place or a bilateral velocity cannot: it may stand in forces, "
    "bounds, coefficients, slip velocities and outputs. A servo is friction with a bound whose "
    "slip velocity is that of the joint less the commanded one"
)
_REMEDY_V = "Gaps and position constraints hold coordinates only: use a velocity_constraint"
