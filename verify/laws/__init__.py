"""Laws of friction as the reference and the judges know them, one file each.

They share no formula with the C: a law is asked for the residual of its inclusion, and for the two
sizes by which a judge decides whether a percussion is allowed and takes all the power that it can.
"""

import pkgutil
from functools import cache
from importlib import import_module
from typing import Protocol

import numpy as np


class Law(Protocol):
    """Friction of one or two components in a set that grows with a radius.

    `mu_F` holds the coefficients of the components, the largest of which the radius is made with.
    """

    name: str

    def residual(
        self, P: np.ndarray, slip: np.ndarray, radius: float, r: float, mu_F: np.ndarray
    ) -> np.ndarray:
        """P + prox_C(r slip - P): zero iff the law holds."""

    def size(self, P: np.ndarray, mu_F: np.ndarray) -> np.ndarray:
        """The least radius that allows the percussions P, shape (..., n)."""

    def rate(self, slip: np.ndarray, mu_F: np.ndarray) -> np.ndarray:
        """The largest power against `slip`, shape (..., n), for the radius one."""


@cache
def _all() -> dict[str, Law]:
    laws: list[Law] = [
        import_module(f"{__name__}.{m.name}").LAW for m in pkgutil.iter_modules(__path__)
    ]
    return {law.name: law for law in laws}


def find(name: str) -> Law:
    """A law by its name in the manifest; contacts without friction and given bounds are balls."""
    return _all()[name if name in _all() else "coulomb"]
