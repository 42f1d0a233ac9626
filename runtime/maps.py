"""Steps from many states at once, for frameworks that differentiate and batch by themselves."""

import ctypes
from typing import Any

import numpy as np
from signorini.runtime.arguments import number
from signorini.runtime.compiled import Compiled
from signorini.runtime.errors import RunError
from signorini.runtime.options import RunOptions


class StepMap:
    """Steps (q, v, u, par) -> (q_next, v_next) of one stepper, with derivatives.

    Attributes
    ----------
    sizes : tuple of int
        Numbers of q, v, u, par.
    columns : int
        Their sum: columns of the derivatives.
    function, common : int
        Addresses of the function in C and of what all its steps have in common.
    """

    def __init__(
        self, stepper: Compiled, dt: float, t0: float, steps: int, options: dict[str, Any]
    ) -> None:
        lib, n = stepper.library, stepper.sizes
        h = number("dt", dt)
        if h <= 0:
            raise RunError(f"dt = {h:g}: give a step size > 0")
        if not isinstance(steps, (int, np.integer)) or isinstance(steps, bool) or steps < 1:
            raise RunError(f"steps = {steps!r}: give a number of steps of at least 1")
        if stepper.manifest["precision"] != "double":
            raise RunError(f"model '{stepper.name}': frameworks need a stepper in double precision")
        self.stepper, self.steps = stepper, int(steps)
        self.sizes = (n["n_q"], n["n_q"], n["n_u"], n["n_par"])
        self.columns = sum(self.sizes)
        self._options = stepper.c_options(RunOptions.of({"events": "located", **options}))
        self._map = lib.map_struct()
        self._map.steps, self._map.t0, self._map.h = int(steps), number("t0", t0), h
        self._map.n_q, self._map.n_u, self._map.n_par = n["n_q"], n["n_u"], n["n_par"]
        self._map.options = ctypes.cast(ctypes.byref(self._options), ctypes.c_void_p)
        self._call = lib.call["map_steps"]
        self.function = ctypes.cast(self._call, ctypes.c_void_p).value or 0
        self.common = ctypes.addressof(self._map)

    def __call__(self, n: int, arguments: list[int], results: list[int]) -> None:
        """Take the steps of n runs.

        Parameters
        ----------
        arguments : list of int
            Addresses of rows of q, v, u and par.
        results : list of int
            Addresses of rows of q_next and v_next, and of derivatives (n, 2 n_q, columns) if they
            are asked for.

        Raises
        ------
        RunError
            If a step cannot be taken.
        """
        slopes = results[2] if len(results) > 2 else None
        failed = self._call(self.common, n, *arguments, results[0], results[1], slopes)
        if failed:
            raise RunError(
                f"model '{self.stepper.name}': memory is short"
                if failed < 0
                else f"model '{self.stepper.name}', run {failed - 1}: a step cannot be taken"
            )
