"""Curves over time: coordinates, velocities, energy, gaps, forces, friction, states of contacts."""

import io
import math
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from signorini.view.ink import HIT, INK, STATES, new_figure

_MANY = 24  # curves of a panel that a legend still names
_WORDS = {"rad": "angles", "m": "places", "": "coordinates"}


class Plots:
    """Panels of one run.

    Parameters
    ----------
    traj : Trajectory
    """

    def __init__(self, traj: Any) -> None:
        self.traj = traj
        self.m = traj.stepper.manifest
        self.t = traj.t
        self.spans = np.diff(traj.t)
        self._legend_at: dict[Any, float] = {}
        # Rows with an impact of each contact.
        self.hits = {name: self._rows_of_impacts(name) for name in traj.contacts}

    def available(self) -> dict[str, list[Callable[[Any], None]]]:
        """Names of panels and what draws them; some names stand for several panels."""
        traj = self.traj
        found: dict[str, list[Callable[[Any], None]]] = {
            "q": self._columns("q"),
            "v": self._columns("v"),
            "energy": [self.energy],
        }
        if any(c["normal"] >= 0 and not c["one_way"] for c in self.m["contacts"]):
            found["gaps"] = [self.gaps]
        if traj.contacts:
            found["forces"] = [self.forces]
        if any(self._use(name) is not None for name in traj.contacts):
            found["friction"] = [self.friction]
        if traj.contacts:
            found["states"] = [self.states]
        if self.m["inputs"]:
            found["inputs"] = [lambda axis: self._lines(axis, traj.u, self.m["inputs"], "inputs")]
        if self.m["outputs"]:
            found["outputs"] = [
                lambda axis: self._lines(axis, traj.outputs, self.m["outputs"], "outputs")
            ]
        return found

    def figure(self, panels: Sequence[str] | None = None) -> Any:
        """All panels, or those that are named, in one figure.

        Raises
        ------
        ValueError
            For a name that stands for no panel of this run.
        """
        found = self.available()
        names = list(found) if panels is None else list(panels)
        for name in names:
            if name not in found:
                raise ValueError(
                    f"there is no panel '{name}' of '{self.traj.model}'; there are: "
                    f"{', '.join(found)}"
                )
        draw = [each for name in names for each in found[name]]
        columns = 2 if len(draw) > 1 else 1
        rows = math.ceil(len(draw) / columns)
        high = 2.7 + 0.11 * max(0, len(self.traj.contacts) - 8)
        fig = new_figure(5.8 * columns, high * rows)
        axes = fig.subplots(rows, columns, squeeze=False, sharex=True)
        for axis, each in zip(axes.flat, draw, strict=False):
            each(axis)
            axis.set_xlim(self.t[0], max(self.t[-1], self.t[0] + 1e-300))
            axis.grid(alpha=0.25, lw=0.6)
            axis.spines[["top", "right"]].set_visible(False)
            _legend(axis, self._legend_at.get(axis, 1.01))
        for axis in axes.flat[len(draw) :]:
            axis.set_visible(False)
        for column in range(columns):
            last = [a for a in axes[:, column] if a.get_visible()]
            if last:
                last[-1].set_xlabel("t [s]")
                last[-1].tick_params(labelbottom=True)
        about = f"{self.m['scheme']}, s = {self.m['stages']}"
        fig.suptitle(f"{self.m['model']}: {about}", fontsize=11)
        return fig

    # --- panels ----------------------------------------------------------------------------------

    def _columns(self, array: str) -> list[Callable[[Any], None]]:
        """Coordinates or velocities, a panel for each unit; attitudes as angles."""
        names = self.m["coordinates" if array == "q" else "velocities"]
        units = self.m.get("units") or [""] * len(names)
        values = getattr(self.traj, array)
        panels: list[Callable[[Any], None]] = []
        for unit in dict.fromkeys(units):
            own = [k for k, u in enumerate(units) if u == unit]
            if unit == "quaternion":
                if array == "q":
                    panels.append(self._attitudes(own))
                else:
                    panels.append(self._group(values, names, own, "rates of quaternions [1/s]"))
                continue
            if array == "q":
                label = f"{_WORDS.get(unit, 'coordinates')} [{unit}]" if unit else "q"
            else:
                label = f"velocities [{unit}/s]" if unit else "v"
            panels.append(self._group(values, names, own, label))
        return panels

    def _group(
        self, values: np.ndarray, names: Sequence[str], own: list[int], label: str
    ) -> Callable[[Any], None]:
        return lambda axis: self._lines(axis, values[:, own], [names[k] for k in own], label)

    def _attitudes(self, own: list[int]) -> Callable[[Any], None]:
        def show(axis: Any) -> None:
            names = self.m["coordinates"]
            for first in range(0, len(own), 4):
                p = self.traj.q[:, own[first : first + 4]]
                body = names[own[first]].rstrip("0123456789").removesuffix("p").rstrip("_")
                for name, angle in zip(("roll", "pitch", "yaw"), cardan(p), strict=True):
                    axis.plot(self.t, angle, lw=1.2, label=f"{body} {name}".strip())
            axis.set_ylabel("attitude (z-y-x) [rad]")

        return show

    def _lines(self, axis: Any, values: np.ndarray, names: Sequence[str], label: str) -> None:
        for k, name in enumerate(names):
            axis.plot(self.t, values[:, k], lw=1.2, label=name)
        axis.set_ylabel(label)

    def energy(self, axis: Any) -> None:
        """The energy, and what impacts have taken up to a time."""
        axis.plot(self.t, self.traj.energy, lw=1.3, c=INK, label="energy")
        taken = np.zeros(len(self.t))
        for event in self.traj.events:
            if event.kind == "impact":
                taken[np.searchsorted(self.t, event.t - 1e-12 * abs(event.t)) :] += event.energy
        if np.any(taken):
            axis.step(self.t, -taken, where="post", lw=1.1, c=HIT, label="taken by impacts")
        axis.set_ylabel("energy [J]")

    def gaps(self, axis: Any) -> None:
        places = [c for c in self.m["contacts"] if c["normal"] >= 0 and not c["one_way"]]
        values = self.traj.g_N[:, [c["normal"] for c in places]]
        self._lines(axis, values, [c["name"] for c in places], "gaps g_N [m]")
        axis.axhline(0, c=INK, lw=0.7)

    def forces(self, axis: Any) -> None:
        """Mean forces of rows without impacts as lines; percussions of impacts as stems."""
        stems = axis.twinx()
        any_stem = False
        # An impact of one contact gives percussions to all that are closed with it.
        hit = np.any([*self.hits.values()], axis=0)[1:]
        for k, name in enumerate(self.traj.contacts):
            colour = f"C{k % 10}"
            columns = self.traj.contacts[name]
            for label, style, percussion in self._percussions(name, columns):
                force = np.where(hit, np.nan, percussion[1:] / self.spans)
                axis.step(self.t[1:], force, where="pre", lw=1.1, c=colour, ls=style, label=label)
                pushed = hit & (percussion[1:] > 0)
                if label.endswith("N") and pushed.any():
                    times, sizes = self.t[1:][pushed], percussion[1:][pushed]
                    stems.vlines(times, 0, sizes, color=colour, lw=1.0)
                    stems.plot(times, sizes, "o", c=colour, ms=3)
                    any_stem = True
        axis.set_ylabel("contact forces [N]")
        stems.spines[["top"]].set_visible(False)
        if any_stem:
            stems.set_ylabel("percussions of impacts [N s]")
            # Both scales have their zero at one height.
            low, high = axis.get_ylim()
            top = 1.08 * stems.get_ylim()[1]
            stems.set_ylim(top * min(low, 0.0) / max(high, 1e-300), top)
            self._legend_at[axis] = 1.36
        else:
            stems.set_yticks([])
            stems.spines[["right"]].set_visible(False)

    def _percussions(
        self, name: str, columns: dict[str, Any]
    ) -> Iterable[tuple[str, str, np.ndarray]]:
        if columns["P_N"] is not None:
            yield f"{name} N", "-", self.traj.P_N[:, columns["P_N"]]
        for j, column in enumerate(columns["P_F"]):
            suffix = f"F{j + 1}" if len(columns["P_F"]) > 1 else "F"
            yield f"{name} {suffix}", ("--", ":")[j], self.traj.P_F[:, column]

    def friction(self, axis: Any) -> None:
        """How much of the largest friction a contact uses: 1 where it slips."""
        for name in self.traj.contacts:
            use = self._use(name)
            if use is not None:
                axis.step(self.t[1:], use, where="pre", lw=1.1, label=name)
        axis.axhline(1, c=INK, lw=0.7)
        axis.set_ylim(-0.03, 1.12)
        axis.set_ylabel("|P_F| / (μ P_N)")

    def states(self, axis: Any) -> None:
        """A band for each contact: open, sticking, slipping; impacts as ticks."""
        names = list(self.traj.contacts)
        edges = self.t
        seen: set[str] = set()
        for row, name in enumerate(names):
            state = self.traj[f"{name}.state"][1:]
            changes = np.flatnonzero(np.concatenate([[True], state[1:] != state[:-1], [True]]))
            for a, b in pairwise(changes):
                colour = STATES.get(str(state[a]))
                if colour:
                    label = str(state[a]) if str(state[a]) not in seen else None
                    seen.add(str(state[a]))
                    wide = edges[b] - edges[a]
                    axis.barh(row, wide, left=edges[a], height=0.6, color=colour, label=label)
            at = self.t[self.hits[name]]
            if at.size:
                label = None if "impact" in seen else "impact"
                seen.add("impact")
                axis.vlines(at, row - 0.42, row + 0.42, color=HIT, lw=1.0, label=label)
        axis.set_yticks(range(len(names)), names, fontsize=8 if len(names) <= 12 else 6)
        spare = max(0.0, 4 - len(names)) / 2
        axis.set_ylim(len(names) - 0.4 + spare, -0.6 - spare)
        axis.set_ylabel("contacts")

    # --- what they need --------------------------------------------------------------------------

    def _rows_of_impacts(self, name: str) -> np.ndarray:
        rows = np.zeros(len(self.t), dtype=bool)
        times = np.array(
            [e.t for e in self.traj.events if e.contact == name and e.kind == "impact"]
        )
        if times.size:
            at = np.searchsorted(self.t, times - 1e-12 * np.abs(times))
            rows[np.minimum(at, len(rows) - 1)] = True
        return rows

    def _use(self, name: str) -> np.ndarray | None:
        """|P_F / mu| / P_N row by row, where something presses; None without friction."""
        columns = self.traj.contacts[name]
        if columns["P_N"] is None or not columns["P_F"]:
            return None
        stepper = self.traj.stepper
        # coefficients hold over a step: rows are its start
        starts = (x[:-1] for x in (self.traj.t, self.traj.q, self.traj.v, self.traj.u))
        at = (*starts, self.traj.parameters)
        if "mu_F" in stepper.functions:
            mu = stepper.evaluate("mu_F", *at)[:, columns["P_F"]]
        else:
            mu = stepper.evaluate("mu", *at)[:, [list(self.traj.contacts).index(name)]]
        if not np.all(mu > 0):
            return None
        P_N = self.traj.P_N[1:, columns["P_N"]]
        size = np.linalg.norm(self.traj.P_F[1:, columns["P_F"]] / mu, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(P_N > 0, size / P_N, np.nan)


def thumbnail(traj: Any) -> str:
    """Coordinates and states of contacts as a small picture within HTML."""
    plots = Plots(traj)
    panels = ["q", *(["states"] if traj.contacts else [])]
    figure = plots.figure(panels)
    figure.suptitle("")
    stream = io.StringIO()
    figure.savefig(stream, format="svg")
    return stream.getvalue()[stream.getvalue().index("<svg") :]


def cardan(p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch and yaw [rad] of unit quaternions, without jumps: A = A_z A_y A_x."""
    p0, p1, p2, p3 = p.T
    roll = np.arctan2(2 * (p0 * p1 + p2 * p3), p0**2 - p1**2 - p2**2 + p3**2)
    pitch = np.arcsin(np.clip(2 * (p0 * p2 - p3 * p1), -1.0, 1.0))
    yaw = np.arctan2(2 * (p0 * p3 + p1 * p2), p0**2 + p1**2 - p2**2 - p3**2)
    return np.unwrap(roll), pitch, np.unwrap(yaw)


def _legend(axis: Any, right: float) -> None:
    """Beside the curves, where it covers none."""
    handles, labels = axis.get_legend_handles_labels()
    if not 0 < len(handles) <= _MANY:
        return
    axis.legend(
        handles,
        labels,
        fontsize=8 if len(handles) <= 10 else 6,
        loc="upper left",
        bbox_to_anchor=(right, 1.0),
        borderaxespad=0.0,
        frameon=False,
        ncols=1 if len(handles) <= 12 else 2,
    )
