"""Results of a campaign: table, files, failed steps."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from signorini.runtime.errors import RunError
from signorini.runtime.files import write_text
from signorini.runtime.replay import FailedStep
from signorini.runtime.replay import replay as take_again
from signorini.runtime.stepper import Stepper
from signorini.stress.campaign import RESCUES, Result, stepper_of
from signorini.stress.corpus import SCENES
from signorini.stress.enumeration import Verdict, examine

_HEADINGS = (
    *("scene", "s", "runs", "steps", "counted", "failed", "proven", "captured", "substeps"),
    *RESCUES,
    *("mean", "99.9 %", "max", "gap", "compl.", "cone", "gain", "lost", "push"),
)
_TIMES = ("median us", "99.9 % us", "worst us")
_SHARES = dict(zip(_TIMES, (0.5, 0.999, 1.0), strict=True))
_WIDTH = 190
LEGEND = (
    "counted: steps with a change of contact state or at least two closed contacts; failed: steps "
    "left unsolved, proven: those of them that have no solution; captured: located steps that fell "
    "back to capturing, at least their rest; substeps, cold, path, soft, relaxed: "
    "steps that needed them; mean, 99.9 %, max: Newton iterations of a step; gap: smallest at a "
    "stage [m]; compl., cone: worst relative violation of complementarity and friction law; "
    "gain: largest energy above the start's where none may be gained, over the kinetic energy; "
    "lost: contacts that pushed at a stage without taking part in the impact; push: contacts that "
    "approach for more than two steps while they push"
)
_OF_TIMES = "; us: CPU time of a step, of all steps, those included that failed"


class Results:
    """Results by scene and number of stages.

    Parameters
    ----------
    scenes, stages
        What is run, in the order of the table.
    """

    def __init__(self, scenes: Sequence[str], stages: Sequence[int]) -> None:
        self.rows = {(name, s): Result(name, s) for name in scenes for s in stages}
        self.total = Result("all", 0)
        self.verdicts: list[tuple[FailedStep, Verdict]] = []

    def add(self, result: Result) -> None:
        """Add one chunk of runs."""
        self.rows[result.scene, result.stages].add(result)
        self.total.add(result)

    def examine(self) -> int:
        """Examine all failed steps; returns how many are not proven to have no solution."""
        self.verdicts = [(step, examine(_stepper_of(step), step)) for step in self.total.failures]
        return sum(not verdict.proven for _, verdict in self.verdicts)

    @property
    def headings(self) -> tuple[str, ...]:
        """Headings of the table; those of times where steps were measured."""
        return (*_HEADINGS, *(_TIMES if self.total.times else ()))

    @property
    def legend(self) -> str:
        """What they mean."""
        return LEGEND + (_OF_TIMES if self.total.times else "")

    def table(self) -> list[tuple[str, ...]]:
        """Rows of text, the sum at the end."""
        return [self._row(r) for r in [*self.rows.values(), self.total]]

    def _row(self, r: Result) -> tuple[str, ...]:
        own = [
            v.proven for step, v in self.verdicts
            if r is self.total or (step.about["scene"], step.stages) == (r.scene, r.stages)
        ]  # fmt: skip
        counts = (r.runs, r.steps, r.counted, len(r.failures), sum(own), r.captured, r.substepped)
        return (
            r.scene, str(r.stages or ""), *map(str, counts),
            *(str(r.rescues[name]) for name in RESCUES),
            f"{r.mean:.1f}", str(r.quantile(0.999)), str(max(r.iterations, default=0)),
            *(f"{x:.0e}" for x in (r.gap, r.complementarity, r.cone, r.gain)),
            str(r.lost), str(r.pushing),
            *(f"{r.time(share):.0f}" for share in _SHARES.values() if self.total.times),
        )  # fmt: skip

    def show(self, console: Console) -> None:
        """Print the table and the verdicts."""
        table = Table(box=box.SIMPLE_HEAD, padding=(0, 0, 0, 1))
        for k, heading in enumerate(self.headings):
            table.add_column(heading, justify="right" if k else "left", no_wrap=True)
        for row in self.table():
            table.add_row(*row)
        # All columns or none: a table squeezed into a narrow terminal cannot be read.
        Console(file=console.file, width=max(console.width, _WIDTH)).print(table)
        console.print(self.legend, style="dim", markup=False, highlight=False)
        for step, verdict in self.verdicts:
            console.print(f"{name_of(step)}: {verdict.text}", markup=False, highlight=False)

    def markdown(self) -> str:
        """The table for the documentation."""
        lines = ["| " + " | ".join(self.headings) + " |"]
        lines.append("|---|" + "---:|" * (len(self.headings) - 1))
        lines += ["| " + " | ".join(row) + " |" for row in self.table()]
        return "\n".join([*lines, "", self.legend + ".", ""])

    def to_json(self) -> str:
        """All counts, by scene and number of stages."""
        rows = []
        for r in self.rows.values():
            row: dict[str, Any] = {f.name: getattr(r, f.name) for f in fields(r)}
            row["failures"] = [name_of(step) for step in r.failures]
            row["times"] = {name: r.time(x) for name, x in _SHARES.items() if r.times}
            row["iterations"] = {str(k): n for k, n in sorted(r.iterations.items())}
            rows.append(row)
        return json.dumps({"rows": rows}, indent=1)

    def save(self, folder: Path) -> None:
        """Write stress.md, stress.json and a replay file of every failed step."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunError(f"cannot write into {folder}: {error.strerror}") from None
        write_text(folder / "stress.md", self.markdown())
        write_text(folder / "stress.json", self.to_json() + "\n")
        for step, _ in self.verdicts:
            step.save(folder / f"{name_of(step)}.json")


def _stepper_of(step: FailedStep) -> Stepper:
    return stepper_of(step.about["scene"], step.stages, step.options.get("events", "captured"))


def name_of(step: FailedStep) -> str:
    """Name of a failed step of the corpus."""
    about = step.about
    return f"{about['scene']}-s{step.stages}-run{about['run']}-step{about['step']}"


def replay(path: Path) -> Iterator[str]:
    """Take a failed step of the corpus again and examine it; yields lines to print."""
    step = FailedStep.load(path)
    scene = step.about.get("scene") if isinstance(step.about, dict) else None
    if scene not in SCENES:
        raise RunError(
            f"{path} is of no scene of the corpus: load it with signorini.runtime.replay.FailedStep"
        )
    stepper = _stepper_of(step)
    result = take_again(stepper, step)
    yield f"{scene}, s = {step.stages}, t = {step.state['t']:g}, h = {step.h:g}"
    yield (
        f"then: {step.status}, now: {result['status']} after {result['iterations']} iterations, "
        f"{result['substeps']} substeps"
    )
    verdict = examine(stepper, step)
    yield f"{verdict.text} ({verdict.combinations} combinations of contact states)"
