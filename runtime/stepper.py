"""A loaded stepper: steps, whole runs, model functions, residuals."""

import math
import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from signorini.runtime.arguments import as_path, grid, number, reals, shaped
from signorini.runtime.batch import Batch, run_batch
from signorini.runtime.consistency import project
from signorini.runtime.errors import RunError
from signorini.runtime.library import Library
from signorini.runtime.run import SUCCESS, Inputs, Run
from signorini.runtime.simulator import Simulator
from signorini.runtime.simulator import start as start_simulator
from signorini.runtime.trajectory import Trajectory

_ACTIVE_SETS = {"any_stage": 0, "end": 1}
_SCALINGS = {"rows": 0, "none": 1}
_LARGEST_TOL = 2.0**-10  # as runtime/c has it: a step solved less exactly is none


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


class Stepper:
    """A compiled stepper of one model.

    Made by `signorini.build` or `signorini.load`. Every model function is available through
    `evaluate`, every residual with its Jacobian through `problem`.

    Attributes
    ----------
    name : str
        Name of the model.
    stages : int
        Number of stages s.
    sizes : dict
        ``n_q``, ``n_u``, ``n_g``, ``n_gamma``, ``n_N``, ``n_F``, ...
    manifest : dict
        What the generated folder says of itself.
    """

    def __init__(self, library: Library) -> None:
        self._library = library
        self.manifest = library.manifest
        self.name: str = library.manifest["model"]
        self.stages: int = library.manifest["stages"]
        self.sizes = library.sizes
        self.folder = library.folder

    def __repr__(self) -> str:
        return f"Stepper('{self.name}', {self.manifest['scheme']}, s = {self.stages})"

    # --- parameters, state -----------------------------------------------------------------------

    @property
    def parameters(self) -> dict[str, float]:
        """The default parameters by name."""
        return {p["name"]: p["default"] for p in self.manifest["parameters"]}

    def check_parameters(self, values: Mapping[str, float] | None) -> dict[str, float]:
        """Complete parameter values with the defaults.

        Raises
        ------
        RunError
            For an unknown name, a value that is no finite number, or one outside its bounds.
        """
        full = self.parameters
        table = {p["name"]: p for p in self.manifest["parameters"]}
        if values is not None and not isinstance(values, Mapping):
            raise RunError(f"parameters = {values!r}: give a mapping from name to value")
        for name, value in (values or {}).items():
            if name not in table:
                raise RunError(
                    f"model '{self.name}' has no parameter '{name}'; it has: {', '.join(table)}"
                )
            given = number(f"parameter '{name}'", value)
            low, top = table[name]["min"], table[name]["max"]
            if (low is not None and given < low) or (top is not None and given > top):
                raise RunError(
                    f"parameter '{name}' = {given:g} is outside its bounds "
                    f"[{'-inf' if low is None else low}, {'inf' if top is None else top}]"
                )
            full[name] = given
        return full

    def initial_state(
        self, parameters: Mapping[str, float] | None = None
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Return (t, q, v) that the model file gives."""
        lib = self._library
        n = self.sizes["n_q"]
        t, q, v = lib.array(np.zeros(1)), lib.array(np.zeros(n)), lib.array(np.zeros(n))
        params = self._params(self.check_parameters(parameters))
        lib.call["initial_state"](params, lib.pointer(t), lib.pointer(q), lib.pointer(v))
        return float(t[0]), q.astype(float), v.astype(float)

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

    def start_of(
        self, q0: Any, v0: Any, t0: float | None, parameters: Mapping[str, float]
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Return (t, q, v) of a start; what is not given comes from the model file.

        Raises
        ------
        RunError
            For arguments that cannot be used.
        """
        start = self.initial_state(parameters)
        t = start[0] if t0 is None else number("t0", t0)
        q = self._vector("q0", q0, start[1], "coordinates")
        return t, q, self._vector("v0", v0, start[2], "velocities")

    # --- model functions -------------------------------------------------------------------------

    @property
    def functions(self) -> list[str]:
        """Names of the model functions that `evaluate` knows."""
        return sorted((*self.manifest["functions"], *self.manifest["zeros"]))

    def evaluate(
        self,
        name: str,
        t: Any,
        q: Any,
        v: Any = None,
        u: Any = None,
        parameters: Mapping[str, float] | None = None,
        R: Any = None,
    ) -> np.ndarray:
        """Evaluate a model function through the compiled C.

        Parameters
        ----------
        name : str
            E.g. ``"g_N"``, ``"W_F"``, ``"p_v"``, ``"energy"``; see `functions`. A function
            without entries (no constraints, say) gives an empty array.
        t : float or ndarray, shape (m,)
            Time or times.
        q, v : ndarray, shape (n_q,) or (m, n_q)
            Coordinates and velocities; v is zero by default.
        u : ndarray, shape (n_u,) or (m, n_u)
            Inputs; zero by default.
        parameters : mapping
            Values that differ from the defaults.
        R : ndarray, shape (n_R,)
            Percussions for ``WR`` and ``WR_q``.

        Returns
        -------
        ndarray, shape of the function, with a leading m if `q` has two dimensions
        """
        lib, n = self._library, self.sizes
        q = reals("q", q)
        many = q.ndim == 2
        rows = len(q) if many else 1
        empty = {
            "g": "n_g", "g_dot": "n_g", "gamma": "n_gamma", "g_N": "n_N", "g_N_dot": "n_N",
            "gamma_F": "n_F", "outputs": "n_outputs",
        }  # fmt: skip
        zeros = self.manifest["zeros"]
        if isinstance(name, str) and name in zeros:
            shape = tuple(zeros[name])
            return np.zeros((rows, *shape) if many else shape)
        if not isinstance(name, str) or name not in self.manifest["functions"]:
            if isinstance(name, str) and name in empty and n[empty[name]] == 0:
                return np.zeros((rows, 0) if many else (0,))
            raise RunError(
                f"model '{self.name}' has no function '{name}'; it has: {', '.join(self.functions)}"
            )
        function = self.manifest["functions"][name]
        shape = tuple(function["shape"])
        columns = {
            "q": self._rows("q", q, rows, n["n_q"]),
            "v": self._rows("v", v, rows, n["n_q"]),
            "u": self._rows("u", u, rows, n["n_u"]),
            "R": self._rows("R", R, rows, n["n_R"]),
        }
        times = reals("t", t)
        if times.size not in (1, rows) or times.ndim > 1:
            raise RunError(f"t has shape {times.shape}: give one time, or one for each row of q")
        times = np.broadcast_to(times.reshape(-1), (rows,))
        params = self._params(self.check_parameters(parameters))
        out = lib.array(np.zeros((rows, *shape)))
        call = lib.call[name]
        for k in range(rows):
            arguments = [
                float(times[k])
                if a == "t"
                else params
                if a == "par"
                else lib.pointer(columns[a][k])
                for a in function["arguments"]
            ]
            call(*arguments, lib.pointer(out[k]))
        result = out.astype(float)
        if name in ("L", "energy"):
            result = result[:, 0]
        return result if many else result[0]

    def problem(
        self,
        name: str,
        x: Any,
        lam: Any,
        h: float,
        *,
        t: float | None = None,
        q: Any = None,
        v: Any = None,
        u: Any = None,
        parameters: Mapping[str, float] | None = None,
        **options: Any,
    ) -> dict[str, np.ndarray]:
        """Residual and Jacobian of one nonlinear problem of the scheme.

        Parameters
        ----------
        name : {"position", "velocity"}
            The problem.
        x : ndarray
            Unknown velocities of all problems: V^1 ... V^s, v_{n+1}.
        lam : ndarray
            Unknown percussions of all problems: R^1 ... R^{s-1}, Delta P; each R in the order
            g, gamma, N, F.
        h : float
            Step size.
        t, q, v : state at the start of the step; the model's initial state by default
        u : inputs

        Returns
        -------
        dict
            ``r`` smooth rows, ``y`` kinematic rows, ``phi`` residual of the percussion rows with
            the prox parameter ``prox_r``, ``A = dr/dx``, ``B = dr/dlam``, ``C = dy/dx``.
        """
        lib, n = self._library, self.sizes
        names = [p["name"] for p in self.manifest["problems"]]
        if name not in names:
            raise RunError(f"there is no problem '{name}'; there are: {', '.join(names)}")
        par = self.check_parameters(parameters)
        start = self.initial_state(par)
        state = self._state(
            start[0] if t is None else t,
            self._vector("q", q, start[1], "coordinates"),
            self._vector("v", v, start[2], "velocities"),
        )
        work = lib.structs["work"]()
        x_array = lib.array(shaped("x", x, (n["n_x_total"],)))
        lam_array = lib.array(shaped("lam", lam, (n["n_lambda_total"],)))
        u_array = self._rows("u", u, 1, n["n_u"])[0]
        status = lib.call["problem"](
            state,
            work,
            self._params(par),
            self._options(**options),
            lib.pointer(u_array),
            number("h", h),
            names.index(name),
            lib.pointer(x_array),
            lib.pointer(lam_array),
        )
        if status > SUCCESS:
            raise RunError(f"problem '{name}': {lib.status_texts[status]}")
        p = self.manifest["problems"][names.index(name)]
        n_x, n_lam, tables = p["n_x"], p["n_slots"] * n["n_R"], p["tables"]

        def take(field: str, *shape: int) -> np.ndarray:
            count = math.prod(shape)
            return np.array(getattr(work, field)[:count], dtype=float).reshape(shape)

        return {
            "r": take("r", n_x),
            "y": take("y", n_lam),
            "phi": take("phi", n_lam),
            "prox_r": take("prox_r", n_lam),
            "A": _matrix(work.K, tables, "K_start", "K_column", True, (n_x, n_x)),
            "B": _matrix(work.B, tables, "B_start", "B_row", False, (n_lam, n_x)).T,
            "C": _matrix(work.C, tables, "C_start", "C_column", False, (n_lam, n_x)),
        }

    # --- runs ------------------------------------------------------------------------------------

    def simulate(
        self,
        *,
        t_end: float,
        dt: float,
        q0: Any = None,
        v0: Any = None,
        t0: float | None = None,
        parameters: Mapping[str, float] | None = None,
        inputs: Any = None,
        tol: float | None = None,
        r: float | None = None,
        active_set: str = "any_stage",
        record: str = "steps",
        every: int = 1,
        scaling: str = "rows",
        max_halvings: int = 4,
        max_iterations: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> Trajectory:
        """Run from the initial state to `t_end` in steps of `dt`.

        Parameters
        ----------
        t_end, dt : float
            End and step size [s]. If dt does not divide the time to within 1e-9 of a step, the
            last step ends before `t_end` and a warning says so.
        q0, v0 : array, shape (n_q,), or mapping from name to value
            Initial state; what is not given comes from the model file.
        t0 : float
            Initial time.
        parameters : mapping
            Values that differ from the defaults.
        inputs : None, array of shape (n_steps, n_u), or callable (t, q, v) -> u
            Held over each step; a callable is asked before each step.
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
        options = {
            "tol": tol,
            "r": r,
            "active_set": active_set,
            "scaling": scaling,
            "max_halvings": max_halvings,
            "max_iterations": max_iterations,
        }
        t, q, v = self.start_of(q0, v0, t0, par)
        h, n_steps = grid(t, number("t_end", t_end), number("dt", dt))
        if record not in ("steps", "stages"):
            raise RunError(f'record = {record!r}: choose "steps" or "stages"')
        every = _interval(every, n_steps)
        if progress is not None and not callable(progress):
            raise RunError(f"progress = {progress!r}: give a function of (done, total)")
        u, asked = self._inputs(inputs, n_steps)
        run = Run(self, par, options, t, q, v, h, n_steps, every, record == "stages")
        return run.go(u, asked, progress)

    def start(
        self,
        *,
        dt: float,
        q0: Any = None,
        v0: Any = None,
        t0: float | None = None,
        parameters: Mapping[str, float] | None = None,
        record: bool = False,
        max_halvings: int = 4,
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
        return start_simulator(
            self,
            dt=dt,
            q0=q0,
            v0=v0,
            t0=t0,
            parameters=parameters,
            record=record,
            options={"max_halvings": max_halvings, **options},
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return load, (str(self.folder),)

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
        max_halvings: int = 4,
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
        progress : callable (done, total)
            Called between blocks of runs.
        **options
            ``tol``, ``r``, ``active_set``, ``scaling``, ``max_iterations`` as for `simulate`.

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
        return run_batch(
            self,
            h=h,
            n_steps=n_steps,
            every=_interval(every, n_steps),
            t0=t0,
            q0=q0,
            v0=v0,
            parameters=parameters,
            inputs=inputs,
            options={"max_halvings": max_halvings, **options},
            threads=threads,
            progress=progress,
        )

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
        """
        par = self.check_parameters(parameters)
        inputs = self._rows("u", u, 1, self.sizes["n_u"])
        q = self._vector("q", q, None, "coordinates")
        v = self._vector("v", v, None, "velocities")
        h = number("dt", dt)
        if h <= 0:
            raise RunError(f"dt = {h:g}: give a step size > 0")
        chosen = {"max_halvings": 4, **options}
        run = Run(self, par, chosen, number("t", t), q, v, h, 1, 1, True)
        return run.go(inputs, None, None)

    # --- conversions -----------------------------------------------------------------------------

    def _params(self, values: Mapping[str, float]) -> Any:
        params = self._library.structs["params"]()
        for name, value in values.items():
            setattr(params, name, value)
        return params

    def _options(self, **options: Any) -> Any:
        known = ("tol", "r", "active_set", "scaling", "max_halvings", "max_iterations")
        for name in options:
            if name not in known:
                raise RunError(f"there is no option '{name}'; there are: {', '.join(known)}")
        return self._checked_options(**options)

    def _checked_options(
        self,
        tol: float | None = None,
        r: float | None = None,
        active_set: str = "any_stage",
        scaling: str = "rows",
        max_halvings: int = 0,
        max_iterations: int | None = None,
    ) -> Any:
        options = self._library.call["default_options"]()
        if not isinstance(active_set, str) or active_set not in _ACTIVE_SETS:
            raise RunError(f'active_set = {active_set!r}: choose "any_stage" or "end"')
        if not isinstance(scaling, str) or scaling not in _SCALINGS:
            raise RunError(f'scaling = {scaling!r}: choose "rows" or "none"')
        options.active_set = _ACTIVE_SETS[active_set]
        options.scaling = _SCALINGS[scaling]
        if tol is not None:
            options.tol = number("tol", tol)
            least = "0" if scaling == "rows" else "above 0"
            if not 0 <= options.tol <= _LARGEST_TOL or (options.tol == 0 and scaling == "none"):
                raise RunError(f"tol = {tol!r}: give a tolerance from {least} to {_LARGEST_TOL:g}")
        if r is not None:
            options.r = number("r", r)
            if options.r <= 0:
                raise RunError(f"r = {r!r}: give a prox parameter > 0, or none")
        for name, value, low, top in (
            ("max_halvings", max_halvings, 0, 10),
            ("max_iterations", max_iterations, 1, 1_000_000),
        ):
            if value is None:
                continue
            whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
            if not whole or not low <= value <= top:
                raise RunError(f"{name} = {value!r}: give an integer from {low} to {top}")
            setattr(options, name, int(value))
        return options

    def _state(self, t: float, q: np.ndarray, v: np.ndarray) -> Any:
        lib = self._library
        state = lib.structs["state"]()
        q_array, v_array = lib.array(q), lib.array(v)
        status = lib.call["set_state"](state, t, lib.pointer(q_array), lib.pointer(v_array))
        if status > SUCCESS:
            raise RunError(f"the state is not finite: t = {t}, q = {q}, v = {v}")
        return state

    def _vector(self, what: str, given: Any, default: np.ndarray | None, kind: str) -> np.ndarray:
        names = self.manifest[kind]
        if given is None:
            if default is None:
                raise RunError(f"{what} is missing")
            return default
        if isinstance(given, Mapping):
            if default is None:
                raise RunError(f"{what}: give all {len(names)} values")
            values = default.copy()
            coordinates = self.manifest["coordinates"]
            for name, value in given.items():
                if name in coordinates:
                    values[coordinates.index(name)] = number(f"{what} of '{name}'", value)
                elif name in names:
                    values[names.index(name)] = number(f"{what} of '{name}'", value)
                else:
                    raise RunError(
                        f"{what}: there is no coordinate '{name}'; there are: "
                        f"{', '.join(coordinates)}"
                    )
            return values
        return shaped(what, given, (len(names),))

    def _rows(self, what: str, values: Any, rows: int, columns: int) -> np.ndarray:
        if values is None:
            return self._library.array(np.zeros((rows, columns)))
        array = reals(what, values)
        if array.ndim < 2:
            array = np.broadcast_to(array.reshape(1, -1), (rows, array.size))
        if array.shape != (rows, columns):
            raise RunError(f"{what} has shape {np.shape(values)}: give {columns} numbers")
        return self._library.array(array)

    def _inputs(self, inputs: Any, n_steps: int) -> tuple[np.ndarray, Inputs | None]:
        n_u = self.sizes["n_u"]
        zero = np.zeros((n_steps, n_u))
        if inputs is None:
            return zero, None
        if callable(inputs):
            return zero, inputs
        if n_u == 0:
            raise RunError(f"model '{self.name}' has no inputs")
        u = reals("inputs", inputs)
        if u.ndim == 1 and n_u == 1 and u.size == n_steps:
            u = u.reshape(n_steps, 1)
        elif u.ndim < 2 and u.size == n_u:
            u = np.broadcast_to(u.reshape(1, n_u), (n_steps, n_u))
        if u.shape != (n_steps, n_u):
            raise RunError(
                f"inputs have shape {u.shape}: give ({n_steps}, {n_u}), one row for each step"
            )
        if not np.all(np.isfinite(u)):
            k = int(np.argwhere(~np.isfinite(u))[0][0])
            raise RunError(f"inputs of step {k} are not finite: {u[k]}")
        return u, None


def _interval(every: Any, n_steps: int) -> int:
    """Every how many steps a row is recorded."""
    if not isinstance(every, (int, np.integer)) or isinstance(every, bool) or every < 1:
        raise RunError(f"every = {every!r}: give an integer of at least 1")
    return min(int(every), n_steps + 1)


def _matrix(
    values: Any,
    tables: Mapping[str, list[int]],
    start: str,
    index: str,
    reordered: bool,
    shape: tuple[int, int],
) -> np.ndarray:
    """A matrix from its rows with columns in elimination order; `reordered`: the rows too."""
    order, begins, columns = tables["K_order"], tables[start], tables[index]
    full = np.zeros(shape)
    for i in range(shape[0]):
        for k in range(begins[i], begins[i + 1]):
            if columns[k] < shape[1]:
                full[order[i] if reordered else i, order[columns[k]]] = values[k]
    return full
