"""Translation of SymPy expressions into CasADi SX, node by node, nothing expanded."""

import math
from collections.abc import Callable, Iterable
from typing import Any

import casadi as ca
import sympy as sp
from signorini.codegen.errors import ModelError, foreign_symbol
from sympy.core.function import AppliedUndef
from sympy.functions.elementary.piecewise import ExprCondPair
from sympy.logic.boolalg import BooleanFalse, BooleanTrue


class smooth(sp.Function):  # noqa: N801 - printed and written as a function: smooth(expr)
    """Marks `expr` as twice continuously differentiable although it contains branches."""

    nargs = 1


_UNARY: dict[type, Callable[[ca.SX], ca.SX]] = {
    sp.sin: ca.sin,
    sp.cos: ca.cos,
    sp.tan: ca.tan,
    sp.asin: ca.asin,
    sp.acos: ca.acos,
    sp.atan: ca.atan,
    sp.sinh: ca.sinh,
    sp.cosh: ca.cosh,
    sp.tanh: ca.tanh,
    sp.asinh: ca.asinh,
    sp.acosh: ca.acosh,
    sp.atanh: ca.atanh,
    sp.exp: ca.exp,
    sp.Abs: ca.fabs,
    sp.sign: ca.sign,
    sp.floor: ca.floor,
    sp.ceiling: ca.ceil,
    sp.erf: ca.erf,
    sp.sec: lambda x: 1 / ca.cos(x),
    sp.csc: lambda x: 1 / ca.sin(x),
    sp.cot: lambda x: 1 / ca.tan(x),
    sp.sech: lambda x: 1 / ca.cosh(x),
    sp.csch: lambda x: 1 / ca.sinh(x),
    sp.coth: lambda x: 1 / ca.tanh(x),
    smooth: lambda x: x,
}
_RELATIONS: dict[type, Callable[[ca.SX, ca.SX], ca.SX]] = {
    sp.StrictLessThan: lambda a, b: a < b,
    sp.LessThan: lambda a, b: a <= b,
    sp.StrictGreaterThan: lambda a, b: b < a,
    sp.GreaterThan: lambda a, b: b <= a,
    sp.Equality: lambda a, b: a == b,
    sp.Unequality: lambda a, b: a != b,
}


_NONSMOOTH = (
    sp.Abs, sp.sign, sp.floor, sp.ceiling, sp.Max, sp.Min, sp.Heaviside, sp.Mod, sp.Piecewise
)  # fmt: skip


def nonsmooth_part(expr: Any, constants: Iterable[Any] = ()) -> str | None:
    """Return the first function outside `smooth` that has a kink or a jump, as text.

    What depends on `constants` alone, the parameters, has none.
    """
    fixed = set(constants)
    walk = sp.preorder_traversal(sp.sympify(expr))
    for node in walk:
        if isinstance(node, smooth):
            walk.skip()
        elif isinstance(node, _NONSMOOTH) and node.free_symbols - fixed:
            return str(node)
    return None


class SympyToCasadi:
    """Translates expressions of declared symbols; equal nodes become one SX node."""

    def __init__(self) -> None:
        self._memo: dict[Any, ca.SX] = {}
        self._names: list[str] = []

    def declare(self, symbol: sp.Symbol) -> None:
        """Give `symbol` its SX counterpart of the same name."""
        self._memo[symbol] = ca.SX.sym(symbol.name)
        self._names.append(symbol.name)

    def convert(self, model: str, equation: str, expr: Any) -> ca.SX:
        """Return the SX of a scalar expression.

        Raises
        ------
        ModelError
            For anything that is no real scalar of declared symbols and C99 functions.
        """
        if isinstance(expr, (ca.SX, ca.MX)):
            raise ModelError(
                model,
                equation,
                "is a CasADi expression in a model with symbols='sympy'",
                "Use SymPy, or make the model with symbols='casadi'",
            )
        try:
            node = sp.sympify(expr, strict=True)
        except (sp.SympifyError, TypeError):
            raise ModelError(
                model,
                equation,
                f"{expr!r} is not an expression",
                "Give a SymPy expression or a number",
            ) from None
        if isinstance(node, (sp.MatrixBase, sp.Tuple)) or getattr(node, "shape", ()) not in (
            (),
            None,
        ):
            raise ModelError(
                model,
                equation,
                f"has shape {getattr(node, 'shape', (len(node),))}",
                "Give scalars; several equations go into a list",
            )
        if not isinstance(node, sp.Expr):
            raise ModelError(
                model,
                equation,
                f"{node} is no real expression",
                "Give a SymPy expression or a number",
            )
        return self._convert(model, equation, node)

    def _convert(self, model: str, equation: str, root: sp.Basic) -> ca.SX:
        # An explicit stack: user expressions may be deeper than Python's recursion limit.
        stack = [root]
        while stack:
            node = stack[-1]
            if node in self._memo:
                stack.pop()
                continue
            missing = [a for a in self._operands(node) if a not in self._memo]
            if missing:
                stack.extend(reversed(missing))
                continue
            self._memo[node] = self._translate(model, equation, node)
            stack.pop()
        return self._memo[root]

    @staticmethod
    def _operands(node: sp.Basic) -> tuple[sp.Basic, ...]:
        if isinstance(node, sp.Piecewise):
            return tuple(part for pair in node.args for part in (pair.expr, pair.cond))
        if isinstance(node, sp.Pow) and isinstance(node.exp, sp.Rational):
            return (node.base,)
        repeated = _repeated_exponential(node)
        if repeated is not None:
            return (repeated[0],)
        if isinstance(node, (sp.Number, sp.NumberSymbol, sp.Symbol, ExprCondPair)):
            return ()
        return tuple(node.args)

    def _translate(self, model: str, equation: str, node: Any) -> ca.SX:
        args = [self._memo[a] for a in self._operands(node)]
        repeated = _repeated_exponential(node)
        if repeated is not None:
            return _integer_power(args[0], repeated[1])
        if isinstance(node, sp.Symbol):
            raise foreign_symbol(model, equation, node.name, self._names)
        if node in (sp.oo, -sp.oo, sp.zoo, sp.nan):
            raise ModelError(
                model, equation, f"contains {node}", "Every expression must stay finite"
            )
        if isinstance(node, (sp.Rational, sp.Float, sp.NumberSymbol)):
            try:
                value = node.p / node.q if isinstance(node, sp.Rational) else float(node)
            except OverflowError:
                value = math.inf
            if math.isinf(value):
                raise ModelError(
                    model, equation, "contains a number beyond 1e308", "Scale the model's units"
                )
            return ca.SX(value)
        if isinstance(node, sp.Add):
            return _sum(args)
        if isinstance(node, sp.Mul):
            return _product(node, args)
        if isinstance(node, sp.Pow):
            return _power(node, args)
        if isinstance(node, sp.log):
            return ca.log(args[0]) if len(args) == 1 else ca.log(args[0]) / ca.log(args[1])
        if isinstance(node, sp.atan2):
            return ca.atan2(args[0], args[1])
        if isinstance(node, (sp.Max, sp.Min)):
            fold = ca.fmax if isinstance(node, sp.Max) else ca.fmin
            value = args[0]
            for arg in args[1:]:
                value = fold(value, arg)
            return value
        if isinstance(node, sp.Heaviside):
            return ca.if_else(args[0] < 0, ca.SX(0), ca.if_else(args[0] > 0, ca.SX(1), args[1]))
        if isinstance(node, sp.Mod):
            return args[0] - args[1] * ca.floor(args[0] / args[1])
        if isinstance(node, sp.Piecewise):
            return _piecewise(model, equation, node, args)
        if isinstance(node, (BooleanTrue, BooleanFalse)):
            return ca.SX(1 if node else 0)
        if type(node) in _RELATIONS:
            return _RELATIONS[type(node)](args[0], args[1])
        if isinstance(node, sp.And):
            value = args[0]
            for arg in args[1:]:
                value = ca.logic_and(value, arg)
            return value
        if isinstance(node, sp.Or):
            value = args[0]
            for arg in args[1:]:
                value = ca.logic_or(value, arg)
            return value
        if isinstance(node, sp.Not):
            return ca.logic_not(args[0])
        if type(node) in _UNARY:
            return _UNARY[type(node)](args[0])
        if node is sp.I or node.has(sp.I):
            raise ModelError(model, equation, "contains the imaginary unit", "Models are real")
        if isinstance(node, (sp.Derivative, AppliedUndef)):
            problem = f"contains {node}, a function of time or a derivative"
            remedy = "Use the symbols of m.coordinates and m.velocities instead of x(t)"
        else:
            problem = f"contains {type(node).__name__}({', '.join(map(str, node.args))})"
            remedy = "C99 has no such function: write it with elementary ones"
        raise ModelError(model, equation, problem, remedy)


def _sum(terms: list[ca.SX]) -> ca.SX:
    value = terms[0]
    for term in terms[1:]:
        value = value + term
    return value


def _product(node: sp.Mul, args: list[ca.SX]) -> ca.SX:
    # Factors with negative exponent go below one fraction bar: m*g/2, not m*g*(1/2).
    over: list[ca.SX] = []
    under: list[ca.SX] = []
    sign = 1
    for factor, sx in zip(node.args, args, strict=True):
        if isinstance(factor, sp.Rational):
            if factor.p < 0:
                sign = -sign
            if abs(factor.p) != 1:
                over.append(ca.SX(float(abs(factor.p))))
            if factor.q != 1:
                under.append(ca.SX(float(factor.q)))
        elif isinstance(factor, sp.Pow) and factor.exp.is_Rational and factor.exp.is_negative:
            under.append(1 / sx)
        else:
            over.append(sx)
    value = over[0] if over else ca.SX(1)
    for factor in over[1:]:
        value = value * factor
    for factor in under:
        value = value / factor
    return value if sign > 0 else -value


def _repeated_exponential(node: Any) -> tuple[sp.Basic, int] | None:
    """exp(x) and n where the node is exp(n x): SymPy gathers what was written as a power."""
    if isinstance(node, sp.exp):
        factor, rest = node.args[0].as_coeff_Mul()
        if isinstance(factor, sp.Integer) and 2 <= abs(factor) <= 4 and not rest.is_Number:
            return sp.exp(rest if factor > 0 else -rest), int(abs(factor))
    return None


def _power(node: sp.Pow, args: list[ca.SX]) -> ca.SX:
    base = args[0]
    exponent = node.exp
    if not isinstance(exponent, sp.Rational):
        return ca.exp(args[1]) if node.base is sp.E else ca.power(base, args[1])
    magnitude = abs(exponent)
    # x*sqrt(x) has the derivative 0*inf at 0 where x^(3/2) has 0: positive ones stay powers.
    if magnitude.q == 2 and magnitude.p <= (1 if exponent > 0 else 7):
        value = ca.sqrt(base)
        whole = magnitude.p // 2
        if whole:
            value = _integer_power(base, whole) * value
    elif magnitude.q == 1 and magnitude.p <= 16:
        value = _integer_power(base, int(magnitude.p))
    else:
        return ca.power(base, float(exponent))
    return value if exponent > 0 else 1 / value


def _integer_power(base: ca.SX, n: int) -> ca.SX:
    if n == 0:
        return ca.SX(1)
    if n == 1:
        return base
    half = _integer_power(base, n // 2)
    return half * half * base if n % 2 else half * half


def _piecewise(model: str, equation: str, node: sp.Piecewise, args: list[ca.SX]) -> ca.SX:
    if node.args[-1].cond is not sp.true:
        raise ModelError(
            model,
            equation,
            f"{node} has no value where none of its conditions holds",
            "End the Piecewise with (value, True)",
        )
    value = args[-2]
    for branch, condition in zip(args[-4::-2], args[-3::-2], strict=True):
        value = ca.if_else(condition, branch, value)
    return value
