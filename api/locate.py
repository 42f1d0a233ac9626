"""Finds the model that a MODEL argument names."""

import difflib
import importlib
import importlib.util
import inspect
import pkgutil
import re
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import signorini.models
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import Model
from signorini.runtime.errors import RunError


def shipped() -> list[str]:
    """Names of the models that come with the package."""
    return sorted(m.name for m in pkgutil.iter_modules(signorini.models.__path__))


def find_model(name: str) -> Model:
    """Return the model of a shipped name, ``path.py[:function]`` or ``package.module[:function]``.

    Raises
    ------
    RunError
        If there is no such model, or its file fails.
    """
    place, _, function = (
        name.partition(":") if not re.match(r"[A-Za-z]:[\\/]", name) else (name, "", "")
    )
    module = _module(place)
    make = getattr(module, function or "model", None)
    if isinstance(make, Model):
        return make
    if not callable(make):
        others = _offers(module)
        if function or not others:
            known = f"; it has {', '.join(others)}" if others else ""
            raise RunError(
                f"{place} has no function '{function or 'model'}'{known}: define "
                "'def model() -> sg.Model'"
            )
        if len(others) > 1:
            raise RunError(
                f"{place} has no function 'model' but {', '.join(others)}: say which, "
                f"{place}:{others[0]}"
            )
        function = others[0]
        make = getattr(module, function)
        if isinstance(make, Model):
            return make
    function = function or "model"
    try:
        model = make()
    except (ModelError, RunError):
        raise
    except Exception as error:
        raise RunError(_failure(f"{place}:{function}", error)) from None
    if not isinstance(model, Model):
        raise RunError(f"{place}:{function} returned {type(model).__name__}, not a signorini.Model")
    return model


def find_function(name: str) -> Callable[..., Any]:
    """Return the function of ``path.py:function`` or ``package.module:function``.

    Raises
    ------
    RunError
        If there is no such function, or its file fails.
    """
    place, colon, function = name.rpartition(":")
    if not colon or not function.isidentifier():
        raise RunError(f"'{name}' names no function: write FILE.py:FUNCTION")
    found = getattr(_module(place), function, None)
    if not callable(found):
        raise RunError(f"{place} has no function '{function}'")
    made: Callable[..., Any] = found
    return made


def _offers(module: object) -> list[str]:
    """Names in a file that may give a model: models, and functions that need no argument."""
    found = []
    for name, value in vars(module).items():
        own = getattr(value, "__module__", None) == getattr(module, "__name__", "")
        if isinstance(value, Model):
            found.append(name)
        elif own and inspect.isfunction(value) and not name.startswith("_"):
            try:
                inspect.signature(value).bind()
            except TypeError:
                continue
            found.append(name)
    return found


def _module(place: str) -> object:
    if place in shipped():
        return importlib.import_module(f"signorini.models.{place}")
    path = Path(place)
    if place.endswith(".py") or path.is_file():
        if not path.is_file():
            raise RunError(f"there is no file {place}")
        spec = importlib.util.spec_from_file_location(f"_model_{path.stem}", path)
        if spec is None or spec.loader is None:
            raise RunError(f"{place} is no Python file")
        module = importlib.util.module_from_spec(spec)
        # dataclasses look their module up; helpers beside the file may be imported later, too
        sys.modules[spec.name] = module
        folder = str(path.parent.resolve())
        if folder not in sys.path:
            sys.path.insert(0, folder)
        try:
            spec.loader.exec_module(module)
        except (ModelError, RunError):
            raise
        except Exception as error:
            raise RunError(_failure(place, error)) from None
        return module
    if re.fullmatch(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*", place):
        sys.path.insert(0, str(Path.cwd()))
        try:
            return importlib.import_module(place)
        except ModuleNotFoundError as error:
            if error.name is None or not (place + ".").startswith(error.name + "."):
                raise RunError(_failure(place, error)) from None
        except (ModelError, RunError):
            raise
        except Exception as error:
            raise RunError(_failure(place, error)) from None
        finally:
            sys.path.pop(0)
    near = difflib.get_close_matches(place, shipped(), 1)
    meant = f" (did you mean {near[0]}?)" if near else ""
    raise RunError(
        f"there is no model '{place}'{meant}: give one of {', '.join(shipped())}, a file "
        "path.py[:function] "
        "or a module package.module[:function]"
    )


def _failure(place: str, error: Exception) -> str:
    """The user's own exception with the line of the user's file."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if Path(f.filename).name not in ("locate.py",)]
    where = ""
    for frame in own:
        if Path(frame.filename).name == Path(place.partition(":")[0]).name:
            where = f" in line {frame.lineno}: {frame.line}"
    hint = ""
    if isinstance(error, TypeError) and "Cannot convert expression to float" in str(error):
        hint = (
            "\nThe functions of math and NumPy take numbers only: for expressions write those of "
            "SymPy, sp.sin(x), sp.sqrt(x), ..."
        )
    return f"{place} failed{where}\n{type(error).__name__}: {error}{hint}"
