"""A loaded stepper: steps, whole runs, model functions, residuals."""

import functools
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, cast

import numpy as np
from signorini.runtime.arguments import as_path, grid, number, reals
from signorini.runtime.batch import Batch, run_batch
from signorini.runtime.changes import Taken, differentiate, differentiate_batch, table_of
from signorini.runtime.chosen import ChosenRun, largest_step
from signorini.runtime.compiled import Compiled
from signorini.runtime.consistency import project
from signorini.runtime.controller import Controller
from signorini.runtime.derivatives import check_derivatives
from signorini.runtime.errors import RunError
from signorini.runtime.library import Library
from signorini.runtime.linearise import Linearisation, linearise
from signorini.runtime.options import DEFAULTS, RunOptions
from signorini.runtime.run import Run
from signorini.runtime.simulator import Simulator
from signorini.runtime.simulator import start as start_simulator
from signorini.runtime.threads import number_of_threads
from signorini.runtime.tolerance import check_chosen, scale_of
from signorini.runtime.trajectory import Trajectory

Method = TypeVar("Method", bound=Callable[..., Any])


def _named(method: Method) -> Method:
    """The method, whose messages say of which model they speak."""

    @functools.wraps(method)
    def named(self: "Stepper", *args: Any, **kwargs: Any) -> Any:
        try:
            return method(self, *args, **kwargs)
        except RunError as error:
            if type(error) is not RunError or f"'{self.name}'" in str(error):
                raise
            about = RunError(f"model '{self.name}': {error}")
            about.__dict__.update(error.__dict__)
            raise about from None

    return cast(Method, named)


def load(folder: str | os.PathLike[str]) -> "Stepper":
    """Load the stepper in a generated folder; compiles it if needed.

    Needs NumPy and a C compiler only.

    Parameters
    ----------
    folder : path
        A folder that `generate` or ``signorini generate`` wrote.

    Returns
    -------
    Stepper

    Raises
    ------
    RunError
        If the folder is no generated folder, or its files do not belong together.
    CompilerError
        If there is no C compiler or it fails.
    """
    return Stepper(Library(as_path("folder", folder).resolve()))


class Stepper(Compiled):
    """A compiled stepper of one model.

    Made by `signorini.build` or `signorini.load`. Every model function is available through
    `evaluate`, every residual with its Jacobian through `problem`.

    Attributes
    ----------
    name, stages, sizes, manifest
        See `Compiled`.
    """

    def __init__(self, library: Library) -> None:
        super().__init__(library)
        # what makes the same stepper with more in it, and what it has made: `signorini.build`
        self.locating: Callable[[], Stepper] | None = None
        self.differentiating: Callable[[], Stepper] | None = None
        self._made: dict[str, Stepper] = {}

    def fitting(self, options: RunOptions) -> "Stepper":
        """The stepper that has what the options ask for: this one, or one made on first use."""
        m = self.manifest
        if options.events == "captured" or m["events"] == "located":
            return self
        if options.error is None and not m["contacts"]:
            return self
        wanted = 'events="located"' if options.error is None else "error"
        if m["scheme"] != "lobatto":
            raise RunError(
                f"model '{self.name}': {wanted} needs the scheme lobatto, and this is {m['scheme']}"
            )
        if options.error is not None and m["compliant"]:
            raise RunError(
                f"model '{self.name}': error needs steps of the scheme's order, and "
                f"'{m['compliant'][0]}' is compliant, of first order. Give dt alone"
            )
        if m["adaptive"] and not m["contacts"]:
            return self
        return self._more("located events", 'events="located"', "--events located", self.locating)

    def differentiable(self) -> "Stepper":
        """The stepper that can differentiate its steps: this one, or one made on first use."""
        if self.manifest["derivatives"]:
            return self
        return self._more("derivatives", "derivatives=True", "--derivatives", self.differentiating)

    def _more(
        self, what: str, option: str, switch: str, make: Callable[[], "Stepper"] | None
    ) -> "Stepper":
        if what not in self._made:
            if make is None:
                raise RunError(
                    f"the stepper of '{self.name}' was generated without {what}: generate it again "
                    f"with {option} (signorini generate {switch})"
                )
            self._made[what] = make()
        return self._made[what]

    def __repr__(self) -> str:
        m, n = self.manifest, self.sizes
        sizes = ", ".join(f"{k} = {n[k]}" for k in ("n_q", "n_g", "n_gamma", "n_N", "n_F") if n[k])
        return (
            f"Stepper('{self.name}', {m['scheme']}, s = {self.stages}, {m['precision']}: {sizes})"
        )

    @_named
    def project(
        self,
        q0: Any,
        v0: Any,
        t0: float | None = None,
        parameters: Mapping[str, float] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the nearest (q, v) that satisfies g = 0, g_N >= 0, g_dot = 0, gamma = 0.

        Nearest is measured with the mass matrix at the given state.

        Raises
        ------
        RunError
            If no consistent state is found near by.
        """
        par = self.check_parameters(parameters)
        return project(self, *self.start_of(q0, v0, t0, par), par)

    # --- runs ------------------------------------------------------------------------------------

    @_named
    def simulate(
        self,
        *,
        t_end: float,
        dt: float | None = None,
        error: float | None = None,
        scale: Any = None,
        q0: Any = None,
        v0: Any = None,
        t0: float | None = None,
        parameters: Mapping[str, float] | None = None,
        inputs: Any = None,
        tol: float | None = None,
        r: float | None = None,
        active_set: str = DEFAULTS.active_set,
        record: str = "steps",
        every: int = 1,
        scaling: str = DEFAULTS.scaling,
        max_halvings: int = DEFAULTS.max_halvings,
        max_iterations: int | None = None,
        events: str = DEFAULTS.events,
        max_events: int | None = None,
        derivatives: str | None = None,
        of: Sequence[str] = ("q0", "v0", "parameters"),
        project: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> Trajectory:
        """Run from the initial state to `t_end` in steps of `dt`, or as exact as `error` says.

        Parameters
        ----------
        t_end, dt : float
            End and step size [s]. If dt does not divide the time to within 1e-9 of a step, the
            last step ends before `t_end` and a warning says so.
        error : float
            The error of the coordinates at the end that is wanted, in units of `scale`; step sizes
            follow from estimates of what each step adds to it, and steps are cut at their events.
            Rows are the steps taken, or those of the grid if `dt` is given, over whose intervals
            inputs are held. ``traj.estimate`` is the sum of the estimates up to each row. It holds
            as long as the motion does not spread them: chaos multiplies every error.
        scale : mapping from coordinate to number, or array, shape (n_q,)
            What 1 means of each coordinate; by default 1 of its unit. Errors of velocities count by
            what they make of the coordinates in the time of the run.
        q0, v0 : array, shape (n_q,), or mapping from name to value
            Initial state; what is not given comes from the model file.
        t0 : float
            Initial time.
        parameters : mapping
            Values that differ from the defaults.
        inputs : None, array of shape (n_steps, n_u), or callable (t, q, v) -> u
            Held over each step; a callable is asked before each step. One in C, see `controller`,
            costs nothing.
        tol : float
            Relative tolerance of every row; 0 iterates to round-off. With ``scaling="none"`` an
            absolute tolerance, as in the paper.
        r : float
            Prox parameter of the contact laws; by default one is chosen per contact.
        active_set : {"any_stage", "end"}
            Which contacts take part in the impact equations; "end" is the paper's rule (67).
        record : {"steps", "stages"}
            "stages" keeps t, q, v and percussions of every stage of a row's last step, too; NaN
            where that step was solved in substeps, whose stages are others.
        every : int
            Record a row for every `every` steps and one for what is left at the end. A row holds
            the state at its end, and the sums or extremes of all its steps.
        scaling : {"rows", "none"}
            How `tol` is meant.
        max_halvings : int
            How often a step that is not solved otherwise may be halved; 0 forbids substeps.
        max_iterations : int
            Newton iterations of one nonlinear problem.
        events : {"captured", "located"}
            "captured": impacts are spread over the step in which they happen, as in the paper.
            "located": steps are cut at impacts and at changes of stick and slip, so that the order
            2 s - 2 holds through them; where that cannot be decided a step is captured, and
            `Trajectory.captured` says so.
        max_events : int
            Events of one located step, at most 64 and by default so many; with more of them the
            rest of the step is captured.
        derivatives : {"forward", "adjoint"}, optional
            Differentiate the run: with ``events="located"`` ``traj.dq["v0"]`` of shape
            (n_t, n_q, n_q), ``traj.dv["parameters"]``, ``traj.doutputs["q0"]``, ... are exact
            derivatives through impacts and changes of stick and slip. `Trajectory.differentiable`
            is True, or lists the events that have no derivative; behind the first of them
            derivatives are NaN. So are those along directions that leave the constraints of the
            start. Steps that `error` chooses keep their sizes. With ``events="captured"`` they are
            derivatives of the map of the steps, which
            `Trajectory.differentiable` says, too. "adjoint": ``traj.gradient(q_bar, v_bar)`` with
            cotangents of the end (n_q,) or of all rows (n_t, n_q) carries gradients back to
            "q0", "v0", "parameters", "t0", "dt", and "inputs" (n_steps, n_u), each step's own.
        of : sequence of str
            With respect to what, if "forward": among "q0", "v0", "parameters", "inputs" (all held
            inputs moved alike), "t0", "dt".
        project : bool
            Whether changes of the start are made to keep the constraints, closed contacts and
            sticking that hold there: those of q0 and v0 become the nearest that do, measured with
            the mass matrix, and the start follows a parameter or a later start time.
        progress : callable (done, total)
            Called now and then.

        Returns
        -------
        Trajectory

        Raises
        ------
        RunError
            For arguments that cannot be used.
        InconsistentStartError
            If the initial state violates a constraint or penetrates a contact.
        StepError
            If a step cannot be solved; it carries the steps done so far.
        """
        par = self.check_parameters(parameters)
        options = RunOptions(
            tol, r, active_set, scaling, max_halvings, max_iterations, events, max_events, error,
            scale,
        )  # fmt: skip
        t, q, v = self.start_of(q0, v0, t0, par)
        end = number("t_end", t_end)
        if dt is None and error is None:
            raise RunError(
                "neither dt nor error is given: say how large or how exact steps are to be"
            )
        h, n_steps = (0.0, 1) if dt is None else grid(t, end, number("dt", dt))
        if error is not None and end <= t:
            raise RunError(f"t_end = {end:g}: with error give an end after the start t0 = {t:g}")
        if record not in ("steps", "stages"):
            raise RunError(f'record = {record!r}: choose "steps" or "stages"')
        every = _interval(every, n_steps if dt is not None else 2**30)
        if progress is not None and not callable(progress):
            raise RunError(f"progress = {progress!r}: give a function of (done, total)")
        u, asked = self.inputs_of(inputs, n_steps)
        wanted = check_derivatives(self, derivatives, of, options, asked is not None)
        stepper = self.differentiable() if wanted else self.fitting(options)
        if error is None:
            run = Run(stepper, par, options, t, q, v, h, n_steps, every, record == "stages")
        else:
            check_chosen(record, asked is not None and dt is None, wanted, True)
            last = end if dt is None else t + n_steps * h
            run = ChosenRun(stepper, par, options, t, q, v, h, n_steps, every, last)
        traj = run.go(u, asked, progress)
        if wanted:
            table = table_of(stepper, par)
            sizes = ends = None
            if isinstance(run, ChosenRun):
                sizes, ends, u = run.parts(u)
                n_steps = len(sizes)
            taken = Taken(
                stepper, options, np.array([t]), q[None], v[None], table, u[None], h, n_steps,
                np.array([n_steps]), every, 1, bool(project), sizes, ends,
            )  # fmt: skip
            differentiate(traj, taken, wanted if derivatives == "forward" else None)
        return traj

    @_named
    def step_size(
        self,
        *,
        t_end: float,
        error: float,
        scale: Any = None,
        t0: float | None = None,
        parameters: Mapping[str, float] | None = None,
        **options: Any,
    ) -> float:
        """The largest step size for which runs of steps of one size are as exact as is asked for.

        Steps of one size keep what a variational scheme keeps: the energy of a motion without loss
        stays near its value for ever, which it does not if step sizes follow the motion.

        Parameters
        ----------
        t_end : float
            End [s]; the step size divides the time up to it.
        error, scale
            As for `simulate`; here of the coordinates at all times.
        t0, parameters, **options
            As for `simulate`: q0, v0, inputs that are constant, tol, ...

        Returns
        -------
        float
            The step size [s], for ``simulate(dt=..., events="located")``.

        Raises
        ------
        RunError
            If no step size above 2^-20 of the time is small enough, as in motions that spread
            errors or grow.
        """
        RunOptions(error=error, scale=scale)
        par = self.check_parameters(parameters)
        t = self.initial_state(par)[0] if t0 is None else number("t0", t0)
        return largest_step(
            self, t, number("t_end", t_end), error, scale_of(self, scale), par, options
        )

    @_named
    def start(
        self,
        *,
        dt: float,
        q0: Any = None,
        v0: Any = None,
        t0: float | None = None,
        parameters: Mapping[str, float] | None = None,
        record: bool = False,
        max_halvings: int = DEFAULTS.max_halvings,
        derivatives: str | None = None,
        of: Sequence[str] = ("q0", "v0", "inputs"),
        project: bool = False,
        **options: Any,
    ) -> Simulator:
        """A simulator that goes on step by step, for a controller in the loop.

        Parameters
        ----------
        dt : float
            Step size [s].
        q0, v0, t0, parameters
            As for `simulate`.
        record : bool
            Keep every step for `Simulator.trajectory`.
        derivatives : {"forward"}, optional
            Differentiate every step: `Simulator.dq` and `Simulator.dv` say how the state changes
            with what it began with; `Simulator.begin_derivatives` begins anew, e.g. before each
            step for a controller that needs its linear system.
        of, project
            As for `simulate`.
        max_halvings, **options
            As for `simulate`.

        Returns
        -------
        Simulator

        Raises
        ------
        RunError, InconsistentStartError, StepError
            As for `simulate`.
        """
        chosen = RunOptions.of({"max_halvings": max_halvings, **options})
        wanted = check_derivatives(self, derivatives, of, chosen, False)
        if derivatives == "adjoint":
            raise RunError(
                'derivatives = "adjoint": a run that goes on has no end; choose "forward"'
            )
        return start_simulator(
            self.differentiable() if wanted else self.fitting(chosen),
            of=wanted,
            project=bool(project),
            dt=dt,
            q0=q0,
            v0=v0,
            t0=t0,
            parameters=parameters,
            record=record,
            options=chosen,
        )

    def controller(
        self,
        source: str | os.PathLike[str],
        function: str = "control",
        memory: Sequence[float] = (0.0,),
    ) -> Controller:
        """A controller in C that gives the inputs of a run at full speed.

        Parameters
        ----------
        source : path
            A C file with ``void control(double t, const double q[], const double v[], double u[],
            double memory[])``, which needs only libm; ``real`` of the stepper for ``double``.
        function : str
            Name of the function.
        memory : sequence of float
            Numbers of its own: gains, integrals. Every run begins with these.

        Returns
        -------
        Controller
            For ``simulate(inputs=...)``; asked before every step, as a function in Python is.

        Raises
        ------
        RunError
            If the file or the function is not there, or the model has no inputs.
        CompilerError
            If it does not compile.
        """
        return Controller(self, source, function, memory)

    @_named
    def linearise(
        self,
        *,
        dt: float,
        period: float | None = None,
        q0: Any = None,
        v0: Any = None,
        t0: float | None = None,
        parameters: Mapping[str, float] | None = None,
        u: Any = None,
        shift: Any = None,
        tol: float = 1e-6,
        events: str = "located",
        **options: Any,
    ) -> Linearisation:
        """The linear system about an equilibrium, also in contact, or about a periodic motion.

        Parameters
        ----------
        dt : float
            Step size [s]. About an equilibrium the linear system is that of one step.
        period : float, optional
            Of a periodic motion [s].
        q0, v0, t0, parameters
            The equilibrium, or a place on the motion at which nothing happens, as for `simulate`.
        u : array, shape (n_u,)
            Inputs, held; zero by default.
        shift : array, shape (n_q,), optional
            By what the coordinates have grown when the motion has come back to where it began,
            e.g. a walker's way.
        tol : float
            How far the state may be from where it began, relative to its size.
        events, **options
            As for `simulate`, but located by default.

        Returns
        -------
        Linearisation
            A, B, C, D, the deviations that are possible, multipliers and rates.

        Raises
        ------
        RunError
            If the start is no equilibrium or on no motion of that period, or if the motion has no
            derivative.
        """
        par = self.check_parameters(parameters)
        t, q, v = self.start_of(q0, v0, t0, par)
        step = number("dt", dt)
        time = step if period is None else number("period", period)
        if not 0 < step <= time:
            raise RunError(f"dt = {step:g}: give a step size > 0, at most the period")
        n_steps = int(np.ceil(time / step - 1e-9))
        chosen = RunOptions.of({"events": events, **options})
        return linearise(
            self.differentiable(), (t, q, v), h=time / n_steps, n_steps=n_steps, parameters=par,
            u=self.rows("u", u, 1, self.sizes["n_u"])[0], shift=shift, tol=tol, options=chosen,
        )  # fmt: skip

    def __reduce__(self) -> tuple[Any, ...]:
        return load, (str(self.folder),)

    @_named
    def simulate_batch(
        self,
        *,
        t_end: float,
        dt: float,
        q0: Any = None,
        v0: Any = None,
        t0: Any = None,
        parameters: Mapping[str, Any] | None = None,
        inputs: Any = None,
        every: int = 1,
        threads: int | None = None,
        max_halvings: int = DEFAULTS.max_halvings,
        derivatives: str | None = None,
        of: Sequence[str] = ("q0", "v0", "parameters"),
        project: bool = False,
        progress: Callable[[int, int], None] | None = None,
        **options: Any,
    ) -> Batch:
        """Many runs at once, on threads in C, each bit for bit as `simulate` would run it.

        Parameters
        ----------
        t_end, dt : float
            As for `simulate`; with different starts each run takes as many steps as the first.
        q0, v0 : array, shape (n_q,) or (n, n_q), or mapping from name to a number or n numbers
            Initial states; what is not given comes from the model file.
        t0 : float or array, shape (n,)
            Initial times.
        parameters : mapping from name to a number or an array, shape (n,)
            Values that differ from the defaults.
        inputs : None, array of shape (n_steps, n_u) for all or (n, n_steps, n_u)
            Held over each step.
        every : int
            Record a row for every `every` steps, as for `simulate`.
        threads : int
            By default as many as there are processors.
        derivatives, of, project
            As for `simulate`: ``batch.dq["v0"]`` of shape (n, n_t, n_q, n_q), ... or
            ``batch.gradient(q_bar, v_bar)``, and ``batch.differentiable``, run by run.
        progress : callable (done, total)
            Called between blocks of runs.
        **options
            ``tol``, ``r``, ``active_set``, ``scaling``, ``max_iterations``, ``events``,
            ``max_events``, ``error``, ``scale`` as for `simulate`; rows are those of the grid.

        Returns
        -------
        Batch
            Arrays of shape (n, n_t, ...). A run that fails or cannot start ends alone; its status
            says why.

        Raises
        ------
        RunError
            For arguments that cannot be used, or that are for different numbers of runs.
        """
        if t0 is None:
            # a start time that depends on parameters: that of the first run
            some = {
                k: float(np.ravel(reals(k, x))[0])
                for k, x in (parameters or {}).items()
                if np.size(x)
            }
            first = self.initial_state(self.check_parameters(some))[0]
        else:
            first = float(np.ravel(reals("t0", t0))[0])
        h, n_steps = grid(first, number("t_end", t_end), number("dt", dt))
        chosen = RunOptions.of({"max_halvings": max_halvings, **options}, chosen=True)
        wanted = check_derivatives(self, derivatives, of, chosen, callable(inputs))
        if chosen.error is not None:
            check_chosen("", False, wanted, False)
        stepper = self.differentiable() if wanted else self.fitting(chosen)
        batch = run_batch(
            stepper,
            h=h,
            n_steps=n_steps,
            every=_interval(every, n_steps),
            t0=t0,
            q0=q0,
            v0=v0,
            parameters=parameters,
            inputs=inputs,
            options=chosen,
            threads=threads,
            progress=progress,
        )
        if not wanted:
            return batch
        taken = Taken(
            stepper, chosen, batch.t[:, 0], batch.q[:, 0], batch.v[:, 0],
            np.column_stack([*batch.parameters.values()] or [np.zeros(len(batch))]), batch.u, h,
            n_steps, batch.steps, batch.every, number_of_threads(threads), bool(project),
        )  # fmt: skip
        return differentiate_batch(batch, taken, wanted if derivatives == "forward" else None)

    @_named
    def step(
        self,
        t: float,
        q: Any,
        v: Any,
        dt: float,
        *,
        u: Any = None,
        parameters: Mapping[str, float] | None = None,
        **options: Any,
    ) -> Trajectory:
        """One step of size `dt` from (t, q, v), without a guess from an earlier step.

        Parameters
        ----------
        t, q, v : state at the start of the step
        dt : float
            Step size.
        u : array, shape (n_u,)
            Inputs.
        parameters : mapping
            Values that differ from the defaults.
        **options
            ``tol``, ``r``, ``active_set``, ``scaling``, ``max_halvings``, ``max_iterations`` as for
            `simulate`.

        Returns
        -------
        Trajectory
            Of two rows, with the stages.

        Raises
        ------
        RunError
            For a step size or arrays that do not fit.
        StepError
            If the step has no solution, or it is not found.
        """
        par = self.check_parameters(parameters)
        inputs = self.rows("u", u, 1, self.sizes["n_u"])
        q = self.vector("q", q, None, "coordinates")
        v = self.vector("v", v, None, "velocities")
        h = number("dt", dt)
        if h <= 0:
            raise RunError(f"dt = {h:g}: give a step size > 0")
        chosen = RunOptions.of(options)
        run = Run(self.fitting(chosen), par, chosen, number("t", t), q, v, h, 1, 1, True)
        return run.go(inputs, None, None)


def _interval(every: Any, n_steps: int) -> int:
    """Every how many steps a row is recorded."""
    if not isinstance(every, (int, np.integer)) or isinstance(every, bool) or every < 1:
        raise RunError(f"every = {every!r}: give an integer of at least 1")
    return min(int(every), n_steps + 1)
