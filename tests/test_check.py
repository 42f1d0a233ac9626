"""`signorini check` and `generate --check`: they pass what is right and catch what is not."""

import importlib
import json
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest
import signorini as sg
from signorini.locate import shipped
from signorini.models import bouncing_ball, box, slope
from signorini.verify.check import Checker
from trap_models import TRAPS, forms, forty_coordinates, mixed_contacts, one_coordinate

FAST = (bouncing_ball.model, slope.model, box.model, *TRAPS)
LARGE = (
    *(importlib.import_module(f"signorini.models.{name}").model for name in shipped()),
    forms,
    forty_coordinates,
)


def identify(value: object) -> str:
    module = getattr(value, "__module__", "")
    return f"{module.split('.')[-1]}.{value.__name__}" if callable(value) else str(value)


def failures(report: sg.Report) -> list[str]:
    return [f"{i.name}: {i.worst:.2e}" for i in report.items if not i.passed] + report.unseen


@pytest.mark.parametrize(
    "make",
    [pytest.param(m, marks=[pytest.mark.thorough] if m is mixed_contacts else []) for m in FAST],
    ids=identify,
)
def test_models_pass(make: Callable[[], sg.Model]) -> None:
    report = sg.check(make(), stages=(3,))
    assert report, failures(report)


@pytest.mark.slow
@pytest.mark.parametrize("make", (*TRAPS, *LARGE), ids=identify)
def test_every_model_passes_for_two_to_five_stages(make: Callable[[], sg.Model]) -> None:
    report = sg.check(make(), stages=(2, 3, 4, 5), sanitize=True)
    assert report, failures(report)


def test_a_spoiled_stepper_is_caught(tmp_path: Path) -> None:
    """One sign in the generated C of a copy: the report names the equation."""

    def build_spoiled(model: sg.Model, stages: int) -> sg.Stepper:
        folder = sg.generate(model, tmp_path / f"s{stages}", stages=stages)
        source = folder / "mixed_contacts.c"
        text = source.read_text()
        old = "/* g_N_dot = W_N^T v + dg_N/dt */"
        at = text.rindex(old)
        head, tail = text[:at], text[at:]
        source.write_text(head + tail.replace("out->g_N_dot[2] = ", "out->g_N_dot[2] = 0.02 + ", 1))
        return sg.load(folder)

    report = Checker(mixed_contacts(), build_spoiled).run((2,))
    assert not report
    assert any("velocity y" in name for name in failures(report))


def test_report_formats(tmp_path: Path) -> None:
    report = sg.check(one_coordinate(), stages=(2,))
    data = json.loads(report.to_json())
    assert data["passed"] is True
    assert data["counts"]["table"]["impacting"] > 0
    suite = ET.fromstring(report.to_junit())
    assert suite.attrib["failures"] == "0"
    assert int(suite.attrib["tests"]) == len(report.items) + len(report.counts["table"])


def command(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "signorini", *arguments],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )


def test_command_line(tmp_path: Path) -> None:
    result = command(
        *("check", "slope", "--stages", "2", "3", "--seed", "1", "--json", "r.json"),
        *("--junit", "r.xml"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert "passed" in result.stdout
    assert json.loads((tmp_path / "r.json").read_text())["passed"]
    assert (tmp_path / "r.xml").read_text().startswith("<?xml")


def test_drift_is_shown(tmp_path: Path) -> None:
    assert command("generate", "slope", "--stages", "2", cwd=tmp_path).returncode == 0
    same = command("generate", "slope", "--check", "slope_c", cwd=tmp_path)
    assert same.returncode == 0, same.stdout + same.stderr
    source = tmp_path / "slope_c" / "slope.c"
    source.write_text(source.read_text().replace("par.mu = 0.3;", "par.mu = 0.4;"))
    drifted = command("generate", "slope", "--check", "slope_c", cwd=tmp_path)
    assert drifted.returncode == 1
    assert "-    par.mu = 0.4;" in drifted.stdout
    assert "+    par.mu = 0.3;" in drifted.stdout
    assert command("generate", "slope", "--check", "nowhere", cwd=tmp_path).returncode == 1
