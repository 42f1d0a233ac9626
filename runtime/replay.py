"""A step that failed, as data and as a file that replays it alone."""

import ctypes
import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from signorini.runtime.arguments import as_path
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError
from signorini.runtime.options import RunOptions

_FORMAT = 4


@dataclass(frozen=True)
class FailedStep:
    """Everything that one step needs: model, state with its guess, inputs, parameters, options.

    Attributes
    ----------
    model, model_hash, scheme, precision : str
    stages : int
    state : dict
        Fields of the C struct ``p_state``.
    u : list of float
        Inputs.
    parameters, options : dict
    h : float
        Step size.
    status : str
        How the step ended.
    """

    model: str
    model_hash: str
    scheme: str
    precision: str
    stages: int
    state: dict[str, Any]
    u: list[float]
    parameters: dict[str, float]
    options: dict[str, Any]
    h: float
    status: str
    about: dict[str, Any]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write a JSON file; numbers survive to the last bit."""
        target = as_path("the file", path)
        text = json.dumps({"format": _FORMAT, **asdict(self)}, indent=1)
        try:
            target.write_text(text + "\n", encoding="utf-8")
        except OSError as error:
            raise RunError(f"cannot write {target}: {error.strerror}") from None
        return target

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "FailedStep":
        """Read a file that `save` wrote; `RunError` if it is none."""
        target = as_path("the file", path)
        try:
            data = json.loads(target.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise RunError(f"there is no file {target}") from None
        except (OSError, ValueError, RecursionError) as error:
            raise RunError(f"{target} is no file of a failed step ({error})") from None
        if not isinstance(data, dict) or data.pop("format", None) != _FORMAT:
            raise RunError(f"{target} is no file of a failed step that this version reads")
        if set(data) != set(_CONTENT):
            raise RunError(f"{target} is damaged: fields are missing or unknown")
        for name, fits in _CONTENT.items():
            if not fits(data[name]):
                raise RunError(
                    f"{target} is damaged: its field '{name}' does not hold what `save` writes"
                )
        return cls(**data)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _are_numbers(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_number, value))


def _is_named(value: Any) -> bool:
    return isinstance(value, dict)


def _are_options(value: Any) -> bool:
    return isinstance(value, dict) and all(
        x is None or isinstance(x, (str, int, float)) for x in value.values()
    )


def _are_named_numbers(value: Any) -> bool:
    return isinstance(value, dict) and all(_is_number(x) or _are_numbers(x) for x in value.values())


def _is_state(value: Any) -> bool:
    """Whether it is what `fields_of` makes of a state: that of a model of parts holds theirs."""
    return isinstance(value, dict) and all(
        _is_number(x)
        or _are_numbers(x)
        or _is_state(x)
        or (isinstance(x, list) and all(map(_is_state, x)))
        for x in value.values()
    )


# What each field of a file holds.
_CONTENT: dict[str, Callable[[Any], bool]] = {
    "model": _is_text,
    "model_hash": _is_text,
    "scheme": _is_text,
    "precision": _is_text,
    "stages": lambda value: type(value) is int and value > 0,
    "state": _is_state,
    "u": _are_numbers,
    "parameters": _are_named_numbers,
    "options": _are_options,
    "h": _is_number,
    "status": _is_text,
    "about": _is_named,
}


def fields_of(struct: Any) -> dict[str, Any]:
    """Fields of a C struct as plain Python: numbers, lists, lists of such dictionaries."""

    def plain(value: Any) -> Any:
        if isinstance(value, (int, float)):
            return value
        if isinstance(value, ctypes.Structure):
            return fields_of(value)
        return [plain(x) for x in value]

    return {name: plain(getattr(struct, name)) for name, *_ in struct._fields_}


def _fill(struct: Any, values: dict[str, Any]) -> None:
    """Give the fields of a C struct their values; the terms of a state are found anew."""
    for name, _kind in struct._fields_:
        value, there = values[name], getattr(struct, name)
        if isinstance(there, ctypes.Structure):
            _fill(there, value)
        elif isinstance(there, ctypes.Array):
            if len(value) != len(there):
                raise ValueError(f"{name} has {len(value)} entries")
            for k, x in enumerate(value):
                if isinstance(x, dict):
                    _fill(there[k], x)
                else:
                    there[k] = x
        else:
            setattr(struct, name, value)
    if hasattr(struct, "has_terms"):
        struct.has_terms = 0  # how they are chosen is the generator's affair


def replay(stepper: Compiled, step: FailedStep) -> dict[str, Any]:
    """Take the step again; returns ``status``, ``q``, ``v``, ``t`` and the fields of ``p_info``.

    Raises
    ------
    RunError
        If the file is of another model, scheme or number of stages, or damaged.
    """
    m = stepper.manifest
    for key in ("model", "model_hash", "scheme", "precision", "stages"):
        if getattr(step, key) != m[key]:
            raise RunError(
                f"the step is of {key} {getattr(step, key)!r}, the stepper of {m[key]!r}: build "
                "the stepper that it failed with"
            )
    lib = stepper.library
    state, work, info = (lib.structs[name]() for name in ("state", "work", "info"))
    try:
        _fill(state, step.state)
        u = lib.array(stepper.rows("u", step.u, 1, stepper.sizes["n_u"])[0])
        options = stepper.c_options(RunOptions.of({"max_halvings": 0, **step.options}))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise RunError(f"the file of the failed step is damaged ({error!r})") from None
    par = stepper.c_params(stepper.check_parameters(step.parameters))
    status = lib.call["step"](state, work, info, par, options, lib.pointer(u), step.h)
    return {
        **fields_of(info), "status": lib.statuses[status],
        "t": float(state.t), "q": list(state.q), "v": list(state.v),
    }  # fmt: skip
