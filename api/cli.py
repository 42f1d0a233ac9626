"""The command ``signorini``."""

import sys

from rich.console import Console
from signorini.codegen.frontend.errors import GenerationError, ModelError
from signorini.commands import doctor, generate, look, measure, new, run, sweep, ways
from signorini.commands.base import app
from signorini.runtime.errors import CompilerError, RunError, StepError

_EXPECTED = (ModelError, GenerationError, CompilerError, RunError)
COMMANDS = (
    new,
    run,
    generate,
    look,
    measure,
    sweep,
    ways,
    doctor,
)  # modules: importing them registers what they have


def main() -> None:
    """Entry point: expected errors end with one message and exit status 1."""
    errors = Console(stderr=True)
    try:
        app()
    except StepError as error:
        errors.print(f"error: {error}", style="red", markup=False, highlight=False)
        sys.exit(1)
    except _EXPECTED as error:
        errors.print(f"error: {error}", style="red", markup=False, highlight=False)
        sys.exit(1)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        errors.print(f"error: {where}{error.strerror or error}", style="red", markup=False)
        sys.exit(1)
    except KeyboardInterrupt as interruption:
        text = f": {interruption}" if str(interruption) else ""
        errors.print(f"interrupted{text}", markup=False, highlight=False, soft_wrap=True)
        sys.exit(130)


if __name__ == "__main__":
    main()
