"""What a user declared of a contact, as it was written."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

# What a contact can be seen doing in one step; the sign of a slip does not count here.
MOTIONS = (
    *("open", "impacting", "separating", "persisting", "sticking", "slipping"),
    *("guard on", "guard off"),
)


@dataclass
class ContactDeclaration:
    """What `Model.contact` or `Model.friction` was called with.

    `pressed_by` is the contact whose normal percussion bounds friction with the coefficient `mu`:
    itself where empty, unless friction has a bound.
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
    never: Mapping[str, str] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        return "friction" if self.g_N is None else "contact"
