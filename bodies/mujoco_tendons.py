"""What moves several joints at once: tendons of constant coefficients, and what acts on them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from signorini.codegen.frontend.model import Model

_ALONG_JOINT = 1  # the number that MuJoCo has for a tendon's coefficient of a joint


@dataclass(frozen=True)
class Transmission:
    """A length that is linear in coordinates: of one joint, or of a tendon.

    Attributes
    ----------
    length, rate : expression
    shares : dict of float
        Derivatives of the length by coordinate name: a force along it is shared out like that.
    """

    length: Any
    rate: Any
    shares: dict[str, float]


class Tendons:
    """The tendons of a compiled model, as far as they are linear in coordinates.

    Parameters
    ----------
    m : MjModel
    model : Model
        Receives their energies, forces, friction and limits.
    coordinate : callable
        From the number of a hinge or slide to coordinate, velocity and name.
    """

    def __init__(self, m: Any, model: Model, coordinate: Callable[[int], tuple[Any, Any, str]]):
        self.m, self.model, self.coordinate = m, model, coordinate
        self.read: dict[int, Transmission] = {}
        for k in range(m.ntendon):
            first = int(m.tendon_adr[k])
            wraps = range(first, first + int(m.tendon_num[k]))
            if all(int(m.wrap_type[i]) == _ALONG_JOINT for i in wraps):
                pairs = [(int(m.wrap_objid[i]), float(m.wrap_prm[i])) for i in wraps]
                self.read[k] = self._linear(pairs)

    def _linear(self, pairs: list[tuple[int, float]]) -> Transmission:
        length: Any = 0.0
        rate: Any = 0.0
        shares: dict[str, float] = {}
        for joint, share in pairs:
            q, v, name = self.coordinate(joint)
            length, rate = length + share * q, rate + share * v
            shares[name] = shares.get(name, 0.0) + share
        return Transmission(length, rate, shares)

    def act(
        self,
        names: dict[int, str],
        algebra: Any,
        add_energy: Callable[[Any, Any], None],
        e_N: Any,
    ) -> None:
        """Stiffness, damping, armature, dry friction and limits of the tendons that were read.

        A tendon is slack between the two lengths of its spring, as in the file.
        """
        m = self.m
        for k, tendon in self.read.items():
            name = names[k]
            if m.tendon_armature[k]:
                add_energy(float(m.tendon_armature[k]) * tendon.rate**2 / 2, 0)
            if m.tendon_stiffness[k]:
                low, high = map(float, m.tendon_lengthspring[k])
                beyond = algebra.maximum(tendon.length - high, 0)
                before = algebra.minimum(tendon.length - low, 0)
                if low == high:
                    beyond, before = tendon.length - low, 0
                pull = -float(m.tendon_stiffness[k]) * (beyond + before)
                self.push(tendon, pull)
            if m.tendon_damping[k]:
                self.push(tendon, -float(m.tendon_damping[k]) * tendon.rate)
            if m.tendon_frictionloss[k]:
                self.model.friction(
                    f"{name}_dry", gamma_F=tendon.rate, bound=float(m.tendon_frictionloss[k])
                )
            if m.tendon_limited[k]:
                low, high = map(float, m.tendon_range[k])
                self.model.contact(f"{name}_lower", g_N=tendon.length - low, e_N=e_N)
                self.model.contact(f"{name}_upper", g_N=high - tendon.length, e_N=e_N)

    def push(self, along: Transmission, force: Any) -> None:
        """A force along a transmission."""
        self.model.force({name: share * force for name, share in along.shares.items() if share})

    def follows(self, one: int, other: int, polynomial: np.ndarray) -> Any:
        """What vanishes where tendon `one` follows `other` (-1: none) from the reference on."""
        m = self.m
        moved = self.read[one].length - float(m.tendon_length0[one])
        if other < 0:
            return moved - float(polynomial[0])
        x = self.read[other].length - float(m.tendon_length0[other])
        return moved - sum(float(c) * x**i for i, c in enumerate(polynomial[:5]))
