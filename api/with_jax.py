"""Steps as functions of JAX. Needs the extra ``signorini[jax]``."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import signorini.runtime
from signorini.runtime.compile import compile_plain
from signorini.runtime.errors import RunError
from signorini.runtime.maps import StepMap
from signorini.runtime.stepper import Stepper

_TARGET = "signorini_steps"


def jax_step(
    stepper: Stepper, dt: float, *, t0: float = 0.0, steps: int = 1, **options: Any
) -> Callable[..., tuple[jax.Array, jax.Array]]:
    """Steps of a model as a function of JAX, (q, v, u, par) -> (q_next, v_next).

    Works under ``jit``, ``vmap`` and ``grad``, forward and backward; calls go to C without Python.

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
    callable
        ``u`` and ``par`` may be left out: no inputs, the default parameters. Derivatives are
        exact; those that do not exist are NaN. Every call starts anew from (q, v).

    Raises
    ------
    RunError
        If an argument cannot be used, or JAX computes in single precision.
    """
    of = StepMap(stepper.differentiable(), dt, t0, steps, options)
    _register()
    defaults = np.array(list(stepper.parameters.values()))
    n_q, _, n_u, _ = of.sizes
    about = {"function": np.int64(of.function), "common": np.int64(of.common)}

    def shapes(lead: tuple[int, ...], slopes: bool) -> tuple[Any, ...]:
        state = jax.ShapeDtypeStruct((*lead, n_q), np.float64)
        matrix = jax.ShapeDtypeStruct((*lead, 2 * n_q, of.columns), np.float64)
        return (state, state, matrix) if slopes else (state, state)

    def call(slopes: bool, *x: Any) -> Any:
        ask = jax.ffi.ffi_call(
            _TARGET, shapes(x[0].shape[:-1], slopes), vmap_method="broadcast_all"
        )
        return ask(*x, **about)

    def plain(q: Any, v: Any, u: Any, par: Any) -> Any:
        return call(False, q, v, u, par)

    def along(primals: Any, tangents: Any) -> Any:
        q, v, J = call(True, *primals)
        change = J @ jnp.concatenate(tangents, axis=-1)[..., None]
        return (q, v), (change[..., :n_q, 0], change[..., n_q:, 0])

    take: Any = jax.custom_jvp(plain)
    take.defjvp(along)

    def step(q: Any, v: Any, u: Any = None, par: Any = None) -> tuple[jax.Array, jax.Array]:
        given = (q, v, np.zeros(n_u) if u is None else u, defaults if par is None else par)
        x = [jnp.asarray(a) for a in given]
        # `of` lives as long as this function: its address stands in compiled programs
        for name, a, n in zip(("q", "v", "u", "par"), x, of.sizes, strict=True):
            if a.dtype != np.float64:
                raise RunError(
                    f"{name} is of type {a.dtype}: steps are of double precision, call "
                    'jax.config.update("jax_enable_x64", True)'
                )
            if a.shape != (n,):
                raise RunError(f"{name} has shape {a.shape}: give ({n},), and vmap for batches")
        result: tuple[jax.Array, jax.Array] = take(*x)
        return result

    return step


@cache
def _register() -> None:
    """Compile the handler that XLA calls, and tell JAX of it."""
    import ctypes

    source = Path(signorini.runtime.__file__).with_name("ffi.c")
    library = ctypes.CDLL(str(compile_plain(source, ("-I", jax.ffi.include_dir()))))
    handler = jax.ffi.pycapsule(library.signorini_steps)
    jax.ffi.register_ffi_target(_TARGET, handler, platform="cpu")
