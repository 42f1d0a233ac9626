"""Controllers in C: inputs before every step, without Python in between."""

import ctypes
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from signorini.runtime.arguments import as_path, reals
from signorini.runtime.compile import compile_plain
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError


class Controller:
    """A controller in C for one stepper, made by `Stepper.controller`.

    It is a callable (t, q, v) -> u, too, with the memory that it had at first.

    Attributes
    ----------
    source : Path
        Its file.
    memory : ndarray
        Numbers that it begins every run with, and may change.
    """

    def __init__(
        self,
        stepper: Compiled,
        source: str | os.PathLike[str],
        function: str,
        memory: Sequence[float],
    ) -> None:
        self.source = as_path("source", source)
        if not self.source.is_file():
            raise RunError(f"there is no file {self.source}: give the C file of the controller")
        if not isinstance(function, str) or not re.fullmatch(r"[A-Za-z_]\w*", function, re.ASCII):
            raise RunError(f"function = {function!r}: give the name of a C function")
        lib, n = stepper.library, stepper.sizes
        if not n["n_u"]:
            raise RunError(f"model '{stepper.name}' has no inputs that a controller could give")
        self.stepper, self.name = stepper, function
        self.memory = np.atleast_1d(reals("memory", memory)).astype(lib.dtype)
        self._dll = ctypes.CDLL(str(compile_plain(Path(self.source))))
        try:
            self._call = getattr(self._dll, function)
        except AttributeError:
            raise RunError(
                f"{self.source} has no function {function}: write void {function}(double t, const "
                "double q[], const double v[], double u[], double memory[]), not static"
            ) from None
        self._call.restype = None
        self._call.argtypes = [lib.real, *[ctypes.c_void_p] * 4]

    @property
    def address(self) -> Any:
        """The function, as C takes it."""
        return ctypes.cast(self._call, ctypes.c_void_p)

    def __call__(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Inputs at a state, from the memory that every run begins with."""
        lib = self.stepper.library
        u = np.zeros(self.stepper.sizes["n_u"], lib.dtype)
        arrays = (lib.array(q), lib.array(v), u, self.memory.copy())
        self._call(t, *(a.ctypes.data for a in arrays))
        return u
