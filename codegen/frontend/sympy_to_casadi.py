"""Translation of SymPy expressions into CasADi SX, node by node, nothing expanded."""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import casadi as ca
import sympy as sp
from signorini.codegen.frontend import special
from signorini.codegen.frontend.errors import ModelError, foreign_symbol, refuse_tuple
from signorini.codegen.frontend.table import Applied
from signorini.codegen.frontend.terms import unique_nodes
from sympy.codegen import cfunctions
from sympy.core.function import AppliedUndef
from sympy.functions.elementary.piecewise import ExprCondPair
from sympy.logic.boolalg import BooleanFalse, BooleanTrue
from sympy.matrices.expressions.matexpr import MatrixElement
from sympy.physics.vector import dynamicsymbols


class smooth(sp.Function):  # noqa: N801 - printed and written as a function: smooth(expr)
    """Marks `expr` as twice continuously differentiable although it contains branches."""

    nargs = 1


class norm(sp.Function):  # noqa: N801 - written as a function: norm([x, y])
    """Euclidean norm of its arguments; its derivative at zero is zero."""

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """x_k / norm(x), and 0 where all of them are 0."""
        return sp.Piecewise((self.args[argindex - 1] / self, sp.Gt(self, 0)), (0, True))

    def _eval_is_nonnegative(self) -> bool:
        return True


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
    sp.erfc: special.erfc,
    sp.gamma: special.gamma,
    sp.loggamma: special.log_gamma,
    cfunctions.log1p: ca.log1p,
    cfunctions.expm1: ca.expm1,
    cfunctions.exp2: lambda x: ca.power(2, x),
    cfunctions.log2: lambda x: ca.log(x) / ca.log(2),
    cfunctions.log10: lambda x: ca.log(x) / ca.log(10),
    cfunctions.Cbrt: special.cbrt,
    cfunctions.Sqrt: ca.sqrt,
    smooth: lambda x: x,
}
_FURTHER: dict[type, Callable[..., ca.SX]] = {
    cfunctions.hypot: ca.hypot,
    cfunctions.fma: lambda a, b, c: a * b + c,
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


_NOT_CARRIED_OUT = (
    *(sp.Derivative, sp.Integral, sp.Sum, sp.Product, sp.Limit, sp.Subs),
    *(AppliedUndef, MatrixElement, sp.Indexed),
)


def nonsmooth_part(expr: Any, constants: Iterable[Any] = ()) -> str | None:
    """Return the first function outside `smooth` that has a kink or a jump, as text.

    What depends on `constants` alone, the parameters, has none. Every shared term is looked at
    once.
    """
    fixed = set(constants)
    vouched: set[int] = set()
    depends: dict[int, bool] = {}
    nodes = unique_nodes(sp.sympify(expr))
    for node in nodes:
        depends[id(node)] = (isinstance(node, sp.Symbol) and node not in fixed) or any(
            depends[id(child)] for child in nodes.children(node)
        )
    stack = [nodes.root]
    while stack:
        node = stack.pop()
        if id(node) in vouched:
            continue
        vouched.add(id(node))
        if isinstance(node, smooth):
            continue
        if isinstance(node, _NONSMOOTH) and depends[id(node)]:
            return str(node)
        stack.extend(reversed(nodes.children(node)))
    return None


class SympyToCasadi:
    """Translates expressions of declared symbols; equal terms become one SX node."""

    def __init__(self) -> None:
        self._symbols: dict[sp.Symbol, ca.SX] = {}
        self._names: list[str] = []

    def declare(self, symbol: sp.Symbol) -> None:
        """Give `symbol` its SX counterpart of the same name."""
        self._symbols[symbol] = ca.SX.sym(symbol.name)
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
        refuse_tuple(model, equation, expr)
        try:
            node = sp.sympify(expr, strict=True)
        except (sp.SympifyError, TypeError):
            raise ModelError(
                model,
                equation,
                f"{expr!r} is not an expression",
                "Give a SymPy expression or a number",
            ) from None
        shape = getattr(node, "shape", ()) or ()
        if isinstance(node, (sp.MatrixBase, sp.MatrixExpr, sp.Tuple)) or shape != ():
            single = tuple(shape) == (1, 1)
            raise ModelError(
                model,
                equation,
                f"has shape {tuple(shape) or (len(node),)}",
                "A matrix of one entry is no scalar: take its entry with [0]"
                if single
                else "Give scalars; several equations go into a list",
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
        nodes = unique_nodes(root)
        for node in nodes:  # before their parts, whose symbols may be bound to them
            if isinstance(node, _NOT_CARRIED_OUT):
                raise ModelError(model, equation, *_remedy(node))
        done: dict[int, ca.SX] = {}
        for node in nodes:
            children = nodes.children(node)
            if isinstance(node, ExprCondPair):
                continue  # its parts are those of the Piecewise
            if isinstance(node, sp.Piecewise):
                children = [part for pair in children for part in nodes.children(pair)]
            if isinstance(node, sp.exp):
                value = self._exponential(node, nodes, done)
            else:
                unused = isinstance(node, sp.Pow) and isinstance(node.exp, sp.Rational)
                parts = children[:1] if unused else children
                value = self._translate(model, equation, node, [done[id(c)] for c in parts])
            done[id(node)] = value
        return done[id(nodes.root)]

    @staticmethod
    def _exponential(node: sp.Basic, nodes: unique_nodes, done: dict[int, ca.SX]) -> ca.SX:
        """exp(x); exp(n x) as a power of exp(x): SymPy gathers what was written as a power."""
        (argument,) = nodes.children(node)
        if isinstance(argument, sp.Mul):
            factor, *others = argument.args
            if isinstance(factor, sp.Integer) and 2 <= abs(factor) <= 4 and others:
                rest = _product(others, [done[id(nodes.canonical(a))] for a in others])
                return _integer_power(ca.exp(rest if factor > 0 else -rest), int(abs(factor)))
        return ca.exp(done[id(argument)])

    def _translate(self, model: str, equation: str, node: Any, args: list[ca.SX]) -> ca.SX:
        if isinstance(node, sp.Symbol):
            if node in self._symbols:
                return self._symbols[node]
            raise foreign_symbol(model, equation, node.name, self._names)
        if node in (sp.oo, -sp.oo, sp.zoo, sp.nan):
            raise ModelError(
                model, equation, f"contains {node}", "Every expression must stay finite"
            )
        if isinstance(node, (sp.Rational, sp.Float, sp.NumberSymbol)):
            number = _number(node)
            if math.isinf(number):
                raise ModelError(
                    model, equation, "contains a number beyond 1e308", "Scale the model's units"
                )
            return ca.SX(number)
        if isinstance(node, sp.Add):
            return _sum(args)
        if isinstance(node, sp.Mul):
            return _product(node.args, args)
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
        if isinstance(node, norm):
            return special.norm(args)
        if isinstance(node, Applied):
            return node.table.sx(args, node.orders)
        if type(node) in _UNARY:
            return _UNARY[type(node)](args[0])
        if type(node) in _FURTHER:
            return _FURTHER[type(node)](*args)
        raise ModelError(model, equation, *_remedy(node))


def _sum(terms: list[ca.SX]) -> ca.SX:
    value = terms[0]
    for term in terms[1:]:
        value = value + term
    return value


def _number(node: Any) -> float:
    """A SymPy number as a double, however many digits it has."""
    try:
        return node.p / node.q if isinstance(node, sp.Rational) else float(node)
    except OverflowError:
        pass
    try:
        return float(node.evalf(30))
    except OverflowError:
        return math.inf


def _remedy(node: Any) -> tuple[str, str]:
    """What is wrong with a term that C cannot compute, and what to do."""
    if node is sp.I:
        return "contains the imaginary unit", "Models are real"
    if isinstance(node, sp.Derivative):
        return (
            f"contains {node}, a derivative that is not carried out",
            "Call .doit() on the expression; models in x(t) come in by "
            "signorini.bodies.from_lagrangian",
        )
    if isinstance(node, (sp.Integral, sp.Sum, sp.Product, sp.Limit)):
        return (
            f"contains {node}, which is not carried out",
            "Call .doit() on the expression; what has no closed form must be written as one",
        )
    if isinstance(node, AppliedUndef):
        if node.args == (dynamicsymbols._t,) or str(node.args[0]) == "t":
            return (
                f"contains {node}, a function of time",
                "Use the symbols of m.coordinates and m.velocities, or bring the model in by "
                "signorini.bodies.from_lagrangian",
            )
        return (
            f"contains {node}, a function without an expression",
            f"Put its expression in its place: .subs({node}, ...)",
        )
    if isinstance(node, (MatrixElement, sp.Indexed)):
        return (
            f"contains {node}, an entry of a symbolic array",
            "Declare scalars with m.parameters and put them in its place: .subs(...), "
            ".as_explicit()",
        )
    name = f"{type(node).__name__}({', '.join(map(str, node.args))})"
    return (
        f"contains {name}, for which C99 has no function",
        "Write it with elementary functions, for example by .rewrite(sin) or .rewrite(Piecewise)",
    )


def _product(factors: Sequence[Any], args: list[ca.SX]) -> ca.SX:
    # Factors with negative exponent go below one fraction bar: m*g/2, not m*g*(1/2).
    over: list[ca.SX] = []
    under: list[ca.SX] = []
    sign = 1
    for factor, sx in zip(factors, args, strict=True):
        if isinstance(factor, sp.Rational) and max(abs(factor.p), factor.q) < 2**53:
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
            "Make the last condition True where its value may go on outside, or add the value that "
            "holds there as (value, True)",
        )
    value = args[-2]
    for branch, condition in zip(args[-4::-2], args[-3::-2], strict=True):
        value = ca.if_else(condition, branch, value)
    return value
