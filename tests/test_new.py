"""`signorini new`, and what the commands print for other programs."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import signorini as sg
from command import signorini
from signorini.bodies import Planar
from signorini.models import bouncing_ball


@pytest.mark.parametrize("kind", ["plane", "space", "lagrangian", "casadi"])
def test_a_new_file_runs_and_is_drawn(kind: str, tmp_path: Path) -> None:
    """It names itself, moves, touches something, is formatted, and is what `check` can prove."""
    made = signorini(tmp_path, "new", "first.py", "--kind", kind)
    assert made.returncode == 0, made.stderr
    assert "signorini run first.py" in made.stdout
    names: dict = {}
    text = (tmp_path / "first.py").read_text()
    exec(compile(text, "first.py", "exec"), names)
    model = names["model"]()
    assert model.name == "first"
    stepper = sg.build(model, stages=2)
    traj = stepper.simulate(**model.suggested)
    assert any(e.kind == "impact" for e in traj.events)
    assert traj.g_N.min() > -1e-9
    assert traj.animate(tmp_path / "first.html").stat().st_size > 10_000
    report = sg.check(model, stages=(2,))
    assert all(item.passed for item in report.items), report
    assert not report.contradicted
    for tool in (("format", "--check"), ("check", "--ignore", "N806")):
        options = ("--line-length", "100")
        result = subprocess.run(
            [sys.executable, "-m", "ruff", *tool, *options, tmp_path / "first.py"], check=False
        )
        assert result.returncode == 0


def test_a_new_file_replaces_nothing(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("precious\n")
    for words, message in (
        (("mine.py",), "is there already"),
        (("2x.py",), "cannot be a model's name"),
        (("class.py",), "cannot be a model's name"),
        (("x.txt",), "ends in .py"),
        (("nowhere/x.py",), "there is no folder"),
    ):
        result = signorini(tmp_path, "new", *words)
        assert result.returncode == 1
        assert message in " ".join(result.stderr.split())
    assert (tmp_path / "mine.py").read_text() == "precious\n"
    assert signorini(tmp_path, "new", "mine.py", "--force").returncode == 0
    assert "sg.Model" in (tmp_path / "mine.py").read_text()


def test_a_run_as_json(tmp_path: Path) -> None:
    """Numbers of the run, nothing else on the standard output."""
    result = signorini(tmp_path, "run", "bouncing_ball", "--t-end", "1.1", "--json")
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)
    traj = sg.build(bouncing_ball.model()).simulate(t_end=1.1, dt=1e-2)
    assert found["end"]["q"] == dict(zip(("x", "y", "phi"), traj.q[-1].tolist(), strict=True))
    assert [(e["contact"], e["kind"]) for e in found["events"]] == [
        ("floor", "impact"),
        ("floor", "stick"),
    ]
    assert found["energy"]["end"] == traj.energy[-1]
    assert found["impacts"] == 1
    assert found["steps"] == 110
    listed = json.loads(signorini(tmp_path, "list", "--json").stdout)
    assert next(m for m in listed if m["model"] == "slider_crank")["n_N"] == 4
    proof = signorini(tmp_path, "check", "slope", "--stages", "2", "--json=-")
    assert json.loads(proof.stdout)["model"] == "slope"


def test_inputs_of_the_command_line(tmp_path: Path) -> None:
    """Constants by name, a function of a file; a wrong name is refused. Notes go to stderr."""
    (tmp_path / "mine.py").write_text(
        "import signorini as sg\n\n"
        "def model():\n"
        "    m = sg.Model('cart')\n"
        "    (x,), (F,) = m.coordinates('x'), m.inputs('F')\n"
        "    m.lagrangian = m.velocities[0] ** 2 / 2\n"
        "    m.force([F])\n"
        "    m.initial_state(q=[0])\n"
        "    return m\n\n"
        "def push(t, q, v):\n"
        "    return [2.0 if t < 0.5 else 0.0]\n"
    )
    run = ("run", "mine.py", "--stages", "2", "--t-end", "1", "--dt", "0.1", "--json")
    for words, speed in (
        ((), 0.0),
        (("--inputs", "F=3"), 3.0),
        (("--inputs", "mine.py:push"), 1.0),
    ):
        result = signorini(tmp_path, *run, *words)
        assert result.returncode == 0, result.stderr
        assert json.loads(result.stdout)["end"]["v"]["x_dot"] == pytest.approx(speed, abs=1e-12)
        assert ("note: the inputs F stay zero" in result.stderr) == (not words)
    for words, message in (
        (("--inputs", "G=3"), "no such input; there are: F"),
        (("--inputs", "mine.py:pull"), "no function 'pull'"),
        (("--inputs", "mine"), "names no function"),
    ):
        result = signorini(tmp_path, *run, *words)
        assert result.returncode == 1
        assert message in " ".join(result.stderr.split())


def test_all_events(tmp_path: Path) -> None:
    """Twelve, and how to see the rest; or all."""
    words = ("run", "slider_crank", "--stages", "2")
    few, all_of_them = (signorini(tmp_path, *words, *more) for more in ((), ("--all-events",)))
    assert "--all-events" in few.stdout
    assert all_of_them.stdout.count(" P_") > few.stdout.count(" P_") == 12


def _mass_on_a_plane(**given: object) -> None:
    m = sg.Model("one")
    _x, y = m.coordinates("x y")
    mu = m.parameters(mu=0.3)
    m.lagrangian = sum(v**2 for v in m.velocities) / 2 - 9.81 * y
    m.contact("floor", g_N=y, gamma_F=m.velocities[0], **{"mu": mu, **given})
    m.initial_state(q=[0, 1])
    sg.build(m, stages=2)


def test_mistakes_of_beginners_have_remedies(tmp_path: Path) -> None:
    """Each message says what to write instead."""
    with pytest.raises(sg.ModelError, match=r"a tuple of one.*with the comma"):
        _mass_on_a_plane()
    m = sg.Model("two")
    world = Planar(m)
    body = world.body("b", 1.0, 1.0)
    for call, words in (
        (lambda: world.plane((0, 0)), r"world\.ground\.point\(2, 0\)"),
        (lambda: world.contact("c", body, world.plane()), r"Give a point of the frame"),
        (lambda: world.contact("c", world.plane(), body.point()), "the other way round"),
        (lambda: m.initial_state(q=[0, 0, 0], v=[1]), r"3 velocities \(b_x_dot b_y_dot"),
        (lambda: m.initial_state(q=[0, 0, 0], v={"w": 1}), "velocities: b_x_dot"),
    ):
        with pytest.raises(sg.ModelError, match=words):
            call()
    (tmp_path / "m.py").write_text(
        "import math, signorini as sg\n\ndef model():\n    m = sg.Model('m')\n"
        "    (x,) = m.coordinates('x')\n    m.contact('c', g_N=math.sin(x))\n    return m\n"
    )
    result = signorini(tmp_path, "run", "m.py")
    assert "sp.sin(x)" in result.stderr
    assert "line 6" in result.stderr
    traj = sg.build(bouncing_ball.model(), stages=2).simulate(t_end=0.1, dt=1e-2)
    with pytest.raises(KeyError, match=r"'bouncing_ball' has no column 'phy' \(did you mean phi"):
        traj["phy"]
    assert traj["energy"] is traj.energy
