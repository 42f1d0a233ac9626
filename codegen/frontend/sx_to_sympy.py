"""Back from CasADi SX to SymPy, to show derived expressions to people."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import sympy as sp
from signorini.codegen.frontend import table

_BINARY: dict[int, Callable[[Any, Any], Any]] = {
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b,
    ca.OP_POW: lambda a, b: a**b,
    ca.OP_CONSTPOW: lambda a, b: a**b,
    ca.OP_ATAN2: sp.atan2,
    ca.OP_FMIN: sp.Min,
    ca.OP_FMAX: sp.Max,
    ca.OP_LT: lambda a, b: a < b,
    ca.OP_LE: lambda a, b: a <= b,
    ca.OP_EQ: sp.Eq,
    ca.OP_NE: sp.Ne,
    ca.OP_AND: sp.And,
    ca.OP_OR: sp.Or,
    ca.OP_IF_ELSE_ZERO: lambda c, a: sp.Piecewise((a, c), (0, True)),
    ca.OP_FMOD: sp.Function("fmod"),
    ca.OP_REMAINDER: sp.Function("remainder"),
    ca.OP_COPYSIGN: sp.Function("copysign"),
    ca.OP_HYPOT: lambda a, b: sp.sqrt(a**2 + b**2),
}
_UNARY: dict[int, Callable[[Any], Any]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_NEG: lambda a: -a,
    ca.OP_EXP: sp.exp,
    ca.OP_EXPM1: lambda a: sp.exp(a) - 1,
    ca.OP_LOG1P: lambda a: sp.log(1 + a),
    ca.OP_LOG: sp.log,
    ca.OP_SQRT: sp.sqrt,
    ca.OP_SQ: lambda a: a**2,
    ca.OP_TWICE: lambda a: 2 * a,
    ca.OP_INV: lambda a: 1 / a,
    ca.OP_SIN: sp.sin,
    ca.OP_COS: sp.cos,
    ca.OP_TAN: sp.tan,
    ca.OP_ASIN: sp.asin,
    ca.OP_ACOS: sp.acos,
    ca.OP_ATAN: sp.atan,
    ca.OP_SINH: sp.sinh,
    ca.OP_COSH: sp.cosh,
    ca.OP_TANH: sp.tanh,
    ca.OP_ASINH: sp.asinh,
    ca.OP_ACOSH: sp.acosh,
    ca.OP_ATANH: sp.atanh,
    ca.OP_FABS: sp.Abs,
    ca.OP_SIGN: sp.sign,
    ca.OP_FLOOR: sp.floor,
    ca.OP_CEIL: sp.ceiling,
    ca.OP_ERF: sp.erf,
    ca.OP_NOT: sp.Not,
}


def operations(expr: ca.SX) -> int:
    """Arithmetic operations and function calls of one evaluation."""
    f = ca.Function("f", ca.symvar(expr), [expr])
    free = {ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_PARAMETER}
    return sum(f.instruction_id(k) not in free for k in range(f.n_instructions()))


def to_sympy(expr: ca.SX) -> sp.Matrix:
    """A dense SymPy matrix of the same shape; whole numbers stay whole."""
    symbols = ca.symvar(expr)
    f = ca.Function("f", symbols, [ca.densify(expr)])
    work: dict[int, Any] = {}
    entries: dict[int, Any] = {}
    for k in range(f.n_instructions()):
        op, out, args = f.instruction_id(k), f.instruction_output(k), f.instruction_input(k)
        if op == ca.OP_CONST:
            work[out[0]] = _number(f.instruction_constant(k))
        elif op == ca.OP_INPUT:
            work[out[0]] = sp.Symbol(symbols[args[0]].name(), real=True)
        elif op == ca.OP_CALL:
            cell = table.known(f.instructions_sx()[k].which_function().name())
            title = cell.name if cell is not None and cell.name else "table"
            for entry, place in enumerate(out):
                if place >= 0:
                    work[place] = sp.Function(f"{title}_{entry}")(*(work[a] for a in args))
        elif op == ca.OP_OUTPUT:
            entries[out[1]] = work[args[0]]
        elif op in _UNARY:
            work[out[0]] = _UNARY[op](work[args[0]])
        else:
            work[out[0]] = _BINARY[op](work[args[0]], work[args[1]])
    rows, columns = expr.shape
    return sp.Matrix(
        rows, columns, lambda i, j: _as_number(entries.get(j * rows + i, sp.Integer(0)))
    )


def _as_number(entry: Any) -> Any:
    """A condition as 1 or 0: matrices hold numbers."""
    return entry if isinstance(entry, sp.Expr) else sp.Piecewise((1, entry), (0, True))


def _number(x: float) -> sp.Expr:
    if x == int(x):
        return sp.Integer(int(x))
    simple = sp.nsimplify(x, rational=True, tolerance=1e-15)
    return simple if simple.q <= 1000 and float(simple) == x else sp.Float(x, 17)
