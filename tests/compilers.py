"""Compilers and other programs that tests call, and the models that they are called with."""

import os
import shutil
import subprocess
from collections.abc import Callable, Container, Iterable
from pathlib import Path

import pytest
import signorini as sg
from signorini.models import bouncing_ball, box_in_space, slider_crank, slope
from trap_models import (
    mixed_contacts,
    one_coordinate,
    only_constraints,
    rheonomic,
    tabulated,
    unconstrained,
)

STRICT = [
    "-std=c99",
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wsign-conversion",
    "-Wshadow",
    "-Wstrict-prototypes",
    "-Wmissing-prototypes",
    "-Wdouble-promotion",
    "-Wundef",
    "-Wcast-qual",
    "-Wvla",
    "-Werror",
]
GOLDEN = (bouncing_ball.model, slider_crank.model, slope.model)
MODELS = (*GOLDEN, box_in_space.model, rheonomic, mixed_contacts, only_constraints, unconstrained,
          one_coordinate, tabulated)  # fmt: skip
# What a firmware engineer would take: the benchmarks, eight corners, inputs with constraints.
FIRMWARE = (*GOLDEN, box_in_space.model, rheonomic)
# Those of them that analysers get through within a minute.
SMALL = (bouncing_ball.model, slope.model, rheonomic)
# libm, and the four functions that a compiler may call in any freestanding program.
ALLOWED = {
    *"sin cos tan sincos asin acos atan atan2 sinh cosh tanh exp log pow sqrt".split(),
    *"fabs fmin fmax memcpy memmove memset memcmp".split(),
}


def identify(value: object) -> str:
    module = getattr(value, "__module__", "")
    return f"{module.split('.')[-1]}.{value.__name__}" if callable(value) else str(value)


def all_of(models: Iterable[Callable[[], sg.Model]], quick: Container[object]) -> list[object]:
    """Parameters of a test: models other than the quick ones only with ``-m thorough``."""
    return [m if m in quick else pytest.param(m, marks=pytest.mark.thorough) for m in models]


def compiler(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        if os.environ.get("CI"):
            pytest.fail(f"{name} is missing in continuous integration")
        pytest.skip(f"{name} is not installed: apt-get install {name}")
    return found


def run(*command: object, cwd: Path) -> str:
    result = subprocess.run(
        [str(c) for c in command], cwd=cwd, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout + result.stderr
