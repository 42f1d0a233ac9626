"""What a user declared of a contact, as it was written."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

# What a contact can be seen doing in one step; the sign of a slip does not count here.
MOTIONS = (
    *("open", "impacting", "separating", "persisting", "sticking", "slipping"),
    *("guard on", "guard off"),
)


@dataclass(frozen=True)
class Reaction:
    """The size of what a constraint carries: the norm of its percussions, or of some of its rows.

    Attributes
    ----------
    name : str
        Of the constraint.
    first, count : int
        Its rows that count; None: all from the first on.
    factor : expression
        A coefficient that it was multiplied with.
    """

    name: str
    first: int = 0
    count: int | None = None
    factor: Any = 1

    def __mul__(self, factor: Any) -> "Reaction":
        return replace(self, factor=self.factor * factor)

    __rmul__ = __mul__


@dataclass
class ContactDeclaration:
    """What `Model.contact` or `Model.friction` was called with.

    `pressed_by` is the contact whose normal percussion bounds friction with the coefficient `mu`:
    itself where empty, unless friction has a bound. With `one_way` `g_N` is a velocity.
    """

    name: str
    g_N: Any
    gamma_F: list[Any]
    mu: Any = 0
    e_N: Any = 0
    e_F: Any = 0
    bound: Any = None
    guard: Any = None
    pressed_by: str = ""
    load: Reaction | None = None
    one_way: bool = False
    impact: str = "newton"
    mu_at: str = "start"
    never: Mapping[str, str] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        return "friction" if self.g_N is None else "contact"
