"""The corpus: every scene with its models, starts, step sizes and horizons. Seeds are fixed.

A start is drawn from (seed, name of the scene, number of the run) alone, so that every number of
stages sees the same starts.
"""

from functools import partial
from math import atan, cos, log10, pi, sin, sqrt

import numpy as np
from signorini.models import (
    arch,
    block_stack,
    bouncing_ball,
    box,
    box_in_space,
    coin,
    conveyor_oscillator,
    cradle,
    dominoes,
    drawer,
    falling_chain,
    four_bar,
    painleve_rod,
    pendulum_with_wall,
    prism_in_chute,
    rimless_wheel,
    rocking_block,
    slider_crank,
    slope,
    table_with_legs,
    v_groove,
    vibrating_table,
    woodpecker,
)
from signorini.stress.crowds import CROWDS
from signorini.stress.laws import LAWS, LOCKED
from signorini.stress.scene import Case, Scene
from signorini.stress.space import SPACE

SEED = 1
G = 9.81
Rng = np.random.Generator


def power(rng: Rng, low: float, high: float) -> float:
    """A number between two bounds, its logarithm uniform."""
    return float(10 ** rng.uniform(log10(low), log10(high)))


def restitution(rng: Rng) -> float:
    """Often none, sometimes elastic, else anything between."""
    return float(rng.choice([0.0, 0.0, rng.uniform(), 0.5, 1.0]))


def friction(rng: Rng, top: float = 1.5) -> float:
    """Sometimes none, else anything up to `top`."""
    return float(rng.choice([0.0, *rng.uniform(0, top, 4)]))


def is_passive(par: dict[str, float]) -> bool:
    """Whether contact laws alone cannot add energy."""
    e_N, e_F, mu = (par.get(name, 0.0) for name in ("e_N", "e_F", "mu"))
    return (e_N == 0 and e_F == 0) or mu == 0


# --- boxes in the plane ---------------------------------------------------------------------------


def box_drop(rng: Rng) -> Case:
    par = {"mu": friction(rng), "e_N": restitution(rng)}
    par["e_F"] = float(rng.choice([0.0, 0.0, 0.0, rng.uniform()]))
    q = [0, rng.uniform(0.25, 0.8), rng.uniform(-pi, pi)]
    return Case(
        float(rng.choice([1e-2, 2e-3])), q, rng.normal(size=3) * [2, 1, 6], par,
        passive=is_passive(par),
    )  # fmt: skip


def box_pressed(rng: Rng) -> Case:
    par = {"mu": friction(rng), "e_N": restitution(rng)}
    v = [rng.normal(), rng.choice([-1.0, 0.0]) * rng.uniform(), rng.choice([0.0, rng.normal()])]
    return Case(power(rng, 1e-3, 2e-2), [0, 0.1, 0], v, par, passive=is_passive(par))


def box_scales(rng: Rng) -> Case:
    par = {"mass": power(rng, 1e-6, 1e6), "mu": friction(rng), "e_N": restitution(rng)}
    phi = rng.uniform(-0.5, 0.5)
    lowest = 0.2 * abs(sin(phi)) + 0.1 * cos(phi)
    dt = power(rng, 1e-6, 1e-1)
    q = [rng.uniform(-1, 1), lowest + rng.choice([0.0, dt]), phi]
    return Case(dt, q, rng.normal(size=3) * [1, 0.5, 2], par, passive=is_passive(par))


def box_rests_elastic(rng: Rng) -> Case:
    par = {"mu": friction(rng), "e_N": float(rng.choice([0.3, 0.5, 0.8, 1.0]))}
    return Case(power(rng, 1e-3, 2e-2), [0, 0.1, 0], [rng.normal(), 0, 0], par)


def box_large_steps(rng: Rng) -> Case:
    par = {"mu": friction(rng), "e_N": restitution(rng)}
    q = [0, rng.uniform(0.25, 1.5), rng.uniform(-pi, pi)]
    return Case(
        float(rng.choice([0.05, 0.1, 0.3, 1.0])), q, rng.normal(size=3) * [1, 1, 2], par
    )  # fmt: skip


# --- wedged ---------------------------------------------------------------------------------------


def groove(rng: Rng) -> Case:
    alpha = rng.uniform(0.3, 1.3)
    par = {"alpha": alpha, "mu": friction(rng, 2.0), "e_N": restitution(rng)}
    q = [rng.uniform(-0.05, 0.05), 0.1 / cos(alpha) + rng.uniform(0.05, 0.3), rng.uniform(-pi, pi)]
    return Case(
        float(rng.choice([1e-2, 2e-3])), q, rng.normal(size=3) * [0.5, 1, 5], par,
        passive=is_passive(par),
    )  # fmt: skip


def groove_shaken(rng: Rng) -> Case:
    omega = rng.uniform(20, 100)
    par = {
        "alpha": rng.uniform(0.3, 1.2), "mu": friction(rng), "e_N": restitution(rng),
        "omega": omega, "A": rng.uniform(0.5, 5) * G / omega**2,
    }  # fmt: skip
    q = [0, 0.1 / cos(par["alpha"]) + 0.1, rng.uniform(-pi, pi)]
    return Case(2e-3, q, [0, 0, rng.normal()], par, t=rng.uniform(0, 2 * pi / omega))


def wedge_locked(rng: Rng) -> Case:
    # Flat on both walls of a right angle, mu around the angle of self-locking. With e_N > 0 = e_F
    # Newton's impact law contradicts itself here: a locked wedge cannot rebound without slip.
    e = restitution(rng)
    par = {"alpha": pi / 4, "mu": rng.uniform(0.8, 2.5), "e_N": e, "e_F": e}
    v = rng.normal(size=3) * [1, 1, 5] * rng.choice([0.0, 0.1, 1.0])
    return Case(
        float(rng.choice([1e-2, 1e-3])), [0, 0.1, 0], v, par, passive=is_passive(par)
    )  # fmt: skip


def chute(rng: Rng) -> Case:
    # In space nothing is proven: laws of impact that contradict themselves are not drawn.
    alpha, e = rng.uniform(0.3, 1.3), restitution(rng)
    par = {
        "alpha": alpha, "beta": float(rng.choice([0.0, rng.uniform(0, 1)])),
        "mu": friction(rng, 2.0), "e_N": e, "e_F": e,
    }  # fmt: skip
    height = 0.1 / cos(alpha) + rng.uniform(0.05, 0.3)
    q = [rng.uniform(-0.05, 0.05), height, 0, rng.uniform(-pi, pi)]
    v = rng.normal(size=4) * [0.5, 1, 1, 5]
    return Case(float(rng.choice([1e-2, 2e-3])), q, v, par)


def chute_locked(rng: Rng) -> Case:
    e = restitution(rng)
    par = {
        "alpha": pi / 4, "beta": float(rng.choice([0.0, rng.uniform(0, 1)])),
        "mu": rng.uniform(0.8, 2.5), "e_N": e, "e_F": e,
    }  # fmt: skip
    v = rng.normal(size=4) * [1, 1, 1, 5] * rng.choice([0.0, 0.1, 1.0])
    return Case(float(rng.choice([1e-2, 1e-3])), [0, 0.1, 0, 0], v, par)


def jamming(rng: Rng) -> Case:
    par = {
        "mu": rng.uniform(0.1, 1.5), "e": rng.uniform(0, 0.5), "e_N": restitution(rng),
        "play": power(rng, 1e-6, 1e-2), "F": power(rng, 0.1, 1e3),
    }  # fmt: skip
    return Case(power(rng, 1e-4, 5e-3), None, [rng.normal(), 0, 0], par)


# --- stacks ---------------------------------------------------------------------------------------


def stack(rng: Rng) -> Case:
    par = {
        "mu": rng.uniform(0.1, 1.2), "e_N": float(rng.choice([0.0, 0.0, rng.uniform()])),
        "share": rng.uniform(0, 1.3),
    }  # fmt: skip
    v = rng.normal(size=9) * rng.choice([0.0, 0.01, 0.3])
    return Case(5e-3, None, v, par, passive=is_passive(par))


def stack_graded(rng: Rng) -> Case:
    par = {
        "grading": power(rng, 1e-3, 1e3), "mu": rng.uniform(0, 1), "share": rng.uniform(0, 0.9),
        "mass": power(rng, 1e-3, 1e3),
    }  # fmt: skip
    v = rng.normal(size=9) * rng.choice([0.0, 0.1])
    return Case(5e-3, None, v, par, passive=True)


def stack_falls(rng: Rng) -> Case:
    # blocks apart, all closing in the same step
    par = {"mu": friction(rng), "e_N": restitution(rng), "share": rng.uniform(0, 0.5)}
    drop = 2.0 ** rng.integers(-8, -2)
    q = {f"b{k}_y": 0.05 + 0.1 * k + drop * (k + 1) for k in range(3)}
    return Case(5e-3, q, None, par, passive=is_passive(par))


def vault(rng: Rng) -> Case:
    par = {"thick": rng.uniform(0.08, 0.2), "mu": rng.uniform(0.2, 1.0)}
    v = rng.normal(size=15) * rng.choice([0.0, 0.02])
    return Case(5e-3, None, v, par, passive=True)


# --- impacts in rows ------------------------------------------------------------------------------


def cradle_touching(rng: Rng) -> Case:
    par = {"e_N": restitution(rng), "apart": 0.0}
    q = {"x_1": 0.01 + 1e-3 * rng.uniform()}
    return Case(1e-3, q, {"x_1": rng.uniform(0.5, 5)}, par, passive=True)


def cradle_apart(rng: Rng) -> Case:
    par = {"e_N": restitution(rng), "apart": power(rng, 1e-9, 1e-2)}
    return Case(1e-3, {"x_1": 0.01 + 1e-3 * rng.uniform()}, None, par, passive=True)


def domino_row(rng: Rng) -> Case:
    par = {
        "lean": rng.uniform(0.05, 0.5), "apart": rng.uniform(0.005, 0.03), "mu": friction(rng, 1),
        "e_N": float(rng.choice([0.0, 0.0, rng.uniform(0, 0.6)])),
    }  # fmt: skip
    return Case(1e-3, None, {"d0_phi": -rng.uniform(0, 3)}, par)


def chain(rng: Rng) -> Case:
    par = {
        "x": float(rng.choice([0.0, rng.uniform(-0.5, 0.5)])), "mu": friction(rng, 1),
        "e_N": float(rng.choice([0.0, 0.0, rng.uniform()])),
    }  # fmt: skip
    return Case(float(rng.choice([1e-3, 5e-3])), None, None, par, passive=is_passive(par))


# --- rods, wheels, mechanisms ---------------------------------------------------------------------


def painleve(rng: Rng) -> Case:
    theta = rng.uniform(0.3, 1.4)
    critical = (1 + 3 * cos(theta) ** 2) / (3 * sin(theta) * cos(theta))
    par = {"mu": critical * rng.choice([rng.uniform(0.5, 2), 1 + power(rng, 1e-9, 1e-1)])}
    v = [-rng.uniform(0, 3), 0, rng.choice([0.0, rng.normal()])]
    v[1] = 0.5 * cos(theta) * v[2]
    return Case(
        float(rng.choice([1e-3, 1e-2])), [0, 0.5 * sin(theta), theta], v, par, passive=True
    )  # fmt: skip


def rocking(rng: Rng) -> Case:
    par = {"width": rng.uniform(0.1, 0.6), "mu": rng.uniform(0.2, 1.5), "e_N": restitution(rng)}
    corner = atan(par["width"] / 1.0)
    lean = -rng.uniform(0, 1.1) * corner
    w, h = par["width"] / 2, 0.5
    q = [w - (w * cos(lean) + h * sin(lean)), -(w * sin(lean) - h * cos(lean)), lean]
    return Case(2e-3, q, None, par, passive=is_passive(par))


def wheel(rng: Rng) -> Case:
    par = {"slope": rng.uniform(0, 0.4), "mu": rng.uniform(0.3, 1.5)}
    return Case(2e-3, None, None, par, passive=True)


def pendulum(rng: Rng) -> Case:
    par = {"wall": rng.uniform(-0.3, 0.5), "mu": friction(rng), "e_N": restitution(rng)}
    q = rng.uniform(0.6, 1.5) + rng.normal(size=3) * 0.3
    if par["wall"] < 0:
        q = pi / 2 + rng.uniform(-0.2, 0.5, size=3)
    return Case(float(rng.choice([1e-3, 5e-3])), q, None, par, passive=is_passive(par))


def pecking(rng: Rng) -> Case:
    par = {"mu": rng.uniform(0.1, 0.6), "e_N": rng.uniform(0, 0.8)}
    return Case(float(rng.choice([1e-4, 5e-4])), None, {"y": -rng.uniform(0, 0.5)}, par)


def crank(rng: Rng) -> Case:
    par = {"mu": rng.uniform(0, 0.3), "e_N": rng.uniform(0, 0.9), "d": rng.uniform(0.0515, 0.056)}
    scale = rng.uniform(0.3, 1.5)
    v = np.array([0, 11.475, 150, 0, 11.475, -75, 0, 0, 0]) * scale
    return Case(float(rng.choice([1e-4, 3e-4])), None, v, par)


def linkage(rng: Rng) -> Case:
    par = {"phi": rng.uniform(0, 1.5), "m_c": power(rng, 1e-2, 1e2), "m_k": power(rng, 1e-2, 1e2)}
    return Case(5e-3, None, None, par, passive=True)


# --- bodies in space ------------------------------------------------------------------------------


def quaternion(rng: Rng) -> np.ndarray:
    p = rng.normal(size=4)
    return p / np.linalg.norm(p)


def box_tumbles(rng: Rng) -> Case:
    par = {"mu": friction(rng), "e_N": float(rng.choice([0.0, rng.uniform()]))}
    q = [0, 0, rng.uniform(0.3, 0.6), *quaternion(rng)]
    return Case(1e-2, q, rng.normal(size=7) * 2, par, passive=is_passive(par))


def box_slides(rng: Rng) -> Case:
    par = {"mu": friction(rng), "e_N": restitution(rng)}
    v = [rng.normal() * 2, rng.normal() * 2, -rng.choice([0.0, 1.0]), 0, 0, 0, rng.normal() * 3]
    return Case(1e-2, [0, 0, 0.1, 1, 0, 0, 0], v, par, passive=is_passive(par))


def table(rng: Rng) -> Case:
    par = {
        "mu": friction(rng), "e_N": restitution(rng), "aside": float(rng.choice([0.0, 0.2, 0.6])),
    }  # fmt: skip
    tilt = rng.choice([0.0, rng.uniform(0, 0.3)])
    axis = rng.uniform(0, 2 * pi)
    p = [cos(tilt / 2), sin(tilt / 2) * cos(axis), sin(tilt / 2) * sin(axis), 0]
    lift = 1.2 * sin(tilt) + rng.choice([0.0, 0.1])
    v = rng.normal(size=7) * [1, 1, 1, 0.3, 0.3, 0.3, 0.3] * rng.choice([0.0, 1.0])
    return Case(5e-3, [0, 0, 0.7 + lift, *p], v, par, passive=is_passive(par))


def coin_settles(rng: Rng) -> Case:
    par = {
        "mu": rng.uniform(0, 1), "e_N": float(rng.choice([0.0, rng.uniform()])),
        "M_roll": float(rng.choice([0.0, 4e-5])), "M_bore": float(rng.choice([0.0, 4e-5])),
    }  # fmt: skip
    q = {"z": 0.012 + rng.choice([0.0, 0.01])}
    return Case(1e-3, q, rng.normal(size=7) * [0.5, 0.5, 0, 10, 10, 10, 10], par)


# --- ties, grazing, moving obstacles --------------------------------------------------------------


def ties(rng: Rng) -> Case:
    # flights of the ball last a whole number of steps
    dt = 0.01
    n = int(rng.integers(4, 60))
    start = G * (n * dt) ** 2 / 2
    e_N = float(rng.choice([0.5, 0.25, 1.0, 0.0]))
    return Case(dt, [0, 0.1 + start, 0], [0, 0, rng.normal() * 20], {"e_N": e_N})


def grazing(rng: Rng) -> Case:
    # the apex of an upward throw against the ceiling of the step: gap and speed vanish together
    par = {"mu": friction(rng), "e_N": restitution(rng), "grav": rng.choice([-1, 1]) * G}
    gap = power(rng, 1e-14, 1e-4)
    speed = sqrt(2 * G * gap) * (1 + rng.choice([0.0, 1e-12, 1e-6, -1e-12, -1e-6]))
    return Case(
        float(rng.choice([1e-3, 1e-2])), [0, 0.1 + gap, 0], [1, -speed, rng.normal()], par
    )  # fmt: skip


def vibrating(rng: Rng) -> Case:
    omega = rng.uniform(20, 200)
    par = {"Gamma": rng.uniform(0.3, 6), "omega": omega, "e_N": restitution(rng)}
    period = 2 * pi / omega
    t = rng.uniform(0, period)
    lift = par["Gamma"] * G / omega**2
    return Case(period / rng.uniform(10, 100), [lift * 1.01], [0], par, t=t)


def belt(rng: Rng) -> Case:
    par = {"F_s": power(rng, 0.01, 10), "v_belt": rng.uniform(-1, 1), "delta": rng.uniform(0, 3)}
    return Case(float(rng.choice([1e-2, 5e-2])), None, rng.normal(size=1), par)


def hill(rng: Rng) -> Case:
    # fast on a convex slope: lifts off, lands again
    par = {"mu": friction(rng)}
    x = rng.uniform(0, 0.5)
    t_x, t_y = 1 / sqrt(1 + np.exp(-2 * x)), -np.exp(-x) / sqrt(1 + np.exp(-2 * x))
    speed = rng.uniform(0, 8)
    return Case(
        float(rng.choice([1e-3, 1e-2])),
        [x, np.exp(-x)], [speed * t_x, speed * t_y], par, passive=True,
    )  # fmt: skip


CORPUS = (
    Scene("box_drop", "box on its corners, any e_N, e_F, mu", box.model, box_drop, 200, 3),
    Scene("box_pressed", "closed at the start, moving inwards", box.model, box_pressed, 120, 3),
    Scene("box_scales", "masses 1e-6 ... 1e6, dt 1e-6 ... 1e-1", box.model, box_scales, 120, 3),
    Scene("box_rests_elastic", "rests, e_N > 0", box.model, box_rests_elastic, 120),
    Scene("box_large_steps", "dt up to 1 s", box.model, box_large_steps, 60, 2),
    Scene("groove", "box falls into a groove", v_groove.model, groove, 250, 3),
    Scene(
        "groove_triangle", "triangle falls into a groove", partial(v_groove.model, 3), groove, 250
    ),
    Scene("groove_shaken", "box in a vibrating groove", v_groove.model, groove_shaken, 300, 2),
    Scene("wedge_locked", "about self-locking", v_groove.model, wedge_locked, 100, 3),
    Scene("jamming", "drawer slides or jams", drawer.model, jamming, 200, 3),
    Scene("stack", "stack stands or topples", block_stack.model, stack, 150),
    Scene("stack_graded", "mass ratios to 1e6 in contact", block_stack.model, stack_graded, 100),
    Scene("stack_falls", "blocks close at the same time", block_stack.model, stack_falls, 120),
    Scene("arch", "arch stands or falls", arch.model, vault, 120),
    Scene("cradle_touching", "impacts all at once", cradle.model, cradle_touching, 60, 4),
    Scene("cradle_apart", "impacts one after the other", cradle.model, cradle_apart, 60, 4),
    Scene("dominoes", "row of dominoes", dominoes.model, domino_row, 400),
    Scene("chain", "chain of beads on strings falls", falling_chain.model, chain, 400),
    Scene("painleve", "rod near its critical angle", painleve_rod.model, painleve, 150, 3),
    Scene("rocking", "block rocks", rocking_block.model, rocking, 400, 2),
    Scene("wheel", "rimless wheel walks", rimless_wheel.model, wheel, 400),
    Scene("pendulum", "chain of rods against a wall", pendulum_with_wall.model, pendulum, 300),
    Scene("woodpecker", "sleeve jams on its pole", woodpecker.model, pecking, 600, 2),
    Scene("slider_crank", "slider between two walls", slider_crank.model, crank, 400),
    Scene("four_bar", "redundant bilateral constraints", four_bar.model, linkage, 60, 0.2),
    Scene("box_tumbles", "box in space falls", box_in_space.model, box_tumbles, 120),
    Scene("box_slides", "box in space on four corners", box_in_space.model, box_slides, 80),
    Scene("table", "five legs, tilted or flat", table_with_legs.model, table, 150),
    Scene("coin", "disc rolls, falls, settles", coin.model, coin_settles, 400),
    Scene("ties", "flights of whole steps", bouncing_ball.model, ties, 200, 4),
    Scene("grazing", "gap and speed vanish together", bouncing_ball.model, grazing, 60, 4),
    Scene("vibrating", "table throws and catches", vibrating_table.model, vibrating, 300, 3),
    Scene("belt", "stick and slip on a belt", conveyor_oscillator.model, belt, 400, 2),
    Scene("hill", "lifts off a slope and lands", slope.model, hill, 200, 3),
    *LAWS,
)  # fmt: skip
# Wedged in space, where failed steps cannot be examined, or under load. They run only when named.
BEYOND = (
    Scene("chute", "prism falls into a chute", prism_in_chute.model, chute, 150, 2),
    Scene("chute_locked", "about self-locking", prism_in_chute.model, chute_locked, 60, 2),
    *LOCKED,
    *CROWDS,
    *SPACE,
)
SCENES = {scene.name: scene for scene in (*CORPUS, *BEYOND)}
