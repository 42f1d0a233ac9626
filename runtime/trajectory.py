"""A trajectory: the recorded steps with everything that follows from them."""

import csv
import difflib
import html
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from signorini.runtime import export, storage
from signorini.runtime.arguments import as_path
from signorini.runtime.between import between
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError
from signorini.runtime.event import Event
from signorini.runtime.export import COUNTS
from signorini.runtime.files import check_ending, write_text, write_whole
from signorini.runtime.screen import show_page

_DERIVED = ("g", "g_dot", "gamma", "g_N", "g_N_dot", "gamma_F", "energy", "outputs")
# What the codes of C are called here: a slip of one component has a sign there.
_STATE_NAMES = {"SLIP_BACK": "slip"}


class Trajectory:
    """Recorded steps of a run. Row k belongs to time ``t[k]``, row 0 to the start.

    Attributes
    ----------
    t : ndarray, shape (n+1,)
        Times [s].
    q, v : ndarray, shape (n+1, n_q)
        Coordinates and velocities.
    P_g, P_gamma, P_N, P_F : ndarray, shape (n+1, n_g | n_gamma | n_N | n_F)
        Percussions [N s] of all the steps from ``t[k-1]`` to ``t[k]``; divided by
        ``t[k] - t[k-1]`` they are mean forces. Row 0 is zero.
    g, g_dot, gamma, g_N, g_N_dot, gamma_F : ndarray, shape (n+1, ...)
        Constraints, gaps, slip velocities at the recorded states.
    energy : ndarray, shape (n+1,)
        E = p^T v - L.
    outputs : ndarray, shape (n+1, n_outputs)
        The model's outputs.
    energy_range : ndarray, shape (n+1, 2)
        Smallest and largest energy at the ends of the steps that a row stands for.
    iterations, status, substeps, rescues, percussions : ndarray of int
    lost_impacts, impacts, captured, islands, largest_island : ndarray of int
        What the steps of the row reported: sums, the worst status, all rescues (1 cold start,
        4 path or contacts held, 8 contacts soft at first, 16 contacts relaxed; added up), the least
        certain choice of
        percussions (0 unique, 1 of least norm, 2 one of several). ``substeps`` is 0 where all
        steps were solved whole. ``captured`` is 1 where a located step, or its rest, was captured.
        ``islands`` is the smallest number of islands that a step was taken in, ``largest_island``
        the largest number of parts in one; both are 1 in models of one part.
    residual, smallest_gap : ndarray, shape (n+1,)
        Largest scaled residual, smallest gap at any stage; infinite where there is no gap.
    estimate : ndarray, shape (n+1,)
        Of a run with ``error=...``: estimated errors of all steps so far, in units of its scale.
    missed : int
        Of such a run: steps less exact than asked for, however small they were.
    events : list of Event
        Changes of contact states in every step of the run, recorded or not.
    dq, dv : dict from name to ndarray, shape (n+1, n_q, ...)
        Derivatives of a run with ``derivatives="forward"``.
    doutputs : dict from name to ndarray, shape (n+1, n_outputs, ...)
        Those of its outputs.
    gradient : Gradient
        Gradients of a run with ``derivatives="adjoint"``: ``traj.gradient(q_bar, v_bar)``.
    differentiable : True or list of NotDifferentiable
        Of such runs: whether all events have a derivative, or those that have none.
    contacts : dict
        Contact name -> {"P_N": column or None, "P_F": columns}.
    t_stage, Q, V, R, R_g, R_gamma, R_N, R_F : ndarray, shape (n, s, ...)
        Only with ``record="stages"``: the stages of each recorded step.
    stepper : Compiled
        What the run was made with.
    parameters : dict
        Parameter values of the run.
    """

    # of runs that are differentiated
    dq: dict[str, np.ndarray]
    dv: dict[str, np.ndarray]
    doutputs: dict[str, np.ndarray]
    gradient: Callable[..., dict[str, Any]]
    differentiable: Any

    def __init__(self, stepper: Compiled, arrays: dict[str, np.ndarray], **about: Any) -> None:
        self.stepper = stepper
        self._arrays = arrays
        self.parameters: dict[str, float] = about["parameters"]
        self.options: dict[str, Any] = about["options"]
        self.seconds: float = about.get("seconds", 0.0)
        self.steps: int = about.get("steps", len(arrays["t"]) - 1)
        self.missed = 0
        self._events: list[Event] | None = about.get("events")
        self._find_events: Callable[[], list[Event]] | None = about.get("find_events")
        self.model: str = stepper.name
        n = stepper.sizes
        at = np.cumsum([0, n["n_g"], n["n_gamma"], n["n_N"], n["n_F"]])
        self._columns = {
            name: slice(int(at[k]), int(at[k + 1]))
            for k, name in enumerate(("g", "gamma", "N", "F"))
        }
        self._cache: dict[str, np.ndarray] = {}

    def __getattr__(self, name: str) -> np.ndarray:
        if name.startswith("_"):
            raise AttributeError(name)
        arrays = self._arrays
        if name in ("t", "q", "v", "u", "residual", "smallest_gap"):
            return arrays[name]
        if name == "estimate":
            if name not in arrays:
                raise AttributeError("'estimate' needs a run with error=...")
            return arrays[name]
        if name in COUNTS:
            return arrays["counts"][:, COUNTS.index(name)]
        if name == "energy_range":
            if name in arrays:
                return arrays[name]
            return np.column_stack([self.energy, self.energy])
        kind, _, row = name.partition("_")
        if kind in ("P", "R") and row in self._columns:
            source = arrays["P"] if kind == "P" else self._stages("R")
            return source[..., self._columns[row]]
        if name in ("t_stage", "Q", "V", "R"):
            return self._stages(name)
        if name in _DERIVED:
            if name not in self._cache:
                self._cache[name] = self.stepper.evaluate(
                    name, self.t, self.q, self.v, self.u, self.parameters
                )
            return self._cache[name]
        raise AttributeError(f"a trajectory has no '{name}'")

    def _stages(self, name: str) -> np.ndarray:
        if name not in self._arrays:
            raise AttributeError(f"'{name}' needs a run with record=\"stages\"")
        return self._arrays[name]

    def __len__(self) -> int:
        return len(self.t)

    def __call__(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """States at any times of the run, between the rows, too.

        What is asked for is the step from the row before, taken anew up to there, as exact as the
        scheme: with ``events="located"`` of order 2 s - 2 through impacts, and without penetration
        at any time. A captured step spreads an impact over itself, so that its inside says when the
        step sees the impact, not when it was.

        Parameters
        ----------
        t : float or array
            Times from ``traj.t[0]`` to ``traj.t[-1]`` [s].

        Returns
        -------
        q, v : ndarray, shape of `t` with (n_q,) behind it
            Coordinates and velocities; at an impact those behind it.

        Raises
        ------
        RunError
            For a time outside the run, or if a step cannot be taken.

        Notes
        -----
        Inputs of a row are held. A run that was recorded with ``every`` takes all steps of a row.
        """
        return between(self, t)

    def __dir__(self) -> list[str]:
        return sorted(
            {
                *super().__dir__(),
                "t",
                "q",
                "v",
                "u",
                "residual",
                "smallest_gap",
                *COUNTS,
                *_DERIVED,
                "energy_range",
            }
            | {f"P_{name}" for name in self._columns}
        )

    def __repr__(self) -> str:
        return (
            f"Trajectory('{self.model}', {len(self) - 1} steps, "
            f"t = {self.t[0]:g} ... {self.t[-1]:g})"
        )

    def _repr_html_(self) -> str:
        """In a notebook: what it is, and small curves."""
        from signorini.view.plots import thumbnail

        about = html.escape(repr(self))
        events = len(self.events)
        return f"<code>{about}</code>, {events} events<br>{thumbnail(self)}"

    @property
    def events(self) -> list[Event]:
        """Changes of contact states in every step of the run, in the order of time."""
        if self._events is None:
            self._events = [] if self._find_events is None else self._find_events()
        return self._events

    @property
    def contacts(self) -> dict[str, dict[str, Any]]:
        """Columns of each contact in ``P_N``, ``g_N`` and in ``P_F``, ``gamma_F``."""
        return {
            c["name"]: {
                "P_N": c["normal"] if c["normal"] >= 0 else None,
                "P_F": list(range(c["friction"], c["friction"] + c["components"])),
            }
            for c in self.stepper.manifest["contacts"]
        }

    def __getitem__(self, key: str) -> np.ndarray:
        """Column by name: ``traj["x"]``, ``traj["x_dot"]``, ``traj["floor.P_N"]``, an output.

        ``"floor.state"`` is text: ``"open"``, ``"slip"``, ``"stick"``, or ``"closed"`` without slip
        velocity, at the end of the row's last step; ``"unknown"`` before the first step.
        ``"floor.force_N"``, ``"floor.force_F"`` and ``"hinge.force"`` are percussions divided by
        the time that the row stands for: mean forces [N]. ``"floor.P_F"`` has shape (n+1,) for one
        slip component and (n+1, 2) for two.

        Raises
        ------
        KeyError
            If there is no such column; the message lists those there are.
        """
        m = self.stepper.manifest
        if not isinstance(key, str):
            raise KeyError(f"{key!r}: columns are named; rows are in .t, .q, .v, ...")
        for names, array in ((m["coordinates"], "q"), (m["velocities"], "v"), (m["inputs"], "u")):
            if key in names:
                return getattr(self, array)[:, names.index(key)]
        if key in ("t", "energy"):
            return getattr(self, key)
        if key in m["outputs"]:
            return self.outputs[:, m["outputs"].index(key)]
        contact, dot, quantity = key.rpartition(".")
        if dot and contact in self.contacts:
            columns = self.contacts[contact]
            if quantity in ("P_N", "g_N", "g_N_dot") and columns["P_N"] is not None:
                return getattr(self, quantity)[:, columns["P_N"]]
            if quantity in ("P_F", "gamma_F") and columns["P_F"]:
                values = getattr(self, quantity)[:, columns["P_F"]]
                return values[:, 0] if values.shape[1] == 1 else values
            if quantity == "state":
                return self._states(list(self.contacts).index(contact))
            if quantity in ("force_N", "force_F"):
                percussion = self[f"{contact}.P_{quantity[-1]}"]
                return (percussion.T / self._spans).T
        for blocks, rows in (
            (m["g_blocks"], {"P_g": "P_g", "g": "g", "g_dot": "g_dot", "force": "P_g"}),
            (
                m["gamma_blocks"],
                {"P_gamma": "P_gamma", "gamma": "gamma", "force": "P_gamma"},
            ),
        ):
            first = 0
            for name, count in blocks:
                if dot and name == contact and quantity in rows:
                    values = getattr(self, rows[quantity])[:, first : first + count]
                    return values / self._spans[:, None] if quantity == "force" else values
                first += count
        names = self.keys()
        near = difflib.get_close_matches(key, names, 3, 0.6)
        meant = f" (did you mean {' or '.join(near)}?)" if near else ""
        raise KeyError(
            f"'{self.model}' has no column '{key}'{meant}; there are: t, energy, {', '.join(names)}"
        )

    @property
    def _spans(self) -> np.ndarray:
        """The time that each row stands for; 1 for the start, whose percussions are zero."""
        return np.concatenate([[1.0], np.diff(self.t)])

    def _states(self, k: int) -> np.ndarray:
        names = [
            _STATE_NAMES.get(name, name.lower()) for name in self.stepper.manifest["contact_states"]
        ]
        return np.array([*names, "unknown"])[self._arrays["contact"][:, k]]

    def keys(self) -> list[str]:
        """Names of all columns, as ``traj[name]`` takes them."""
        m = self.stepper.manifest
        names = [*m["coordinates"], *m["velocities"], *m["inputs"], *m["outputs"]]
        for c in m["contacts"]:
            kinds = ["state"]
            if c["normal"] >= 0:
                kinds += ["P_N", "force_N", "g_N", "g_N_dot"]
            if c["components"]:
                kinds += ["P_F", "force_F", "gamma_F"]
            names += [f"{c['name']}.{kind}" for kind in kinds]
        for name, _ in m["g_blocks"]:
            names += [f"{name}.{kind}" for kind in ("P_g", "force", "g", "g_dot")]
        for name, _ in m["gamma_blocks"]:
            names += [f"{name}.{kind}" for kind in ("P_gamma", "force", "gamma")]
        return names

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write a NumPy ``.npz`` file that `load` reads, a table, or labelled arrays.

        The ``.npz`` holds, beside the arrays, what they mean: names of columns, units, energy,
        gaps, states of contacts, outputs, parameters, versions. The ``.csv`` has a column for every
        name of `keys` and the energy, ``.parquet`` the table of `to_pandas`, ``.nc`` (netCDF) the
        arrays of `to_xarray`. A file is replaced only when the new one is complete.

        Parameters
        ----------
        path : path
            The ending decides the format.

        Raises
        ------
        RunError
            For an ending that stands for no format, or a file that cannot be written.
        """
        target = as_path("the file", path)
        if not target.name or target.is_dir():
            raise RunError(f"{target} is a folder: give a file name, e.g. run.npz")
        writers: dict[str, Callable[[Path], None]] = {
            ".npz": partial(storage.write, self, self._arrays),
            ".csv": self._write_csv,
            **{ending: partial(write, self) for ending, write in export.writers().items()},
        }
        check_ending(target, writers)
        write_whole(target, writers[target.suffix])
        return target

    def plot(
        self,
        path: str | os.PathLike[str] | None = None,
        panels: Sequence[str] | None = None,
    ) -> Any:
        """Draw curves over time.

        Parameters
        ----------
        path : path, optional
            A file to write as well: .png, .svg or .pdf.
        panels : sequence of str, optional
            Of ``"q"``, ``"v"`` (a panel for each unit, attitudes as angles), ``"energy"`` (with
            what impacts have taken), ``"gaps"``, ``"forces"`` (percussions of impacts as stems),
            ``"friction"`` (``|P_F| / (mu P_N)``), ``"states"``, ``"inputs"``, ``"outputs"``; by
            default all that the model has.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        RunError
            For a panel that there is not, or a file that cannot be written.
        """
        from signorini.view.plots import Plots

        try:
            figure = Plots(self).figure(panels)
        except ValueError as error:
            raise RunError(str(error)) from None
        if path is not None:
            target = as_path("the file", path)
            check_ending(target, (".png", ".svg", ".pdf"))
            write_whole(target, lambda file: figure.savefig(file, dpi=130))
        return figure

    def animate(
        self,
        path: str | os.PathLike[str],
        *,
        fps: float = 30.0,
        speed: float | None = None,
    ) -> Path:
        """Write the motion as a page or a film.

        An ``.html`` page needs nothing but a browser: it plays, with a slider for the time, the
        states of the contacts, contact forces and trails. In space it needs `viser` to be made, an
        ``.mp4`` needs ffmpeg (both come with ``signorini[view]``); a ``.gif`` needs nothing more.
        Bodies, obstacles, springs and contacts of `signorini.bodies` draw themselves, others with
        `Model.shape` and the argument `at` of `Model.contact`. The page of a model that draws
        nothing has its curves over time and says so.

        Parameters
        ----------
        path : path
            Ends in .html, .gif or .mp4.
        fps : float
            Frames a second.
        speed : float, optional
            Model seconds a second; by default 1, or what makes the film last 3 to 20 s. The page
            and the film say which.

        Raises
        ------
        RunError
            If a package is missing, the ending stands for no format, the file cannot be written, or
            a film is wanted of a model that draws nothing.
        """
        from signorini.view import ink

        target = as_path("the file", path)
        check_ending(target, (".html", ".gif", ".mp4"))
        _check_pace(fps, speed)
        try:
            if target.suffix == ".html":
                write_text(target, self._page(fps, speed))
            else:
                motion = self._motion(fps, speed)
                write_whole(target, lambda file: ink.film(motion, file))
        except (ValueError, ModuleNotFoundError) as error:
            raise RunError(str(error)) from None
        return target

    def view(self, *, fps: float = 30.0, speed: float | None = None) -> Any:
        """Show the motion: in a notebook below the cell, else in the browser.

        Raises
        ------
        RunError
            If viser is missing for a motion in space.
        """
        _check_pace(fps, speed)
        try:
            text = self._page(fps, speed)
        except (ValueError, ModuleNotFoundError) as error:
            raise RunError(str(error)) from None
        return show_page(text, self.model)

    def _motion(self, fps: float, speed: float | None) -> Any:
        from signorini.view.motion import motion

        return motion(self, fps, speed)

    def _page(self, fps: float, speed: float | None) -> str:
        from signorini.view import page, space

        if not self.stepper.manifest["shapes"]:
            return page.curves(self.stepper.manifest["doc"] or self.model, self.plot())
        frames = self._motion(fps, speed)
        return page.page(frames) if frames.dimension == 2 else space.page(frames)

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame`: a column for every name of `keys` and the energy, indexed by t.

        Columns with several components become ``"ball.P_F[0]"``, ``"ball.P_F[1]"``. Model, scheme,
        parameters and their units are in its ``attrs``.

        Raises
        ------
        RunError
            If pandas is missing.
        """
        return export.to_pandas(self)

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` with named dimensions.

        ``q (t, coordinate)``, ``v (t, velocity)``, ``u (t, input)``, ``outputs (t, output)``,
        ``g_N, g_N_dot, P_N (t, gap)``, ``gamma_F, P_F (t, slip)``, ``state (t, contact)``,
        ``g, P_g (t, g_row)``, ``gamma, P_gamma (t, gamma_row)``, ``energy (t)`` and what the steps
        of a row reported. Dimensions without entries are left out.

        Raises
        ------
        RunError
            If xarray is missing.
        """
        return export.to_xarray(self)

    def _write_csv(self, path: Path) -> None:
        table = export.columns(self)
        with path.open("w", encoding="utf-8", newline="") as stream:
            rows = csv.writer(stream)
            rows.writerow(table)
            for row in zip(*(c.tolist() for c in table.values()), strict=True):
                rows.writerow(row)

    @classmethod
    def load(cls, path: str | os.PathLike[str], stepper: Compiled) -> "Trajectory":
        """Read a file that `save` wrote.

        Parameters
        ----------
        path : path
            The ``.npz`` file.
        stepper : Compiled
            A stepper of the same model: it evaluates the derived quantities.

        Raises
        ------
        RunError
            If the file is damaged, of another kind, or of another model.
        """
        arrays, about = storage.read(path, stepper)
        return cls(stepper, arrays, **about)


def _check_pace(fps: float, speed: float | None) -> None:
    """Raise unless there is at least a frame a second, and time goes on."""
    if not (isinstance(fps, (int, float)) and 1 <= fps < float("inf")):
        raise RunError(f"fps is {fps!r}: give at least one frame a second")
    if speed is not None and not (isinstance(speed, (int, float)) and 0 < speed < float("inf")):
        raise RunError(f"speed is {speed!r}: give a positive number")
