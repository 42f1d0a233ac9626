"""From a symbolic mechanical model with contact to a standalone C stepper.

Define a model with `Model`, run it with `build`, write C with `generate`, load a generated folder
with `load` (which needs neither SymPy nor CasADi).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from signorini.version import __version__

if TYPE_CHECKING:
    from signorini.codegen.frontend.errors import GenerationError, ModelError
    from signorini.codegen.frontend.model import Model
    from signorini.codegen.frontend.symbols import norm, par, smooth
    from signorini.codegen.frontend.table import table
    from signorini.optimise import casadi_step
    from signorini.runtime.batch import Batch
    from signorini.runtime.errors import CompilerError, InconsistentStartError, RunError, StepError
    from signorini.runtime.event import Event
    from signorini.runtime.simulator import Simulator
    from signorini.runtime.stepper import Stepper, load
    from signorini.runtime.trajectory import Trajectory
    from signorini.swept import open_sweep
    from signorini.verify.report import Report
    from signorini.with_jax import jax_step
    from signorini.with_torch import torch_step
    from signorini.workflow import build, check, generate

# Imported on first use: loading a stepper must not need the symbolic packages.
_HOMES = {
    "Model": "signorini.codegen.frontend.model",
    "ModelError": "signorini.codegen.frontend.errors",
    "GenerationError": "signorini.codegen.frontend.errors",
    "par": "signorini.codegen.frontend.symbols",
    "smooth": "signorini.codegen.frontend.symbols",
    "norm": "signorini.codegen.frontend.symbols",
    "table": "signorini.codegen.frontend.table",
    "build": "signorini.workflow",
    "casadi_step": "signorini.optimise",
    "jax_step": "signorini.with_jax",
    "torch_step": "signorini.with_torch",
    "generate": "signorini.workflow",
    "check": "signorini.workflow",
    "Report": "signorini.verify.report",
    "load": "signorini.runtime.stepper",
    "open_sweep": "signorini.swept",
    "Stepper": "signorini.runtime.stepper",
    "Simulator": "signorini.runtime.simulator",
    "Event": "signorini.runtime.event",
    "Trajectory": "signorini.runtime.trajectory",
    "RunError": "signorini.runtime.errors",
    "Batch": "signorini.runtime.batch",
    "StepError": "signorini.runtime.errors",
    "InconsistentStartError": "signorini.runtime.errors",
    "CompilerError": "signorini.runtime.compile",
}
__all__ = [
    "CompilerError",
    "GenerationError",
    "InconsistentStartError",
    "Model",
    "ModelError",
    "Report",
    "RunError",
    "Batch",
    "StepError",
    "Stepper",
    "Simulator",
    "Event",
    "Trajectory",
    "__version__",
    "build",
    "casadi_step",
    "check",
    "generate",
    "jax_step",
    "load",
    "norm",
    "open_sweep",
    "par",
    "smooth",
    "table",
    "torch_step",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'signorini' has no attribute '{name}'")


def __dir__() -> list[str]:
    return __all__
