"""Controllers in C: the same runs as with functions in Python."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import signorini as sg
from signorini.models import hopper

Build = Callable[..., sg.Stepper]

RAIBERT = """
#include <math.h>
static double clip(double x, double most) { return x < -most ? -most : x > most ? most : x; }
void control(double t, const double q[], const double v[], double u[], double memory[]) {
    const double speed = memory[0];
    (void)t;
    if (q[1] - q[4] * cos(q[3]) < 2e-3) {
        u[0] = v[4] > 0 ? 30.0 : 0.0;
        u[1] = 60.0 * q[2] + 10.0 * v[2];
    } else {
        const double forward = v[0] * 0.15 / 2 + 0.1 * (v[0] - speed);
        u[0] = 0.0;
        u[1] = -20.0 * (q[3] - asin(clip(forward / q[4], 0.5))) - v[3];
    }
}
"""
COUNT = """
void count(double t, const double q[], const double v[], double u[], double memory[]) {
    (void)t; (void)q; (void)v;
    u[0] = u[1] = memory[0];
    memory[0] += 1;
}
"""


@pytest.mark.parametrize("every", [1, 7])
def test_a_hopper_hops_as_with_python(stepper: Build, tmp_path: Path, every: int) -> None:
    """Raibert's controller once more: states, inputs, events, stages."""
    made = stepper(hopper.model, 2)
    (tmp_path / "raibert.c").write_text(RAIBERT)
    about: dict[str, Any] = {"t_end": 1.2, "dt": 1e-3, "every": every, "record": "stages"}
    mine = made.simulate(**about, inputs=made.controller(tmp_path / "raibert.c", memory=[0.5]))
    other = made.simulate(**about, inputs=hopper.controller(0.5))
    assert len(mine.events) == len(other.events) > 2
    np.testing.assert_allclose(mine.q, other.q, atol=1e-9)
    np.testing.assert_allclose(mine.u, other.u, atol=1e-7)
    np.testing.assert_allclose(mine.V, other.V, atol=1e-6)
    np.testing.assert_array_equal(mine.status, other.status)


def test_a_controller_remembers_within_a_run(stepper: Build, tmp_path: Path) -> None:
    """Over chunks of many steps; the next run begins as the first did."""
    made = stepper(hopper.model, 2)
    (tmp_path / "count.c").write_text(COUNT)
    count = made.controller(tmp_path / "count.c", "count", [2.0])
    for _ in range(2):
        traj = made.simulate(t_end=0.05, dt=1e-3, inputs=count)
        np.testing.assert_array_equal(traj.u[:-1, 0], 2.0 + np.arange(50))
    np.testing.assert_array_equal(count(0.0, traj.q[0], traj.v[0]), [2.0, 2.0])


def test_refusals(stepper: Build, tmp_path: Path) -> None:
    made = stepper(hopper.model, 2)
    (tmp_path / "count.c").write_text(COUNT)
    with pytest.raises(sg.RunError, match=r"there is no file .*none.c"):
        made.controller(tmp_path / "none.c")
    with pytest.raises(sg.RunError, match="has no function control: write void control"):
        made.controller(tmp_path / "count.c")
    with pytest.raises(sg.RunError, match="give the name of a C function"):
        made.controller(tmp_path / "count.c", "a b")
