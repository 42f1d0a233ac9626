"""Sweeps: runs are those alone, an interrupted sweep goes on, the diagram is the known one."""

import math
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from command import signorini
from signorini import sweep as sweeping
from signorini import swept
from signorini.models import bouncing_ball, vibrating_table

Ink = Callable[[Path], tuple[float, float, float, int]]

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


def test_damaged_stores_are_refused(tmp_path: Path) -> None:
    """One message for each: nothing is said to be in that cannot be read."""
    compiled = sg.build(bouncing_ball.model(), stages=2)
    sweeping.Store(tmp_path / "whole", compiled, PLAN, 4)
    assert [p.name for p in tmp_path.iterdir()] == ["whole"]  # nothing beside it

    def damage(store: Path, kind: str) -> None:
        if kind == "array gone":
            shutil.rmtree(store / "q")
        elif kind == "array's description":
            (store / "v" / "zarr.json").write_text("{")
        elif kind == "another shape":
            shutil.copy(store / "q" / "zarr.json", store / "t" / "zarr.json")
        elif kind == "points":
            for path in (store / "points" / "c").rglob("*"):
                if path.is_file():
                    path.write_bytes(b"x")
        elif kind == "no group":
            (store / "zarr.json").unlink()
        else:
            shutil.rmtree(store)
            store.write_text("no folder")

    for kind, says in (
        ("array gone", "the array 'q' is damaged"),
        ("array's description", "the array 'v' is damaged"),
        ("another shape", "the array 't' is damaged"),
        ("points", "the array 'points' is damaged"),
        ("no group", "no store of a sweep"),
        ("a file", "no store of a sweep"),
    ):
        store = tmp_path / kind.replace(" ", "_")
        shutil.copytree(tmp_path / "whole", store)
        damage(store, kind)
        with pytest.raises(sg.RunError, match=says):
            sweeping.Store(store, compiled, PLAN, 4)


def interrupt(tmp_path: Path, *command: str) -> tuple[int, str]:
    """Start a command, press Ctrl-C when it computes; status, and what it said."""
    process = subprocess.Popen(
        [sys.executable, "-c", _START, *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=tmp_path,
        start_new_session=True,
    )
    time.sleep(15)
    os.killpg(process.pid, signal.SIGINT)
    said, _ = process.communicate(timeout=20)  # workers are not waited for
    return process.returncode, said


# As a terminal starts it: Ctrl-C is heard, also where the tests run without it.
_START = """import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from signorini.cli import main
sys.argv[0] = "signorini"
main()
"""


@pytest.mark.thorough
@pytest.mark.parametrize("what", ["sweep", "stress"])
def test_ctrl_c_ends_it_with_one_message(what: str, tmp_path: Path) -> None:
    if what == "sweep":
        status, said = interrupt(
            tmp_path,
            *("sweep", "bouncing_ball", "--over", "y=1:2:4000", "--t-end", "20", "--dt", "1e-4"),
            *("--every", "100", "--batch", "50", "--workers", "2", "--out", "s.zarr"),
        )
        assert "batches are in s.zarr; the same command goes on" in said
    else:
        status, said = interrupt(
            tmp_path,
            *("stress", "--scenes", "groove", "box_tumbles", "--runs", "400", "--workers", "2"),
            *("--out", "s"),
        )
        assert "interrupted: the table holds the runs that had ended" in said
        assert (tmp_path / "s" / "stress.json").is_file()
    assert status == 130
    assert "Traceback" not in said


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


def test_period_doubling_from_the_command_line(tmp_path: Path, ink: Ink) -> None:
    """One bounce a period from Gamma = pi/3 on, its period doubles at 1.5268 (Luck, Mehta)."""
    out, picture = tmp_path / "b.zarr", tmp_path / "b.png"
    result = signorini(
        *(tmp_path, "sweep", "vibrating_table"),
        *("--over", "Gamma=1.02,1.2,1.45,1.6", "--stages", "2", "--dt", "2.5e-4", "--t-end", "10"),
        *("--every", "200", "--last", "20", "--workers", "1"),
        *("--out", str(out), "--plot", str(picture), "--show", "y_dot"),
    )
    assert result.returncode == 0, result.stderr
    assert "4 runs: OK" in result.stdout
    share, wide, high, _colours = ink(picture)
    assert 0.002 < share < 0.5
    assert min(wide, high) > 0.5
    v = zarr.open_group(out, mode="r")["v"][:, :, 0]
    spread = np.ptp(v, axis=1)
    assert np.all(spread[:3] < 1e-3)
    assert spread[3] > 1e-2
    # below the threshold the ball stays on the table: its velocity is the table's
    model = vibrating_table.model()
    rate = 2 * math.pi * 20
    assert model.name == "vibrating_table"
    np.testing.assert_allclose(v[0], 1.02 * 9.81 / rate, rtol=1e-2)


def test_a_store_opens_over_its_grid(tmp_path: Path) -> None:
    """Every number is that of the run at its place in the grid, by names."""
    compiled = sg.build(bouncing_ball.model(), stages=2)
    out = tmp_path / "grid.zarr"
    collect(compiled, out, [])
    data = sg.open_sweep(out)
    assert dict(data.sizes)["e_N"] * dict(data.sizes)["y_dot"] == PLAN.size
    assert data.attrs["model"] == "bouncing_ball"
    assert data.coordinate.values.tolist() == ["x", "y", "phi"]
    for e_N in data.e_N.values[::2]:
        for y_dot in data.y_dot.values:
            one = data.sel(e_N=e_N, y_dot=y_dot)
            traj = compiled.simulate(
                t_end=PLAN.t_end,
                dt=PLAN.dt,
                every=PLAN.every,
                v0={"y": y_dot},
                parameters={"e_N": e_N, **PLAN.fixed},
            )
            rows = slice(-PLAN.last, None) if PLAN.last else slice(None)
            np.testing.assert_array_equal(one.q.values, traj.q[rows])
            np.testing.assert_allclose(one.energy.values, traj.energy[rows], rtol=1e-14)
            np.testing.assert_allclose(
                one.g_N.sel(gap="floor").values, traj["floor.g_N"][rows], atol=1e-15
            )
            assert str(one.status.values) == "OK"
            assert int(one.impacts) >= 1
    with pytest.raises(sg.RunError, match="no store of a sweep"):
        sg.open_sweep(tmp_path)


def test_columns_of_a_picture() -> None:
    about = sg.build(bouncing_ball.model(), stages=2).manifest
    assert swept.column_of(about, None) == swept.Column("x", "q", 0, True)
    assert swept.column_of(about, "phi_dot") == swept.Column("phi_dot", "v", 2, True)
    assert swept.column_of(about, "floor.g_N") == swept.Column("floor.g_N", "g_N", 0, True)
    assert swept.column_of(about, "impacts") == swept.Column("impacts", "impacts", None, False)
    with pytest.raises(sg.RunError, match=r"no column 'z'.*floor\.g_N, energy"):
        swept.column_of(about, "z")
