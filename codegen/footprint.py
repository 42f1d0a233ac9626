"""Memory and operations of a generated stepper, as its README and manifest state them."""

from dataclasses import dataclass

from signorini.codegen.layout import Struct

_INT = 4
_POINTER = 8


@dataclass(frozen=True)
class Footprint:
    """Bytes of the structs that a caller provides, bounds for stack and flash, operations.

    Attributes
    ----------
    state, work, params, options, info : int
        Sizes of the structs where int has 4 bytes and a double is aligned to 8.
    stack, flash : int
        Upper bounds for `p_simulate` with all that it calls but libm, and for code and constants,
        for gcc at -O2 on x86-64 and Cortex-M4F and M7.
    start, values, derivatives : int
        Operations of the generated code: once a step, once an evaluation, once an iteration.
    products : int
        Products of one elimination of the smooth unknowns, all problems.
    """

    state: int
    work: int
    params: int
    options: int
    info: int
    stack: int
    flash: int
    start: int
    values: int
    derivatives: int
    products: int


def struct_sizes(structs: tuple[Struct, ...], real: int) -> dict[str, int]:
    """Size of every struct with natural alignment."""
    sizes: dict[str, int] = {}
    alignments: dict[str, int] = {}
    for s in structs:
        at = alignment = 0
        for f in s.fields:
            if f.type in ("int", "real"):
                size = align = _INT if f.type == "int" else real
            elif f.type.endswith("*"):
                size = align = _POINTER
            else:
                size, align = sizes[f.type], alignments[f.type]
            alignment = max(alignment, align)
            at = -(-at // align) * align + size * (f.extent if f.dims else 1)
        sizes[s.name] = -(-at // alignment) * alignment if alignment else 0
        alignments[s.name] = alignment
    return sizes


def stack_bound(real: int, locals_: int, lines: int) -> int:
    """Bound from the locals of the largest function and the statements of all of them."""
    return 1600 + real * (locals_ + locals_ // 4 + lines // 6)


def flash_bound(lines: int, operations: int, products: int) -> int:
    """Bound from statements and operations; of software floating point the calls, not the code."""
    return (42_000 + 33 * lines + 13 * operations + 40 * products) // 1000 * 1000
