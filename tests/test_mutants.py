"""Would our own tests notice? Every planted fault of `mutants.MUTANTS` must be caught.

``pytest tests/test_mutants.py -m slow`` takes about an hour on two cores and writes
docs/mutants.md. Of every fault it also says whether `signorini check` of two models, which is
what a user has, notices it without our tests.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from mutants import MUTANTS, Mutant

ROOT = Path(__file__).resolve().parent.parent
PARTS = (
    "benchmarks",
    "bodies",
    "codegen",
    "models",
    "runtime",
    "stress",
    "studies",
    "templates",
    "verify",
    "view",
)
# What `signorini check` is asked alone: a model with a row of every kind, all moving with time, and
# one at full order.
CHECKED = ("rheonomic", "only_constraints")
# An editable install looks the package up before the path does; the copy has to come first.
_COPY_FIRST = """import sys
sys.meta_path[:] = [f for f in sys.meta_path if "editable" not in getattr(f, "__module__", "")]
"""
# Fast and broad first; the first group that fails has caught the fault.
CATCHERS = (
    ("units of C, tableaux", "tests/test_tableau.py tests/test_c_units.py", ""),
    (
        "functions against 50 digits",
        "tests/test_functions.py",
        "rheonomic or mixed or forms",
    ),
    (
        "Jacobians and steps against the reference",
        "tests/test_steps.py",
        "(rheonomic or mixed or sticking or only_constraints or unconstrained or slope)"
        " and not 5 and not 4",
    ),
    (
        "benchmarks and robustness",
        "tests/test_benchmarks.py tests/test_robustness.py",
        "(ball or equal or stress or units or scratch or any_mass or pushed) and not 5 and not 4",
    ),
    (
        "rest, stability, records",
        "tests/test_rest.py tests/test_stability.py tests/test_records.py",
        "",
    ),
    (
        "full order, Moreau, theta",
        "tests/test_full_order.py tests/test_moreau.py tests/test_theta.py",
        "not coin",
    ),
    ("located events", "tests/test_located.py", ""),
    ("parts", "tests/test_parts.py tests/test_join.py", ""),
    ("tolerances", "tests/test_tolerance.py", ""),
    (
        "derivatives",
        "tests/test_derivatives.py tests/test_adjoint.py tests/test_linearise.py "
        "tests/test_optimisers.py",
        "not hopper",
    ),
    ("tables", "tests/test_tables.py", ""),
    ("anisotropic friction", "tests/test_elliptic.py", ""),
    ("polygons", "tests/test_polygons.py", ""),
    (
        "bodies, sizes of terms",
        "tests/test_bodies.py tests/test_commands_for_models.py",
        "kinematics or magnitude or springs or spin_of_a_body",
    ),
    ("loops", "tests/test_generated_code.py", "stride"),
    (
        "what is seen and learned",
        "tests/test_view.py tests/test_learning.py",
        "arrows or percussion or panels or episode",
    ),
    (
        "stress",
        "tests/test_stress.py",
        "left_of or substeps or hold_solve or rough or relax or painleve or groove or chain "
        "or judge or enumeration or drop or proven",
    ),
    ("hostile input", "tests/test_hostile.py", "fuzz and not minutes"),
    ("runs", "tests/test_runs.py", "not neither"),
    ("check", "tests/test_check.py", "models_pass and (mixed or sticking)"),
    (
        "steps with four and five stages",
        "tests/test_steps.py",
        "(bouncing or rheonomic) and (4 or 5)",
    ),
)


def test_every_old_text_is_there() -> None:
    assert len(MUTANTS) >= 60
    for m in MUTANTS:
        assert m.old in (ROOT / m.file).read_text(), m
    assert len({m.fault for m in MUTANTS}) == len(MUTANTS)


def plant(m: Mutant, folder: Path) -> dict[str, str]:
    """A copy of the project with one fault; returns the environment to run it in."""
    for part in ("api", *PARTS, "tests", "generated"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    for part in ("constraints.txt", "pyproject.toml"):
        shutil.copy(ROOT / part, folder / part)
    path = folder / m.file
    path.write_text(path.read_text().replace(m.old, m.new, 1))
    package = folder / "build" / "signorini"
    package.mkdir(parents=True)
    for source in (folder / "api").iterdir():
        (package / source.name).symlink_to(source)
    for part in PARTS:
        (package / part).symlink_to(folder / part)
    (package.parent / "sitecustomize.py").write_text(_COPY_FIRST)
    environment = os.environ | {
        "PYTHONPATH": str(package.parent),
        "SIGNORINI_CACHE": str(folder / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    found = subprocess.run(
        [sys.executable, "-c", "import signorini.codegen.frontend.model as m; print(m.__file__)"],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    # a fault that breaks the import is found by the first test
    assert found.returncode or Path(found.stdout.strip()).is_relative_to(folder), found.stdout
    return environment


def caught_by_check(folder: Path, environment: dict[str, str]) -> bool:
    """Whether `signorini check` of CHECKED alone notices a fault."""
    for model in CHECKED:
        command = ["-m", "signorini", "check", f"tests/trap_models.py:{model}", "--stages", "3"]
        try:
            result = subprocess.run(
                [sys.executable, *command],
                cwd=folder,
                env=environment | {"SIGNORINI_CFLAGS": "-O0"},
                capture_output=True,
                check=False,
                timeout=400,
            )
        except subprocess.TimeoutExpired:
            return True
        if result.returncode:
            return True
    return False


def catcher(folder: Path, environment: dict[str, str]) -> str:
    """Name of the test that catches a fault, or ''."""
    for name, files, keyword in CATCHERS:
        selection = ["-k", keyword] if keyword else []
        try:
            result = subprocess.run(
                [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", *files.split(), *selection],
                cwd=folder,
                env=environment,
                capture_output=True,
                text=True,
                check=False,
                timeout=400,
            )
        except subprocess.TimeoutExpired:
            return f"{name}: does not end"
        if result.returncode == 1:
            failed = re.search(r"^FAILED (\S+)", result.stdout, re.MULTILINE)
            return f"{name}: {failed[1].split('::')[-1] if failed else 'failed'}"
        if result.returncode != 0:
            return f"{name}: does not start"
    return ""


@pytest.mark.slow
def test_every_fault_is_caught(tmp_path: Path) -> None:
    def one(k: int) -> tuple[str, bool]:
        folder = tmp_path / str(k)
        environment = plant(MUTANTS[k], folder)
        found = catcher(folder, environment), caught_by_check(folder, environment)
        shutil.rmtree(folder, ignore_errors=True)
        return found

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        found = list(pool.map(one, range(len(MUTANTS))))
    (ROOT / "docs" / "mutants.md").write_text(table(found))
    assert not [m.fault for m, (by, _) in zip(MUTANTS, found, strict=True) if not by]


def table(found: Sequence[tuple[str, bool]]) -> str:
    """The page: what caught each fault, and whether the check alone does."""
    caught = sum(alone for _, alone in found)
    lines = [
        "# Planted faults and what catches them",
        "",
        "Written by `pytest tests/test_mutants.py -m slow`: each fault is one change of text in a",
        "copy of the project; the first test that fails has caught it. The last column says",
        f"whether `signorini check` of two models ({' and '.join(CHECKED)}, s = 3) notices it",
        f"alone: it does for {caught} of {len(found)} ({caught / len(found):.0%}). What it does",
        "not notice are faults of what it leaves out and says so (rescues, substeps, options), and",
        "of rows that these two models lack.",
        "",
        "| fault | file | caught by | check alone |",
        "|---|---|---|---|",
        *(
            f"| {m.fault} | `{m.file}` | {by or '**nothing**'} | {'yes' if alone else 'no'} |"
            for m, (by, alone) in zip(MUTANTS, found, strict=True)
        ),
    ]
    return "\n".join(lines) + "\n"
