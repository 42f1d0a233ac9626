"""Order of the laws of contact: errors at the end of motions in which a law acts and changes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import sympy as sp
from signorini import Model, Stepper, build
from signorini.bodies import Planar, Pulley, Round
from signorini.models import bungee, freewheel, kanes_pendulum, string_pendulum
from signorini.studies.claims import Claim
from signorini.studies.paper import Progress, Study

G = sp.Rational(981, 100)


def rolling() -> Model:
    """A disc in a bowl turns back against its resistance to rolling."""
    m = Model("rolling_in_a_bowl")
    world = Planar(m, gravity=(0, -G))
    disc = world.body("disc", 1, sp.Rational(1, 50), coordinates="x y phi")
    m.lagrangian -= 10 * m.q[0] ** 2
    touching = Round(disc.point(), sp.Rational(1, 5))
    world.contact("floor", touching, world.plane(), mu=1, rolling=sp.Rational(1, 100))
    m.initial_state(q={"x": 0.4, "y": 0.2})
    return m


def two_surfaces() -> Model:
    """A mass on a spring between a floor and a belt that a contact presses."""
    m = Model("two_surfaces")
    (x, y), (v_x, v_y) = m.coordinates("x y"), m.velocities
    m.lagrangian = (v_x**2 + v_y**2) / 2 - G * y - 15 * x**2 - x**4
    m.contact("floor", g_N=y, gamma_F=v_x, mu=sp.Rational(1, 5))
    belt = v_x - sp.Rational(1, 2)
    m.friction("belt", gamma_F=belt, mu=sp.Rational(1, 10), pressed_by="floor")
    m.initial_state(q=[0.6, 0])
    return m


def ribs(mu: object = (sp.Rational(1, 10), sp.Rational(2, 5))) -> Model:
    """A mass in a bowl on a ribbed floor: its path bends."""
    m = Model("ribs")
    (x, y, z), v = m.coordinates("x y z"), m.velocities
    m.lagrangian = sum(w**2 for w in v) / 2 - G * z - 2 * x**2 - 3 * y**2
    m.contact("floor", g_N=z, gamma_F=[v[0], v[1]], mu=mu)
    m.initial_state(q=[0.1, -0.2, 0], v=[1, 1.5, 0])
    return m


def spinning() -> Model:
    """A disc slides and spins on a small area."""
    m = Model("spinning_disc")
    (x, y, z, _), (v_x, v_y, v_z, omega) = m.coordinates("x y z phi"), m.velocities
    spin = omega**2 / 400
    m.lagrangian = (v_x**2 + v_y**2 + v_z**2 + spin) / 2 - G * z - 2 * x**2 - 3 * y**2
    drilling = (sp.Rational(1, 20), omega)
    laws = {"mu": sp.Rational(3, 10), "drilling": drilling, "coupling": "contensou"}
    m.contact("floor", g_N=z, gamma_F=[v_x, v_y], **laws)
    m.initial_state(q=[0.1, -0.2, 0, 0], v=[1, 1.5, 0, 20])
    return m


def hoop() -> Model:
    """A bead on a rough hoop, pressed by its weight and the bend."""
    m = Model("rough_hoop")
    (x, y, z), v = m.coordinates("x y z"), m.velocities
    m.lagrangian = sum(w**2 for w in v) / 2 - G * z
    r = sp.sqrt(x**2 + y**2)
    m.constraint("hoop", [r - 1, z])
    slip = (x * v[1] - y * v[0]) / r
    m.friction("rub", gamma_F=slip, bound=sp.Rational(1, 4) * m.reaction("hoop"))
    m.initial_state(q=[1, 0, 0], v=[0, 3, 0])
    return m


def falling_friction(mu_at: str) -> Model:
    """A mass on a spring whose friction falls with the slip, and does not change its sign."""
    m = Model("falling_friction")
    (x, y), (v_x, v_y) = m.coordinates("x y"), m.velocities
    m.lagrangian = (v_x**2 + v_y**2) / 2 - G * y - 8 * x**2
    slip = v_x - 2
    mu = sp.Rational(1, 10) + sp.exp(-(slip**2)) / 2
    m.contact("belt", g_N=y, gamma_F=slip, mu=mu, mu_at=mu_at)
    m.initial_state(q=[0.2, 0])
    return m


def at_the_start() -> Model:
    """With the coefficient of the start of a step."""
    return falling_friction("start")


def at_the_stages() -> Model:
    """With that of every stage."""
    return falling_friction("stages")


def gears() -> Model:
    """Two gears with play under a torque that turns."""
    m = Model("driven_gears")
    (one, two), (w_1, w_2) = m.coordinates("one two"), m.velocities
    m.lagrangian = (w_1**2 + 2 * w_2**2) / 2 - two**2
    m.force({"one": 3 * sp.sin(7 * m.time)})
    m.coupling("teeth", one + 2 * two, play=sp.Rational(1, 10), e_N=sp.Rational(1, 2))
    m.initial_state(q=[0, 0], v=[1, 0])
    return m


def pulley() -> Model:
    """Two weights on a rope over a pulley, one of which swings."""
    m = Model("swinging_atwood")
    world = Planar(m, gravity=(0, -G))
    one, two = world.particle("one", 1), world.particle("two", 2)
    wheel = Pulley(world.ground.point(0, 0), sp.Rational(1, 10), over=(0, 1))
    world.rope("rope", [one, wheel, two], 3)
    m.initial_state(q={"one_x": -0.6, "one_y": -1.0, "two_x": 0.1, "two_y": -1.2})
    return m


def buffer() -> Model:
    """A mass meets a compliant stop with friction."""
    m = Model("buffer")
    (x, _), (v_x, v_y) = m.coordinates("x y"), m.velocities
    m.lagrangian = (v_x**2 + v_y**2) / 2
    laws = {"compliance": sp.Rational(1, 100), "relaxation": sp.Rational(1, 20)}
    m.contact("stop", g_N=x, gamma_F=v_y, mu=sp.Rational(1, 5), **laws)
    m.initial_state(q=[0.1, 0], v=[-1, 1])
    return m


@dataclass(frozen=True)
class Scene:
    """A law in motion, and the orders of captured and located steps with s = 2, 3.

    `located` is None where the events of the law are not. `exact` is the same model with a law that
    has the scheme's order, where the law itself has not.
    """

    text: str
    model: Callable[[], Model]
    t_end: float
    captured: tuple[float, float]
    located: tuple[float, float] | None = None
    exact: Callable[[], Model] | None = None
    steps: int = 40


SCENES = (
    Scene("resistance to rolling", rolling, 1.0, (1, 1), (2, 4)),
    Scene("pressed by a contact", two_surfaces, 1.2, (1, 1), (2, 4)),
    Scene("anisotropic, sliding", ribs, 0.3, (1, 1), (2, 4)),
    Scene("sliding that spins", spinning, 0.25, (1, 1), (2, 4)),
    Scene("under load, sliding", hoop, 0.8, (2, 2)),
    Scene("one way", freewheel.model, 0.9, (1, 1)),
    Scene("mu of the slip, at the start", at_the_start, 0.6, (1, 1), (1, 1), at_the_stages, 400),
    Scene("mu of the slip, at the stages", at_the_stages, 0.6, (2, 4), (2, 4), steps=20),
    Scene("a string, slack and taut", string_pendulum.model, 1.6, (1, 1), (2, 4)),
    Scene("a rope on a pulley", pulley, 0.5, (1, 1), (2, 4)),
    Scene("gears with play", gears, 1.3, (1, 1), (2, 4)),
    Scene("Poisson's law", kanes_pendulum.model, 0.6, (1, 1), (2, 4)),
    Scene("a compliant stop", buffer, 0.6, (1, 1)),
    Scene("an elastic rope", bungee.model, 4.0, (1, 1)),
)


def orders(report: Progress = lambda text: None, scenes: tuple[Scene, ...] = SCENES) -> Study:
    """Orders of captured and located steps for every law, s = 2 and 3, against s = 4 or, where
    events are not located, against steps sixteen times shorter."""
    study = Study("law orders")
    for scene in scenes:
        report(f"law orders, {scene.text}")
        _orders(study, scene)
    return study


def _orders(study: Study, scene: Scene) -> None:
    way = "captured" if scene.located is None else "located"
    exact = None
    if scene.located:
        made = build((scene.exact or scene.model)(), stages=4, events="located")
        exact = _end(made, scene, 16 * scene.steps, "located")
    for k, s in enumerate((2, 3)):
        made = build(scene.model(), stages=s, events=way)
        for events, expected in (("captured", scene.captured), ("located", scene.located)):
            if expected is None:
                continue
            counts = scene.steps * np.array([1, 2, 4, 8])
            end = _end(made, scene, 128 * scene.steps, events) if exact is None else exact
            errors = [
                float(np.max(np.abs(_end(made, scene, int(n), events) - end))) for n in counts
            ]
            study.curves[f"{scene.text}: {events}, s = {s}"] = {
                "dt": scene.t_end / counts, "q": errors
            }  # fmt: skip
            order = float(np.log2(errors[0] / max(errors[-1], 1e-14)) / 3)
            text = f"order, {scene.text}: {expected[k]:g}"
            study.claims.append(Claim(f"{events}, s = {s}", text, order, ">=", expected[k] - 0.4))


def _end(made: Stepper, scene: Scene, steps: int, events: str) -> np.ndarray:
    traj = made.simulate(t_end=scene.t_end, dt=scene.t_end / steps, events=events)
    return np.concatenate([traj.q[-1], traj.v[-1]])


STUDIES: dict[str, Callable[..., Study]] = {"law orders": orders}
