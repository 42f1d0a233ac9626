"""The scenes in Drake: discrete contact, no coefficient of restitution."""

from collections.abc import Iterator
from importlib.metadata import version
from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    HalfSpace,
    ProximityProperties,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from signorini.benchmarks.scenes import BALL, BOX, CRANK, Run, clock

VERSION = version("drake")
APPROXIMATIONS = ("sap", "lagged", "tamsi")
_START = [1.0, 0, 0, 0, 0, 0, BALL.height]
_SPINNING = [0, -50.0, 0, 0, 0, 0]


class _World:
    """A plant with its diagram; `finish` makes it ready to run."""

    def __init__(self, dt: float, approximation: str) -> None:
        self.builder = DiagramBuilder()
        config = MultibodyPlantConfig(time_step=dt, discrete_contact_approximation=approximation)
        self.plant, self.scene_graph = AddMultibodyPlant(config, self.builder)
        self.dt = dt

    def properties(self, mu: float) -> Any:
        properties = ProximityProperties()
        AddContactMaterial(friction=CoulombFriction(mu, mu), properties=properties)
        return properties

    def body(self, name: str, mass: float, inertia: Any, at: float = 0.0) -> Any:
        unit = UnitInertia(*(j / mass for j in inertia))
        spatial = SpatialInertia(mass, [0, 0, 0], unit)
        if at:
            spatial = spatial.Shift([-at, 0, 0])
        return self.plant.AddRigidBody(name, spatial)

    def shape(self, body: Any, place: Any, shape: Any, name: str, mu: float) -> None:
        self.plant.RegisterCollisionGeometry(body, place, shape, name, self.properties(mu))

    def finish(self) -> None:
        self.plant.Finalize()
        self.diagram = self.builder.Build()
        self.simulator = Simulator(self.diagram)
        self.context = self.diagram.CreateDefaultContext()
        self.at = self.plant.GetMyContextFromRoot(self.context)

    def run(self, q: Any, v: Any, steps: int) -> tuple[float, np.ndarray]:
        """Median microseconds a step, and q after every step."""

        def start() -> None:
            context = self.simulator.get_mutable_context()
            context.SetTime(0.0)
            at = self.plant.GetMyMutableContextFromRoot(context)
            self.plant.SetPositions(at, q)
            self.plant.SetVelocities(at, v)
            self.simulator.Initialize()

        def go() -> None:
            start()
            self.simulator.AdvanceTo(steps * self.dt)

        time = clock(go) / steps
        start()
        seen = []
        for k in range(1, steps + 1):
            self.simulator.AdvanceTo(k * self.dt)
            at = self.plant.GetMyContextFromRoot(self.simulator.get_context())
            seen.append(self.plant.GetPositions(at).copy())
        return time, np.array(seen)


def _floor(world: _World, mu: float) -> None:
    world.shape(world.plant.world_body(), RigidTransform(), HalfSpace(), "floor", mu)


def runs() -> Iterator[Run]:
    """All scenes with all approximations of contact."""
    for name in APPROXIMATIONS:
        world = _ball(BALL.dt, name)
        time, q = world.run(_START, np.zeros(6), 300)
        yield Run.of_bouncing("Drake", name, time, q[:, 6])
        time, q = world.run(_START, _SPINNING, 110)
        yield Run.of_slipping("Drake", name, time, q[:, [4, 6]])
        yield _crank(name)
        yield from _boxes(name)


def slip(dt: float) -> tuple[float, float]:
    """Error of x(1.1) of the slipping ball [m], microseconds a simulated second."""
    time, q = _ball(dt, "tamsi").run(_START, _SPINNING, round(1.1 / dt))
    return abs(float(q[-1, 4]) - BALL.exact_x), time / dt


def _ball(dt: float, name: str) -> _World:
    world = _World(dt, name)
    J = 0.4 * BALL.mass * BALL.R**2
    ball = world.body("ball", BALL.mass, (J, J, J))
    world.shape(ball, RigidTransform(), Sphere(BALL.R), "ball", BALL.mu)
    _floor(world, BALL.mu)
    world.finish()
    return world


def _crank(name: str) -> Run:
    c = CRANK
    world = _World(c.dt, name)
    tilt = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0, 0, c.d / 2])
    _floor_at = RigidTransform([0, 0, -c.d / 2])
    world.shape(world.plant.world_body(), _floor_at, HalfSpace(), "low", c.mu)
    world.shape(world.plant.world_body(), tilt, HalfSpace(), "high", c.mu)
    crank = world.body("crank", c.m_1, (c.J_1,) * 3, c.l_1 / 2)
    rod = world.body("rod", c.m_2, (c.J_2,) * 3, c.l_2 / 2)
    slider = world.body("slider", c.m_3, (c.J_3,) * 3)
    plant, axis, r = world.plant, [0, -1, 0], 1e-3
    joints = (
        ("a", plant.world_body(), 0.0, crank),
        ("b", crank, c.l_1, rod),
        ("c", rod, c.l_2, slider),
    )
    for label, before, at, after in joints:
        frame = plant.AddFrame(_fixed(plant, label, before, at))
        plant.AddJoint(RevoluteJoint(label, frame, after.body_frame(), axis))
    for x in (-1, 1):
        for z in (-1, 1):
            place = RigidTransform([x * (c.a - r), 0, z * (c.b - r)])
            world.shape(slider, place, Sphere(r), f"corner{x}{z}", c.mu)
    world.finish()
    start = [0.0, 0.0, c.phi_3]
    speed = [c.omega_1, c.omega_2 - c.omega_1, -c.omega_2]
    time, q = world.run(start, speed, 1466)
    return Run.of_crank("Drake", name, time, np.cumsum(q, axis=1))


def _fixed(plant: Any, label: str, body: Any, at: float) -> Any:
    return FixedOffsetFrame(f"at_{label}", body.body_frame(), RigidTransform([at, 0, 0]))


def _boxes(name: str) -> Iterator[Run]:
    world = _World(BOX.dt, name)
    a, b, c = BOX.a, BOX.b, BOX.c
    third = BOX.mass / 3
    box = world.body(
        "box", BOX.mass, (third * (b**2 + c**2), third * (a**2 + c**2), third * (a**2 + b**2))
    )
    world.shape(box, RigidTransform(), Box(2 * a, 2 * b, 2 * c), "box", BOX.mu)
    _floor(world, BOX.mu)
    world.finish()
    place, speed = BOX.thrown()
    R = RotationMatrix(_quaternion(place[3:])).matrix()
    omega = R @ np.array(speed[3:])
    for scene, q, v, steps in (
        ("box_tumbles", [*place[3:], *place[:3]], [*omega, *speed[:3]], 600),
        ("box_rests", [1.0, 0, 0, 0, 0, 0, c], np.zeros(6), 300),
    ):
        time, seen = world.run(q, v, steps)
        yield Run.of_box("Drake", scene, name, time, seen[:, [4, 5, 6, 0, 1, 2, 3]])


def _quaternion(p: list[float]) -> Any:
    return Quaternion(np.array(p) / np.linalg.norm(p))
