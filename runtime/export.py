"""Trajectories as tables and labelled arrays of other packages."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from signorini.runtime.errors import RunError

# What the steps of a row reported, column by column.
COUNTS = (
    *("status", "iterations", "substeps", "rescues", "percussions", "lost_impacts", "impacts"),
    *("captured", "islands", "largest_island"),
)
_ADVICE = "install it with: pip install 'signorini[data]'"


def columns(traj: Any) -> dict[str, np.ndarray]:
    """Every named column of a trajectory, each of shape (n+1,), and the energy.

    Parameters
    ----------
    traj : Trajectory
        The run.

    Returns
    -------
    dict
        Names as `Trajectory.keys` has them; of several components one column each, as in
        ``"ball.P_F[0]"``.
    """
    found: dict[str, np.ndarray] = {"t": traj.t}
    names: list[str] = traj.keys()
    for name in names:
        values = traj[name]
        if values.ndim == 1:
            found[name] = values
        else:
            found |= {f"{name}[{k}]": values[:, k] for k in range(values.shape[1])}
    found["energy"] = traj.energy
    return found


def to_pandas(traj: Any) -> Any:
    """A table with the time as its index; see `Trajectory.to_pandas`."""
    pandas = _module("pandas", "a table")
    named = columns(traj)
    table = pandas.DataFrame(
        {name: values for name, values in named.items() if name != "t"},
        index=pandas.Index(named["t"], name="t"),
    )
    table.attrs = _about(traj)
    return table


def to_xarray(traj: Any) -> Any:
    """Labelled arrays; see `Trajectory.to_xarray`."""
    xarray = _module("xarray", "labelled arrays")
    m = traj.stepper.manifest
    gaps = [c["name"] for c in m["contacts"] if c["normal"] >= 0]
    slips = [
        c["name"] if c["components"] == 1 else f"{c['name']}[{k}]"
        for c in m["contacts"]
        for k in range(c["components"])
    ]
    rows = {
        "g_row": _row_names(m["g_blocks"]),
        "gamma_row": _row_names(m["gamma_blocks"]),
    }
    axes: dict[str, list[str]] = {
        "coordinate": m["coordinates"],
        "velocity": m["velocities"],
        "input": m["inputs"],
        "output": m["outputs"],
        "gap": gaps,
        "slip": slips,
        "contact": [c["name"] for c in m["contacts"]],
        **rows,
    }
    what = {
        "q": ("coordinate", "coordinates"),
        "v": ("velocity", "velocities"),
        "u": ("input", "inputs, held over the step after the row's time"),
        "outputs": ("output", "the model's outputs"),
        "g_N": ("gap", "gaps [m]"),
        "g_N_dot": ("gap", "normal velocities [m/s]"),
        "P_N": ("gap", "normal percussions of what the row stands for [N s]"),
        "gamma_F": ("slip", "slip velocities [m/s]"),
        "P_F": ("slip", "friction percussions of what the row stands for [N s]"),
        "g": ("g_row", "position constraints"),
        "P_g": ("g_row", "their percussions of what the row stands for"),
        "gamma": ("gamma_row", "velocity constraints"),
        "P_gamma": ("gamma_row", "their percussions of what the row stands for"),
    }
    data: dict[str, Any] = {
        name: (("t", axis), getattr(traj, name), {"long_name": text})
        for name, (axis, text) in what.items()
        if axes[axis]
    }
    if axes["contact"]:
        states = np.column_stack([traj[f"{name}.state"] for name in axes["contact"]])
        data["state"] = (("t", "contact"), states, {"long_name": "states of the contacts"})
    data["energy"] = (("t",), traj.energy, {"long_name": "p^T v - L", "units": "J"})
    for name in ("residual", "smallest_gap", *COUNTS):
        data[name] = (("t",), getattr(traj, name))
    labels = {name: names for name, names in axes.items() if names}
    time = ("t", traj.t, {"units": "s", "long_name": "time"})
    return xarray.Dataset(data, coords={"t": time, **labels}, attrs=_flat(_about(traj)))


def writers() -> dict[str, Callable[[Any, Path], None]]:
    """What writes a trajectory to a file of an ending that needs another package."""
    return {".parquet": _write_parquet, ".nc": _write_netcdf}


def _write_parquet(traj: Any, path: Path) -> None:
    _module("pyarrow", "a .parquet file")
    to_pandas(traj).to_parquet(path)


def _write_netcdf(traj: Any, path: Path) -> None:
    _module("h5netcdf", "a .nc file")
    to_xarray(traj).to_netcdf(path, engine="h5netcdf")


def _about(traj: Any) -> dict[str, Any]:
    m = traj.stepper.manifest
    return {
        "model": m["model"],
        "model_hash": m["model_hash"],
        "scheme": m["scheme"],
        "stages": m["stages"],
        "precision": m["precision"],
        "generator": m["generator"],
        "parameters": dict(traj.parameters),
        "units": {p["name"]: p["unit"] for p in m["parameters"] if p["unit"]},
    }


def _flat(about: dict[str, Any]) -> dict[str, Any]:
    """Attributes that netCDF can hold: no dictionaries."""
    flat = {k: v for k, v in about.items() if not isinstance(v, dict)}
    flat |= {f"parameter {name}": value for name, value in about["parameters"].items()}
    return flat | {f"unit of {name}": unit for name, unit in about["units"].items()}


def _row_names(blocks: list[list[Any]]) -> list[str]:
    return [n if count == 1 else f"{n}[{k}]" for n, count in blocks for k in range(count)]


def _module(name: str, what: str) -> Any:
    try:
        return __import__(name)
    except ImportError:
        raise RunError(f"{what} needs the package '{name}': {_ADVICE}") from None
