"""Options and shared steppers of the test suite."""

import os
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import signorini as sg

sys.path.insert(0, str(Path(__file__).resolve().parent))
import branch_coverage

ROOT = Path(__file__).resolve().parent.parent

# A cache of its own: nothing compiled earlier may hide a fault.
os.environ.setdefault(
    "SIGNORINI_CACHE",
    str(Path(tempfile.gettempdir()) / f"signorini-tests-{os.getppid()}"),
)
# Most of the suite's time is compilation, and few tests run long.
os.environ.setdefault("SIGNORINI_CFLAGS", "-O0")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="rewrite the golden steppers in generated/"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Tests with these markers run only when asked for by the marker."""
    chosen = config.option.markexpr or ""
    for marker, what in (
        ("slow", "a long study: run with -m slow"),
        ("thorough", "another machine, compiler or analyser: run with -m thorough"),
    ):
        if marker not in chosen:
            for item in items:
                if marker in item.keywords:
                    item.add_marker(pytest.mark.skip(reason=what))


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def stepper() -> Callable[..., sg.Stepper]:
    """Build a stepper once per test process: ``stepper(model_function, stages)``."""

    @cache
    def make(
        model: Callable[[], sg.Model], stages: int = 3, velocity_constraints: str | None = None
    ) -> sg.Stepper:
        return sg.build(model(), stages=stages, velocity_constraints=velocity_constraints)

    return make


_BEGIN = time.time()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """What the run cost; branches of the C runtime that its unit tests took in it."""
    if not hasattr(terminalreporter.config, "workerinput"):
        made = (Path(os.environ["SIGNORINI_CACHE"]) / "compiled").glob("*.sha256")
        count = sum(path.stat().st_mtime >= _BEGIN for path in made)
        cpu = sum(os.times()[:4])
        terminalreporter.write_line(f"{count} steppers compiled, {cpu:.0f} CPU seconds")
    if any("test_branches" in r.nodeid for r in terminalreporter.getreports("passed")):
        terminalreporter.section("branches of runtime/c taken by its unit tests")
        terminalreporter.write(branch_coverage.REPORT.read_text())
