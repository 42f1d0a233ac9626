"""What the command line shows of a run: events, a short table."""

from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from signorini.runtime.trajectory import Trajectory


def summary(traj: Trajectory) -> dict[str, Any]:
    """What `show` prints, and all events, as plain data."""
    m = traj.stepper.manifest
    n = traj.steps

    def named(names: list[str], values: np.ndarray) -> dict[str, float]:
        return dict(zip(names, values.tolist(), strict=True))

    gaps = traj.smallest_gap[1:]
    return {
        "model": m["model"],
        "scheme": m["scheme"],
        "stages": m["stages"],
        "precision": m["precision"],
        "located": traj.options.get("events") == "located",
        "captured": int(np.count_nonzero(traj.captured[1:])),
        "generator": m["generator"],
        "parameters": traj.parameters,
        "t": [float(traj.t[0]), float(traj.t[-1])],
        "steps": n,
        "rows": len(traj) - 1,
        "start": {
            "q": named(m["coordinates"], traj.q[0]),
            "v": named(m["velocities"], traj.v[0]),
        },
        "end": {
            "q": named(m["coordinates"], traj.q[-1]),
            "v": named(m["velocities"], traj.v[-1]),
            "outputs": named(m["outputs"], traj.outputs[-1]),
        },
        "energy": {
            "start": float(traj.energy[0]),
            "end": float(traj.energy[-1]),
            "least": float(traj.energy_range[:, 0].min()),
            "most": float(traj.energy_range[:, 1].max()),
        },
        "smallest_gap": float(gaps.min()) if n and np.isfinite(gaps).any() else None,
        "iterations": int(traj.iterations.sum()),
        "impacts": int(traj.impacts.sum()),
        "lost_impacts": int(np.sum(traj.lost_impacts[1:])),
        "rows_with_rescues": int(np.count_nonzero(traj.rescues[1:])),
        "rows_with_substeps": int(np.count_nonzero(traj.substeps[1:])),
        "seconds": traj.seconds,
        "events": [event._asdict() for event in traj.events],
    }


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
            table.add_row("...", f"{len(traj.events) - most} more", "(--all-events shows them)")
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
        if traj.options.get("events") == "located":
            back = int(np.count_nonzero(traj.captured[1:]))
            table.add_row("events", f"located; {back} of {rows} rows hold captured steps")
        several = int(np.count_nonzero(traj.percussions[1:] > 1))
        if several:
            table.add_row("percussions one of several", f"in {several} of {rows} rows")
        lost = int(np.sum(traj.lost_impacts[1:]))
        if lost:
            table.add_row("pushes without percussion", f"{lost} (active_set = end loses impacts)")
        if traj.seconds:
            table.add_row("µs per step", f"{traj.seconds / n * 1e6:.3g} (wall, from Python)")
    console.print(table)
