"""Bodies in the plane: x, y, phi, or poses given by coordinates of one's own."""

from collections.abc import Sequence
from typing import Any

from signorini.bodies.algebra import dot, subtract
from signorini.bodies.frames import Frame, Point, turned_in_plane
from signorini.bodies.given import positive, unit
from signorini.bodies.polygons import outline, pairs
from signorini.bodies.scene import Scene
from signorini.bodies.shapes import tangents
from signorini.codegen.frontend.errors import ModelError


class Planar(Scene):
    """Bodies, joints and contacts in the plane.

    Examples
    --------
    >>> import signorini as sg
    >>> from signorini.bodies import Planar, Round, inertia
    >>> m = sg.Model("wheel")
    >>> world = Planar(m, gravity=(0, -9.81))
    >>> wheel = world.body("wheel", mass=2.0, inertia=inertia.disc(2.0, 0.3))
    >>> world.contact("road", Round(wheel.point(), 0.3), world.plane(), mu=0.5)
    >>> m.initial_state(q={"wheel_y": 0.4}, v={"wheel_phi": -10})
    """

    dimension = 2

    def body(
        self,
        name: str,
        mass: Any,
        inertia: Any,
        *,
        coordinates: str | None = None,
        frame: Frame | None = None,
    ) -> Frame:
        """A rigid body whose centre of mass is the frame's origin.

        Parameters
        ----------
        name : str
            Coordinates are ``name_x name_y name_phi``.
        mass, inertia : expression
            [kg], about the centre of mass [kg m^2].
        coordinates : str, optional
            Other names for the three coordinates.
        frame : Frame, optional
            A frame that moves with other coordinates (see `frame`): the body gets none of its own.

        Returns
        -------
        Frame
            At the centre of mass.

        Raises
        ------
        ModelError
            For a mass or inertia that is no positive number, or other than three names.
        """
        if frame is None:
            q = self._coordinates(name, coordinates or f"{name}_x {name}_y {name}_phi", "m m rad")
            if len(q) != 3:
                raise ModelError(
                    self.model.name,
                    f"body '{name}'",
                    f"{len(q)} coordinates are named",
                    "Name three: x y phi",
                )
            v = self.model.velocities[-3:]
            frame = turned_in_plane(name, self.ground, q[2], v[2], q[:2], v[:2])
        positive(self.model, f"mass of body '{name}'", mass)
        if isinstance(inertia, (tuple, list)):
            raise ModelError(
                self.model.name,
                f"inertia of body '{name}'",
                f"is {inertia!r}",
                "Give one number: the moment about the centre of mass",
            )
        positive(self.model, f"inertia of body '{name}'", inertia)
        T = mass * dot(frame.velocity, frame.velocity) / 2 + inertia * frame.spin[0] ** 2 / 2
        self.add_energy(T, -mass * dot(self.gravity, frame.origin))
        self.looks.body(frame)
        return frame

    def frame(
        self,
        name: str,
        angle: Any = 0,
        at: Sequence[Any] = (0, 0),
        parent: Frame | None = None,
    ) -> Frame:
        """A frame whose pose against `parent` is given by expressions of t and q.

        Raises
        ------
        ModelError
            For another number of components of `at`.
        """
        slide = self._rates(self.vector(f"frame '{name}'", at))
        (rate,) = self._rates([angle])
        base = self.ground if parent is None else parent
        return turned_in_plane(name, base, angle, rate, tuple(at), slide)

    # --- joints ----------------------------------------------------------------------------------

    def revolute(self, name: str, one: Point, other: Point) -> None:
        """Hinge: the points stay together."""
        self.coincide(name, one, other)

    def prismatic(
        self, name: str, one: Point, other: Point, axis: Sequence[Any], angle: Any = 0
    ) -> None:
        """Slider: `one` moves along an axis through `other`, fixed to `other`'s frame.

        `axis` has components of `other`'s frame; `angle` is the fixed angle between the frames.

        Raises
        ------
        ModelError
            For an axis of length zero or with other than two components.
        """
        self.looks.joint(one, other)
        what = f"axis of joint '{name}'"
        a = unit(self.model, what, self.vector(what, axis))
        across = other.frame.direction(-a[1], a[0])
        self.model.constraint(
            name,
            [
                dot(across, subtract(one.position, other.position)),
                self._angle(one.frame, other.frame, angle),
            ],
        )

    def rigid(self, name: str, one: Point, other: Point, angle: Any = 0) -> None:
        """Weld: the points stay together and the frames at a fixed angle."""
        self.looks.joint(one, other)
        apart = subtract(one.position, other.position)
        self.model.constraint(name, [*apart, self._angle(one.frame, other.frame, angle)])

    def _angle(self, one: Frame, other: Frame, angle: Any) -> Any:
        """Sine of the angle of `one` against `other` less `angle`."""
        s, c = self.algebra.sin(angle), self.algebra.cos(angle)
        return dot(one.direction(0, 1), other.direction(c, s))

    # --- springs and contacts of the plane -------------------------------------------------------

    def torsion_spring(
        self, angle: Any, rate: Any, stiffness: Any, rest: Any = 0, damping: Any = 0
    ) -> None:
        """A spring on an angle, a coordinate or a difference of two, with its rate."""
        self.add_energy(0, stiffness * (angle - rest) ** 2 / 2)
        self._work((rate,), (-damping * rate,))

    def polygons(
        self,
        name: str,
        one: Sequence[Point],
        other: Sequence[Point],
        *,
        guard: Any = None,
        friction: bool = True,
        **laws: Any,
    ) -> None:
        """Contacts between the corners and edges of two polygons.

        Parameters
        ----------
        name : str
            Contacts are named ``name_a0_1``: corner 0 of `one` with edge 1 of `other`, between its
            corners 1 and 2; ``name_b0_1`` the other way round.
        one, other : sequence of Point
            Corners one after the other, in either order, fixed in one frame each. Polygons that are
            not convex are cut into convex pieces; where a place depends on parameters, with their
            defaults.
        guard : expression of t and q, optional
            All these contacts exist in a step only if it is >= 0 at its start.
        friction : bool
            False leaves out the slip velocity.
        **laws
            ``mu``, ``e_N``, ``e_F`` as in `Model.contact`.

        Raises
        ------
        ModelError
            If the corners bound no polygon, or a law is wrong.
        """
        what = f"polygons '{name}'"
        shapes = [outline(self.model, what, corners) for corners in (one, other)]
        self.looks.polygon(one)
        self.looks.polygon(other)
        for letter, found in zip("ab", pairs(self.algebra, *shapes), strict=True):
            for pair in found:
                directions = tangents(self.algebra, pair.normal)
                slip = [dot(t, pair.velocity) for t in directions]
                full_name = f"{name}_{letter}{pair.corner}_{pair.edge}"
                self.looks.contact(full_name, pair.place, pair.normal, directions)
                self.model.contact(
                    full_name,
                    g_N=pair.gap,
                    gamma_F=slip if friction else None,
                    guard=pair.guard if guard is None else self.algebra.minimum(pair.guard, guard),
                    **laws,
                )
