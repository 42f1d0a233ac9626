"""Unit tests of the C runtime, compiled as it is, with sanitizers."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def test_kernels(tmp_path: Path) -> None:
    gcc = shutil.which("gcc") or shutil.which("cc")
    if gcc is None:
        pytest.skip("no C compiler")
    command = [
        *(gcc, "-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-fsanitize=address,undefined"),
        *("-fno-sanitize-recover=all", f"-I{ROOT / 'runtime' / 'c'}"),
        *("-o", str(tmp_path / "units"), str(ROOT / "tests" / "c" / "test_runtime.c"), "-lm"),
    ]
    build = subprocess.run(command, capture_output=True, text=True, check=False)
    assert build.returncode == 0, build.stderr
    result = subprocess.run([tmp_path / "units"], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "0 failed" in result.stdout
