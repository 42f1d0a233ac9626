"""Compile a stepper with the timing program, run it, and sort its steps."""

import re
import subprocess
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from signorini.benchmarks.cases import Case
from signorini.runtime.compile import find_compiler
from signorini.runtime.errors import RunError
from signorini.runtime.stepper import load
from signorini.workflow import generate

HERE = Path(__file__).parent
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
NATIVE = ("-std=c99", "-O2", "-ffp-contract=off", "-march=native")
_AFTER = 20  # steps after an impact that are reported apart


@dataclass(frozen=True)
class Timing:
    """Times of one case in microseconds, over the steps of its run.

    Attributes
    ----------
    median, mean, p90, worst : float
        Of all steps; each step's time is the median of its repetitions.
    smooth, after : float
        Median of the steps that are not within 20 after an impact, and of those that are; NaN
        where there are none.
    event : float
        Median of the steps that are cut at an event; NaN where there are none.
    iterations : float
        Newton iterations a step, all problems.
    substeps : int
        Steps that were halved.
    evaluation : float
        One evaluation of all public model functions.
    flops, rate : float
        Operations of the generated code a step, from its own counts; operations a nanosecond.
    instructions : float or None
        Instructions a step, where they were counted.
    """

    case: str
    median: float
    mean: float
    p90: float
    worst: float
    smooth: float
    after: float
    event: float
    iterations: float
    substeps: int
    evaluation: float
    flops: float
    rate: float
    instructions: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


class Program:
    """The timing program of one case.

    Parameters
    ----------
    case : Case
    folder : Path
        Where to generate and compile.
    """

    def __init__(self, case: Case, folder: Path) -> None:
        self.case = case
        self.folder = generate(
            case.model(),
            folder / case.name,
            stages=case.stages,
            prefix="m",
            scheme=case.scheme,
            events=case.events,
            derivatives=bool(case.derivatives),
        )
        self.stepper = load(self.folder)
        manifest = self.stepper.manifest
        self.footprint = manifest["footprint"]
        (self.folder / "functions.h").write_text(_functions(manifest), encoding="utf-8")
        par = self.stepper.check_parameters(case.parameters)
        t, _, _ = self.stepper.initial_state(par)
        self.q, self.v = self.stepper.project(case.q, case.v, t, par)
        values = [
            t,
            *self.q.tolist(),
            *self.v.tolist(),
            *(par[p["name"]] for p in manifest["parameters"]),
        ]
        self.start = " ".join(repr(float(x)) for x in values) + "\n"

    def compile(self, repeats: int, flags: Sequence[str] = FLAGS) -> Path:
        """Compile with so many repetitions of every step."""
        n = self.stepper.sizes
        sizes = {
            "N_Q": n["n_q"], "N_U": n["n_u"], "N_N": n["n_N"],
            "FIRST_N": n["n_g"] + n["n_gamma"],
            "N_PAR": len(self.stepper.manifest["parameters"]),
            "STEPS": self.case.steps, "REPEATS": repeats, "H": repr(self.case.dt), "PRE": "m",
            "HEADER": '"m.h"', "LOCATED": int(self.case.events == "located"),
            "DERIVATIVES": ("", "forward", "adjoint").index(self.case.derivatives),
        }  # fmt: skip
        target = self.folder / "steps"
        command = [
            *(*find_compiler(), *flags, "-I."),
            *(f"-D{name}={value}" for name, value in sizes.items()),
            *("-o", str(target), str(HERE / "steps.c"), "m.c", "m_model.c", "-lm"),
        ]
        _run(command, self.folder)
        return target

    def time(self, repeats: int, flags: Sequence[str] = FLAGS) -> Timing:
        """Time every step `repeats` times."""
        text = _run([str(self.compile(repeats, flags))], self.folder, self.start)
        first, *rows = text.splitlines()
        evaluation = float(first.split()[1]) / 1e3
        data = np.array([[float(x) for x in row.split()] for row in rows])
        t, iterations = data[:, 0] / 1e3, data[:, 1]
        near = _near_impacts(data[:, 3].astype(int))
        cut = data[:, 4] > 0
        flops = self._flops(iterations)
        return Timing(
            case=self.case.name,
            median=float(np.median(t)),
            mean=float(t.mean()),
            p90=float(np.quantile(t, 0.9)),
            worst=float(t.max()),
            smooth=float(np.median(t[~near])) if (~near).any() else float("nan"),
            after=float(np.median(t[near])) if near.any() else float("nan"),
            event=float(np.median(t[cut])) if cut.any() else float("nan"),
            iterations=float(iterations.mean()),
            substeps=int(np.count_nonzero(data[:, 2])),
            evaluation=evaluation,
            flops=float(flops.mean()),
            rate=float(flops.sum() / (t.sum() * 1e3)),
        )

    def _flops(self, iterations: np.ndarray) -> np.ndarray:
        """Operations of the generated code in every step; both problems iterate alike."""
        f = self.footprint
        each = f["values"] + f["derivatives"] + 2 * f["products"]
        return f["start"] + f["values"] + iterations / 2 * each

    def instructions(self) -> float:
        """Instructions a step by valgrind, the same at every run of one binary.

        Raises
        ------
        RunError
            If valgrind is not there or fails.
        """
        binary, case = self.compile(1), self.case.derivatives
        out = self.folder / "callgrind.out"
        command = [
            *("valgrind", "--tool=callgrind", f"--toggle-collect=m_step{'_' * bool(case)}{case}"),
            *(f"--callgrind-out-file={out}", str(binary)),
        ]
        try:
            _run(command, self.folder, self.start)
        except FileNotFoundError:
            raise RunError("valgrind is not installed: apt-get install valgrind") from None
        total = re.search(r"^(?:totals|summary): (\d+)", out.read_text(), re.MULTILINE)
        if total is None:
            raise RunError(f"valgrind left no total in {out}")
        return int(total[1]) / self.case.steps


def peak(folder: Path) -> float:
    """Operations a nanosecond of a loop of fused multiply-adds, compiled for this machine."""
    command = [*find_compiler(), "-O2", "-march=native", "-o", "peak", str(HERE / "peak.c")]
    _run(command, folder)
    return float(_run(["./peak"], folder).split()[0])


def _near_impacts(pushed: np.ndarray) -> np.ndarray:
    """Steps in which a contact begins to push, and those within 20 after."""
    began = (pushed & ~np.concatenate([[0], pushed[:-1]])) != 0
    near = np.zeros(len(pushed), dtype=bool)
    for k in np.flatnonzero(began):
        near[k : k + 1 + _AFTER] = True
    return near


def _functions(manifest: dict[str, Any]) -> str:
    """C that evaluates every public model function once."""
    values = {"t": "0.1", "q": "q", "v": "v", "u": "u", "R": "R", "par": "par"}
    largest = max(int(np.prod(f["shape"])) for f in manifest["functions"].values())
    n = manifest["sizes"]
    calls = [
        f"    m_{name}({', '.join([*(values[a] for a in f['arguments']), 'out'])});\n"
        "    sink = out[0];\n"
        for name, f in manifest["functions"].items()
    ]
    return (
        "static void evaluate_all(const m_params *par, const m_real q[], const m_real v[]) {\n"
        f"    static const m_real u[{max(n['n_u'], 1)}] = {{0}}, R[{max(n['n_R'], 1)}] = {{0}};\n"
        f"    m_real out[{max(largest, 1)}];\n"
        "    (void)u; (void)R; (void)v; (void)q; (void)par;\n" + "".join(calls) + "}\n"
    )


def _run(command: Sequence[str], folder: Path, text: str = "") -> str:
    result = subprocess.run(
        list(command), cwd=folder, input=text, capture_output=True, text=True, check=False
    )
    if result.returncode != 0:
        raise RunError(f"{' '.join(command)} failed:\n{result.stderr.strip()[:2000]}")
    return result.stdout
