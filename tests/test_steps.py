"""Trajectories and Jacobians against the independent reference implementation."""

from collections.abc import Callable

import numpy as np
import pytest
import signorini as sg
from signorini.models import bouncing_ball, box, box_in_space, slider_crank, slope
from signorini.verify.reference import Reference, Step
from trap_models import TRAPS, chain

FEW_AND_MANY = [2, 3, *(pytest.param(s, marks=pytest.mark.thorough) for s in (4, 5))]
SMALL = (*TRAPS, bouncing_ball.model, slope.model, box.model)


def identify(value: object) -> str:
    module = getattr(value, "__module__", "")
    return f"{module.split('.')[-1]}.{value.__name__}" if callable(value) else str(value)


def compare(
    make: Callable[[], sg.Model],
    compiled: sg.Stepper,
    dt: float,
    n: int,
    own: int,
    active_set: str = "any_stage",
) -> list[str]:
    """What steps do not satisfy of the reference's equations; some are solved again from a cold
    start, too, and most of those must be."""
    wrong: list[str] = []
    reference = Reference(make(), compiled.stages, active_set)
    n_u = compiled.sizes["n_u"]
    u = np.random.default_rng(3).normal(size=(n, n_u))
    start = compiled.initial_state()
    traj = compiled.simulate(
        t_end=start[0] + n * dt,
        dt=dt,
        inputs=u if n_u else None,
        record="stages",
        active_set=active_set,
    )
    par = list(compiled.parameters.values())
    momenta = np.abs(compiled.evaluate("p", traj.t, traj.q, traj.v)).max() + 1e-3
    solved = 0
    for k in range(n):
        at = (traj.t[k], traj.q[k], traj.v[k], u[k], par, dt)
        step = Step(traj.V[k], traj.v[k + 1], traj._arrays["R"][k])
        for name, value in reference.residual(step, *at).items():
            if not np.max(np.abs(value), initial=0) < 1e-9 * max(momenta, 1.0):
                wrong.append(f"{name} of step {k}")
        if own and k % own == 0:
            other = reference.solve(*at)
            if other is not None:
                solved += 1
                if not np.allclose(other.v_end, step.v_end, 1e-7, 2e-8 * max(1, momenta)):
                    wrong.append(f"velocities of step {k}")
    if own and solved < 0.7 * len(range(0, n, own)):
        wrong.append(f"only {solved} steps solved again")
    return wrong


@pytest.mark.parametrize("stages", FEW_AND_MANY)
@pytest.mark.parametrize("make", SMALL, ids=identify)
def test_steps_satisfy_the_scheme(
    make: Callable[[], sg.Model], stages: int, stepper: Callable[..., sg.Stepper]
) -> None:
    slow = make().world.name == "casadi"
    assert not compare(
        make,
        stepper(make, stages, velocity_constraints="paper"),
        1e-2,
        25 if slow else 60,
        0 if slow and stages > 3 else 20,
    )


def test_the_paper_s_active_set(stepper: Callable[..., sg.Stepper]) -> None:
    assert not compare(bouncing_ball.model, stepper(bouncing_ball.model, 4), 1e-2, 60, 20, "end")


def test_slider_crank_steps(stepper: Callable[..., sg.Stepper]) -> None:
    assert not compare(slider_crank.model, stepper(slider_crank.model, 3), 1e-4, 60, 0)


def test_box_in_space_steps(stepper: Callable[..., sg.Stepper]) -> None:
    assert not compare(box_in_space.model, stepper(box_in_space.model, 2), 1e-2, 60, 0)


@pytest.mark.parametrize("stages", [2, 3, 4])
@pytest.mark.parametrize("make", (*TRAPS, slider_crank.model), ids=identify)
@pytest.mark.parametrize("problem", ["position", "velocity"])
def test_jacobians_are_derivatives_of_the_residuals(
    make: Callable[[], sg.Model], stages: int, problem: str, stepper: Callable[..., sg.Stepper]
) -> None:
    compiled = stepper(make, stages, velocity_constraints="paper")
    n, h = compiled.sizes, 0.05
    rng = np.random.default_rng(stages)
    t, q, v = compiled.initial_state()
    q, v = q + 0.05 * rng.normal(size=q.size), v + 0.3 * rng.normal(size=v.size)
    x = np.tile(v, n["n_x_total"] // n["n_q"]) + 0.2 * rng.normal(size=n["n_x_total"])
    lam = 0.3 * rng.normal(size=n["n_rows_total"])
    u = rng.normal(size=n["n_u"])
    spec = next(p for p in compiled.manifest["kinds"][0]["problems"] if p["name"] == problem)

    def at(x: np.ndarray, lam: np.ndarray) -> dict[str, np.ndarray]:
        return compiled.problem(problem, x, lam, h, t=t, q=q, v=v, u=u)

    here = at(x, lam)
    d = 1e-5
    for k in range(spec["n_x"]):
        e = np.zeros_like(x)
        e[spec["x"] + k] = d
        plus, minus = at(x + e, lam), at(x - e, lam)
        for row, matrix in (("r", "A"), ("y", "C")):
            slope = (plus[row] - minus[row]) / (2 * d)
            scale = 1 + np.max(np.abs(here[row]), initial=0)
            np.testing.assert_allclose(here[matrix][:, k], slope, atol=2e-8 * scale)
    for k in range(here["B"].shape[1]):
        e = np.zeros_like(lam)
        e[spec["R"] + k] = 1.0
        slope = at(x, lam + e)["r"] - here["r"]  # the percussions enter linearly
        np.testing.assert_allclose(here["B"][:, k], slope, atol=1e-11 * (1 + np.abs(slope).max()))


def test_a_chain_of_ten_links(stepper: Callable[..., sg.Stepper]) -> None:
    """Inertia and weight of rods in a row in closed form, energy to the order 2s - 2."""
    compiled = stepper(chain, 3)
    phi = np.linspace(-1.3, 2.1, 10)
    k = np.arange(10)
    # rod j turns with all that hang on it: (n - j - 1/2) of their masses act at its end
    behind = 10 - np.maximum.outer(k, k) - 0.5 - np.eye(10) / 6
    M = behind * np.cos(np.subtract.outer(phi, phi))
    np.testing.assert_allclose(compiled.evaluate("p_v", 0.0, phi, 0 * phi), M, atol=1e-14)
    weight = -9.81 * (10 - k - 0.5) * np.sin(phi)
    np.testing.assert_allclose(compiled.evaluate("L_q", 0.0, phi, 0 * phi), weight, atol=1e-13)
    drift = []
    for dt in (2e-2, 1e-2):
        energy = compiled.simulate(t_end=0.4, dt=dt).energy
        drift.append(np.max(np.abs(energy / energy[0] - 1)))
    assert 3.7 < np.log2(drift[0] / drift[1]) < 4.6, drift
    text = (compiled.folder / "chain_10.c").read_text()
    assert max(map(len, text.splitlines())) <= 140
