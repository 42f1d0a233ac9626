"""Moments of inertia of simple homogeneous shapes about their centre of mass.

Planar shapes give one number, shapes in space the three principal moments about the axes x, y, z
of the body. Dimensions in m, mass in kg, inertia in kg m^2; expressions are as good as numbers.
"""

from typing import Any

Moments = tuple[Any, Any, Any]


def rod(mass: Any, length: Any) -> Any:
    """Thin rod, about an axis perpendicular to it: m l^2 / 12."""
    return mass * length**2 / 12


def rectangle(mass: Any, width: Any, height: Any) -> Any:
    """Rectangle: m (w^2 + h^2) / 12."""
    return mass * (width**2 + height**2) / 12


def disc(mass: Any, radius: Any) -> Any:
    """Disc: m R^2 / 2."""
    return mass * radius**2 / 2


def ring(mass: Any, radius: Any) -> Any:
    """Thin ring: m R^2."""
    return mass * radius**2


def cuboid(mass: Any, a: Any, b: Any, c: Any) -> Moments:
    """Cuboid with edges a, b, c along x, y, z."""
    return mass * (b**2 + c**2) / 12, mass * (a**2 + c**2) / 12, mass * (a**2 + b**2) / 12


def ball(mass: Any, radius: Any) -> Moments:
    """Solid ball: 2/5 m R^2."""
    J = 2 * mass * radius**2 / 5
    return J, J, J


def shell(mass: Any, radius: Any) -> Moments:
    """Thin spherical shell: 2/3 m R^2."""
    J = 2 * mass * radius**2 / 3
    return J, J, J


def cylinder(mass: Any, radius: Any, height: Any) -> Moments:
    """Solid cylinder about its axis z; height 0 is a thin disc."""
    across = mass * (3 * radius**2 + height**2) / 12
    return across, across, mass * radius**2 / 2
