"""The scenes in Exudyn: penalty contact of spheres with a plane, stiffness chosen by a sweep."""

from collections.abc import Iterator
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.utilities import (
    InertiaCuboid,
    InertiaSphere,
    MarkerBodyRigid,
    NodeGenericData,
    ObjectContactSphereTriangle,
    SensorBody,
)
from signorini.benchmarks.scenes import BALL, BOX, Run, clock

VERSION = exu.config.Version() if hasattr(exu, "config") else exu.GetVersionString()
STIFFNESSES = (1e4, 1e5, 1e6)
# Corners of the box are rounded: a sphere that enters deeper than its radius is not seen.
ROUND = 0.04


class _World:
    """A floor of one large triangle; spheres touch it by penalty, Gonthier's model of impact."""

    def __init__(self, mu: float, k: float, e_N: float) -> None:
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.law = {
            "dynamicFriction": mu,
            "contactStiffness": k,
            "restitutionCoefficient": max(e_N, 0.05),  # zero is not possible
            "impactModel": 2,
            "minimumImpactVelocity": 1e-3,
            "frictionProportionalZone": 1e-3,
        }
        ground = self.mbs.CreateGround()
        self.ground = self.mbs.AddMarker(
            MarkerBodyRigid(bodyNumber=ground, localPosition=[0, 0, 0])
        )

    def sphere(self, marker: int, radius: float) -> None:
        node = self.mbs.AddNode(
            NodeGenericData(initialCoordinates=[1, 0, 0, 0], numberOfDataCoordinates=4)
        )
        self.mbs.AddObject(
            ObjectContactSphereTriangle(
                markerNumbers=[marker, self.ground],
                nodeNumber=node,
                sphereRadius=radius,
                trianglePoints=exu.Vector3DList([[-50, -50, 0], [80, -50, 0], [-50, 80, 0]]),
                includeEdges=0,
                **self.law,
            )
        )

    def run(self, body: int, dt: float, steps: int) -> tuple[float, np.ndarray]:
        """Median microseconds a step, and position and rotation matrix after every step."""
        mbs = self.mbs
        sensors = [
            mbs.AddSensor(SensorBody(bodyNumber=body, storeInternal=True, outputVariableType=kind))
            for kind in (exu.OutputVariableType.Position, exu.OutputVariableType.RotationMatrix)
        ]
        mbs.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.endTime = steps * dt
        settings.timeIntegration.numberOfSteps = steps
        settings.timeIntegration.verboseMode = 0
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = dt
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.8

        def go() -> None:
            if not mbs.SolveDynamic(settings, updateInitialValues=False):
                raise RuntimeError("not solved")

        time = clock(go) / steps
        position, rotation = (mbs.GetSensorStoredData(s)[1:, 1:] for s in sensors)
        return time, np.hstack([position, rotation])


def _ball(k: float, e_N: float, omega: float) -> tuple[_World, int]:
    world = _World(BALL.mu, k, e_N)
    body = world.mbs.CreateRigidBody(
        referencePosition=[0, 0, BALL.height],
        inertia=InertiaSphere(BALL.mass, BALL.R),
        initialAngularVelocity=[0, -omega, 0],
        gravity=[0, 0, -9.81],
    )
    world.sphere(
        world.mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=[0, 0, 0])), BALL.R
    )
    return world, body


def _box(stiffness: float, e_N: float, q: Any, v: Any) -> tuple[_World, int]:
    world = _World(BOX.mu, stiffness, e_N)
    w, x, y, z = q[3:]
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    size = [2 * BOX.a, 2 * BOX.b, 2 * BOX.c]
    volume = float(np.prod(size))
    body = world.mbs.CreateRigidBody(
        referencePosition=q[:3],
        referenceRotationMatrix=R,
        inertia=InertiaCuboid(BOX.mass / volume, size),
        initialVelocity=v[:3],
        initialAngularVelocity=R @ np.array(v[3:]),
        gravity=[0, 0, -9.81],
    )
    r = ROUND
    for i in (-1, 1):
        for j in (-1, 1):
            for k in (-1, 1):
                place = [i * (BOX.a - r), j * (BOX.b - r), k * (BOX.c - r)]
                marker = MarkerBodyRigid(bodyNumber=body, localPosition=place)
                world.sphere(world.mbs.AddMarker(marker), r)
    return world, body


def runs() -> Iterator[Run]:
    """Ball and box with all stiffnesses."""
    for k in STIFFNESSES:
        settings = f"k {k:.0e} N/m"
        world, body = _ball(k, 0.5, 0.0)
        time, seen = world.run(body, BALL.dt, 300)
        yield Run.of_bouncing("Exudyn", settings, time, seen[:, 2])
        world, body = _ball(k, 0.0, 50.0)
        time, seen = world.run(body, BALL.dt, 110)
        yield Run.of_slipping("Exudyn", settings, time, seen[:, [0, 2]])
        for scene, (q, v), e_N, steps in (
            ("box_tumbles", BOX.thrown(), 0.1, 600),
            ("box_rests", ([0, 0, BOX.c, 1, 0, 0, 0], [0] * 6), 0.0, 300),
        ):
            world, body = _box(k, e_N, q, v)
            time, seen = world.run(body, BOX.dt, steps)
            half = np.array([BOX.a, BOX.b, BOX.c]) - ROUND
            lowest = seen[:, 2] - np.abs(seen[:, 9:12]) @ half - ROUND
            depth = max(0.0, float(-lowest.min()))
            yield Run(scene, "Exudyn", settings, time, depth, "")


def slip(dt: float) -> tuple[float, float]:
    """Error of x(1.1) of the slipping ball [m], microseconds a simulated second."""
    world, body = _ball(STIFFNESSES[-1], 0.0, 50.0)
    time, seen = world.run(body, dt, round(1.1 / dt))
    return abs(float(seen[-1, 0]) - BALL.exact_x), time / dt
