"""Contacts between bodies join their parts in the steps in which they may act."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import signorini as sg
from compilers import STRICT, compiler, run
from crowds import RADIUS, balls_in_a_bowl, crowd, row_of_discs
from signorini.codegen import parts
from signorini.codegen.composition import compose
from signorini.codegen.frontend.validate import freeze
from signorini.runtime.library import SUCCESS
from signorini.runtime.options import RunOptions
from signorini.runtime.replay import FailedStep, replay
from signorini.stress.crowds import discs_in_a_box
from signorini.stress.judge import judge

FREE = {"e_N": 1.0, "mu": 0.0, "grav": 0.0}


def built(stepper: Callable[..., sg.Stepper]) -> sg.Stepper:
    return stepper(row_of_discs, 2, events="located")


def placed(apart: float, count: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Discs in a row on the x-axis, `apart` from each other, the others far away; at rest."""
    q = np.zeros(18)
    q[0::3] = np.arange(6) * (2 * RADIUS + apart)
    q[1::3] = 1.0
    q[3 * count :: 3] += 10.0 * np.arange(1, 7 - count)
    return q, np.zeros(18)


def test_couplings_are_contacts_between_bodies() -> None:
    composition = compose(freeze(row_of_discs()))
    couplings = [p for p in composition.parts if p.couples]
    assert [p.name for p in composition.parts[:6]] == [f"d{k}" for k in range(6)]
    assert len(couplings) == 15 and len(composition.kinds) == 3  # discs, the last one, pairs
    assert couplings[4].name == "c1_3"
    assert couplings[4].coordinates == (3, 4, 5, 9, 10, 11)
    assert all(p.data.L.is_zero() and p.data.n_q == 6 for p in couplings)
    assert sorted(k for p in composition.parts for k in p.contacts) == list(range(16))
    assert sorted(r for p in composition.parts for r in p.rows) == list(range(32))


def test_few_bodies_and_hand_written_models_stay_one_piece() -> None:
    assert len(compose(freeze(crowd(0))).parts) == 1 < parts.LEAST_PARTS
    m = sg.Model("by_hand", symbols="casadi")
    q = m.coordinates("a b c d e")
    m.lagrangian = sum(v**2 for v in m.velocities) / 2
    for i in range(4):
        m.contact(f"c{i}", g_N=q[i + 1] - q[i])
    m.initial_state(q=list(range(5)))
    assert len(compose(freeze(m)).parts) == 1


@pytest.mark.parametrize("events", ["captured", "located"])
@pytest.mark.parametrize("apart", [1e-4, 0.03])
def test_an_impact_runs_through_a_row(
    stepper: Callable[..., sg.Stepper], events: str, apart: float
) -> None:
    """Elastic and one after the other: the last one takes all of the velocity; what is struck when
    a contact beyond is left out takes that in, too."""
    together = built(stepper)
    q, v = placed(apart, 5)
    v[0] = 2.0
    q[0] -= 0.05
    traj = together.simulate(t_end=0.2, dt=1e-3, q0=q, v0=v, events=events, parameters=FREE)
    expected = np.zeros(18)
    if events == "located" or apart > 0.01:
        expected[12] = 2.0
    else:
        # at once: each of five that touch within a step takes what makes it part as it came
        assert traj.v[-1, 12] > traj.v[-1, 0]
        expected = traj.v[-1]
    np.testing.assert_allclose(traj.v[-1], expected, atol=1e-9)
    if events == "located":
        struck = [event.contact for event in traj.events if event.kind == "impact"]
        assert struck == ["c0_1", "c1_2", "c2_3", "c3_4"]
    assert traj.smallest_gap.min() > -1e-9
    np.testing.assert_allclose(traj.v[:, 0::3].sum(axis=1), 2.0, rtol=1e-12)
    np.testing.assert_allclose(traj.energy, 2.0, rtol=1e-9)


@pytest.mark.parametrize("events", ["captured", "located"])
def test_each_contact_has_coefficients_of_its_own(
    stepper: Callable[..., sg.Stepper], events: str
) -> None:
    """The last disc is struck by the one before it: elastic, whatever its floor gives back."""
    together = built(stepper)
    q, v = placed(0.01)
    v[12] = 1.0
    traj = together.simulate(t_end=0.1, dt=1e-3, q0=q, v0=v, events=events, parameters=FREE)
    np.testing.assert_allclose(traj.v[-1, [12, 15]], [0.0, 1.0], atol=1e-9)


@pytest.mark.parametrize("events", ["captured", "located"])
def test_momentum_and_energy_of_a_crowd(stepper: Callable[..., sg.Stepper], events: str) -> None:
    """Discs thrown at a point: momentum and angular momentum stay, energy falls by friction and
    restitution alone."""
    together = built(stepper)
    rng = np.random.default_rng(4)
    q, v = np.zeros(18), np.zeros(18)
    angles = np.arange(6) * np.pi / 3 + rng.uniform(-0.2, 0.2, 6)
    q[0::3], q[1::3] = 0.4 * np.cos(angles), 3.0 + 0.4 * np.sin(angles)
    v[0::3], v[1::3], v[2::3] = -np.cos(angles), -np.sin(angles), rng.normal(size=6)
    how = {"e_N": 0.6, "mu": 0.4, "grav": 0.0}
    traj = together.simulate(t_end=0.8, dt=2e-3, q0=q, v0=v, events=events, parameters=how)
    x, y, vx, vy = traj.q[:, 0::3], traj.q[:, 1::3] - 3.0, traj.v[:, 0::3], traj.v[:, 1::3]
    spin = traj.v[:, 2::3] * (RADIUS**2 / 2)
    for value in (vx.sum(axis=1), vy.sum(axis=1)):
        np.testing.assert_allclose(value, value[0], atol=1e-12)
    if events == "located":  # else friction acts where a gap may have opened again
        turning = (x * vy - y * vx + spin).sum(axis=1)
        np.testing.assert_allclose(turning, turning[0], atol=2e-10)
    assert sum(event.kind == "impact" for event in traj.events) > 6
    # an impact of located steps, whose islands are cut at places of their own, too
    assert np.diff(traj.energy).max() < 1e-12
    assert traj.energy[-1] < 0.8 * traj.energy[0]
    assert traj.smallest_gap.min() > -1e-9
    apart = np.hypot(*(z[:, :, None] - z[:, None, :] for z in (x, y)))
    assert apart[:, ~np.eye(6, dtype=bool)].min() > 2 * RADIUS - 1e-9


@pytest.mark.parametrize("events", ["captured", "located"])
def test_what_nothing_touches_moves_bit_for_bit_as_before(
    stepper: Callable[..., sg.Stepper], events: str
) -> None:
    """The last disc bounces on the floor, whatever the others do."""
    together = built(stepper)
    how = {"e_N": 0.7, "e_floor": 0.7, "mu": 0.3, "grav": 9.81}
    q, v = placed(0.02, 5)
    q[1:15:3] += np.array([0.0, 0.25, 0.5, 0.75, 1.0]) + 50.0
    q[15:18] = 40.0, 0.4, 0.0
    v[0:15:3] = 1.0, 0.0, 0.0, 0.0, -1.0
    v[15:18] = 0.3, 0.0, 2.0
    runs = []
    for others in (v, np.concatenate([np.zeros(15), v[15:]])):
        runs.append(
            together.simulate(t_end=0.8, dt=2e-3, q0=q, v0=others, events=events, parameters=how)
        )
    first, second = (run.q[:, 15:] for run in runs)
    assert not np.array_equal(runs[0].q[:, :15], runs[1].q[:, :15])
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(runs[0].v[:, 15:], runs[1].v[:, 15:])


def step_of(
    together: sg.Stepper, q: np.ndarray, v: np.ndarray, h: float, state: Any = None, **options: Any
) -> tuple[int, Any, Any]:
    """Status, info and state of a step."""
    lib = together.library
    par = together.c_params(together.check_parameters(FREE | options.pop("parameters", {})))
    state = together.c_state(0.0, q, v) if state is None else state
    info, work = lib.structs["info"](), lib.structs["work"]()
    opt = together.c_options(RunOptions.of(options))
    status = lib.call["step"](state, work, info, par, opt, lib.pointer(lib.array(np.zeros(1))), h)
    return status, info, state


def test_islands_are_reported(stepper: Callable[..., sg.Stepper]) -> None:
    together = built(stepper)
    q, v = placed(1.0)
    _, info, state = step_of(together, q, v, 1e-3)
    assert (info.islands, info.largest, state.n_links) == (6, 1, 0)
    q[9] = q[6] + 2 * RADIUS  # 2 and 3 touch
    _, info, state = step_of(together, q, v, 1e-3)
    assert (info.islands, info.largest, state.n_links) == (5, 2, 1)
    assert state.link[0].coupling == 1 + 2 + 2  # of c2_3 among c0_1, c0_2, c1_2, c0_3, ...
    q[12] = q[9] + 2 * RADIUS
    q[3] = q[0] + 2 * RADIUS
    _, info, state = step_of(together, q, v, 1e-3)
    assert (info.islands, info.largest, state.n_links) == (3, 3, 3)
    assert [state.link[k].coupling for k in range(3)] == sorted({0, 5, 9})
    chain, _ = placed(1.0)
    for place, k in enumerate((2, 1, 3, 0)):  # joined by c1_2, c0_3 and c1_3 in turn
        chain[3 * k : 3 * k + 2] = 20.0 + 2 * RADIUS * place, 1.0
    _, info, state = step_of(together, chain, v, 1e-3)
    assert (info.islands, info.largest, state.n_links) == (3, 4, 3)
    crossed, _ = placed(1.0)
    crossed[12] = crossed[0] - 2 * RADIUS  # 4 touches 0, 2 touches 1: links by their numbers
    crossed[6] = crossed[3] + 2 * RADIUS
    _, _, state = step_of(together, crossed, v, 1e-3)
    assert [state.link[k].coupling for k in range(state.n_links)] == [2, 6]
    traj = together.simulate(t_end=5e-3, dt=1e-3, q0=q, v0=v, parameters=FREE)
    assert traj.islands.tolist() == [0] + [3] * 5 and traj.largest_island.max() == 3


def test_a_contact_that_was_left_out_is_found(stepper: Callable[..., sg.Stepper]) -> None:
    """From rest nothing comes near at the velocities of the start: what falls onto another in the
    step does so all the same."""
    together = built(stepper)
    q, v = placed(5.0)
    fall = 9.81 * 1e-2**2 / 2
    q[15:18] = 30.0, RADIUS, 0.0  # lies on the floor
    q[12:15] = 30.0, 3 * RADIUS + 0.25 * fall, 0.0  # and another above it
    how = {"grav": 9.81, "e_N": 0.0, "e_floor": 0.0}
    status, info, state = step_of(together, q, v, 1e-2, parameters=how)
    assert status <= SUCCESS and info.largest == 2 and info.islands == 5
    assert state.q[13] == pytest.approx(3 * RADIUS, abs=1e-12)
    # without weight it is left out
    status, info, state = step_of(together, q, v, 1e-2, parameters={"grav": 0.0})
    assert info.largest == 1 and info.smallest_gap == pytest.approx(0.0, abs=1e-15)


def test_what_rests_on_another_needs_no_iteration(stepper: Callable[..., sg.Stepper]) -> None:
    """Percussions of a coupling are predicted by those of the step before."""
    together = built(stepper)
    q, v = placed(5.0)
    q[15:18] = 30.0, RADIUS, 0.0
    q[12:15] = 30.0, 3 * RADIUS, 0.0
    how = {"grav": 9.81, "e_N": 0.0, "e_floor": 0.0, "mu": 0.0}
    traj = together.simulate(t_end=0.1, dt=2e-3, q0=q, v0=v, parameters=how)
    fall = traj.iterations[-10:]
    together_at_rest = traj.q[-1, 12:]
    np.testing.assert_allclose(together_at_rest, q[12:], atol=1e-12)
    assert fall.max() == 0
    np.testing.assert_allclose(traj.P_N[-1].max(), 2 * 9.81 * 2e-3, rtol=1e-10)


def test_a_state_goes_on_as_it_would_have(stepper: Callable[..., sg.Stepper]) -> None:
    """The state holds all that the next step depends on: its copy moves on bit for bit."""
    together = built(stepper)
    q, v = placed(0.01)
    v[0:18:3] = 1.0, 0.4, 0.2, -0.1, -0.3, -0.6
    how = {"parameters": {"e_N": 0.4, "mu": 0.3}}
    state = together.c_state(0.0, q, v)
    for _ in range(40):
        step_of(together, q, v, 2e-3, state, **how)
    copy = type(state).from_buffer_copy(bytes(state))
    ends = []
    for s in (state, copy):
        for _ in range(40):
            status, _info, _ = step_of(together, q, v, 2e-3, s, **how)
            assert status <= SUCCESS
        ends.append(bytes(s))
    assert ends[0] == ends[1]
    assert state.n_links > 0


def test_a_failed_step_changes_nothing(stepper: Callable[..., sg.Stepper]) -> None:
    together = built(stepper)
    q, v = placed(1e-3)
    v[15] = -300.0
    v[0] = 300.0
    state = together.c_state(0.0, q, v)
    before = bytes(state)
    status, info, _ = step_of(together, q, v, 2e-3, state, max_iterations=1, max_halvings=0)
    assert status > SUCCESS and bytes(state) == before
    assert 0 <= info.failed < 6
    with pytest.raises(sg.RunError, match="c0_1"):
        overlapping = q.copy()
        overlapping[3] = q[0] + RADIUS
        together.simulate(t_end=0.1, dt=2e-3, q0=overlapping, v0=v)


def test_a_failed_step_is_taken_again(stepper: Callable[..., sg.Stepper], tmp_path: Path) -> None:
    """From its file, with what each part and coupling went on from: it fails as it did, and with
    more iterations it ends where a run with as many does."""
    together = built(stepper)
    q, v = placed(0.02)
    v[0::3] = np.array([1.0, 0.5, 0.0, 0.0, -0.5, -1.0])
    how = {"dt": 2e-3, "q0": q, "v0": v, "parameters": FREE | {"mu": 0.3}, "max_halvings": 0}
    whole = together.simulate(t_end=0.1, **how)
    with pytest.raises(sg.StepError) as caught:
        together.simulate(t_end=0.1, max_iterations=1, **how)
    caught.value.step.save(tmp_path / "step.json")
    step = FailedStep.load(tmp_path / "step.json")
    k = len(caught.value.trajectory.t)
    assert 0 < k < len(whole.t)
    assert replay(together, step)["status"] == step.status == "NOT_CONVERGED"
    again = replay(together, replace(step, options=step.options | {"max_iterations": 200}))
    assert again["status"] in ("OK", "OK_RESCUED")
    np.testing.assert_allclose(again["q"], whole.q[k], atol=1e-12)
    np.testing.assert_allclose(again["v"], whole.v[k], atol=1e-9)


def test_room_for_couplings(tmp_path: Path) -> None:
    """Where more pairs meet than there is room for the step fails, says why, changes nothing."""
    few = sg.build(row_of_discs(), stages=2, max_couplings=2, prefix="few")
    assert few.sizes["n_joined"] == 2
    q, v = placed(1.0)
    q[0:9:3] = 0.0, 2 * RADIUS, 4 * RADIUS
    status, info, state = step_of(few, q, v, 1e-3)
    assert status <= SUCCESS and info.largest == 3
    q[9] = 6 * RADIUS
    state = few.c_state(0.0, q, v)
    before = bytes(state)
    status, info, _ = step_of(few, q, v, 1e-3, state)
    assert few.library.statuses[status] == "CROWDED" and bytes(state) == before
    with pytest.raises(sg.StepError, match="larger max_couplings"):
        few.simulate(t_end=0.01, dt=1e-3, q0=q, v0=v)
    with pytest.raises(sg.GenerationError, match="at least 1"):
        sg.generate(row_of_discs(), tmp_path / "none", max_couplings=0)


def test_public_functions_of_couplings(stepper: Callable[..., sg.Stepper]) -> None:
    """Gaps and directions of all contacts, in closed form."""
    together = built(stepper)
    rng = np.random.default_rng(2)
    q = rng.normal(size=18) * 3.0
    x = q.reshape(6, 3)
    pairs = [(j, i) for i in range(6) for j in range(i)]
    gaps = [np.hypot(*(x[i, :2] - x[j, :2])) - 2 * RADIUS for j, i in pairs]
    np.testing.assert_allclose(together.evaluate("g_N", 0.0, q), [*gaps, x[5, 1] - RADIUS])
    W = together.evaluate("W_N", 0.0, q)
    for c, (j, i) in enumerate(pairs):
        n = (x[i, :2] - x[j, :2]) / np.hypot(*(x[i, :2] - x[j, :2]))
        expected = np.zeros((6, 3))
        expected[i, :2], expected[j, :2] = n, -n
        np.testing.assert_allclose(W[:, c], expected.reshape(18), atol=1e-14)
    assert together.evaluate("energy", 0.0, q, np.ones(18), parameters=FREE) == pytest.approx(
        6 * (1 + RADIUS**2 / 4)
    )


def both(
    make: Callable[[], sg.Model], monkeypatch: pytest.MonkeyPatch, **options: Any
) -> tuple[sg.Stepper, sg.Stepper]:
    """The model with couplings, and as one piece."""
    monkeypatch.setattr(parts, "LEAST_PARTS", 2)
    joined = sg.build(make(), stages=2, prefix="joined", **options)
    assert joined.sizes["n_couplings"] > 0
    monkeypatch.setattr(parts, "LEAST_PARTS", 10**6)
    whole = sg.build(make(), stages=2, prefix="whole", **options)
    assert whole.sizes["n_couplings"] == 0
    return joined, whole


@pytest.mark.parametrize(
    ("make", "options"),
    [
        pytest.param(crowd, {}, marks=pytest.mark.thorough),
        pytest.param(crowd, {"scheme": "moreau"}, marks=pytest.mark.slow),
        pytest.param(balls_in_a_bowl, {}, marks=pytest.mark.slow),
    ],
)
def test_islands_move_as_one_piece(
    make: Callable[[], sg.Model], options: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sets of equations that do not see each other have the same solution apart: but for rounding,
    as long as that decides nothing."""
    one, other = both(make, monkeypatch, **options)
    rng = np.random.default_rng(1)
    _t, q, _ = one.initial_state()
    linked = [k for k, name in enumerate(one.manifest["coordinates"]) if "er_" in name]
    impacts = agreed = 0
    for _ in range(4):
        v = 1.5 * rng.normal(size=q.size)
        v[linked] = 0.0
        if make is balls_in_a_bowl:  # a rotation keeps the length of its quaternion
            for k in range(5):
                p, rate = q[7 * k + 3 : 7 * k + 7], v[7 * k + 3 : 7 * k + 7]
                rate -= p * (p @ rate)
        inputs = [0.1] if one.sizes["n_u"] else None
        a, b = (
            s.simulate(t_end=0.6, dt=2e-3, v0=v, inputs=inputs, max_halvings=4)
            for s in (one, other)
        )
        error = np.abs(a.q - b.q).max(axis=1)
        agreed += int(np.argmax(error > 1e-8)) if (error > 1e-8).any() else error.size
        impacts += sum(event.kind == "impact" for event in a.events)
        assert error[:60].max() < 1e-10
        np.testing.assert_allclose(a.energy, b.energy, rtol=2e-3)
    assert impacts > 50 and agreed > 0.7 * 4 * 301


@pytest.mark.parametrize(
    ("make", "options"),
    [
        pytest.param(lambda: row_of_discs(2), {}, marks=pytest.mark.thorough),
        pytest.param(lambda: row_of_discs(2), {"events": "located"}, marks=pytest.mark.slow),
        pytest.param(lambda: crowd(1), {}, marks=pytest.mark.slow),
        pytest.param(lambda: crowd(1), {"scheme": "moreau"}, marks=pytest.mark.slow),
    ],
)
def test_models_with_couplings_are_checked(
    make: Callable[[], sg.Model], options: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every function, residual and Jacobian against NumPy, which knows nothing of islands."""
    monkeypatch.setattr(parts, "LEAST_PARTS", 2)
    report = sg.check(make(), stages=[2], **options)
    assert report, str(report)


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["gcc", "clang"])
def test_no_warnings_in_models_with_couplings(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts, "LEAST_PARTS", 2)
    folder = sg.generate(crowd(2), tmp_path / "m", stages=2, events="located")
    for file in ("crowd", "crowd_model"):
        said = run(compiler(name), *STRICT, "-c", f"{file}.c", "-o", f"{file}.o", cwd=folder)
        assert not said


# --- heaps: percussions are eliminated row by row -------------------------------------------------


def packed(stepper: sg.Stepper, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Discs a little above each other in a box, nearly packed, thrown gently."""
    rng = np.random.default_rng(seed)
    _t, q, _v = stepper.initial_state()
    count = q.size // 3
    q[0::3] = 0.2 * (np.arange(count) % 4) + rng.uniform(-0.02, 0.02, count)
    q[1::3] = 0.15 + 0.29 * (np.arange(count) // 4) + rng.uniform(0, 0.005, count)
    return stepper.project(q, 0.2 * rng.normal(size=q.size))


@pytest.mark.thorough
def test_a_heap_moves_and_rests_as_one_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same model in one piece solves dense systems with a rank decision: motion and, where rows
    depend on each other, percussions of least norm are the same; the laws hold."""
    monkeypatch.setattr(parts, "LEAST_PARTS", 2)
    one = sg.build(discs_in_a_box(12), stages=3, prefix="joined")
    monkeypatch.setattr(parts, "LEAST_PARTS", 10**6)
    other = sg.build(discs_in_a_box(12), stages=3, prefix="whole")
    how = {"mu": 0.4, "e_N": 0.0}
    many = 0
    for seed in range(3):
        q, v = packed(one, seed)
        a, b = (
            s.simulate(t_end=0.5, dt=2e-3, q0=q, v0=v, parameters=how, record="stages")
            for s in (one, other)
        )
        error = np.abs(a.q - b.q).max(axis=1)
        apart = int(np.argmax(error > 1e-8)) if (error > 1e-8).any() else error.size
        assert apart > 200
        closed = np.count_nonzero(a.P_N[1:apart] > 0, axis=1)
        many += int(np.count_nonzero(closed > 12))  # four rows each
        found = judge(a, 2e-3, True)
        assert found.gap > -1e-9 and found.complementarity < 1e-8 and found.cone < 1e-8
        # where those of least norm leave a cone, a heap keeps what was found: few, and close by
        differ = np.abs(a.P_N[:apart] - b.P_N[:apart]) / np.abs(b.P_N).max()
        assert np.count_nonzero(differ > 1e-6) < 0.01 * differ.size and differ.max() < 5e-3
    assert many > 100
