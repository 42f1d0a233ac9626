"""Models from SymPy's mechanics: `dynamicsymbols`, `LagrangesMethod`, `System`."""

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import sympy as sp
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import Model
from signorini.codegen.frontend.symbols import par
from sympy.core.function import AppliedUndef
from sympy.matrices.expressions.matexpr import MatrixElement
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Lagrangian,
    System,
    dynamicsymbols,
)
from sympy.physics.vector import ReferenceFrame

# Symbols, elements of matrix symbols and indexed symbols.
Parameters = Mapping[Any, float | par]
Names = Mapping[Any, str]


class Translated:
    """A model made from SymPy's mechanics, and the translation of more expressions into it.

    Attributes
    ----------
    model : Model
        Contacts, outputs and the initial state are added to it with translated expressions.

    Examples
    --------
    >>> import signorini as sg
    >>> import sympy as sp
    >>> from signorini.bodies import from_lagrangian
    >>> from sympy.physics.mechanics import dynamicsymbols
    >>> y = dynamicsymbols("y")
    >>> m, g = sp.symbols("m g")
    >>> L = m * y.diff() ** 2 / 2 - m * g * y
    >>> ball = from_lagrangian("ball", L, [y], parameters={m: 1.0, g: 9.81})
    >>> ball.model.contact("floor", g_N=ball.translate(y), e_N=0.5)
    >>> ball.model.initial_state(q=[1])
    """

    def __init__(
        self,
        name: str,
        q: Sequence[Any],
        parameters: Parameters | None = None,
        inputs: Sequence[Any] = (),
        names: Names | None = None,
    ) -> None:
        self.model = m = Model(name)
        called = _called(name, [*q, *(parameters or {}), *inputs], names or {})
        t = dynamicsymbols._t
        self._rules: dict[Any, Any] = {t: m.time}
        coordinates = list(q)
        for k, coordinate in enumerate(coordinates):
            if not isinstance(coordinate, AppliedUndef) or coordinate.args != (t,):
                raise ModelError(
                    name,
                    f"coordinate {k}",
                    f"{coordinate} is no dynamicsymbol",
                    "Make it with sympy.physics.mechanics.dynamicsymbols",
                )
        symbols = m.coordinates(" ".join(called[c] for c in coordinates))
        for coordinate, symbol, velocity in zip(coordinates, symbols, m.velocities, strict=True):
            self._rules[coordinate] = symbol
            self._rules[coordinate.diff(t)] = velocity
        given = dict(parameters or {})
        for symbol in given:
            if not isinstance(symbol, (sp.Symbol, sp.Indexed, MatrixElement)):
                raise ModelError(
                    name,
                    f"parameter '{symbol}'",
                    "is no SymPy symbol, nor an element of a matrix or indexed symbol",
                    "Give {symbol: default}",
                )
        for symbol, made in zip(
            given, m.parameters(**{called[s]: v for s, v in given.items()}), strict=True
        ):
            self._rules[symbol] = made
        if inputs:
            for u, made in zip(inputs, m.inputs(" ".join(called[u] for u in inputs)), strict=True):
                self._rules[u] = made

    def translate(self, expr: Any) -> Any:
        """An expression in dynamicsymbols and SymPy symbols as one of the model.

        Raises
        ------
        ModelError
            If a symbol or function is neither coordinate, velocity, parameter nor input.
        """
        result = sp.sympify(expr).xreplace(self._rules)
        known = set(self._rules.values())
        atoms = result.atoms(AppliedUndef, sp.Derivative, sp.Symbol, sp.Indexed, MatrixElement)
        strange = sorted((str(s) for s in atoms if s not in known), key=len)
        if strange:
            raise ModelError(
                self.model.name,
                f"the expression {expr}",
                f"contains {strange[0]}, which is no coordinate, velocity, parameter or input",
                "Name it in parameters={symbol: default} or inputs=[...]",
            )
        return result


def from_lagrangian(
    name: str,
    lagrangian: Any,
    q: Sequence[Any],
    *,
    forces: Sequence[Any] | None = None,
    holonomic: Sequence[Any] = (),
    nonholonomic: Sequence[Any] = (),
    parameters: Parameters | None = None,
    inputs: Sequence[Any] = (),
    names: Names | None = None,
) -> Translated:
    """A model from a Lagrangian in `dynamicsymbols`.

    Parameters
    ----------
    name : str
        Name of the model.
    lagrangian : expression
        T - V.
    q : sequence of dynamicsymbols
        The coordinates.
    forces : sequence of expressions, optional
        Generalized forces, one for each coordinate.
    holonomic, nonholonomic : sequences of expressions, optional
        Position and velocity constraints that vanish.
    parameters : mapping from Symbol to default or `par`, optional
        Every other symbol of the expressions.
    inputs : sequence of dynamicsymbols, optional
        Functions of time that are inputs.
    names : mapping from coordinate, parameter or input to str, optional
        What one is called in the model and in C, where its own name is no name of C: LaTeX
        (``{theta: "theta"}`` for ``dynamicsymbols(r"\\theta")``), primes, elements of matrices.

    Returns
    -------
    Translated
        The model and the translation of gaps and slip velocities.
    """
    if isinstance(lagrangian, (KanesMethod, LagrangesMethod, System)):
        raise ModelError(name, *_other(lagrangian, "Lagrangian", "from_lagrangian"))
    made = Translated(name, list(q), parameters, inputs, names)
    m = made.model
    m.lagrangian = made.translate(_scalar(lagrangian))
    if forces is not None:
        m.force([made.translate(f) for f in forces])
    _constraints(made, holonomic, nonholonomic)
    return made


def from_lagranges_method(
    name: str,
    method: Any,
    *,
    parameters: Parameters | None = None,
    inputs: Sequence[Any] = (),
    names: Names | None = None,
) -> Translated:
    """A model from the data of a `sympy.physics.mechanics.LagrangesMethod`.

    Lagrangian, coordinates, forces on points and frames, holonomic and nonholonomic constraints
    are taken over; its equations need not be formed.
    """
    if not isinstance(method, LagrangesMethod):
        raise ModelError(name, *_other(method, "LagrangesMethod", "from_lagranges_method"))
    n_hol = len(method._hol_coneqs)
    made = from_lagrangian(
        name,
        method._L,
        list(method.q),
        holonomic=list(method._hol_coneqs),
        nonholonomic=list(method.coneqs)[n_hol:],
        parameters=parameters,
        inputs=inputs,
        names=names,
    )
    _loads(made, method.forcelist, method.inertial, {})
    return made


def from_system(
    name: str,
    system: Any,
    *,
    parameters: Parameters | None = None,
    inputs: Sequence[Any] = (),
    names: Names | None = None,
) -> Translated:
    """A model from a `sympy.physics.mechanics.System` of bodies, joints, loads and actuators.

    Generalized speeds are replaced by the coordinates' rates with the kinematic equations;
    potential energies belong to the bodies, as for SymPy's Lagrangian. A load that is a constant
    force in the system's frame, weight above all, becomes a potential as well, so that the energy
    of a run contains it.
    """
    if not isinstance(system, System):
        raise ModelError(name, *_other(system, "System", "from_system"))
    speeds = list(system.u)
    rates: dict[Any, Any] = {}
    if speeds:
        solved = sp.solve(list(system.kdes), speeds, dict=True)
        if len(solved) != 1 or len(solved[0]) != len(speeds):
            raise ModelError(
                name,
                "kinematic equations of the system",
                "do not give the speeds",
                "Add one kde for each generalized speed",
            )
        rates = solved[0]
    T_V = Lagrangian(system.frame, *system.bodies)
    made = from_lagrangian(
        name,
        _scalar(T_V).subs(rates),
        list(system.q),
        holonomic=[e.subs(rates) for e in system.holonomic_constraints],
        nonholonomic=[e.subs(rates) for e in system.nonholonomic_constraints],
        parameters=parameters,
        inputs=inputs,
        names=names,
    )
    loads = [*system.loads, *(load for a in system.actuators for load in a.to_loads())]
    _loads(made, _without_weights(made, loads, system), system.frame, rates)
    return made


def _called(model: str, things: Iterable[Any], names: Names) -> dict[Any, str]:
    """The name of every coordinate, parameter and input: given, or its own."""
    found = {x: str(getattr(getattr(x, "func", None), "__name__", x)) for x in things}
    found |= {x: x.name for x in found if isinstance(x, sp.Symbol)}
    # elements of matrix symbols and indexed symbols: A[0, 1] is A_0_1
    found |= {
        x: re.sub(r"\W+", "_", str(x)).strip("_")
        for x in found
        if isinstance(x, (sp.Indexed, MatrixElement))
    }
    strange = [x for x in names if x not in found]
    if strange:
        raise ModelError(
            model,
            f"names of '{strange[0]}'",
            "it is no coordinate, parameter or input",
            f"There are: {', '.join(str(x) for x in found)}",
        )
    for x, text in (found | dict(names)).items():
        if not (text.isascii() and text.isidentifier()):
            raise ModelError(
                model,
                f"'{text}'",
                "is no name that C and Python know",
                f'Call it otherwise: names={{{x}: "{_ascii(text)}"}}',
            )
    return found | dict(names)


def _ascii(text: str) -> str:
    """A name near to one that is none: primes are counted, signs left out."""
    spelled = text.replace("''", "_2").replace("'", "_1")
    spelled = "".join(
        unicodedata.name(c, "").rpartition(" ")[2].lower() if not c.isascii() else c
        for c in spelled
    )
    return re.sub(r"\W+", "_", spelled).strip("_") or "x"


def _other(thing: Any, wanted: str, function: str) -> tuple[str, str, str]:
    """Problem and remedy where an object of another of SymPy's methods is given."""
    kind = type(thing).__name__
    remedy = f"Give {function} a {wanted} of sympy.physics.mechanics"
    if isinstance(thing, KanesMethod):
        remedy = (
            "Kane's equations hold no Lagrangian: put the same bodies, loads and constraints "
            "into a sympy.physics.mechanics.System for from_system, or give from_lagrangian "
            "T - V and the forces"
        )
    elif isinstance(thing, LagrangesMethod):
        remedy = "Use from_lagranges_method"
    elif isinstance(thing, System):
        remedy = "Use from_system"
    return f"the object of type {kind}", f"is no {wanted}", remedy


def _scalar(lagrangian: Any) -> Any:
    return lagrangian[0] if isinstance(lagrangian, sp.MatrixBase) else sp.sympify(lagrangian)


def _constraints(made: Translated, holonomic: Iterable[Any], nonholonomic: Iterable[Any]) -> None:
    for k, g in enumerate(holonomic):
        made.model.constraint(f"holonomic_{k}", made.translate(g))
    for k, gamma in enumerate(nonholonomic):
        made.model.velocity_constraint(f"nonholonomic_{k}", made.translate(gamma))


def _without_weights(made: Translated, loads: Iterable[Any], system: System) -> list[Any]:
    """The loads that are no constant forces; those become potentials -F . r of their points."""
    m = made.model
    rest = []
    for place, vector in loads:
        if isinstance(place, ReferenceFrame):
            rest.append((place, vector))
            continue
        constant = vector.to_matrix(system.frame)
        if constant.atoms(AppliedUndef, sp.Derivative) or constant.has(dynamicsymbols._t):
            rest.append((place, vector))
            continue
        force = [made.translate(c) for c in constant]
        try:
            position = place.pos_from(system.fixed_point).to_matrix(system.frame)
            r = [made.translate(c) for c in position]
        except (ValueError, ModelError):
            r = []  # nobody said where the point is: its velocity alone is known
        if not r:
            rest.append((place, vector))
            continue
        m.lagrangian = m.lagrangian + sum(f * x for f, x in zip(force, r, strict=True))
    return rest


def _loads(made: Translated, loads: Iterable[Any], frame: Any, rates: dict[Any, Any]) -> None:
    """Generalized forces of forces on points and torques on frames: f . dv/dv_k."""
    m = made.model
    for place, vector in loads:
        moving = place.ang_vel_in(frame) if isinstance(place, ReferenceFrame) else place.vel(frame)
        velocity = [made.translate(c.subs(rates)) for c in moving.to_matrix(frame)]
        force = [made.translate(c.subs(rates)) for c in vector.to_matrix(frame)]
        m.force(
            [
                sum((f * sp.diff(c, v) for f, c in zip(force, velocity, strict=True)), sp.S.Zero)
                for v in m.velocities
            ]
        )
