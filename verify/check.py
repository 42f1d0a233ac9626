"""Generated against numeric: one report for one model."""

import json
import os
import shutil
import subprocess
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
from rich.console import Console
from rich.table import Table
from signorini.codegen.cfunction import equation_of
from signorini.codegen.model import Model
from signorini.runtime.compile import find_compiler
from signorini.runtime.errors import StepError
from signorini.runtime.stepper import Stepper
from signorini.verify.draw import Drawer, State, seen, wanted
from signorini.verify.expressions import DIGITS, Expressions
from signorini.verify.functions import reference_values
from signorini.verify.reference import Reference, Step

_FUNCTION_STATES = 4
_JACOBIAN_STATES = 2
_MAX_DRAWS = 3000
_PER_KIND = 2  # verified steps for each kind of motion of each contact
_RANDOM_STEPS = 10
_TIE = 1e-9  # guards closer to zero than this are left to neither implementation
_SOLVED_AGAIN = 3
_APART = 1e-4  # end velocities further apart than this belong to different solutions
_TRAJECTORY = 30


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
    notes : list of str
        What was noticed besides.
    """

    model: str
    items: list[Item] = field(default_factory=list)
    counts: dict[str, dict[str, int]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @property
    def unseen(self) -> list[str]:
        """Kinds of motion that no verified step showed."""
        return [
            f"{contact}: {kind}"
            for contact, kinds in self.counts.items()
            for kind, count in kinds.items()
            if count == 0
        ]

    @property
    def passed(self) -> bool:
        """Whether every comparison holds and every kind of motion was seen."""
        return bool(self.items) and all(i.passed for i in self.items) and not self.unseen

    def __bool__(self) -> bool:
        return self.passed

    def to_dict(self) -> dict[str, Any]:
        """The report as plain data."""
        return {
            "model": self.model,
            "passed": self.passed,
            "items": [vars(i) | {"passed": i.passed} for i in self.items],
            "counts": self.counts,
            "unseen": self.unseen,
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
            failures=str(len(failed) + len(self.unseen)),
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
                if not count:
                    ET.SubElement(case, "failure", message="never seen in a verified step")
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
                    f"{kind} {count}" if count else f"[bold red]{kind} 0[/]"
                    for kind, count in kinds.items()
                )
                table.add_row(contact, text)
            console.print(table)
        for note in self.notes:
            console.print(f"note: {note}", markup=False)
        console.print("[green]passed" if self.passed else "[bold red]FAILED")


class Checker:
    """Collects the comparisons of one model.

    Parameters
    ----------
    model : Model
        The model as the user wrote it.
    build : callable (model, stages) -> Stepper
        Makes the stepper under test.
    seed : int
        Seed of all random states.
    progress : callable (text), optional
        Told what is being compared.
    """

    def __init__(
        self,
        model: Model,
        build: Callable[[Model, int], Stepper],
        seed: int = 0,
        progress: Callable[[str], None] | None = None,
    ) -> None:
        self.model = model
        self.build = build
        self.seed = seed
        self.tell = progress or (lambda text: None)
        self.report = Report(model.name)

    def run(self, stages: Sequence[int], sanitize: bool = False) -> Report:
        """Compare everything for the given numbers of stages."""
        first = self.build(self.model, stages[0])
        self.tell("model functions")
        self.functions(first)
        for s in stages:
            stepper = self.build(self.model, s)
            self.tell(f"Jacobians, s = {s}")
            self.jacobians(stepper)
            self.tell(f"steps, s = {s}")
            self.steps(stepper)
            self.tell(f"trajectory, s = {s}")
            self.trajectory(stepper)
            if sanitize:
                self.tell(f"sanitizers, s = {s}")
                self.sanitizers(stepper)
        return self.report

    def _add(self, name: str, equation: str, errors: list[float], tolerance: float) -> None:
        worst = float(np.max(errors)) if errors else 0.0
        # max() of a list with NaN is no number to trust.
        if errors and not np.all(np.isfinite(errors)):
            worst = float("inf")
        self.report.items.append(Item(name, equation, worst, tolerance, len(errors)))

    # --- functions -------------------------------------------------------------------------------

    def functions(self, stepper: Stepper) -> None:
        """Every emitted function and derivative at random states."""
        e = Expressions(self.model, high=True)
        rng = np.random.default_rng(self.seed)
        errors: dict[str, list[float]] = {name: [] for name in stepper.functions}
        for _ in range(_FUNCTION_STATES):
            t, q, v, u, R, parameters = self._any_state(stepper, rng)
            expected = reference_values(e, t, q, v, u, R, list(parameters.values()))
            for name in stepper.functions:
                value = stepper.evaluate(name, t, q, v, u, parameters, R)
                other = expected[name].reshape(np.shape(value))
                scale = max(1.0, float(np.max(np.abs(other), initial=0)))
                errors[name].append(float(np.max(np.abs(value - other), initial=0)) / scale)
        for name, list_of in errors.items():
            self._add(name, equation_of(name), list_of, 1e-12)

    def _any_state(self, stepper: Stepper, rng: np.random.Generator) -> tuple[Any, ...]:
        n = stepper.sizes
        t, q, v = stepper.initial_state()
        parameters = Drawer(stepper, int(rng.integers(2**31)))._parameters()
        return (
            t + rng.uniform(0.1, 1.0),
            q + 0.2 * rng.normal(size=n["n_q"]),
            v + rng.normal(size=n["n_q"]),
            rng.normal(size=n["n_u"]),
            rng.normal(size=n["n_R"]),
            parameters,
        )

    # --- Jacobians -------------------------------------------------------------------------------

    def jacobians(self, stepper: Stepper) -> None:
        """Residuals and Jacobians of both problems against differences in 50 digits."""
        reference = Reference(self.model, stepper.stages, high=True)
        rng = np.random.default_rng(self.seed + stepper.stages)
        n, s = stepper.sizes, stepper.stages
        names = ("r", "y", "A", "B", "C")
        errors: dict[tuple[str, str], list[float]] = {}
        for _ in range(_JACOBIAN_STATES):
            t, q, v, u, _, parameters = self._any_state(stepper, rng)
            h = 0.05
            x = np.tile(v, s + 1) + 0.2 * rng.normal(size=(s + 1) * n["n_q"])
            lam = 0.3 * rng.normal(size=s * n["n_R"])
            par = list(parameters.values())
            for problem in ("position", "velocity"):
                mine = stepper.problem(
                    problem, x, lam, h, t=t, q=q, v=v, u=u, parameters=parameters
                )
                other = self._differences(reference, problem, t, q, v, u, par, h, x, lam)
                for name in names:
                    scale = max(1.0, float(np.max(np.abs(other[name]), initial=0)))
                    difference = np.max(np.abs(mine[name] - other[name]), initial=0) / scale
                    errors.setdefault((problem, name), []).append(float(difference))
        titles = {
            "r": "smooth rows (47b), (47d)",
            "y": "kinematic rows (47f), (48), (51), (68)",
            "A": "A = dr/dx",
            "B": "B = dr/dlambda",
            "C": "C = dy/dx",
        }
        for (problem, name), list_of in errors.items():
            self._add(f"{problem} {name}, s = {s}", titles[name], list_of, 1e-11)

    def _differences(
        self,
        reference: Reference,
        problem: str,
        t: Any,
        q: Any,
        v: Any,
        u: Any,
        par: Any,
        h: Any,
        x: np.ndarray,
        lam: np.ndarray,
    ) -> dict[str, np.ndarray]:
        n, s, n_R = reference.n, reference.s, reference.n_R
        with mp.workdps(DIGITS):
            exact = np.vectorize(mp.mpf, otypes=[object])
            q, v = exact(q), exact(v)
            weights = exact(reference.b)
            e_N, e_F, rates = self._restitution(reference, t, q, v, u, par)

            def rows(x: np.ndarray, lam: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
                R = np.zeros((s, n_R), dtype=object)
                R[: s - 1] = lam[: (s - 1) * n_R].reshape(s - 1, n_R)
                delta_P = lam[(s - 1) * n_R :]
                R[s - 1] = (delta_P - weights[: s - 1] @ R[: s - 1]) / weights[s - 1]
                step = Step(x[: s * n].reshape(s, n), x[s * n :], R)
                momentum, final, y, end_rates, _ = reference.smooth(step, t, q, v, u, par, h)
                if problem == "position":
                    return np.concatenate(momentum), np.concatenate([np.zeros(0), *y[1:]])
                xi = np.array(end_rates, dtype=object)
                xi[reference.n_bilateral : reference.n_normal] += e_N * rates[0]
                xi[reference.n_normal :] += e_F * rates[1]
                return final, xi

            xs, lams = exact(x), exact(lam) if lam.size else np.zeros(0, dtype=object)
            here = rows(xs, lams)
            step = mp.mpf(10) ** -20
            first, count = (0, s * n) if problem == "position" else (s * n, n)
            lam_first, lam_count = (
                (0, (s - 1) * n_R) if problem == "position" else ((s - 1) * n_R, n_R)
            )
            A, B, C = [], [], []
            for k in range(count):
                plus, minus = xs.copy(), xs.copy()
                plus[first + k] += step
                minus[first + k] -= step
                (r_plus, y_plus), (r_minus, y_minus) = rows(plus, lams), rows(minus, lams)
                A.append((r_plus - r_minus) / (2 * step))
                C.append((y_plus - y_minus) / (2 * step))
            for k in range(lam_count):
                plus = lams.copy()
                plus[lam_first + k] += 1
                B.append(rows(xs, plus)[0] - here[0])

            def number(value: Any, *shape: int) -> np.ndarray:
                return np.array(value, dtype=float).reshape(shape)

            n_r, n_y = len(here[0]), len(here[1])
            return {
                "r": number(here[0], n_r),
                "y": number(here[1], n_y),
                "A": number(A, count, n_r).T,
                "B": number(B, lam_count, n_r).T,
                "C": number(C, count, n_y).T,
            }

    @staticmethod
    def _restitution(reference: Reference, t: Any, q: Any, v: Any, u: Any, par: Any) -> Any:
        e = reference.e
        at = (t, q, v, u, par)
        contacts = e.contacts
        e_N_all, e_F_all = e.value("e_N", *at), e.value("e_F", *at)
        e_N = np.array([e_N_all[k] for k, c in enumerate(contacts) if c.g_N is not None], object)
        e_F = np.array([e_F_all[k] for k, c in enumerate(contacts) for _ in c.gamma_F], object)
        return e_N, e_F, (e.dot("g_N", *at), e.value("gamma_F", *at))

    # --- steps -----------------------------------------------------------------------------------

    def steps(self, stepper: Stepper) -> None:
        """Single steps from drawn states: verified by the reference, some solved again by it."""
        reference = Reference(self.model, stepper.stages)
        drawer = Drawer(stepper, self.seed)
        targets = wanted(stepper, stepper.parameters)
        counts = {name: dict.fromkeys(kinds, 0) for name, kinds in targets.items()}
        errors: dict[str, list[float]] = {}
        own: list[float] = []
        failures = random_steps = ties = others = 0
        for _ in range(_MAX_DRAWS):
            missing = any(c < _PER_KIND for kinds in counts.values() for c in kinds.values())
            if not missing and random_steps >= _RANDOM_STEPS:
                break
            state = drawer.draw()
            if state is None:
                continue
            if self._is_tie(stepper, state):
                ties += 1
                continue
            try:
                traj = self._one_step(stepper, state)
            except StepError:
                failures += 1
                continue
            kinds_seen = seen(stepper, traj, state)
            news = [
                (name, kind)
                for name, kind in kinds_seen
                if kind in counts[name] and counts[name][kind] < _PER_KIND
            ]
            if not news and random_steps >= _RANDOM_STEPS:
                continue
            random_steps += not news
            scale = self._scale(stepper, traj, state)
            residual, _ = self._residual(reference, traj, state, 0)
            for name, value in residual.items():
                worst = float(np.max(np.abs(value), initial=0))
                errors.setdefault(name, []).append(worst / scale)
            for name, kind in kinds_seen:
                if kind in counts[name]:
                    counts[name][kind] += 1
            if len(own) < _SOLVED_AGAIN:
                solution = reference.solve(*self._arguments(state))
                if solution is not None:
                    difference = np.max(np.abs(solution.v_end - traj.v[1]), initial=0)
                    difference /= max(1.0, float(np.max(np.abs(traj.v))))
                    # Friction may leave several solutions; the step was verified to be one.
                    if difference > _APART:
                        others += 1
                    else:
                        own.append(float(difference))
        self._add_steps(f"step, s = {stepper.stages}", errors)
        self._add(f"step solved again, s = {stepper.stages}", "v_{n+1}", own, 1e-7)
        if others:
            self.report.notes.append(
                f"s = {stepper.stages}: for {others} of the steps solved again the reference found "
                "another solution"
            )
        if ties:
            self.report.notes.append(
                f"s = {stepper.stages}: {ties} drawn states left out, a guard is zero to round-off"
            )
        if failures:
            self.report.notes.append(
                f"s = {stepper.stages}: {failures} drawn states had no solution that was accepted"
            )
        for name, kinds in counts.items():
            total = self.report.counts.setdefault(name, dict.fromkeys(kinds, 0))
            for kind, count in kinds.items():
                total[kind] += count

    @staticmethod
    def _is_tie(stepper: Stepper, state: State) -> bool:
        """Whether round-off decides if a contact exists."""
        if not any(c["guarded"] for c in stepper.manifest["contacts"]):
            return False
        guard = stepper.evaluate("guard", state.t, state.q, parameters=state.parameters)
        guarded = [c["guarded"] for c in stepper.manifest["contacts"]]
        return bool(np.any(np.abs(guard[guarded]) < _TIE))

    @staticmethod
    def _one_step(stepper: Stepper, state: State) -> Any:
        return stepper.step(
            state.t,
            state.q,
            state.v,
            state.dt,
            u=state.u,
            parameters=state.parameters,
            max_halvings=0,
        )

    @staticmethod
    def _arguments(state: State) -> tuple[Any, ...]:
        return (state.t, state.q, state.v, state.u, list(state.parameters.values()), state.dt)

    def _residual(
        self, reference: Reference, traj: Any, state: State, row: int
    ) -> tuple[dict[str, np.ndarray], Step]:
        step = Step(traj.V[row], traj.v[row + 1], traj._arrays["R"][row])
        # Unit prox parameters of the size of a mass keep the mixed residual on one scale.
        return reference.residual(step, *self._arguments(state)), step

    @staticmethod
    def _scale(stepper: Stepper, traj: Any, state: State) -> float:
        p = stepper.evaluate("p", traj.t, traj.q, traj.v, parameters=state.parameters)
        speeds = float(np.max(np.abs(traj.v), initial=0))
        return max(1.0, float(np.max(np.abs(p), initial=0)), speeds)

    def _add_steps(self, what: str, errors: dict[str, list[float]]) -> None:
        equations = {
            "momentum": "(47b)",
            "end": "(47d)",
            "bilateral": "(47f), (48), (51)",
            "normal": "(52), (56)",
            "friction": "(57), (58)",
        }
        for name, list_of in errors.items():
            self._add(f"{what}: {name}", equations[name], list_of, 1e-8)

    # --- trajectory and sanitizers ---------------------------------------------------------------

    def trajectory(self, stepper: Stepper) -> None:
        """A short run from the model's initial state."""
        reference = Reference(self.model, stepper.stages)
        rng = np.random.default_rng(self.seed)
        start = stepper.initial_state()
        u = rng.normal(size=(_TRAJECTORY, stepper.sizes["n_u"]))
        dt = 5e-3 / max(1.0, float(np.max(np.abs(start[2]), initial=0)) / 10)
        dt = min(dt, self.model.suggested.get("dt", dt))
        try:
            traj = stepper.simulate(
                t_end=start[0] + _TRAJECTORY * dt,
                dt=dt,
                inputs=u if u.size else None,
                record="stages",
                max_halvings=0,
            )
        except StepError as error:
            self._add(f"run, s = {stepper.stages}", str(error), [float("inf")], 0.0)
            return
        errors: dict[str, list[float]] = {}
        for k in range(_TRAJECTORY):
            state = State(traj.t[k], traj.q[k], traj.v[k], u[k], stepper.parameters, dt)
            residual, _ = self._residual(reference, traj, state, k)
            scale = self._scale(stepper, traj, state)
            for name, value in residual.items():
                worst = float(np.max(np.abs(value), initial=0))
                errors.setdefault(name, []).append(worst / scale)
        self._add_steps(f"run, s = {stepper.stages}", errors)

    def sanitizers(self, stepper: Stepper) -> None:
        """The generated example under the address and undefined-behaviour sanitizers."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name) / "c"
            shutil.copytree(stepper.folder, folder)
            flags = "-std=c99 -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all"
            prefix = stepper.manifest["prefix"]
            command = [*find_compiler(), *flags.split(), "-o", "example", "example.c"]
            build = subprocess.run(
                [*command, f"{prefix}.c", "-lm"], cwd=folder, capture_output=True, check=False
            )
            failed = build.returncode != 0
            if not failed:
                environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
                run = subprocess.run(
                    [str(folder / "example")],
                    cwd=folder,
                    env=environment,
                    capture_output=True,
                    check=False,
                )
                failed = run.returncode != 0
        self._add(f"sanitizers, s = {stepper.stages}", "address, undefined", [float(failed)], 0.0)
