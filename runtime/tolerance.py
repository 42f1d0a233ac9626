"""How exact a run is to be, as C takes it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from signorini.runtime.arguments import reals
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError
from signorini.runtime.options import RunOptions


def scale_of(stepper: Compiled, given: Any) -> np.ndarray:
    """What 1 means of each coordinate, shape (n_q,); 1 of its unit where nothing is given.

    Raises
    ------
    RunError
        For a name that is no coordinate, or what is no positive number.
    """
    names = stepper.manifest["coordinates"]
    scale = np.ones(len(names))
    if isinstance(given, Mapping):
        for name, value in given.items():
            if name not in names:
                raise RunError(
                    f"scale: there is no coordinate '{name}'; there are: {', '.join(names)}"
                )
            scale[names.index(name)] = float(reals(f"scale of '{name}'", value))
    elif given is not None:
        array = reals("scale", given)
        if array.shape not in ((), (len(names),)):
            raise RunError(f"scale has shape {array.shape}: give one number or {len(names)}")
        scale[:] = array
    if not np.all((scale > 0) & np.isfinite(scale)):
        raise RunError(f"scale = {scale.tolist()}: give numbers > 0")
    return scale


def check_chosen(record: str, asked: bool, wanted: tuple[str, ...], alone: bool) -> None:
    """Raise for what a run of chosen steps does not have.

    Raises
    ------
    RunError
        With what to do instead.
    """
    if record == "stages":
        raise RunError('record = "stages" is of steps of one size: leave out error, and give dt')
    if asked:
        raise RunError(
            "inputs that are a function of the state are held over intervals: give dt, too, "
            "which is the interval; error chooses the steps within it"
        )
    if wanted and not alone:
        raise RunError(
            "derivatives of a batch need steps of one size: leave out error, or simulate one by one"
        )
    if "dt" in wanted:
        raise RunError(
            'of = "dt": error chooses the sizes of steps, and derivatives hold them as they are'
        )


def control_of(
    stepper: Compiled, options: RunOptions, t: float, t_end: float, h: float = 0.0
) -> Any:
    """The struct by which C chooses the sizes of steps from t to t_end."""
    control = stepper.library.structs["control"]()
    control.error, control.span, control.h = options.error, t_end - t, h
    control.t_start, control.t_end = t, t_end
    for k, value in enumerate(scale_of(stepper, options.scale)):
        control.scale[k] = value
    return control
