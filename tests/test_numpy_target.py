"""The NumPy target: its functions against those of the compiled C, one state and many at once."""

import importlib.util
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import signorini as sg
from drawing import draw
from signorini.models import slider_crank
from trap_models import forms, mixed_contacts, rheonomic, tabulated

_ARGUMENTS = {"t", "q", "v", "u", "R"}


def module_of(model: sg.Model, folder: Path) -> ModuleType:
    path = sg.generate(model, folder, target="numpy")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def call(module: ModuleType, name: str, at: dict[str, object], par: object) -> np.ndarray:
    function = getattr(module, name)
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    return np.asarray(function(*(at[n] for n in names if n in _ARGUMENTS), par))


@pytest.mark.parametrize("model", [rheonomic, mixed_contacts, forms, tabulated, slider_crank.model])
def test_functions_are_those_of_c(
    model: Callable[[], sg.Model], stepper: Callable[..., sg.Stepper], tmp_path: Path
) -> None:
    compiled = stepper(model)
    module = module_of(model(), tmp_path)
    parameters = {name: 1.1 * value for name, value in compiled.parameters.items()}
    states = [draw(compiled, seed) for seed in range(4)]
    many = {name: np.stack([at[name] for at in states]) for name in states[0]}
    with np.errstate(all="ignore"):  # both branches of a selection are computed
        for name in compiled.functions:
            batch = call(module, name, many, parameters)
            for k, at in enumerate(states):
                c = compiled.evaluate(
                    name, at["t"], at["q"], at["v"], at["u"], R=at["R"], parameters=parameters
                )
                one = np.squeeze(call(module, name, at, parameters))
                size = max(1.0, float(np.max(np.abs(c), initial=0)))
                np.testing.assert_allclose(one, np.squeeze(c), atol=2e-14 * size, err_msg=name)
                rows = batch[k] if batch.ndim > np.ndim(getattr(c, "T", c)) else batch
                np.testing.assert_array_equal(np.squeeze(rows), one, err_msg=name)


def test_the_module_needs_numpy_alone(tmp_path: Path) -> None:
    path = sg.generate(mixed_contacts(), tmp_path, target="numpy")
    assert path.name == "mixed_contacts_model.py"
    code = (
        "import sys\n"
        f"sys.path.insert(0, {str(tmp_path)!r})\n"
        "import mixed_contacts_model as m\n"
        "print(m.g_N(0.0, [0.0, 0.0, 0.5, 0.0]))\n"
        "print(sorted(n for n in sys.modules if n in ('sympy', 'casadi', 'signorini')))\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    gaps, others = result.stdout.strip().splitlines()
    assert gaps.startswith("[0.5 ")
    assert others == "[]"


def test_the_folder_keeps_what_is_in_it(tmp_path: Path) -> None:
    sg.generate(tabulated(), tmp_path / "c", stages=2)
    before = {p.name: p.read_bytes() for p in (tmp_path / "c").iterdir()}
    path = sg.generate(tabulated(), tmp_path / "c", target="numpy")
    first = path.read_bytes()
    assert sg.generate(tabulated(), tmp_path / "c", target="numpy").read_bytes() == first
    after = {p.name: p.read_bytes() for p in (tmp_path / "c").iterdir() if p != path}
    assert after == before
    with pytest.raises(sg.GenerationError, match="choose c or numpy"):
        sg.generate(tabulated(), tmp_path, target="fortran")
    with pytest.raises(sg.GenerationError, match="cannot write"):
        sg.generate(tabulated(), path, target="numpy")
