"""Arguments of runs: numbers, arrays and time grids, checked by name."""

import math
import os
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from signorini.runtime.errors import RunError


def number(what: str, value: Any) -> float:
    """`value` as a finite float; `RunError` names `what` otherwise."""
    try:
        if isinstance(value, (bool, str)):
            raise TypeError
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise RunError(f"{what} = {value!r}: give a number") from None
    if not math.isfinite(result):
        raise RunError(f"{what} = {result}: give a finite number")
    return result


_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z", re.ASCII)


def plain_number(text: str) -> float | None:
    """A finite decimal number as people write it, or None: no underscores, no other digits."""
    if not _DECIMAL.match(text):
        return None
    value = float(text)
    return value if math.isfinite(value) else None


def shaped(what: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """`value` as a finite array of the given shape; `RunError` names `what` otherwise."""
    array = reals(what, value)
    if array.shape != shape:
        raise RunError(f"{what} has shape {array.shape}: give {shape[0]} numbers")
    if not np.all(np.isfinite(array)):
        k = int(np.flatnonzero(~np.isfinite(array))[0])
        raise RunError(f"{what}[{k}] is {array[k]}: give finite numbers")
    return array


def grid(t0: float, t_end: float, dt: float) -> tuple[float, int]:
    """Step size and number of steps of the grid t_k = t_0 + k dt."""
    if dt <= 0:
        raise RunError(f"dt = {dt:g}: give a step size > 0")
    if t_end < t0:
        raise RunError(f"t_end = {t_end:g} lies before the start t0 = {t0:g}")
    exact = (t_end - t0) / dt
    if 0 < exact < 1 - 1e-9:
        raise RunError(
            f"dt = {dt:g} is larger than the time from t0 = {t0:g} to t_end = {t_end:g}: "
            "give a smaller step or a later end"
        )
    if exact > 2**31 - 2:
        raise RunError(f"dt = {dt:g} makes {exact:.3g} steps: at most {2**31 - 2} are possible")
    nearest = round(exact)
    if abs(exact - nearest) <= 1e-9 * max(nearest, 1):
        return dt, nearest
    n = math.floor(exact)
    warnings.warn(
        f"dt = {dt:g} does not divide the time from {t0:g} to {t_end:g}: the last of {n} steps "
        f"ends at {t0 + n * dt:g}",
        stacklevel=4,
    )
    return dt, n


def reals(what: str, value: Any) -> np.ndarray:
    """`value` as an array of real numbers; `RunError` names `what` otherwise."""
    try:
        array = np.asarray(value)
        if np.iscomplexobj(array) or array.dtype.kind in "USmM":
            raise TypeError
        return array.astype(np.longdouble if array.dtype == np.longdouble else float)
    except (TypeError, ValueError):
        raise RunError(f"{what} = {value!r}: give real numbers") from None


def as_path(what: str, value: Any) -> Path:
    """`value` as a path; `RunError` names `what` otherwise."""
    if not isinstance(value, (str, os.PathLike)) or "\0" in os.fspath(value):
        raise RunError(f"{what} = {value!r}: give a path")
    return Path(value)
