"""Bodies in space: position and unit quaternion, or poses given by coordinates of one's own."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from signorini.bodies.algebra import (
    Matrix,
    Vector,
    add,
    apply,
    dot,
    multiply,
    number,
    subtract,
)
from signorini.bodies.frames import Frame, Point, turned_in_space
from signorini.bodies.given import positive, unit
from signorini.bodies.scene import Scene
from signorini.bodies.shapes import Plane, frame_of, perpendicular
from signorini.bodies.solids import Solid, contacts_of, sizes_of
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.symbols import smooth


class Spatial(Scene):
    """Bodies, joints and contacts in space.

    A body has the coordinates x y z and a quaternion p0 p1 p2 p3 of length one, kept by a bilateral
    constraint. The kinetic energy contains tr(J) (p . p_dot)^2, zero on the constraint, which makes
    the mass matrix regular.
    """

    dimension = 3

    def __init__(self, model: Any, gravity: Sequence[Any] | None = None) -> None:
        super().__init__(model, gravity)
        self._quaternions: dict[str, list[str]] = {}
        self._inertias: dict[Frame, Matrix] = {}

    def body(
        self,
        name: str,
        mass: Any,
        inertia: Sequence[Any],
        *,
        coordinates: str | None = None,
        frame: Frame | None = None,
    ) -> Frame:
        """A rigid body whose centre of mass is the frame's origin.

        Parameters
        ----------
        name : str
            Coordinates are ``name_x name_y name_z name_p0 ... name_p3``.
        mass : expression
            [kg]
        inertia : three expressions, or three rows of three
            Principal moments about the axes of the body, or the symmetric tensor in components
            of the body [kg m^2]: with the products of inertia as the entries -∫ x y dm.
        coordinates : str, optional
            Other names for the seven coordinates.
        frame : Frame, optional
            A frame that moves with other coordinates (see `frame`): the body gets none of its own.

        Returns
        -------
        Frame
            At the centre of mass.

        Raises
        ------
        ModelError
            For a mass or moment that is no positive number, a tensor that is not symmetric or that
            no body has, or other than seven names.
        """
        what = f"inertia of body '{name}'"
        J = self._tensor(what, inertia)
        positive(self.model, f"mass of body '{name}'", mass)
        if frame is not None:
            T = mass * dot(frame.velocity, frame.velocity) / 2
            omega = frame.components(frame.spin)
            T = T + _quadratic(J, omega) / 2
            self._inertias[frame] = J
            self.add_energy(T, -mass * dot(self.gravity, frame.origin))
            self.looks.body(frame)
            return frame
        frame = self.floating(name, J[0][0] + J[1][1] + J[2][2], coordinates=coordinates)
        p, p_dot = self.model.q[-4:], self.model.velocities[-4:]
        # Angular velocity in the body's frame: omega = 2 H(p) p_dot.
        omega = tuple(2 * dot(row, p_dot) for row in _H(p))
        T = mass * dot(frame.velocity, frame.velocity) / 2 + _quadratic(J, omega) / 2
        self.add_energy(T, -mass * dot(self.gravity, frame.origin))
        self._inertias[frame] = J
        self.looks.body(frame)
        return frame

    def floating(
        self,
        name: str,
        weight: Any,
        *,
        coordinates: str | None = None,
        parent: Frame | None = None,
        at: Sequence[Any] | None = None,
    ) -> Frame:
        """A frame that turns freely, with a quaternion; its origin moves freely or is given.

        Parameters
        ----------
        name : str
            Coordinates are ``name_x name_y name_z name_p0 ... name_p3``, or the last four.
        weight : expression
            Inertia that the length of the quaternion gets, which is constant [kg m^2]: any positive
            one makes the mass matrix regular, the trace of a tensor makes it well scaled.
        coordinates : str, optional
            Other names for them.
        parent : Frame, optional
            What the quaternion turns it against; the fixed frame by default.
        at : three expressions, optional
            Its origin in the parent; it then has no coordinates for that.

        Raises
        ------
        ModelError
            For another number of names.
        """
        base = self.ground if parent is None else parent
        letters = ["p0", "p1", "p2", "p3"] if at is not None else "x y z p0 p1 p2 p3".split()
        units = 4 * " quaternion" if at is not None else "m m m" + 4 * " quaternion"
        q = self._coordinates(name, coordinates or " ".join(f"{name}_{c}" for c in letters), units)
        if len(q) != len(letters):
            raise ModelError(
                self.model.name,
                f"body '{name}'",
                f"{len(q)} coordinates are named",
                f"Name {'four' if at is not None else 'seven'}: {' '.join(letters)}",
            )
        v = self.model.velocities[-len(q) :]
        p, p_dot = q[-4:], v[-4:]
        place = base.point(*(q[:3] if at is None else at))
        slide = v[:3] if at is None else self._rates(self.vector(f"frame '{name}'", at))
        self._quaternions[name] = self.model.coordinate_names[-4:]
        self.model.constraint(f"{name}_unit", dot(p, p) - 1)
        self.add_energy(weight * dot(p, p_dot) ** 2)
        # In the parent: 2 E(p) p_dot, which is A omega where |p| = 1, and bilinear.
        spin = tuple(2 * dot(row, p_dot) for row in _E(p))
        if parent is None:  # without products with zeros and ones
            origin = tuple(q[:3] if at is None else at)
            return Frame(name, self.algebra, origin, tuple(slide), _rotation(p), spin)
        return Frame(
            name,
            self.algebra,
            place.position,
            add(place.velocity, base.direction(*slide)),
            multiply(base.axes, _rotation(p)),
            add(base.spin, base.direction(*spin)),
        )

    def outputs(self, body: Frame) -> None:
        """Add the rotation of a body to the outputs of the model.

        ``NAME_omega_x`` ... are its angular velocity [rad/s], ``NAME_L_x`` ... its angular momentum
        about the centre of mass [kg m^2/s], both in components of the fixed frame.

        Raises
        ------
        ModelError
            For a frame that is no body.
        """
        if body not in self._inertias:
            raise ModelError(
                self.model.name,
                "outputs(...)",
                f"'{body.name}' is no body",
                "Give a frame that body(...) returned",
            )
        momentum = body.direction(*apply(self._inertias[body], body.components(body.spin)))
        for letter, omega, L in zip("xyz", body.spin, momentum, strict=True):
            self.model.output(f"{body.name}_omega_{letter}", omega)
            self.model.output(f"{body.name}_L_{letter}", L)

    def _tensor(self, what: str, inertia: Sequence[Any]) -> Matrix:
        """The tensor of inertia, from principal moments or as it is given."""
        if getattr(inertia, "shape", None) == (3, 3):  # a matrix of SymPy, CasADi or NumPy
            matrix: Any = inertia
            inertia = [[matrix[i, j] for j in range(3)] for i in range(3)]
        rows = self.vector(what, inertia)
        if not any(isinstance(row, (tuple, list)) for row in rows):
            for moment in rows:
                positive(self.model, what, moment)
            return tuple(tuple(x if i == j else 0 for j in range(3)) for i, x in enumerate(rows))
        J = tuple(self.vector(what, row) for row in rows)
        values = np.array([[number(self.model, what, x) for x in row] for row in J])
        if not np.array_equal(values, values.T):
            raise ModelError(
                self.model.name, what, f"is not symmetric: {values.tolist()}", "Give J = J^T"
            )
        moments = np.linalg.eigvalsh(values)
        if not (moments[0] > 0 and moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9)):
            raise ModelError(
                self.model.name,
                what,
                f"has the principal moments {[float(f'{x:.6g}') for x in moments]}",
                "They must be positive, and none larger than the sum of the others",
            )
        return J

    def frame(
        self,
        name: str,
        axis: Sequence[Any] = (0, 0, 1),
        angle: Any = 0,
        at: Sequence[Any] = (0, 0, 0),
        parent: Frame | None = None,
    ) -> Frame:
        """A frame turned by `angle` about an axis of `parent`, its origin at `at` there.

        An axis of numbers is divided by its length, one of expressions must have length one.
        Expressions of t and q; several in a row make Euler or Cardan angles.

        Raises
        ------
        ModelError
            For an axis of length zero, or other than three components.
        """
        slide = self._rates(self.vector(f"frame '{name}'", at))
        (rate,) = self._rates([angle])
        base = self.ground if parent is None else parent
        what = f"axis of frame '{name}'"
        a = unit(self.model, what, self.vector(what, axis))
        return turned_in_space(name, base, a, angle, rate, tuple(at), slide)

    # --- joints ----------------------------------------------------------------------------------

    def spherical(self, name: str, one: Point, other: Point) -> None:
        """Ball joint: the points stay together."""
        self.coincide(name, one, other)

    def revolute(
        self,
        name: str,
        one: Point,
        other: Point,
        axis: Sequence[float],
        other_axis: Sequence[float] | None = None,
    ) -> None:
        """Hinge about an axis fixed to both frames, given in components of each."""
        self.looks.joint(one, other)
        a = self._axis(name, axis)
        b = a if other_axis is None else self._axis(name, other_axis)
        apart = subtract(one.position, other.position)
        self.model.constraint(name, [*apart, *self._parallel(one.frame, a, other.frame, b)])

    def universal(
        self,
        name: str,
        one: Point,
        other: Point,
        axis: Sequence[float],
        other_axis: Sequence[float],
    ) -> None:
        """Cardan joint: an axis of each frame, perpendicular to each other."""
        self.looks.joint(one, other)
        a, b = self._axis(name, axis), self._axis(name, other_axis)
        apart = subtract(one.position, other.position)
        cosine = dot(one.frame.direction(*a), other.frame.direction(*b))
        self.model.constraint(name, [*apart, cosine])

    def prismatic(self, name: str, one: Point, other: Point, axis: Sequence[float]) -> None:
        """Slider: `one` moves along an axis through `other`; both frames stay parallel."""
        self.looks.joint(one, other)
        a = self._axis(name, axis)
        apart = subtract(one.position, other.position)
        across = [dot(other.frame.direction(*b), apart) for b in perpendicular(a)]
        self.model.constraint(name, [*across, *self.aligned(one.frame, other.frame)])

    def rigid(self, name: str, one: Point, other: Point) -> None:
        """Weld: the points stay together and the frames parallel (turn one with `frame`)."""
        self.looks.joint(one, other)
        apart = subtract(one.position, other.position)
        self.model.constraint(name, [*apart, *self.aligned(one.frame, other.frame)])

    def _axis(self, name: str, axis: Sequence[float]) -> Vector:
        what = f"axis of joint '{name}'"
        a = self.vector(what, axis)
        if not all(_is_number(c) for c in a) or dot(a, a) == 0:
            raise ModelError(self.model.name, what, f"is {a}", "Give three numbers")
        return unit(self.model, what, a)

    def _parallel(self, one: Frame, a: Vector, other: Frame, b: Vector) -> list[Any]:
        axis = other.direction(*b)
        return [dot(one.direction(*c), axis) for c in perpendicular(a)]

    def aligned(self, one: Frame, other: Frame) -> list[Any]:
        """Three expressions that vanish where two frames are parallel."""
        pairs = (((1, 0, 0), (0, 1, 0)), ((0, 1, 0), (0, 0, 1)), ((0, 0, 1), (1, 0, 0)))
        return [dot(one.direction(*a), other.direction(*b)) for a, b in pairs]

    # --- contacts of solids --------------------------------------------------------------------

    def solids(
        self,
        name: str,
        one: Solid,
        other: Solid | Plane,
        *,
        guard: Any = None,
        friction: bool = True,
        **laws: Any,
    ) -> None:
        """All contacts of two solids, or of a solid with a plane.

        Parameters
        ----------
        name : str
            Contacts are called ``name`` and the part that touches: ``name_0`` to ``name_7`` corners
            of a box, ``name_start`` and ``name_end`` ends of a capsule, ``name_top`` and
            ``name_bottom`` rims of a cylinder. Of two capsules, ``name_a_start`` is an end of `one`
            with `other`, ``name_b_start`` the other way round, ``name_sides`` where they cross. Of
            a capsule with a box, ``name_corner3`` and ``name_edge37`` are the corner and the edge
            between two corners that its side touches. Of two boxes, ``name_a3`` is a corner of
            `one`, ``name_b3`` of `other`, ``name_edge37_in`` and ``_out`` where an edge of `one`
            crosses the border of a face of `other`.
        one, other : Round, Ellipsoid, Capsule, Box or Cylinder; `other` may be a Plane
            Balls, capsules and boxes with each other, balls with cylinders, all with planes.
        guard : expression of t and q, optional
            All these contacts exist in a step only if it is >= 0 at its start.
        friction : bool
            False leaves out the slip velocity.
        **laws
            ``mu``, ``e_N``, ``e_F`` and the others of `contact`.

        Raises
        ------
        ModelError
            For a pair without a rule, a size that is not positive, or a wrong law.
        """
        what = f"solids '{name}'"
        for solid in (one, other):
            for size in sizes_of(solid):
                positive(self.model, f"size in {what}", size)
        found = contacts_of(self.algebra, one, other)
        if found is None:
            raise ModelError(
                self.model.name,
                what,
                f"there is no rule for {type(one).__name__} with {type(other).__name__}",
                "Round, Capsule and Box with each other; Round with Cylinder; all with Plane; "
                "or write g_N and gamma_F yourself with Model.contact",
            )
        self.looks.touching(one, other)
        frames = frame_of(one), frame_of(other)
        for word, kinematics in found:
            # gaps branch where other parts of the solids come nearest, and are smooth between
            vouched = replace(kinematics, gap=smooth(kinematics.gap))
            self._declare(f"{name}{word}", vouched, *frames, guard, friction, **laws)

    # --- start -----------------------------------------------------------------------------------

    def initial_state(
        self,
        q: Mapping[str, Any],
        v: Mapping[str, Any] | None = None,
        *,
        attitude: Mapping[str, tuple[Sequence[Any], Any]] | None = None,
        spin: Mapping[str, Sequence[Any]] | None = None,
        t: Any = 0,
    ) -> None:
        """Set the model's initial state; quaternions from attitudes, their rates from spins.

        Parameters
        ----------
        q, v : mapping from coordinate name
            The rest is zero.
        attitude : mapping from body name to (axis, angle [rad]), optional
            Bodies that are not named are not turned.
        spin : mapping from body name to three components in the body's frame [rad/s], optional
            Initial angular velocities.

        Raises
        ------
        ModelError
            For a name that is no body with a quaternion, or other than three components.
        """
        q_all, v_all = dict(q), dict(v or {})
        attitude, spin = dict(attitude or {}), dict(spin or {})
        for given in (attitude, spin):
            for name in given:
                if name not in self._quaternions:
                    raise ModelError(
                        self.model.name,
                        "initial_state",
                        f"there is no body '{name}' with a quaternion",
                        f"Bodies are: {', '.join(self._quaternions)}",
                    )
        for name, names in self._quaternions.items():
            axis, angle = attitude.get(name, ((0, 0, 1), 0))
            what = f"attitude of '{name}'"
            a = unit(self.model, what, self.vector(what, axis))
            if _is_number(angle):
                angle = angle * 1.0
            half = angle / 2
            c, s = self.algebra.cos(half), self.algebra.sin(half)
            p: Vector = (1, 0, 0, 0) if angle == 0 else (c, *(s * x for x in a))
            q_all.update({n: x for n, x in zip(names, p, strict=True) if n not in q})
            if name in spin:
                omega = self.vector(f"spin of '{name}'", spin[name])
                # p_dot = H(p)^T omega / 2
                for k, n in enumerate(names):
                    v_all[n] = dot([row[k] for row in _H(p)], omega) / 2
        self.model.initial_state(q=q_all, v=v_all, t=t)


def _is_number(x: Any) -> bool:
    return isinstance(x, (int, float))


def _quadratic(J: Matrix, omega: Vector) -> Any:
    """omega^T J omega; entries that are the number zero leave no term."""
    terms = [
        J[i][j] * omega[i] * omega[j] if i == j else 2 * J[i][j] * omega[i] * omega[j]
        for i in range(3)
        for j in range(i, 3)
        if not (_is_number(J[i][j]) and J[i][j] == 0)
    ]
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _H(p: Sequence[Any]) -> Matrix:
    p0, p1, p2, p3 = p
    return ((-p1, p0, p3, -p2), (-p2, -p3, p0, p1), (-p3, p2, -p1, p0))


def _E(p: Sequence[Any]) -> Matrix:
    p0, p1, p2, p3 = p
    return ((-p1, p0, -p3, p2), (-p2, p3, p0, -p1), (-p3, -p2, p1, p0))


def _rotation(p: Sequence[Any]) -> Matrix:
    """Rotation matrix of a unit quaternion."""
    p0, p1, p2, p3 = p
    return (
        (p0**2 + p1**2 - p2**2 - p3**2, 2 * (p1 * p2 - p0 * p3), 2 * (p1 * p3 + p0 * p2)),
        (2 * (p1 * p2 + p0 * p3), p0**2 - p1**2 + p2**2 - p3**2, 2 * (p2 * p3 - p0 * p1)),
        (2 * (p1 * p3 - p0 * p2), 2 * (p2 * p3 + p0 * p1), p0**2 - p1**2 - p2**2 + p3**2),
    )
