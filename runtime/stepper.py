"""A loaded stepper: steps, whole runs, model functions, residuals."""

import ctypes
import math
import time
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from signorini.runtime.consistency import project, report
from signorini.runtime.errors import InconsistentStartError, RunError, StepError
from signorini.runtime.library import Library
from signorini.runtime.trajectory import Trajectory

_ACTIVE_SETS = {"any_stage": 0, "end": 1}
_SCALINGS = {"rows": 0, "none": 1}
_SUCCESS = 2  # largest status of a solved step
_CHUNK = 4096  # steps between two calls of a progress function
Inputs = Callable[[float, np.ndarray, np.ndarray], Any]


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
        for name, value in (values or {}).items():
            if name not in table:
                raise RunError(
                    f"model '{self.name}' has no parameter '{name}'; it has: {', '.join(table)}"
                )
            number = _number(f"parameter '{name}'", value)
            low, top = table[name]["min"], table[name]["max"]
            if (low is not None and number < low) or (top is not None and number > top):
                raise RunError(
                    f"parameter '{name}' = {number:g} is outside its bounds "
                    f"[{'-inf' if low is None else low}, {'inf' if top is None else top}]"
                )
            full[name] = number
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
        start = self.initial_state(par)
        t = start[0] if t0 is None else _number("t0", t0)
        q = self._vector("q0", q0, start[1], "coordinates")
        v = self._vector("v0", v0, start[2], "velocities")
        return project(self, t, q, v, par)

    # --- model functions -------------------------------------------------------------------------

    @property
    def functions(self) -> list[str]:
        """Names of the model functions that `evaluate` knows."""
        return sorted(self.manifest["functions"])

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
        many = np.ndim(q) == 2
        rows = len(q) if many else 1
        empty = {
            "g": "n_g", "g_dot": "n_g", "gamma": "n_gamma", "g_N": "n_N", "g_N_dot": "n_N",
            "gamma_F": "n_F", "outputs": "n_outputs",
        }  # fmt: skip
        if name not in self.manifest["functions"]:
            if name in empty and n[empty[name]] == 0:
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
        times = np.broadcast_to(np.asarray(t, dtype=float), (rows,))
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
        x_array = lib.array(_shaped("x", x, (n["n_x_total"],)))
        lam_array = lib.array(_shaped("lam", lam, (n["n_lambda_total"],)))
        u_array = self._rows("u", u, 1, n["n_u"])[0]
        status = lib.call["problem"](
            state,
            work,
            self._params(par),
            self._options(**options),
            lib.pointer(u_array),
            _number("h", h),
            names.index(name),
            lib.pointer(x_array),
            lib.pointer(lam_array),
        )
        if status > _SUCCESS:
            raise RunError(f"problem '{name}': {lib.status_texts[status]}")
        p = self.manifest["problems"][names.index(name)]
        n_x, n_lam = p["n_x"], p["n_slots"] * n["n_R"]

        def take(field: str, *shape: int) -> np.ndarray:
            count = math.prod(shape)
            return np.array(getattr(work, field)[:count], dtype=float).reshape(shape)

        return {
            "r": take("r", n_x),
            "y": take("y", n_lam),
            "phi": take("phi", n_lam),
            "prox_r": take("prox_r", n_lam),
            "A": take("A", n_x, n_x),
            "B": take("B", n_lam, n_x).T,
            "C": take("C", n_lam, n_x),
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
            "stages" keeps t, q, v and percussions of every stage too.
        every : int
            Record every `every`-th step.
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
        start = self.initial_state(par)
        t = start[0] if t0 is None else _number("t0", t0)
        q = self._vector("q0", q0, start[1], "coordinates")
        v = self._vector("v0", v0, start[2], "velocities")
        h, n_steps = _grid(t, _number("t_end", t_end), _number("dt", dt))
        if record not in ("steps", "stages"):
            raise RunError(f'record = {record!r}: choose "steps" or "stages"')
        if not isinstance(every, (int, np.integer)) or isinstance(every, bool) or every < 1:
            raise RunError(f"every = {every!r}: give an integer of at least 1")
        u, asked = self._inputs(inputs, n_steps)
        run = _Run(self, par, options, t, q, v, h, n_steps, int(every), record == "stages")
        return run.go(u, asked, progress)

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
        h = _number("dt", dt)
        if h <= 0:
            raise RunError(f"dt = {h:g}: give a step size > 0")
        chosen = {"max_halvings": 4, **options}
        run = _Run(self, par, chosen, _number("t", t), q, v, h, 1, 1, True)
        return run.go(inputs, None, None)

    # --- conversions -----------------------------------------------------------------------------

    def _params(self, values: Mapping[str, float]) -> Any:
        params = self._library.structs["params"]()
        for name, value in values.items():
            setattr(params, name, value)
        return params

    def _options(
        self,
        tol: float | None = None,
        r: float | None = None,
        active_set: str = "any_stage",
        scaling: str = "rows",
        max_halvings: int = 0,
        max_iterations: int | None = None,
    ) -> Any:
        options = self._library.call["default_options"]()
        if active_set not in _ACTIVE_SETS:
            raise RunError(f'active_set = {active_set!r}: choose "any_stage" or "end"')
        if scaling not in _SCALINGS:
            raise RunError(f'scaling = {scaling!r}: choose "rows" or "none"')
        options.active_set = _ACTIVE_SETS[active_set]
        options.scaling = _SCALINGS[scaling]
        if tol is not None:
            options.tol = _number("tol", tol)
            if options.tol < 0 or (options.tol == 0 and scaling == "none"):
                raise RunError(f"tol = {tol!r}: give a tolerance >= 0, > 0 with scaling='none'")
        if r is not None:
            options.r = _number("r", r)
            if options.r <= 0:
                raise RunError(f"r = {r!r}: give a prox parameter > 0, or none")
        for name, value, low, top in (
            ("max_halvings", max_halvings, 0, 10),
            ("max_iterations", max_iterations, 1, 1_000_000),
        ):
            if value is None:
                continue
            if not isinstance(value, (int, np.integer)) or not low <= value <= top:
                raise RunError(f"{name} = {value!r}: give an integer from {low} to {top}")
            setattr(options, name, int(value))
        return options

    def _state(self, t: float, q: np.ndarray, v: np.ndarray) -> Any:
        lib = self._library
        state = lib.structs["state"]()
        q_array, v_array = lib.array(q), lib.array(v)
        status = lib.call["set_state"](state, t, lib.pointer(q_array), lib.pointer(v_array))
        if status > _SUCCESS:
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
                    values[coordinates.index(name)] = _number(f"{what} of '{name}'", value)
                elif name in names:
                    values[names.index(name)] = _number(f"{what} of '{name}'", value)
                else:
                    raise RunError(
                        f"{what}: there is no coordinate '{name}'; there are: "
                        f"{', '.join(coordinates)}"
                    )
            return values
        return _shaped(what, given, (len(names),))

    def _rows(self, what: str, values: Any, rows: int, columns: int) -> np.ndarray:
        if values is None:
            return self._library.array(np.zeros((rows, columns)))
        array = np.asarray(values, dtype=float)
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
        u = np.asarray(inputs, dtype=float)
        if u.ndim < 2 and u.size == n_u:
            u = np.broadcast_to(u.reshape(1, n_u), (n_steps, n_u))
        if u.shape != (n_steps, n_u):
            raise RunError(
                f"inputs have shape {u.shape}: give ({n_steps}, {n_u}), one row for each step"
            )
        if not np.all(np.isfinite(u)):
            k = int(np.argwhere(~np.isfinite(u))[0][0])
            raise RunError(f"inputs of step {k} are not finite: {u[k]}")
        return u, None


class _Run:
    """One run: buffers, the loop over chunks of steps, the trajectory at the end."""

    def __init__(
        self,
        stepper: Stepper,
        par: dict[str, float],
        options: dict[str, Any],
        t: float,
        q: np.ndarray,
        v: np.ndarray,
        h: float,
        n_steps: int,
        every: int,
        stages: bool,
    ) -> None:
        lib = stepper._library
        self.stepper, self.lib = stepper, lib
        self.par, self.option_values = par, options
        self.h, self.n_steps, self.every = h, n_steps, every
        self.params = stepper._params(par)
        self.options = stepper._options(**options)
        self.state = lib.structs["state"]()
        self.work = lib.structs["work"]()
        self.info = lib.structs["info"]()
        n, s = stepper.sizes, stepper.stages
        rows = n_steps // every
        self.rows = rows
        self.buffers = {
            "t": lib.array(np.zeros(rows + 1)),
            "q": lib.array(np.zeros((rows + 1, n["n_q"]))),
            "v": lib.array(np.zeros((rows + 1, n["n_q"]))),
            "P": lib.array(np.zeros((rows + 1, n["n_R"]))),
            "residual": lib.array(np.zeros(rows + 1)),
            "smallest_gap": lib.array(np.full(rows + 1, np.inf)),
            "counts": np.zeros((rows + 1, 6), dtype=np.intc),
        }
        self.nothing = lib.array(np.zeros(1))
        if stages:
            self.buffers |= {
                "stage_t": lib.array(np.zeros((rows, s))),
                "stage_q": lib.array(np.zeros((rows, s, n["n_q"]))),
                "stage_v": lib.array(np.zeros((rows, s, n["n_q"]))),
                "stage_R": lib.array(np.zeros((rows, s, n["n_R"]))),
            }
        q_array, v_array = lib.array(q), lib.array(v)
        status = lib.call["init"](
            self.state, self.params, self.options, t, lib.pointer(q_array), lib.pointer(v_array)
        )
        name = lib.statuses[status]
        if name == "INCONSISTENT_START":
            raise InconsistentStartError(report(stepper, t, q, v, par))
        if status > _SUCCESS:
            raise RunError(
                f"model '{stepper.name}' cannot start at t = {t:g}, q = {q.tolist()}, "
                f"v = {v.tolist()}: {lib.status_texts[status]}"
            )
        self.buffers["t"][0] = t
        self.buffers["q"][0] = q
        self.buffers["v"][0] = v

    def go(
        self,
        u: np.ndarray,
        asked: Inputs | None,
        progress: Callable[[int, int], None] | None,
    ) -> Trajectory:
        used = self.lib.array(u)
        begin = time.perf_counter()
        done = 0
        status = 0
        try:
            while done < self.n_steps and status <= _SUCCESS:
                count = 1 if asked else min(_CHUNK, self.n_steps - done)
                # A chunk ends on a recorded row, so that rows are counted from its start.
                if not asked and count < self.n_steps - done:
                    count = max(self.every, count - count % self.every)
                if asked:
                    used[done] = self._ask(asked)
                status, taken = self._chunk(used, done, count)
                done += taken
                if progress is not None:
                    progress(done, self.n_steps)
        except KeyboardInterrupt as error:
            error.trajectory = self._trajectory(done, used, begin)  # type: ignore[attr-defined]
            raise
        trajectory = self._trajectory(done, used, begin)
        if status > _SUCCESS:
            t = float(self.state.t)
            name = self.lib.statuses[status]
            raise StepError(
                f"model '{self.stepper.name}', step {done + 1} of {self.n_steps} at t = {t:g}: "
                f"{name}, {self.lib.status_texts[status]}. The steps before are in the "
                "error's attribute 'trajectory'",
                name,
                trajectory,
            )
        return trajectory

    def _ask(self, asked: Inputs) -> np.ndarray:
        q, v = np.array(self.state.q, dtype=float), np.array(self.state.v, dtype=float)
        n_u = self.stepper.sizes["n_u"]
        u = np.asarray(asked(float(self.state.t), q, v), dtype=float).reshape(-1)
        if u.shape != (n_u,) or not np.all(np.isfinite(u)):
            raise RunError(
                f"inputs(t, q, v) returned {u.tolist()} at t = {float(self.state.t):g}: "
                f"return {n_u} finite numbers"
            )
        return u

    def _chunk(self, u: np.ndarray, done: int, count: int) -> tuple[int, int]:
        lib = self.lib
        record = lib.structs["record"]()
        # With feedback one step at a time is taken; it is recorded if its turn has come.
        every = 1 if count < self.every else self.every
        wanted = count >= self.every or (done + count) % self.every == 0
        if wanted:
            row = (done + count) // self.every if count < self.every else done // self.every + 1
            for name, buffer in self.buffers.items():
                first = row - 1 if name.startswith("stage_") else row
                if first < len(buffer):
                    kind = ctypes.c_int if name == "counts" else lib.real
                    # An empty array has no address to rely on; nothing is written through it.
                    rows = buffer[first:] if buffer.size else self.nothing
                    setattr(record, name, rows.ctypes.data_as(ctypes.POINTER(kind)))
        taken = ctypes.c_int(0)
        status = lib.call["simulate"](
            self.state,
            self.work,
            self.info,
            self.params,
            self.options,
            lib.pointer(u[done:]) if u.size else None,
            self.h,
            count,
            every,
            record if wanted else None,
            taken,
        )
        return status, taken.value

    def _trajectory(self, done: int, u: np.ndarray, begin: float) -> Trajectory:
        rows = done // self.every
        names = {"stage_t": "t_stage", "stage_q": "Q", "stage_v": "V", "stage_R": "R"}
        arrays = {}
        for name, buffer in self.buffers.items():
            kept = buffer[: rows if name in names else rows + 1]
            arrays[names.get(name, name)] = kept if name == "counts" else kept.astype(float)
        # Inputs of row k: those held from t[k] on; the last row repeats the last step's.
        if self.n_steps and u.size:
            index = np.minimum(np.arange(rows + 1) * self.every, max(done - 1, 0))
            arrays["u"] = u[index].astype(float)
        else:
            arrays["u"] = np.zeros((rows + 1, self.stepper.sizes["n_u"]))
        return Trajectory(
            self.stepper,
            arrays,
            parameters=self.par,
            options={k: v for k, v in self.option_values.items() if v is not None},
            seconds=time.perf_counter() - begin,
        )


def _number(what: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise RunError(f"{what} = {value!r}: give a number") from None
    if not math.isfinite(number):
        raise RunError(f"{what} = {number}: give a finite number")
    return number


def _shaped(what: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise RunError(f"{what} = {value!r}: give {shape[0]} numbers") from None
    if array.shape != shape:
        raise RunError(f"{what} has shape {array.shape}: give {shape[0]} numbers")
    if not np.all(np.isfinite(array)):
        k = int(np.flatnonzero(~np.isfinite(array))[0])
        raise RunError(f"{what}[{k}] is {array[k]}: give finite numbers")
    return array


def _grid(t0: float, t_end: float, dt: float) -> tuple[float, int]:
    """Step size and number of steps of the grid t_k = t_0 + k dt."""
    if dt <= 0:
        raise RunError(f"dt = {dt:g}: give a step size > 0")
    if t_end < t0:
        raise RunError(f"t_end = {t_end:g} lies before the start t0 = {t0:g}")
    exact = (t_end - t0) / dt
    if exact > 2**31 - 2:
        raise RunError(f"dt = {dt:g} makes {exact:.3g} steps: at most {2**31 - 2} are possible")
    nearest = round(exact)
    if abs(exact - nearest) <= 1e-9 * max(nearest, 1):
        return dt, nearest
    n = math.floor(exact)
    warnings.warn(
        f"dt = {dt:g} does not divide the time from {t0:g} to {t_end:g}: the last of {n} steps "
        f"ends at {t0 + n * dt:g}",
        stacklevel=3,
    )
    return dt, n
