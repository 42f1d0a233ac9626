"""How generation, C size, compilation and steps grow with bodies and contacts."""

import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from math import cos, pi, sin
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import signorini as sg
from signorini.bodies import Planar, Spatial, inertia
from signorini.codegen.c.build import emit_spec
from signorini.codegen.c.emit import render, write
from signorini.codegen.frontend.validate import freeze


def chain(links: int, redundant: bool) -> sg.Model:
    """Hanging rods in absolute angles, or with x, y, phi each and hinges; the tip at a wall."""
    m = sg.Model("chain", symbols="casadi")
    length, mass = 0.2, 0.1
    world = Planar(m, gravity=(0, -9.81))
    hinge = world.ground.point()
    start: dict[str, float] = {}
    lean = 0.3
    for k in range(links):
        if redundant:
            rod = world.body(f"b{k}", mass, inertia.rod(mass, length))
            world.revolute(f"hinge{k}", rod.point(0, length / 2), hinge)
            start |= {
                f"b{k}_x": (k + 0.5) * length * sin(lean),
                f"b{k}_y": -(k + 0.5) * length * cos(lean),
                f"b{k}_phi": lean,
            }
        else:
            (angle,) = m.coordinates(f"phi{k}")
            at = hinge.position
            s, c = world.algebra.sin(angle), world.algebra.cos(angle)
            rod = world.frame(f"b{k}", angle, (at[0] + length / 2 * s, at[1] - length / 2 * c))
            world.body(f"b{k}", mass, inertia.rod(mass, length), frame=rod)
            start[f"phi{k}"] = lean
        hinge = rod.point(0, -length / 2)
    wall = world.plane(world.ground.point(-0.1, 0), (1, 0))
    world.contact("tip", hinge, wall, mu=0.2, e_N=0.5)
    m.initial_state(q=start)
    return m


def boxes(count: int) -> sg.Model:
    """Planar boxes side by side, four corners each, dropped at different angles."""
    m = sg.Model("boxes", symbols="casadi")
    world = Planar(m, gravity=(0, -9.81))
    start: dict[str, float] = {}
    for k in range(count):
        box = world.body(f"b{k}", 1.0, inertia.rectangle(1.0, 0.4, 0.2))
        for j, (x, y) in enumerate(((-0.2, -0.1), (0.2, -0.1), (0.2, 0.1), (-0.2, 0.1))):
            world.contact(f"c{k}_{j}", box.point(x, y), world.plane(), mu=0.3, e_N=0.2)
        start |= {f"b{k}_x": float(k), f"b{k}_y": 0.4, f"b{k}_phi": 0.4 * pi * k / count}
    m.initial_state(q=start)
    return m


def boxes_in_space(count: int) -> sg.Model:
    """Boxes in space side by side above a floor, eight corners each."""
    m = sg.Model("boxes_in_space", symbols="casadi")
    world = Spatial(m, gravity=(0, 0, -9.81))
    floor = world.plane()
    start: dict[str, float] = {}
    for k in range(count):
        box = world.body(f"b{k}", 1.0, inertia.cuboid(1.0, 0.4, 0.3, 0.2))
        for j in range(8):
            x, y, z = (((j >> i & 1) - 0.5) * size for i, size in enumerate((0.4, 0.3, 0.2)))
            world.contact(f"c{k}_{j}", box.point(x, y, z), floor, mu=0.3, e_N=0.2)
        start |= {f"b{k}_x": float(k), f"b{k}_z": 0.4}
    world.initial_state(q=start)
    return m


FAMILIES: dict[str, tuple[Callable[[int], sg.Model], Sequence[int]]] = {
    "chain, minimal": (lambda n: chain(n, redundant=False), (2, 4, 8, 16, 24)),
    "chain, redundant": (lambda n: chain(n, redundant=True), (2, 4, 8, 16, 32)),
    "boxes": (boxes, (1, 2, 4, 8, 16)),
    "boxes in space": (boxes_in_space, (1, 2, 4, 8, 16)),
}
MEASURED = ("derive_s", "emit_s", "c_kB", "compile_s", "step_us")


@dataclass(frozen=True)
class Size:
    """One model of a family, measured."""

    family: str
    count: int
    n_q: int
    contacts: int
    derive_s: float
    emit_s: float
    c_kB: float
    compile_s: float
    step_us: float


def measure(family: str, count: int, stages: int = 3) -> Size:
    """Generate, compile and step one model; the compiler's cache is left out."""
    make, _ = FAMILIES[family]
    with tempfile.TemporaryDirectory() as folder:
        before = os.environ.get("SIGNORINI_CACHE")
        os.environ["SIGNORINI_CACHE"] = folder
        try:
            times = [time.perf_counter()]
            spec = emit_spec(freeze(make(count)), stages=stages)
            times.append(time.perf_counter())
            generated = write(render(spec), Path(folder) / "c")
            times.append(time.perf_counter())
            stepper = sg.load(generated)
            times.append(time.perf_counter())
            derive_s, emit_s, compile_s = np.diff(times).tolist()
        finally:
            if before is None:
                del os.environ["SIGNORINI_CACHE"]
            else:
                os.environ["SIGNORINI_CACHE"] = before
        c_kB = sum(p.stat().st_size for p in generated.glob("*.c") if p.name != "example.c") / 1e3
        runs = [stepper.simulate(t_end=0.2, dt=2e-3).seconds / 100 * 1e6 for _ in range(3)]
    manifest = stepper.manifest
    return Size(
        family,
        count,
        len(manifest["coordinates"]),
        len(manifest["contacts"]),
        derive_s,
        emit_s,
        c_kB,
        compile_s,
        median(runs),
    )


def study(largest: int | None = None) -> Iterator[Size]:
    """Measure every family up to the largest count."""
    for family, (_, counts) in FAMILIES.items():
        for count in counts:
            if largest is None or count <= largest:
                yield measure(family, count)


def exponents(sizes: Sequence[Size]) -> dict[str, dict[str, float]]:
    """Slopes of the logarithms over the larger half of the counts."""
    found: dict[str, dict[str, float]] = {}
    for family in FAMILIES:
        rows = [s for s in sizes if s.family == family][-3:]
        if len(rows) >= 2:
            x = np.log([s.count for s in rows])
            found[family] = {
                name: float(np.polyfit(x, np.log([getattr(s, name) for s in rows]), 1)[0])
                for name in MEASURED
            }
    return found


def markdown(sizes: Sequence[Size]) -> str:
    """The table with exponents below each family."""
    lines = [
        "| model | count | coordinates | contacts | derive [s] | emit [s] | C [kB] | compile [s] "
        "| step [µs] |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    slopes = exponents(sizes)
    for family in FAMILIES:
        for s in sizes:
            if s.family == family:
                lines.append(
                    f"| {family} | {s.count} | {s.n_q} | {s.contacts} | {s.derive_s:.2f} "
                    f"| {s.emit_s:.2f} | {s.c_kB:.0f} | {s.compile_s:.2f} | {s.step_us:.3g} |"
                )
        if family in slopes:
            e = slopes[family]
            lines.append(
                f"| {family} | **exponent** | | | {e['derive_s']:.1f} | {e['emit_s']:.1f} "
                f"| {e['c_kB']:.1f} | {e['compile_s']:.1f} | {e['step_us']:.1f} |"
            )
    return "\n".join(lines) + "\n"


def plot(sizes: Sequence[Size], path: Path) -> None:
    """Log-log curves of the measured quantities."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    labels = ("derive [s]", "emit [s]", "C [kB]", "compile [s]", "time per step [µs]")
    fig, axes = plt.subplots(1, 5, figsize=(17, 3.6), layout="constrained")
    for axis, name, label in zip(axes, MEASURED, labels, strict=True):
        for family in FAMILIES:
            rows = [s for s in sizes if s.family == family]
            axis.loglog([s.count for s in rows], [getattr(s, name) for s in rows], "o-", ms=4,
                        label=family)  # fmt: skip
        axis.set_xlabel("links or boxes")
        axis.set_ylabel(label)
        axis.grid(alpha=0.25, which="both")
    axes[0].legend(fontsize=8)
    fig.savefig(path, dpi=120)
    plt.close(fig)


def save(sizes: Sequence[Size], folder: Path) -> None:
    """Write growth.json, growth.md and growth.png."""
    folder.mkdir(parents=True, exist_ok=True)
    data: dict[str, Any] = {"sizes": [asdict(s) for s in sizes], "exponents": exponents(sizes)}
    (folder / "growth.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    title = (
        "# How cost grows with bodies\n\n`signorini growth --out docs/growth` measured this.\n\n"
    )
    (folder / "growth.md").write_text(title + markdown(sizes), encoding="utf-8")
    plot(sizes, folder / "growth.png")
