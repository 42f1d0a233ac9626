"""The front end: a user declares a mechanical model."""

import pickle
from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
from signorini.codegen.frontend import equations
from signorini.codegen.frontend.drawing import points_of, tip_of
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.laws import Laws
from signorini.codegen.frontend.names import split_names
from signorini.codegen.frontend.symbols import CasADi, SymPy, World, is_number, par
from signorini.codegen.frontend.table import all_known
from signorini.codegen.frontend.vouched import all_vouched, vouch


class Model(Laws):
    """A mechanical model with constraints and contacts, written symbolically.

    Parameters
    ----------
    name : str
        Name of the model and prefix of everything in the generated C: a C identifier.
    symbols : {"sympy", "casadi"}
        The symbol world: SymPy expressions or CasADi SX.

    Attributes
    ----------
    doc : str
        One line on the model, for listings and the generated README.

    Notes
    -----
    The quantities are those of Capobianco, Harsch and Leyendecker: L(t, q, v), f(t, q, v, u),
    g(t, q) = 0, gamma(t, q, v) = 0, gaps g_N(t, q) >= 0 and slip velocities gamma_F(t, q, v).

    Examples
    --------
    >>> import signorini as sg
    >>> m = sg.Model("particle")
    >>> (y,) = m.coordinates("y")
    >>> (vy,) = m.velocities
    >>> (mass,) = m.parameters(mass=1.0)
    >>> m.lagrangian = mass * vy**2 / 2 - 9.81 * mass * y
    >>> m.contact("floor", g_N=y, e_N=0.5)
    >>> m.initial_state(q=[1.0])
    """

    def __init__(self, name: str, symbols: str = "sympy") -> None:
        super().__init__(name)
        worlds: dict[str, type] = {"sympy": SymPy, "casadi": CasADi}
        if symbols not in worlds:
            raise ModelError(
                self.name, "Model(symbols=...)", f"got {symbols!r}", "Give 'sympy' or 'casadi'"
            )
        self.world: World = worlds[symbols]()
        self.doc = ""
        self.coordinate_names: list[str] = []
        self.coordinate_units: list[str] = []
        self.bodies: list[tuple[str, tuple[int, ...]]] = []  # names, places of coordinates
        self.velocity_names: list[str] = []
        self.parameter_table: dict[str, par] = {}
        self.input_names: list[str] = []
        self.q: list[Any] = []
        self.v: list[Any] = []
        self.par: list[Any] = []
        self.u: list[Any] = []
        self.L: Any = None
        self._L_is_read = False
        self.forces: list[list[Any]] = []
        self.outputs: list[tuple[str, Any]] = []
        self.start: dict[str, Any] | None = None
        self.suggested: dict[str, Any] = {}
        self._t = self.world.symbol("t")

    def __copy__(self) -> "Model":
        # its own declarations are shared, so are the symbols in them
        made = type(self).__new__(type(self))
        made.__dict__.update(self.__dict__)
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        # CasADi's symbols keep what they are to each other only within one context
        with ca.global_pickle_context():
            # and expressions do not hold what was vouched for, and know a table by its name alone
            beside = (all_known(), all_vouched()) if self.world.name == "casadi" else ([], [])
            return _unpickled, (type(self), pickle.dumps((*beside, self.__dict__)))

    def __repr__(self) -> str:
        return equations.text(self)

    def _repr_markdown_(self) -> str:
        return equations.markdown(self)

    # --- symbols ---------------------------------------------------------------------------------

    def coordinates(
        self, names: str, velocities: str | None = None, *, units: str | None = None
    ) -> tuple[Any, ...]:
        """Declare generalized coordinates q and their velocities v.

        Parameters
        ----------
        names : str
            Names separated by spaces or commas, ``"x y phi"``. Several calls add up.
        velocities : str, optional
            As many names for the velocities; ``x_dot`` ... by default.
        units : str, optional
            A unit for each name, ``"m m rad"``: plots get a panel for each unit.

        Returns
        -------
        tuple of symbols
            One symbol for each name, also where there is one name only.

        Raises
        ------
        ModelError
            For a name that is taken or none of C, or numbers of names that differ.
        """
        what = "coordinates(...)"
        q_names = split_names(self.name, what, names)
        v_names = (
            [f"{name}_dot" for name in q_names]
            if velocities is None
            else split_names(self.name, what, velocities)
        )
        if not q_names:
            raise ModelError(self.name, what, "no name given", 'Give names, e.g. "x y phi"')
        if len(v_names) != len(q_names):
            raise ModelError(
                self.name,
                what,
                f"{len(q_names)} coordinates but {len(v_names)} velocities",
                "Give one velocity name for each coordinate",
            )
        q_units = [""] * len(q_names) if units is None else str(units).replace(",", " ").split()
        if len(q_units) != len(q_names):
            raise ModelError(
                self.name,
                what,
                f"{len(q_names)} coordinates but {len(q_units)} units",
                'Give one unit for each coordinate, e.g. units="m m rad"',
            )
        for name in q_names:
            self._claim(name, "coordinate")
        for name in v_names:
            self._claim(name, "velocity")
        symbols = tuple(self.world.symbol(name) for name in q_names)
        self.q.extend(symbols)
        self.v.extend(self.world.symbol(name) for name in v_names)
        self.coordinate_names += q_names
        self.coordinate_units += q_units
        self.velocity_names += v_names
        return symbols

    @property
    def velocities(self) -> tuple[Any, ...]:
        """The symbols of v, in the order of the coordinates."""
        return tuple(self.v)

    @property
    def time(self) -> Any:
        """The symbol of t."""
        return self._t

    def parameters(self, /, **defaults: float | par) -> tuple[Any, ...]:
        """Declare run-time parameters with their defaults, numbers or `par` declarations.

        Parameters
        ----------
        **defaults : float or par
            By name.

        Returns
        -------
        tuple of symbols
            In the order given.

        Raises
        ------
        ModelError
            For a name that is taken or none of C, or a default outside its bounds.
        """
        symbols = []
        for name, value in defaults.items():
            what = f"parameter '{name}'"
            self._claim(name, "parameter")
            declared = value if isinstance(value, par) else par(value)
            self._check_parameter(what, declared)
            self.parameter_table[name] = declared
            symbols.append(self.world.symbol(name))
        self.par.extend(symbols)
        return tuple(symbols)

    def inputs(self, names: str) -> tuple[Any, ...]:
        """Declare inputs u, held constant over each step.

        Parameters
        ----------
        names : str
            Names separated by spaces or commas.

        Returns
        -------
        tuple of symbols

        Raises
        ------
        ModelError
            For a name that is taken or none of C.
        """
        u_names = split_names(self.name, "inputs(...)", names)
        for name in u_names:
            self._claim(name, "input")
        symbols = tuple(self.world.symbol(name) for name in u_names)
        self.u.extend(symbols)
        self.input_names += u_names
        return symbols

    # --- equations -------------------------------------------------------------------------------

    @property
    def lagrangian(self) -> Any:
        """L(t, q, v) = T - V; assign it once, or add to it with ``m.lagrangian += ...``."""
        self._L_is_read = True
        return self.L

    @lagrangian.setter
    def lagrangian(self, L: Any) -> None:
        # an addition reads it first; what is assigned unread would be lost
        if self.L is not None and not self._L_is_read:
            raise ModelError(
                self.name,
                "lagrangian",
                "it is assigned a second time, and what it was would be lost",
                "Assign it once, or add to it: m.lagrangian += ... (with bodies: "
                "world.add_energy(T, V))",
            )
        self.L = L
        self._L_is_read = False

    def force(self, f: Sequence[Any] | Mapping[str, Any]) -> None:
        """Add generalized forces f(t, q, v, u) that L does not contain.

        Parameters
        ----------
        f : sequence of n_q expressions, or mapping from coordinate name to expression
            Several calls add up. [N] for a length, [N m] for an angle.

        Raises
        ------
        ModelError
            For another number of entries, or a name that is no coordinate.
        """
        self.forces.append(self._column("force(...)", f))

    def output(self, name: str, expr: Any) -> None:
        """Add a named quantity of t, q, v, u that trajectories carry along.

        Parameters
        ----------
        name : str
            ``traj[name]`` are its values, of shape (n+1,).
        expr : expression

        Raises
        ------
        ModelError
            For a name that is taken.
        """
        self._claim(name, "output", symbol=False)
        self.outputs.append((name, expr))

    def initial_state(self, q: Any, v: Any = None, t: Any = 0) -> None:
        """Give the state a run starts from unless told otherwise.

        Parameters
        ----------
        q, v : sequence of n_q entries, or mapping from name to entry
            Numbers or expressions of parameters; a mapping sets the rest to zero; v is zero by
            default. The mapping for v is keyed by coordinate or velocity name.
        t : number or expression of parameters
            Initial time.
        """
        n = len(self.q)
        self.start = {
            "q": self._column("initial_state(q=...)", q),
            "v": [0] * n if v is None else self._column("initial_state(v=...)", v),
            "t": t,
        }

    def shape(
        self,
        points: Sequence[Sequence[Any]],
        *,
        closed: bool = False,
        radius: Any = None,
        convex: bool = False,
        normal: Sequence[Any] | None = None,
    ) -> None:
        """Add a line through points, or what the options say, to pictures of the model.

        Parameters
        ----------
        points : sequence of points with 2 or 3 expressions of t, q and parameters
            [m]
        closed : bool
            Join the last point to the first: in the plane an area.
        radius : expression of parameters, optional
            Draw circles of this radius around the points instead.
        convex : bool
            Draw the convex body whose corners they are, in any order.
        normal : sequence of 2 or 3 expressions, optional
            Draw the ground instead: a plane through each point, free on the side of this unit
            vector.
        """
        places = points_of(self.name, "shape(...)", points)
        if normal is not None:
            for place in places:
                tip = tip_of(self.name, "shape(...)", place, normal)
                self.drawing.add("plane", [place, tip], by_hand=True)
        else:
            self.drawing.add_shape(places, closed, radius, convex)

    def suggest(self, *, dt: float, t_end: float, inputs: Any = None) -> None:
        """Suggest arguments of ``Stepper.simulate``: the defaults of ``signorini run``.

        Parameters
        ----------
        dt, t_end : float
            Step size and end of a run.
        inputs : callable (t, q, v) -> u, optional
            A controller.

        Raises
        ------
        ModelError
            For a step size or an end that is no positive number.
        """
        for name, value in (("dt", dt), ("t_end", t_end)):
            if not is_number(value) or not 0 < float(value) < float("inf"):
                raise ModelError(
                    self.name, f"suggest({name}=...)", f"is {value!r}", "Give a positive number"
                )
        self.suggested = {"dt": float(dt), "t_end": float(t_end)}
        if inputs is not None:
            self.suggested["inputs"] = inputs

    # --- helpers ---------------------------------------------------------------------------------

    def _column(self, what: str, entries: Any) -> list[Any]:
        n = len(self.q)
        if isinstance(entries, Mapping):
            index = {name: k for k, name in enumerate(self.coordinate_names)}
            index |= {name: k for k, name in enumerate(self.velocity_names)}
            column: list[Any] = [0] * n
            for name, entry in entries.items():
                if name not in index:
                    further = f"; velocities: {' '.join(self.velocity_names)}"
                    raise ModelError(
                        self.name,
                        what,
                        f"there is no coordinate '{name}'",
                        f"Coordinates are: {' '.join(self.coordinate_names)}{further}",
                    )
                column[index[name]] = entry
            return column
        column = self._list(what, entries)
        rates = what == "initial_state(v=...)"
        kind, names = (
            ("velocities", self.velocity_names) if rates else ("coordinates", self.coordinate_names)
        )
        if len(column) != n:
            raise ModelError(
                self.name,
                what,
                f"has {len(column)} entries for {n} {kind} ({' '.join(names)})",
                "Give one entry for each",
            )
        return column

    def _check_parameter(self, what: str, declared: par) -> None:
        values = {"default": declared.default, "min": declared.min, "max": declared.max}
        for key, value in values.items():
            if value is None and key != "default":
                continue
            if not is_number(value) or not abs(float(value)) < float("inf"):  # type: ignore[arg-type]
                raise ModelError(
                    self.name,
                    what,
                    f"its {key} is {value!r}",
                    "Give a finite number or sg.par(number)",
                )
        default = float(declared.default)
        if (declared.min is not None and default < declared.min) or (
            declared.max is not None and default > declared.max
        ):
            raise ModelError(
                self.name,
                what,
                f"its default {default:g} is outside [{declared.min}, {declared.max}]",
                "Change the default or the bounds",
            )


def _unpickled(kind: type[Model], content: bytes) -> Model:
    """A model sent from another process; its symbols are new ones, with the same names."""
    model = kind.__new__(kind)
    with ca.global_unpickle_context():
        _tables, vouched, declared = pickle.loads(content)
        for expression in vouched:
            vouch(expression)
        model.__dict__.update(declared)
    return model
