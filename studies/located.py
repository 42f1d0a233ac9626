"""Located events: energy of elastic impacts, accumulations, an impact oscillator.

The oscillator is x'' + x = cos(omega t) in front of a wall, x <= sigma, with x' -> -r x' there
(S. W. Shaw, P. J. Holmes, *A periodically forced piecewise linear oscillator*, Journal of Sound
and Vibration 90, 1983). Between impacts x = a cos t + b sin t + cos(omega t) / (1 - omega^2), so
that its impacts are roots of a function in closed form.
"""

from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import sympy as sp
from signorini import Model
from signorini.models import bouncing_ball
from signorini.studies.claims import Claim, near
from signorini.studies.located_orders import stepper
from signorini.studies.paper import Progress, Study


def oscillator() -> Model:
    """A mass on a spring in front of a wall."""
    m = Model("impact_oscillator")
    (x,), (v,) = m.coordinates("x", units="m"), m.velocities
    omega, sigma, r = m.parameters(omega=2.7, sigma=0.0, r=0.8)
    m.lagrangian = v**2 / 2 - x**2 / 2
    m.force([sp.cos(omega * m.time)])
    m.contact("wall", g_N=sigma - x, e_N=r)
    m.initial_state(q=[-0.3])
    return m


def located(
    report: Progress = lambda text: None,
    bounces: int = 100_000,
    frequencies: int = 181,
) -> Study:
    """Energy, accumulations, and the impact oscillator against its closed form."""
    study = Study("located")
    report("located, energy")
    _energy(study, bounces)
    report("located, accumulations")
    _accumulations(study)
    report("located, impact oscillator")
    _oscillator(study, frequencies)
    return study


def _accumulations(study: Study) -> None:
    """A ball comes to rest where its flights, each e times the last, come to an end."""
    for e_N, height, dt in ((0.5, 0.9, 1e-2), (0.9, 0.1, 1e-3)):
        fall = np.sqrt(2 * height / 9.81)
        ends = fall * (1 + 2 * e_N / (1 - e_N))
        traj = stepper(bouncing_ball.model, 3).simulate(
            t_end=dt * np.ceil(1.05 * ends / dt), dt=dt, q0={"y": 0.1 + height}, v0={"phi": 0.0},
            parameters={"e_N": e_N}, events="located",
        )  # fmt: skip
        last = [e.t for e in traj.events if e.kind == "impact"][-1]
        text = f"located, accumulation, e_N = {e_N}"
        study.claims += [
            near(text, "the ball rests from", last, ends, 0.015 * dt * e_N / (1 - e_N), "s"),
            near(text, "velocity behind it", float(np.max(np.abs(traj.v[-1]))), 0.0, 0.0, "m/s"),
            near(text, "steps of which any part was captured", int(traj.captured.sum()), 0, 0.0),
        ]


def _energy(study: Study, bounces: int) -> None:
    fall = np.sqrt(2 * 0.9 / 9.81)
    dt = 1e-2
    for events in ("captured", "located"):
        n = bounces if events == "located" else min(bounces, 1000)
        steps = int(np.ceil(2 * fall * (n - 0.25) / dt))
        traj = stepper(bouncing_ball.model, 3).simulate(
            t_end=steps * dt, dt=dt, v0={"phi": 0.0}, parameters={"e_N": 1.0}, events=events,
            every=max(1, steps // 400),
        )  # fmt: skip
        energy = traj.energy - 0.981
        study.curves[f"energy, {events}"] = {"t": traj.t, "energy": energy / energy[0]}
        if events == "located":
            hits = [e.t for e in traj.events]
            last = fall * (2 * len(hits) - 1)
            study.claims += [
                Claim("located, e_N = 1", f"energy over {len(hits)} bounces, off by",
                      float(np.max(np.abs(energy / energy[0] - 1))), "<=", 1e-9),
                Claim("located, e_N = 1", "time of the last bounce, relative, off by",
                      abs(hits[-1] / last - 1), "<=", 1e-8),
            ]  # fmt: skip


def flights(x: float, v: float, omega: float, r: float, t_end: float) -> tuple[float, float]:
    """The oscillator from t = 0 with the wall at 0, flight by flight, impacts with 30 digits."""
    with mp.workdps(30):
        w, restitution = mp.mpf(omega), mp.mpf(r)
        t, place, speed, end = mp.mpf(0), mp.mpf(x), mp.mpf(v), mp.mpf(t_end)
        gain = 1 / (1 - w**2)
        while True:
            a, b = place - gain * mp.cos(w * t), speed + gain * w * mp.sin(w * t)

            def at(time: Any, a: Any = a, b: Any = b, t: Any = t) -> tuple[Any, Any]:
                d = time - t
                return (
                    a * mp.cos(d) + b * mp.sin(d) + gain * mp.cos(w * time),
                    b * mp.cos(d) - a * mp.sin(d) - gain * w * mp.sin(w * time),
                )

            hit, low = None, t + mp.mpf(10) ** -6
            while low < end and hit is None:
                high = min(low + mp.mpf("0.01"), end)
                if at(low)[0] < 0 <= at(high)[0]:
                    hit = mp.findroot(lambda z, at=at: at(z)[0], (low, high), solver="anderson")
                low = high
            if hit is None:
                x_end, v_end = at(end)
                return float(x_end), float(v_end)
            t, place, speed = hit, mp.mpf(0), -restitution * at(hit)[1]


def _oscillator(study: Study, frequencies: int) -> None:
    made = stepper(oscillator, 4)
    omega = 2.7
    period = 2 * np.pi / omega
    traj = made.simulate(
        t_end=400 * period, dt=period / 40, every=40, parameters={"omega": omega}, events="located"
    )
    z = np.column_stack([traj.q[:, 0], traj.v[:, 0]])[-3:]
    end = flights(float(z[0, 0]), float(z[0, 1]), omega, 0.8, 2 * period)
    study.claims += [
        Claim("impact oscillator", "omega = 2.7 has period two: change over two periods",
              float(np.max(np.abs(z[2] - z[0]))), "<=", 1e-9),
        Claim("impact oscillator", "... and over one",
              float(np.max(np.abs(z[1] - z[0]))), ">=", 1e-2),
        Claim("impact oscillator", "two periods against flights in closed form, off by",
              float(np.max(np.abs(z[2] - end))), "<=", 1e-9),
    ]  # fmt: skip
    # grazing: the steady motion 1/(omega^2 - 1) cos reaches a wall that stands just inside
    reach = 1 / (omega**2 - 1)
    for factor, hits in ((1 + 1e-6, 0), (1 - 1e-6, 1)):
        traj = made.simulate(
            t_end=period, dt=period / 40, q0=[-reach], v0=[0.0],
            parameters={"omega": omega, "sigma": reach * factor}, events="located",
        )  # fmt: skip
        text = f"wall at {'1 + 1e-6' if hits == 0 else '1 - 1e-6'} of the amplitude: impacts"
        study.claims.append(near("impact oscillator", text, len(traj.events), hits, 0.0))
        if hits and traj.events:
            first = (np.pi - np.arccos(factor)) / omega
            time, name = traj.events[0].t, "time of the grazing impact"
            study.claims.append(near("impact oscillator", name, time, first, 1e-7))
    where, speeds = [], []
    for w in np.linspace(2.2, 4.0, frequencies):
        period = 2 * np.pi / w
        traj = made.simulate(
            t_end=120 * period, dt=period / 30, every=30, parameters={"omega": w}, events="located"
        )
        where += [w] * 24
        speeds += traj.v[-24:, 0].tolist()
    study.curves["bifurcation"] = {"omega": np.array(where), "v": np.array(speeds)}


STUDIES: dict[str, Callable[..., Study]] = {"located": located}
