"""A run that goes on step by step: for control, games, co-simulation, learning."""

import ctypes
from collections.abc import Mapping
from typing import Any

import numpy as np
from signorini.runtime.arguments import number, reals
from signorini.runtime.changes import Taken, table_of
from signorini.runtime.compiled import Compiled
from signorini.runtime.derivatives import Walk
from signorini.runtime.errors import RunError, StepError
from signorini.runtime.event import Event
from signorini.runtime.export import COUNTS
from signorini.runtime.library import SUCCESS
from signorini.runtime.options import RunOptions
from signorini.runtime.replay import FailedStep, fields_of
from signorini.runtime.run import Run, event_of, events_of_step
from signorini.runtime.trajectory import Trajectory

_KEPT = (
    *("stepper", "parameters", "dt", "steps", "_option_values", "_records", "_start", "_of"),
    "_projects",
)


class Simulator:
    """A model in motion, made by `Stepper.start`.

    `step` goes on from where the last one ended, with its starting guess. A simulator can be
    copied, pickled and set back; each has a state of its own.

    Attributes
    ----------
    stepper : Compiled
        What takes the steps.
    parameters : dict
        All parameter values.
    dt : float
        Step size [s].
    steps : int
        Steps taken since the start.
    """

    def __init__(
        self,
        stepper: Compiled,
        parameters: dict[str, float],
        options: RunOptions,
        start: tuple[float, np.ndarray, np.ndarray],
        dt: float,
        record: bool,
        of: tuple[str, ...] = (),
        project: bool = False,
    ) -> None:
        self.stepper, self.parameters, self.dt = stepper, parameters, dt
        self._option_values, self._records = options, record
        self._of, self._projects = of, project
        self._walk: Walk | None = None
        self._attach()
        self._begin(start)

    def _attach(self) -> None:
        """Structs, and the addresses that every step passes on."""
        stepper, lib = self.stepper, self.stepper.library
        n = stepper.sizes
        self._state, self._info = lib.structs["state"](), lib.structs["info"]()
        self._work = lib.structs["work"]()
        self._params = stepper.c_params(self.parameters)
        self._options = stepper.c_options(self._option_values)
        self._u = lib.array(np.zeros(n["n_u"]))
        self._views = {
            name: lib.view(getattr(struct, name))[:count]
            for struct, name, count in (
                (self._state, "q", n["n_q"]),
                (self._state, "v", n["n_q"]),
                (self._info, "P", n["n_R"]),
            )
        }
        states = np.ctypeslib.as_array(self._info.contact)
        self._views["contact"] = states[: n["n_contacts"]]
        # without declared types: a step costs what C needs and little more
        self._call = lib.dll[f"{lib.prefix}_step"]
        self._call.restype = ctypes.c_int
        at = ctypes.byref
        self._arguments = (
            *(at(self._state), at(self._work), at(self._info), at(self._params), at(self._options)),
            ctypes.c_void_p(self._u.ctypes.data if n["n_u"] else None),
            lib.real(self.dt),
        )
        edges = np.cumsum([0, n["n_g"], n["n_gamma"], n["n_N"], n["n_F"]])
        self._columns = {
            name: slice(int(edges[k]), int(edges[k + 1]))
            for k, name in enumerate(("g", "gamma", "N", "F"))
        }

    def _begin(self, start: tuple[float, np.ndarray, np.ndarray]) -> None:
        # the same look at the start as before a run, which also sets the state
        run = Run(self.stepper, self.parameters, self._option_values, *start, self.dt, 0, 1, False)
        run.look_at_start(np.zeros(self.stepper.sizes["n_u"]))
        ctypes.memmove(ctypes.byref(self._state), ctypes.byref(run.state), ctypes.sizeof(run.state))
        ctypes.memset(ctypes.byref(self._info), 0, ctypes.sizeof(self._info))
        self._views["contact"][:] = -1
        self._P = np.zeros(self.stepper.sizes["n_R"])
        self.steps = 0
        self._rows: list[dict[str, np.ndarray]] = []
        self._events: list[Event] = []
        self._start = start

    # --- going on --------------------------------------------------------------------------------

    def step(self, u: Any = None, n: int = 1) -> None:
        """Take `n` steps with inputs `u` held.

        Parameters
        ----------
        u : array, shape (n_u,), optional
            Inputs; those of the last call by default, zero at first.
        n : int
            Number of steps.

        Raises
        ------
        RunError
            If `u` has another shape or holds what is no number.
        StepError
            If a step cannot be solved; the state is then that after the last step that was.
        """
        if u is not None:
            if type(u) is not np.ndarray or u.dtype != self._u.dtype or u.shape != self._u.shape:
                u = reals("u", u)
                if u.ndim == 0:
                    u = u.reshape(1)
                if u.shape != self._u.shape:
                    names = " ".join(self.stepper.manifest["inputs"])
                    raise RunError(
                        f"u has shape {np.shape(u)}: give {self._u.size} numbers "
                        f"({names or 'the model has no inputs'})"
                    )
            self._u[:] = u
        if self._walk is not None:
            self._step_along(n)
            return
        if n == 1 and not self._records:
            status = self._call(*self._arguments)
            if status > SUCCESS:
                self._fail(status)
            self.steps += 1
            self._P = self._views["P"]
            return
        self._take(n)

    def _take(self, n: int) -> None:
        if not isinstance(n, (int, np.integer)) or isinstance(n, bool) or n < 1:
            raise RunError(f"n = {n!r}: give a number of steps of at least 1")
        total = np.zeros(self.stepper.sizes["n_R"], self.stepper.library.wide)
        for _ in range(int(n)):
            status = self._recorded() if self._records else self._call(*self._arguments)
            if status > SUCCESS:
                self._fail(status)
            self.steps += 1
            total += self._views["P"]
        self._P = total

    # --- derivatives -----------------------------------------------------------------------------

    def begin_derivatives(self) -> None:
        """From now on derivatives are of the present state, as ``of`` says."""
        if not self._of:
            return
        taken = Taken(
            self.stepper, self._option_values, np.array([self.t]), self.q[None], self.v[None],
            table_of(self.stepper, self.parameters), self.u[None, None], self.dt, 1,
            np.array([1]), 1, 1, self._projects,
        )  # fmt: skip
        (seeds,) = taken.seeds(self._of)
        start = self.t, self.q, self.v
        self._walk = Walk(self.stepper, self.parameters, self._option_values, start, seeds)
        size = ctypes.sizeof(self._state)
        ctypes.memmove(ctypes.byref(self._walk.state), ctypes.byref(self._state), size)

    def _step_along(self, n: int) -> None:
        """Steps, and the same steps along the directions."""
        assert self._walk is not None
        for _ in range(int(n)):
            self._take(1)
            self._walk.step(self._u, self.dt)

    @property
    def dq(self) -> dict[str, np.ndarray]:
        """How q has changed with what it began with, by name, shapes (n_q, number)."""
        return self._directions().changes()[0]

    @property
    def dv(self) -> dict[str, np.ndarray]:
        """How v has changed with what it began with, by name, shapes (n_q, number)."""
        return self._directions().changes()[1]

    @property
    def differentiable(self) -> Any:
        """True, or the events since then that have no derivative."""
        return list(self._directions().found) or True

    def _directions(self) -> Walk:
        if self._walk is None:
            raise RunError(
                'nothing is differentiated: call stepper.start(..., derivatives="forward")'
            )
        return self._walk

    # --- records and failures --------------------------------------------------------------------

    def _recorded(self) -> int:
        lib, sizes = self.stepper.library, self.stepper.sizes
        record = lib.structs["record"]()
        row = {
            "t": np.zeros(1, lib.dtype),
            "q": np.zeros((1, sizes["n_q"]), lib.dtype),
            "v": np.zeros((1, sizes["n_q"]), lib.dtype),
            "P": np.zeros((1, sizes["n_R"]), lib.dtype),
            "residual": np.zeros(1, lib.dtype),
            "smallest_gap": np.zeros(1, lib.dtype),
            "counts": np.zeros((1, len(COUNTS)), np.intc),
            "contact": np.zeros((1, sizes["n_contacts"]), np.intc),
        }
        for name, array in row.items():
            kind = ctypes.c_int if array.dtype == np.intc else lib.real
            if array.size:
                setattr(record, name, array.ctypes.data_as(ctypes.POINTER(kind)))
        count = events_of_step(self.stepper, self._option_values)
        events, found = (lib.structs["event"] * max(count, 1))(), ctypes.c_int(0)
        if count:
            record.events, record.max_events = events, count
            record.n_events = ctypes.pointer(found)
        taken = ctypes.c_int(0)
        status: int = lib.call["simulate"](
            *(self._state, self._work, self._info, self._params, self._options),
            *(lib.pointer(self._u) if self._u.size else None, self.dt, 1, 1, record, taken),
        )
        if status <= SUCCESS:
            row["u"] = self._u.reshape(1, -1).copy()
            self._rows.append(row)
            self._events += [event_of(self.stepper, events[k]) for k in range(found.value)]
        return status

    def _fail(self, status: int) -> None:
        lib = self.stepper.library
        m = self.stepper.manifest
        name = lib.statuses[status]
        raise StepError(
            f"model '{self.stepper.name}', step {self.steps + 1} at t = {self.t:g}: {name}, "
            f"{lib.status_texts[status]}",
            name,
            self._trajectory(),
            FailedStep(
                **{key: m[key] for key in ("model", "model_hash", "scheme", "precision", "stages")},
                state=fields_of(self._state),
                u=[float(x) for x in self._u],
                parameters=dict(self.parameters),
                options=self._option_values.given(),
                h=self.dt,
                status=name,
                about={},
            ),
        )

    def reset(
        self,
        *,
        q0: Any = None,
        v0: Any = None,
        t0: float | None = None,
        parameters: Mapping[str, float] | None = None,
    ) -> None:
        """Start again, from the model's initial state where nothing else is given.

        Parameters
        ----------
        q0, v0, t0, parameters
            As for `Stepper.simulate`; parameters not given keep their values.

        Raises
        ------
        RunError
            For arguments that cannot be used.
        """
        stepper = self.stepper
        self.parameters = stepper.check_parameters({**self.parameters, **(parameters or {})})
        self._attach()
        self._begin(stepper.start_of(q0, v0, t0, self.parameters))
        self.begin_derivatives()

    def copy(self) -> "Simulator":
        """A simulator in the same state that goes its own way."""
        other = object.__new__(Simulator)
        other.__setstate__(self.__getstate__())
        return other

    def __getstate__(self) -> dict[str, Any]:
        about = {name: getattr(self, name) for name in _KEPT}
        about |= {"rows": list(self._rows), "events": list(self._events)}
        about |= {"state": bytes(self._state), "info": bytes(self._info)}
        walk = self._walk
        if walk is not None:
            about |= {
                "walk": (
                    bytes(walk.state),
                    bytes(walk.seeds.directions),
                    list(walk.found),
                    walk.lost,
                )
            }
        return about | {"u": self._u.copy(), "P": self._P.copy()}

    def __setstate__(self, about: dict[str, Any]) -> None:
        for name in _KEPT:
            setattr(self, name, about[name])
        self._attach()
        for struct, name in ((self._state, "state"), (self._info, "info")):
            ctypes.memmove(ctypes.byref(struct), about[name], ctypes.sizeof(struct))
        self._u[:] = about["u"]
        self._P = about["P"]
        self._rows, self._events = list(about["rows"]), list(about["events"])
        self._walk = None
        if "walk" in about:
            self.begin_derivatives()
            walk = self._directions()
            state, directions, walk.found, walk.lost = about["walk"]
            for struct, kept in ((walk.state, state), (walk.seeds.directions, directions)):
                ctypes.memmove(ctypes.byref(struct), kept, ctypes.sizeof(struct))

    # --- looking ---------------------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Time [s]."""
        return float(self._state.t)

    @property
    def q(self) -> np.ndarray:
        """Coordinates, shape (n_q,)."""
        return self._views["q"].astype(self.stepper.library.wide)

    @property
    def v(self) -> np.ndarray:
        """Velocities, shape (n_q,)."""
        return self._views["v"].astype(self.stepper.library.wide)

    @property
    def u(self) -> np.ndarray:
        """Inputs of the last step, shape (n_u,)."""
        return self._u.astype(self.stepper.library.wide)

    @property
    def P_N(self) -> np.ndarray:
        """Normal percussions of the last call of `step` [N s], shape (n_N,)."""
        return self._P[self._columns["N"]].astype(self.stepper.library.wide)

    @property
    def P_F(self) -> np.ndarray:
        """Friction percussions of the last call of `step` [N s], shape (n_F,)."""
        return self._P[self._columns["F"]].astype(self.stepper.library.wide)

    @property
    def energy(self) -> float:
        """E = p^T v - L [J]."""
        return float(
            self.stepper.evaluate("energy", self.t, self.q, self.v, parameters=self.parameters)
        )

    @property
    def info(self) -> dict[str, Any]:
        """What the last step reported, the fields of ``p_info`` by name."""
        return fields_of(self._info)

    def state(self, contact: str) -> str:
        """State of a contact after the last step, as in ``trajectory["floor.state"]``.

        Raises
        ------
        RunError
            If there is no such contact.
        """
        m = self.stepper.manifest
        names = [c["name"] for c in m["contacts"]]
        if contact not in names:
            raise RunError(
                f"model '{self.stepper.name}' has no contact '{contact}'; it has: "
                f"{', '.join(names) or 'none'}"
            )
        code = int(self._views["contact"][names.index(contact)])
        return "unknown" if code < 0 else m["contact_states"][code].lower().split("_")[0]

    def trajectory(self) -> Trajectory:
        """The steps since the start; only if `Stepper.start` was called with ``record=True``.

        Raises
        ------
        RunError
            If nothing is recorded.
        """
        if not self._records:
            raise RunError("nothing is recorded: call stepper.start(..., record=True)")
        return self._trajectory()

    def _trajectory(self) -> Trajectory:
        t, q, v = self._start if self._records else (self.t, self.q, self.v)
        n = self.stepper.sizes
        first = {
            "t": np.array([t]),
            "q": q.reshape(1, -1),
            "v": v.reshape(1, -1),
            "u": np.zeros((1, n["n_u"])),
            "P": np.zeros((1, n["n_R"])),
            "residual": np.zeros(1),
            "smallest_gap": np.array([np.inf]),
            "counts": np.zeros((1, len(COUNTS)), np.intc),
            "contact": np.full((1, n["n_contacts"]), -1, np.intc),
        }
        arrays = {
            name: np.concatenate([start, *(row[name] for row in self._rows)])
            for name, start in first.items()
        }
        if self._rows:  # inputs of a row are those held from it on
            arrays["u"] = np.concatenate([arrays["u"][1:], arrays["u"][-1:]])
        gaps = arrays["smallest_gap"]
        gaps[gaps >= self.stepper.library.largest] = np.inf
        options = self._option_values.given()
        return Trajectory(
            self.stepper,
            arrays,
            parameters=self.parameters,
            options=options,
            steps=len(self._rows),
            events=list(self._events),
        )

    def __repr__(self) -> str:
        return (
            f"Simulator('{self.stepper.name}', t = {self.t:g}, {self.steps} steps of {self.dt:g})"
        )


def start(
    stepper: Compiled,
    *,
    of: tuple[str, ...],
    project: bool,
    dt: float,
    q0: Any,
    v0: Any,
    t0: float | None,
    parameters: Mapping[str, float] | None,
    record: bool,
    options: RunOptions,
) -> Simulator:
    """Make a simulator; see `Stepper.start`."""
    par = stepper.check_parameters(parameters)
    h = number("dt", dt)
    if h <= 0:
        raise RunError(f"dt = {h:g}: give a step size > 0")
    if not isinstance(record, (bool, np.bool_)):
        raise RunError(f"record = {record!r}: give True or False")
    begin = stepper.start_of(q0, v0, t0, par)
    made = Simulator(stepper, par, options, begin, h, bool(record), of, project)
    made.begin_derivatives()
    return made
