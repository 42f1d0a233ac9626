"""Unit tests of the C runtime, compiled as it is, with sanitizers."""

import shutil
import subprocess
from pathlib import Path

import pytest
import signorini as sg
from signorini.models import bouncing_ball

ROOT = Path(__file__).resolve().parent.parent


def build_and_run(source: Path, include: Path, folder: Path) -> None:
    gcc = shutil.which("gcc") or shutil.which("cc")
    if gcc is None:
        pytest.skip("no C compiler")
    command = [
        *(gcc, "-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-fsanitize=address,undefined"),
        *("-fno-sanitize-recover=all", f"-I{include}", "-o", str(folder / "units")),
        *(str(source), "-lm"),
    ]
    build = subprocess.run(command, capture_output=True, text=True, check=False)
    assert build.returncode == 0, build.stderr
    assert "warning" not in build.stderr, build.stderr
    result = subprocess.run([folder / "units"], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "0 failed" in result.stdout


def test_kernels(tmp_path: Path) -> None:
    build_and_run(ROOT / "tests" / "c" / "test_runtime.c", ROOT / "runtime" / "c", tmp_path)


def test_step_and_checker(tmp_path: Path) -> None:
    folder = sg.generate(bouncing_ball.model(), tmp_path / "ball", stages=3, prefix="ball")
    build_and_run(ROOT / "tests" / "c" / "test_step.c", folder, tmp_path)
