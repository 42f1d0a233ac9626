"""The user's expressions as functions of numbers, by routes that share nothing with generation.

SymPy models are differentiated by SymPy and evaluated in double or by mpmath. CasADi models are
evaluated node by node in complex arithmetic, double or mpmath; first derivatives by complex step.
"""

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca
import mpmath as mp
import numpy as np
import sympy as sp
from signorini.codegen.frontend.model import Model
from signorini.codegen.frontend.table import Applied, known
from signorini.codegen.frontend.terms import unique_nodes
from signorini.verify.splines import Spline
from sympy.core.function import AppliedUndef

DIGITS = 50
Vector = np.ndarray
Expression = Any


def _flat(blocks: Sequence[tuple[str, list[Any]]]) -> list[Any]:
    return [e for _, block in blocks for e in block]


def _each(contact: Any) -> list[Any]:
    """The friction coefficient of every slip component."""
    mu = contact.mu
    return list(mu) if isinstance(mu, (list, tuple)) else [mu] * len(contact.gamma_F)


def _differ(contacts: Sequence[Any]) -> bool:
    return any(isinstance(c.mu, (list, tuple)) for c in contacts)


class Expressions:
    """Numbers from a model's expressions.

    Parameters
    ----------
    model : Model
        The model as the user wrote it.
    high : bool
        Evaluate with 50 digits (arrays of mpf) instead of in double.

    Notes
    -----
    All methods take (t, q, v, u, par) as numbers or arrays and return arrays.
    """

    def __init__(self, model: Model, high: bool = False) -> None:
        self.high = high
        self.n_q = len(model.q)
        guards = {c.name: c.guard for c in model.contacts}
        # what a contact presses exists with it
        contacts = [
            replace(c, guard=guards[c.pressed_by]) if c.pressed_by else c for c in model.contacts
        ]
        self.contacts = contacts
        self.yields = _yielding(model)
        things = model.drawing.wanted()
        total = [0] * self.n_q
        for force in model.forces:
            total = [a + b for a, b in zip(total, force, strict=True)]
        rows = {
            "L": [model.L],
            "f": total,
            "g": _flat(model.constraints),
            "gamma": _flat(model.velocity_constraints),
            "g_N": [c.g_N for c in contacts if c.g_N is not None],
            "gamma_F": [e for c in contacts for e in c.gamma_F],
            "bound": [c.bound for c in contacts if c.bound is not None],
            "guard": [0 if c.guard is None else c.guard for c in contacts],
            "mu": [] if _differ(contacts) else [c.mu for c in contacts],
            "mu_F": [mu for c in contacts for mu in _each(c)] if _differ(contacts) else [],
            "e_N": [c.e_N for c in contacts],
            "e_F": [c.e_F for c in contacts],
            "compliance": [c for c, _ in self.yields.values()],
            "relaxation": [tau for _, tau in self.yields.values()],
            "outputs": [e for _, e in model.outputs],
            "shapes": [x for thing in things for point in thing.points for x in point],
        }
        world = _SymPy if model.world.name == "sympy" else _CasADi
        self._world = world(model, rows, high)
        self.n = {name: len(value) for name, value in rows.items()}

    def value(self, name: str, *at: Any) -> Vector:
        """Value of a quantity the user wrote."""
        if name == "mu" and self.n["mu_F"]:
            each = self._world.value("mu_F", at)
            first, largest = 0, []
            for contact in self.contacts:
                n_F = len(contact.gamma_F)
                largest.append(max(each[first : first + n_F], default=0.0))
                first += n_F
            return np.array(largest)
        return self._world.value(name, at)

    def derivative(self, name: str, variable: str, *at: Any) -> Vector:
        """Jacobian of such a quantity in "t", "q" or "v", shape (rows, columns)."""
        return self._world.derivative(name, variable, at)

    def p(self, *at: Any) -> Vector:
        return self.derivative("L", "v", *at)[0]

    def L_q(self, *at: Any) -> Vector:
        return self.derivative("L", "q", *at)[0]

    def energy(self, *at: Any) -> Any:
        return self.p(*at) @ np.asarray(at[2]) - self.value("L", *at)[0]

    def dot(self, name: str, *at: Any) -> Vector:
        """Total time derivative of g or g_N."""
        if not self.n[name]:
            return self.value(name, *at)
        rate = self.derivative(name, "q", *at) @ np.asarray(at[2])
        rate = rate + self.derivative(name, "t", *at)[:, 0]
        for k in self._velocities(name):
            rate[k] = self.value(name, *at)[k]
        return rate

    def _velocities(self, name: str) -> list[int]:
        """Rows of g_N that are velocities."""
        if name != "g_N":
            return []
        normal = [c.one_way for c in self.contacts if c.g_N is not None]
        return [k for k, one_way in enumerate(normal) if one_way]

    def W(self, *at: Any) -> Vector:
        """All force directions, n_q x (n_g + n_gamma + n_N + n_F)."""
        columns = [
            self.derivative(name, variable, *at).T
            for name, variable in (("g", "q"), ("gamma", "v"), ("g_N", "q"), ("gamma_F", "v"))
            if self.n[name]
        ]
        one_way = self._velocities("g_N")
        if one_way:
            slopes = self.derivative("g_N", "v", *at).T
            columns[bool(self.n["g"]) + bool(self.n["gamma"])][:, one_way] = slopes[:, one_way]
        return np.hstack(columns) if columns else np.zeros((self.n_q, 0))

    def y(self, *at: Any) -> Vector:
        """g, gamma, g_N, gamma_F in one column."""
        return np.concatenate([self.value(n, *at) for n in ("g", "gamma", "g_N", "gamma_F")])

    def y_dot(self, *at: Any) -> Vector:
        """g_dot, gamma, g_N_dot, gamma_F in one column."""
        return np.concatenate(
            [
                self.dot("g", *at),
                self.value("gamma", *at),
                self.dot("g_N", *at),
                self.value("gamma_F", *at),
            ]
        )


def _yielding(model: Model) -> dict[int, tuple[Any, Any]]:
    """Compliance and relaxation of the percussion rows that yield."""
    names = [
        name
        for name, expressions in (*model.constraints, *model.velocity_constraints)
        for _ in expressions
    ]
    names += [c.name for c in model.contacts if c.g_N is not None]
    return {k: model.compliances[x] for k, x in enumerate(names) if x in model.compliances}


class _SymPy:
    def __init__(self, model: Model, rows: dict[str, list[Any]], high: bool) -> None:
        self.rows = {
            name: [self._plain(sp.sympify(e)) for e in value] for name, value in rows.items()
        }
        self.symbols = [model.time, *model.q, *model.v, *model.u, *model.par]
        self.variables = {"t": [model.time], "q": model.q, "v": model.v}
        self.modules = "mpmath" if high else "numpy"
        self.high = high
        self._functions: dict[Any, Callable[..., Any]] = {}
        self._splines: dict[str, Spline] = {}

    @staticmethod
    def _plain(e: sp.Expr) -> sp.Expr:
        """Without markers, and with functions of C and of this package written out."""
        written: dict[Any, Any] = {}
        nodes = unique_nodes(e)
        for node in nodes:
            name = type(node).__name__
            args = [written[id(c)] for c in nodes.children(node)]
            if name in _PLAIN and not isinstance(node, AppliedUndef):
                written[id(node)] = _PLAIN[name](*args)
            elif any(a is not b for a, b in zip(args, node.args, strict=True)):
                written[id(node)] = node.func(*args)
            else:
                written[id(node)] = node
        return written[id(nodes.root)]

    def _call(self, key: Any, expressions: list[sp.Expr], at: Any) -> list[Any]:
        if key not in self._functions:
            self._functions[key] = sp.lambdify(
                self.symbols,
                expressions,
                modules=[self._tables(expressions), self.modules],
                cse=True,
            )
        numbers = [x for part in at for x in np.atleast_1d(np.asarray(part, dtype=object))]
        if self.high:
            with mp.workdps(DIGITS):
                return list(self._functions[key](*(mp.mpf(x) for x in numbers)))
        return list(self._functions[key](*(float(x) for x in numbers)))

    def _tables(self, expressions: list[sp.Expr]) -> dict[str, Callable[..., Any]]:
        """Tables in the expressions, and derivatives of tables, by name."""
        found = {type(a) for e in expressions for a in unique_nodes(e) if isinstance(a, Applied)}
        for applied in found:
            self._splines.setdefault(applied.table.function, Spline(applied.table))
        return {
            a.__name__: partial(self._splines[a.table.function].derivative, a.orders) for a in found
        }

    def _array(self, values: list[Any]) -> Vector:
        return np.array(values, dtype=object if self.high else float)

    def value(self, name: str, at: Any) -> Vector:
        return (
            self._array(self._call(name, self.rows[name], at)) if self.rows[name] else np.zeros(0)
        )

    def derivative(self, name: str, variable: str, at: Any) -> Vector:
        key = (name, variable)
        x = self.variables[variable]
        rows = self.rows[name]
        if not rows:
            return np.zeros((0, len(x)))
        expressions = [] if key in self._functions else [sp.diff(e, s) for e in rows for s in x]
        return self._array(self._call(key, expressions, at)).reshape(len(rows), len(x))


# By name, so that nothing of the translation is used but the walk over its terms.
_PLAIN: dict[str, Callable[..., Any]] = {
    "smooth": lambda x: x,
    "norm": lambda *x: sp.sqrt(sum(c**2 for c in x)),
    "log1p": lambda x: sp.log(1 + x),
    "expm1": lambda x: sp.exp(x) - 1,
    "exp2": lambda x: sp.Integer(2) ** x,
    "log2": lambda x: sp.log(x) / sp.log(2),
    "log10": lambda x: sp.log(x) / sp.log(10),
    "Cbrt": lambda x: sp.sign(x) * sp.Abs(x) ** sp.Rational(1, 3),
    "Sqrt": sp.sqrt,
    "hypot": lambda x, y: sp.sqrt(x**2 + y**2),
    "fma": lambda a, b, c: a * b + c,
}


class _CasADi:
    """Node-by-node evaluation of SX graphs; the derivative is Im f(x + i h) / h."""

    def __init__(self, model: Model, rows: dict[str, list[Any]], high: bool) -> None:
        symbols = [model.time, *model.q, *model.v, *model.u, *model.par]
        inputs = ca.vertcat(*symbols)
        self.functions = {
            name: ca.Function(name, [inputs], [ca.vertcat(ca.SX(0, 1), *(ca.SX(e) for e in value))])
            for name, value in rows.items()
        }
        n_q = len(model.q)
        self.columns = {"t": range(1), "q": range(1, 1 + n_q), "v": range(1 + n_q, 1 + 2 * n_q)}
        self.high = high
        self.operations = _operations(mp if high else cmath)
        self._programs: dict[str, list[tuple[int, list[int], list[int], float]]] = {}
        self._splines: dict[str, list[Spline]] = {}
        self.step = mp.mpf(10) ** -40 if high else 1e-100

    def _numbers(self, at: Any) -> list[Any]:
        make = mp.mpf if self.high else float
        return [make(x) for part in at for x in np.atleast_1d(np.asarray(part, dtype=object))]

    def value(self, name: str, at: Any) -> Vector:
        with mp.workdps(DIGITS):
            values = self._run(self.functions[name], self._numbers(at))
            return np.array([v.real for v in values], dtype=object if self.high else float)

    def derivative(self, name: str, variable: str, at: Any) -> Vector:
        with mp.workdps(DIGITS):
            x = self._numbers(at)
            columns = []
            for k in self.columns[variable]:
                z = list(x)
                z[k] = (mp.mpc if self.high else complex)(x[k], self.step)
                columns.append([v.imag / self.step for v in self._run(self.functions[name], z)])
            return np.array(columns, dtype=object if self.high else float).T.reshape(
                -1, len(self.columns[variable])
            )

    def _instructions(self, f: ca.Function) -> list[tuple[int, list[int], list[int], float]]:
        if f.name() not in self._programs:
            self._programs[f.name()] = [
                (
                    f.instruction_id(k),
                    f.instruction_input(k),
                    f.instruction_output(k),
                    f.instruction_constant(k) if f.instruction_id(k) == ca.OP_CONST else 0.0,
                )
                for k in range(f.n_instructions())
            ]
        return self._programs[f.name()]

    def _called(self, f: ca.Function) -> list[Spline]:
        """The tables that a function calls, in the order of its instructions."""
        if f.name() not in self._splines:
            ids = [f.instruction_id(k) for k in range(f.n_instructions())]
            nodes: Any = f.instructions_sx() if ca.OP_CALL in ids else None
            names = [
                nodes[k].which_function().name() for k, op in enumerate(ids) if op == ca.OP_CALL
            ]
            tables = [known(name) for name in names]
            self._splines[f.name()] = [Spline(t) for t in tables if t is not None]
        return self._splines[f.name()]

    def _run(self, f: ca.Function, x: list[Any]) -> list[Any]:
        make = mp.mpc if self.high else complex
        operate = self.operations
        splines, next_call = self._called(f), 0
        work: list[Any] = [make(0)] * max(f.sz_w(), 1)
        out: list[Any] = [make(0)] * f.numel_out(0)
        nonzeros = f.sparsity_out(0).row() if f.numel_out(0) else []
        for op, i, o, constant in self._instructions(f):
            if op == ca.OP_INPUT:
                work[o[0]] = make(x[i[1]])
            elif op == ca.OP_CONST:
                work[o[0]] = make(constant)
            elif op == ca.OP_CALL:
                for place, number in zip(
                    o, splines[next_call].cell([work[j] for j in i]), strict=True
                ):
                    if place >= 0:
                        work[place] = make(number)
                next_call += 1
            elif op == ca.OP_OUTPUT:
                out[nonzeros[o[1]]] = work[i[0]]
            else:
                work[o[0]] = operate[op](*(work[j] for j in i))
        return out


def _operations(m: Any) -> dict[int, Callable[..., Any]]:
    """Operations of CasADi on complex numbers; branches look at the real part."""

    def power(x: Any, y: Any) -> Any:
        if y.imag == 0 and y.real == int(y.real):
            return x ** int(y.real)
        return m.exp(y * m.log(x))

    def atan2(y: Any, x: Any) -> Any:
        # Off its branch point, analytic in both.
        if abs(x.real) >= abs(y.real):
            turn = 0 if x.real > 0 else (1 if y.real >= 0 else -1)
            return m.atan(y / x) + turn * m.pi
        return (1 if y.real > 0 else -1) * m.pi / 2 - m.atan(x / y)

    return {
        ca.OP_ASSIGN: lambda x: x,
        ca.OP_ADD: lambda x, y: x + y,
        ca.OP_SUB: lambda x, y: x - y,
        ca.OP_MUL: lambda x, y: x * y,
        ca.OP_DIV: lambda x, y: x / y,
        ca.OP_NEG: lambda x: -x,
        ca.OP_SQ: lambda x: x * x,
        ca.OP_TWICE: lambda x: x + x,
        ca.OP_INV: lambda x: 1 / x,
        ca.OP_POW: power,
        ca.OP_CONSTPOW: power,
        ca.OP_SQRT: m.sqrt,
        ca.OP_SIN: m.sin,
        ca.OP_COS: m.cos,
        ca.OP_TAN: m.tan,
        ca.OP_ASIN: m.asin,
        ca.OP_ACOS: m.acos,
        ca.OP_ATAN: m.atan,
        ca.OP_SINH: m.sinh,
        ca.OP_COSH: m.cosh,
        ca.OP_TANH: m.tanh,
        ca.OP_ASINH: m.asinh,
        ca.OP_ACOSH: m.acosh,
        ca.OP_ATANH: m.atanh,
        ca.OP_EXP: m.exp,
        ca.OP_EXPM1: lambda x: m.exp(x) - 1,
        ca.OP_LOG: m.log,
        ca.OP_LOG1P: lambda x: m.log(1 + x),
        ca.OP_FABS: lambda x: x if x.real >= 0 else -x,
        ca.OP_SIGN: lambda x: type(x)((x.real > 0) - (x.real < 0)),
        ca.OP_ERF: m.erf if m is mp else _erf,
        ca.OP_FLOOR: lambda x: type(x)(math.floor(x.real)),
        ca.OP_CEIL: lambda x: type(x)(math.ceil(x.real)),
        ca.OP_FMIN: lambda x, y: x if x.real <= y.real else y,
        ca.OP_FMAX: lambda x, y: x if x.real >= y.real else y,
        ca.OP_HYPOT: lambda x, y: m.sqrt(x * x + y * y),
        ca.OP_ATAN2: atan2,
        ca.OP_LT: lambda x, y: type(x)(x.real < y.real),
        ca.OP_LE: lambda x, y: type(x)(x.real <= y.real),
        ca.OP_EQ: lambda x, y: type(x)(x.real == y.real),
        ca.OP_NE: lambda x, y: type(x)(x.real != y.real),
        ca.OP_NOT: lambda x: type(x)(x.real == 0),
        ca.OP_AND: lambda x, y: type(x)(x.real != 0 and y.real != 0),
        ca.OP_OR: lambda x, y: type(x)(x.real != 0 or y.real != 0),
        ca.OP_IF_ELSE_ZERO: lambda x, y: y if x.real != 0 else type(x)(0),
        ca.OP_COPYSIGN: lambda x, y: x if (x.real >= 0) == (y.real >= 0) else -x,
        ca.OP_FMOD: lambda x, y: x - y * int(x.real / y.real),
        ca.OP_REMAINDER: lambda x, y: x - y * round(x.real / y.real),
    }


def _erf(x: complex) -> complex:
    """Error function next to the real axis: the slope there is 2 / sqrt(pi) exp(-x^2)."""
    slope = 2 / math.sqrt(math.pi) * math.exp(-(x.real**2))
    return complex(math.erf(x.real), slope * x.imag)
