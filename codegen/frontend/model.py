"""The front end: a user declares a mechanical model."""

import pickle
from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
from signorini.codegen.frontend import equations
from signorini.codegen.frontend.declarations import MOTIONS, ContactDeclaration, Reaction
from signorini.codegen.frontend.drawing import Drawing, points_of, tip_of
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.names import check_identifier, split_names
from signorini.codegen.frontend.symbols import CasADi, SymPy, World, is_number, par
from signorini.codegen.frontend.table import all_known
from signorini.codegen.frontend.vouched import all_vouched, vouch


class Model:
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
        self.name = check_identifier(str(name), "its name", name, symbol=False)
        worlds: dict[str, type] = {"sympy": SymPy, "casadi": CasADi}
        if symbols not in worlds:
            raise ModelError(
                self.name, "Model(symbols=...)", f"got {symbols!r}", "Give 'sympy' or 'casadi'"
            )
        self.world: World = worlds[symbols]()
        self.doc = ""
        self.coordinate_names: list[str] = []
        self.coordinate_units: list[str] = []
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
        self.constraints: list[tuple[str, list[Any]]] = []
        self.velocity_constraints: list[tuple[str, list[Any]]] = []
        self.contacts: list[ContactDeclaration] = []
        self.outputs: list[tuple[str, Any]] = []
        self.start: dict[str, Any] | None = None
        self.drawing = Drawing()
        self.suggested: dict[str, Any] = {}
        self._taken: dict[str, str] = {"t": "symbol, the time"}
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

    def constraint(self, name: str, g: Any) -> None:
        """Add bilateral position constraints g(t, q) = 0 (13).

        Parameters
        ----------
        name : str
            ``traj["name.force"]`` are their mean forces.
        g : expression or list of expressions
            Of t, q and parameters. Redundant ones are solved.

        Raises
        ------
        ModelError
            For a name that is taken, or something else than scalars.
        """
        self._claim(name, "constraint", symbol=False)
        self.constraints.append((name, self._list(f"constraint '{name}'", g)))

    def velocity_constraint(self, name: str, gamma: Any) -> None:
        """Add bilateral velocity constraints gamma(t, q, v) = 0 (13), affine in v.

        Parameters
        ----------
        name : str
            ``traj["name.force"]`` are their mean forces.
        gamma : expression or list of expressions
            Of t, q, v and parameters; at the start of a run they hold.

        Raises
        ------
        ModelError
            For a name that is taken, or something else than scalars. `build` refuses expressions
            that are not affine in v.
        """
        self._claim(name, "velocity constraint", symbol=False)
        self.velocity_constraints.append((name, self._list(f"velocity_constraint '{name}'", gamma)))

    def contact(
        self,
        name: str,
        *,
        g_N: Any,
        gamma_F: Any = None,
        mu: Any = 0,
        e_N: Any = 0,
        e_F: Any = 0,
        guard: Any = None,
        impact: str = "newton",
        mu_at: str = "start",
        rolling: tuple[Any, Any] | None = None,
        drilling: tuple[Any, Any] | None = None,
        coupling: str | None = None,
        never: Mapping[str, str] | None = None,
        at: Sequence[Any] | None = None,
        normal: Sequence[Any] | None = None,
    ) -> None:
        """Add a unilateral contact with Newton impacts and Coulomb friction.

        Parameters
        ----------
        name : str
            Name of the contact.
        g_N : expression
            Gap g_N(t, q) >= 0.
        gamma_F : None, expression, or list of one or two expressions
            Slip velocity gamma_F(t, q, v), affine in v: frictionless, planar or spatial.
        mu : number or expression of parameters, or a pair of them
            Friction coefficient >= 0. A pair gives one coefficient for each of the two slip
            components: friction lies in the ellipse ``|(P_F1 / mu_1, P_F2 / mu_2)| <= P_N`` and
            takes as much power from the slip as it can (anisotropic friction). Both are positive,
            or both zero.
        e_N, e_F : number or expression of parameters
            Normal and tangential restitution in [0, 1].
        guard : expression of t and q, optional
            The contact exists in a step iff ``guard(t_n, q_n) >= 0`` at the start of the step.
        mu_at : {"start", "stages"}
            Where a coefficient that depends on t, q, v or u is taken. At the start of a step it is
            known; at the stages it is part of the iteration, with its derivative, and has the order
            of the scheme where it is smooth.
        impact : {"newton", "poisson"}
            What e_N restores. Newton: the normal velocity. Poisson: of the percussion in a
            compression, solved without restitution over all contacts, at least the share e_N in an
            expansion; with friction, and where several contacts are struck, energy is not gained.
            It has no tangential restitution.
        rolling, drilling : pair (radius, rate), optional
            Resistance to rolling and to spinning on the spot. `radius` >= 0 [m], a number or an
            expression of parameters; `rate` the relative angular velocity [rad/s] affine in v: of
            rolling one component in the plane, or a list of two along the tangents in space; of
            drilling the one along the normal. While the rate is zero the contact carries any
            torque up to radius times its normal force, else just that, against the rate. They
            are friction elements of their own (see `friction`), called NAME_rolling and
            NAME_drilling.
        coupling : {None, "contensou"}
            How sliding and drilling in space share what the contact can carry: each has its own
            bound, or both lie in the ellipsoid ``|(P_F / mu, M / radius)| <= P_N`` with the
            largest dissipation, so that a body that spins slides as if with little friction
            (Contensou). Then they are one law, and the spin is the third component of ``P_F``.
        never : mapping from kind of motion to reason, optional
            Motions that this contact cannot make, e.g. ``{"sticking": "its motion is given"}``:
            `signorini.check` does not ask for them, repeats the reason, and fails if it sees one.
            Kinds are open, impacting, separating, persisting, sticking, slipping, guard on,
            guard off.
        at, normal : sequences of 2 or 3 expressions of t, q and parameters, optional
            For pictures: where the contact is [m], and the unit vector along which the force of
            P_N acts there.

        Raises
        ------
        ModelError
            For a missing gap, friction without a slip velocity, or an unknown kind.
        """
        if g_N is None:
            raise ModelError(
                self.name, f"contact '{name}'", "g_N is None", "Give the gap g_N(t, q)"
            )
        if gamma_F is None:
            for law, value in (("mu", mu), ("e_F", e_F)):
                if isinstance(value, (list, tuple)) or not is_number(value) or float(value) != 0:
                    raise ModelError(
                        self.name,
                        f"{law} of contact '{name}'",
                        f"is {value}, but the contact has no slip velocity gamma_F",
                        "Give gamma_F, or leave out mu and e_F for a frictionless contact",
                    )
        if mu_at not in ("start", "stages") or (
            mu_at == "stages" and (coupling is not None or isinstance(mu, (list, tuple)))
        ):
            raise ModelError(
                self.name,
                f"mu_at of contact '{name}'",
                f"is {mu_at!r}",
                "Give 'start', or for one coefficient without a coupling 'stages'",
            )
        if impact not in ("newton", "poisson"):
            raise ModelError(
                self.name,
                f"impact of contact '{name}'",
                f"is {impact!r}",
                "Give 'newton' or 'poisson'",
            )
        if impact == "poisson" and not (is_number(e_F) and float(e_F) == 0):
            raise ModelError(
                self.name,
                f"e_F of contact '{name}'",
                f"is {e_F}, and Poisson's law has no tangential restitution here",
                "Leave it out, or take impact='newton'",
            )
        if coupling is not None:
            mu, gamma_F = self._coupled(name, coupling, mu, gamma_F, drilling)
            drilling = None
        self._add_contact(
            name,
            g_N,
            gamma_F,
            never,
            mu=mu,
            e_N=e_N,
            e_F=e_F,
            guard=guard,
            impact=impact,
            mu_at=mu_at,
        )
        for kind, resistance in (("rolling", rolling), ("drilling", drilling)):
            if resistance is not None:
                radius, rate = self._resistance(f"{kind} of contact '{name}'", resistance)
                self.friction(f"{name}_{kind}", gamma_F=rate, mu=radius, pressed_by=name)
        if at is not None:
            (place,) = points_of(self.name, f"contact '{name}'", [at])
            tips = [] if normal is None else [tip_of(self.name, f"contact '{name}'", place, normal)]
            self.drawing.add("contact", [place, *tips], name)
        elif normal is not None:
            raise ModelError(
                self.name,
                f"contact '{name}'",
                "has a normal but no place",
                "Give at=..., where the normal starts",
            )

    def one_way(
        self,
        name: str,
        gamma: Any,
        *,
        e_N: Any = 0,
        guard: Any = None,
        never: Mapping[str, str] | None = None,
    ) -> None:
        """Let a velocity go one way only: a freewheel, a ratchet with fine teeth, a check valve.

        ``0 <= gamma``, ``0 <= P`` and one of them zero, at the stages and at the end of each step.
        It is a contact without a place: ``traj["name.state"]`` is open while it runs free, closed
        while it holds, ``traj["name.force_N"]`` the force or torque that holds it.

        Parameters
        ----------
        name : str
            Of the contact.
        gamma : expression
            gamma(t, q, v) >= 0, affine in v.
        e_N : number or expression
            Restitution where it is struck backwards.
        guard, never
            As for `contact`.

        Raises
        ------
        ModelError
            For a name that is taken or an unknown kind of motion. `build` refuses an expression
            that is not affine in v, and located events.
        """
        self._add_contact(name, gamma, None, never, e_N=e_N, guard=guard, one_way=True)

    def friction(
        self,
        name: str,
        *,
        gamma_F: Any,
        bound: Any = None,
        mu: Any = None,
        pressed_by: str | Reaction | None = None,
        never: Mapping[str, str] | None = None,
    ) -> None:
        """Add friction with a given force bound, or pressed by a contact or a constraint.

        A brake has a bound. Friction that a contact presses beside that contact's own has a
        coefficient: resistance to rolling and drilling, a brake shoe, a second surface on the same
        pad. With it ``|P_F| <= mu P_N``, solved together with P_N. Dry friction in a slot, on a
        screw, in a joint is pressed by what a constraint carries, ``|P_F| <= mu |P_g|``.

        Parameters
        ----------
        name : str
            Name of the friction element.
        gamma_F : expression or list of one or two expressions
            Slip velocity gamma_F(t, q, v), affine in v.
        bound : number or expression of t, q, u and parameters, or a multiple of `reaction`
            Largest friction force; a negative value counts as zero. ``mu * m.reaction("joint")``
            is short for `mu` and `pressed_by`.
        mu : number or expression, or a pair of them
            Instead of a bound, with `pressed_by`: friction coefficient >= 0, as for `contact`; a
            length [m] where gamma_F is an angular velocity.
        pressed_by : str or Reaction
            Name of the contact or constraint, declared before, or some rows of a constraint.
        never : mapping from kind of motion to reason, optional
            As for `contact`.

        Raises
        ------
        ModelError
            For a missing slip velocity, an unknown contact, constraint or kind of motion, or a
            bound and a coefficient at once.
        """
        what = f"friction '{name}'"
        if isinstance(bound, Reaction):
            bound, mu, pressed_by = None, bound.factor, bound
        if (bound is None) == (mu is None) or (mu is None) != (pressed_by is None):
            raise ModelError(
                self.name,
                what,
                "needs either a bound, or a coefficient mu and what presses it",
                "Give bound=..., or mu=... and pressed_by=...",
            )
        blocks = [*self.constraints, *self.velocity_constraints]
        if pressed_by is None:
            self._add_contact(name, None, gamma_F, never, bound=bound)
        elif isinstance(pressed_by, Reaction) or any(pressed_by == b for b, _ in blocks):
            load = self.reaction(pressed_by) if isinstance(pressed_by, str) else pressed_by
            self._add_contact(name, None, gamma_F, never, mu=mu, load=load)
        else:
            gaps = [c.name for c in self.contacts if c.g_N is not None]
            if pressed_by not in gaps:
                raise ModelError(
                    self.name,
                    what,
                    f"pressed_by is {pressed_by!r}, but nothing of that name stands before it",
                    f"There is: {', '.join((*gaps, *(b for b, _ in blocks)))}"
                    if gaps or blocks
                    else "Declare the contact or constraint first",
                )
            self._add_contact(name, None, gamma_F, never, mu=mu, pressed_by=pressed_by)
        if not self.contacts[-1].gamma_F:
            raise ModelError(self.name, what, "has no slip velocity", "Give gamma_F(t, q, v)")

    def coupling(self, name: str, g: Any, *, play: Any = None, e_N: Any = 0) -> None:
        """Couple motions by gears, racks, screws, belts: ``g = 0``, or ``|g| <= play / 2``.

        Parameters
        ----------
        name : str
            Of the constraint; with play of two contacts, name_above and name_below.
        g : expression
            What vanishes: ``R_1 * phi_1 + R_2 * phi_2`` for two gears, ``x - R * phi`` for a rack
            and pinion, ``x - pitch * phi / (2 * pi)`` for a screw, ``z_s * phi_s + z_r * phi_r -
            (z_s + z_r) * phi_c`` for a planetary gear, ``phi_2 - k * phi_1`` for a joint that
            mimics another.
        play : expression of parameters, optional
            Width of the backlash, in the unit of g.
        e_N : number or expression of parameters
            Restitution of the flanks.

        Raises
        ------
        ModelError
            For a name that is taken.
        """
        if play is None:
            self.constraint(name, g)
            return
        self.contact(f"{name}_above", g_N=play / 2 - g, e_N=e_N)
        self.contact(f"{name}_below", g_N=play / 2 + g, e_N=e_N)

    def reaction(self, name: str, first: int = 0, count: int | None = None) -> Reaction:
        """What a constraint carries, for the bound of `friction`: the norm of its force.

        Parameters
        ----------
        name : str
            Of a constraint or velocity constraint, declared before.
        first, count : int, optional
            The rows that count, where it has others: of a hinge in space the first three are the
            force, the rest torques.

        Returns
        -------
        Reaction
            To be multiplied with a coefficient: ``bound=mu * m.reaction("joint")``.

        Raises
        ------
        ModelError
            For a name that is none.
        """
        blocks = [b for b, _ in (*self.constraints, *self.velocity_constraints)]
        if name not in blocks:
            raise ModelError(
                self.name,
                f"reaction({name!r})",
                "there is no such constraint before it",
                f"Constraints are: {', '.join(blocks)}" if blocks else "Declare it first",
            )
        return Reaction(name, first, count)

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

    def _claim(self, name: str, kind: str, symbol: bool = True) -> None:
        what = f"{kind} '{name}'"
        check_identifier(self.name, what, name, symbol)
        if name in self._taken:
            raise ModelError(
                self.name,
                what,
                f"the name is used twice, first as a {self._taken[name]}",
                "Give every symbol, constraint, contact and output a name of its own",
            )
        self._taken[name] = kind

    def _add_contact(
        self, name: str, g_N: Any, gamma_F: Any, never: Mapping[str, str] | None, **laws: Any
    ) -> None:
        kind = "friction" if g_N is None else "contact"
        self._claim(name, kind, symbol=False)
        components = [] if gamma_F is None else self._list(f"gamma_F of {kind} '{name}'", gamma_F)
        if len(components) > (3 if isinstance(laws.get("mu"), tuple) else 2):
            raise ModelError(
                self.name,
                f"gamma_F of {kind} '{name}'",
                f"has {len(components)} components",
                "Give none (frictionless), one (planar) or two (spatial)",
            )
        waived = {} if never is None else never
        if not isinstance(waived, Mapping) or not all(
            k in MOTIONS and isinstance(reason, str) and reason for k, reason in waived.items()
        ):
            raise ModelError(
                self.name,
                f"never of {kind} '{name}'",
                f"is {never!r}",
                f"Give a reason for each of these kinds of motion: {', '.join(MOTIONS)}",
            )
        self.contacts.append(ContactDeclaration(name, g_N, components, **laws, never=dict(waived)))

    def _coupled(
        self, name: str, coupling: str, mu: Any, gamma_F: Any, drilling: Any
    ) -> tuple[Any, list[Any]]:
        """Coefficients and slip velocities of sliding and drilling as one law."""
        what = f"coupling of contact '{name}'"
        if coupling != "contensou":
            raise ModelError(self.name, what, f"is {coupling!r}", "Give 'contensou', or nothing")
        sliding = [] if gamma_F is None else self._list(what, gamma_F)
        if len(sliding) != 2 or drilling is None or isinstance(mu, (list, tuple)):
            raise ModelError(
                self.name,
                what,
                "couples sliding with drilling, and one of them is missing",
                "Give two slip velocities, one mu, and drilling=(radius, rate)",
            )
        radius, rate = self._resistance(f"drilling of contact '{name}'", drilling)
        return (mu, mu, radius), [*sliding, *rate]

    def _resistance(self, what: str, law: Any) -> tuple[Any, Any]:
        if not isinstance(law, (list, tuple)) or len(law) != 2:
            raise ModelError(
                self.name,
                what,
                f"is {law!r}",
                "Give a pair: its radius [m], and the relative angular velocity",
            )
        rate = self._list(what, law[1])
        most = 2 if what.startswith("rolling") else 1
        if not 1 <= len(rate) <= most:
            raise ModelError(
                self.name,
                what,
                f"has {len(rate)} angular velocities",
                "Give one (two along the tangents for rolling in space)",
            )
        return law[0], rate

    def _list(self, what: str, expressions: Any) -> list[Any]:
        """One expression, a list, or a column matrix, as a list."""
        shape = getattr(expressions, "shape", None)
        if shape is not None and shape != ():
            if (len(shape) == 2 and 1 not in shape) or len(shape) > 2:
                raise ModelError(
                    self.name,
                    what,
                    f"has shape {'x'.join(map(str, shape))}",
                    "Give a list or a column",
                )
            count = 1
            for extent in shape:
                count *= int(extent)
            return [expressions[k] for k in range(count)]
        if isinstance(expressions, (list, tuple)):
            return list(expressions)
        return [expressions]

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
