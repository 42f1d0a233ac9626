"""Sweeps: runs are those alone, an interrupted sweep goes on, the diagram is the known one."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from signorini import sweep as sweeping
from signorini.models import bouncing_ball, vibrating_table

zarr = pytest.importorskip("zarr")
PLAN = sweeping.Sweep(
    (sweeping.axis("e_N=0:1:5"), sweeping.axis("y_dot=-1,0.5")), {"mu": 0.1}, 0.5, 1e-2, 5, 3
)


def collect(stepper: sg.Stepper, out: Path, seen: list[tuple[int, int]]) -> sweeping.Store:
    return sweeping.run_sweep(
        stepper,
        PLAN,
        out,
        batch=4,
        workers=1,
        scheduler=None,
        progress=lambda done, total: seen.append((done, total)),
    )


def test_runs_and_resumption(tmp_path: Path) -> None:
    compiled = sg.build(bouncing_ball.model(), stages=2)
    seen: list[tuple[int, int]] = []
    out = tmp_path / "sweep.zarr"
    # the last of three batches is in, the first two are not: as after an interruption
    before = sweeping.Store(out, compiled, PLAN, 4)
    part = sweeping.run_part(sweeping.read_files(compiled), PLAN, PLAN.points()[8:])
    before.put(2, 4, part)
    before.group["steps"][8:] = 77  # seen again below: this batch is not run again
    store = collect(compiled, out, seen)
    assert seen == [(1, 3), (2, 3), (3, 3)]
    np.testing.assert_array_equal(store.group["steps"][:], [50] * 8 + [77] * 2)
    points = store.group["points"][:]
    assert points.shape == (10, 2)
    assert len(np.unique(points, axis=0)) == 10
    for k, (e_N, y_dot) in enumerate(points):
        alone = compiled.simulate(
            t_end=0.5, dt=1e-2, every=5, v0={"y": y_dot}, parameters={"e_N": e_N, "mu": 0.1}
        )
        for name in ("t", "q", "v"):
            np.testing.assert_array_equal(store.group[name][k], getattr(alone, name)[-3:])
        # figures of the whole run, of which three rows were kept: those of every step
        every = compiled.simulate(
            t_end=0.5, dt=1e-2, v0={"y": y_dot}, parameters={"e_N": e_N, "mu": 0.1}
        )
        assert store.group["impacts"][k] == sum(e.kind == "impact" for e in every.events) > 0
        assert store.group["iterations"][k] == every.iterations.sum()
        assert store.group["smallest_gap"][k] == every.smallest_gap.min()
        extremes = [every.energy.min(), every.energy.max()]
        np.testing.assert_allclose(store.group["energy_range"][k], extremes, rtol=1e-14)
    seen.clear()
    collect(compiled, out, seen)
    assert seen == [(3, 3)]
    assert list(sweeping.summary(store)) == ["10 runs: OK"]
    other = sg.build(bouncing_ball.model(), stages=3)
    with pytest.raises(sg.RunError, match=r"another sweep: .*stages"):
        collect(other, out, seen)


def test_folders_that_are_no_store(tmp_path: Path) -> None:
    compiled = sg.build(bouncing_ball.model(), stages=2)
    (tmp_path / "letter.txt").write_text("dear reader")
    with pytest.raises(sg.RunError, match="no store of a sweep"):
        collect(compiled, tmp_path, [])
    assert (tmp_path / "letter.txt").read_text() == "dear reader"


@pytest.mark.parametrize(
    "text",
    [
        "e_N",
        "=1",
        "e_N=",
        "e_N=1:2",
        "e_N=0:1:0",
        "e_N=0:1:x",
        "e_N=1,,2",
        "e_N=nan",
        "e_N=0:inf:3",
    ],
)
def test_axes_that_are_none(text: str) -> None:
    with pytest.raises(sg.RunError, match="--over"):
        sweeping.axis(text)


def test_axes_of_a_model() -> None:
    compiled = sg.build(bouncing_ball.model(), stages=2)
    for axes, words in (
        (("nothing=1",), "'nothing'"),
        (("mu=1", "mu=2"), "twice"),
        (("e_N=0:2:3",), "bounds"),
    ):
        with pytest.raises(sg.RunError, match=words):
            sweeping.check_axes(compiled, tuple(sweeping.axis(a) for a in axes))


def test_period_doubling_from_the_command_line(tmp_path: Path) -> None:
    """One bounce a period from Gamma = pi/3 on, its period doubles at 1.5268 (Luck, Mehta)."""
    out, picture = tmp_path / "b.zarr", tmp_path / "b.png"
    command = [
        *(sys.executable, "-m", "signorini", "sweep", "vibrating_table"),
        *("--over", "Gamma=1.02,1.2,1.45,1.6", "--stages", "2", "--dt", "2.5e-4", "--t-end", "10"),
        *("--every", "200", "--last", "20", "--workers", "1"),
        *("--out", str(out), "--plot", str(picture), "--show", "y_dot"),
    ]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "4 runs: OK" in result.stdout
    assert picture.stat().st_size > 5000
    v = zarr.open_group(out, mode="r")["v"][:, :, 0]
    spread = np.ptp(v, axis=1)
    assert np.all(spread[:3] < 1e-3)
    assert spread[3] > 1e-2
    # below the threshold the ball stays on the table: its velocity is the table's
    model = vibrating_table.model()
    rate = 2 * math.pi * 20
    assert model.name == "vibrating_table"
    np.testing.assert_allclose(v[0], 1.02 * 9.81 / rate, rtol=1e-2)
