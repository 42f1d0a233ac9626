"""Models from SymPy's mechanics: `dynamicsymbols`, `LagrangesMethod`, `System`."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import sympy as sp
from signorini.codegen.errors import ModelError
from signorini.codegen.model import Model
from signorini.codegen.symbols import par
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Lagrangian, dynamicsymbols
from sympy.physics.vector import ReferenceFrame

Parameters = Mapping[sp.Symbol, float | par]


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
    ) -> None:
        self.model = m = Model(name)
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
        names = [c.func.__name__ for c in coordinates]
        symbols = m.coordinates(" ".join(names))
        for coordinate, symbol, velocity in zip(coordinates, symbols, m.velocities, strict=True):
            self._rules[coordinate] = symbol
            self._rules[coordinate.diff(t)] = velocity
        given = dict(parameters or {})
        for symbol in given:
            if not isinstance(symbol, sp.Symbol):
                raise ModelError(
                    name, f"parameter '{symbol}'", "is no SymPy symbol", "Give {symbol: default}"
                )
        for symbol, made in zip(
            given, m.parameters(**{s.name: v for s, v in given.items()}), strict=True
        ):
            self._rules[symbol] = made
        if inputs:
            functions = [getattr(u, "func", u).__name__ for u in inputs]
            for u, made in zip(inputs, m.inputs(" ".join(functions)), strict=True):
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
        atoms = result.atoms(AppliedUndef, sp.Derivative, sp.Symbol)
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

    Returns
    -------
    Translated
        The model and the translation of gaps and slip velocities.
    """
    made = Translated(name, list(q), parameters, inputs)
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
) -> Translated:
    """A model from the data of a `sympy.physics.mechanics.LagrangesMethod`.

    Lagrangian, coordinates, forces on points and frames, holonomic and nonholonomic constraints
    are taken over; its equations need not be formed.
    """
    n_hol = len(method._hol_coneqs)
    made = from_lagrangian(
        name,
        method._L,
        list(method.q),
        holonomic=list(method._hol_coneqs),
        nonholonomic=list(method.coneqs)[n_hol:],
        parameters=parameters,
        inputs=inputs,
    )
    _loads(made, method.forcelist, method.inertial, {})
    return made


def from_system(
    name: str,
    system: Any,
    *,
    parameters: Parameters | None = None,
    inputs: Sequence[Any] = (),
) -> Translated:
    """A model from a `sympy.physics.mechanics.System` of bodies, joints, loads and actuators.

    Generalized speeds are replaced by the coordinates' rates with the kinematic equations;
    potential energies belong to the bodies, as for SymPy's Lagrangian.
    """
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
    )
    loads = [*system.loads, *(load for a in system.actuators for load in a.to_loads())]
    _loads(made, loads, system.frame, rates)
    return made


def _scalar(lagrangian: Any) -> Any:
    return lagrangian[0] if isinstance(lagrangian, sp.MatrixBase) else sp.sympify(lagrangian)


def _constraints(made: Translated, holonomic: Iterable[Any], nonholonomic: Iterable[Any]) -> None:
    for k, g in enumerate(holonomic):
        made.model.constraint(f"holonomic_{k}", made.translate(g))
    for k, gamma in enumerate(nonholonomic):
        made.model.velocity_constraint(f"nonholonomic_{k}", made.translate(gamma))


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
