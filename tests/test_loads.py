"""Friction under the load of a constraint: screws, hoops, capstans."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.codegen.frontend.validate import freeze
from signorini.models import screw_jack

Build = Callable[..., sg.Stepper]
G = 9.81


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_screw_holds_iff_mu_exceeds_its_lead(stepper: Build, share: float) -> None:
    run = stepper(screw_jack.model, 2).simulate(
        dt=1e-3, t_end=0.1, parameters={"mu": share * np.tan(0.25)}
    )
    if share > 1:
        assert np.abs(run.q).max() < 1e-15
        assert run["flank.state"][-1] == "stick"
    else:
        s, c = np.sin(0.25), np.cos(0.25)
        mu = share * np.tan(0.25)
        along = 100 / (2 * s + 1e-3 / 0.02**2 * c * (c + mu * s) / (s - mu * c))
        assert run.v[-1, 0] == pytest.approx(-along * s * 0.1, rel=1e-9)


def hoop() -> sg.Model:
    """A bead on a horizontal rough hoop: its reaction has two components, weight and bend."""
    m = sg.Model("hoop")
    x, y, z = m.coordinates("x y z")
    v_x, v_y, v_z = m.velocities
    mass, R, mu = m.parameters(mass=0.4, R=0.5, mu=0.25)
    m.lagrangian = mass * (v_x**2 + v_y**2 + v_z**2) / 2 - mass * G * z
    r = sp.sqrt(x**2 + y**2)
    m.constraint("hoop", [r - R, z])
    m.friction("rub", gamma_F=(x * v_y - y * v_x) / r, mu=mu, pressed_by="hoop")
    m.initial_state(q=[R, 0, 0], v=[0, 2, 0])
    m.suggest(dt=5e-3, t_end=2)
    return m


def test_a_bead_stops_on_a_rough_hoop(stepper: Build) -> None:
    """d(v^2)/ds = -2 mu sqrt(g^2 + v^4 / R^2): it stops after asinh(v^2 / (g R)) / (2 mu) rad."""
    turns = np.arcsinh(4 / (G * 0.5)) / 0.5
    errors = []
    for dt in (1e-2, 2.5e-3):
        run = stepper(hoop, 2).simulate(dt=dt, t_end=2)
        angle = np.unwrap(np.arctan2(run.q[:, 1], run.q[:, 0]))
        errors.append(abs(angle[-1] - turns))
        assert run["rub.state"][-1] == "stick"
    assert errors[1] < errors[0] / 6
    assert errors[1] < 1e-5


def slider() -> sg.Model:
    """A slide on a dry rail, pulled by a slanted force, and a hinge at its end that is dry, too."""
    m = sg.Model("slider")
    x, y, a, b, _ = m.coordinates("x y a b phi")
    v_x, v_y, v_a, v_b, omega = m.velocities
    mass, pull, up, mu, nu = m.parameters(mass=2.0, pull=30.0, up=12.0, mu=0.3, nu=0.01)
    m.lagrangian = mass * (v_x**2 + v_y**2 + v_a**2 + v_b**2) / 2 + omega**2 / 200
    m.lagrangian -= mass * G * (y + b)
    m.force({"x": pull, "y": up})
    m.constraint("rail", y)
    m.constraint("hinge", [a - x, b - y])
    m.friction("rub", gamma_F=v_x, bound=mu * m.reaction("rail"))
    m.friction("dry", gamma_F=omega, bound=nu * m.reaction("hinge"))
    m.initial_state(q=[0] * 5, v=[1, 0, 1, 0, 20])
    return m


@pytest.mark.parametrize("up", [12.0, 60.0])
def test_a_slider_between_dry_joints(stepper: Build, up: float) -> None:
    """Rail and hinge carry what balance says, the rail pulls down once the force lifts both bodies:
    a = (F - mu |2 m g - U|) / 2 m, and the wheel on the hinge loses nu m |(a, g)| / J a second."""
    run = stepper(slider, 2).simulate(dt=1e-2, t_end=0.2, parameters={"up": up})
    a = (30 - 0.3 * abs(4 * G - up)) / 4
    assert np.sign(4 * G - up) == (1 if up < 30 else -1)
    assert run.v[-1, 0] == pytest.approx(1 + a * 0.2, rel=1e-12)
    assert run["hinge.force"][-1] == pytest.approx([2 * a, 2 * G], rel=1e-10)
    assert run.v[-1, 4] == pytest.approx(20 - 0.01 * 2 * np.hypot(a, G) * 100 * 0.2, rel=1e-12)


def capstan(pins: int, mu: float = 0.3) -> sg.Model:
    """A cord of stiff links, bent over pins on half a circle; friction is bounded by the pins."""
    m = sg.Model("capstan")
    names = " ".join(f"x_{k} y_{k}" for k in range(pins))
    q, v = m.coordinates(names), m.velocities
    slack, pull = m.parameters(slack=1.0, pull=1.0)
    angle = sp.pi / pins
    m.lagrangian = sum(w**2 for w in v) / 20
    m.force({"y_0": -slack})
    m.force({f"y_{pins - 1}": -pull})
    start = []
    for k in range(pins):
        x, y = q[2 * k : 2 * k + 2]
        turned = angle * (k + sp.Rational(1, 2))
        start += [sp.cos(turned), sp.sin(turned)]
        m.constraint(f"pin_{k}", (x**2 + y**2 - 1) / 2)  # of unit slope, so that it is a force
        if k > 0:
            apart = (x - q[2 * k - 2]) ** 2 + (y - q[2 * k - 1]) ** 2
            m.constraint(f"link_{k}", apart - (2 * sp.sin(angle / 2)) ** 2)
        slip = x * v[2 * k + 1] - y * v[2 * k]
        m.friction(f"rub_{k}", gamma_F=slip, bound=mu * m.reaction(f"pin_{k}"))
    m.initial_state(q=start)
    return m


@pytest.mark.parametrize("pins", [3, pytest.param(8, marks=pytest.mark.thorough)])
def test_a_capstan_holds_what_euler_and_eytelwein_say(pins: int) -> None:
    """A pin turns the cord by d = pi / n, its force grows by (1 + mu tan d/2) / (1 - mu tan d/2);
    for many pins by exp(mu pi) in all."""
    mu = 0.3
    t = mu * np.tan(np.pi / pins / 2)
    most = ((1 + t) / (1 - t)) ** pins
    # to leading order it exceeds the exponential by mu pi (1 + mu^2) (pi / n)^2 / 12
    assert most == pytest.approx(np.exp(mu * np.pi), rel=1.1 / pins**2)
    assert most > np.exp(mu * np.pi)
    made = sg.build(capstan(pins, mu), stages=2)
    for share in (1 / most, 0.999 / most**2, 0.5, 0.999, 1.001, 1.001 / most**2):
        run = made.simulate(dt=1e-3, t_end=0.01, parameters={"pull": share * most})
        holds = 1 / most <= share * most <= most
        assert (np.abs(run.v[-1]).max() < 1e-15) == holds, (share, run.v[-1])


@pytest.mark.thorough
@pytest.mark.parametrize("options", [{}, {"scheme": "moreau"}])
@pytest.mark.parametrize("make", [hoop, screw_jack.model])
def test_loads_are_checked(make: Callable[[], sg.Model], options: dict[str, Any]) -> None:
    report = sg.check(make(), stages=(2, 3) if not options else (2,), **options)
    assert report.passed, str(report)


def test_reactions_that_there_are_not() -> None:
    m = sg.Model("m")
    x, y = m.coordinates("x y")
    v_x, _ = m.velocities
    m.lagrangian = v_x**2 / 2
    m.constraint("rail", y)
    with pytest.raises(sg.ModelError, match=r"reaction\('rial'\).*Constraints are: rail"):
        m.reaction("rial")
    m.friction("rub", gamma_F=v_x, bound=0.3 * m.reaction("rail", 0, 2))
    m.initial_state(q=[0, 0])
    with pytest.raises(sg.ModelError, match=r"reaction of 'rail' in friction 'rub'.*0 to 1 of 1"):
        freeze(m)
    assert x is not None
