"""The studies of Capobianco, Harsch, Leyendecker, section 6, through compiled steppers.

Each function runs one figure and returns its curves and what section 6 claims about them. Closed
forms are derived in the docstrings.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from math import pi, sqrt
from typing import Any

import numpy as np
from signorini import Stepper, Trajectory, build
from signorini.models import bouncing_ball, slider_crank, slope
from signorini.studies.claims import Claim, near

G = 9.81
Progress = Callable[[str], None]
MODELS = {"ball": bouncing_ball.model, "crank": slider_crank.model, "slope": slope.model}


@cache
def stepper(model: str, stages: int) -> Stepper:
    """One compiled stepper for each model and number of stages."""
    return build(MODELS[model](), stages=stages)


@dataclass
class Study:
    """What a study found: curves by name, claims with verdicts."""

    name: str
    curves: dict[str, Any] = field(default_factory=dict)
    claims: list[Claim] = field(default_factory=list)


def ball(stages: int, omega: float, e_N: float, t_end: float, dt: float = 1e-2) -> Trajectory:
    """Section 6.1 with its parameters; the absolute tolerance is 1e-13 where the paper has 1e-8, so
    that no penetration means none."""
    return stepper("ball", stages).simulate(
        t_end=t_end,
        dt=dt,
        v0=[0, 0, omega],
        parameters={"e_N": e_N, "mu": 0.2},
        tol=1e-13,
        r=0.5,
        scaling="none",
    )


def fig3(report: Progress = lambda text: None, stages: tuple[int, ...] = (2, 3, 4)) -> Study:
    """Bouncing ball, case 1: the gap over time, through the accumulation point.

    Flights from height 0.9 last T_0 = sqrt(2 * 0.9 / g) down and 2 T_0 e^k up and down again; they
    add up to T_0 (1 + 2 e / (1 - e)) = 3 T_0 for e = 1/2. Apexes are 0.9 e^(2k).
    """
    study = Study("fig3")
    zeno = 3 * sqrt(2 * 0.9 / G)
    for s in stages:
        report(f"fig3, s = {s}")
        traj = ball(s, 0.0, 0.5, 3.0)
        study.curves[f"s = {s}"] = {"t": traj.t, "g_N": traj["floor.g_N"]}
        name = f"6.1, case 1, s = {s}"
        study.claims += [
            Claim(
                name, "no penetration at any stage time", -traj.smallest_gap.min(), "<=", 1e-12, "m"
            ),
            Claim(
                name,
                f"at rest after the accumulation point t = {zeno:.3f}: largest gap after t = 1.5",
                traj["floor.g_N"][traj.t > 1.5].max(),
                "<=",
                1e-4,
                "m",
            ),
        ]
        flight = (traj.t > 0.43) & (traj.t < 0.43 + sqrt(2 * 0.9 / G))
        apex = float(traj["floor.g_N"][flight].max())
        study.claims.append(near(name, "first apex", apex, 0.9 / 4, 0.02, "m"))
    return study


def fig4(report: Progress = lambda text: None, stages: tuple[int, ...] = (2, 3, 4)) -> Study:
    """Bouncing ball, cases 2 and 3: percussions of contact and friction.

    With inertia 2/5 m R^2 a percussion P_F changes v_x by P_F/m and R omega by 5/2 P_F/m: rolling
    starts from R omega_0 = 0.1 omega with v_x = -2/7 R omega_0. The impact at T = sqrt(2 * 0.9 / g)
    brings -mu |v_y|; what is missing to -2/7 R omega_0 is slid away at the rate mu g. In discrete
    time the ball touches in the first step that ends after T; that step's normal percussion stops
    what gravity has given by its end: m g t_{n+1}.
    """
    study = Study("fig4")
    T = sqrt(2 * 0.9 / G)
    speed = sqrt(2 * 0.9 * G)
    for case, omega in ((2, 50.0), (3, 10.0)):
        end = np.array([-2 / 7 * 0.1 * omega, 0, 2 / 7 * omega])
        stick = T + max(0.0, (2 / 7 * 0.1 * omega - 0.2 * speed) / (0.2 * G))
        runs = {}
        for s in stages:
            report(f"fig4, case {case}, s = {s}")
            traj = runs[s] = ball(s, omega, 0.0, 2.0)
            t, P_N, P_F = traj.t, traj["floor.P_N"], traj["floor.P_F"]
            study.curves[f"case {case}, s = {s}"] = {"t": t, "P_N": P_N, "P_F": P_F}
            name = f"6.1, case {case}, s = {s}"
            dt = t[1] - t[0]
            hit = int(np.argmax(P_N > 0))
            study.claims += [
                Claim(
                    name,
                    "no penetration at any stage time",
                    -traj.smallest_gap.min(),
                    "<=",
                    1e-12,
                    "m",
                ),
                Claim(
                    name,
                    f"end velocities = ({end[0]:.4f}, 0, {end[2]:.4f}), off by",
                    float(np.abs(traj.v[-1] - end).max()),
                    "<=",
                    1e-9,
                ),
                near(
                    name,
                    "percussion of the impact, discrete closed form m g t_(n+1)",
                    P_N[hit],
                    G * t[hit],
                    1e-9,
                    "N s",
                ),
                near(name, "the same in continuous time", P_N[hit], speed, G * dt, "N s"),
                near(name, "sum of friction percussions m v_x", P_F.sum(), end[0], 1e-9, "N s"),
                Claim(
                    name,
                    "friction zero while rolling",
                    float(np.abs(P_F[t > stick + 2 * dt]).max()),
                    "<=",
                    1e-10,
                    "N s",
                ),
            ]
            if case == 2:
                slides = t[1:][np.abs(P_F[1:]) > 0.5 * 0.2 * G * dt]
                study.claims.append(
                    near(
                        name,
                        "slip-stick transition within one step of its time",
                        slides[-1],
                        stick,
                        dt,
                        "s",
                    )
                )
        apart = (
            max(float(np.abs(runs[a].q - runs[stages[0]].q).max()) for a in stages[1:])
            if len(stages) > 1
            else 0.0
        )
        study.claims.append(
            Claim(
                f"6.1, case {case}",
                "stages nearly indistinguishable: largest difference "
                f"of q relative to its largest value {np.abs(runs[stages[0]].q).max():.1f}",
                apart / float(np.abs(runs[stages[0]].q).max()),
                "<=",
                5e-3,
            )
        )
    return study


def fig6(
    report: Progress = lambda text: None,
    stages: tuple[int, ...] = (2, 3, 4),
    t_end: float = 7 * pi / 150,
) -> Study:
    """Slider-crank with clearance: gaps, angle of the slider, path of its centre."""
    study = Study("fig6")
    for s in stages:
        report(f"fig6, s = {s}")
        crank = stepper("crank", s)
        tol = 1e-8  # [m] of a gap, as the paper asks of its Newton iteration; no less is promised
        steps = int(t_end / 1e-4)
        traj = crank.simulate(t_end=steps * 1e-4, dt=1e-4, tol=tol, r=1.0, scaling="none")
        study.curves[f"s = {s}"] = {
            "t": traj.t,
            "g_N1": traj["P_1.g_N"],
            "g_N1_dot": traj["P_1.g_N_dot"],
            "g_N3": traj["P_3.g_N"],
            "g_N3_dot": traj["P_3.g_N_dot"],
            "phi_3": traj["phi_3"],
            "omega_3": traj["phi_3_dot"],
            "x_3": traj["x_3"],
            "y_3": traj["y_3"],
        }
        name = f"6.2, s = {s}"
        closed = traj.P_N > 0
        closing = closed[1:] & ~closed[:-1]
        settled = np.abs(traj["phi_3"][traj.t > 0.02])
        study.claims += [
            Claim(
                name, "no penetration at any stage time", -traj.smallest_gap.min(), "<=", tol, "m"
            ),
            Claim(
                name,
                "position constraints at the tolerance",
                float(np.abs(traj.g).max()),
                "<=",
                1e-8,
                "m",
            ),
            Claim(
                name,
                "their velocities at the tolerance",
                float(np.abs(traj.g_dot).max()),
                "<=",
                1e-8,
                "m/s",
            ),
            Claim(
                name,
                "slider stabilised: largest |phi_3| after t = 0.02",
                float(settled.max()),
                "<=",
                1e-6,
                "rad",
            ),
            Claim(
                name,
                "steps in which several corners close at once",
                float((closing.sum(axis=1) >= 2).sum()),
                ">=",
                1,
            ),
            Claim(
                name, "steps that were not solved whole", float((traj.substeps > 0).sum()), "<=", 0
            ),
        ]
        if steps == 1466:
            study.claims.append(
                near(
                    name,
                    "crank angle at the end, between other codes",
                    float(traj["phi_1"][-1]),
                    13.4345,
                    0.0035,
                    "rad",
                )
            )
    return study


def fig8(report: Progress = lambda text: None, stages: tuple[int, ...] = (3,)) -> Study:
    """Point mass on the slope, cases 1 and 2: paths and velocities."""
    study = Study("fig8")
    for case, y, around, within in ((1, 1.0, 2.1, 0.06), (2, 1.5, 2.25, 0.25)):
        for s in stages:
            report(f"fig8, case {case}, s = {s}")
            traj = stepper("slope", s).simulate(t_end=2.5, dt=1e-2, q0=[0, y])
            study.curves[f"case {case}, s = {s}"] = {"t": traj.t, "q": traj.q, "v": traj.v}
            name = f"6.3, case {case}, s = {s}"
            speed = np.linalg.norm(traj.v, axis=1)
            rest = traj.t[np.argmax((speed < 1e-9) & (traj.t > 1))]
            jumps = np.linalg.norm(np.diff(traj.v, axis=0), axis=1)
            study.claims += [
                Claim(
                    name,
                    "no penetration at any stage time",
                    -traj.smallest_gap.min(),
                    "<=",
                    1e-12,
                    "m",
                ),
                near(
                    name,
                    "comes to rest at t",
                    float(rest),
                    around,
                    within,
                    "s",
                ),
            ]
            if case == 1:
                # gravity 10 over a step, and the normal force of the curve
                study.claims.append(
                    Claim(
                        name,
                        "velocity continuous: largest change in a step",
                        float(jumps.max()),
                        "<=",
                        0.15,
                        "m/s",
                    )
                )
            else:
                k = int(np.argmax(jumps))
                study.claims += [
                    Claim(name, "velocity jumps", float(jumps[k]), ">=", 1.0, "m/s"),
                    near(name, "at t", float(traj.t[k + 1]), 0.3162, 0.02, "s"),
                ]
    return study


def error(traj: Trajectory, reference: Trajectory, what: str) -> float:
    """Discrete L1 distance (74) on the coarser grid."""
    coarse, fine = getattr(traj, what), getattr(reference, what)
    ratio = round((traj.t[1] - traj.t[0]) / (reference.t[1] - reference.t[0]))
    return float((traj.t[1] - traj.t[0]) * np.abs(coarse - fine[::ratio]).sum())


def fig9(
    report: Progress = lambda text: None,
    stages: tuple[int, ...] = (2, 3, 4, 5),
    halvings: int = 8,
    finest: float = 5e-5,
) -> Study:
    """Convergence on the slope up to t = 1.6384: errors (74) of q and v over the step size."""
    study = Study("fig9")
    sizes = 3.2e-3 * 2.0 ** np.arange(halvings)
    for case, y in ((1, 1.0), (2, 1.5)):
        report(f"fig9, case {case}, reference")
        reference = stepper("slope", max(stages)).simulate(
            t_end=1.6384, dt=finest, q0=[0, y], tol=0, every=round(3.2e-3 / finest)
        )
        for s in stages:
            errors: dict[str, list[float]] = {"q": [], "v": []}
            for dt in sizes:
                report(f"fig9, case {case}, s = {s}, dt = {dt:g}")
                traj = stepper("slope", s).simulate(t_end=1.6384, dt=dt, q0=[0, y], tol=0)
                for what in ("q", "v"):
                    errors[what].append(error(traj, reference, what))
            study.curves[f"case {case}, s = {s}"] = {"dt": sizes, **errors}
            order = slope_of(sizes, np.array(errors["q"]), 3e-12 if case == 1 else 0.0)
            name = f"6.3, convergence, case {case}, s = {s}"
            if case == 1:
                expected = 2 * s - 2
                study.claims.append(
                    near(
                        name,
                        "order of q with persistent contact 2s - 2",
                        order,
                        expected,
                        0.12 * expected,
                    )
                )
            else:
                study.claims.append(near(name, "order on average with an impact", order, 1.0, 0.4))
    return study


def slope_of(dt: np.ndarray, errors: np.ndarray, rounding: float) -> float:
    """Order by least squares over the finest points above rounding, the coarsest left out."""
    use = np.flatnonzero(errors > rounding)
    use = use[use < len(dt) - 1] if len(use) > 2 else use
    if rounding > 0:
        use = use[:3]
    return float(np.polyfit(np.log(dt[use]), np.log(errors[use]), 1)[0])


STUDIES: dict[str, Callable[..., Study]] = {
    "fig3": fig3,
    "fig4": fig4,
    "fig6": fig6,
    "fig8": fig8,
    "fig9": fig9,
}
