"""Derivatives where they are used: optimisation, identification, other frameworks."""

import importlib.util
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
import signorini as sg
from compilers import STRICT
from signorini.models import bouncing_ball, chaplygin_sleigh

ROOT = Path(__file__).resolve().parents[1]
Build = Callable[..., sg.Stepper]


def test_a_step_as_a_function_of_casadi(stepper: Build) -> None:
    """Its derivatives are those of a run, chained by CasADi over four calls of ten steps each."""
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    step = sg.casadi_step(made, 1e-2, steps=10)
    assert (step.name_in(1), step.name_out(0), step.size_in(3)) == ("v", "q_next", (5, 1))
    q, v, par = ca.MX.sym("q", 3), ca.MX.sym("v", 3), ca.MX.sym("par", 5)
    where, speed = q, v
    for _ in range(5):
        where, speed = step(where, speed, ca.MX(0, 1), par)
    end = ca.vertcat(where, speed)
    of = ca.vertcat(q, v, par)
    slopes = ca.Function("slopes", [q, v, par], [end, ca.jacobian(end, of)])
    start = made.initial_state()[1:]
    values = list(made.parameters.values())
    found, slope_of = (np.array(x) for x in slopes(*start, values))
    traj = made.simulate(
        t_end=0.5, dt=1e-2, events="located", derivatives="forward", of=("q0", "v0", "parameters")
    )
    np.testing.assert_allclose(found[:, 0], [*traj.q[-1], *traj.v[-1]], atol=1e-12)
    mine = np.vstack([np.hstack(list(x.values())) for x in (
        {k: c[-1] for k, c in traj.dq.items()}, {k: c[-1] for k, c in traj.dv.items()})
    ])  # fmt: skip
    np.testing.assert_allclose(slope_of, mine, atol=1e-10)


def example(name: str) -> Any:
    """A program of the folder examples, as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def test_a_bounce_shot() -> None:
    """IPOPT finds the throw whose third bounce is in a cup; heights in closed form."""
    shot = example("bounce_shot")
    found = shot.solve()
    run = found["run"]
    assert [e.kind for e in run.events if e.kind == "impact"] == ["impact"] * 2
    np.testing.assert_allclose(run.q[-1, :2], shot.CUP, atol=1e-7)
    assert run.v[-1, 1] < -0.5
    height, speed, left = 1.0 - 0.1, found["throw"][1], found["time"]
    for _ in range(2):
        fall = (speed + np.sqrt(speed**2 + 2 * 9.81 * height)) / 9.81
        height, speed, left = 0.0, -0.8 * (speed - 9.81 * fall), left - fall
    assert 0.1 + speed * left - 9.81 * left**2 / 2 == pytest.approx(shot.CUP[1], abs=1e-7)
    # less energy than an admissible throw without spin, which the floor holds back
    flat = run.stepper.simulate(
        t_end=found["time"], dt=found["time"] / 60, q0=[0, 1, 0], v0=[*found["throw"][:2], 0],
        parameters={"e_N": 0.8}, events="located",
    )  # fmt: skip
    assert abs(flat.q[-1, 0] - shot.CUP[0]) > 1e-2


@pytest.mark.parametrize("seed", [1, 2])
def test_an_identification(seed: int) -> None:
    """Restitution, friction and inertia, each within what the noise allows."""
    result = example("identification").identify(seed)
    assert np.all(np.abs(result.found - result.true) < 4 * result.deviation)
    assert np.all(result.deviation < 3e-4)
    assert result.evaluations < 15


def test_a_hopper_that_finds_its_way() -> None:
    """Two stances, to the place, height and attitude asked for, with less effort than at first."""
    hop = example("hopper_jump")
    jump = hop.solve()
    q, v = jump.run.q[-1], jump.run.v[-1]
    np.testing.assert_allclose([q[0], q[1], q[2], q[3]], [hop.WAY, hop.HEIGHT, 0, 0], atol=1e-5)
    np.testing.assert_allclose([v[1], v[2], v[3]], 0, atol=1e-4)
    assert [e.kind for e in jump.run.events if e.kind == "impact"] == ["impact"] * 2
    assert jump.run.smallest_gap.min() > -1e-9
    first = jump.first.u[:-1].reshape(hop.PIECES, hop.STEPS, 2).mean(axis=1) / [30.0, 5.0]
    assert jump.effort < 0.5 * np.sum(first**2) / hop.PIECES


@pytest.mark.thorough
def test_the_external_of_casadi(tmp_path: Path) -> None:
    """Compiled from the generated folder: values, derivatives and patterns are those of Python."""
    for model, s in ((bouncing_ball.model, 3), (chaplygin_sleigh.model, 2)):
        made = sg.build(model(), stages=s, derivatives=True)
        folder = sg.generate(model(), out_dir=tmp_path / made.name, stages=s, derivatives=True)
        library = folder / "step.so"
        sources = [str(folder / f"{made.name}{end}.c") for end in ("_casadi", "")]
        subprocess.run(
            ["cc", "-shared", "-fPIC", "-O1", *STRICT, "-o", str(library), *sources, "-lm"],
            check=True,
        )
        external = ca.external(f"{made.name}_casadi", str(library))
        step = sg.casadi_step(made)
        _, q, v = made.initial_state()
        q, v = made.project(q, v + 0.1)
        arguments = (q, v, [], list(made.parameters.values()), 0.2, 1e-2)
        for mine, other in zip(external(*arguments), step(*arguments), strict=True):
            assert np.array_equal(np.array(mine), np.array(other))
        mine, other = (f.jacobian()(*arguments, 0, 0) for f in (external, step))
        for a, b in zip(mine, other, strict=True):
            assert a.sparsity() == b.sparsity()
            assert np.array_equal(np.array(a), np.array(b))


def two_apart() -> sg.Model:
    """A ball over the floor, and far from it a spring with a load that nobody sees."""
    m = sg.Model("two_apart")
    (x, y), (v, w) = m.coordinates("x y", units="m m"), m.velocities
    k, grav = m.parameters(k=30.0, grav=9.81)
    m.lagrangian = (v**2 + w**2) / 2 - k * x**4 / 4 - grav * y
    m.contact("floor", g_N=y, e_N=0.7)
    m.initial_state(q=[1, 0.5])
    return m


def test_patterns_hold_what_there_is(stepper: Build) -> None:
    """No derivative is outside of the pattern, which has neither cyclic coordinates nor strangers.

    An impact cuts the step for all, and the other one's truncation error changes with its time.
    """
    for model, s in ((bouncing_ball.model, 3), (chaplygin_sleigh.model, 2), (two_apart, 2)):
        made = stepper(model, s, derivatives=True)
        reads = made.manifest["influence"]
        traj = made.simulate(
            t_end=1.0, dt=1e-2, events="located", derivatives="forward",
            of=("q0", "v0", "parameters"),
        )  # fmt: skip
        for name, key in (("q0", "q"), ("v0", "v"), ("parameters", "par")):
            for place, change in ((True, traj.dq[name]), (False, traj.dv[name])):
                for i, known in enumerate(reads[key]):
                    allowed = {*known, i} if place and key == "q" else set(known)
                    rest = [k for k in range(change.shape[2]) if k not in allowed]
                    assert not np.nan_to_num(change[1:, i, rest]).any()
        if model is two_apart:
            assert traj.dq["q0"][-1, 0, 1] != 0  # that is what the pattern has to know
            assert reads["q"] == [[0, 1], [1]]
        else:
            assert reads["q"] == ([[1], [1], [1]] if s == 3 else [[2], [2], [2]])


# --- frameworks that differentiate and batch by themselves ----------------------------------------


def expected_of(made: sg.Stepper) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ten steps of a ball through its impact: end, and derivatives by q, v and parameters."""
    about: dict[str, Any] = {"t_end": 0.5, "dt": 1e-2, "events": "located"}
    traj = made.simulate(**about, derivatives="forward", of=("q0", "v0", "parameters"))
    assert [e.kind for e in traj.events] == ["impact"]
    slopes = np.vstack([np.hstack([x[-1] for x in c.values()]) for c in (traj.dq, traj.dv)])
    return traj.q[-1], traj.v[-1], slopes


@pytest.mark.slow
def test_steps_in_jax(stepper: Build) -> None:
    """jit, vmap, forward and reverse mode, scan: values and derivatives of the run."""
    jax = pytest.importorskip("jax", reason="the extra signorini[jax] is not installed")
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    jax.config.update("jax_enable_x64", True)
    step = sg.jax_step(made, 1e-2, steps=10)
    q_end, v_end, slopes = expected_of(made)
    _, q, v = made.initial_state()
    par = np.array(list(made.parameters.values()))

    def run(q: Any, v: Any, par: Any) -> Any:
        def go(state: Any, _: Any) -> Any:
            return step(*state, None, par), None

        (q, v), _ = jax.lax.scan(go, (q, v), None, length=5)
        return jax.numpy.concatenate([q, v])

    found = jax.jit(run)(q, v, par)
    np.testing.assert_allclose(found, np.concatenate([q_end, v_end]), atol=1e-12)
    for mode in (jax.jacfwd, jax.jacrev):
        parts = jax.jit(mode(run, argnums=(0, 1, 2)))(q, v, par)
        np.testing.assert_allclose(np.hstack(parts), slopes, atol=1e-9)
    many = np.linspace(0.9, 1.3, 7)
    starts = np.stack([0 * many, many, 0 * many], axis=1)
    gradients = jax.vmap(jax.grad(lambda q: run(q, v, par)[0]), in_axes=0)(starts)
    ends = jax.vmap(run, in_axes=(0, None, None))(starts, v, par)
    for k, start in enumerate(starts):
        one = made.simulate(
            t_end=0.5, dt=1e-2, q0=start, events="located", derivatives="forward", of="q0"
        )
        np.testing.assert_allclose(ends[k][:3], one.q[-1], atol=1e-12)
        np.testing.assert_allclose(gradients[k], one.dq["q0"][-1, 0], atol=1e-9)
    check = pytest.importorskip("jax.test_util").check_grads
    check(lambda v: step(q, v)[0], (v,), order=1, modes=("fwd", "rev"))
    with pytest.raises(sg.RunError, match="jax_enable_x64"):
        step(np.float32(q), v)
    with pytest.raises(Exception, match="a step cannot be taken"):
        jax.block_until_ready(step(q * np.nan, v))


@pytest.mark.slow
def test_steps_in_torch(stepper: Build) -> None:
    """Batches, vmap, forward and reverse mode, gradcheck: values and derivatives of the run."""
    torch = pytest.importorskip("torch", reason="the extra signorini[torch] is not installed")
    made = stepper(bouncing_ball.model, 3, derivatives=True)
    step = sg.torch_step(made, 1e-2, steps=10)
    q_end, v_end, slopes = expected_of(made)
    _, q, v = (torch.tensor(x) for x in made.initial_state())
    par = torch.tensor(list(made.parameters.values()), dtype=torch.float64)

    def run(q: Any, v: Any, par: Any) -> Any:
        for _ in range(5):
            q, v = step(q, v, None, par)
        return torch.cat([q, v], dim=-1)

    np.testing.assert_allclose(run(q, v, par), np.concatenate([q_end, v_end]), atol=1e-12)
    for mode in (torch.func.jacfwd, torch.func.jacrev, torch.autograd.functional.jacobian):
        if mode is torch.autograd.functional.jacobian:
            parts = mode(run, (q, v, par))
        else:
            parts = mode(run, argnums=(0, 1, 2))(q, v, par)
        np.testing.assert_allclose(torch.cat(parts, dim=-1), slopes, atol=1e-9)
    many = torch.linspace(0.9, 1.3, 7, dtype=torch.float64)
    starts = torch.stack([0 * many, many, 0 * many], dim=1).requires_grad_()
    ends = run(starts, v, par)
    assert torch.equal(ends, torch.func.vmap(run, in_dims=(0, None, None))(starts, v, par))
    ends[:, 0].sum().backward()
    for k, start in enumerate(starts.detach().numpy()):
        one = made.simulate(
            t_end=0.5, dt=1e-2, q0=start, events="located", derivatives="forward", of="q0"
        )
        np.testing.assert_allclose(starts.grad[k], one.dq["q0"][-1, 0], atol=1e-9)
    assert torch.autograd.gradcheck(lambda v: step(q, v)[0], (v.clone().requires_grad_(),))
    with pytest.raises(sg.RunError, match="give a tensor of"):
        step(q.float(), v)
    with pytest.raises(sg.RunError, match="run 0: a step cannot be taken"):
        step(q * torch.nan, v)
