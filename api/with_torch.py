"""Steps as functions of PyTorch. Needs the extra ``signorini[torch]``."""

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from signorini.runtime.errors import RunError
from signorini.runtime.maps import StepMap
from signorini.runtime.stepper import Stepper


def torch_step(
    stepper: Stepper, dt: float, *, t0: float = 0.0, steps: int = 1, **options: Any
) -> Callable[..., tuple[torch.Tensor, torch.Tensor]]:
    """Steps of a model as a function of PyTorch, (q, v, u, par) -> (q_next, v_next).

    Takes batches, rows of any number of dimensions, and works under ``torch.func``.

    Parameters
    ----------
    stepper : Stepper
        Built with ``derivatives=True``, or made so on first use.
    dt, t0, steps, **options
        As for `jax_step`.

    Returns
    -------
    callable
        ``u`` and ``par`` may be left out: no inputs, the default parameters. Derivatives are
        exact; those that do not exist are NaN. Every call starts anew from (q, v).

    Raises
    ------
    RunError
        If an argument cannot be used; by a call, if a step cannot be taken.
    """
    of = StepMap(stepper.differentiable(), dt, t0, steps, options)
    defaults = torch.tensor(list(stepper.parameters.values()), dtype=torch.float64)
    none = torch.zeros(of.sizes[2], dtype=torch.float64)

    def step(
        q: torch.Tensor, v: torch.Tensor, u: Any = None, par: Any = None
    ) -> tuple[torch.Tensor, torch.Tensor]:
        x = [q, v, none if u is None else u, defaults if par is None else par]
        for name, a, n in zip(("q", "v", "u", "par"), x, of.sizes, strict=True):
            if not isinstance(a, torch.Tensor) or a.dtype != torch.float64:
                raise RunError(
                    f"{name}: give a tensor of torch.float64, steps are of that precision"
                )
            if a.shape[-1:] != (n,):
                raise RunError(f"{name} has shape {tuple(a.shape)}: give (..., {n})")
        lead = torch.broadcast_shapes(*(a.shape[:-1] for a in x))
        rows = [a.expand(*lead, a.shape[-1]) for a in x]
        q_next, v_next, _ = _Steps.apply(of, *rows)
        return q_next, v_next

    return step


class _Steps(torch.autograd.Function):
    """The steps, with their derivatives as a third result that nobody differentiates."""

    @staticmethod
    def forward(
        of: StepMap, q: torch.Tensor, v: torch.Tensor, u: torch.Tensor, par: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        lead, n_q = q.shape[:-1], of.sizes[0]
        x = [a.detach().contiguous() for a in (q, v, u, par)]
        found = [
            torch.empty((*lead, n), dtype=torch.float64) for n in (n_q, n_q, 2 * n_q * of.columns)
        ]
        of(int(np.prod(lead)), [a.data_ptr() for a in x], [a.data_ptr() for a in found])
        return found[0], found[1], found[2].reshape(*lead, 2 * n_q, of.columns)

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        ctx.of = inputs[0]
        ctx.mark_non_differentiable(output[2])
        ctx.save_for_backward(output[2])
        ctx.save_for_forward(output[2])

    @staticmethod
    def backward(ctx: Any, q_bar: torch.Tensor, v_bar: torch.Tensor, _: Any) -> Any:
        (J,) = ctx.saved_tensors
        bar = torch.cat([q_bar, v_bar], dim=-1).unsqueeze(-2) @ J
        return (None, *torch.split(bar.squeeze(-2), list(ctx.of.sizes), dim=-1))

    @staticmethod
    def jvp(ctx: Any, _: Any, *tangents: torch.Tensor) -> Any:
        (J,) = ctx.saved_tensors
        change = (J @ torch.cat(tangents, dim=-1).unsqueeze(-1)).squeeze(-1)
        n_q = ctx.of.sizes[0]
        return change[..., :n_q], change[..., n_q:], None

    @staticmethod
    def vmap(info: Any, in_dims: Any, of: StepMap, *x: torch.Tensor) -> Any:
        rows = [
            a.unsqueeze(0).expand(info.batch_size, *a.shape) if d is None else a.movedim(d, 0)
            for a, d in zip(x, in_dims[1:], strict=True)
        ]
        return _Steps.apply(of, *rows), (0, 0, 0)
