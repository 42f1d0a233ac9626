"""A store of a sweep, read back: labelled arrays over the grid, pictures."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from signorini.runtime.arguments import as_path
from signorini.runtime.errors import RunError
from signorini.runtime.files import write_whole

_ADVICE = "install it with: pip install 'signorini[sweep,data]'"
_WHOLE = ("smallest_gap", "impacts", "iterations", "substeps")
_MANY = 20_000  # points above which marks get smaller


@dataclass(frozen=True)
class Column:
    """One number of every row, or of every run (`rows` is false)."""

    name: str
    array: str
    index: int | None
    rows: bool


def column_of(about: Mapping[str, Any], name: str | None) -> Column:
    """What a name stands for: by default the first coordinate.

    Parameters
    ----------
    about : mapping
        A stepper's manifest, or what a store says of itself.

    Raises
    ------
    RunError
        If there is none of that name.
    """
    name = about["coordinates"][0] if name is None else name
    gaps = about.get("gaps")
    if gaps is None:
        gaps = [c["name"] for c in about["contacts"] if c["normal"] >= 0]
    groups = (
        ("q", about["coordinates"]),
        ("v", about["velocities"]),
        ("outputs", about["outputs"]),
        ("g_N", [f"{gap}.g_N" for gap in gaps]),
    )
    for array, names in groups:
        if name in names:
            return Column(name, array, names.index(name), True)
    if name == "energy":
        return Column(name, name, None, True)
    if name in _WHOLE:
        return Column(name, name, None, False)
    known = [*(n for _, names in groups for n in names), "energy", *_WHOLE]
    raise RunError(f"model '{about['model']}' has no column '{name}'; it has: {', '.join(known)}")


def diagram(group: Any, column: Column, path: Path) -> None:
    """Scatter all rows kept against the first axis: a bifurcation diagram if runs were long."""
    from matplotlib.figure import Figure

    about = dict(group.attrs)
    values = np.asarray(group[column.array][...])
    if column.index is not None:
        values = values[..., column.index]
    at = np.asarray(group["points"][:, 0])
    plan = about["sweep"]
    units = about["units"]
    figure = Figure(figsize=(8, 5), layout="constrained")
    picture = figure.add_subplot()
    many = values.size > _MANY
    places = np.repeat(at, values.shape[1]) if values.ndim > 1 else at
    picture.plot(
        places,
        values.ravel(),
        "." if values.ndim > 1 or len(plan["axes"]) > 1 else ".-",
        color="C0",
        markersize=1.0 if many else 2.5,
        markeredgewidth=0,
        alpha=0.5 if many else 0.9,
        lw=0.8,
        rasterized=True,
    )
    first = plan["axes"][0]["name"]
    picture.set_xlabel(_with_unit(first, units))
    picture.set_ylabel(_with_unit(column.name, units | {"energy": "J", "smallest_gap": "m"}))
    kept = f"last {plan['last']} rows" if plan["last"] else "all rows"
    what = kept if column.rows else "of whole runs"
    others = "".join(f", {k} = {v:g}" for k, v in plan["fixed"].items())
    steps = (
        f"every {plan['every']} steps of {plan['dt']:g} s"
        if plan["every"] > 1
        else (f"steps of {plan['dt']:g} s")
    )
    title = f"{about['model']}: {column.name}, {what}, {steps} to t = {plan['t_end']:g} s{others}"
    picture.set_title(title, fontsize=9)
    picture.grid(alpha=0.25)
    picture.spines[["top", "right"]].set_visible(False)
    write_whole(path, lambda file: figure.savefig(file, dpi=150))


def _with_unit(name: str, units: Mapping[str, str]) -> str:
    return f"{name} [{units[name]}]" if units.get(name) else name


def open_sweep(path: str | os.PathLike[str]) -> Any:
    """Open the store of ``signorini sweep`` as labelled arrays over the grid.

    Parameters
    ----------
    path : path
        The folder of ``--out``.

    Returns
    -------
    xarray.Dataset
        A dimension for every axis of the sweep with its values as coordinates, then ``row``,
        ``coordinate``, ``velocity``, ``gap``, ``output``: ``q, v, t, P, energy, g_N, outputs`` of
        the rows kept; ``smallest_gap, energy_range, iterations, substeps, impacts, steps`` and
        ``status`` (text) of whole runs. Units and the plan are attributes. Arrays are read when
        they are used.

    Raises
    ------
    RunError
        If xarray or zarr is missing, or the folder is no store of a sweep.
    """
    try:
        import xarray
        import zarr  # noqa: F401  (what xarray reads the store with)
    except ImportError as error:
        raise RunError(f"opening a sweep needs {error.name}: {_ADVICE}") from None
    folder = as_path("the store", path)
    try:
        data = xarray.open_zarr(folder, consolidated=False, chunks=None)
        about = dict(data.attrs)
        axes = about["sweep"]["axes"]
        names = {
            "coordinate": about["coordinates"],
            "velocity": about["velocities"],
            "gap": about["gaps"],
            "output": about["outputs"],
            "end": ["least", "most"],
        }
    except Exception as error:  # of many kinds, for folders that are none
        raise RunError(f"{folder} is no store of a sweep ({error})") from None
    shape = tuple(len(a["values"]) for a in axes)
    grid = tuple(a["name"] for a in axes)
    variables: dict[str, Any] = {}
    for name, array in data.variables.items():
        if name in ("points", "done") or array.dims[:1] != ("run",) or 0 in array.shape:
            continue
        values = np.asarray(array.values).reshape(*shape, *array.shape[1:])
        if name == "status":
            texts = np.array([*about["statuses"], "not run"])
            values = texts[values]
        variables[str(name)] = ((*grid, *array.dims[1:]), values)
    coordinates: dict[str, Any] = {
        a["name"]: (a["name"], a["values"], {"units": about["units"].get(a["name"], "")})
        for a in axes
    }
    used = {d for dims, _ in variables.values() for d in dims}
    coordinates |= {d: (d, list(labels)) for d, labels in names.items() if d in used}
    kept = ("model", "model_hash", "scheme", "stages", "precision")
    plan = {k: about["sweep"][k] for k in ("t_end", "dt", "every", "last")}
    attributes = {k: about[k] for k in kept} | {k: v for k, v in plan.items() if v is not None}
    attributes |= about["sweep"]["fixed"]
    assert math.prod(shape) == data.sizes["run"]
    return xarray.Dataset(variables, coordinates, attributes)
