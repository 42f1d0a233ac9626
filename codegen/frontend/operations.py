"""The operations that expressions may contain: one list for translation, printing and display.

What an operation means is written where it is needed, in C (`cprint`), for people (`sx_to_sympy`)
and independently in `verify`; a test holds each of them against this list.
"""

from dataclasses import dataclass

import casadi as ca

Interval = tuple[float, float]
_ANY: Interval = (-2.0, 2.0)
_POSITIVE: Interval = (0.1, 2.0)
_TRUTH: Interval = (0.0, 1.0)


@dataclass(frozen=True)
class Operation:
    """One operation of CasADi's SX.

    Attributes
    ----------
    op : int
        CasADi's number of it.
    name : str
        Operator or function of C99, or a name of this package for what C writes otherwise.
    domain : tuple of intervals
        One for every operand: where the operation is defined, for tests.
    """

    op: int
    name: str
    domain: tuple[Interval, ...]

    @property
    def arity(self) -> int:
        """Number of operands."""
        return len(self.domain)


OPERATIONS: tuple[Operation, ...] = (
    Operation(ca.OP_ADD, "+", (_ANY, _ANY)),
    Operation(ca.OP_SUB, "-", (_ANY, _ANY)),
    Operation(ca.OP_MUL, "*", (_ANY, _ANY)),
    Operation(ca.OP_DIV, "/", (_ANY, _POSITIVE)),
    Operation(ca.OP_POW, "pow", (_POSITIVE, _ANY)),
    Operation(ca.OP_CONSTPOW, "pow", (_POSITIVE, _ANY)),
    Operation(ca.OP_FMIN, "fmin", (_ANY, _ANY)),
    Operation(ca.OP_FMAX, "fmax", (_ANY, _ANY)),
    Operation(ca.OP_ATAN2, "atan2", (_ANY, _ANY)),
    Operation(ca.OP_HYPOT, "hypot", (_ANY, _ANY)),
    Operation(ca.OP_FMOD, "fmod", (_ANY, _POSITIVE)),
    Operation(ca.OP_REMAINDER, "remainder", (_ANY, _POSITIVE)),
    Operation(ca.OP_COPYSIGN, "copysign", (_ANY, _ANY)),
    Operation(ca.OP_LT, "<", (_ANY, _ANY)),
    Operation(ca.OP_LE, "<=", (_ANY, _ANY)),
    Operation(ca.OP_EQ, "==", (_ANY, _ANY)),
    Operation(ca.OP_NE, "!=", (_ANY, _ANY)),
    Operation(ca.OP_AND, "&&", (_TRUTH, _TRUTH)),
    Operation(ca.OP_OR, "||", (_TRUTH, _TRUTH)),
    Operation(ca.OP_IF_ELSE_ZERO, "if_else_zero", (_TRUTH, _ANY)),
    Operation(ca.OP_NEG, "neg", (_ANY,)),
    Operation(ca.OP_SQ, "sq", (_ANY,)),
    Operation(ca.OP_TWICE, "twice", (_ANY,)),
    Operation(ca.OP_INV, "inv", (_POSITIVE,)),
    Operation(ca.OP_SQRT, "sqrt", (_POSITIVE,)),
    Operation(ca.OP_SIN, "sin", (_ANY,)),
    Operation(ca.OP_COS, "cos", (_ANY,)),
    Operation(ca.OP_TAN, "tan", ((-1.4, 1.4),)),
    Operation(ca.OP_ASIN, "asin", ((-0.9, 0.9),)),
    Operation(ca.OP_ACOS, "acos", ((-0.9, 0.9),)),
    Operation(ca.OP_ATAN, "atan", (_ANY,)),
    Operation(ca.OP_SINH, "sinh", (_ANY,)),
    Operation(ca.OP_COSH, "cosh", (_ANY,)),
    Operation(ca.OP_TANH, "tanh", (_ANY,)),
    Operation(ca.OP_ASINH, "asinh", (_ANY,)),
    Operation(ca.OP_ACOSH, "acosh", ((1.1, 3.0),)),
    Operation(ca.OP_ATANH, "atanh", ((-0.9, 0.9),)),
    Operation(ca.OP_EXP, "exp", (_ANY,)),
    Operation(ca.OP_EXPM1, "expm1", (_ANY,)),
    Operation(ca.OP_LOG, "log", (_POSITIVE,)),
    Operation(ca.OP_LOG1P, "log1p", ((-0.9, 2.0),)),
    Operation(ca.OP_FABS, "fabs", (_ANY,)),
    Operation(ca.OP_FLOOR, "floor", (_ANY,)),
    Operation(ca.OP_CEIL, "ceil", (_ANY,)),
    Operation(ca.OP_SIGN, "sign", (_ANY,)),
    Operation(ca.OP_ERF, "erf", (_ANY,)),
    Operation(ca.OP_NOT, "!", (_TRUTH,)),
)
BY_NUMBER: dict[int, Operation] = {operation.op: operation for operation in OPERATIONS}
# Part of every CasADi function, and no operation.
PLUMBING = frozenset({ca.OP_ASSIGN, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_PARAMETER})
