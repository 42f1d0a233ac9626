"""The compiled functions of one stepper by their names, and what is handed to them."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from signorini.runtime.arguments import number, reals, shaped
from signorini.runtime.errors import RunError
from signorini.runtime.evaluation import Evaluation
from signorini.runtime.library import SUCCESS, Library
from signorini.runtime.options import RunOptions

Inputs = Callable[[float, np.ndarray, np.ndarray], Any]


class Compiled:
    """A compiled model under a scheme, without runs.

    Attributes
    ----------
    library : Library
        The loaded library with the layout of its structs.
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
        self.library = library
        self.manifest = library.manifest
        self.name: str = library.manifest["model"]
        self.stages: int = library.manifest["stages"]
        self.sizes = library.sizes
        self.folder = library.folder

    # --- parameters, state -----------------------------------------------------------------------

    @property
    def parameters(self) -> dict[str, float]:
        """The default parameters by name."""
        return {p["name"]: p["default"] for p in self.manifest["parameters"]}

    @property
    def rigid(self) -> list[bool]:
        """Which rows of g do not yield."""
        yields = self.manifest["compliant"]
        return [name not in yields for name, n in self.manifest["g_blocks"] for _ in range(n)]

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
        lib = self.library
        n = self.sizes["n_q"]
        t, q, v = lib.array(np.zeros(1)), lib.array(np.zeros(n)), lib.array(np.zeros(n))
        params = self.c_params(self.check_parameters(parameters))
        lib.call["initial_state"](params, lib.pointer(t), lib.pointer(q), lib.pointer(v))
        return float(t[0]), q.astype(lib.wide), v.astype(lib.wide)

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
        q = self.vector("q0", q0, start[1], "coordinates")
        return t, q, self.vector("v0", v0, start[2], "velocities")

    # --- model functions -------------------------------------------------------------------------

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts that take their steps one by one: what nothing couples.

        A part is called like its first body, or its first coordinate; a model that is one part like
        the model. `info` of C counts them in this order.
        """
        return tuple(p["name"] for p in self.manifest["parts"] if not p["couples"])

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

        Raises
        ------
        RunError
            For a name that the model does not have, or arrays of other shapes.
        """
        lib, n = self.library, self.sizes
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
            "q": self.rows("q", q, rows, n["n_q"]),
            "v": self.rows("v", v, rows, n["n_q"]),
            "u": self.rows("u", u, rows, n["n_u"]),
            "R": self.rows("R", R, rows, n["n_R"]),
        }
        times = reals("t", t)
        if times.size not in (1, rows) or times.ndim > 1:
            raise RunError(f"t has shape {times.shape}: give one time, or one for each row of q")
        times = np.broadcast_to(times.reshape(-1), (rows,))
        params = self.c_params(self.check_parameters(parameters))
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
        result = out.astype(self.library.wide)
        if name in ("L", "energy"):
            result = result[:, 0]
        return result if many else result[0]

    def problem(
        self,
        name: str,
        x: Any,
        R: Any,
        h: float,
        *,
        t: float | None = None,
        q: Any = None,
        v: Any = None,
        u: Any = None,
        parameters: Mapping[str, float] | None = None,
        known: Mapping[str, np.ndarray] | None = None,
        **options: Any,
    ) -> dict[str, np.ndarray]:
        """Residual and Jacobian of one nonlinear problem of the scheme.

        Parameters
        ----------
        name : {"position", "velocity"}
            The problem; with located events also "segment", "accelerations", "impact".
        x : ndarray
            Unknown velocities of all problems, in their order: V^1 ... V^s, v_{n+1}, ...
        R : ndarray
            Unknown percussions of all problems: R^1 ... R^{s-1}, Delta P, ...; each R in the
            order g, gamma, N, F.
        h : float
            Step size.
        t, q, v : state at the start of the step; the model's initial state by default
        u : inputs
        known : mapping, optional
            ``share`` and ``given`` of a segment's first stage, where steps can be cut at events:
            friction over the normal percussion, and percussions of gamma and F.

        Returns
        -------
        dict
            ``r`` smooth rows, ``y`` kinematic rows, ``phi`` residual of the percussion rows with
            the prox parameter ``prox_r``, ``A = dr/dx``, ``B = dr/dR``, ``C = dy/dx``.

        Raises
        ------
        RunError
            For a name that is no problem of the scheme, or arrays that do not fit.
        """
        n = self.sizes
        names = [p["name"] for p in self.manifest["kinds"][0]["problems"]]
        if name not in names:
            raise RunError(f"there is no problem '{name}'; there are: {', '.join(names)}")
        par = self.check_parameters(parameters)
        start = self.initial_state(par)
        state = self.c_state(
            start[0] if t is None else t,
            self.vector("q", q, start[1], "coordinates"),
            self.vector("v", v, start[2], "velocities"),
        )
        given = (
            shaped("x", x, (n["n_x_total"],)),
            shaped("R", R, (n["n_rows_total"],)),
            self.rows("u", u, 1, n["n_u"])[0],
        )
        at = (state, self.c_params(par), self.c_options(RunOptions.of(options)), number("h", h))
        return Evaluation(self.library).of(names.index(name), given, at, known or {})

    # --- conversions -----------------------------------------------------------------------------

    def c_params(self, values: Mapping[str, float]) -> Any:
        params = self.library.structs["params"]()
        for name, value in values.items():
            setattr(params, name, value)
        return params

    def c_options(self, options: RunOptions) -> Any:
        """Options of the steps as C has them."""
        made = self.library.call["default_options"]()
        options.fill(made)
        return made

    def c_state(self, t: float, q: np.ndarray, v: np.ndarray) -> Any:
        lib = self.library
        state = lib.structs["state"]()
        q_array, v_array = lib.array(q), lib.array(v)
        status = lib.call["set_state"](state, t, lib.pointer(q_array), lib.pointer(v_array))
        if status > SUCCESS:
            raise RunError(f"the state is not finite: t = {t}, q = {q}, v = {v}")
        return state

    def vector(self, what: str, given: Any, default: np.ndarray | None, kind: str) -> np.ndarray:
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

    def rows(self, what: str, values: Any, rows: int, columns: int) -> np.ndarray:
        if values is None:
            return self.library.array(np.zeros((rows, columns)))
        array = reals(what, values)
        if array.ndim < 2:
            array = np.broadcast_to(array.reshape(1, -1), (rows, array.size))
        if array.shape != (rows, columns):
            raise RunError(f"{what} has shape {np.shape(values)}: give {columns} numbers")
        return self.library.array(array)

    def inputs_of(self, inputs: Any, n_steps: int) -> tuple[np.ndarray, Inputs | None]:
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
