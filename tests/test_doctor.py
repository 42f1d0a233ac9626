"""What `signorini doctor` says where everything is there, and where something is not."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest


def doctor(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "signorini", "doctor", *arguments],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_everything_is_there() -> None:
    result = doctor("--json")
    assert result.returncode == 0, result.stdout
    found = {f["name"]: f for f in json.loads(result.stdout)}
    assert all(f["ok"] is not False for f in found.values())
    assert found["a stepper"]["text"] == "falls 0.04905 m in 0.1 s"
    assert "MB" in found["cache"]["text"]


@pytest.mark.parametrize(
    ("variable", "value", "name", "says"),
    [
        ("CC", "no-such-compiler", "C compiler", "is not on the PATH: install it or unset CC"),
        ("SIGNORINI_CACHE", "/dev/null/x", "cache", "name another one in SIGNORINI_CACHE"),
    ],
)
def test_what_is_missing_is_said(
    variable: str, value: str, name: str, says: str, tmp_path: Path
) -> None:
    result = doctor("--json", **{"SIGNORINI_CACHE": str(tmp_path)} | {variable: value})
    assert result.returncode == 1
    assert "Traceback" not in result.stderr
    found = {f["name"]: f for f in json.loads(result.stdout)}
    assert found[name]["ok"] is False
    assert says in found[name]["text"]
    assert found["a stepper"]["ok"] is False
    assert found["numpy"]["ok"] is True


@pytest.mark.thorough
def test_a_compiler_that_comes_by_pip(tmp_path: Path) -> None:
    """Without a compiler on the PATH ziglang's is found, and its steps are those of the other."""
    pytest.importorskip("ziglang", reason="pip install 'signorini[cc]'")
    code = (
        "import signorini as sg\nfrom signorini.models import slider_crank\n"
        "traj = sg.build(slider_crank.model(), stages=2).simulate(t_end=0.01, dt=1e-4)\n"
        "print(traj.q[-1].tobytes().hex(), traj.P_N.tobytes().hex())"
    )
    empty = tmp_path / "bin"
    empty.mkdir()
    said = []
    for place in (os.environ["PATH"], str(empty)):
        cache = str(tmp_path / f"cache{len(said)}")
        changed = {k: v for k, v in os.environ.items() if k != "CC"}
        changed |= {"PATH": place, "SIGNORINI_CACHE": cache, "HOME": str(tmp_path)}
        result = subprocess.run(
            [sys.executable, "-c", code], env=changed, capture_output=True, text=True, check=False
        )
        assert result.returncode == 0, result.stderr[-2000:]
        said.append(result.stdout)
    assert said[0] == said[1]
    found = doctor("--json", PATH=str(empty), SIGNORINI_CACHE=str(tmp_path / "c"), CC="")
    compiler = next(f for f in json.loads(found.stdout) if f["name"] == "C compiler")
    assert "ziglang cc" in compiler["text"]
