"""What a scene of the corpus is."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from signorini.codegen.frontend.model import Model


@dataclass(frozen=True)
class Case:
    """One run of a scene.

    Attributes
    ----------
    dt : float
        Step size.
    q, v : mapping or array
        Start; what is not given comes from the model. The nearest consistent state is taken.
    parameters : dict
        Values that differ from the defaults.
    t : float or None
        Start time.
    passive : bool
        No energy may be gained: e_N = e_F = 0, or no friction and equal e_N, and
        nothing moves on its own or is driven.
    """

    dt: float
    q: Any = None
    v: Any = None
    parameters: dict[str, float] = field(default_factory=dict)
    t: float | None = None
    passive: bool = False


@dataclass(frozen=True)
class Scene:
    """A family of runs of one model.

    Attributes
    ----------
    name, text : str
        Name, and what is hard about it.
    model : callable
        Returns the model.
    draw : callable
        From a random generator to a `Case`.
    steps : int
        Horizon of a run in steps.
    share : float
        How many runs this scene gets, relative to the others.
    """

    name: str
    text: str
    model: Callable[[], Model]
    draw: Callable[[np.random.Generator], Case]
    steps: int
    share: float = 1.0
