"""Stack and flash of a compiled stepper against what its folder states."""

import json
import re
from pathlib import Path

from compilers import run

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")


def depths(graph: Path) -> dict[str, int]:
    """Worst-case stack of every function from gcc's call graph; fails on recursion."""
    own: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for line in graph.read_text().splitlines():
        node = re.match(r'node: \{ title: "([^"]+)" label: "([^"]*)"', line)
        if node:
            size = re.search(r"(\d+) bytes \((\w+(?:,bounded)?)\)", node[2])
            own[node[1]] = int(size[1]) if size else 0
            assert size is None or size[2] != "dynamic", f"{node[1]}: stack not bounded"
        edge = re.match(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', line)
        if edge:
            calls.setdefault(edge[1], set()).add(edge[2])
    known: dict[str, int] = {}

    def depth(name: str, path: tuple[str, ...]) -> int:
        assert name not in path, f"recursion: {path}"
        if name not in known:
            below = [depth(other, (*path, name)) for other in calls.get(name, ())]
            known[name] = own.get(name, 0) + max(below, default=0)
        return known[name]

    return {name: depth(name, ()) for name in own}


def check_footprint(folder: Path, prefix: str, *cc: str) -> None:
    stated = json.loads((folder / "manifest.json").read_text())["footprint"]
    run(*cc, *FLAGS, "-fcallgraph-info=su", "-c", f"{prefix}.c", cwd=folder)
    stack = max(d for name, d in depths(folder / f"{prefix}.ci").items() if name.startswith(prefix))
    # figures far above the truth would be of no use either
    assert stated["stack"] / 3 <= stack <= stated["stack"]
    size = run(cc[0].replace("gcc", "size"), f"{prefix}.o", cwd=folder).splitlines()[1].split()
    assert int(size[0]) <= stated["flash"]
    assert size[2] == "0"
