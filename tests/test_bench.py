"""`signorini bench`: what it times is what the stepper does; figures of hand-made runs."""

import json
import shutil
import sys
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from signorini.benchmarks import report
from signorini.benchmarks.cases import CASES
from signorini.benchmarks.measure import Program, _near_impacts, _run, peak
from signorini.benchmarks.scenes import BALL, BOX, CRANK, Run
from signorini.cli import main

SHORT = {c.name: replace(c, steps=min(c.steps, 60)) for c in CASES}


def test_the_timed_steps_are_those_of_the_stepper(tmp_path: Path) -> None:
    """Iterations and pushing contacts of every timed step are those of a run from Python."""
    case = SHORT["ball_slips"]
    program = Program(case, tmp_path)
    text = _run([str(program.compile(3))], program.folder, program.start)
    rows = np.array([[float(x) for x in line.split()] for line in text.splitlines()[1:]])
    traj = program.stepper.simulate(
        q0=program.q,
        v0=program.v,
        dt=case.dt,
        t_end=case.steps * case.dt,
        parameters=case.parameters,
    )
    np.testing.assert_array_equal(rows[:, 1], traj.iterations[1:])
    np.testing.assert_array_equal(rows[:, 3] > 0, traj.P_N[1:, 0] > 0)
    assert rows[:, 3].any() and not rows[:, 3].all()
    timing = program.time(3)
    assert 0 < timing.median <= timing.p90 <= timing.worst
    assert timing.evaluation > 0 and timing.rate > 0
    assert timing.after > 0


def test_steps_after_impacts() -> None:
    pushed = np.zeros(60, dtype=int)
    pushed[5:9] = 1  # one contact, then another joins
    pushed[40:] = 3
    pushed[50:] = 7
    near = _near_impacts(pushed)
    assert np.flatnonzero(near).tolist() == [*range(5, 26), *range(40, 60)]
    assert not _near_impacts(np.zeros(4, dtype=int)).any()


def test_figures_of_runs() -> None:
    t = np.linspace(0, 1, 400)
    fall = np.maximum(1 - 4.905 * t**2, BALL.R - 0.002)
    assert Run.of_bouncing("x", "", 1, fall).depth == pytest.approx(0.002)
    bounce = BALL.R + np.abs(np.sin(3 * pi * t)) * np.where(t < 1 / 3, 0.9, 0.225)
    assert "apex 0.250" in Run.of_bouncing("x", "", 1, bounce[100:]).note
    q = np.tile([BALL.exact_x + 0.01, 0.1], (3, 1))
    assert "1.0e-02" in Run.of_slipping("x", "", 1, q).note
    straight = np.zeros((2, 3))
    assert Run.of_crank("x", "", 1, straight).depth == 0
    tilted = np.array([[0, 0, 0.02]])
    expected = CRANK.a * np.sin(0.02) + CRANK.b * np.cos(0.02) - CRANK.d / 2
    assert Run.of_crank("x", "", 1, tilted).depth == pytest.approx(max(0, expected))
    flat = np.array([[0, 0, BOX.c - 1e-3, 1, 0, 0, 0]])
    assert Run.of_box("x", "box", "", 1, flat).depth == pytest.approx(1e-3)
    side = np.array([[0, 0, BOX.b, np.cos(pi / 4), np.sin(pi / 4), 0, 0]])  # about x
    assert Run.of_box("x", "box", "", 1, side).depth == pytest.approx(0, abs=1e-12)


def test_exact_end_of_the_slipping_ball() -> None:
    """The paper's number, and what the scheme converges to."""
    assert pytest.approx(-0.8713, abs=1e-4) == BALL.exact_x
    ball = next(c for c in CASES if c.name == "ball_slips")
    traj = sg.build(ball.model(), stages=2).simulate(
        t_end=1.1, dt=1e-4, v0=ball.v, parameters=ball.parameters
    )
    assert abs(traj["x"][-1] - BALL.exact_x) < 1e-3


def test_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "CASES", tuple(SHORT.values()))
    out = tmp_path / "bench"
    arguments = ["bench", "--cases", "ball_flies", "slope_slides", "--repeats", "3", "--native"]
    monkeypatch.setattr(sys, "argv", ["signorini", *arguments, "--out", str(out)])
    with pytest.raises(SystemExit) as done:
        main()
    assert done.value.code in (0, None)
    assert "us: median" in capsys.readouterr().out
    data = json.loads((out / "bench.json").read_text())
    assert [t["case"] for t in data["timings"]] == ["ball_flies", "slope_slides"]
    page = (out / "bench.md").read_text()
    assert "| slope_slides |" in page and "0.6 " in page
    for bad in (["--cases", "no"], ["--repeats", "0"], ["--store"]):
        monkeypatch.setattr(sys, "argv", ["signorini", "bench", *bad])
        with pytest.raises(SystemExit) as failed:
            main()
        assert failed.value.code not in (0, None)


def test_missing_peers_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.delitem(sys.modules, "signorini.benchmarks.peer_mujoco", raising=False)
    with pytest.raises(sg.RunError, match=r"mujoco.*signorini\[peers\]"):
        report.measure([], 1, False, False, True, lambda _: None)


@pytest.mark.thorough
def test_instructions_are_the_same_each_time(tmp_path: Path) -> None:
    """Counts repeat; with the compiler of the stored counts they are within a tenth of them."""
    assert shutil.which("valgrind"), "apt-get install valgrind"
    stored = json.loads(report.STORED.read_text())
    case = next(c for c in CASES if c.name == "slope_slides")
    program = Program(case, tmp_path)
    counts = {program.instructions() for _ in range(2)}
    assert len(counts) == 1
    assert peak(tmp_path) > 0.5
    if report._machine(tmp_path)["compiler"] == stored["compiler"]:
        assert counts.pop() < 1.1 * stored["cases"]["slope_slides"]
