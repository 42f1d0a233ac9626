"""What is timed: models, step sizes, starts, and what their documentation promises."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import cos, sin

from signorini.codegen.frontend.model import Model
from signorini.models import bouncing_ball, box_in_space, slider_crank, slope


@dataclass(frozen=True)
class Case:
    """One run that is timed.

    Attributes
    ----------
    name, text : str
        Name, and what moves.
    model : callable
        Returns the model.
    stages, dt, steps :
        Number of stages, step size [s], number of steps.
    q, v, parameters : dict
        What differs from the model's start and defaults.
    goal : float or None
        Median time of a step that is aimed at [us].
    flies : bool
        No contact closes: the time is also given in evaluations of all model functions.
    scheme, events : str
        Scheme, and whether steps are cut at their events.
    derivatives : str
        "forward" along all q and v, "adjoint", or "".
    """

    name: str
    text: str
    model: Callable[[], Model]
    stages: int
    dt: float
    steps: int
    q: dict[str, float] = field(default_factory=dict)
    v: dict[str, float] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)
    goal: float | None = None
    flies: bool = False
    scheme: str = "lobatto"
    events: str = "captured"
    derivatives: str = ""


_FLAT = {"z": 0.1, "p0": 1.0, "p1": 0.0, "p2": 0.0, "p3": 0.0}
_SPIN = {"x": 0.3, "p1": 1.5, "p2": -1.0, "p3": 2.0}


def _tilted(angle: float) -> dict[str, float]:
    return {"z": 0.45, "p0": cos(angle), "p1": 0.6 * sin(angle), "p2": 0.8 * sin(angle), "p3": 0.0}


_CAPTURED = (
    Case(
        "ball_bounces",
        "bouncing ball, case 1: falls, bounces, rests",
        bouncing_ball.model,
        3,
        1e-2,
        300,
        v={"phi": 0.0},
        parameters={"e_N": 0.5},
        goal=0.4,
    ),
    Case(
        "ball_slips",
        "bouncing ball, case 2: impact, slip, rolling",
        bouncing_ball.model,
        3,
        1e-2,
        110,
        v={"phi": 50.0},
        parameters={"e_N": 0.0},
        goal=0.4,
    ),
    Case(
        "slope_slides",
        "point mass on a slope, case 1: slides, stops",
        slope.model,
        3,
        1e-2,
        250,
        goal=0.6,
    ),
    Case(
        "slope_falls",
        "point mass on a slope, case 2: falls, slides, stops",
        slope.model,
        3,
        1e-2,
        250,
        q={"y": 1.5},
        goal=0.6,
    ),
    Case(
        "slider_crank",
        "slider-crank with clearance, two turns",
        slider_crank.model,
        3,
        1e-4,
        1466,
        goal=3.0,
    ),
    Case(
        "box_tumbles",
        "box in space, eight corners, thrown",
        box_in_space.model,
        2,
        2e-3,
        600,
        q=_tilted(0.4),
        v=_SPIN,
        goal=15.0,
    ),
    Case(
        "box_rests",
        "box in space at rest on four corners",
        box_in_space.model,
        2,
        2e-3,
        300,
        q=_FLAT,
        v={"x": 0.0},
        parameters={"e_N": 0.0},
        goal=10.0,
    ),
    Case(
        "box_slides",
        "box in space sliding on four corners",
        box_in_space.model,
        2,
        2e-3,
        150,
        q=_FLAT,
        v={"x": 1.5, "y": 0.4},
        parameters={"e_N": 0.0},
    ),
    Case(
        "ball_flies",
        "ball in free flight",
        bouncing_ball.model,
        3,
        1e-2,
        40,
        flies=True,
    ),
    Case(
        "box_flies",
        "box in space in free flight, spinning",
        box_in_space.model,
        2,
        2e-3,
        200,
        q=_tilted(0.4) | {"z": 5.0},
        v=_SPIN,
        flies=True,
    ),
    Case(
        "crank_flies",
        "slider-crank between walls far away",
        slider_crank.model,
        3,
        1e-4,
        1466,
        parameters={"d": 10.0},
        flies=True,
    ),
)
_LOCATED = tuple(
    replace(c, name=f"{c.name}_located", text=f"{c.text}; cut at events", goal=None,
            events="located")
    for c in _CAPTURED
)  # fmt: skip
_DERIVATIVES = tuple(
    replace(c, name=f"{c.name.removesuffix('_located')}_{kind}", derivatives=kind,
            text=f"{c.text}; derivatives {kind}")
    for c in _LOCATED if c.name.startswith(("ball_slips", "slope_slides", "slider", "box_tumbles"))
    for kind in ("forward", "adjoint")
)  # fmt: skip
CASES = (*_CAPTURED, *_LOCATED, *_DERIVATIVES)
