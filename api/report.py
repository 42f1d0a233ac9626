"""What the command line shows of a run: events, a short table, a plot."""

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from signorini.runtime.trajectory import Trajectory

_STATES = ("open", "closed", "slip", "stick")


def contact_states(traj: Trajectory) -> dict[str, np.ndarray]:
    """State of every contact in every recorded step: open, closed (frictionless), slip or stick.

    A contact is closed in a step if it transmits a percussion; it slips if the friction reaches
    the ball's radius.
    """
    stepper = traj._stepper
    states = {}
    mu = np.zeros(0)
    if traj.contacts:
        mu = stepper.evaluate("mu", 0.0, traj.q[0], parameters=traj.parameters)
    bound = None
    if any(c["bound"] >= 0 for c in stepper.manifest["contacts"]):
        bound = stepper.evaluate("bound", traj.t, traj.q, traj.v, traj.u, traj.parameters)
    steps = np.diff(traj.t, prepend=traj.t[0])
    for k, c in enumerate(stepper.manifest["contacts"]):
        friction = np.linalg.norm(
            traj.P_F[:, c["friction"] : c["friction"] + c["components"]], axis=1
        )
        if c["normal"] >= 0:
            normal = traj.P_N[:, c["normal"]]
            radius = mu[k] * normal
            closed = normal > 0
        else:
            assert bound is not None
            radius = steps * np.maximum(bound[:, c["bound"]], 0)
            closed = np.ones(len(traj), dtype=bool)
        if c["components"] == 0:
            state = np.where(closed, "closed", "open")
        else:
            slips = friction >= radius * (1 - 1e-6)
            state = np.where(closed, np.where(slips & (radius > 0), "slip", "stick"), "open")
        state[0] = "open" if c["normal"] >= 0 else state[min(1, len(state) - 1)]
        states[c["name"]] = state
    return states


def events(traj: Trajectory) -> list[tuple[float, str, str, str]]:
    """Changes of contact state as (time of the step's end, contact, from, to)."""
    found = []
    for name, state in contact_states(traj).items():
        changes = [k for k in range(1, len(state)) if state[k] != state[k - 1]]
        found += [(float(traj.t[k]), name, str(state[k - 1]), str(state[k])) for k in changes]
    return sorted(found, key=lambda event: event[0])


def impacts(traj: Trajectory) -> int:
    """Closings of contacts that were open in the step before, over all contacts."""
    return sum(1 for _, _, before, after in events(traj) if before == "open" and after != "open")


def show(console: Console, traj: Trajectory, most: int = 12) -> None:
    """Print the events and a short table of the run."""
    stepper = traj._stepper
    m = stepper.manifest
    list_of_events = events(traj)
    if list_of_events:
        table = Table(title="contact events", title_justify="left")
        table.add_column("t", justify="right")
        for heading in ("contact", "from", "to"):
            table.add_column(heading)
        for t, name, before, after in list_of_events[:most]:
            table.add_row(f"{t:.6g}", name, before, after)
        if len(list_of_events) > most:
            table.add_row("...", f"{len(list_of_events) - most} more", "", "")
        console.print(table)
    table = Table(title="final state", title_justify="left")
    for heading in ("", "q", "v"):
        table.add_column(heading, justify="right" if heading else "left")
    shown = min(len(m["coordinates"]), 24)
    for k, name in enumerate(m["coordinates"][:shown]):
        table.add_row(name, f"{traj.q[-1, k]:.10g}", f"{traj.v[-1, k]:.10g}")
    if shown < len(m["coordinates"]):
        table.add_row("...", "", "")
    console.print(table)
    n = len(traj) - 1
    table = Table(title="run", title_justify="left", show_header=False)
    table.add_column("")
    table.add_column("")
    table.add_row("model", f"{m['model']}, {m['scheme']}, s = {m['stages']}, {m['precision']}")
    table.add_row("time", f"{traj.t[0]:.6g} ... {traj.t[-1]:.6g}, {n} recorded steps")
    table.add_row("impacts", str(impacts(traj)))
    table.add_row("energy", f"{traj.energy[0]:.8g} -> {traj.energy[-1]:.8g}")
    if n and np.isfinite(traj.smallest_gap[1:]).any():
        table.add_row("smallest gap", f"{np.min(traj.smallest_gap[1:]):.3g}")
    if n:
        its = traj.iterations[1:]
        table.add_row("iterations", f"{its.mean():.2f} a step, at most {its.max()}")
        rescued = int(np.count_nonzero(traj.rescues[1:]))
        halved = int(np.count_nonzero(traj.substeps[1:]))
        table.add_row("rescued, substepped", f"{rescued}, {halved} of {n}")
        lost = int(np.sum(traj.lost_impacts[1:]))
        if lost:
            table.add_row("pushes without percussion", f"{lost} (active_set = end loses impacts)")
        table.add_row("µs per step", f"{traj.seconds / n * 1e6:.3g} (wall, from Python)")
    console.print(table)


def plot(traj: Trajectory, path: Path) -> None:
    """Write a figure of coordinates, velocities, gaps and mean contact forces."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    m = traj._stepper.manifest
    t = traj.t
    contacts = list(traj.contacts.items())
    rows = 2 if contacts else 1
    fig, axes = plt.subplots(rows, 2, figsize=(11, 3.6 * rows), squeeze=False, layout="constrained")
    few = len(m["coordinates"]) <= 12
    for axis, array, names, label in (
        (axes[0, 0], traj.q, m["coordinates"], "q"),
        (axes[0, 1], traj.v, m["velocities"], "v"),
    ):
        for k, name in enumerate(names):
            axis.plot(t, array[:, k], label=name if few else None, lw=1.2)
        axis.set_ylabel(label)
    if contacts:
        dt = np.diff(t)
        for name, columns in contacts:
            if columns["P_N"] is not None:
                (_line,) = axes[1, 0].plot(
                    t, traj.g_N[:, columns["P_N"]], label=f"g_N {name}", lw=1.2
                )
                axes[1, 1].step(
                    t[1:],
                    traj.P_N[1:, columns["P_N"]] / dt,
                    where="pre",
                    label=f"P_N/dt {name}",
                    lw=1.2,
                )
            for j, column in enumerate(columns["P_F"]):
                suffix = f"[{j}]" if len(columns["P_F"]) > 1 else ""
                axes[1, 1].step(
                    t[1:],
                    traj.P_F[1:, column] / dt,
                    where="pre",
                    label=f"P_F{suffix}/dt {name}",
                    lw=1.0,
                    ls="--",
                )
        if traj.P_N.shape[1]:
            axes[1, 0].set_ylabel("gap")
        else:
            axes[1, 0].plot(t, traj.gamma_F, lw=1.2)
            axes[1, 0].set_ylabel("slip velocity")
        forces = np.abs(np.hstack([traj.P_N[1:], traj.P_F[1:]])) / dt[:, None]
        pushing = forces[forces > 0]
        if pushing.size:
            # Impacts are off the scale of contact forces; the axis keeps to the latter.
            top = 4 * float(np.median(np.max(forces, axis=1)[np.max(forces, axis=1) > 0]))
            if np.max(forces) > top:
                axes[1, 1].set_ylim(-top, top)
                axes[1, 1].set_title("impacts exceed the axis", fontsize=8, loc="right")
        axes[1, 1].set_ylabel("percussion / dt")
        for time, _, _, _ in events(traj)[:40]:
            for axis in axes.flat:
                axis.axvline(time, color="0.85", lw=0.8, zorder=0)
    for axis in axes.flat:
        axis.set_xlabel("t")
        axis.grid(alpha=0.25)
        handles, _ = axis.get_legend_handles_labels()
        if 0 < len(handles) <= 14:
            axis.legend(fontsize=8)
    fig.suptitle(f"{m['model']}: {m['scheme']}, s = {m['stages']}")
    fig.savefig(path, dpi=130)
    plt.close(fig)
