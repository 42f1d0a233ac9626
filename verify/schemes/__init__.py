"""References of the schemes, one file each; `Reference` itself is that of the paper's scheme."""

import pkgutil
from functools import cache
from importlib import import_module

from signorini.verify.reference import Reference


@cache
def _all() -> dict[tuple[str, str], type[Reference]]:
    found = {Reference.scheme: Reference}
    for module in pkgutil.iter_modules(__path__):
        reference: type[Reference] = import_module(f"{__name__}.{module.name}").REFERENCE
        found[reference.scheme] = reference
    return found


def find(scheme: str, form: str, events: str = "captured") -> type[Reference]:
    """The reference of a scheme and its form of velocity constraints, or of its located steps.

    Raises
    ------
    KeyError
        If there is none: such a scheme cannot be checked.
    """
    name = scheme.partition("=")[0]
    form = "located" if events == "located" else form
    if (name, form) not in _all():
        raise KeyError(f"the scheme {name!r} in the form {form!r} has no reference")
    return _all()[name, form]
