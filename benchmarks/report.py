"""The table of `signorini bench`: ours, with goals; peers beside it; cost at equal error."""

import importlib
import json
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from signorini.benchmarks.cases import CASES, Case
from signorini.benchmarks.measure import FLAGS, NATIVE, Program, Timing, peak
from signorini.benchmarks.scenes import BALL, Run
from signorini.runtime.compile import describe_machine
from signorini.runtime.errors import RunError

PEERS = ("mujoco", "exudyn", "drake")
STORED = Path(__file__).with_name("instructions.json")
_DTS = (5e-2, 2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4)
_FLIGHT = 3.0  # evaluations of all model functions that a step of free flight may cost
_ADVICE = "install them with: pip install 'signorini[peers]'"


@dataclass
class Results:
    """Everything that was measured.

    Attributes
    ----------
    machine : dict
        Processor, system, compiler, flags, date, peak.
    timings, native : list of Timing
        At -O2, and with -march=native, too.
    runs : list of Run
        Scenes that peers run, ours first.
    errors : dict from name to list of (dt, error, cost)
        Cost of a simulated second against the error of the slipping ball.
    """

    machine: dict[str, Any]
    timings: list[Timing] = field(default_factory=list)
    native: list[Timing] = field(default_factory=list)
    runs: list[Run] = field(default_factory=list)
    errors: dict[str, list[tuple[float, float, float]]] = field(default_factory=dict)

    def to_json(self) -> str:
        """All figures."""
        return json.dumps(asdict(self), indent=1)


def select(names: Sequence[str]) -> list[Case]:
    """Cases by name, all if none is named; `RunError` for an unknown one."""
    known = {c.name: c for c in CASES}
    for name in names:
        if name not in known:
            raise RunError(f"there is no case '{name}'; there are: {', '.join(known)}")
    return [known[name] for name in names] or list(CASES)


def measure(
    cases: Sequence[Case],
    repeats: int,
    native: bool,
    counts: bool,
    peers: bool,
    progress: Callable[[str], None],
) -> Results:
    """Time the cases; with `peers` also the other engines and the cost at equal error.

    Raises
    ------
    RunError
        If a program that is needed is not there.
    """
    others = [_peer(name) for name in PEERS] if peers else []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        results = Results(_machine(folder))
        for case in cases:
            progress(case.name)
            program = Program(case, folder)
            timing = program.time(repeats)
            if counts:
                timing = replace(timing, instructions=program.instructions())
            results.timings.append(timing)
            if native:
                results.native.append(program.time(repeats, NATIVE))
            if peers:
                results.runs += _own(program, timing)
        for peer in others:
            progress(f"{peer.__name__.rpartition('_')[2]} {peer.VERSION}")
            results.machine[peer.__name__.rpartition("_")[2]] = peer.VERSION
            results.runs += peer.runs()
        if peers:
            progress("cost at equal error")
            results.errors = dict(_errors(folder, others))
    return results


def _peer(name: str) -> Any:
    try:
        return importlib.import_module(f"signorini.benchmarks.peer_{name}")
    except ImportError as error:
        raise RunError(f"{name} is not there ({error}); {_ADVICE}") from None


def _machine(folder: Path) -> dict[str, Any]:
    return {
        **describe_machine(),
        "flags": " ".join(FLAGS),
        "date": date.today().isoformat(),
        "peak": peak(folder),
    }


# --- ours beside the peers ------------------------------------------------------------------------


def _own(program: Program, timing: Timing) -> Iterator[Run]:
    case, engine = program.case, "signorini"
    par = case.parameters
    traj = program.stepper.simulate(
        q0=program.q, v0=program.v, dt=case.dt, t_end=case.steps * case.dt, parameters=par
    )
    settings = f"s = {case.stages}, defaults"
    if case.name == "ball_bounces":
        yield Run.of_bouncing(engine, settings, timing.mean, traj["y"][1:])
    elif case.name == "ball_slips":
        yield Run.of_slipping(engine, settings, timing.mean, traj.q[1:, :2])
    elif case.name == "slider_crank":
        angles = np.stack([traj[f"phi_{k}"][1:] for k in (1, 2, 3)], axis=1)
        yield Run.of_crank(engine, settings, timing.mean, angles)
    elif case.name in ("box_tumbles", "box_rests"):
        yield Run.of_box(engine, case.name, settings, timing.mean, traj.q[1:])


def _errors(
    folder: Path, peers: Sequence[Any]
) -> Iterator[tuple[str, list[tuple[float, float, float]]]]:
    """Slipping ball: error of x(1.1) and microseconds a simulated second, for several dt."""
    slips = next(c for c in CASES if c.name == "ball_slips")
    for scheme, events, stages in (
        *(("lobatto", "captured", s) for s in (2, 3)),
        *(("lobatto", "located", s) for s in (2, 3)),
        ("moreau", "captured", 2),
    ):
        rows = []
        name = f"slip_{scheme}_{events}_{stages}"
        for dt in _DTS:
            case = replace(
                slips, name=name, stages=stages, dt=dt, steps=round(1.1 / dt), scheme=scheme,
                events=events,
            )  # fmt: skip
            program = Program(case, folder)
            traj = program.stepper.simulate(
                q0=program.q, v0=program.v, dt=dt, t_end=1.1, parameters=case.parameters,
                events=events,
            )  # fmt: skip
            error = abs(float(np.interp(1.1, traj.t, traj["x"])) - BALL.exact_x)
            rows.append((dt, error, program.time(11).mean / dt))
        yield "signorini, " + (scheme if scheme == "moreau" else f"{events}, s = {stages}"), rows
    for peer in peers:
        name = peer.__name__.rpartition("_")[2]
        yield name, [(dt, *peer.slip(dt)) for dt in _DTS]


# --- text -----------------------------------------------------------------------------------------


def ours(results: Results) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table of our steps."""
    by_name = {c.name: c for c in CASES}
    native = {t.case: t for t in results.native}
    stored = json.loads(STORED.read_text())["cases"] if STORED.is_file() else {}
    head = ["case", "us", "goal", "smooth", "after", "event", "90 %", "max", "it.", "eval."]
    head += ["flops", "peak"]
    head += ["native"] if native else []
    counted = any(t.instructions for t in results.timings)
    head += ["instr.", "change"] if counted else []
    rows = []
    for t in results.timings:
        case = by_name[t.case]
        ratio = t.median / (case.stages * t.evaluation)
        row = [t.case, f"{t.median:.3f}", _goal(case, t, ratio), _us(t.smooth), _us(t.after)]
        row.append(_us(t.event))
        row += [f"{t.p90:.2f}", f"{t.worst:.1f}", f"{t.iterations:.1f}", f"{ratio:.1f}"]
        row += [f"{t.flops:.0f}", f"{100 * t.rate / results.machine['peak']:.1f}%"]
        if native:
            row.append(f"{native[t.case].median:.3f}")
        if counted:
            n, before = t.instructions or 0.0, stored.get(t.case)
            row += [f"{n:.0f}", f"{n / before - 1:+.1%}" if before else ""]
        rows.append(row)
    return head, rows


def _us(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2f}"


def _goal(case: Case, t: Timing, ratio: float) -> str:
    if case.flies:
        return _verdict(ratio, _FLIGHT, " ev.")
    return "" if case.goal is None else _verdict(t.median, case.goal, "")


def _verdict(value: float, goal: float, unit: str) -> str:
    over = value / goal - 1
    return f"{goal:g}{unit} " + ("met" if over < 0 else f"+{over:.0%}")


def derivatives(results: Results) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table of steps with derivatives: what they cost more, in steps."""
    medians = {t.case: t.median for t in results.timings}
    found: dict[str, list[str]] = {}
    for case in CASES:
        step = medians.get(f"{case.name.removesuffix(f'_{case.derivatives}')}_located")
        if case.derivatives and step and case.name in medians:
            name = case.name.removesuffix(f"_{case.derivatives}")
            row = found.setdefault(name, [name, f"{step:.2f}", "", "", "", ""])
            at = 2 if case.derivatives == "forward" else 4
            row[at : at + 2] = [
                f"{medians[case.name]:.2f}", f"{medians[case.name] / step - 1:.1f}"
            ]  # fmt: skip
    head = ["case", "step", "forward", "more, in steps", "adjoint", "more, in steps"]
    return head, list(found.values())


def others(results: Results) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table of all engines."""
    head = ["scene", "engine", "settings", "us a step", "penetration [mm]", ""]
    ordered = sorted(results.runs, key=lambda r: r.scene)
    return head, [
        [r.scene, r.engine, r.settings, f"{r.time:.2f}", f"{1e3 * r.depth:.2g}", r.note]
        for r in ordered
    ]


NOTES = (
    "Times in microseconds of one core; each step's time is the median of its repetitions, the "
    "columns are over the steps of the run. us: median; goal: what it is to be below; smooth, "
    "after: median of the steps that are not, or are, within 20 after a contact began to push; "
    "event: median of the steps that are cut at an event; it.: Newton iterations, both problems; "
    "eval.: median over one evaluation of all public model "
    "functions at the stages; flops: operations of the generated code a step, without the "
    "runtime's; peak: their rate over that of a loop of fused multiply-adds; native: median with "
    "-march=native; instr.: instructions a step by valgrind, change against the stored count."
)


def markdown(results: Results) -> str:
    """The page."""
    m = results.machine
    lines = [
        "# Time of a step",
        "",
        "`signorini bench` writes this page: with `--native --counts --peers` for other engines "
        "and what depends on the machine, with `--cases` for some steps alone.",
        "",
        f"{m['processor']}; {m['system']}; {m['compiler']}; `{m['flags']}`; {m['date']}. "
        f"Peak of one core, measured: {m['peak']:.0f} operations a nanosecond.",
        "",
        *_table(*ours(results)),
        "",
        NOTES,
        "",
    ]
    head, rows = derivatives(results)
    if rows:
        lines += [
            "## Derivatives",
            "",
            "Median time of a located step in microseconds: plain, with its derivatives along all "
            "q and v, and with a gradient carried back to q, v, the parameters, t and h.",
            "",
            *_table(head, rows),
            "",
        ]
    if results.runs:
        versions = ", ".join(f"{name} {m[name]}" for name in PEERS if name in m)
        lines += [
            "## Beside other engines",
            "",
            f"{versions}; same masses, step sizes and starts, from Python, CPU time. They solve "
            "another problem: contacts are compliant, so bodies enter each other, and the settings "
            "of contact decide how far and what a bounce returns; all settings tried are shown. "
            "Ours is the mean time a step. The ball may bounce to 0.25 of its height and the "
            "slipping ball's end is known; codes that resolve the slider-crank end near "
            "phi_1 = 13.43.",
            "",
            *_table(*others(results)),
            "",
            "The slipping ball is exact to round-off where steps are cut at its impact and at the "
            "end of its slip: its motion between them is quadratic.",
            "",
            "![cost against error of the slipping ball](cost.png)",
            "",
        ]
    return "\n".join(lines)


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    return [
        "| " + " | ".join(head) + " |",
        "|" + "---|" * len(head),
        *("| " + " | ".join(row) + " |" for row in rows),
    ]


def picture(results: Results, path: Path) -> None:
    """Cost of a simulated second against the error, one curve for each engine."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for name, rows in results.errors.items():
        _, error, cost = np.array(rows).T
        style = "o-" if name.startswith("signorini") else "s--"
        axes.loglog(error, cost, style, label=name, markersize=4)
    axes.set_xlabel("error of x(1.1) of the slipping ball [m]")
    axes.set_ylabel("CPU time of a simulated second [us]")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(loc="upper left", ncols=2, fontsize=8)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def store_counts(results: Results) -> None:
    """Keep the instruction counts as those that later runs are compared with."""
    cases = {t.case: t.instructions for t in results.timings if t.instructions}
    text = json.dumps({"compiler": results.machine["compiler"], "cases": cases}, indent=1)
    STORED.write_text(text + "\n", encoding="utf-8")
