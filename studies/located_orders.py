"""Order of located events: errors at the end of motions through impacts, friction, accumulations.

The bead, the block and the conveyor are shipped models; the others are stated here.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import sympy as sp
from signorini import Model, Stepper, build
from signorini.models import bead_on_hoop, conveyor_oscillator, rocking_block
from signorini.studies.claims import Claim, near
from signorini.studies.paper import Progress, Study
from signorini.verify.event_driven import EventDriven


def rough_floor() -> Model:
    """A mass on a spring on a rough floor: friction turns with the velocity."""
    m = Model("rough_floor")
    (x, y), (v_x, v_y) = m.coordinates("x y", units="m m"), m.velocities
    m.lagrangian = (v_x**2 + v_y**2) / 2 - sp.Rational(981, 100) * y - 20 * x**2
    m.contact("floor", g_N=y, gamma_F=v_x, mu=sp.Rational(1, 5))
    m.initial_state(q=[0.5, 0])
    return m


def hill() -> Model:
    """A mass that hops down a hill, ever lower, and slides on."""
    m = Model("hill")
    (x, y), (v_x, v_y) = m.coordinates("x y", units="m m"), m.velocities
    m.lagrangian = (v_x**2 + v_y**2) / 2 - sp.Rational(981, 100) * y
    m.contact("ground", g_N=y + x**2 / 4, e_N=sp.Rational(1, 2))
    m.initial_state(q=[0.2, 0.05], v=[0.3, 0])
    return m


@dataclass(frozen=True)
class Scene:
    """A motion through events: a model, where it starts and ends, its events by kind.

    `steps`: of the coarsest run. `most`: order of what the rest rule takes from an accumulation.
    """

    text: str
    model: Callable[[], Model]
    t_end: float
    events: tuple[str, ...]
    parameters: dict[str, float] = field(default_factory=dict)
    q: tuple[float, ...] | None = None
    steps: int = 20
    most: int = 100


SCENES = (
    Scene("one impact, e = 0, and lift-off", bead_on_hoop.model, 1.2, ("impact", "open"),
          {"e_N": 0.0}),
    Scene("two impacts, e = 0.5", bead_on_hoop.model, 0.8, ("impact",) * 2),
    Scene("five impacts, e = 1", bead_on_hoop.model, 2.4, ("impact",) * 5,
          {"e_N": 1.0, "Omega": 0.0}, (1.0,)),
    Scene("a block that rocks", rocking_block.model, 0.7, ("impact", "impact"), steps=10),
    Scene("slip turns back", rough_floor, 1.3, ("reverse",) * 2),
    Scene("stick, slip, stick", conveyor_oscillator.model, 10.5, ("slip", "stick"), steps=80),
    Scene("hops that end", hill, 0.8, (), most=3),
)  # fmt: skip


@cache
def stepper(model: Callable[[], Model], stages: int, precision: str = "double") -> Stepper:
    """The stepper of a model whose steps can be cut at events."""
    return build(model(), stages=stages, events="located", precision=precision)


def orders(
    report: Progress = lambda text: None,
    scenes: tuple[Scene, ...] = SCENES,
    stages: tuple[int, ...] = (2, 3, 4, 5),
) -> Study:
    """Orders of located and captured steps in all scenes."""
    study = Study("located orders")
    for scene in scenes:
        report(f"located orders, {scene.text}")
        _orders(study, scene, stages)
    return study


def _orders(study: Study, scene: Scene, stages: tuple[int, ...]) -> None:
    """Errors at the end against s = 5 with ever so many steps, which itself is compared.

    Stages beyond four, and what all are compared with, are in extended precision where the machine
    has it: in double round-off would hide their order.
    """
    wide = "extended" if np.finfo(np.longdouble).eps < np.finfo(float).eps else "double"
    exact, traj = _end(scene, 5, 32 * scene.steps, "located", wide)
    plain = stepper(scene.model, 5, wide)
    par = plain.check_parameters(scene.parameters)
    t, q, v = plain.start_of(scene.q, None, None, par)
    at = (t, q.astype(float), v.astype(float), np.zeros(plain.sizes["n_u"]), list(par.values()))
    motion = EventDriven(scene.model(), 1e-6)
    other = np.concatenate(motion.run(at, t + scene.t_end, scene.t_end / 40))
    study.claims.append(
        Claim("located", f"{scene.text}: s = 5 and motion by events, apart by",
              float(np.max(np.abs(exact - other))), "<=", 2e-10)
    )  # fmt: skip
    if scene.events:
        kinds = tuple(e.kind for e in traj.events)
        study.claims.append(
            near("located", f"{scene.text}: events", len(kinds), len(scene.events), 0.0)
        )
    counts = scene.steps * np.array([1, 2, 4, 8])
    for s in stages:
        for events in ("captured", "located"):
            precision = wide if s > 4 and events == "located" else "double"
            errors = []
            for n in counts:
                end, _ = _end(scene, s, int(n), events, precision)
                errors.append(float(np.max(np.abs(end - exact))))
            study.curves[f"{scene.text}: {events}, s = {s}"] = {
                "dt": scene.t_end / counts, "q": errors
            }  # fmt: skip
            if events == "located":
                # from the coarsest to the finest that round-off leaves alone
                floor = 5e-17 if precision == "extended" else 1e-13
                k = max((k for k in range(1, 4) if errors[k] > floor), default=0)
                if k == 0:
                    continue
                order = float(np.log2(errors[0] / errors[k]) / k)
                expected = min(2 * s - 2, scene.most)
                study.claims.append(
                    Claim(
                        f"located, s = {s}",
                        f"order, {scene.text}: {expected}",
                        order,
                        ">=",
                        expected - 0.6,
                    )
                )


def _end(
    scene: Scene, stages: int, steps: int, events: str, precision: str
) -> tuple[np.ndarray, Any]:
    traj = stepper(scene.model, stages, precision).simulate(
        t_end=scene.t_end, dt=scene.t_end / steps, events=events, tol=0.0,
        parameters=scene.parameters, q0=scene.q,
    )  # fmt: skip
    return np.concatenate([traj.q[-1], traj.v[-1]]), traj


STUDIES: dict[str, Callable[..., Study]] = {"located orders": orders}
