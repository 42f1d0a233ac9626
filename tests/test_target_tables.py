"""Tables of docs/targets.md and real_time.md: instructions of a step, runs in single precision.

``pytest tests/test_target_tables.py -m slow`` measures and writes the pages.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from compilers import run
from machines import HERE, M4F, M7, Target, program_output
from signorini.models import bouncing_ball, box_in_space, hopper, slider_crank, slope

DOCS = Path(__file__).resolve().parent.parent / "docs"
TICKS = 25.6  # of the board's timer an instruction
CLOCKS = {"M7": 480, "M4F": 168}  # MHz of common parts

INSTRUCTIONS: tuple[tuple[str, Callable[[], sg.Model], int, float, int], ...] = (
    ("ball", bouncing_ball.model, 3, 1e-2, 110),
    ("slider-crank", slider_crank.model, 3, 1e-4, 200),
    ("slider-crank", slider_crank.model, 2, 1e-4, 200),
    ("box in space", box_in_space.model, 2, 2e-3, 250),
)
RUNS: tuple[tuple[str, Callable[[], sg.Model], int, float, float, dict[str, object]], ...] = (
    ("ball, case 1", bouncing_ball.model, 3, 1e-2, 3.0, {"v0": {"phi": 0.0}, "e_N": 0.5}),
    ("ball, case 2", bouncing_ball.model, 3, 1e-2, 2.0, {"v0": {"phi": 50.0}, "e_N": 0.0}),
    ("ball, case 3", bouncing_ball.model, 3, 1e-2, 2.0, {"v0": {"phi": 10.0}, "e_N": 0.0}),
    ("slope, case 1", slope.model, 3, 1e-2, 2.5, {}),
    ("slope, case 2", slope.model, 3, 1e-2, 2.5, {"q0": {"y": 1.5}}),
    ("slider-crank", slider_crank.model, 3, 1e-4, 0.1466, {}),
    ("slider-crank, s = 2", slider_crank.model, 2, 1e-4, 0.1466, {}),
    ("box in space", box_in_space.model, 2, 5e-3, 1.5, {}),
)


# Model, stages, step size, steps, of which a loop with a fixed worst case is made.
BOUNDED: tuple[tuple[str, Callable[[], sg.Model], int, float, int], ...] = (
    ("hopper", hopper.model, 2, 1e-3, 1500),
    ("slider-crank", slider_crank.model, 2, 1e-4, 600),
    ("box in space", box_in_space.model, 2, 2e-3, 400),
)
MOST = (4, 8, 16, 32, 200)  # iterations


def instructions(folder: Path, target: Target, case: tuple[float, int]) -> np.ndarray:
    """Instructions and iterations of every step on a board."""
    h, steps = case
    flags = ("-std=c99", "-O2", "-ffp-contract=off", f"-DH={h!r}", f"-DSTEPS={steps}", "-I.")
    sources = (str(HERE / "instructions.c"), "m.c", str(HERE / "startup.c"))
    run(*target.compile, *flags, "-o", "count", *sources, "-lm", cwd=folder)
    emulator = (*target.run[:-1], "-icount", "shift=10,sleep=off", target.run[-1])
    rows = np.array(program_output(*emulator, folder / "count"))
    return np.column_stack([rows[:, 0] / TICKS, rows[:, 1]])


def counted(folder: Path) -> list[str]:
    lines = [
        "| model | s | precision | core | instructions of a step: median | largest | "
        "of one iteration, largest | 200 iterations | clock for 1 kHz [MHz]: median | largest |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, make, stages, h, steps in INSTRUCTIONS:
        for precision in ("double", "float"):
            place = folder / f"{make.__module__}_{stages}_{precision}"
            sg.generate(make(), place, stages=stages, prefix="m", precision=precision)
            for target in (M7, M4F):
                data = instructions(place, target, (h, steps))
                n, iterations = data.T
                assert np.all(n > 100)
                rest = np.median(n[iterations == iterations.min()])
                busy = iterations > iterations.min()
                each = ((n[busy] - rest) / (iterations[busy] - iterations.min())).max()
                worst = rest + 200 * each
                fits = [
                    f"{x * 1e-3:.0f}{'' if x * 1e-3 < CLOCKS[target.name] else ' (no)'}"
                    for x in (np.median(n), n.max())
                ]
                lines.append(
                    f"| {name} | {stages} | {precision} | {target.name} | {np.median(n):,.0f} | "
                    f"{n.max():,.0f} | {each:,.0f} | {worst:,.0f} | {fits[0]} | {fits[1]} |"
                )
    return lines


def single(_: Path) -> list[str]:
    lines = [
        "| run | dt | steps | substeps | iterations: mean | largest | smallest gap [m] | "
        "largest difference to double [m, rad] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, make, stages, dt, t_end, about in RUNS:
        start = {k: v for k, v in about.items() if k in ("q0", "v0")}
        parameters = {k: v for k, v in about.items() if k not in start}
        double, real = (sg.build(make(), stages=stages, precision=p) for p in ("double", "float"))
        exact = double.simulate(t_end=t_end, dt=dt, parameters=parameters, **start)
        try:
            traj = real.simulate(t_end=t_end, dt=dt, parameters=parameters, **start)
            steps = f"{len(traj) - 1}"
        except sg.StepError as error:
            traj = error.trajectory
            steps = f"{len(traj) - 1} of {len(exact) - 1}, then {error.status}"
        k = len(traj)
        difference = np.abs(traj.q - exact.q[:k]).max()
        assert difference < 0.1
        lines.append(
            f"| {name} | {dt:g} | {steps} | {np.count_nonzero(traj.substeps)} | "
            f"{traj.iterations[1:].mean():.1f} | {traj.iterations.max()} | "
            f"{traj.smallest_gap[1:].min():.0e} | {difference:.0e} |"
        )
    return lines


def bounded(folder: Path) -> list[str]:
    """Steps of a fixed number of iterations: how many are solved, what the largest costs."""
    heads = " | ".join(f"{most}: not solved | largest step" for most in MOST)
    lines = [f"| model | s | steps | {heads} |", "|---|---|---|" + "---|---|" * len(MOST)]
    for name, make, stages, h, steps in BOUNDED:
        place = folder / f"worst_{make.__module__}"
        sg.generate(make(), place, stages=stages, prefix="m")
        cells = []
        for most in MOST:
            flags = ("-std=c99", "-O2", "-ffp-contract=off", "-I.")
            case = (f"-DH={h!r}", f"-DSTEPS={steps}", f"-DMOST={most}")
            sources = (str(HERE / "worst.c"), "m.c", str(HERE / "startup.c"))
            run(*M7.compile, *flags, *case, "-o", "count", *sources, "-lm", cwd=place)
            emulator = (*M7.run[:-1], "-icount", "shift=10,sleep=off", M7.run[-1])
            ticks, failed = np.array(program_output(*emulator, place / "count")).T
            assert len(ticks) == steps
            cells.append(f"{int(failed.sum())} | {ticks.max() / TICKS:,.0f}")
        lines.append(f"| {name} | {stages} | {steps:,} | {' | '.join(cells)} |")
    return lines


@pytest.mark.thorough
@pytest.mark.parametrize("dt", [5e-5, 1e-4, 2e-4])
@pytest.mark.parametrize("stages", [2, 3])
def test_single_precision_goes_to_the_end(stages: int, dt: float) -> None:
    """The slider-crank hits its walls 30 times and slides along them: all of it whole, in float."""
    make = slider_crank.model
    double, real = (sg.build(make(), stages=stages, precision=p) for p in ("double", "float"))
    exact = double.simulate(t_end=0.1466, dt=dt)
    traj = real.simulate(t_end=0.1466, dt=dt)
    assert len(traj) == len(exact)
    assert not np.any(traj.substeps)
    assert traj.smallest_gap[1:].min() > -1e-7
    assert np.abs(traj.q - exact.q).max() < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "title", "rows"),
    [
        ("targets", "instructions", counted),
        ("targets", "single", single),
        ("real_time", "worst case", bounded),
    ],
)
def test_tables(page: str, title: str, rows: Callable[[Path], list[str]], tmp_path: Path) -> None:
    M7.need()
    path = DOCS / f"{page}.md"
    text = path.read_text()
    begin, end = f"<!-- {title} -->", f"<!-- end of {title} -->"
    assert text.count(begin) == text.count(end) == 1
    head, _, rest = text.partition(begin)
    lines = rows(tmp_path)
    assert len(lines) > 3
    text = head + begin + "\n" + "\n".join(lines) + "\n" + end + rest.partition(end)[2]
    path.write_text(text)
