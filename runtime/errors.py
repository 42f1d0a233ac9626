"""Errors of compiled steppers and runs."""

from typing import Any


class RunError(ValueError):
    """An argument or file of a run that cannot be used; the message says what to do."""


class InconsistentStartError(RunError):
    """An initial state that violates a constraint or penetrates a contact."""


class CompilerError(RuntimeError):
    """No C compiler, or one that fails."""


class StepError(RuntimeError):
    """A step that could not be solved.

    Attributes
    ----------
    status : str
        Name of the status code.
    trajectory : Trajectory
        The steps done so far.
    step : FailedStep
        The step itself: ``error.step.save("step.json")`` writes a file that replays it alone.
    """

    def __init__(self, message: str, status: str, trajectory: Any, step: Any) -> None:
        super().__init__(message)
        self.status = status
        self.trajectory = trajectory
        self.step = step

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.status, self.trajectory, self.step)
