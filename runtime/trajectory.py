"""A trajectory: the recorded steps with everything that follows from them."""

import contextlib
import json
import os
import struct
import zipfile
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from signorini.runtime.arguments import as_path
from signorini.runtime.errors import RunError

if TYPE_CHECKING:
    from signorini.runtime.stepper import Stepper

_FORMAT = 1
_STORED = (
    *("t", "q", "v", "u", "P", "residual", "smallest_gap", "counts"),
    *("t_stage", "Q", "V", "R"),
)
_DERIVED = ("g", "g_dot", "gamma", "g_N", "g_N_dot", "gamma_F", "energy", "outputs")
# What zip archives and NumPy raise on files that are none.
_DAMAGE = (
    *(OSError, ValueError, TypeError, KeyError, EOFError, IndexError, SyntaxError, OverflowError),
    *(NotImplementedError, RuntimeError, MemoryError, struct.error, zlib.error),
    zipfile.BadZipFile,
)
_COUNTS = ("status", "iterations", "substeps", "rescues", "percussions", "lost_impacts")


class Trajectory:
    """Recorded steps of a run. Row k belongs to time ``t[k]``, row 0 to the start.

    Attributes
    ----------
    t : ndarray, shape (n+1,)
        Times [s].
    q, v : ndarray, shape (n+1, n_q)
        Coordinates and velocities.
    P_g, P_gamma, P_N, P_F : ndarray, shape (n+1, n_g | n_gamma | n_N | n_F)
        Percussions of the whole step that ends at ``t[k]``; row 0 is zero.
    g, g_dot, gamma, g_N, g_N_dot, gamma_F : ndarray, shape (n+1, ...)
        Constraints, gaps, slip velocities at the recorded states.
    energy : ndarray, shape (n+1,)
        E = p^T v - L.
    outputs : ndarray, shape (n+1, n_outputs)
        The model's outputs.
    iterations, status, substeps, rescues, percussions, lost_impacts : ndarray of int, (n+1,)
        What the step reported; ``substeps`` is 0 for a step that was solved whole.
    residual, smallest_gap : ndarray, shape (n+1,)
        Largest scaled residual, smallest gap at any stage of the step.
    contacts : dict
        Contact name -> {"P_N": column or None, "P_F": columns}.
    t_stage, Q, V, R_g, R_gamma, R_N, R_F : ndarray, shape (n, s, ...)
        Only with ``record="stages"``: the stages of each recorded step.
    parameters : dict
        Parameter values of the run.
    """

    def __init__(self, stepper: "Stepper", arrays: dict[str, np.ndarray], **about: Any) -> None:
        self._stepper = stepper
        self._arrays = arrays
        self.parameters: dict[str, float] = about["parameters"]
        self.options: dict[str, Any] = about["options"]
        self.seconds: float = about.get("seconds", 0.0)
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
        if name in _COUNTS:
            return arrays["counts"][:, _COUNTS.index(name)]
        kind, _, row = name.partition("_")
        if kind in ("P", "R") and row in self._columns:
            source = arrays["P"] if kind == "P" else self._stages("R")
            return source[..., self._columns[row]]
        if name in ("t_stage", "Q", "V"):
            return self._stages(name)
        if name in _DERIVED:
            if name not in self._cache:
                self._cache[name] = self._stepper.evaluate(
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
                *_COUNTS,
                *_DERIVED,
            }
            | {f"P_{name}" for name in self._columns}
        )

    def __repr__(self) -> str:
        return (
            f"Trajectory('{self.model}', {len(self) - 1} steps, "
            f"t = {self.t[0]:g} ... {self.t[-1]:g})"
        )

    @property
    def contacts(self) -> dict[str, dict[str, Any]]:
        """Columns of each contact in ``P_N``, ``g_N`` and in ``P_F``, ``gamma_F``."""
        return {
            c["name"]: {
                "P_N": c["normal"] if c["normal"] >= 0 else None,
                "P_F": list(range(c["friction"], c["friction"] + c["components"])),
            }
            for c in self._stepper.manifest["contacts"]
        }

    def __getitem__(self, key: str) -> np.ndarray:
        """Column by name: ``traj["x"]``, ``traj["x_dot"]``, ``traj["floor.P_N"]``, an output.

        ``"floor.P_F"`` has shape (n+1,) for one slip component and (n+1, 2) for two.
        """
        m = self._stepper.manifest
        if not isinstance(key, str):
            raise KeyError(f"{key!r}: columns are named; rows are in .t, .q, .v, ...")
        for names, array in ((m["coordinates"], "q"), (m["velocities"], "v"), (m["inputs"], "u")):
            if key in names:
                return getattr(self, array)[:, names.index(key)]
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
        for blocks, rows in (
            (m["constraints"], {"P_g": "P_g", "g": "g", "g_dot": "g_dot"}),
            (m["velocity_constraints"], {"P_gamma": "P_gamma", "gamma": "gamma"}),
        ):
            first = 0
            for name, count in blocks:
                if dot and name == contact and quantity in rows:
                    return getattr(self, rows[quantity])[:, first : first + count]
                first += count
        raise KeyError(
            f"no column '{key}'; there are coordinates {m['coordinates']}, velocities "
            f"{m['velocities']}, inputs {m['inputs']}, outputs {m['outputs']}, and 'NAME.P_N', "
            f"'NAME.P_F', 'NAME.g_N', 'NAME.gamma_F' for the contacts {list(self.contacts)}"
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write a NumPy ``.npz`` file that `load` reads; replaced only when complete."""
        m = self._stepper.manifest
        about = {
            "format": _FORMAT,
            "model": self.model,
            "model_hash": m["model_hash"],
            "stages": m["stages"],
            "parameters": self.parameters,
            "options": self.options,
            "seconds": self.seconds,
        }
        arrays = {name: self._arrays[name] for name in _STORED if name in self._arrays}
        target = as_path("the file", path)
        if not target.name or target.is_dir():
            raise RunError(f"{target} is a folder: give a file name, e.g. run.npz")
        partial = target.with_name(f".{target.name}.part")
        try:
            with partial.open("wb") as stream:
                stored: dict[str, Any] = {"about": np.array(json.dumps(about)), **arrays}
                np.savez_compressed(stream, **stored)
            partial.replace(target)
        except OSError as error:
            raise RunError(f"cannot write {target}: {error.strerror}") from None
        finally:
            with contextlib.suppress(OSError):
                partial.unlink(missing_ok=True)
        return target

    @classmethod
    def load(cls, path: str | os.PathLike[str], stepper: "Stepper") -> "Trajectory":
        """Read a file that `save` wrote.

        Parameters
        ----------
        path : path
            The ``.npz`` file.
        stepper : Stepper
            A stepper of the same model: it evaluates the derived quantities.

        Raises
        ------
        RunError
            If the file is damaged, of another kind, or of another model.
        """
        try:
            with np.load(as_path("the file", path), allow_pickle=False) as data:
                about = json.loads(str(data["about"]))
                arrays = {name: data[name] for name in _STORED if name in data.files}
        except FileNotFoundError:
            raise RunError(f"there is no file {path}") from None
        except _DAMAGE as error:
            raise RunError(f"{path} is no file that Trajectory.save wrote ({error})") from None
        if not isinstance(about, dict) or about.get("format") != _FORMAT:
            raise RunError(f"{path} has a format that this version does not read")
        missing = [k for k in ("model", "model_hash", "parameters", "options") if k not in about]
        if missing:
            raise RunError(f"{path} is damaged: it lacks {', '.join(missing)}")
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
            "P": (rows, n["n_R"]), "counts": (rows, len(_COUNTS)),
            "residual": (rows,), "smallest_gap": (rows,),
        }  # fmt: skip
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
        return cls(stepper, arrays, **about)
