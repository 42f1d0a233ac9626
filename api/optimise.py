"""Steps as functions of CasADi, with exact derivatives, for its optimisers."""

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from signorini.runtime.derivatives import Seeds, Walk
from signorini.runtime.errors import RunError
from signorini.runtime.options import RunOptions
from signorini.runtime.stepper import Stepper


def casadi_step(
    stepper: Stepper, dt: float, *, t0: float = 0.0, steps: int = 1, **options: Any
) -> ca.Function:
    """Steps of a model as a CasADi function (q, v, u, par) -> (q+, v+).

    Parameters
    ----------
    stepper : Stepper
        Built with ``derivatives=True``, or made so on first use.
    dt : float
        Step size [s].
    t0 : float
        Time at which they begin; it matters where the model depends on time.
    steps : int
        How many steps, with the same inputs.
    **options
        ``tol``, ``max_halvings``, ... as for `Stepper.simulate`; events are located.

    Returns
    -------
    casadi.Function
        With the exact derivatives of the steps; entries that have none are NaN. Every call starts
        anew from (q, v), without the contact states of an earlier step.

    Raises
    ------
    RunError
        If an argument cannot be used; by a call, if a step cannot be taken.
    """
    if not isinstance(steps, (int, np.integer)) or steps < 1:
        raise RunError(f"steps = {steps!r}: give a number of steps of at least 1")
    step = _Step(_Steps(stepper.differentiable(), float(dt), float(t0), int(steps), options))
    _KEPT.append(step)
    return step


_IN, _OUT = ("q", "v", "u", "par"), ("q_next", "v_next")
# CasADi holds callbacks weakly, whatever is made of them: here they live as long as the module.
_KEPT: list[ca.Callback] = []


class _Steps:
    """Steps from (q, v) with inputs and parameters, and their derivatives."""

    def __init__(
        self, stepper: Stepper, dt: float, t0: float, steps: int, options: dict[str, Any]
    ) -> None:
        n = stepper.sizes
        self.stepper, self.dt, self.t0, self.steps = stepper, dt, t0, steps
        self.options = RunOptions(events="located", **options)
        self.sizes = (n["n_q"], n["n_q"], n["n_u"], n["n_par"])
        self.names = list(stepper.parameters)

    def __call__(self, of: tuple[str, ...], arguments: Sequence[Any]) -> Walk:
        q, v, u, par = (np.array(x, dtype=float).ravel() for x in arguments)
        parameters = self.stepper.check_parameters(dict(zip(self.names, par, strict=True)))
        seeds = Seeds(self.stepper, of, fresh=False)
        walk = Walk(self.stepper, parameters, self.options, (self.t0, q, v), seeds)
        for _ in range(self.steps):
            walk.step(u, self.dt)
        return walk


class _Step(ca.Callback):
    def __init__(self, walk: _Steps) -> None:
        ca.Callback.__init__(self)
        self.walk = walk
        self.construct(f"{walk.stepper.name}_step", {})

    def get_n_in(self) -> int:
        return len(_IN)

    def get_n_out(self) -> int:
        return len(_OUT)

    def get_name_in(self, i: int) -> str:
        return _IN[i]

    def get_name_out(self, i: int) -> str:
        return _OUT[i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.walk.sizes[i], 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.walk.sizes[0], 1)

    def eval(self, arguments: Sequence[Any]) -> list[Any]:
        end = self.walk((), arguments)
        return [end.q, end.v]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(
        self, name: str, inames: Sequence[str], onames: Sequence[str], options: Mapping[str, Any]
    ) -> ca.Function:
        self.slopes = _Slopes(name, self.walk, inames, onames, options)
        return self.slopes


class _Slopes(ca.Callback):
    """All blocks of the derivative, from the arguments and the results."""

    def __init__(
        self,
        name: str,
        walk: _Steps,
        inames: Sequence[str],
        onames: Sequence[str],
        options: Mapping[str, Any],
    ) -> None:
        ca.Callback.__init__(self)
        self.walk, self.inames, self.onames = walk, inames, onames
        self.construct(name, options)

    def get_n_in(self) -> int:
        return len(_IN) + len(_OUT)

    def get_n_out(self) -> int:
        return len(_IN) * len(_OUT)

    def get_name_in(self, i: int) -> str:
        return self.inames[i]

    def get_name_out(self, i: int) -> str:
        return self.onames[i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        n = self.walk.sizes[i] if i < len(_IN) else self.walk.sizes[0]
        return ca.Sparsity.dense(n, 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.walk.sizes[0], self.walk.sizes[i % len(_IN)])

    def eval(self, arguments: Sequence[Any]) -> list[Any]:
        walk = self.walk(("q0", "v0", "inputs", "parameters"), arguments[: len(_IN)])
        dq, dv = walk.changes()
        return [*dq.values(), *dv.values()]
