"""Moreau's scheme, another instance of the scheme interface, against its own formulas."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from command import signorini
from signorini.models import bouncing_ball, slider_crank, slope
from trap_models import only_constraints, rheonomic


@pytest.mark.parametrize(("e_N", "omega"), [(0.5, 0.0), (0.0, 50.0), (0.3, 10.0)])
def test_ball_step_by_step(e_N: float, omega: float) -> None:
    """The scheme of a ball is closed: normal percussion, then friction clipped to its disc."""
    mass, R, mu, h = 1.0, 0.1, 0.2, 1e-2
    J = 0.4 * mass * R**2
    q, v = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, omega])
    stepper = sg.build(bouncing_ball.model(), scheme="moreau")
    traj = stepper.simulate(t_end=2, dt=h, v0=v, parameters={"e_N": e_N, "mu": mu})
    for k in range(200):
        free = v + h * np.array([0, -9.81, 0])
        P_N = P_F = 0.0
        if q[1] + h / 2 * v[1] - R <= 0:
            P_N = max(0.0, -mass * (free[1] + e_N * v[1]))
            slip, mobility = free[0] + R * free[2], 1 / mass + R**2 / J
            P_F = float(np.clip(-slip / mobility, -mu * P_N, mu * P_N))
        new = free + np.array([P_F / mass, P_N / mass, R * P_F / J])
        q, v = q + h / 2 * (v + new), new
        assert traj.v[k + 1] == pytest.approx(v, abs=1e-9)
        assert traj["floor.P_N"][k + 1] == pytest.approx(P_N, abs=1e-10)
        assert traj["floor.P_F"][k + 1] == pytest.approx(P_F, abs=1e-10)
    assert traj.q[-1] == pytest.approx(q, abs=1e-9)


@pytest.mark.parametrize("make", [rheonomic, only_constraints, slider_crank.model])
def test_steps_satisfy_the_equations(make: object) -> None:
    """Momenta, constraints and contact laws at the middle, from the model's functions alone."""
    stepper = sg.build(make(), scheme="moreau")  # type: ignore[operator]
    n = stepper.sizes
    h = 1e-4 if stepper.name == "slider_crank" else 1e-2
    u = np.random.default_rng(0).normal(size=(60, n["n_u"]))
    traj = stepper.simulate(t_end=60 * h, dt=h, inputs=u if u.size else None)
    pushed = 0
    for k in range(60):
        t, q = traj.t[k] + h / 2, traj.q[k] + h / 2 * traj.v[k]
        before, after = ({"t": t, "q": q, "v": v} for v in (traj.v[k], traj.v[k + 1]))
        eps = 1e-6
        p_t = (
            stepper.evaluate("p", t + eps, q, traj.v[k])
            - stepper.evaluate("p", t - eps, q, traj.v[k])
        ) / (2 * eps)
        force = (
            stepper.evaluate("L_q", **before)
            + stepper.evaluate("f", **before, u=u[k])
            - stepper.evaluate("p_q", **before) @ traj.v[k]
            - p_t
        )
        P = np.concatenate([x[k + 1] for x in (traj.P_g, traj.P_gamma, traj.P_N, traj.P_F)])
        W = np.hstack(
            [
                stepper.evaluate(name, **before).reshape(n["n_q"], -1)
                for name in ("W_g", "W_gamma", "W_N", "W_F")
                if name in stepper.functions
            ]
        )
        balance = stepper.evaluate("p", **after) - stepper.evaluate("p", **before) - h * force
        assert balance - W @ P == pytest.approx(np.zeros(n["n_q"]), abs=1e-8)
        for name in ("g_dot", "gamma"):
            if name in stepper.functions:
                assert np.abs(stepper.evaluate(name, **after)).max(initial=0) < 1e-8
        if n["n_N"]:
            gap = stepper.evaluate("g_N", t=t, q=q)
            rate = stepper.evaluate("g_N_dot", **after)
            old = stepper.evaluate("g_N_dot", **before)
            e_N = {"rheonomic": 0.3, "slider_crank": 0.4}[stepper.name]
            xi = rate + e_N * old
            assert np.all(traj.P_N[k + 1][gap > 0] == 0)
            assert np.all(xi[gap <= 0] > -1e-8)
            assert np.abs(xi * traj.P_N[k + 1])[gap <= 0].max(initial=0) < 1e-8
            pushed += int((traj.P_N[k + 1] > 0).any())
    assert pushed > 0 or not n["n_N"] or stepper.name == "rheonomic"
    assert np.allclose(traj.q[1:], traj.q[:-1] + h / 2 * (traj.v[1:] + traj.v[:-1]), atol=1e-12)


def test_generated_and_compared(tmp_path: Path) -> None:
    """The command line generates it, the folder stands alone, and drift is seen for it too."""
    made = signorini(tmp_path, "generate", "slope", "--scheme", "moreau")
    assert made.returncode == 0, made.stdout + made.stderr
    stepper = sg.load(tmp_path / "slope_c")
    assert stepper.manifest["scheme"] == "moreau"
    build = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-c", "slope.c"]
    subprocess.run(build, cwd=tmp_path / "slope_c", check=True)
    same = signorini(tmp_path, "generate", "slope", "--check", "slope_c")
    assert same.returncode == 0, same.stdout + same.stderr
    mine = stepper.simulate(t_end=1, dt=1e-3)
    fine = sg.build(slope.model(), stages=4).simulate(t_end=1, dt=1e-2)
    assert mine.q[-1] == pytest.approx(fine.q[-1], abs=5e-3)
    assert mine.g_N.min() < -1e-6  # velocity level only: the point sinks in
