"""Branch coverage of the C runtime by its own unit tests, counted by gcov.

The generated stepper carries the runtime verbatim between markers; `#line` directives put behind
the markers let the compiler attribute every branch to its file in runtime/c.
"""

import json
import re
import subprocess
from collections import defaultdict
from pathlib import Path

from signorini.codegen.c.build import runtime_file
from signorini.codegen.c.emit import RUNTIME_END, TABLES_BEGIN

MARKER = re.compile(r"^/\* ---- (sg_\w+\.[ch]) -+ \*/\n\n", re.MULTILINE)
REPORT = Path(__file__).resolve().parent.parent / "build" / "branches.txt"
# (file, line, number of branches) → how often each branch was taken.
Branches = dict[tuple[str, int, int], list[int]]


def with_lines(source: str) -> str:
    """The stepper's text with every runtime file attributed to itself."""

    def attributed(m: re.Match[str]) -> str:
        # includes and what stands before them are left out of the stepper
        head = re.match(r'(#pragma once\n|#include "sg_\w+\.[ch]"\n|\n)*', runtime_file(m[1]))
        first = 1 + (head[0].count("\n") if head else 0)
        return f'{m[0]}#line {first} "{m[1]}"\n'

    text = MARKER.sub(attributed, source)
    for mark in (TABLES_BEGIN, RUNTIME_END):
        text = text.replace(mark, f'#line 1 "generated.c"\n{mark}')
    return text


def collect(folder: Path, found: Branches) -> None:
    """Add the branch counts of one instrumented run."""
    (notes,) = folder.glob("*.gcno")
    result = subprocess.run(
        [
            "gcov",
            "--json-format",
            "--branch-probabilities",
            "--branch-counts",
            "--stdout",
            notes.name,
        ],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    for document in result.stdout.splitlines():
        for file in json.loads(document)["files"]:
            name = Path(file["file"]).name
            if not name.startswith("sg_"):
                continue
            for line in file["lines"]:
                counts = [branch["count"] for branch in line["branches"]]
                if counts:
                    key = (name, line["line_number"], len(counts))
                    total = found.setdefault(key, [0] * len(counts))
                    for k, count in enumerate(counts):
                        total[k] += count


def summary(found: Branches) -> tuple[dict[str, tuple[int, int]], list[str]]:
    """Taken and existing branches of every file, and the lines with branches never taken.

    A model without bilateral constraints, say, folds some conditions away: of one line the form
    with most branches counts.
    """
    widest: dict[tuple[str, int], int] = defaultdict(int)
    for name, number, count in found:
        widest[name, number] = max(widest[name, number], count)
    totals: dict[str, tuple[int, int]] = {}
    missing = []
    for (name, number, count), counts in sorted(found.items()):
        if count < widest[name, number]:
            continue
        taken, all_ = totals.get(name, (0, 0))
        totals[name] = (taken + sum(c > 0 for c in counts), all_ + count)
        if 0 in counts:
            missing.append(f"{name}:{number}")
    return totals, missing


def table(totals: dict[str, tuple[int, int]], missing: list[str]) -> str:
    """Branches per file and in all, and where one was never taken."""
    rows = [*totals.items(), ("all", tuple(sum(c) for c in zip(*totals.values(), strict=True)))]
    lines = [f"{name:14} {a:5} of {b:5} branches  {a / b:6.1%}" for name, (a, b) in rows]
    return "\n".join([*lines, "not taken: " + ", ".join(missing)]) + "\n"
