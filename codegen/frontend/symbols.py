"""The two symbol worlds of a model file, SymPy and CasADi, behind one small interface.

Each world makes symbols and turns the user's expressions into CasADi SX, the only
representation from there on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import casadi as ca
import numpy as np
import sympy as sp
from signorini.codegen.frontend import special, sympy_to_casadi
from signorini.codegen.frontend.errors import ModelError, foreign_symbol, refuse_tuple
from signorini.codegen.frontend.sympy_to_casadi import SympyToCasadi
from signorini.codegen.frontend.vouched import is_vouched, vouch


@dataclass(frozen=True)
class par:  # noqa: N801 - reads as a declaration: parameters(R=sg.par(0.1, unit="m"))
    """A parameter's default value with what is known about it.

    Parameters
    ----------
    default : float
        Value that ``default_params`` sets.
    unit : str
        Unit, for documentation, e.g. ``"m"``.
    min, max : float or None
        Bounds that run-time values must keep.
    doc : str
        One line of documentation.
    """

    default: float
    unit: str = ""
    min: float | None = None
    max: float | None = None
    doc: str = ""


class World(Protocol):
    """What a model needs from its symbol world."""

    name: str

    def symbol(self, name: str) -> Any: ...
    def nonsmooth_part(self, expr: Any, constants: Sequence[Any]) -> str | None: ...
    def to_sx(self, model: str, equation: str, expr: Any) -> ca.SX: ...


class SymPy:
    """Symbols are `sympy.Symbol` with ``real=True``."""

    name = "sympy"

    def __init__(self) -> None:
        self._converter = SympyToCasadi()

    def symbol(self, name: str) -> sp.Symbol:
        symbol = sp.Symbol(name, real=True)
        self._converter.declare(symbol)
        return symbol

    def to_sx(self, model: str, equation: str, expr: Any) -> ca.SX:
        """Translate a scalar expression; foreign symbols and functions without C are named."""
        return self._converter.convert(model, equation, expr)

    def nonsmooth_part(self, expr: Any, constants: Sequence[Any]) -> str | None:
        """The first function of more than `constants` with a kink or a jump outside `smooth`."""
        return sympy_to_casadi.nonsmooth_part(expr, constants)


class CasADi:
    """Symbols are scalar `casadi.SX`."""

    name = "casadi"

    def __init__(self) -> None:
        self._symbols: list[ca.SX] = []
        self._known: set[int] = set()  # their hashes

    def symbol(self, name: str) -> ca.SX:
        symbol = ca.SX.sym(name)
        self._symbols.append(symbol)
        self._known.add(symbol.element_hash())
        return symbol

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Hashes of symbols are those of one process."""
        self.__dict__.update(state)
        self._known = {symbol.element_hash() for symbol in self._symbols}

    def to_sx(self, model: str, equation: str, expr: Any) -> ca.SX:
        """Check that `expr` is a real scalar in this model's symbols."""
        if type(expr) in (int, float):
            return ca.SX(expr)
        if isinstance(expr, sp.Basic) and expr.free_symbols:
            raise ModelError(
                model,
                equation,
                f"{expr} is a SymPy expression in a model with symbols='casadi'",
                "Use the symbols that this model's methods return",
            )
        if isinstance(expr, ca.MX):
            raise ModelError(
                model,
                equation,
                "is a CasADi MX",
                "Write it in the SX symbols that this model's methods return; a Function of MX is "
                "called with them after f.expand()",
            )
        refuse_tuple(model, equation, expr)
        try:
            sx = ca.SX(expr) if isinstance(expr, (ca.SX, ca.DM)) else ca.SX(float(expr))
        except (TypeError, ValueError, NotImplementedError, RuntimeError):
            raise ModelError(
                model,
                equation,
                f"{expr!r} is not a scalar expression",
                "Give a CasADi SX or a number",
            ) from None
        if sx.shape != (1, 1):
            raise ModelError(
                model,
                equation,
                f"has shape {sx.shape[0]}x{sx.shape[1]}",
                "Give scalars; several equations go into a list",
            )
        for symbol in ca.symvar(sx):
            if symbol.element_hash() not in self._known:
                raise foreign_symbol(
                    model, equation, symbol.name(), [s.name() for s in self._symbols]
                )
        return ca.densify(sx)

    def nonsmooth_part(self, expr: Any, constants: Sequence[Any]) -> str | None:
        """The first operation on more than `constants` with a kink or jump outside `smooth`."""
        fixed = {symbol.element_hash() for symbol in constants}
        seen: set[int] = set()
        stack = [ca.SX(expr)]
        while stack:
            node = stack.pop()
            key = node.element_hash()
            if key in seen or is_vouched(key) or not node.n_dep():
                continue
            seen.add(key)
            if node.op() in _NONSMOOTH_OPERATIONS and any(
                symbol.element_hash() not in fixed for symbol in ca.symvar(node)
            ):
                return str(node)
            stack.extend(node.dep(k) for k in range(node.n_dep()))
        return None


_NONSMOOTH_OPERATIONS = frozenset(
    getattr(ca, "OP_" + name)
    for name in [
        "FABS",
        "SIGN",
        "FLOOR",
        "CEIL",
        "FMOD",
        "REMAINDER",
        "FMIN",
        "FMAX",
        "COPYSIGN",
        "IF_ELSE_ZERO",
        "LT",
        "LE",
        "EQ",
        "NE",
        "NOT",
        "AND",
        "OR",
    ]
)


def smooth(expr: Any) -> Any:
    """Vouch that `expr` has two continuous derivatives although it contains branches.

    Piecewise functions, `Abs`, `Max` and the like are refused in the Lagrangian, in gaps and in
    position constraints unless they stand inside `smooth`.

    Parameters
    ----------
    expr : sympy.Expr or casadi.SX
        A scalar expression, twice continuously differentiable where the model will move.

    Returns
    -------
    sympy.Expr or casadi.SX
        The same value.
    """
    if isinstance(expr, ca.SX):
        return vouch(expr)
    return sympy_to_casadi.smooth(expr)


def norm(components: Sequence[Any]) -> Any:
    """Euclidean norm whose derivative at zero is zero: for drag and other forces ``-c |v| v``.

    The derivative of ``sqrt(x**2 + y**2)`` at zero is 0/0; this function knows better.

    Parameters
    ----------
    components : sequence of expressions
        At least one, all SymPy or all CasADi.

    Returns
    -------
    sympy.Expr or casadi.SX
        sqrt(sum of squares).

    Examples
    --------
    >>> import signorini as sg
    >>> m = sg.Model("drop")
    >>> x, y = m.coordinates("x y")
    >>> vx, vy = m.velocities
    >>> m.force([-sg.norm([vx, vy]) * vx, -sg.norm([vx, vy]) * vy])
    """
    parts = list(components) if isinstance(components, (list, tuple)) else None
    if not parts:
        raise TypeError(f"norm({components!r}): give a list of components, e.g. norm([vx, vy])")
    if any(isinstance(x, ca.SX) for x in parts):
        return special.norm([ca.SX(x) for x in parts])
    return sympy_to_casadi.norm(*(sp.sympify(x) for x in parts))


def is_number(value: Any) -> bool:
    """Whether `value` is a plain real number."""
    return isinstance(value, (int, float, np.integer, np.floating, sp.Number)) and not isinstance(
        value, bool
    )
