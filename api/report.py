"""What the command line shows of a run: events, a short table, a plot."""

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from signorini.runtime.files import write_whole
from signorini.runtime.trajectory import Trajectory


def show(console: Console, traj: Trajectory, most: int = 12) -> None:
    """Print the events and a short table of the run."""
    stepper = traj.stepper
    m = stepper.manifest
    if traj.events:
        table = Table(title="contact events", title_justify="left")
        table.add_column("t", justify="right")
        for heading in ("contact", "event"):
            table.add_column(heading)
        for event in traj.events[:most]:
            table.add_row(f"{event.t:.6g}", event.contact, event.kind)
        if len(traj.events) > most:
            table.add_row("...", f"{len(traj.events) - most} more", "(in the file of --out)")
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
    rows, n = len(traj) - 1, traj.steps
    table = Table(title="run", title_justify="left", show_header=False)
    table.add_column("")
    table.add_column("")
    recorded = f"{n} steps" if rows == n else f"{n} steps in {rows} recorded rows"
    table.add_row("model", f"{m['model']}, {m['scheme']}, s = {m['stages']}, {m['precision']}")
    table.add_row("time", f"{traj.t[0]:.6g} ... {traj.t[-1]:.6g}, {recorded}")
    if m["contacts"]:
        table.add_row("impacts", str(int(traj.impacts.sum())))
    least, most_energy = traj.energy_range[:, 0].min(), traj.energy_range[:, 1].max()
    table.add_row(
        "energy",
        f"{traj.energy[0]:.8g} -> {traj.energy[-1]:.8g}, between {least:.8g} and {most_energy:.8g}",
    )
    if n and np.isfinite(traj.smallest_gap[1:]).any():
        table.add_row("smallest gap", f"{np.min(traj.smallest_gap[1:]):.3g}")
    if n:
        table.add_row("iterations", f"{traj.iterations.sum() / n:.2f} a step")
        rescued = int(np.count_nonzero(traj.rescues[1:]))
        halved = int(np.count_nonzero(traj.substeps[1:]))
        table.add_row("rows with rescues, substeps", f"{rescued}, {halved} of {rows}")
        several = int(np.count_nonzero(traj.percussions[1:] > 1))
        if several:
            table.add_row("percussions one of several", f"in {several} of {rows} rows")
        lost = int(np.sum(traj.lost_impacts[1:]))
        if lost:
            table.add_row("pushes without percussion", f"{lost} (active_set = end loses impacts)")
        if traj.seconds:
            table.add_row("µs per step", f"{traj.seconds / n * 1e6:.3g} (wall, from Python)")
    console.print(table)


def plot(traj: Trajectory, path: Path) -> None:
    """Write a figure of coordinates, velocities, gaps and mean contact forces."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    m = traj.stepper.manifest
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
                    label=f"P_N/Δt {name}",
                    lw=1.2,
                )
            for j, column in enumerate(columns["P_F"]):
                suffix = f"[{j}]" if len(columns["P_F"]) > 1 else ""
                axes[1, 1].step(
                    t[1:],
                    traj.P_F[1:, column] / dt,
                    where="pre",
                    label=f"P_F{suffix}/Δt {name}",
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
        axes[1, 1].set_ylabel("mean force: percussion / Δt")
        for event in traj.events[:40]:
            for axis in axes.flat:
                axis.axvline(event.t, color="0.85", lw=0.8, zorder=0)
    for axis in axes.flat:
        axis.set_xlabel("t")
        axis.grid(alpha=0.25)
        handles, _ = axis.get_legend_handles_labels()
        if 0 < len(handles) <= 14:
            axis.legend(fontsize=8)
    fig.suptitle(f"{m['model']}: {m['scheme']}, s = {m['stages']}")
    write_whole(path, lambda file: fig.savefig(file, dpi=130))
    plt.close(fig)
