"""What a user declares of constraints, contacts and friction."""

from collections.abc import Mapping, Sequence
from typing import Any

from signorini.codegen.frontend.declarations import MOTIONS, ContactDeclaration, Reaction
from signorini.codegen.frontend.drawing import Drawing, points_of, tip_of
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.names import check_identifier
from signorini.codegen.frontend.symbols import is_number


class Laws:
    """The set-valued part of a model: constraints, contacts and friction with their laws."""

    def __init__(self, name: str) -> None:
        self.name = check_identifier(str(name), "its name", name, symbol=False)
        self.constraints: list[tuple[str, list[Any]]] = []
        self.velocity_constraints: list[tuple[str, list[Any]]] = []
        self.contacts: list[ContactDeclaration] = []
        self.compliances: dict[str, tuple[Any, Any]] = {}
        self.drawing = Drawing()
        self._taken: dict[str, str] = {"t": "symbol, the time"}

    def constraint(self, name: str, g: Any, *, compliance: Any = None, relaxation: Any = 0) -> None:
        """Add bilateral position constraints g(t, q) = 0 (13), rigid or compliant.

        Parameters
        ----------
        name : str
            ``traj["name.force"]`` are their mean forces.
        g : expression or list of expressions
            Of t, q and parameters. Redundant ones are solved.
        compliance : number or expression, optional
            Inverse c >= 0 of the stiffness of every row [m/N]: ``g + relaxation dg/dt + c force =
            0``, implicit, without a limit on the step size, and of first order. c = 0 is the rigid
            constraint. An expression is taken at the start of a step.
        relaxation : number or expression, optional
            Damping over stiffness [s], >= 0, with a compliance.

        Raises
        ------
        ModelError
            For a name that is taken, something else than scalars, or a relaxation alone.
        """
        self._claim(name, "constraint", symbol=False)
        self._yields(name, "constraint", compliance, relaxation)
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
        compliance: Any = None,
        relaxation: Any = 0,
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
        compliance : number or expression, optional
            Inverse c >= 0 of the contact's stiffness [m/N], without restitution: ``0 <= g_N +
            relaxation dg_N/dt + c force``, ``0 <= force`` and one of them zero, implicit, without
            a limit on the step size, and of first order. A contact that lasts several steps springs
            back, a shorter one hardly does; c = 0 is the rigid contact. Friction is as ever.
        relaxation : number or expression, optional
            Damping over stiffness [s], >= 0, with a compliance.
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
        if compliance is not None and not (
            impact == "newton" and all(is_number(e) and float(e) == 0 for e in (e_N, e_F))
        ):
            raise ModelError(
                self.name,
                f"compliance of contact '{name}'",
                f"is given beside e_N = {e_N}, e_F = {e_F}, impact={impact!r}",
                "A compliant contact springs back by its stiffness: leave restitution out",
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
        self._yields(name, "contact", compliance, relaxation)
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

    def _yields(self, name: str, kind: str, compliance: Any, relaxation: Any) -> None:
        if compliance is not None:
            self.compliances[name] = (compliance, relaxation)
        elif not (is_number(relaxation) and float(relaxation) == 0):
            raise ModelError(
                self.name,
                f"relaxation of {kind} '{name}'",
                f"is {relaxation} without a compliance",
                "Give compliance=..., which may be 0",
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

        The multiplier of a constraint is a force where the constraint is a length of unit slope:
        ``sqrt(x**2 + y**2) - R``. Of ``x**2 + y**2 - R**2`` it is 1 / (2 R) of the force.

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
