"""Numbers, places and times of a program as C text."""

from dataclasses import replace

from signorini.codegen.c.loops import Entry
from signorini.codegen.c.printer import Precision
from signorini.codegen.program import (
    ARGUMENT,
    CALLER,
    FORWARD,
    STATE,
    WORK,
    Argument,
    Parameters,
    Place,
    Ref,
    Time,
)

# How the arrays of each owner are reached; a buffer of the caller has a name of its own.
_OWNERS = {WORK: "w->", STATE: "w->trial.", CALLER: "", ARGUMENT: "", FORWARD: "w->forward."}


def lvalue(ref: Ref, kind: str = "") -> str:
    """One number; results of points have the prefix of the kind of parts that they belong to."""
    of_point = ref.field and ref.owner != ARGUMENT
    text = _OWNERS[ref.owner] + (kind if of_point else "") + ref.array
    if ref.index is not None:
        text += f"[{ref.index}]"
    if ref.field:
        name, entry = ref.field
        arrow = "->" if ref.owner == ARGUMENT else "."
        text += f"{arrow}{name}[{entry}]"
    return text


def entry(ref: Ref, kind: str = "") -> Entry | None:
    """The same number as an entry of its array; None for a number that stands alone."""
    if ref.field:
        name, index = ref.field
        first = lvalue(replace(ref, field=(name, 0)), kind)
        return Entry(first.removesuffix("[0]") + "[{}]", index)
    if ref.index is None:
        return None
    return Entry(f"{_OWNERS[ref.owner]}{ref.array}[{{}}]", ref.index)


def array(name: str, owner: str) -> str:
    """The first number of an array."""
    return _OWNERS[owner] + name


def base(name: str, owner: str) -> str:
    """The argument of a C function through which an array is reached."""
    return name if owner == CALLER else "w"


def argument(value: Argument, precision: Precision, kind: str = "") -> str:
    """What is handed to an evaluating function: a pointer, a number or the parameters."""
    if isinstance(value, Parameters):
        return "par" if value.owner == WORK else f"&{_OWNERS[value.owner]}par"
    if isinstance(value, Time):
        t, h = (f"{_OWNERS[value.owner]}{name}" for name in "th")
        if value.c == 0:
            return t
        return f"{t} + {h}" if value.c == 1 else f"{t} + {precision.number(value.c)} * {h}"
    if isinstance(value, Place):
        index = "" if value.index is None else f"[{value.index}]"
        return f"&{_OWNERS[value.owner]}{kind}{value.name}{index}"
    return lvalue(value, kind) if value.index is None else f"&{lvalue(value, kind)}"
