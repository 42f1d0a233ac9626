"""Is everything there?"""

import json as jsonlib
import sys
from dataclasses import asdict

from rich.console import Console
from rich.table import Table
from rich.text import Text
from signorini.commands.base import Switch, app


@app.command
def doctor(*, json: Switch = False) -> None:
    """Say what this installation has and lacks: packages, compiler, cache, a stepper that runs.

    The exit status is 1 if something is missing that a first run needs.

    Parameters
    ----------
    json
        Print JSON instead of a table.
    """
    from signorini.doctor import examine

    findings = list(examine())
    if json:
        sys.stdout.write(jsonlib.dumps([asdict(f) for f in findings], indent=1) + "\n")
    else:
        table = Table(box=None, padding=(0, 1, 0, 0), show_header=False)
        for f in findings:
            mark, colour = {True: ("ok", "green"), False: ("fails", "red"), None: ("", "")}[f.ok]
            table.add_row(Text(mark, style=colour), Text(f.name), Text(f.text))
        Console().print(table)
    if any(f.ok is False for f in findings):
        sys.exit(1)
