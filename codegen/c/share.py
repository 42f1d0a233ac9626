"""A public function that is made of what it is of each part, as the templates print it."""

from dataclasses import dataclass

import numpy as np
from signorini.codegen.c.functions import CFunction

# What the rows of a function count, and its columns; "one" is summed up over the parts.
SPACES = (
    *("one", "q", "g", "gamma", "N", "F", "contacts", "bounds", "compliances", "R"),
    *("points", "axes"),
)


@dataclass(frozen=True)
class SharedFunction:
    """A public function that is made of what it is of each part.

    Attributes
    ----------
    public : CFunction
        Its declaration.
    rows, columns : str
        What they count.
    kinds : tuple of (int, CFunction)
        The function of each kind that has one.
    buffers : tuple of (str, int)
        Arguments and results of one part.
    width : int
        Columns of the whole.
    sparse : bool
        Whether parts of some kind have nothing of it.
    rest : CFunction or None
        What fills the rows that no part has a share of, and all others with zeros.
    """

    public: CFunction
    rows: str
    columns: str
    kinds: tuple[tuple[int, CFunction], ...]
    buffers: tuple[tuple[str, int], ...]
    width: int
    sparse: bool
    rest: CFunction | None = None

    @property
    def size(self) -> int:
        """Numbers of the whole."""
        return int(np.prod(self.public.shape))
