"""Tables: twice continuously differentiable functions through measured points, in 1D and 2D.

A table enters an expression as a polynomial in the distance from the corner of the cell that its
argument lies in. Corner and coefficients are what a CasADi function of the argument returns; it is
constant between the points, so that its derivatives are zero and those of the polynomial are right.
In C it is a search and rows of numbers (`runtime/c/sg_cell.c`).
"""

import hashlib
import itertools
import math
import re
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
import sympy as sp
from signorini.codegen.frontend.errors import refuse_tuple
from signorini.codegen.frontend.names import check_identifier
from signorini.codegen.frontend.vouched import vouch

ENDS = ("natural", "not-a-knot", "periodic")
_DEGREE = 3
_MOST_POINTS = 2000  # of one direction: the slopes follow from a full system of equations
_MOST_CELLS = 10_000


class Table:
    """A cubic spline through points, see `table`.

    Attributes
    ----------
    name : str
        What the user called it, or "".
    function : str
        Name of the CasADi function that returns corner and coefficients of a cell; unique to the
        numbers.
    points : tuple of arrays
        Points of every direction.
    cells : array, shape (cells of the first direction, [of the second,] entries)
        Corner and coefficients, c[k] or c[k, l], row by row, of every cell; the first and the last
        of a direction lie beyond its ends.
    """

    def __init__(
        self, name: str, points: Sequence[np.ndarray], values: np.ndarray, ends: Sequence[str]
    ) -> None:
        self.name = name
        self.points = tuple(points)
        self.values = values
        self.ends = tuple(ends)
        self.cells = _cells(self.points, values, self.ends)
        numbers = hashlib.sha256(repr((name, self.ends)).encode())
        for array in (*self.points, values):
            numbers.update(repr(array.shape).encode() + array.tobytes())
        self.function = f"table_{numbers.hexdigest()[:16]}"
        self._applied: dict[tuple[int, ...], type[Applied]] = {}
        self._cell: ca.Function | None = None
        _known[self.function] = self

    def __repr__(self) -> str:
        extent = " x ".join(str(p.size) for p in self.points)
        return f"<table {self.name or self.function} of {extent} points>"

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (self.name, self.points, self.values, self.ends)

    @property
    def dimension(self) -> int:
        """Number of arguments."""
        return len(self.points)

    def __call__(self, *arguments: Any) -> Any:
        """Value at `arguments`: SymPy or CasADi expressions, or numbers (then a float).

        Raises
        ------
        TypeError
            For another number of arguments, or for what is no scalar.
        """
        if len(arguments) != self.dimension:
            raise TypeError(f"{self!r} takes {self.dimension} arguments, not {len(arguments)}")
        for x in arguments:
            refuse_tuple(self.name or "table", "the argument", x)
            if isinstance(x, ca.MX) or (np.ndim(x) if not isinstance(x, ca.SX) else x.numel() != 1):
                raise TypeError(f"{self!r}: the argument {x!r} is no scalar of SymPy or CasADi SX")
        if any(isinstance(x, ca.SX) for x in arguments):
            return self.sx([ca.SX(x) for x in arguments], (0,) * self.dimension)
        expressions = [sp.sympify(x) for x in arguments]
        if all(x.is_number for x in expressions):
            return self._number([float(x) for x in expressions])
        return self.applied((0,) * self.dimension)(*expressions)

    def _number(self, arguments: Sequence[float]) -> float:
        symbols = [ca.SX.sym(letter) for letter in "xy"[: self.dimension]]
        value = self.sx(symbols, (0,) * self.dimension)
        return float(ca.Function("value", symbols, [value])(*arguments))

    def applied(self, orders: tuple[int, ...]) -> "type[Applied]":
        """The SymPy function of a derivative of the table."""
        if orders not in self._applied:
            title = self.name or self.function
            if any(orders):
                title += "_" + "".join(
                    x * n for x, n in zip("xy", orders, strict=self.dimension == 2)
                )
            attributes = {"table": self, "orders": orders, "nargs": self.dimension}
            self._applied[orders] = type(title, (Applied,), attributes)
        return self._applied[orders]

    def sx(self, arguments: Sequence[ca.SX], orders: Sequence[int]) -> ca.SX:
        """A derivative of the table as a polynomial in the distance from the cell's corner."""
        inside = [
            self._reduced(x, k) if self.ends[k] == "periodic" else x
            for k, x in enumerate(arguments)
        ]
        cell = self.cell()(*inside)
        distance = [x - cell[k] for k, x in enumerate(inside)]
        coefficients = [cell[k] for k in range(self.dimension, cell.numel())]
        n = _DEGREE + 1
        if self.dimension == 1:
            return vouch(_polynomial(coefficients, distance[0], orders[0]))
        columns = [
            _polynomial(coefficients[k * n : (k + 1) * n], distance[1], orders[1]) for k in range(n)
        ]
        return vouch(_polynomial(columns, distance[0], orders[0]))

    def _reduced(self, x: ca.SX, k: int) -> ca.SX:
        first, last = self.points[k][0], self.points[k][-1]
        return x - (last - first) * ca.floor((x - first) / (last - first))

    def cell(self) -> ca.Function:
        """Corner and coefficients of the cell in which the arguments lie."""
        if self._cell is None:
            x = [ca.SX.sym(letter) for letter in "xy"[: self.dimension]]
            shape = self.cells.shape[:-1]
            chosen = ca.SX(ca.DM(self.cells[(0,) * self.dimension]))
            beyond = [
                [ca.SX(1)] + [x[k] >= p for p in self.points[k]] for k in range(self.dimension)
            ]
            if self.dimension == 1:
                for i in range(1, shape[0]):
                    chosen = ca.if_else(beyond[0][i], ca.DM(self.cells[i]), chosen)
            else:
                rows = []
                for i in range(shape[0]):
                    row = ca.SX(ca.DM(self.cells[i, 0]))
                    for j in range(1, shape[1]):
                        row = ca.if_else(beyond[1][j], ca.DM(self.cells[i, j]), row)
                    rows.append(row)
                chosen = rows[0]
                for i in range(1, shape[0]):
                    chosen = ca.if_else(beyond[0][i], rows[i], chosen)
            options: dict[str, Any] = {"never_inline": True, "is_diff_in": [False] * self.dimension}
            self._cell = ca.Function(self.function, x, [chosen], options)
        return self._cell


_known: dict[str, Table] = {}


def _again(*content: Any) -> Table:
    return Table(*content)


class Applied(sp.Function):
    """A table, or a derivative of one, of SymPy expressions."""

    table: Table
    orders: tuple[int, ...]

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """The derivative of the table in one of its arguments."""
        orders = tuple(n + (k == argindex - 1) for k, n in enumerate(self.orders))
        return self.table.applied(orders)(*self.args)

    def _eval_is_extended_real(self) -> bool:
        return True

    def _eval_is_finite(self) -> bool:
        return True

    def __reduce_ex__(self, protocol: Any) -> tuple[Any, ...]:
        return _apply, (self.table, self.orders, self.args)


def _apply(table: Table, orders: tuple[int, ...], arguments: tuple[sp.Expr, ...]) -> sp.Expr:
    return table.applied(orders)(*arguments)


def table(
    points: Any, values: Any, *, ends: str | Sequence[str] = "natural", name: str = ""
) -> Table:
    """A smooth function through given points: a cubic spline in one or two variables.

    The result is called with expressions, ``sg.table(s, F)(x)``, and stands in forces, gaps,
    constraints, outputs and the Lagrangian. It has two continuous derivatives everywhere, beyond
    the ends, too. The generated C holds the numbers as data and finds the cell by bisection; its
    text does not grow with the number of points otherwise.

    Parameters
    ----------
    points : array (n,), or two arrays (n_x,), (n_y,)
        Increasing. In two dimensions a pair.
    values : array (n,) or (n_x, n_y)
        Values at the points.
    ends : {"natural", "not-a-knot", "periodic"}, or a pair of them
        "natural": no curvature at the ends, and straight on beyond them. "not-a-knot": the third
        derivative is continuous at the last point but one, which fits a smooth function better;
        beyond the ends the curvature stays. "periodic": values repeat, the last is the first.
    name : str
        Name in the generated C, an identifier.

    Returns
    -------
    Table
        To be called with one or two arguments.

    Raises
    ------
    ValueError
        If the numbers are no table; it says which one.

    Examples
    --------
    >>> import signorini as sg
    >>> m = sg.Model("car")
    >>> (x,) = m.coordinates("x")
    >>> (v,) = m.velocities
    >>> drag = sg.table([0, 10, 20, 40], [0, 30, 90, 420], name="drag")
    >>> m.force([-drag(v)])
    """
    numbers = np.array(_floats("values", values), dtype=float)
    if numbers.ndim not in (1, 2):
        raise ValueError(f"values have {numbers.ndim} dimensions: tables have one or two")
    axes = [points] if numbers.ndim == 1 else points
    if numbers.ndim == 2 and not _is_pair(points):
        raise ValueError("values are a matrix: give points as a pair, (x, y)")
    grids = [np.array(_floats("points", axis), dtype=float) for axis in axes]
    kinds = [ends] * numbers.ndim if isinstance(ends, str) else list(ends)
    if len(kinds) != numbers.ndim or not all(kind in ENDS for kind in kinds):
        raise ValueError(f"ends = {ends!r}: choose from {', '.join(ENDS)}, one for each direction")
    if name:
        check_identifier("table", "its name", name)
    for k, (grid, kind) in enumerate(zip(grids, kinds, strict=True)):
        what = "points" if numbers.ndim == 1 else f"points of direction {k}"
        _check_direction(what, grid, kind, numbers, k)
    if math.prod(grid.size + 1 for grid in grids) > _MOST_CELLS:
        raise ValueError(f"the table has more than {_MOST_CELLS} cells: thin the points out")
    return Table(name, grids, numbers, kinds)


def _is_pair(points: Any) -> bool:
    sized = hasattr(points, "__len__") and not isinstance(points, str)
    return sized and len(points) == 2 and all(np.ndim(axis) == 1 for axis in points)


def _floats(what: str, numbers: Any) -> np.ndarray:
    try:
        array = np.array(numbers, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{what} are no array of numbers: {numbers!r}") from None
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{what} must be finite")
    return array


def _check_direction(what: str, grid: np.ndarray, kind: str, values: np.ndarray, k: int) -> None:
    least = {"natural": 2, "not-a-knot": 4, "periodic": 3}[kind]
    if grid.ndim != 1 or not least <= grid.size <= _MOST_POINTS:
        raise ValueError(
            f"{what} have shape {grid.shape}: {least} to {_MOST_POINTS} numbers are needed "
            f"with ends='{kind}'"
        )
    if grid.size != values.shape[k]:
        raise ValueError(f"{what}: {grid.size} of them, but values have shape {values.shape}")
    steps = np.diff(grid)
    if not np.all(steps > 0):
        j = int(np.argmin(steps > 0))
        raise ValueError(f"{what} must increase: {grid[j]:g} is followed by {grid[j + 1]:g}")
    if kind == "periodic":
        first, last = values.take(0, axis=k), values.take(-1, axis=k)
        if not np.array_equal(first, last):
            raise ValueError(f"ends='periodic': the last values of {what} must be the first ones")


def known(name: str) -> Table | None:
    """The table whose CasADi function has a name."""
    return _known.get(name)


def all_known() -> list[Table]:
    """Every table of this process."""
    return list(_known.values())


_RATE = re.compile(r"(?:(?:fwd|adj)\d+_)+(table_[0-9a-f]{16})\Z")


def is_rate(name: str) -> bool:
    """Whether a CasADi function is a derivative of a cell, which is zero."""
    found = _RATE.match(name)
    return found is not None and found[1] in _known


def used(expr: ca.SX) -> list[Table]:
    """Tables in an expression."""
    if not _known:
        return []
    f = ca.Function("f", [ca.vertcat(ca.SX(0, 1), *ca.symvar(expr))], [expr])
    found = (known(g.name()) for g in f.find_functions(0))
    return sorted({t for t in found if t is not None}, key=lambda t: t.function)


def without_rates(expr: ca.SX) -> ca.SX:
    """The same expression; derivatives of cells, all zero, are taken out."""
    if not _known or not expr.nnz():
        return expr
    symbols = ca.vertcat(ca.SX(0, 1), *ca.symvar(expr))
    f = ca.Function("f", [symbols], [expr])
    if not any(is_rate(g.name()) for g in f.find_functions(0)):
        return expr
    nodes = f.instructions_sx()
    work: dict[int, ca.SX] = {}
    entries: dict[int, ca.SX] = {}
    for k in range(f.n_instructions()):
        op, i, o = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if op == ca.OP_INPUT:
            work[o[0]] = symbols[i[1]]
        elif op == ca.OP_CONST:
            work[o[0]] = ca.SX(f.instruction_constant(k))
        elif op == ca.OP_OUTPUT:
            entries[o[1]] = work[i[0]]
        elif op == ca.OP_CALL:
            cell = nodes[k].which_function()
            zero = is_rate(cell.name())
            values = ca.SX.zeros(len(o), 1) if zero else cell(*(work[j] for j in i))
            for j, to in enumerate(o):
                if to >= 0:
                    work[to] = values[j]
        elif len(i) == 1:
            work[o[0]] = ca.SX.unary(op, work[i[0]])
        else:
            work[o[0]] = ca.SX.binary(op, work[i[0]], work[i[1]])
    return ca.SX(expr.sparsity(), ca.vertcat(*(entries[k] for k in range(expr.nnz()))))


def _polynomial(coefficients: Sequence[ca.SX], x: ca.SX, order: int) -> ca.SX:
    """A derivative of sum c_k x^k, by Horner's rule."""
    value = ca.SX(0)
    for k in range(len(coefficients) - 1, order - 1, -1):
        value = value * x + math.perm(k, order) * coefficients[k]
    return value


def _cells(points: Sequence[np.ndarray], values: np.ndarray, ends: Sequence[str]) -> np.ndarray:
    """Corner and coefficients of every cell."""
    operators = [_operators(p, e) for p, e in zip(points, ends, strict=True)]
    corners = [np.concatenate(([p[0]], p)) for p in points]
    if len(points) == 1:
        coefficients = [operator @ values for operator in operators[0]]
        return np.column_stack([corners[0], *coefficients])
    blocks = [a @ values @ b.T for a, b in itertools.product(*operators)]
    x, y = np.meshgrid(*corners, indexing="ij")
    return np.stack([x, y, *blocks], axis=-1)


def _operators(x: np.ndarray, ends: str) -> list[np.ndarray]:
    """Matrices from the values at the points to the coefficients c_0 ... c_3 of all cells.

    The first cell lies before the first point, the last beyond the last.
    """
    n = x.size
    h = np.diff(x)[:, None]
    one = np.eye(n)
    slope = _slopes(x, ends)
    delta = np.diff(one, axis=0) / h
    c2 = (3 * delta - 2 * slope[:-1] - slope[1:]) / h
    c3 = (slope[:-1] + slope[1:] - 2 * delta) / h**2
    last = c2[-1:] + 3 * c3[-1:] * h[-1]
    first = c2[:1]
    if ends == "natural":
        first, last = 0 * first, 0 * last
    beyond = np.zeros((1, n))
    return [
        np.vstack([one[:1], one]),
        np.vstack([slope[:1], slope]),
        np.vstack([first, c2, last]),
        np.vstack([beyond, c3, beyond]),
    ]


def _slopes(x: np.ndarray, ends: str) -> np.ndarray:
    """Matrix from the values at the points to the slopes there: second derivatives meet."""
    n = x.size
    h = np.diff(x)
    left = np.zeros((n, n))
    right = np.zeros((n, n))
    delta = np.diff(np.eye(n), axis=0) / h[:, None]
    for i in range(1, n - 1):
        left[i, i - 1 : i + 2] = 1 / h[i - 1], 2 / h[i - 1] + 2 / h[i], 1 / h[i]
        right[i] = 3 * (delta[i - 1] / h[i - 1] + delta[i] / h[i])
    if ends == "natural":
        left[0, :2] = left[-1, :-3:-1] = 2, 1
        right[0], right[-1] = 3 * delta[0], 3 * delta[-1]
    elif ends == "not-a-knot":
        for row, (i, j) in ((0, (0, 1)), (-1, (n - 2, n - 3))):
            for k, sign in ((i, 1.0), (j, -1.0)):  # third derivatives of neighbours meet
                left[row, k] += sign / h[k] ** 2
                left[row, k + 1] += sign / h[k] ** 2
                right[row] += sign * 2 * delta[k] / h[k] ** 2
    else:
        left[0, [0, -1]] = 1, -1
        left[-1, 0], left[-1, -1] = 2 / h[0], 2 / h[-1]
        left[-1, 1] += 1 / h[0]
        left[-1, -2] += 1 / h[-1]
        right[-1] = 3 * (delta[0] / h[0] + delta[-1] / h[-1])
    solution: np.ndarray = np.linalg.solve(left, right)
    return solution
