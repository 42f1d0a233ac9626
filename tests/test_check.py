"""`signorini check` and `generate --check`: they pass what is right and catch what is not."""

import importlib
import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from command import signorini
from signorini.locate import shipped
from signorini.models import bouncing_ball, box, chaplygin_sleigh, conveyor_oscillator, slope
from signorini.verify.check import Checker
from signorini.verify.judge import accepts
from signorini.verify.reference import Reference, Step
from signorini.workflow import drift
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
        source = folder / f"{model.name}.c"
        text = source.read_text()
        old = "/* g_N_dot = W_N^T v + dg_N/dt */"
        at = text.rindex(old)
        head, tail = text[:at], text[at:]
        source.write_text(head + tail.replace("out->g_N_dot[0] = ", "out->g_N_dot[0] = 0.02 + ", 1))
        return sg.load(folder)

    report = Checker(one_coordinate(), build_spoiled).run((2,))
    assert not report
    assert any("velocity y" in name for name in failures(report)), failures(report)


def test_report_formats(tmp_path: Path) -> None:
    report = sg.check(one_coordinate(), stages=(2,))
    data = json.loads(report.to_json())
    assert data["passed"] is True
    assert data["counts"]["table"]["impacting"] > 0
    suite = ET.fromstring(report.to_junit())
    assert suite.attrib["failures"] == "0"
    assert int(suite.attrib["tests"]) == len(report.items) + len(report.counts["table"])


def test_command_line(tmp_path: Path) -> None:
    result = signorini(
        tmp_path,
        *("check", "slope", "--stages", "2", "3", "--seed", "1", "--json", "r.json"),
        *("--junit", "r.xml"),
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert "passed" in result.stdout
    assert json.loads((tmp_path / "r.json").read_text())["passed"]
    assert (tmp_path / "r.xml").read_text().startswith("<?xml")


def test_drift_is_shown(tmp_path: Path) -> None:
    assert signorini(tmp_path, "generate", "slope", "--stages", "2").returncode == 0
    same = signorini(tmp_path, "generate", "slope", "--check", "slope_c")
    assert same.returncode == 0, same.stdout + same.stderr
    source = tmp_path / "slope_c" / "slope.c"
    source.write_text(source.read_text().replace("par.mu = 0.3;", "par.mu = 0.4;"))
    drifted = signorini(tmp_path, "generate", "slope", "--check", "slope_c")
    assert drifted.returncode == 1
    assert "-    par.mu = 0.4;" in drifted.stdout
    assert "+    par.mu = 0.3;" in drifted.stdout
    sg.generate(slope.model(), tmp_path / "more", stages=2, derivatives=True)
    assert not drift(slope.model(), tmp_path / "more")
    assert signorini(tmp_path, "generate", "slope", "--check", "nowhere").returncode == 1


# --- what a check proves ---------------------------------------------------------------------


def _places(folder: Path, literal: str) -> list[tuple[str, int]]:
    """Where a number stands in the compiled text, comments left out."""
    found = []
    for path in sorted(folder.glob("*.c")):
        if path.name == "example.c":
            continue
        text = re.sub(r"/\*.*?\*/", lambda m: " " * len(m[0]), path.read_text(), flags=re.S)
        pattern = rf"(?<![\w.]){re.escape(literal)}(?![\w.])"
        found += [(path.name, m.start()) for m in re.finditer(pattern, text)]
    return found


def _flipped(model: sg.Model, stages: int, folder: Path, place: tuple[str, int]) -> sg.Stepper:
    name, at = place
    made = sg.generate(model, folder / f"{name}{at}", stages=stages)
    text = (made / name).read_text()
    (made / name).write_text(f"{text[:at]}(-1) * {text[at:]}")
    return sg.load(made)


def _matters(right: sg.Stepper, wrong: sg.Stepper, dt: float) -> bool:
    t = right.initial_state()[0]
    try:
        one, other = (s.simulate(t_end=t + 20 * dt, dt=dt).q for s in (right, wrong))
    except sg.StepError:
        return True
    return not np.allclose(one, other, rtol=1e-9, atol=0)


def light_oscillator(mass: float) -> sg.Model:
    m = sg.Model("oscillator")
    x, y = m.coordinates("x y")
    vx, vy = m.velocities
    (mm,) = m.parameters(mm=mass)
    m.lagrangian = mm * (vx**2 + vy**2) / 2 - mm * sp.Float(48.0) * x**4 - mm * 9.81 * y
    m.contact("floor", g_N=y, gamma_F=vx, mu=0.3, e_N=0.5)
    m.initial_state(q=[0.1, 0.1])
    m.suggest(dt=1e-3, t_end=0.5)
    return m


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("make", "number"),
    [
        (lambda: light_oscillator(1e-12), "48.0"),
        (lambda: light_oscillator(1.0), "48.0"),
        (chaplygin_sleigh.model, repr(5 / 24)),
    ],
)
def test_a_flipped_sign_fails(make: Callable[[], sg.Model], number: str, tmp_path: Path) -> None:
    """Each place of a number whose sign changes a run: in small units, in the default form."""
    model = make()
    right = sg.load(sg.generate(model, tmp_path / "right", stages=3))
    faults = [
        place
        for place in _places(tmp_path / "right", number)
        if _matters(right, _flipped(model, 3, tmp_path / "look", place), 2e-3)
    ]
    assert faults
    for place in faults:
        report = sg.check(
            model,
            stages=(3,),
            build=lambda m, s, place=place: _flipped(m, s, tmp_path / "check", place),
        )
        assert not report, place
        assert report.reasons


@pytest.mark.parametrize(
    ("make", "options", "words"),
    [
        (bouncing_ball.model, {"scheme": "moreau"}, "Moreau's midpoint scheme"),
        (bouncing_ball.model, {"precision": "float"}, "float precision"),
        (chaplygin_sleigh.model, {}, "velocity constraints at full order"),
        (chaplygin_sleigh.model, {"velocity_constraints": "paper"}, "the paper's form"),
        (bouncing_ball.model, {"prefix": "b"}, "prefix b"),
        pytest.param(
            *(bouncing_ball.model, {"events": "located"}, "located events (T13)"),
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            *(conveyor_oscillator.model, {"events": "located"}, "located events (T13)"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_every_form_is_checked_and_named(
    make: Callable[[], sg.Model], options: dict[str, str], words: str
) -> None:
    report = sg.check(make(), stages=(2,), **options)
    assert report, str(report)
    assert words in " ".join(report.covers)
    assert "not covered: substeps" in str(report)


def crank(**never: dict[str, str]) -> sg.Model:
    """Friction on a prescribed motion: it never sticks."""
    m = sg.Model("crank")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2
    m.constraint("drive", x - sp.sin(10 * m.time))
    m.friction("rail", gamma_F=v, bound=2.0, **never)
    m.initial_state(q=[0], v=[10])
    return m


def test_waivers() -> None:
    """Without one the report says what was never seen; with one it repeats the reason; a wrong one
    fails."""
    waived = sg.check(crank(never={"sticking": "its motion is prescribed"}), stages=(2,))
    assert waived
    assert "rail: never sticking, because its motion is prescribed" in str(waived)
    wrong = sg.check(crank(never={"slipping": "a lie"}), stages=(2,))
    assert not wrong
    assert "rail was seen slipping" in str(wrong)
    assert "rail was never seen sticking" in str(wrong)
    assert "rail was never seen sticking" in repr(wrong)  # what pytest shows of a failed assert
    assert "a lie" in wrong.to_json()
    with pytest.raises(sg.ModelError, match=r"never of friction 'rail'.*sticking"):
        crank(never={"flying": "no"})
    with pytest.raises(sg.GenerationError, match="it decides on these itself"):
        sg.check(crank(), build=lambda m, s: sg.build(m, stages=s), precision="float")


def test_a_judge_of_steps() -> None:
    """It takes a solved step and none that is spoiled: friction along the slip, a pull, a gap."""
    model = bouncing_ball.model()
    reference = Reference(model, 2)
    par = [float(p.default) for p in model.parameter_table.values()]
    at, h = (0.0, np.array([0, 0.1, 0]), np.array([1.0, 0, 0]), np.zeros(0), par), 1e-2
    step = reference.solve(*at, h)
    assert step is not None
    assert accepts(reference, step, at, h, 1e-8)
    for column in range(2):
        for factor in (-1.0, 1.01):
            spoiled = Step(step.V.copy(), step.v_end.copy(), step.R.copy())
            spoiled.R[:, column] *= factor
            assert not accepts(reference, spoiled, at, h, 1e-8)
    # velocities that belong to friction along the slip
    along = Step(step.V.copy(), step.v_end.copy(), step.R.copy())
    along.R[:, 1] *= -1
    P = reference.b @ along.R
    W = reference.e.W(0.0, at[1], along.v_end, at[3], par)
    along.v_end[:] = at[2] + np.linalg.solve(reference.mass(at), W @ P + [0, -9.81 * h, 0])
    assert not accepts(reference, along, at, h, 1e-8)


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "s"), [("cradle", 2), ("rocking_block", 3)])
def test_bounds_and_bodies_at_rest_are_no_errors(name: str, s: int) -> None:
    """Parameters stay within their bounds; round-off of a body at rest is no other motion."""
    model = importlib.import_module(f"signorini.models.{name}").model()
    report = sg.check(model, stages=(s,))
    assert report, str(report)
