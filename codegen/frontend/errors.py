"""Errors that name the model, the equation, the symbol or value, and the remedy."""


class ModelError(ValueError):
    """A model that cannot be turned into a stepper.

    Parameters
    ----------
    model : str
        Name of the model.
    equation : str
        The equation, declaration or option at fault, e.g. ``"g_N of contact 'floor'"``.
    problem : str
        What is wrong, with the symbol or value.
    remedy : str
        What to do about it.
    """

    def __init__(self, model: str, equation: str, problem: str, remedy: str) -> None:
        self.model = model
        self.equation = equation
        self.problem = problem
        self.remedy = remedy
        super().__init__(f"model '{model}', {equation}: {problem}. {remedy}.")

    def __reduce__(self) -> tuple[type, tuple[str, str, str, str]]:
        return type(self), (self.model, self.equation, self.problem, self.remedy)


class GenerationError(ValueError):
    """Options or folders from which no C can be generated."""


def foreign_symbol(model: str, equation: str, name: str, known: list[str]) -> ModelError:
    """The error for a symbol that this model did not declare."""
    if name in known:
        return ModelError(
            model,
            equation,
            f"the symbol '{name}' has the name of a declared one but was made elsewhere",
            "Use the symbol that this model's coordinates, velocities, time, parameters or "
            "inputs returned",
        )
    return ModelError(
        model,
        equation,
        f"unknown symbol '{name}'",
        f"Declare it with coordinates, parameters or inputs; declared are: {', '.join(known)}",
    )


def refuse_tuple(model: str, equation: str, expr: object) -> None:
    """Raise the error for a tuple of one symbol, which a forgotten comma leaves behind."""
    if isinstance(expr, tuple) and len(expr) == 1:
        raise ModelError(
            model,
            equation,
            f"{expr!r} is a tuple of one symbol",
            "Unpack it where it is declared: (x,) = m.coordinates('x')",
        )
