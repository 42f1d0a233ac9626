"""How generation, C size, compilation and steps grow with bodies and contacts."""

import ctypes
import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from math import cos, nan, pi, sin
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import signorini as sg
from signorini.bodies import Planar, Round, Spatial, inertia
from signorini.codegen.c.build import emit_spec
from signorini.codegen.c.emit import render, write
from signorini.codegen.frontend.validate import freeze
from signorini.models import block_stack


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


def boxes_in_space(count: int, mixed: bool = False) -> sg.Model:
    """Boxes in space side by side above a floor, eight corners each; `mixed`: of other sizes."""
    m = sg.Model("boxes_in_space", symbols="casadi")
    world = Spatial(m, gravity=(0, 0, -9.81))
    floor = world.plane()
    start: dict[str, float] = {}
    for k in range(count):
        sizes = [size * (1 + 0.05 * k * mixed) for size in (0.4, 0.3, 0.2)]
        mass = 1.0 + 0.3 * k * mixed
        box = world.body(f"b{k}", mass, inertia.cuboid(mass, *sizes))
        for j in range(8):
            x, y, z = (((j >> i & 1) - 0.5) * size for i, size in enumerate(sizes))
            world.contact(f"c{k}_{j}", box.point(x, y, z), floor, mu=0.3, e_N=0.2)
        start |= {f"b{k}_x": float(k), f"b{k}_z": 0.4}
    world.initial_state(q=start)
    return m


def discs(count: int) -> sg.Model:
    """Discs that fall into a container, contacts between all of them."""
    m = sg.Model("discs", symbols="casadi")
    world = Planar(m, gravity=(0, -9.81))
    columns = max(3, round(count**0.5))
    right = world.plane(world.ground.point(1.0 + 0.24 * columns, 0), (-1, 0))
    left = world.plane(world.ground.point(1.0, 0), (1, 0))
    start: dict[str, float] = {}
    round_ones: list[Round] = []
    for k in range(count):
        disc = world.body(f"d{k}", 1.0, inertia.disc(1.0, 0.1))
        round_ones.append(Round(disc.point(), 0.1))
        for name, wall in (("floor", world.plane()), ("left", left), ("right", right)):
            world.contact(f"{name}{k}", round_ones[k], wall, mu=0.3, e_N=0.2)
        for j in range(k):
            world.contact(f"c{j}_{k}", round_ones[j], round_ones[k], mu=0.3, e_N=0.2)
        shift = 0.02 * (k * 7 % 5) / 5
        start |= {f"d{k}_x": 1.11 + 0.23 * (k % columns) + shift}
        start |= {f"d{k}_y": 0.15 + 0.25 * (k // columns)}
    m.initial_state(q=start)
    return m


def balls(count: int) -> sg.Model:
    """Balls in space that fall into a bowl, contacts between all of them."""
    m = sg.Model("balls", symbols="casadi")
    world = Spatial(m, gravity=(0, 0, -9.81))
    bowl = world.graph(lambda x, y: 0.4 * (x**2 + y**2))
    start: dict[str, float] = {}
    round_ones: list[Round] = []
    for k in range(count):
        ball = world.body(f"b{k}", 1.0, inertia.ball(1.0, 0.1))
        round_ones.append(Round(ball.point(), 0.1))
        world.contact(f"bowl{k}", ball.point(), bowl, mu=0.3, e_N=0.3)
        for j in range(k):
            world.contact(f"c{j}_{k}", round_ones[j], round_ones[k], mu=0.3, e_N=0.3)
        start |= {f"b{k}_x": 0.4 * cos(2.0 * k), f"b{k}_y": 0.4 * sin(2.0 * k)}
        start |= {f"b{k}_z": 0.3 + 0.12 * k}
    world.initial_state(q=start)
    return m


FAMILIES: dict[str, tuple[Callable[[int], sg.Model], Sequence[int]]] = {
    "chain, minimal": (lambda n: chain(n, redundant=False), (2, 4, 8, 16, 24)),
    "chain, redundant": (lambda n: chain(n, redundant=True), (2, 4, 8, 16, 32)),
    "boxes": (boxes, (1, 2, 4, 8, 16)),
    "boxes in space": (boxes_in_space, (1, 2, 4, 8, 16, 32)),
    "mixed boxes in space": (lambda n: boxes_in_space(n, mixed=True), (1, 2, 4, 8, 16)),
    "stack": (block_stack.model, (4, 8, 16)),
    "discs, all pairs": (discs, (5, 10, 20, 40, 80)),
    "balls in a bowl": (balls, (4, 8, 16)),
}
MEASURED = ("derive_s", "emit_s", "c_kB", "compile_s", "step_us", "work_kB")
STEPS, DT = 250, 2e-3


@dataclass(frozen=True)
class Size:
    """One model of a family, measured; `peer_us` and `peer_gap` of the same scene in MuJoCo.

    `unsolved` is the first step that no solution was found for, of a model that has no `step_us`.
    """

    family: str
    count: int
    n_q: int
    contacts: int
    derive_s: float
    emit_s: float
    c_kB: float
    compile_s: float
    step_us: float | None
    work_kB: float
    gap: float | None
    peer_us: float | None = None
    peer_gap: float | None = None
    unsolved: int | None = None


def time_of_step(stepper: sg.Stepper, steps: int = STEPS, dt: float = DT) -> float:
    """Mean time of a step [µs] from the start on, without what a run costs whatever its length."""
    seconds = [
        median(stepper.simulate(t_end=n * dt, dt=dt).seconds for _ in range(5)) for n in (1, steps)
    ]
    return (seconds[1] - seconds[0]) / (steps - 1) * 1e6


def _of_peer(family: str, count: int) -> tuple[float, float] | tuple[None, None]:
    """Mean time of a step [µs] and deepest penetration [m] in MuJoCo, where it is installed."""
    try:
        from signorini.benchmarks import many_mujoco
    except ImportError:
        return None, None
    return many_mujoco.measure(family, count, STEPS, DT) or (None, None)


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
        step_us = gap = unsolved = None
        try:
            step_us = time_of_step(stepper)
            gaps = stepper.simulate(t_end=STEPS * DT, dt=DT).smallest_gap
            gap = min(0.0, float(gaps.min()))
        except sg.StepError as error:
            unsolved = len(error.trajectory.t)
    manifest = stepper.manifest
    peer_us, peer_gap = _of_peer(family, count)
    return Size(
        family,
        count,
        len(manifest["coordinates"]),
        len(manifest["contacts"]),
        derive_s,
        emit_s,
        c_kB,
        compile_s,
        step_us,
        ctypes.sizeof(stepper.library.structs["work"]) / 1e3,
        gap,
        peer_us,
        peer_gap,
        unsolved,
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
        rows = [s for s in sizes if s.family == family and s.unsolved is None][-3:]
        if len(rows) >= 2:
            x = np.log([s.count for s in rows])
            names = [*MEASURED] + ["peer_us"] * all(s.peer_us is not None for s in rows)
            found[family] = {
                name: float(np.polyfit(x, np.log([getattr(s, name) for s in rows]), 1)[0])
                for name in names
            }
    return found


def markdown(sizes: Sequence[Size]) -> str:
    """The table with exponents below each family."""
    lines = [
        "| model | count | coordinates | contacts | derive [s] | emit [s] | C [kB] | compile [s] "
        "| step [µs] | scratch [kB] | deepest gap [m] | MuJoCo: step [µs] | deepest gap [m] |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    slopes = exponents(sizes)
    for family in FAMILIES:
        for s in sizes:
            if s.family == family:
                lines.append(
                    f"| {family} | {s.count} | {s.n_q} | {s.contacts} | {s.derive_s:.2f} "
                    f"| {s.emit_s:.2f} | {s.c_kB:.0f} | {s.compile_s:.2f} | "
                    + (
                        f"{s.step_us:.3g} | {s.work_kB:.0f} | {s.gap:.0e} "
                        if s.step_us is not None and s.gap is not None
                        else f"step {s.unsolved} unsolved | {s.work_kB:.0f} | "
                    )
                    + ("| | |" if s.peer_us is None else f"| {s.peer_us:.3g} | {s.peer_gap:.0e} |")
                )
        if family in slopes:
            e = slopes[family]
            lines.append(
                f"| {family} | **exponent** | | | {e['derive_s']:.1f} | {e['emit_s']:.1f} "
                f"| {e['c_kB']:.1f} | {e['compile_s']:.1f} | {e['step_us']:.1f} "
                f"| {e['work_kB']:.1f} | | {e.get('peer_us', nan):.1f} | |".replace("nan", "")
            )
    return "\n".join(lines) + "\n"


def plot(sizes: Sequence[Size], path: Path) -> None:
    """Log-log curves of the measured quantities."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    labels = (
        *("derive [s]", "emit [s]", "C [kB]", "compile [s]", "time per step [µs]"),
        "scratch [kB]",
    )
    fig, axes = plt.subplots(2, 3, figsize=(11, 7), layout="constrained")
    axes = axes.ravel()
    for axis, name, label in zip(axes, MEASURED, labels, strict=True):
        for family in FAMILIES:
            rows = [s for s in sizes if s.family == family and s.unsolved is None]
            axis.loglog([s.count for s in rows], [getattr(s, name) for s in rows], "o-", ms=4,
                        label=family)  # fmt: skip
        axis.set_xlabel("bodies")
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
        "# How cost grows with bodies\n\n`signorini growth --out docs/growth` measured this: the "
        f"first {STEPS} steps of {DT} s, mean over the run, s = 3; MuJoCo with Euler's method, "
        "elliptic cones and the hardest contacts that it accepts.\n\n"
    )
    (folder / "growth.md").write_text(title + markdown(sizes), encoding="utf-8")
    plot(sizes, folder / "growth.png")
