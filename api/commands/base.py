"""What commands share: the application, kinds of arguments, groups of options."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, Parameter, Token
from signorini.runtime.arguments import plain_number
from signorini.runtime.errors import RunError
from signorini.version import __version__


def _decimal(kind: type, tokens: Sequence[Token]) -> Any:
    """A plain decimal number from the command line."""
    text = tokens[0].value
    number = plain_number(text)
    if number is None or (kind is int and not number.is_integer()):
        raise ValueError(
            f"{text!r} is no decimal number" if kind is float else f"{text!r} is no whole number"
        )
    return kind(number)


Real = Annotated[float, Parameter(converter=_decimal)]
Whole = Annotated[int, Parameter(converter=_decimal)]
Pairs = Annotated[list[str] | None, Parameter(consume_multiple=True, negative=())]
Switch = Annotated[bool, Parameter(negative=())]

app = App(
    name="signorini",
    help="From a symbolic mechanical model with contact to a standalone C stepper.",
    version=__version__,
    suppress_keyboard_interrupt=False,
)


@Parameter(name="*")
@dataclass(frozen=True)
class Form:
    """What is generated of a model, but for the number of stages."""

    scheme: Annotated[
        str,
        Parameter(
            help="lobatto; moreau (midpoint) or theta[=VALUE] (theta-method, 0.5 to 1): contacts "
            "on velocity level."
        ),
    ] = "lobatto"
    velocity_constraints: Annotated[
        Literal["paper", "full_order"] | None,
        Parameter(help="paper, or full_order: the default for models without contacts."),
    ] = None
    precision: Annotated[
        Literal["double", "float", "extended"],
        Parameter(help="Real type of the generated C; extended is long double, to verify."),
    ] = "double"
    events: Annotated[
        Literal["captured", "located"],
        Parameter(help="located: steps can be cut at impacts and changes of stick and slip."),
    ] = "captured"

    def keywords(self) -> dict[str, Any]:
        """As `build` takes them."""
        return {
            "scheme": self.scheme,
            "velocity_constraints": self.velocity_constraints,
            "precision": self.precision,
            "events": self.events,
        }


@Parameter(name="*")
@dataclass(frozen=True)
class Built(Form):
    """What is generated of a model."""

    stages: Annotated[
        Whole, Parameter(help="Number of stages s of the Lobatto scheme, at least 2.")
    ] = 3

    def keywords(self) -> dict[str, Any]:
        """As `build` takes them."""
        return {"stages": self.stages, **super().keywords()}


@Parameter(name="*")
@dataclass(frozen=True)
class Grid:
    """The time of a run, and its parameters.

    Parameters
    ----------
    dt
        Step size, by default what the model suggests or 0.01.
    t_end
        End of the run, by default what the model suggests or 2.
    error
        Wanted error of the coordinates at the end: the sizes of steps follow from it, and --dt is
        the interval of the rows.
    set
        Parameters, NAME=VALUE ...
    """

    dt: Real | None = None
    t_end: Real | None = None
    error: Real | None = None
    set: Pairs = None

    def over(self, suggested: dict[str, Any]) -> dict[str, Any]:
        """dt, t_end, inputs, error: those given, those the model suggests, or plain ones."""
        given = {"dt": self.dt, "t_end": self.t_end, "error": self.error}
        plain = {"dt": 1e-2, "t_end": 2.0, "inputs": None}
        found = plain | suggested | {k: v for k, v in given.items() if v is not None}
        if self.error is not None and self.dt is None and found["inputs"] is None:
            found["dt"] = None  # rows are the steps
        return found

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters that differ from the defaults."""
        return pairs_of("--set", self.set)


def pairs_of(option: str, pairs: list[str] | None) -> dict[str, float]:
    """NAME=VALUE ... as a dictionary."""
    values: dict[str, float] = {}
    for pair in pairs or []:
        name, equals, text = pair.partition("=")
        number = plain_number(text)
        if not name or not equals or number is None:
            raise RunError(f"{option} {pair}: write NAME=VALUE with a finite decimal number")
        if name in values:
            raise RunError(f"{option}: '{name}' is given twice")
        values[name] = number
    return values


def check_file(path: Path) -> None:
    if not path.resolve().parent.is_dir():
        raise RunError(f"there is no folder {path.resolve().parent} for {path.name}")
    if path.is_dir():
        raise RunError(f"{path} is a folder: give a file name")


def check_figure(option: str, path: Path) -> None:
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise RunError(f"{option} {path}: give a name that ends in .png, .pdf or .svg")
    check_file(path)
