"""The command ``signorini`` as a user calls it."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command import signorini

MODEL = """
import sympy as sp
import signorini as sg

def model():
    m = sg.Model("bouncing_ball")
    x, y, phi = m.coordinates("x y phi")
    vx, vy, omega = m.velocities
    mass, R, grav, mu, e_N = m.parameters(mass=1.0, R=0.1, grav=9.81, mu=0.2, e_N=0.5)
    m.lagrangian = mass/2*(vx**2 + vy**2) + sp.Rational(1, 5)*mass*R**2*omega**2 - mass*grav*y
    m.contact("floor", g_N=y - R, gamma_F=vx + R*omega, mu=mu, e_N=e_N)
    m.initial_state(q=[0, 1, 0], v=[0, 0, 50])
    return m

def broken():
    return undefined_name

def wrong():
    m = sg.Model("wrong")
    m.coordinates("x x")
    return m
"""


def call(*arguments: str, cwd: Path, ok: bool = True) -> str:
    result = signorini(cwd, *arguments, COLUMNS="200", NO_COLOR="1")
    assert (result.returncode == 0) == ok, result.stdout + result.stderr
    assert "Traceback" not in result.stderr
    return result.stdout + result.stderr


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "ball.py").write_text(MODEL)
    return tmp_path


def test_run_shows_the_transition(folder: Path) -> None:
    out = call(
        *("run", "bouncing_ball", "--dt", "0.01", "--t-end", "1.1"),
        *("--out", "run.npz", "--plot", "run.png"),
        cwd=folder,
    )
    assert [line.split() for line in out.splitlines() if "│ floor" in line] == [
        ["│", "0.43", "│", "floor", "│", "impact", "│"],
        ["│", "0.73", "│", "floor", "│", "stick", "│"],
    ]
    assert re.search(r"impacts +│ 1 ", out)
    assert "-1.428571429" in out
    assert (folder / "run.png").read_bytes()[:4] == b"\x89PNG"
    with np.load(folder / "run.npz") as data:
        assert data["q"].shape == (111, 3)


def test_run_a_file_with_settings(folder: Path) -> None:
    out = call(
        *("run", "ball.py", "--set", "e_N=0", "mu=0.1", "--v0", "phi=10", "--q0", "y=0.5", "x=2"),
        *("--stages", "2", "--t-end", "1"),
        cwd=folder,
    )
    assert "s = 2" in out
    out2 = call(
        *("run", "ball.py:model", "--set", "e_N=0", "--set", "mu=0.1", "--v0", "phi=10"),
        *("--q0", "y=0.5", "--q0", "x=2", "--stages", "2", "--t-end", "1"),
        cwd=folder,
    )

    def results(text: str) -> list[str]:
        return [line for line in text.splitlines() if "µs per step" not in line]

    assert results(out) == results(out2)


def test_run_a_module(folder: Path) -> None:
    assert "impacts" in call("run", "ball:model", "--t-end", "0.5", cwd=folder)


def test_generate_builds_and_runs(folder: Path) -> None:
    call("generate", "ball.py", "--stages", "2", cwd=folder)
    target = folder / "bouncing_ball_c"
    assert {p.name for p in target.iterdir()} == {
        *(
            "bouncing_ball.c",
            "bouncing_ball_model.c",
            "bouncing_ball.h",
            "example.c",
            "Makefile",
            "CMakeLists.txt",
        ),
        *("README.md", "manifest.json", "bouncing_ball_unity.h"),
    }
    subprocess.run(["make", "-C", str(target)], check=True, capture_output=True)
    table = subprocess.run(
        [str(target / "example")], check=True, capture_output=True, text=True
    ).stdout.split("\n")
    assert table[0] == "t x y phi"
    assert float(table[100].split()[0]) == 1.0


def test_list(folder: Path) -> None:
    out = call("list", cwd=folder)
    for name in ("bouncing_ball", "slider_crank", "slope", "box", "box_in_space"):
        assert name in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "nothing"], "no model 'nothing'"),
        (["run", "nothing.py"], "no file"),
        (["run", "ball.py:none"], "no function 'none'"),
        (["run", "ball.py:broken"], "undefined_name"),
        (["run", "ball.py:wrong"], "used twice"),
        (["run", "ball.py", "--set", "foo=1"], "no parameter 'foo'"),
        (["run", "ball.py", "--set", "mu"], "NAME=VALUE"),
        (["run", "ball.py", "--set", "mu=abc"], "NAME=VALUE"),
        (["run", "ball.py", "--v0", "psi=1"], "'psi'"),
        (["run", "ball.py", "--dt", "-1"], "step size > 0"),
        (["run", "ball.py", "--q0", "y=0"], "gap g_N of 'floor'"),
        (["run", "ball.py", "--out", "no/where/run.npz"], "no folder"),
        (["run", "ball.py", "--plot", "run.xyz"], ".png"),
        (["run", "ball.py", "--stages", "1"], "stages"),
        (["generate", "ball.py", "--prefix", "a b"], "prefix"),
        (["generate", "ball.py", "--out", "ball.py"], "is a file"),
    ],
    ids=lambda x: " ".join(x) if isinstance(x, list) else "",
)
def test_errors_are_one_message(arguments: list[str], message: str, folder: Path) -> None:
    assert message in call(*arguments, cwd=folder, ok=False)
    assert sorted(p.name for p in folder.iterdir() if p.name != "__pycache__") == ["ball.py"]


def test_no_compiler_is_advised(folder: Path) -> None:
    env = os.environ | {"CC": "no-such-compiler", "SIGNORINI_CACHE": str(folder / "cache")}
    result = subprocess.run(
        [sys.executable, "-m", "signorini", "run", "ball.py"],
        cwd=folder, env=env, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert result.returncode == 1
    assert "CC='no-such-compiler'" in result.stderr.replace("\n", " ")
