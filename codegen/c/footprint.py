"""Memory and operations of a generated stepper, as its README and manifest state them."""

from dataclasses import dataclass

from signorini.codegen.c.layout import Struct

_INT = 4
_POINTER = 8
SWEEPS = 2200  # of a relaxation, at most


@dataclass(frozen=True)
class Footprint:
    """Bytes of the structs that a caller provides, bounds for stack and flash, operations.

    Attributes
    ----------
    state, work, params, options, info : int
        Sizes of the structs where int has 4 bytes and a double is aligned to 8.
    control : int
        The same of what a tolerance needs; 0 where step sizes cannot follow from one.
    stack, flash : int
        Upper bounds for `p_simulate` with all that it calls but libm, and for code and constants,
        for gcc at -O2 on x86-64 and Cortex-M4F and M7.
    start, values, derivatives : int
        Operations of the generated code: once a step, once an evaluation, once an iteration.
    products : int
        Products of one elimination of the smooth unknowns, all problems.
    iteration, step : int
        Upper bounds for all operations of an iteration, whatever it has to do, and of a step of
        200 iterations without substeps.
    located : int
        The same for a step that is cut at its events; 0 where there are none.
    """

    state: int
    work: int
    params: int
    options: int
    info: int
    control: int
    stack: int
    flash: int
    start: int
    values: int
    derivatives: int
    products: int
    iteration: int
    step: int
    located: int


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


def stack_bound(real: int, locals_: int, lines: int, start: int, n_contacts: int) -> int:
    """Bound from the locals of the largest function and the statements of all of them.

    `start` is the size of what `p_init` keeps, and `p_simulate` keeps a state of every contact.
    """
    return 1600 + real * (locals_ + locals_ // 4 + lines // 6) + max(start, _INT * n_contacts)


# Code of the runtime: for any model, for several contacts or such that are pressed, for ellipses.
_ANY_FLASH, _CONTACTS_FLASH, _ELLIPTIC_FLASH = 46_000, 12_000, 12_000
LOCATED_FLASH = 20_000  # code of the runtime for steps that are cut at their events
ADAPTIVE_FLASH = 4096  # of steps whose sizes a tolerance chooses

# As in runtime/c/sg_real.h: problems that such a step may solve, and its iterations in units of the
# most that a captured one may need; how often a segment is looked at anew; places of a segment,
# evaluations to find one root, dip or positive place.
_SOLVES, _EFFORT, _TURNS = 2048, 16, 4
_PLACES, _SEARCH = 17, 40 + 24 + 20


def located_bound(
    step: int, iterations: int, iteration: int, start: int, look: int, n_contacts: int, events: int
) -> int:
    """Bound for the operations of a step that is cut at its events, without substeps.

    Parameters
    ----------
    step : int
        Bound of a captured step: the rest of the step may be taken so, and then all of it.
    iterations, iteration : int
        Most iterations of a captured step, operations of one.
    start, look : int
        Operations where a step begins, and of a look at gaps, slips and guards at one place.
    n_contacts, events : int
        Contacts; most events of a step.
    """
    solved = (_EFFORT + 1) * iterations * iteration + _SOLVES * (2 * iteration + 2 * start + look)
    looks = _TURNS * (events + 1) * (_PLACES + 3 * n_contacts * _SEARCH)
    return 2 * step + solved + looks * look


def flash_bound(lines: int, operations: int, products: int, contacts: bool, elliptic: bool) -> int:
    """Bound from statements and operations; of software floating point the calls, not the code.

    `contacts` says that there are several, or a contact with friction.
    """
    runtime = _ANY_FLASH + contacts * _CONTACTS_FLASH + elliptic * _ELLIPTIC_FLASH
    return (runtime + 33 * lines + 13 * operations + 40 * products) // 1000 * 1000


def iteration_bound(
    n_x: int,
    n_border: int,
    n: int,
    n_contacts: int,
    evaluation: int,
    derivatives: int,
    products: int,
    spatial: bool,
) -> int:
    """Bound for the operations of an iteration of one problem.

    The largest of three: Newton's iteration with its search along the direction, where rows are
    exchanged and depend on each other; a path with the most changes of state; in space a
    relaxation with the most sweeps.

    Parameters
    ----------
    n_x, n_border, n, n_contacts : int
        Smooth unknowns, with bilateral percussions, percussions, contacts at all stages.
    evaluation, derivatives, products : int
        Operations of one evaluation with its scales, of the derivatives, products of the
        elimination.
    spatial : bool
        Whether contacts are relaxed, in place of paths.
    """
    solve = 2 * n_border**2 + 2 * n_border
    factor = 6 * products + n_x**3 + 4 * n_x**2
    linear = derivatives + factor + (n + 1) * solve
    dense = n**3 + 4 * n**2
    newton = (
        8 * evaluation + 2 * linear + 8 * n * (n + 1) * n_x + dense + 2 * (5 * n**3 + 12 * n**2)
    )
    along = evaluation + linear + 4 * n**2 * n_x
    path = along + (8 * n_contacts + 16) * (dense + 12 * n**2 + 40 * n)
    relaxation = along + dense + 2 * n**3 + SWEEPS * (2 * n**2 + 60 * n)
    return max(newton, relaxation if spatial else path)
