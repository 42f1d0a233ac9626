"""Steps that are too large for the fastest oscillation: noticed, named, and no false alarms."""

import importlib
import re
import warnings

import mpmath as mp
import numpy as np
import pytest
import signorini as sg
from signorini.codegen.schemes.tableau import first_instability, lobatto
from signorini.locate import shipped
from signorini.runtime.stability import stable_step


def spring(stages: int) -> sg.Stepper:
    m = sg.Model("stiff")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    (k,) = m.parameters(k=1e6)
    m.lagrangian = v**2 / 2 - k * x**2 / 2
    m.initial_state(q=[1])
    return sg.build(m, stages=stages)


def half_trace(s: int, z: mp.mpf) -> mp.mpf:
    """Half the trace of a step of q'' = -z^2 q with h = 1, in 50 digits."""
    with mp.workdps(50):
        t = lobatto(s)
        A, A_hat = mp.matrix(t.a), mp.matrix(t.a_hat)
        one = mp.matrix([1] * s)
        system = mp.eye(s) + z**2 * A_hat * A
        from_q = mp.lu_solve(system, -(z**2) * A_hat * one)
        from_v = mp.lu_solve(system, one)
        b = mp.matrix(t.b)
        q_q = 1 + (b.T * from_q)[0]
        v_v = 1 - z**2 * (b.T * (A * from_v))[0]
        return (q_q + v_v) / 2


@pytest.mark.parametrize("stages", [2, 3, 4, 5, 6])
def test_where_the_scheme_begins_to_amplify(stages: int) -> None:
    """Below the phase the step's eigenvalues lie on the unit circle, just above they do not."""
    phase = mp.mpf(first_instability(stages))
    expected = {2: 2.0, 3: 2 * 2**0.5, 4: 3.1127, 5: 3.1404, 6: 3.14156}[stages]
    assert float(phase) == pytest.approx(expected, abs=1e-4)
    for share in np.linspace(0.01, 0.999, 60):
        assert abs(half_trace(stages, phase * share)) <= 1
    assert any(abs(half_trace(stages, phase * (1 + 10.0**-k))) > 1 for k in (3, 4, 5, 6))


@pytest.mark.parametrize(
    ("stages", "h_omega"), [(2, 2.1), (3, 3.0), (3, 100.0), (4, 3.13), (5, 7.0)]
)
def test_the_warning_names_a_stable_step(stages: int, h_omega: float) -> None:
    compiled, dt = spring(stages), h_omega / 1000
    with pytest.warns(UserWarning, match="too large for the stiffness") as caught:
        try:
            compiled.simulate(t_end=200 * dt, dt=dt)
        except sg.StepError as error:
            assert "With dt" in str(caught[0].message) or "dt =" in str(error)
    named = float(re.search(r"With dt = ([\d.e-]+)", str(caught[0].message))[1])  # type: ignore[index]
    assert first_instability(stages) / 1000 / 2 < named < first_instability(stages) / 1000
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        energy = compiled.simulate(t_end=1000 * named, dt=named).energy
    assert np.abs(energy / energy[0] - 1).max() < 10  # bounded, not small, next to the limit


def test_several_frequencies_constraints_and_instability() -> None:
    """Closed forms: the stiffer of two springs; not the one that a constraint locks; a pendulum
    upside down has no oscillation, but one that hangs beside it has."""
    import sympy as sp

    m = sg.Model("springs")
    x, y, z, a, b = m.coordinates("x y z a b")
    m.lagrangian = (
        sum(v**2 for v in m.velocities) / 2
        - 50 * x**2
        - 2e4 * y**2
        - 5e9 * z**2
        - 9 * sp.cos(a)
        + 4 * sp.cos(b)
    )
    m.constraint("locked", z)
    m.initial_state(q=[0] * 5)
    compiled = sg.build(m, stages=2)
    t, q, v = compiled.initial_state()
    par = compiled.parameters
    assert stable_step(compiled, t, q, v, None, par) == pytest.approx(2 / 200, rel=1e-3)

    m = sg.Model("pendulums")
    a, b = m.coordinates("a b")
    m.lagrangian = sum(v**2 for v in m.velocities) / 2 - 9 * sp.cos(a) + 4 * sp.cos(b)
    m.initial_state(q=[0, 0])
    compiled = sg.build(m, stages=2)
    state = compiled.initial_state()
    assert stable_step(compiled, *state, None, {}) == pytest.approx(2 / 2, rel=1e-3)
    alone = stable_step(compiled, 0.0, np.array([0.0, np.pi]), np.zeros(2), None, {})
    assert alone == float("inf")  # both upside down


def test_a_loaded_string_is_stiff_by_its_tension() -> None:
    """A bead on a rod of length l that pulls with F: the constraint force turns with it."""
    m = sg.Model("bead")
    x, y = m.coordinates("x y")
    m.lagrangian = sum(v**2 for v in m.velocities) / 2
    m.constraint("rod", (x**2 + y**2 - 4) / 4)
    m.initial_state(q=[0, -2])
    compiled = sg.build(m, stages=2)
    q = np.array([0.0, -2.0])
    # W = (0, -1): a force lambda = -700 pulls up with 700 N; omega^2 = F / (m l)
    h = stable_step(compiled, 0.0, q, np.zeros(2), None, {}, force=np.array([-700.0]))
    assert h == pytest.approx(2 / np.sqrt(700 / 2), rel=1e-3)
    assert stable_step(compiled, 0.0, q, np.zeros(2), None, {}) == float("inf")


@pytest.mark.parametrize("name", shipped())
def test_no_false_alarm(name: str) -> None:
    """No model of the collection is warned of at the step that it suggests."""
    model = importlib.import_module(f"signorini.models.{name}").model()
    compiled = sg.build(model, stages=3)
    dt = model.suggested.get("dt", 1e-2)
    t, q, v = compiled.initial_state()
    assert stable_step(compiled, t, q, v, None, compiled.parameters) > dt
