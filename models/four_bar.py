"""Planar four-bar linkage described in space: more constraints than it needs.

Three bodies with quaternions and four hinges make 23 constraints for 21 coordinates and one degree
of freedom: three constraints are redundant. Closed form: with equal cranks and the coupler as long
as the base the coupler only translates, and the linkage swings like a pendulum of the length
l (2/3 m_c + m_k) / (m_c + m_k), thin cranks of mass m_c, coupler of mass m_k.
"""

import signorini as sg
import sympy as sp
from signorini.bodies import Spatial


def model() -> sg.Model:
    """Return the model."""
    m = sg.Model("four_bar")
    m.doc = "Four-bar linkage in space with redundant constraints"
    crank, base, m_c, m_k, grav, phi = m.parameters(
        crank=sg.par(0.3, unit="m", min=0, doc="length of a crank"),
        base=sg.par(0.5, unit="m", min=0, doc="length of base and coupler"),
        m_c=sg.par(0.2, unit="kg", min=0, doc="mass of a crank"),
        m_k=sg.par(0.5, unit="kg", min=0, doc="mass of the coupler"),
        grav=sg.par(9.81, unit="m/s^2", doc="gravity"),
        phi=sg.par(0.6, unit="rad", doc="angle of the cranks from the vertical at the start"),
    )
    world = Spatial(m, gravity=(0, 0, -grav))
    thin = 1e-4  # square of the radius of gyration about the long axis [m^2]
    along_z = (m_c * crank**2 / 12, m_c * crank**2 / 12, m_c * thin)
    along_x = (m_k * thin, m_k * base**2 / 12, m_k * base**2 / 12)
    left = world.body("left", m_c, along_z)
    coupler = world.body("coupler", m_k, along_x)
    right = world.body("right", m_c, along_z)
    axis = (0, 1, 0)
    ground = [world.ground.point(), world.ground.point(base, 0, 0)]
    ends = [coupler.point(-base / 2, 0, 0), coupler.point(base / 2, 0, 0)]
    for name, body, above, below in zip(
        ("left", "right"), (left, right), ground, ends, strict=True
    ):
        world.revolute(f"{name}_base", body.point(0, 0, crank / 2), above, axis)
        world.revolute(f"{name}_coupler", body.point(0, 0, -crank / 2), below, axis)
        m.shape([above.position, body.point(0, 0, -crank / 2).position])
    m.shape([e.position for e in ends])
    # cranks turned about the y axis by -phi: their lower ends move to positive x
    s, c = sp.sin(phi), sp.cos(phi)
    world.initial_state(
        q={
            "left_x": crank / 2 * s,
            "left_z": -crank / 2 * c,
            "right_x": base + crank / 2 * s,
            "right_z": -crank / 2 * c,
            "coupler_x": base / 2 + crank * s,
            "coupler_z": -crank * c,
        },
        attitude={"left": (axis, -phi), "right": (axis, -phi)},
    )
    m.output("angle", sp.atan2(coupler.point(-base / 2, 0, 0).position[0], -coupler.origin[2]))
    m.suggest(dt=5e-3, t_end=1)
    return m
