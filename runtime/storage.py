"""The file of a run: what is written, and what is refused when it is read."""

import json
import os
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from signorini.runtime.arguments import as_path
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError
from signorini.runtime.event import Event
from signorini.runtime.export import COUNTS

_FORMAT = 3
_STORED = (
    *("t", "q", "v", "u", "P", "residual", "smallest_gap", "counts", "contact", "energy_range"),
    *("t_stage", "Q", "V", "R", "estimate"),
)
# What zip archives and NumPy raise on files that are none.
_DAMAGE = (
    *(OSError, ValueError, TypeError, KeyError, EOFError, IndexError, SyntaxError, OverflowError),
    *(NotImplementedError, RuntimeError, MemoryError, struct.error, zlib.error),
    *(zipfile.BadZipFile, tokenize.TokenError),
)


def write(traj: Any, arrays: dict[str, np.ndarray], path: Path) -> None:
    """Write the recorded `arrays` of a trajectory, and what they mean."""
    m = traj.stepper.manifest
    units = {p["name"]: p["unit"] for p in m["parameters"] if p["unit"]}
    about = {
        "format": _FORMAT,
        "model": traj.model,
        "model_hash": m["model_hash"],
        "scheme": m["scheme"],
        "stages": m["stages"],
        "precision": m["precision"],
        "generator": m["generator"],
        "tools": m["tools"],
        "parameters": traj.parameters,
        "options": traj.options,
        "seconds": traj.seconds,
        "steps": traj.steps,
        "units": {"t": "s", **units},
        "events": [tuple(event) for event in traj.events],
        "columns": {
            "q": m["coordinates"],
            "v": m["velocities"],
            "u": m["inputs"],
            "outputs": m["outputs"],
            "contact": [c["name"] for c in m["contacts"]],
            "contact_states": m["contact_states"],
            "counts": list(COUNTS),
            "P": [
                *(f"{name}.P_g" for name, count in m["g_blocks"] for _ in range(count)),
                *(f"{name}.P_gamma" for name, count in m["gamma_blocks"] for _ in range(count)),
                *(f"{c['name']}.P_N" for c in m["contacts"] if c["normal"] >= 0),
                *(f"{c['name']}.P_F" for c in m["contacts"] for _ in range(c["components"])),
            ],
        },
    }
    kept = {name: arrays[name] for name in _STORED if name in arrays}
    further = {name: getattr(traj, name) for name in ("energy", "g_N", "gamma_F", "outputs")}
    stored: dict[str, Any] = {"about": np.array(json.dumps(about)), **kept, **further}
    with path.open("wb") as stream:
        np.savez_compressed(stream, **stored)


def about_of(path: str | os.PathLike[str]) -> dict[str, Any]:
    """What a file says of itself.

    Raises
    ------
    RunError
        If it is missing, of another kind, or of a format that this version does not read.
    """
    return _opened(path)[0]


def _opened(path: str | os.PathLike[str]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    try:
        with np.load(as_path("the file", path), allow_pickle=False) as data:
            about = json.loads(str(data["about"]))
            arrays = {name: data[name] for name in _STORED if name in data.files}
    except FileNotFoundError:
        raise RunError(f"there is no file {path}") from None
    except _DAMAGE as error:
        raise RunError(f"{path} is no file that Trajectory.save wrote ({error})") from None
    if not isinstance(about, dict) or about.get("format") not in range(1, _FORMAT + 1):
        raise RunError(f"{path} has a format that this version does not read")
    missing = [k for k in ("model", "model_hash", "parameters", "options") if k not in about]
    if missing:
        raise RunError(f"{path} is damaged: it lacks {', '.join(missing)}")
    return about, arrays


def read(
    path: str | os.PathLike[str], stepper: Compiled
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The recorded arrays of a file, and what else makes a trajectory: parameters, events, ...

    Raises
    ------
    RunError
        If the file is damaged, of another kind, or of another model.
    """
    about, arrays = _opened(path)
    if about["model_hash"] != stepper.manifest["model_hash"]:
        raise RunError(
            f"{path} holds a run of the model '{about['model']}' in another version than the "
            f"stepper's '{stepper.name}': build the stepper from that model"
        )
    n = stepper.sizes
    rows = arrays["t"].size if "t" in arrays else 0
    s = stepper.stages
    shapes = {
        "t": (rows,), "q": (rows, n["n_q"]), "v": (rows, n["n_q"]), "u": (rows, n["n_u"]),
        "P": (rows, n["n_R"]), "counts": (rows, len(COUNTS)), "residual": (rows,),
        "smallest_gap": (rows,), "contact": (rows, n["n_contacts"]),
    }  # fmt: skip
    if about["format"] < _FORMAT:
        arrays = _from_older(arrays, rows, n["n_contacts"])
    if "energy_range" in arrays:
        shapes["energy_range"] = (rows, 2)
    if "estimate" in arrays:
        shapes["estimate"] = (rows,)
    if "Q" in arrays:
        shapes |= {
            "t_stage": (rows - 1, s),
            "Q": (rows - 1, s, n["n_q"]),
            "V": (rows - 1, s, n["n_q"]),
            "R": (rows - 1, s, n["n_R"]),
        }
    for name, shape in shapes.items():
        if name not in arrays or arrays[name].shape != shape:
            raise RunError(f"{path} is damaged: the array '{name}' is missing or misshapen")
        kinds = "iu" if name in ("counts", "contact") else "fiu"
        if arrays[name].dtype.kind not in kinds:
            raise RunError(f"{path} is damaged: the array '{name}' does not hold numbers")
    states = len(stepper.manifest["contact_states"])
    if (
        arrays["contact"].size
        and not -1 <= arrays["contact"].min() <= arrays["contact"].max() < states
    ):
        raise RunError(f"{path} is damaged: the array 'contact' holds unknown states")
    names = ("parameters", "options", "seconds", "steps")
    further = {name: about[name] for name in names if name in about}
    return arrays, {**further, "events": _read_events(path, about)}


_FIRST_COUNTS = 6  # of the first format


def _from_older(arrays: dict[str, np.ndarray], rows: int, n_contacts: int) -> dict[str, np.ndarray]:
    """Arrays of older formats: the first knew no states of contacts and no impacts, the second no
    located steps, so that none of theirs fell back to captured ones, the third no islands."""
    counts = arrays.get("counts", np.zeros((0, 0)))
    if counts.ndim == 2 and _FIRST_COUNTS <= counts.shape[1] < len(COUNTS):
        missing = np.zeros((len(counts), len(COUNTS) - counts.shape[1]), dtype=counts.dtype)
        counts = np.column_stack([counts, missing])
    unknown = np.full((rows, n_contacts), -1, dtype=np.intc)
    return {"contact": unknown} | arrays | {"counts": counts}


def _read_events(path: Any, about: dict[str, Any]) -> list[Event]:
    try:
        return [
            Event(float(t), str(contact), str(kind), float(P_N), tuple(map(float, P_F)), float(E))
            for t, contact, kind, P_N, P_F, E in about.get("events", [])
        ]
    except (TypeError, ValueError):
        raise RunError(f"{path} is damaged: its events are no events") from None
