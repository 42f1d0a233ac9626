"""What plane and space share: forces, springs, contacts between things."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from signorini.bodies.algebra import (
    Vector,
    algebra_of,
    dot,
    is_zero,
    scale,
    subtract,
    total_derivative,
)
from signorini.bodies.frames import Frame, Point
from signorini.bodies.given import positive, unit
from signorini.bodies.looks import Looks
from signorini.bodies.ropes import Pulley, way
from signorini.bodies.shapes import (
    Ellipsoid,
    Plane,
    Round,
    Surface,
    Touch,
    frame_of,
    tangents,
    touch,
)
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import Model


class Scene:
    """Bodies that write a model: every call adds its terms to the model at once.

    Parameters
    ----------
    model : Model
        Gets coordinates, Lagrangian, forces, constraints and contacts.
    gravity : sequence of expressions, optional
        Acceleration of free fall in the fixed frame [m/s^2].
    """

    dimension: int

    def __init__(self, model: Model, gravity: Sequence[Any] | None = None) -> None:
        self.model = model
        self.algebra = algebra_of(model)
        zero = (0,) * self.dimension
        if model.lagrangian is not None:
            raise ModelError(
                model.name,
                f"{type(self).__name__}(model)",
                "the model has a Lagrangian already",
                "Make the scene first; add energies of your own with add_energy(T, V)",
            )
        self.gravity = zero if gravity is None else self.vector("gravity", gravity)
        axes = tuple(
            tuple(int(i == j) for j in range(self.dimension)) for i in range(self.dimension)
        )
        spin = (0,) if self.dimension == 2 else zero
        self.ground = Frame("ground", self.algebra, zero, zero, axes, spin)
        model.lagrangian = 0
        self.looks = Looks(model.drawing)

    # --- energies and forces ---------------------------------------------------------------------

    def add_energy(self, T: Any, V: Any = 0) -> None:
        """Add kinetic minus potential energy to the Lagrangian [J]."""
        self.model.lagrangian = self.model.lagrangian + T - V

    def particle(self, name: str, mass: Any, at: Point | None = None) -> Point:
        """A point mass with coordinates of its own, or at a given point of a frame.

        Parameters
        ----------
        name : str
            Coordinates are ``name_x name_y[ name_z]`` [m].
        mass : expression
            [kg]
        at : Point, optional
            Where it is fixed; it then has no coordinates.

        Raises
        ------
        ModelError
            For a mass that is no positive number, or a name that is taken.
        """
        if at is None:
            letters = "xyz"[: self.dimension]
            names = " ".join(f"{name}_{c}" for c in letters)
            q = self._coordinates(name, names, " ".join("m" for _ in letters))
            v = self.model.velocities[-self.dimension :]
            zero_spin = (0,) if self.dimension == 2 else (0, 0, 0)
            at = Frame(name, self.algebra, q, v, self.ground.axes, zero_spin).point()
        positive(self.model, f"mass of particle '{name}'", mass)
        self.looks.dot(name, at)
        self.add_energy(
            mass * dot(at.velocity, at.velocity) / 2, -mass * dot(self.gravity, at.position)
        )
        return at

    def _coordinates(self, body: str, names: str, units: str) -> tuple[Any, ...]:
        """Coordinates of a body, with their units if there are as many as it has."""
        fits = len(names.replace(",", " ").split()) == len(units.split())
        q = self.model.coordinates(names, units=units if fits else None)
        n = len(self.model.q)
        self.model.bodies.append((body, tuple(range(n - len(q), n))))
        return q

    def force(self, point: Point, force: Sequence[Any], *, local: bool = False) -> None:
        """A force [N] on a point, in components of the fixed frame or of the point's own.

        Raises
        ------
        ModelError
            For another number of components.
        """
        F = self.vector("force", force)
        if local:
            F = point.frame.direction(*F)
        self._work(point.velocity, F)

    def torque(self, frame: Frame, torque: Any, against: Frame | None = None) -> None:
        """A torque [N m] on a frame and its reaction on another; in space in the fixed frame.

        Raises
        ------
        ModelError
            For another number of components than three in space.
        """
        components = (torque,) if self.dimension == 2 else self.vector("torque", torque)
        spin = frame.spin if against is None else subtract(frame.spin, against.spin)
        self._work(spin, components)

    def spring(
        self, one: Point, other: Point, stiffness: Any, length: Any = 0, damping: Any = 0
    ) -> None:
        """A spring with damper between two points: ``k/2 (|r| - l)^2``, ``-d d|r|/dt``."""
        self.looks.spring(one, other)
        r = subtract(one.position, other.position)
        if is_zero(length) and is_zero(damping):
            self.add_energy(0, stiffness * dot(r, r) / 2)
            return
        distance = self.algebra.sqrt(dot(r, r))
        self.add_energy(0, stiffness * (distance - length) ** 2 / 2)
        if not is_zero(damping):
            direction = scale(1 / distance, r)
            rate = dot(direction, subtract(one.velocity, other.velocity))
            self._push(one, other, -damping * rate)

    def actuator(self, one: Point, other: Point, force: Any) -> None:
        """A force [N] that pushes two points apart, an input for example."""
        self.looks.line(one, other)
        self._push(one, other, force)

    def _push(self, one: Point, other: Point, force: Any) -> None:
        r = subtract(one.position, other.position)
        direction = scale(1 / self.algebra.sqrt(dot(r, r)), r)
        self._work(subtract(one.velocity, other.velocity), scale(force, direction))

    def _work(self, velocity: Vector, force: Vector) -> None:
        """Generalized force sum_i force_i d(velocity_i)/dv; the force may depend on v."""
        self.model.force(
            [
                dot(force, [self.algebra.derivative(c, v) for c in velocity])
                for v in self.model.velocities
            ]
        )

    # --- surfaces and contacts -------------------------------------------------------------------

    def plane(
        self, point: Point | None = None, normal: Sequence[Any] | None = None, belt: Any = None
    ) -> Plane:
        """A plane through a point with a normal, fixed to the point's frame.

        By default the ground: through the origin, the last axis up. `normal` has components of the
        point's frame; numbers are divided by their length, expressions must have length one.
        `belt` is the velocity of the surface in that frame [m/s].

        Raises
        ------
        ModelError
            For a normal or belt with another number of components, or a normal of length zero.
        """
        at = self.ground.point() if point is None else point
        if not isinstance(at, Point):
            raise ModelError(
                self.model.name,
                "plane(point, normal)",
                f"its point is {at!r}",
                "Give a point of a frame, e.g. world.ground.point(2, 0)",
            )
        up = (0,) * (self.dimension - 1) + (1,)
        across = up if normal is None else self.vector("normal of a plane", normal)
        n = at.frame.direction(*unit(self.model, "normal of a plane", across))
        moving = (0,) * self.dimension if belt is None else self.vector("belt", belt)
        return Plane(at, n, at.frame.direction(*moving))

    def surface(self, phi: Callable[..., Any], frame: Frame | None = None) -> Surface:
        """The curve or surface phi = 0 in components of a frame; free where phi > 0."""
        return Surface(self.ground if frame is None else frame, phi)

    def graph(
        self, height: Callable[..., Any], frame: Frame | None = None, shown: Any = 1
    ) -> Surface:
        """The curve y = height(x) or the surface z = height(x, y); free above.

        Pictures show `shown` [m] of it on both sides of what touches it.
        """
        base = self.ground if frame is None else frame
        return Surface(base, lambda *place: place[-1] - height(*place[:-1]), height, shown)

    def contact(
        self,
        name: str,
        one: Any,
        other: Any,
        *,
        mu: Any = 0,
        e_N: Any = 0,
        e_F: Any = 0,
        guard: Any = None,
        friction: bool = True,
        impact: str = "newton",
        rolling: Any = None,
        drilling: Any = None,
        coupling: str | None = None,
        compliance: Any = None,
        relaxation: Any = 0,
    ) -> None:
        """Contact between two things.

        Parameters
        ----------
        one, other : Point or Round or Ellipsoid, and Plane or Round or Surface or Edge
            Point, round or ellipsoid with plane; round with round; point with curve or surface;
            point with edge (exists while the point faces the edge).
        mu, e_N, e_F, guard, impact
            As in `Model.contact`.
        friction : bool
            False leaves out the slip velocity.
        rolling, drilling : number or expression of parameters, optional
            Radii [m] of the resistance to rolling, and in space to spinning on the spot: the
            contact carries a torque of up to that radius times its normal force, against the
            relative angular velocity along the tangents or along the normal. See
            `Model.contact`.
        coupling : {None, "contensou"}
            Whether sliding and drilling are one law, as in `Model.contact`.
        compliance, relaxation : number or expression of parameters, optional
            Inverse of the stiffness [m/N], and damping over stiffness [s], as in `Model.contact`.

        Raises
        ------
        ModelError
            For things between which there is no rule, or drilling in the plane.
        """
        kinematics = self._touch(f"contact '{name}'", one, other)
        self._declare(
            *(name, kinematics, frame_of(one), frame_of(other), guard, friction),
            mu=mu,
            e_N=e_N,
            e_F=e_F,
            impact=impact,
            rolling=rolling,
            drilling=drilling,
            coupling=coupling,
            compliance=compliance,
            relaxation=relaxation,
        )

    def _declare(
        self,
        name: str,
        kinematics: Touch,
        frame: Frame,
        other: Frame,
        guard: Any,
        friction: bool,
        *,
        mu: Any = 0,
        e_F: Any = 0,
        rolling: Any = None,
        drilling: Any = None,
        **laws: Any,
    ) -> None:
        """Tell the model of a contact of two frames whose kinematics are known."""
        gamma_F = None
        along_plane = kinematics.tangents or tangents(self.algebra, kinematics.normal)
        directions = along_plane if friction else ()
        if friction:
            # a direction in which nothing can move, as in a mechanism that is plane, has no slip
            slips = [(t, dot(t, kinematics.velocity)) for t in directions]
            slips = [(t, rate) for t, rate in slips if not is_zero(rate)]
            directions = tuple(t for t, _ in slips)
            gamma_F = [rate for _, rate in slips] or None
            if gamma_F is None:
                mu, e_F = 0, 0  # friction has nothing to act on
        self.looks.contact(name, kinematics.place, kinematics.normal, directions)
        if kinematics.guard is not None:
            guard = (
                kinematics.guard if guard is None else self.algebra.minimum(kinematics.guard, guard)
            )
        if rolling is not None or drilling is not None:
            if drilling is not None and self.dimension == 2:
                raise ModelError(
                    self.model.name,
                    f"drilling of contact '{name}'",
                    "is given in the plane, where nothing spins about the normal",
                    "Leave it out; rolling is resistance to the rotation in the plane",
                )
            spin = subtract(frame.spin, other.spin)
            if rolling is not None:
                along = spin if self.dimension == 2 else [dot(t, spin) for t in along_plane]
                laws["rolling"] = (rolling, list(along))
            if drilling is not None:
                laws["drilling"] = (drilling, dot(kinematics.normal, spin))
        self.model.contact(
            name, g_N=kinematics.gap, gamma_F=gamma_F, mu=mu, e_F=e_F, guard=guard, **laws
        )

    def rolling(self, name: str, one: Round | Ellipsoid, other: Plane | Round) -> None:
        """Rolling without slip as a velocity constraint; add what keeps the bodies together."""
        kinematics = self._touch(f"rolling '{name}'", one, other)
        self.model.velocity_constraint(name, self._slip(kinematics))

    def touching(self, name: str, one: Any, other: Any) -> None:
        """A contact that never opens: its gap as a bilateral constraint."""
        self.model.constraint(name, self._touch(f"constraint '{name}'", one, other).gap)

    def _touch(self, what: str, one: Any, other: Any) -> Touch:
        for thing in (one, other):
            if isinstance(thing, Round):
                positive(self.model, f"radius in {what}", thing.radius, zero=True)
            if isinstance(thing, Ellipsoid):
                for axis in thing.semi_axes:
                    positive(self.model, f"semi-axis in {what}", axis, zero=True)
        kinematics = touch(self.algebra, one, other)
        if kinematics is None:
            if isinstance(one, Frame):
                remedy = "Give a point of the frame, frame.point(...), or Round(frame.point(), R). "
            elif touch(self.algebra, other, one) is not None:
                remedy = "Give them the other way round. "
            else:
                remedy = ""
            raise ModelError(
                self.model.name,
                what,
                f"there is no rule for {type(one).__name__} with {type(other).__name__}",
                remedy
                + "Point, Round or Ellipsoid with Plane; Round with Round; Point with Surface or "
                "Edge; or write g_N and gamma_F yourself with Model.contact",
            )
        self.looks.touching(one, other)
        return kinematics

    def _slip(self, kinematics: Touch) -> list[Any]:
        directions = tangents(self.algebra, kinematics.normal)
        return [dot(t, kinematics.velocity) for t in directions]

    def coincide(self, name: str, one: Point, other: Point) -> None:
        """Two points stay together: a revolute joint in the plane, a spherical one in space."""
        self.looks.joint(one, other)
        self.model.constraint(name, subtract(one.position, other.position))

    def pin(self, name: str, point: Point, at: Sequence[Any]) -> None:
        """A point of a body stays at a place of the fixed frame: a fixed pivot.

        Parameters
        ----------
        point : Point
            Of the body.
        at : sequence of expressions
            Where it stays [m].

        Raises
        ------
        ModelError
            For another number of components.
        """
        self.coincide(name, point, self.ground.point(*self.vector(f"pin '{name}'", at)))

    def rope(
        self,
        name: str,
        path: Sequence[Point | Pulley],
        length: Any,
        *,
        e_N: Any = 0,
        taut: bool = False,
        compliance: Any = None,
        relaxation: Any = 0,
    ) -> None:
        """A rope without mass or friction, through points and around pulleys.

        It pulls and cannot push: a contact whose gap is what the rope has to spare,
        ``length - way >= 0``. Its impulse is the tension's, ``traj["name.force_N"]`` the tension.

        Parameters
        ----------
        name : str
            Name of the contact.
        path : sequence of Point or Pulley
            From one end to the other. At a point in between the rope slides through.
        length : expression of t and parameters
            [m]
        e_N : number or expression of parameters
            Restitution when the rope becomes taut.
        taut : bool
            The rope never slackens: a constraint instead, which would also push.
        compliance, relaxation : number or expression of parameters, optional
            Elastic: inverse of the stiffness [m/N], and damping over stiffness [s], as in
            `Model.contact`.

        Raises
        ------
        ModelError
            For fewer than two things, or others than points and pulleys.
        """
        what = f"rope '{name}'"
        if len(path) < 2 or not all(isinstance(thing, (Point, Pulley)) for thing in path):
            raise ModelError(
                self.model.name,
                what,
                f"its path is {list(path)!r}",
                "Give two or more of frame.point(...) and Pulley(point, radius, over)",
            )
        there: list[Point | Pulley] = []
        for thing in path:
            if isinstance(thing, Pulley):
                positive(self.model, f"radius of a pulley of {what}", thing.radius)
                direction = f"direction `over` of a pulley of {what}"
                over = unit(self.model, direction, self.vector(direction, thing.over))
                there.append(replace(thing, over=over))
                self.model.shape([thing.center.position], radius=thing.radius)
            else:
                there.append(thing)
        total, corners = way(self.algebra, there)
        if taut:
            self.model.constraint(
                name, length - total, compliance=compliance, relaxation=relaxation
            )
        else:
            self.model.contact(
                name,
                g_N=length - total,
                e_N=e_N,
                compliance=compliance,
                relaxation=relaxation,
            )
        for k in range(0, len(corners), 2):
            self.model.shape(corners[k : k + 2])

    # --- frames whose motion is given ------------------------------------------------------------

    def _rates(self, expressions: Sequence[Any]) -> Vector:
        return tuple(total_derivative(self.model, e) for e in expressions)

    def vector(self, what: str, components: Sequence[Any]) -> Vector:
        """Check the number of components; `ModelError` if it is another than the dimension."""
        try:
            entries = tuple(components)
        except TypeError:
            entries = ()
        if len(entries) != self.dimension:
            raise ModelError(
                self.model.name,
                what,
                f"has {len(entries)} components" if entries else f"is {components!r}",
                f"Give {self.dimension} components",
            )
        return entries
