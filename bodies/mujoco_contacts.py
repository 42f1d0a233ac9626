"""Contacts of a compiled model of MuJoCo: primitives with planes of the world, and in pairs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from signorini.bodies.frames import Frame, Point
from signorini.bodies.mujoco_names import NAMES, clean
from signorini.bodies.shapes import Box, Capsule, Cylinder, Ellipsoid, Plane, Round
from signorini.bodies.solids import Solid, has_rule
from signorini.bodies.spatial import Spatial
from signorini.codegen.frontend.errors import ModelError

Side = str | int  # a geom or body by its name, a group of geoms by its number
_PLANE, _HFIELD, _SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = range(8)


@dataclass(frozen=True)
class File:
    """What contacts need to know of the file and of what was made of it."""

    m: Any
    mujoco: Any
    world: Spatial
    frames: list[Frame]  # of bodies
    e_N: Any
    meshes: str | None
    named: Callable[[str, int, str], str]
    said: Callable[[str, int], str]
    leave: Callable[[str, str], None]
    turned: Callable[[Frame, str, np.ndarray, Sequence[Any]], Frame]


class Contacts:
    """Writes contacts into the scene.

    Parameters
    ----------
    file : File
    """

    def __init__(self, file: File) -> None:
        self.file = file

    def _moves(self, geom: int) -> bool:
        return bool(self.file.m.body_weldid[self.file.m.geom_bodyid[geom]] != 0)

    def _collide(self, a: int, b: int) -> bool:
        m = self.file.m
        bodies = sorted((int(m.geom_bodyid[a]), int(m.geom_bodyid[b])))
        if (bodies[0] << 16) + bodies[1] in {int(s) for s in m.exclude_signature}:
            return False
        return bool(
            (m.geom_contype[a] & m.geom_conaffinity[b])
            or (m.geom_contype[b] & m.geom_conaffinity[a])
        )

    def _touching(self, contacts: bool | list[str]) -> list[int]:
        """Geoms that touch planes: all, or those that are named, themselves or by their body."""
        if isinstance(contacts, bool):
            return list(range(self.file.m.ngeom))
        found = []
        named = set()
        for geom in range(self.file.m.ngeom):
            body = int(self.file.m.geom_bodyid[geom])
            names = {self.file.said("GEOM", geom), self.file.said("BODY", body)} & set(contacts)
            named |= names
            if names:
                found.append(geom)
        for name in contacts:
            if name not in named:
                raise ModelError(
                    self.file.world.model.name,
                    f"contact of '{name}'",
                    "the file has no geom, and no body with a geom, of that name",
                    "Name others",
                )
        return found

    def write(self, contacts: bool | list[str], pairs: bool | list[tuple[Side, Side]]) -> None:
        """Contacts with the planes of the world, and those between pairs of geoms."""
        m = self.file.m
        for geom in range(m.ngeom):
            solid = self._solid(geom)
            if solid is not None and (m.geom_contype[geom] or m.geom_conaffinity[geom]):
                self.file.world.looks.solid(solid)
        planes = [k for k in range(m.ngeom) if m.geom_type[k] == _PLANE and not self._moves(k)]
        touching = self._touching(contacts)
        for plane in planes if contacts else []:
            wall = self._plane(plane)
            for geom in touching:
                if self._moves(geom) and self._collide(plane, geom):
                    self._touch(geom, plane, wall, len(planes) > 1)
        could = [pair for pair in combinations(range(m.ngeom), 2) if self._may_meet(*pair)]
        wanted: dict[tuple[int, int], bool] = {}  # whether both are named themselves
        if pairs is True:
            wanted = dict.fromkeys(could, False)
        for one, other in [] if isinstance(pairs, bool) else pairs:
            sides = self._geoms(one), self._geoms(other)
            named = self._is_geom(one) and self._is_geom(other)
            found = {(min(a, b), max(a, b)) for a in sides[0] for b in sides[1] if a != b}
            # geoms that are named themselves touch even where the file says that they do not
            found = found if named else found & set(could)
            wanted |= dict.fromkeys(sorted(found), named)
        met = [pair for pair, named in wanted.items() if self._pair(*pair, named)]
        between = len(set(could) - set(met))
        if between:
            self.file.leave(
                f"{between} pairs of geoms that may collide",
                "name some in pairs=[(one, other)], or give pairs=True",
            )

    def _may_meet(self, a: int, b: int) -> bool:
        """Whether MuJoCo looks at a pair that is not one with a plane."""
        m = self.file.m
        if _PLANE in (m.geom_type[a], m.geom_type[b]) or not self._collide(a, b):
            return False
        one, other = (int(m.body_weldid[m.geom_bodyid[k]]) for k in (a, b))
        parents = [int(m.body_weldid[m.body_parentid[k]]) for k in (one, other)]
        family = (parents[0] == other and other != 0) or (parents[1] == one and one != 0)
        return one != other and not family

    def _is_geom(self, side: Side) -> bool:
        return any(self.file.said("GEOM", k) == side for k in range(self.file.m.ngeom))

    def _geoms(self, side: Side) -> list[int]:
        """Geoms of a group, or of a name: that geom, or those of that body."""
        m = self.file.m
        if isinstance(side, int):
            found = [k for k in range(m.ngeom) if m.geom_group[k] == side]
        else:
            found = [k for k in range(m.ngeom) if self.file.said("GEOM", k) == side]
            found = found or [
                k for k in range(m.ngeom) if self.file.said("BODY", m.geom_bodyid[k]) == side
            ]
        if not found:
            what = f"group {side}" if isinstance(side, int) else f"name '{side}'"
            raise ModelError(
                self.file.world.model.name,
                f"pairs of {what}",
                "the file has no geom of it, and no body with a geom",
                "Name geoms, bodies, or groups of geoms by their numbers",
            )
        return found

    def _plane(self, geom: int) -> Plane:
        frame, at, R = self._place(geom)
        return self.file.world.plane(frame.point(*at), frame.direction(*map(float, R[:, 2])))

    def _place(self, geom: int) -> tuple[Frame, tuple[float, ...], np.ndarray]:
        m, nine = self.file.m, np.zeros(9)
        self.file.mujoco.mju_quat2Mat(nine, m.geom_quat[geom])
        frame = self.file.frames[m.geom_bodyid[geom]]
        nine[np.abs(nine) < 1e-15] = 0.0  # right angles of the file, but for round-off
        return frame, tuple(map(float, m.geom_pos[geom])), nine.reshape(3, 3)

    def _parts(self, geom: int) -> list[tuple[str, Any]]:
        """What of a geom can touch a plane first: balls, coins, corners, an ellipsoid."""
        m = self.file.m
        frame, at, R = self._place(geom)
        size = [float(x) for x in m.geom_size[geom]]
        kind = m.geom_type[geom]

        def point(*place: float) -> Point:
            return frame.point(*map(float, np.asarray(at) + R @ np.asarray(place)))

        if kind == _SPHERE:
            return [("", Round(point(0, 0, 0), size[0]))]
        if kind == _CAPSULE:
            ends = (("_top", size[1]), ("_bottom", -size[1]))
            return [(word, Round(point(0, 0, z), size[0])) for word, z in ends]
        if kind in (_ELLIPSOID, _CYLINDER):
            quat = np.array(m.geom_quat[geom])
            name = frame.name

            def turned(z: float) -> Frame:
                place = tuple(map(float, np.asarray(at) + R @ np.array([0, 0, z])))
                return self.file.turned(frame, name, quat, place)

            if kind == _ELLIPSOID:
                return [("", Ellipsoid(turned(0.0), tuple(size)))]
            coin = (size[0], size[0], 0.0)
            ends = (("_top", size[1]), ("_bottom", -size[1]))
            return [(word, Ellipsoid(turned(z), coin)) for word, z in ends]
        if kind == _BOX or (kind == _MESH and self.file.meshes == "box"):
            middle = np.zeros(3) if kind == _BOX else np.array(m.geom_aabb[geom][:3])
            half = np.array(size if kind == _BOX else m.geom_aabb[geom][3:])
            signs = [(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
            return [
                (f"_{n}", point(*(middle + half * np.array(sign)))) for n, sign in enumerate(signs)
            ]
        return []

    def _touch(self, geom: int, plane: int, wall: Plane, several: bool) -> None:
        m = self.file.m
        parts = self._parts(geom)
        said = m.geom_type[geom]
        if not parts:
            hint = " (meshes='box' takes its box)" if said == _MESH else ""
            self.file.leave(
                f"contact of geom '{self.file.said('GEOM', geom)}'", f"it is a {NAMES[said]}{hint}"
            )
            return
        mu = self._friction(geom, plane)
        base = self.file.named("GEOM", geom, f"{self.file.frames[m.geom_bodyid[geom]].name}_geom")
        if several:
            base = f"{base}_on_{clean(self.file.said('GEOM', plane))}"
        for word, part in parts:
            self.file.world.contact(
                f"{base}{word}", part, wall, mu=mu or 0, e_N=self.file.e_N, friction=mu is not None
            )

    def _friction(self, a: int, b: int) -> float | None:
        """Coefficient of two geoms, as MuJoCo mixes them; None where contact has no friction."""
        m = self.file.m
        of = [a, b]
        if m.geom_priority[a] != m.geom_priority[b]:
            of = [max(of, key=lambda k: m.geom_priority[k])]
        dimension = max(int(m.geom_condim[k]) for k in of)
        if dimension == 1:
            return None
        if dimension > 3:
            names = " and ".join(f"'{self.file.said('GEOM', k)}'" for k in (a, b))
            self.file.leave(
                f"torsional or rolling friction of {names}", "sliding friction alone is taken"
            )
        return float(max(m.geom_friction[k, 0] for k in of))

    def _solid(self, geom: int) -> Solid | None:
        m = self.file.m
        frame, at, _ = self._place(geom)
        quat, kind = np.array(m.geom_quat[geom]), m.geom_type[geom]
        size = [float(x) for x in m.geom_size[geom]]
        if kind == _SPHERE:
            return Round(frame.point(*at), size[0])
        turned = self.file.turned(frame, frame.name, quat, at)
        if kind == _CAPSULE:
            return Capsule(turned.point(0, 0, -size[1]), turned.point(0, 0, size[1]), size[0])
        if kind == _CYLINDER:
            return Cylinder(turned.point(), size[0], size[1])
        if kind == _BOX:
            return Box(turned.point(), tuple(size))
        return Ellipsoid(turned, tuple(size)) if kind == _ELLIPSOID else None

    def _pair(self, a: int, b: int, named: bool) -> bool:
        """Contacts of two geoms; whether there is a rule for them."""
        one, other = self._solid(a), self._solid(b)
        words = [self.file.said("GEOM", k) for k in (a, b)]
        if one is None or other is None or not has_rule(one, other):
            if named:
                kinds = " and a ".join(NAMES[self.file.m.geom_type[k]] for k in (a, b))
                raise ModelError(
                    self.file.world.model.name,
                    f"pair ({words[0]}, {words[1]})",
                    f"is a {kinds}, for which there is no rule",
                    "Pair spheres with spheres, capsules, boxes or cylinders, or two capsules",
                )
            return False
        m = self.file.m
        if m.body_weldid[m.geom_bodyid[a]] == m.body_weldid[m.geom_bodyid[b]]:
            raise ModelError(
                self.file.world.model.name,
                f"pair ({words[0]}, {words[1]})",
                "is of two parts of one body, which never move against each other",
                "Leave it out",
            )
        mu = self._friction(a, b)
        name = "_".join(self._word(k) for k in (a, b))
        self.file.world.solids(
            name, one, other, mu=mu or 0, e_N=self.file.e_N, friction=mu is not None
        )
        return True

    def _word(self, geom: int) -> str:
        """A name for a geom, whether it has one or not."""
        m, objects = self.file.m, self.file.mujoco.mjtObj.mjOBJ_GEOM
        own = self.file.mujoco.mj_id2name(m, objects, geom)
        return clean(own or f"{self.file.said('BODY', m.geom_bodyid[geom])}_geom{geom}")
