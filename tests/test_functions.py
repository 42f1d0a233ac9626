"""Every emitted model function against the user's expressions by another route, to 50 digits."""

from collections.abc import Callable

import numpy as np
import pytest
import signorini as sg
from drawing import draw
from signorini.models import bouncing_ball, box, slider_crank, slope
from signorini.verify.expressions import Expressions
from signorini.verify.functions import reference_values
from trap_models import TRAPS, forms

MODELS = (*TRAPS, forms, bouncing_ball.model, slope.model, slider_crank.model, box.model)


@pytest.mark.parametrize(
    "model", MODELS, ids=lambda m: m.__module__.split(".")[-1] + "." + m.__name__
)
@pytest.mark.parametrize("seed", [0, 1])
def test_functions(
    model: Callable[[], sg.Model], seed: int, stepper: Callable[..., sg.Stepper]
) -> None:
    compiled = stepper(model)
    at = draw(compiled, seed)
    expected = reference_values(
        Expressions(model(), high=True),
        *(at[name] for name in ("t", "q", "v", "u", "R")),
        list(compiled.parameters.values()),
    )
    assert set(compiled.functions) <= set(expected)
    for name in compiled.functions:
        value = compiled.evaluate(name, at["t"], at["q"], at["v"], at["u"], R=at["R"])
        other = expected[name].reshape(np.shape(value))
        scale = max(1.0, np.max(np.abs(other), initial=0))
        np.testing.assert_allclose(value, other, rtol=0, atol=1e-13 * scale, err_msg=name)
