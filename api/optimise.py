"""Steps as functions of CasADi, with exact derivatives, for its optimisers."""

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from signorini.runtime.arguments import number
from signorini.runtime.derivatives import Seeds, Walk
from signorini.runtime.errors import RunError
from signorini.runtime.options import RunOptions
from signorini.runtime.stepper import Stepper


def casadi_step(
    stepper: Stepper, dt: float | None = None, *, t0: float = 0.0, steps: int = 1, **options: Any
) -> ca.Function:
    """Steps of a model as a CasADi function (q, v, u, par) -> (q_next, v_next).

    Parameters
    ----------
    stepper : Stepper
        Built with ``derivatives=True``, or made so on first use.
    dt : float, optional
        Step size [s]. Without it the function has two more arguments, ``t`` and ``h``: the time
        at which the steps begin and their size.
    t0 : float
        Time at which they begin, if `dt` is given; it matters where the model depends on time.
    steps : int
        How many steps, with the same inputs.
    **options
        ``tol``, ``max_halvings``, ... as for `Stepper.simulate`; events are located.

    Returns
    -------
    casadi.Function
        With the exact derivatives of the steps and their sparsity; entries that have none are NaN.
        Every call starts anew from (q, v), without the contact states of an earlier step.

    Raises
    ------
    RunError
        If an argument cannot be used; by a call, if a step cannot be taken.
    """
    if not isinstance(steps, (int, np.integer)) or steps < 1:
        raise RunError(f"steps = {steps!r}: give a number of steps of at least 1")
    given = None if dt is None else (number("t0", t0), number("dt", dt))
    step = _Step(_Steps(stepper.differentiable(), given, int(steps), options))
    _KEPT.append(step)
    return step


# What each argument is called where runs are differentiated.
_IN = {"q": "q0", "v": "v0", "u": "inputs", "par": "parameters", "t": "t0", "h": "dt"}
_OUT = ("q_next", "v_next")
# CasADi holds callbacks weakly, whatever is made of them: here they live as long as the module.
_KEPT: list[ca.Callback] = []


class _Steps:
    """Steps from (q, v) with inputs and parameters, and their derivatives."""

    def __init__(
        self,
        stepper: Stepper,
        given: tuple[float, float] | None,
        steps: int,
        options: dict[str, Any],
    ) -> None:
        n = stepper.sizes
        self.stepper, self.given, self.steps = stepper, given, steps
        self.options = RunOptions.of({"events": "located", **options})
        self.arguments = tuple(_IN)[: 6 if given is None else 4]
        self.sizes = dict(zip(_IN, (n["n_q"], n["n_q"], n["n_u"], n["n_par"], 1, 1), strict=True))
        self.names = list(stepper.parameters)

    def __call__(self, of: tuple[str, ...], values: Sequence[Any]) -> Walk:
        q, v, u, par, *when = (np.array(x, dtype=float).ravel() for x in values)
        t, h = self.given or (float(when[0][0]), float(when[1][0]))
        parameters = self.stepper.check_parameters(dict(zip(self.names, par, strict=True)))
        seeds = Seeds(self.stepper, of, fresh=False)
        walk = Walk(self.stepper, parameters, self.options, (t, q, v), seeds)
        for _ in range(self.steps):
            walk.step(u, h)
        return walk

    def pattern(self, result: str, argument: str) -> ca.Sparsity:
        """Where a block of the derivative has entries."""
        n = self.sizes["q"]
        dense = ca.Sparsity.dense(n, self.sizes[argument])
        if argument in ("t", "h"):
            return dense
        found = np.zeros(dense.shape)
        for i, columns in enumerate(self.stepper.manifest["influence"][argument]):
            found[i, columns] = 1
        if (result, argument) == ("q_next", "q"):
            found += np.eye(n)
        return ca.sparsify(ca.DM(found)).sparsity()


class _Step(ca.Callback):
    def __init__(self, steps: _Steps) -> None:
        ca.Callback.__init__(self)
        self.steps = steps
        self.construct(f"{steps.stepper.name}_step", {})

    def get_n_in(self) -> int:
        return len(self.steps.arguments)

    def get_n_out(self) -> int:
        return len(_OUT)

    def get_name_in(self, i: int) -> str:
        return self.steps.arguments[i]

    def get_name_out(self, i: int) -> str:
        return _OUT[i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.steps.sizes[self.steps.arguments[i]], 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.steps.sizes["q"], 1)

    def eval(self, arguments: Sequence[Any]) -> list[Any]:
        end = self.steps((), arguments)
        return [end.q, end.v]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(
        self, name: str, inames: Sequence[str], onames: Sequence[str], options: Mapping[str, Any]
    ) -> ca.Function:
        self.slopes = _Slopes(name, self.steps, inames, onames, options)
        return self.slopes


class _Slopes(ca.Callback):
    """All blocks of the derivative, from the arguments and the results."""

    def __init__(
        self,
        name: str,
        steps: _Steps,
        inames: Sequence[str],
        onames: Sequence[str],
        options: Mapping[str, Any],
    ) -> None:
        ca.Callback.__init__(self)
        self.steps, self.inames, self.onames = steps, inames, onames
        self.blocks = [steps.pattern(x, y) for x in _OUT for y in steps.arguments]
        self.construct(name, options)

    def get_n_in(self) -> int:
        return len(self.steps.arguments) + len(_OUT)

    def get_n_out(self) -> int:
        return len(self.blocks)

    def get_name_in(self, i: int) -> str:
        return self.inames[i]

    def get_name_out(self, i: int) -> str:
        return self.onames[i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        names = (*self.steps.arguments, "q", "v")
        return ca.Sparsity.dense(self.steps.sizes[names[i]], 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return self.blocks[i]

    def eval(self, arguments: Sequence[Any]) -> list[Any]:
        names = self.steps.arguments
        walk = self.steps(tuple(_IN[x] for x in names), arguments[: len(names)])
        changes = (change for which in walk.changes() for change in which.values())
        return [
            ca.project(ca.DM(np.ascontiguousarray(x)), block) if x.size else ca.DM(*x.shape)
            for x, block in zip(changes, self.blocks, strict=True)
        ]
