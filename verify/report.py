"""What `check` found: comparisons, kinds of motion seen, and why it failed."""

import json
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from typing import Any

from rich.console import Console
from rich.table import Table


@dataclass(frozen=True)
class Item:
    """One comparison: the worst error over all its samples, relative to the quantity's size."""

    name: str
    equation: str
    worst: float
    tolerance: float
    samples: int

    @property
    def passed(self) -> bool:
        return self.samples > 0 and self.worst <= self.tolerance


@dataclass
class Report:
    """Outcome of `check`.

    Attributes
    ----------
    model : str
        Name of the model.
    items : list of Item
        Comparisons.
    counts : dict
        Contact -> kind of motion -> number of verified steps that showed it, over all stages.
    never : dict
        Contact -> kind of motion -> why the model says that it never occurs.
    covers : list of str
        What was compared: schemes, forms, precisions, options.
    left_out : list of str
        What a stepper can do that this run did not look at.
    notes : list of str
        What was noticed besides.
    """

    model: str
    items: list[Item] = field(default_factory=list)
    counts: dict[str, dict[str, int]] = field(default_factory=dict)
    never: dict[str, dict[str, str]] = field(default_factory=dict)
    covers: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def waiver(self, contact: str, kind: str) -> str | None:
        """The reason why a kind of motion never occurs, if the model gives one."""
        for waived, reason in self.never.get(contact, {}).items():
            if kind == waived or kind.startswith(f"{waived} "):
                return reason
        return None

    @property
    def unseen(self) -> list[str]:
        """Kinds of motion that no verified step showed and that the model does not waive."""
        return [
            f"{contact}: {kind}"
            for contact, kinds in self.counts.items()
            for kind, count in kinds.items()
            if count == 0 and self.waiver(contact, kind) is None
        ]

    @property
    def contradicted(self) -> list[str]:
        """Kinds of motion that the model says never occur and that were seen."""
        return [
            f"{contact}: {kind}"
            for contact, kinds in self.counts.items()
            for kind, count in kinds.items()
            if count and self.waiver(contact, kind) is not None
        ]

    @property
    def passed(self) -> bool:
        """Whether every comparison holds and every kind of motion was seen or rightly waived."""
        held = bool(self.items) and all(i.passed for i in self.items)
        return held and not self.unseen and not self.contradicted

    def __bool__(self) -> bool:
        return self.passed

    @property
    def reasons(self) -> list[str]:
        """Why the check failed, in sentences; nothing if it passed."""
        found = [
            f"{i.name} ({i.equation}): the worst error is {i.worst:.3g}, allowed is {i.tolerance:g}"
            if i.samples
            else f"{i.name} ({i.equation}): nothing could be compared"
            for i in self.items
            if not i.passed
        ]
        if not self.items:
            found.append("nothing was compared")
        for entry in self.unseen:
            contact, _, kind = entry.partition(": ")
            found.append(
                f"{contact} was never seen {kind} in a verified step: start the model nearer to "
                f"where that happens, or say why it never does with "
                f'never={{"{kind.split()[0]}": "the reason"}}'
            )
        for entry in self.contradicted:
            contact, _, kind = entry.partition(": ")
            found.append(
                f"{contact} was seen {kind}, which the model says never happens "
                f"({self.waiver(contact, kind)})"
            )
        return found

    def __str__(self) -> str:
        head = f"check of {self.model}: {'passed' if self.passed else 'FAILED'}"
        waived = [
            f"{contact}: never {kind}, because {reason}"
            for contact, kinds in self.never.items()
            for kind, reason in kinds.items()
        ]
        lines = [
            head,
            *(f"  {reason}" for reason in self.reasons),
            *(f"  covers: {text}" for text in self.covers),
            *(f"  not covered: {text}" for text in self.left_out),
            *(f"  waived: {text}" for text in waived),
            *(f"  note: {text}" for text in self.notes),
        ]
        return "\n".join(lines)

    __repr__ = __str__

    def to_dict(self) -> dict[str, Any]:
        """The report as plain data."""
        return {
            "model": self.model,
            "passed": self.passed,
            "items": [vars(i) | {"passed": i.passed} for i in self.items],
            "counts": self.counts,
            "unseen": self.unseen,
            "contradicted": self.contradicted,
            "never": self.never,
            "covers": self.covers,
            "left_out": self.left_out,
            "reasons": self.reasons,
            "notes": self.notes,
        }

    def to_json(self) -> str:
        """The report as JSON."""
        return json.dumps(self.to_dict(), indent=1)

    def to_junit(self) -> str:
        """The report as JUnit XML, one test case for each comparison and kind of motion."""
        failed = [i for i in self.items if not i.passed]
        suite = ET.Element(
            "testsuite",
            name=f"signorini check {self.model}",
            tests=str(len(self.items) + sum(len(k) for k in self.counts.values())),
            failures=str(len(failed) + len(self.unseen) + len(self.contradicted)),
        )
        for i in self.items:
            case = ET.SubElement(suite, "testcase", classname=self.model, name=i.name)
            if not i.passed:
                text = f"{i.equation}: worst error {i.worst:.3g} > {i.tolerance:g}"
                ET.SubElement(case, "failure", message=text)
        for contact, kinds in self.counts.items():
            for kind, count in kinds.items():
                case = ET.SubElement(
                    suite, "testcase", classname=self.model, name=f"{contact}: {kind}"
                )
                entry = f"{contact}: {kind}"
                if entry in self.unseen:
                    ET.SubElement(case, "failure", message="never seen in a verified step")
                elif entry in self.contradicted:
                    ET.SubElement(case, "failure", message="seen, though the model waives it")
                elif not count:
                    ET.SubElement(case, "skipped", message=str(self.waiver(contact, kind)))
        return ET.tostring(suite, encoding="unicode", xml_declaration=True)

    def show(self, console: Console) -> None:
        """Print the report as tables."""
        table = Table(
            title=f"{self.model}: generated C against the reference", title_justify="left"
        )
        for heading in ("", "equation"):
            table.add_column(heading)
        for heading in ("worst error", "tolerance", "samples", ""):
            table.add_column(heading, justify="right")
        for i in self.items:
            verdict = "[green]ok" if i.passed else "[bold red]FAILED"
            table.add_row(
                i.name, i.equation, f"{i.worst:.1e}", f"{i.tolerance:.0e}", str(i.samples), verdict
            )
        console.print(table)
        if self.counts:
            table = Table(title="verified steps in which a contact was seen", title_justify="left")
            table.add_column("contact")
            table.add_column("kinds of motion")
            for contact, kinds in self.counts.items():
                text = ", ".join(
                    f"{kind} {count}"
                    if count or self.waiver(contact, kind) is not None
                    else f"[bold red]{kind} 0[/]"
                    for kind, count in kinds.items()
                )
                table.add_row(contact, text)
            console.print(table)
        console.print(str(self), style="" if self.passed else "red", markup=False, highlight=False)
