"""Tables as the C text holds them: arrays of numbers, and a function that finds the cell."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from signorini.codegen.c.printer import Precision
from signorini.codegen.frontend.table import Table

_WIDTH = 92


@dataclass(frozen=True)
class Axis:
    """Points of one direction."""

    letter: str
    count: int
    lines: tuple[str, ...]


@dataclass(frozen=True)
class CTable:
    """One table.

    Attributes
    ----------
    name : str
        What its C names begin with, behind the model's prefix.
    axes : tuple of Axis
        Points of every direction.
    entries : int
        Numbers of a cell: its corner and coefficients.
    lines : tuple of str
        All cells, one line or more for each, row by row.
    numbers : int
        Numbers in all.
    """

    name: str
    axes: tuple[Axis, ...]
    entries: int
    lines: tuple[str, ...]
    numbers: int


def c_table(name: str, table: Table, precision: Precision) -> CTable:
    """The text of a table."""
    cells = table.cells.reshape(-1, table.cells.shape[-1])
    return CTable(
        name=name,
        axes=tuple(
            Axis(letter, points.size, _lines(points, precision))
            for letter, points in zip("xy", table.points, strict=False)
        ),
        entries=cells.shape[1],
        lines=tuple(line for cell in cells for line in _lines(cell, precision)),
        numbers=sum(points.size for points in table.points) + cells.size,
    )


def _lines(numbers: Sequence[float] | np.ndarray, precision: Precision) -> tuple[str, ...]:
    text = ", ".join(precision.number(float(x)) for x in numbers) + ","
    return tuple(textwrap.wrap(text, _WIDTH, break_long_words=False))
