"""Rigid bodies, joints, contacts: a layer that writes a model's expressions for the user.

`Planar` and `Spatial` add coordinates, terms of the Lagrangian, forces, constraints and contacts
to a `signorini.Model`; nothing else changes. They work with SymPy and with CasADi symbols.
`from_lagrangian`, `from_lagranges_method` and `from_system` take over models of SymPy's mechanics.
"""

from signorini.bodies import inertia
from signorini.bodies.frames import Frame, Point
from signorini.bodies.from_mujoco import from_mjcf, from_urdf
from signorini.bodies.from_sympy import (
    Translated,
    from_lagranges_method,
    from_lagrangian,
    from_system,
)
from signorini.bodies.mujoco_writer import Imported
from signorini.bodies.planar import Planar
from signorini.bodies.ropes import Pulley
from signorini.bodies.shapes import Box, Capsule, Cylinder, Edge, Ellipsoid, Plane, Round, Surface
from signorini.bodies.spatial import Spatial

__all__ = [
    "Box",
    "Capsule",
    "Cylinder",
    "Edge",
    "Ellipsoid",
    "Frame",
    "Imported",
    "Planar",
    "Plane",
    "Point",
    "Pulley",
    "Round",
    "Spatial",
    "Surface",
    "Translated",
    "from_lagranges_method",
    "from_lagrangian",
    "from_mjcf",
    "from_system",
    "from_urdf",
    "inertia",
]
