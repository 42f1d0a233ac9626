"""Robots from files: MJCF and URDF, read by MuJoCo's parser, as models in minimal coordinates."""

import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from signorini.bodies.mujoco_contacts import Side
from signorini.bodies.mujoco_names import clean
from signorini.bodies.mujoco_writer import Imported, Writer
from signorini.codegen.frontend.errors import ModelError

_ADVICE = "reading MJCF and URDF needs MuJoCo's parser: pip install 'signorini[robots]'"


def from_mjcf(
    source: str | os.PathLike[str],
    *,
    name: str | None = None,
    contacts: bool | Iterable[str] = True,
    pairs: bool | Iterable[tuple[Side, Side]] = False,
    e_N: float = 0.0,
    meshes: str | None = None,
    keyframe: str | None = None,
    start: Mapping[str, float] | None = None,
) -> Imported:
    """A model from an MJCF file or its text.

    Bodies with their inertias, joints with armature, stiffness, damping, friction loss and limits,
    tendons along joints, equality constraints of joints, tendons and points, welds, actuators on
    joints and such tendons (their controls are inputs, their forces keep their limits), gravity;
    contacts of collision primitives with the planes of the world, and with each other as far as
    `pairs` says. Contacts and limits are rigid: what MuJoCo says of their softness does not count.

    Parameters
    ----------
    source : path or str
        A file, or text that begins with ``<``.
    name : str, optional
        Of the model; by default that of the file.
    contacts : bool or iterable of str
        Whether primitives that may collide in the file touch the world's planes, or the names of
        geoms and bodies that do.
    pairs : bool or iterable of pairs
        What touches besides. A pair has two of: the name of a geom, the name of a body for all its
        geoms, the number of a group of geoms. Two geoms named by themselves touch whatever the file
        says, of the others those that may collide in the file. True: all that may collide. Balls
        touch balls, capsules, boxes and cylinders; capsules touch capsules.
    e_N : float
        Default of the restitution of contacts and limits, the parameter ``e_N``.
    meshes : {None, "box"}
        ``"box"`` takes the box around a mesh in its place; by default meshes are left out.
    keyframe : str, optional
        Initial state; by default the configuration of the file.
    start : mapping from coordinate name, optional
        Values that differ from it; the start must satisfy constraints and not penetrate.

    Returns
    -------
    Imported
        With `Imported.left_out`, what has no counterpart.

    Raises
    ------
    ModelError
        For a file that MuJoCo cannot read, or arguments that name nothing.
    ModuleNotFoundError
        If MuJoCo is missing.

    Examples
    --------
    >>> from signorini.bodies import from_mjcf
    >>> text = (
    ...     '<mujoco model="drop"><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 1">'
    ...     '<freejoint/><geom type="sphere" size=".1" mass="1"/></body></worldbody></mujoco>'
    ... )
    >>> from_mjcf(text).model.name
    'drop'
    """
    spec = _parsed(source)
    return _import(spec, name, contacts, pairs, e_N, meshes, keyframe, start)


def from_urdf(
    source: str | os.PathLike[str],
    *,
    name: str | None = None,
    floating: bool = False,
    ground: bool | Iterable[str] = False,
    massless: Iterable[str] = (),
    pairs: bool | Iterable[tuple[Side, Side]] = False,
    e_N: float = 0.0,
    meshes: str | None = None,
    start: Mapping[str, float] | None = None,
) -> Imported:
    """A model from a URDF file or its text.

    As `from_mjcf`; meshes need not be there unless ``meshes="box"``. Links that are fixed to others
    are parts of them. Geoms are called as their links are, a second one of a link with ``_2``.

    Parameters
    ----------
    source, name, pairs, e_N, meshes, start
        As in `from_mjcf`.
    floating : bool
        Whether the root moves freely; by default it is fixed to the world.
    ground : bool or iterable of str
        Whether there is a plane z = 0 that collision primitives touch, or the names of geoms and
        links that do.
    massless : iterable of str
        Links whose inertia does not count: many files have placeholders that no body can have.

    Returns
    -------
    Imported

    Raises
    ------
    ModelError
        As `from_mjcf`.
    ModuleNotFoundError
        If MuJoCo is missing.
    """
    changed = _changed(source, floating, list(massless))
    spec = _parsed(changed)
    if not _is_text(source):
        spec.modelfiledir = str(Path(source).resolve().parent)
    spec.compiler.discardvisual = True
    spec.compiler.fusestatic = True
    missing = [] if meshes == "box" else _without_meshes(spec)
    _name_geoms(spec)
    ground = ground if isinstance(ground, bool) else list(ground)
    if ground:
        import mujoco

        spec.worldbody.add_geom(
            name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[10.0, 10.0, 0.1]
        )
    found = _import(spec, name, ground, pairs, e_N, meshes, None, start)
    found.left_out[:0] = missing
    return found


# --- reading --------------------------------------------------------------------------------------


def _is_text(source: str | os.PathLike[str]) -> bool:
    return isinstance(source, str) and source.lstrip().startswith("<")


def _file(source: str | os.PathLike[str]) -> Path:
    path = Path(source)
    if not path.is_file():
        raise ModelError(
            path.stem or "robot", "from a file", f"there is no file {path}", "Give its path"
        )
    return path


def _changed(source: str | os.PathLike[str], floating: bool, massless: list[str]) -> str:
    """URDF with a joint between a link that does not move and the root, without placeholders."""
    text = str(source) if _is_text(source) else _file(source).read_text(encoding="utf-8")
    try:
        robot = ET.fromstring(text)
    except ET.ParseError as error:
        raise ModelError("robot", "its file", f"is no XML: {error}", "Correct the file") from None
    links = {link.get("name", ""): link for link in robot.findall("link")}
    for name in massless:
        if name not in links:
            raise ModelError(
                "robot", f"massless link '{name}'", "is not in the file", "Name a link"
            )
        for inertial in links[name].findall("inertial"):
            links[name].remove(inertial)
    if not floating:
        return ET.tostring(robot, encoding="unicode")
    children = {child.get("link") for child in robot.findall("joint/child")}
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise ModelError(
            "robot", "its file", f"has {len(roots)} links that no joint moves", "A tree has one"
        )
    ET.SubElement(robot, "link", {"name": "fixed_world"})
    joint = ET.SubElement(robot, "joint", {"name": f"{roots[0]}_free", "type": "floating"})
    ET.SubElement(joint, "parent", {"link": "fixed_world"})
    ET.SubElement(joint, "child", {"link": roots[0]})
    return ET.tostring(robot, encoding="unicode")


def _parsed(source: str | os.PathLike[str]) -> Any:
    try:
        import mujoco
    except ImportError:
        raise ModuleNotFoundError(_ADVICE) from None
    try:
        if _is_text(source):
            return mujoco.MjSpec.from_string(str(source))
        return mujoco.MjSpec.from_file(str(_file(source)))
    except ValueError as error:
        raise ModelError(
            "robot", "its file", f"MuJoCo cannot read it: {error}", "Correct the file"
        ) from None


def _name_geoms(spec: Any) -> None:
    """Geoms of a URDF have no names: they get that of their link, which may be fused to another."""
    taken = {geom.name for geom in spec.geoms}
    for body in spec.bodies:
        for geom in body.geoms:
            count, word = 1, body.name
            while not geom.name and word in taken:
                count += 1
                word = f"{body.name}_{count}"
            if not geom.name:
                geom.name = word
                taken.add(word)


def _without_meshes(spec: Any) -> list[str]:
    """Take geoms with meshes out of a specification; what they were."""
    import mujoco

    gone = []
    for geom in list(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            gone.append(f"geom '{geom.name or geom.meshname}': a mesh (meshes='box' takes its box)")
            spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    return gone


def _import(
    spec: Any,
    name: str | None,
    contacts: bool | Iterable[str],
    pairs: bool | Iterable[tuple[Side, Side]],
    e_N: float,
    meshes: str | None,
    keyframe: str | None,
    start: Mapping[str, float] | None,
) -> Imported:
    if meshes not in (None, "box"):
        raise ModelError("robot", f"meshes={meshes!r}", "is no choice", 'Give None or "box"')
    try:
        m = spec.compile()
    except ValueError as error:
        raise ModelError(
            "robot",
            "its file",
            f"MuJoCo cannot compile it: {error}",
            "Correct the file; links of a URDF whose inertia is a placeholder: massless=[...]",
        ) from None
    chosen = clean(name or spec.modelname or "robot")
    chosen_pairs = pairs if isinstance(pairs, bool) else list(pairs)
    return Writer(m, chosen, contacts, chosen_pairs, e_N, meshes, keyframe, start or {}).write()
