"""A generated folder as a loaded library: manifest, structs, functions, all verified."""

import ctypes
import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from signorini.runtime.compile import compile_library
from signorini.runtime.errors import RunError

SUCCESS = 2  # the largest status of a step that succeeded
# By precision: the type in C, that of arrays passed to it, that of results in Python.
_REAL: dict[str, tuple[Any, Any, Any]] = {
    "double": (ctypes.c_double, np.float64, np.float64),
    "float": (ctypes.c_float, np.float32, np.float64),
    "extended": (ctypes.c_longdouble, np.longdouble, np.longdouble),
}
_META_SIZES = ("params", "options", "state", "info", "record", "work")
_META_OF_CHANGES = ("directions", "adjoint", "checkpoint")  # where steps can be differentiated
_META_OF_SIZES = ("control",)  # where a tolerance can choose the sizes of steps


class Library:
    """The compiled functions of one stepper with the layout of its structs.

    Parameters
    ----------
    folder : Path
        A generated folder.
    """

    def __init__(self, folder: Path) -> None:
        try:
            self._read(folder)
        except (
            KeyError,
            TypeError,
            ValueError,
            AttributeError,
            IndexError,
            RecursionError,
        ) as error:
            if isinstance(error, RunError):
                raise
            raise RunError(
                f"{folder / 'manifest.json'} is damaged ({type(error).__name__}: {error}): "
                "generate it again"
            ) from None

    def _read(self, folder: Path) -> None:
        self.folder = folder
        self.manifest = read_manifest(folder)
        m = self.manifest
        self.prefix: str = m["prefix"]
        self.sizes: dict[str, int] = m["sizes"]
        self.real, self.dtype, self.wide = _REAL[m["precision"]]
        self.largest = np.finfo(self.dtype).max
        self.statuses: list[str] = [name for name, _ in m["statuses"]]
        self.status_texts: list[str] = [text for _, text in m["statuses"]]
        self.structs: dict[str, Any] = {}
        for name, fields in m["structs"].items():
            self.structs[name] = self._struct(name, fields)
        source = folder / f"{self.prefix}.c"
        for file in (source, source.with_suffix(".h"), folder / f"{self.prefix}_model.c"):
            if not file.is_file():
                raise RunError(f"{folder} lacks {file.name}: generate it again")
        try:
            self.dll = ctypes.CDLL(str(compile_library(source, self.prefix)))
        except OSError:
            # a library of another machine, or one that another program wrote
            self.dll = ctypes.CDLL(str(compile_library(source, self.prefix, again=True)))
        self._declare()
        self._verify()
        self.batch_struct = self._verified_batch()
        if self.manifest["derivatives"]:
            self.changes_struct = self._verified_changes()
            self.map_struct = self._verified_map()

    def _struct(self, name: str, fields: list[dict[str, Any]]) -> Any:
        members = []
        for f in fields:
            kind = f["type"]
            if kind in ("int", "real"):
                ctype: Any = ctypes.c_int if kind == "int" else self.real
            elif kind == "void*":
                ctype = ctypes.c_void_p
            elif kind in ("int*", "real*", "const real*"):
                ctype = ctypes.POINTER(ctypes.c_int if kind == "int*" else self.real)
            elif kind.endswith("*"):
                ctype = ctypes.POINTER(self.structs[kind[:-1]])
            else:
                ctype = self.structs[kind]
            members.append((f["name"], ctype * f["extent"] if f["extent"] else ctype))
        return type(name, (ctypes.Structure,), {"_fields_": members})

    def _declare(self) -> None:
        real, pointer = self.real, ctypes.POINTER
        s = {name: pointer(self.structs[name]) for name in _META_SIZES}
        array = pointer(real)
        c_int = ctypes.c_int
        signatures: dict[str, tuple[Any, list[Any]]] = {
            "default_params": (self.structs["params"], []),
            "default_options": (self.structs["options"], []),
            "status_text": (ctypes.c_char_p, [c_int]),
            "initial_state": (None, [s["params"], array, array, array]),
            "init": (c_int, [s["state"], s["params"], s["options"], real, array, array]),
            "set_state": (c_int, [s["state"], real, array, array]),
            "step": (
                c_int,
                [s["state"], s["work"], s["info"], s["params"], s["options"], array, real],
            ),
            "simulate": (
                c_int,
                [
                    *(s["state"], s["work"], s["info"], s["params"], s["options"], array, real),
                    *(c_int, c_int, s["record"], pointer(c_int)),
                ],
            ),
            "stable_step": (real, [s["params"], real, array, array, array, array, array]),
            "problem": (
                c_int,
                [
                    *(s["state"], s["work"], s["params"], s["options"], array, real),
                    *((c_int,) if len(self.manifest["parts"]) > 1 else ()),  # which part
                    *(c_int, array, array),
                ],
            ),
        }
        kinds = {"t": real, "par": s["params"]}
        if self.manifest["derivatives"]:
            step = signatures["step"]
            signatures["step_forward"] = (step[0], [*step[1], pointer(self.structs["directions"])])
            for name in ("run_forward", "run_back"):
                signatures[name] = (c_int, [ctypes.c_void_p, c_int])
            signatures["map_steps"] = (c_int, [ctypes.c_void_p, c_int, *[ctypes.c_void_p] * 7])
        if self.manifest["adaptive"]:
            simulate = signatures["simulate"]
            control = pointer(self.structs["control"])
            signatures["simulate_within"] = (simulate[0], [*simulate[1], control])
            step = signatures["step"]
            for name in ("step_within", "advance_to"):
                signatures[name] = (step[0], [*step[1], control])
        for name, function in self.manifest["functions"].items():
            arguments = [kinds.get(a, array) for a in function["arguments"]]
            signatures[name] = (None, [*arguments, array])
        self.call: dict[str, Any] = {}
        for name, (result, argument_types) in signatures.items():
            entry = self._symbol(name)
            entry.restype = result
            entry.argtypes = argument_types
            self.call[name] = entry
        widths = ("n_q", "n_u", "n_R", "n_contacts", "n_stages", "n_counts")
        fields = [(name, c_int) for name in widths]
        self.widths = type("widths", (ctypes.Structure,), {"_fields_": fields})
        self.simulate_controlled = self._symbol("simulate_controlled")
        self.simulate_controlled.restype = c_int
        self.simulate_controlled.argtypes = [
            *(s["state"], s["work"], s["info"], s["params"], s["options"]),
            *(ctypes.c_void_p, array, array, real, c_int, c_int),
            *(s["record"], pointer(self.widths), pointer(c_int)),
        ]
        self.run_batch = self._symbol("run_batch")
        self.run_batch.restype = c_int

    def _symbol(self, name: str) -> Any:
        try:
            return getattr(self.dll, f"{self.prefix}_{name}")
        except AttributeError:
            raise RunError(
                f"{self.folder}: the C code has no {self.prefix}_{name}: generate it again"
            ) from None

    def _verify(self) -> None:
        m = self.manifest
        sized = (
            *_META_SIZES,
            *(_META_OF_CHANGES if m["derivatives"] else ()),
            *(_META_OF_SIZES if m["adaptive"] else ()),
        )

        class Meta(ctypes.Structure):
            _fields_ = [
                *((n, ctypes.c_char_p) for n in ("model", "scheme", "precision", "model_hash")),
                *((n, ctypes.c_char_p) for n in ("runtime_hash", "manifest_hash")),
                ("stages", ctypes.c_int),
                *((f"size_{n}", ctypes.c_int) for n in sized),
            ]

        entry = self._symbol("meta")
        entry.restype = Meta
        entry.argtypes = []
        meta = entry()
        text = (self.folder / f"{self.prefix}.c").read_text(encoding="utf-8", errors="replace")
        said = dict(re.findall(r'meta\.(\w+) = "([^"]*)";', text))
        self._verify_model_file()
        for key in ("model", "scheme", "precision", "runtime_hash"):
            said[key] = getattr(meta, key).decode("ascii", "replace")
        for key in ("model", "scheme", "precision", "model_hash", "runtime_hash"):
            if said.get(key) != self.manifest[key]:
                raise RunError(
                    f"{self.folder}: manifest.json says {key} = {self.manifest[key]!r} but the C "
                    f"code {said.get(key)!r}; the files do not belong together: generate them again"
                )
        body = {k: v for k, v in self.manifest.items() if k != "manifest_hash"}
        digest = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
        if said.get("manifest_hash") != digest:
            raise RunError(
                f"{self.folder}: manifest.json was changed after the C code was generated: "
                "generate it again"
            )
        for name in sized:
            size = getattr(meta, f"size_{name}")
            if size != ctypes.sizeof(self.structs[name]):
                raise RunError(
                    f"{self.folder}: the struct '{name}' has {size} bytes in C but "
                    f"{ctypes.sizeof(self.structs[name])} by the manifest: generate it again"
                )

    def _verified_batch(self) -> Any:
        """The struct that the driver of batches takes, laid out as it is in C."""
        integers = ("n_runs", "n_steps", "every", "n_u_rows", "n_q", "n_R", "n_u", "n_contacts")
        pointers = ("t0", "q0", "v0", "u", "params", "options")
        results = (
            *("t", "q", "v", "P", "residual", "smallest_gap", "energy"),
            *("counts", "contact", "status", "done", "stop"),
        )
        fields = [
            *((name, ctypes.c_int) for name in integers),
            ("h", self.real),
            *((name, ctypes.c_void_p) for name in (*pointers, *results)),
        ]
        if self.manifest["adaptive"]:
            fields += [(name, ctypes.c_void_p) for name in ("control", "estimate", "missed")]
        return self._verified_layout("batch", fields)

    def _verified_changes(self) -> Any:
        """The struct that the driver of derivatives takes."""
        integers = (
            *("n_runs", "n_steps", "n_u_rows", "n_q", "n_u", "n_ways", "max_lost", "captured"),
        )
        runs = (
            *("t0", "q0", "v0", "u", "params", "options", "steps", "status", "n_lost"),
            *("lost_t", "lost_contact", "lost_why", "stop"),
        )
        fields = [
            *((name, ctypes.c_int) for name in integers),
            ("h", self.real),
            *((name, ctypes.c_void_p) for name in runs),
            ("sizes", ctypes.c_void_p),
            ("ends", ctypes.c_void_p),
            ("n_rows", ctypes.c_int),
            *((name, ctypes.c_void_p) for name in ("seeds", "dq", "dv")),
            *((name, ctypes.c_int) for name in ("n_kept", "rows")),
            *((n, ctypes.c_void_p) for n in ("q_bar", "v_bar", "gradient", "u_bar", "leaves")),
        ]
        return self._verified_layout("changes", fields)

    def _verified_map(self) -> Any:
        """The struct that says what mapped steps have in common."""
        fields = [
            *((name, ctypes.c_int) for name in ("steps", "n_q", "n_u", "n_par")),
            *((name, self.real) for name in ("t0", "h")),
            ("options", ctypes.c_void_p),
        ]
        return self._verified_layout("map", fields)

    def _verified_layout(self, name: str, fields: list[tuple[str, Any]]) -> Any:
        """A struct of a driver, laid out as it is in C."""
        struct = type(name, (ctypes.Structure,), {"_fields_": fields})
        layout = self._symbol(f"{name}_layout")
        said = (ctypes.c_int * layout(None))()
        layout(said)
        expected = [ctypes.sizeof(struct), *(getattr(struct, name).offset for name, _ in fields)]
        if list(said) != expected:
            raise RunError(
                f"{self.folder}: the driver '{name}' lays out its struct as {list(said)}, the "
                f"loader as {expected}: the installation is damaged"
            )
        return struct

    def _verify_model_file(self) -> None:
        """The file of the model functions says in its head which model it is of."""
        name = f"{self.prefix}_model.c"
        text = (self.folder / name).read_text(encoding="utf-8", errors="replace")
        said = dict(re.findall(r"^ \*   (\w+) +sha256 (\w+)$", text, re.MULTILINE))
        if said != {key: self.manifest[f"{key}_hash"] for key in ("model", "runtime")}:
            raise RunError(
                f"{self.folder}: {name} is of another model or generator than manifest.json; the "
                "files do not belong together: generate them again"
            )

    # --- arrays ----------------------------------------------------------------------------------

    def array(self, values: Any) -> Any:
        """A contiguous NumPy array of the real type."""
        return np.ascontiguousarray(values, dtype=self.dtype)

    def kept(self, values: Any) -> np.ndarray:
        """A copy of an array of C as results have it in Python."""
        return self.view(values).astype(self.wide)

    def view(self, values: Any) -> np.ndarray:
        """The reals of an array of C, where they are."""
        return np.frombuffer(values, dtype=self.dtype)

    def pointer(self, values: np.ndarray) -> Any:
        """The C pointer to an array made by `array`."""
        return values.ctypes.data_as(ctypes.POINTER(self.real))


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read what a generated folder says of itself; `RunError` if it is none."""
    path = folder / "manifest.json"
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise RunError(
            f"{folder} is no generated folder: it has no manifest.json. Write one with "
            "'signorini generate MODEL --out DIR'"
        ) from None
    except (OSError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise RunError(f"{path} cannot be read ({error}): generate it again") from None
    needed = (
        *("model", "prefix", "scheme", "stages", "precision", "sizes", "coordinates"),
        *("velocities", "inputs", "parameters", "contacts", "outputs", "statuses", "structs"),
        *(
            "functions",
            "zeros",
            "kinds",
            "parts",
            "runtime_hash",
            "model_hash",
            "adaptive",
            "contact_states",
            "event_kinds",
            "g_blocks",
            "gamma_blocks",
            "compliant",
        ),
    )
    missing = [key for key in needed if not isinstance(manifest, dict) or key not in manifest]
    if missing:
        raise RunError(f"{path} lacks {', '.join(missing)}: generate it again")
    if not re.fullmatch(r"[A-Za-z]\w*", str(manifest["prefix"]), re.ASCII):
        raise RunError(f"{path} has the prefix {manifest['prefix']!r}: generate it again")
    if not isinstance(manifest["precision"], str) or manifest["precision"] not in _REAL:
        raise RunError(f"{path} has the precision {manifest['precision']!r}: generate it again")
    return manifest
