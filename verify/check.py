"""Generated against numeric: the comparisons of one model."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from signorini.codegen.c.functions import equation_of
from signorini.codegen.frontend.model import Model
from signorini.runtime.compile import find_compiler
from signorini.runtime.errors import RunError, StepError
from signorini.runtime.stepper import Stepper
from signorini.verify import intervals
from signorini.verify.differences import by_differences
from signorini.verify.draw import Drawer, State, seen, wanted
from signorini.verify.expressions import Expressions
from signorini.verify.functions import reference_values
from signorini.verify.judge import accepts
from signorini.verify.reference import Reference, Step
from signorini.verify.report import Item, Report
from signorini.verify.schemes import find

_FUNCTION_STATES = 4
_JACOBIAN_STATES = 2
_MAX_DRAWS = 3000
_PER_KIND = 2  # verified steps for each kind of motion of each contact
_RANDOM_STEPS = 10
_TIE = 1e-9  # guards closer to zero than this are left to neither implementation
_SOLVED_AGAIN = 12  # at most, of models so small that it takes seconds
_SMALL = 40  # unknowns of a step up to which that holds
_APART = 1e-4  # end velocities further apart than this belong to different solutions
_SHARE = 20  # one in so many steps may have another solution, if that is one
_TRAJECTORY = 30
_NOISE = 200  # times what round-off of the arguments changes
# By precision: model functions, Jacobians, steps, steps solved again; relative changes of the
# arguments by which the size of terms and of their round-off are seen.
_TOLERANCES = {
    "double": (1e-12, 1e-11, 1e-8, 1e-7),
    "float": (3e-5, 3e-4, 1e-2, 1e-2),
}
_TOLERANCES["extended"] = _TOLERANCES["double"]  # the reference of a step has double precision
_CHANGES = {"double": (1e-6, 1e-15), "float": (1e-3, 2e-7)}
_CHANGES["extended"] = _CHANGES["double"]
_LEFT_OUT = (
    "substeps and rescues: steps are taken whole, from a cold start and from a run's guess",
    "options other than the defaults of the stepper (active_set='end', scaling='none')",
    "batches and the recording of thinned rows",
)


def reference_of(model: Model, stepper: Stepper, high: bool = False) -> Reference:
    """The reference of the scheme and form that a stepper has."""
    m = stepper.manifest
    option = m["scheme"].partition("=")[2]
    return find(m["scheme"], m["velocity_constraints"], m["events"])(
        model, stepper.stages, high=high, option=option
    )


def _worst(error: np.ndarray, size: np.ndarray) -> float:
    """Largest error over its size; where the size is zero any error is infinite."""
    error, size = np.abs(np.asarray(error, float)), np.asarray(size, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(error == 0, 0.0, error / size)
    return float(np.max(share, initial=0.0))


class Checker:
    """Collects the comparisons of one model under one scheme, form and precision.

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
        self._describe(first, stages)
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
            if stepper.manifest["events"] == "located":
                self.tell(f"located steps, s = {s}")
                self.located(stepper)
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

    def _describe(self, stepper: Stepper, stages: Sequence[int]) -> None:
        m = stepper.manifest
        own = reference_of(self.model, stepper)
        numbers = "" if not own.numbered else f", s = {', '.join(map(str, stages))}"
        self.report.covers += [
            f"{own.covers}{numbers}, {m['precision']} precision, prefix {m['prefix']}",
            f"{len(stepper.functions)} model functions at {_FUNCTION_STATES} states, all rows and "
            f"Jacobians at {_JACOBIAN_STATES}, single steps from drawn states, {_TRAJECTORY} steps "
            "of a run",
        ]
        self.report.left_out += list(_LEFT_OUT)
        if type(own) is not Reference:
            self.report.left_out.append("steps of this form are verified, not solved anew")
        if not own.covers_impacts:
            names = [c.name for c in self.model.contacts if c.impact == "poisson"]
            self.report.left_out.append(
                f"impacts by Poisson's law ({', '.join(names)}) at the end of single steps"
            )
        self.report.never = {c.name: dict(c.never) for c in self.model.contacts if c.never}

    def _tolerance(self, stepper: Stepper, which: int) -> float:
        return _TOLERANCES[stepper.manifest["precision"]][which]

    # --- located steps ----------------------------------------------------------------------------

    def located(self, stepper: Stepper) -> None:
        """Steps that are cut at their events against the motion by events, from drawn states."""
        s = stepper.stages
        found = intervals.compare(self.model, stepper, self.seed + 1, self._is_tie)
        if found is None:
            self.report.left_out.append(f"located steps, s = {s}: anisotropic friction, or float")
            return
        name = f"located steps, s = {s}"
        self._add(name, "motion by events", found.errors, intervals.tolerance(s))
        self._add(f"located events, s = {s}", "impacts", [float(found.wrong)], 0.0)
        self._add(f"tolerance, s = {s}", "errors in wishes", found.wishes, intervals.MOST)
        self.report.notes.append(
            f"s = {s}: {len(found.errors)} intervals of located steps compared, "
            f"{found.eventful} with events"
        )

    # --- functions -------------------------------------------------------------------------------

    def functions(self, stepper: Stepper) -> None:
        """Every emitted function and derivative at random states."""
        e = Expressions(self.model, high=True)
        rng = np.random.default_rng(self.seed)
        tolerance = self._tolerance(stepper, 0)
        errors: dict[str, list[float]] = {name: [] for name in stepper.functions}
        for _ in range(_FUNCTION_STATES):
            t, q, v, u, R, parameters = self._any_state(stepper, rng)
            expected = reference_values(e, t, q, v, u, R, list(parameters.values()))
            names = list(parameters)
            at = [np.atleast_1d(x) for x in (t, q, v, u, R, list(parameters.values()))]

            def values(at: list[np.ndarray], names: list[str] = names) -> dict[str, np.ndarray]:
                par = self._within(stepper, dict(zip(names, map(float, at[5]), strict=True)))
                return {
                    name: stepper.evaluate(name, float(at[0][0]), at[1], at[2], at[3], par, at[4])
                    for name in stepper.functions
                }

            mine = values(at)
            sizes = self._sizes(stepper, values, at, mine, rng, tolerance)
            for name in stepper.functions:
                other = np.array(expected[name], dtype=float).reshape(np.shape(mine[name]))
                size = np.maximum(sizes[name], np.abs(other))
                errors[name].append(_worst(mine[name] - other, size))
        for name, list_of in errors.items():
            self._add(name, equation_of(name), list_of, tolerance)

    def _sizes(
        self,
        stepper: Stepper,
        values: Callable[[list[np.ndarray]], dict[str, np.ndarray]],
        at: list[np.ndarray],
        here: dict[str, np.ndarray],
        rng: np.random.Generator,
        tolerance: float,
    ) -> dict[str, np.ndarray]:
        """The size of the terms of every entry, in its own units.

        A relative change of all arguments shows the size of the terms that do not cancel, a change
        of the size of round-off that of the terms that do.
        """
        change, round_off = _CHANGES[stepper.manifest["precision"]]
        sizes = {name: np.zeros(np.shape(value)) for name, value in here.items()}
        for scale, factor, count in (
            (change, 1 / change, 2),
            (round_off, _NOISE / tolerance, 4),
        ):
            for _ in range(count):
                moved = [x * (1 + scale * rng.uniform(-1, 1, x.shape)) for x in at]
                for name, value in values(moved).items():
                    sizes[name] = np.maximum(sizes[name], factor * np.abs(value - here[name]))
        return sizes

    @staticmethod
    def _within(stepper: Stepper, par: dict[str, float]) -> dict[str, float]:
        """Parameters within their bounds: round-off may lead out."""
        moved = {}
        for p in stepper.manifest["parameters"]:
            low = -np.inf if p["min"] is None else p["min"]
            top = np.inf if p["max"] is None else p["max"]
            moved[p["name"]] = float(np.clip(par[p["name"]], low, top))
        return moved

    def _any_state(self, stepper: Stepper, rng: np.random.Generator) -> tuple[Any, ...]:
        n = stepper.sizes
        t, q, v = stepper.initial_state()
        parameters = Drawer(stepper, int(rng.integers(2**31))).parameters()
        rounded: Any = stepper.library.dtype
        drawn = (
            t + rng.uniform(0.1, 1.0),
            q + 0.2 * rng.normal(size=n["n_q"]),
            v + rng.normal(size=n["n_q"]),
            rng.normal(size=n["n_u"]),
            rng.normal(size=n["n_R"]),
        )
        time, *arrays = (np.asarray(x).astype(rounded).astype(float) for x in drawn)
        parameters = {name: float(rounded(x)) for name, x in parameters.items()}
        return (float(time), *arrays, parameters)

    # --- Jacobians -------------------------------------------------------------------------------

    def jacobians(self, stepper: Stepper) -> None:
        """Residuals and Jacobians of all problems against differences in 50 digits."""
        reference = reference_of(self.model, stepper, high=True)
        plain = reference_of(self.model, stepper)
        rng = np.random.default_rng(self.seed + stepper.stages)
        n, s = stepper.sizes, stepper.stages
        rounded: Any = stepper.library.dtype
        tolerance = self._tolerance(stepper, 1)
        names = ("r", "y", "A", "B", "C")
        errors: dict[tuple[str, str], list[float]] = {}
        for _ in range(_JACOBIAN_STATES):
            t, q, v, u, _, parameters = self._any_state(stepper, rng)
            h = float(rounded(0.05))
            par = list(parameters.values())
            blocks = n["n_x_total"] // n["n_q"]
            masses = plain.effective_masses((t, q, v, u, par))
            x = np.tile(v, blocks) + 0.2 * rng.normal(size=n["n_x_total"])
            # percussions as large as momenta: in other units forces would drown
            lam = 0.3 * rng.normal(size=n["n_rows_total"])
            lam *= np.tile(masses, n["n_rows_total"] // max(n["n_R"], 1)) if n["n_R"] else 1
            known = self._known(stepper, masses, rng)
            for own in (reference, plain):
                own.__dict__.update(known)
            x, lam = (y.astype(rounded).astype(float) for y in (x, lam))
            at = [np.atleast_1d(y) for y in (t, q, v, u, x, lam)]
            for problem in reference.problems:

                def rows(
                    at: list[np.ndarray],
                    problem: str = problem,
                    h: float = h,
                    parameters: dict[str, float] = parameters,
                    known: dict[str, np.ndarray] = known,
                ) -> dict[str, np.ndarray]:
                    t, q, v, u, x, lam = at
                    found = stepper.problem(
                        problem,
                        x,
                        lam,
                        h,
                        t=float(t[0]),
                        q=q,
                        v=v,
                        u=u,
                        parameters=parameters,
                        known=known,
                    )
                    return {name: found[name] for name in names}

                mine = rows(at)
                sizes = self._sizes(stepper, rows, at, mine, rng, tolerance)
                other = by_differences(reference, problem, (t, q, v, u, par), h, x, lam)
                for name in names:
                    size = np.maximum(sizes[name], np.abs(other[name]))
                    worst = _worst(mine[name] - other[name], size)
                    errors.setdefault((problem, name), []).append(worst)
        titles = {
            "r": "smooth rows",
            "y": "kinematic rows",
            "A": "A = dr/dx",
            "B": "B = dr/dlambda",
            "C": "C = dy/dx",
        }
        for (problem, name), list_of in errors.items():
            self._add(f"{problem} {name}, s = {s}", titles[name], list_of, tolerance)

    @staticmethod
    def _known(
        stepper: Stepper, masses: np.ndarray, rng: np.random.Generator
    ) -> dict[str, np.ndarray]:
        """Friction that a segment knows at its start, any numbers; nothing where there is none."""
        n = stepper.sizes
        if stepper.manifest["events"] != "located":
            return {}
        rounded: Any = stepper.library.dtype
        rows = np.concatenate(
            [masses[n["n_g"] : n["n_g"] + n["n_gamma"]], masses[n["n_R"] - n["n_F"] :]]
        )
        known = {
            "share": rng.normal(size=n["n_F"]),
            "given": 0.3 * rows * rng.normal(size=n["n_gamma"] + n["n_F"]),
        }
        return {name: x.astype(rounded).astype(float) for name, x in known.items()}

    # --- steps -----------------------------------------------------------------------------------

    def steps(self, stepper: Stepper) -> None:
        """Single steps from drawn states: verified by the reference, some solved again by it."""
        reference = reference_of(self.model, stepper)
        drawer = Drawer(stepper, self.seed)
        targets = wanted(stepper, stepper.parameters)
        counts = {name: dict.fromkeys(kinds, 0) for name, kinds in targets.items()}
        errors: dict[str, list[float]] = {}
        own: list[float] = []
        failures = random_steps = ties = others = doubtful = 0
        unknowns = (stepper.stages + 1) * stepper.sizes["n_q"]
        unknowns += stepper.stages * stepper.sizes["n_R"]
        again = _SOLVED_AGAIN if unknowns <= _SMALL else 3
        for _ in range(_MAX_DRAWS):
            missing = any(
                count < _PER_KIND and self.report.waiver(name, kind) is None
                for name, kinds in counts.items()
                for kind, count in kinds.items()
            )
            if not missing and random_steps >= _RANDOM_STEPS:
                break
            state = drawer.draw()
            if state is None:
                continue
            state = self._rounded(stepper, state)
            if self._is_tie(stepper, state):
                ties += 1
                continue
            try:
                traj = self._one_step(stepper, state)
            except (StepError, RunError):
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
            step = self._residuals(reference, traj, state, 0, errors)
            for name, kind in kinds_seen:
                if kind in counts[name]:
                    counts[name][kind] += 1
            if len(own) + others + doubtful < again:
                verdict = self._solve_again(reference, step, state)
                others += verdict == "other"
                doubtful += verdict == "doubtful"
                if isinstance(verdict, float):
                    own.append(verdict)
        self._add_steps(reference, f"step, s = {stepper.stages}", errors, stepper)
        if type(reference) is Reference and reference.covers_impacts:
            self._add(
                f"step solved again, s = {stepper.stages}",
                "v_{n+1}",
                own,
                self._tolerance(stepper, 3),
            )
        self._several(stepper, len(own), others, doubtful)
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

    def _solve_again(self, reference: Reference, step: Step, state: State) -> float | str | None:
        """How far the reference's own solution is; whether it is another one that holds as well."""
        if not reference.covers_impacts:
            return None
        at = self._arguments(state)
        solution = reference.solve(*at)
        if solution is None:
            return None
        speeds = (state.v, step.V, step.v_end, solution.v_end)
        speed = max(float(np.max(np.abs(x))) for x in speeds)
        # a body at rest has round-off for velocities: what its forces would give it in the step,
        # or what holds it
        e, place, h = reference.e, at[:5], at[5]
        force = h * np.asarray(e.L_q(*place) + e.value("f", *place), dtype=float)
        held = np.abs(np.asarray(e.W(*place), dtype=float)) @ np.max(np.abs(step.R), axis=0)
        free = np.linalg.solve(reference.mass(place), np.array([force, held]).T)
        speed = max(speed, float(np.max(np.abs(free), initial=0.0)))
        apart = float(np.max(np.abs(solution.v_end - step.v_end), initial=0))
        difference = apart / speed if speed > 0 else 0.0
        if difference <= _APART:
            return difference
        # Friction may leave several solutions. Both count only if the reference stays at the one
        # that C found, and if a judge that shares nothing with it accepts both.
        t, q, v, u, par, _ = at
        there = reference.solve(t, q, v, u, par, h, start=step)
        stays = there is not None and (
            np.max(np.abs(there.v_end - step.v_end), initial=0) <= _APART * speed
        )
        both = stays and all(accepts(reference, one, place, h, 1e-6) for one in (step, solution))
        return "other" if both else "doubtful"

    def _several(self, stepper: Stepper, own: int, others: int, doubtful: int) -> None:
        if not others and not doubtful:
            return
        solved = own + others + doubtful
        self.report.notes.append(
            f"s = {stepper.stages}: for {others + doubtful} of {solved} steps solved again the "
            f"reference found another solution; both hold in {others} of them"
        )
        allowed = max(1, solved // _SHARE)
        self._add(
            f"other solutions, s = {stepper.stages}",
            "steps whose other solution does not hold as well, or too many of them",
            [float(doubtful + max(0, others - allowed))],
            0.0,
        )

    @staticmethod
    def _is_tie(stepper: Stepper, state: State) -> bool:
        """Whether round-off decides if a contact exists."""
        if not any(c["has_guard"] for c in stepper.manifest["contacts"]):
            return False
        guard = stepper.evaluate("guard", state.t, state.q, parameters=state.parameters)
        guarded = [c["has_guard"] for c in stepper.manifest["contacts"]]
        return bool(np.any(np.abs(guard[guarded]) < _TIE))

    @staticmethod
    def _rounded(stepper: Stepper, state: State) -> State:
        """The state as the stepper's numbers hold it."""
        kind: Any = stepper.library.dtype
        if kind is np.float64:
            return state
        q, v, u = (np.asarray(x).astype(kind).astype(float) for x in (state.q, state.v, state.u))
        return State(
            float(kind(state.t)),
            q,
            v,
            u,
            {name: float(kind(x)) for name, x in state.parameters.items()},
            float(kind(state.dt)),
        )

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

    def _residuals(
        self,
        reference: Reference,
        traj: Any,
        state: State,
        row: int,
        errors: dict[str, list[float]],
    ) -> Step:
        """Add the errors of one step, every row in units of its own terms."""
        step = Step(traj.V[row], traj.v[row + 1], traj.R[row], traj.q[row + 1])
        t, q, v, u, par, h = self._arguments(state)
        r = reference.prox_parameters((t, q, v, u, par), h)
        residual = reference.residual(step, t, q, v, u, par, h, r)
        sizes = reference.sizes(step, t, q, v, u, par, h, r)
        for name, value in residual.items():
            errors.setdefault(name, []).append(_worst(value, sizes[name]))
        return step

    def _add_steps(
        self, reference: Reference, what: str, errors: dict[str, list[float]], stepper: Stepper
    ) -> None:
        for name, list_of in errors.items():
            equation = reference.equations[name]
            self._add(f"{what}: {name}", equation, list_of, self._tolerance(stepper, 2))

    # --- trajectory and sanitizers ---------------------------------------------------------------

    def trajectory(self, stepper: Stepper) -> None:
        """A short run from the model's initial state."""
        reference = reference_of(self.model, stepper)
        rng = np.random.default_rng(self.seed)
        rounded: Any = stepper.library.dtype
        start = stepper.initial_state()
        u = rng.normal(size=(_TRAJECTORY, stepper.sizes["n_u"])).astype(rounded).astype(float)
        dt = 5e-3 / max(1.0, float(np.max(np.abs(start[2]), initial=0)) / 10)
        dt = float(rounded(min(dt, self.model.suggested.get("dt", dt))))
        what = f"run, s = {stepper.stages}"
        try:
            traj = stepper.simulate(
                t_end=start[0] + _TRAJECTORY * dt,
                dt=dt,
                inputs=u if u.size else None,
                record="stages",
                max_halvings=0,
            )
        except (StepError, RunError) as error:
            self._add(what, str(error), [float("inf")], 0.0)
            return
        errors: dict[str, list[float]] = {}
        parameters = {name: float(rounded(x)) for name, x in stepper.parameters.items()}
        for k in range(len(traj) - 1):
            state = State(traj.t[k], traj.q[k], traj.v[k], u[k], parameters, dt)
            self._residuals(reference, traj, state, k, errors)
        self._add_steps(reference, what, errors, stepper)

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
