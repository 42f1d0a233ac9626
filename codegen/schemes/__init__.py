"""Time-stepping schemes as programs over derived functions; no line of C.

Every module here that has a `REGISTERED` is a scheme, or another form of one; nothing else has to
know it. Its reference for `check` stands in verify/schemes under the same name.
"""

import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module

from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.program import Scheme

# What happens at an impact within a step: it is smeared over the step, or the step is cut there.
EVENTS = ("captured", "located")

__all__ = ["EVENTS", "Registered", "find", "names", "velocity_form"]


@dataclass(frozen=True)
class Registered:
    """One scheme, or one form of velocity constraints of it.

    Attributes
    ----------
    name : str
        What `build` is asked for.
    make : callable (Derivation, stages, value) -> Scheme
        The scheme for a model; `value` is that of its option, if it has one.
    form : str
        Form of velocity constraints: "paper", where (51) holds, or another one.
    unfit : callable (ModelData) -> str
        Why the form cannot be had for a model; "" if it can, and then it is the default.
    events : str
        "captured", or "located" where steps are cut at their events.
    option : tuple (default, smallest, largest) or None
        A number that is asked for as ``name=number``.
    """

    name: str
    make: Callable[[Derivation, int, float], Scheme]
    form: str = "paper"
    unfit: Callable[[ModelData], str] | None = None
    events: str = "captured"
    option: tuple[float, float, float] | None = None


@cache
def _all() -> tuple[Registered, ...]:
    modules = sorted(module.name for module in pkgutil.iter_modules(__path__))
    found = (getattr(import_module(f"{__name__}.{name}"), "REGISTERED", None) for name in modules)
    return tuple(r for r in found if r is not None)


def names() -> list[str]:
    """Every scheme that can be asked for."""
    return sorted({r.name for r in _all()})


def find(asked: str, form: str, events: str = "captured") -> tuple[Registered, float]:
    """The scheme in a form, and the value of its option.

    Raises
    ------
    ValueError
        If there is none of that name, or the option is out of its range.
    """
    name, _, text = str(asked).partition("=")
    if events not in EVENTS:
        raise ValueError(f"events {events!r} is unknown; choose one of: {', '.join(EVENTS)}")
    found = [r for r in _all() if r.name == name and r.events == events and r.form in (form, "any")]
    if not found and name in names() and events != "captured":
        raise ValueError(f"scheme {asked!r} has no {events} events; use scheme 'lobatto'")
    if not found:
        known = (f"{n}[=number]" if find(n, "paper")[0].option else n for n in names())
        raise ValueError(f"scheme {asked!r} is unknown; there is: {', '.join(known)}")
    registered = found[0]
    if registered.option is None:
        if text:
            raise ValueError(f"scheme {asked!r}: {name} has no option")
        return registered, 0.0
    default, low, high = registered.option
    try:
        value = float(text) if text else default
    except ValueError:
        value = low - 1
    if not low <= value <= high:
        raise ValueError(f"scheme {asked!r}: give {name}=number from {low:g} to {high:g}")
    return registered, value


def _compliant(data: ModelData) -> str:
    return (
        f"'{data.compliances[0].name}' is compliant, and compliance is part of the Lobatto "
        "scheme's captured steps alone. Use scheme='lobatto' with events='captured', or write the "
        "spring as a potential."
    )


def unlocated(data: ModelData) -> str:
    """Why events of a model cannot be located; empty where they can."""
    if data.compliances:
        return _compliant(data)
    for c in data.contacts:
        if c.one_way:
            return (
                f"'{c.name}' goes one way by its velocity, and events of such contacts are not "
                "located. Use events='captured'."
            )
        if c.load is not None:
            return (
                f"friction '{c.name}' is pressed by a constraint, and events of such friction are "
                "not located. Use events='captured'."
            )
    return ""


def velocity_form(data: ModelData, scheme: str, asked: str | None, events: str = "captured") -> str:
    """The form of velocity constraints in use: the best that can be had, or the one asked for.

    Raises
    ------
    ValueError
        If it is unknown, or the scheme does not have it for this model.
    """
    name = str(scheme).partition("=")[0]
    known = sorted(
        {r.form for r in _all() if r.form != "any"}, key=lambda form: (form != "paper", form)
    )
    if asked is not None and asked not in known:
        raise ValueError(
            f"velocity_constraints {asked!r} is unknown; choose one of: {', '.join(known)}"
        )
    if data.compliances and name != "lobatto":
        raise ValueError(f"model '{data.name}', scheme {scheme!r}: {_compliant(data)}")
    if events == "located":
        if reason := unlocated(data):
            raise ValueError(f"model '{data.name}', events='located': {reason}")
        if asked == "paper":
            raise ValueError(
                f"model '{data.name}', velocity_constraints='paper': located steps have them at "
                "full order. Leave the option out, or take events='captured'."
            )
        return "full_order" if data.n_gamma or asked else "paper"
    others = [r for r in _all() if r.name == name and r.form not in ("paper", "any")]
    reasons = {r.form: r.unfit(data) if r.unfit else "" for r in others}
    if asked is None:
        return next((form for form, reason in reasons.items() if not reason), "paper")
    reason = "" if asked == "paper" else reasons.get(asked, f"the scheme is {scheme}")
    if reason:
        raise ValueError(
            f"model '{data.name}', velocity_constraints={asked!r}: {reason}. Use 'paper'."
        )
    return asked
