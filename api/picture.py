"""A picture of a run: superimposed poses of a model's shapes, or curves over time."""

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from signorini import report
from signorini.codegen.frontend.model import Model
from signorini.codegen.frontend.validate import freeze
from signorini.runtime.files import write_whole
from signorini.runtime.trajectory import Trajectory


def poses(model: Model, traj: Trajectory, parameters: dict[str, float]) -> list[np.ndarray]:
    """Points of every shape at every recorded time: one array (n_t, n_points, 2 or 3) each."""
    data = freeze(model)
    values = [float(parameters.get(p.name, p.default)) for p in data.parameters]
    found = []
    for shape in model.shapes:
        flat = [
            model.world.to_sx(model.name, "shape", component)
            for point in shape.points
            for component in point
        ]
        f = ca.Function("shape", [data.t, data.q, data.par], [ca.vertcat(*flat)])
        columns = np.asarray(f.map(len(traj.t))(traj.t, traj.q.T, ca.repmat(ca.DM(values), 1, 1)))
        found.append(columns.T.reshape(len(traj.t), len(shape.points), -1))
    return found


def draw(
    model: Model, traj: Trajectory, path: Path, parameters: dict[str, float], count: int = 8
) -> None:
    """Write a figure: `count` poses equally spaced in time, dark at the end.

    Models without shapes get curves over time.
    """
    if not model.shapes:
        report.plot(traj, path)
        return
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    data = freeze(model)
    values = [float(parameters.get(p.name, p.default)) for p in data.parameters]
    shapes = poses(model, traj, parameters)
    rows = np.unique(np.linspace(0, len(traj.t) - 1, count).astype(int))
    spatial = shapes[0].shape[2] == 3
    fig = plt.figure(figsize=(7.5, 5), layout="constrained")
    axis: Any = fig.add_subplot(projection="3d" if spatial else None)
    for row in rows:
        shade = 0.15 + 0.85 * (row / max(rows[-1], 1))
        colour = mpl.colormaps["viridis_r"](0.1 + 0.85 * shade)
        for declared, places in zip(model.shapes, shapes, strict=True):
            points = places[row]
            if declared.radius is not None:
                radius = model.world.to_sx(model.name, "shape", declared.radius)
                size = float(ca.Function("r", [data.par], [radius])(values))
                turn = np.linspace(0, 2 * np.pi, 60)
                for x, y in points[:, :2]:
                    axis.plot(x + size * np.cos(turn), y + size * np.sin(turn), c=colour, lw=1.2)
                continue
            line = np.vstack([points, points[:1]]) if declared.closed else points
            axis.plot(*line.T, c=colour, lw=1.4, solid_capstyle="round")
    # the way of every shape's middle
    for places in shapes:
        axis.plot(*places.mean(axis=1).T, c="0.75", lw=0.6, zorder=0)
    # what lies in a plane or on a line still gets a readable axis
    everything = np.concatenate([places.reshape(-1, places.shape[2]) for places in shapes])
    low, high = everything.min(axis=0), everything.max(axis=0)
    least = 0.1 * max(float((high - low).max()), 1e-12)
    for name, a, b in zip("xyz", low, high, strict=False):
        if b - a < least:
            getattr(axis, f"set_{name}lim")((a + b - least) / 2, (a + b + least) / 2)
    axis.set_aspect("equal")
    axis.set_xlabel("x [m]")
    axis.set_ylabel("y [m]")
    if spatial:
        axis.set_zlabel("z [m]")
    else:
        axis.grid(alpha=0.25)
    axis.set_title(f"{model.doc or model.name}, t = {traj.t[0]:g} ... {traj.t[-1]:g} s")
    write_whole(path, lambda file: fig.savefig(file, dpi=130))
    plt.close(fig)
