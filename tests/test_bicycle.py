"""The benchmark bicycle against the eigenvalues that are published of it."""

from collections.abc import Callable

import numpy as np
import pytest
import signorini as sg
from signorini.models import bicycle

Build = Callable[..., sg.Stepper]
# Meijaard, Papadopoulos, Ruina, Schwab (2007), table 2: at rest, and where all decay.
PUBLISHED = {
    0.0: (-5.530943717653930, -3.131643247906560, 3.131643247906560, 5.530943717653930),
    5.0: (
        -14.0783896927982,
        complex(-0.775341882195845, -4.46486771378823),
        complex(-0.775341882195845, 4.46486771378823),
        -0.322866429004087,
    ),
}


@pytest.mark.thorough
@pytest.mark.parametrize("speed", PUBLISHED)
def test_eigenvalues_of_the_benchmark_bicycle(stepper: Build, speed: float) -> None:
    """Of the map from lean, steer and their rates to those a tenth of a second later."""
    made = stepper(bicycle.model, 3)
    names = made.manifest["coordinates"]
    shown = [names.index("lean"), names.index("steer")]
    before, after = [], []
    for k in range(4):
        q, v, small = np.zeros(9), np.zeros(9), 1e-5 * np.eye(4)[k]
        q[names.index("z")] = 0.3
        q[shown], v[shown] = small[:2], small[2:]
        v[names.index("x")] = speed
        v[names.index("rear")], v[names.index("front")] = speed / 0.3, speed / 0.35
        q, v = made.project(q, v)
        run = made.simulate(dt=2.5e-3, t_end=0.5, q0=q, v0=v)
        seen = np.hstack([run.q[:, shown], run.v[:, shown]])[::40]
        before.append(seen[:-1])
        after.append(seen[1:])
    step, *_ = np.linalg.lstsq(np.vstack(before), np.vstack(after), rcond=None)
    found = np.log(np.linalg.eigvals(step).astype(complex)) / 0.1
    order = np.lexsort((found.imag.round(6), found.real.round(6)))
    assert found[order] == pytest.approx(np.array(PUBLISHED[speed]), abs=1e-6, rel=1e-6)
    assert run.energy == pytest.approx(np.full(run.t.size, run.energy[0]), rel=1e-9)
