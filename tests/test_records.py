"""What is kept of a run: contact states, events, forces, files, and the simulator."""

import csv
import json
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from signorini.models import bouncing_ball, box, slider_crank
from signorini.runtime.options import RunOptions

Build = Callable[..., sg.Stepper]


def brake() -> sg.Model:
    m = sg.Model("brake")
    m.coordinates("x")
    (v,) = m.velocities
    (rise,) = m.parameters(rise=0.0)
    m.lagrangian = v**2 / 2
    m.friction("brake", gamma_F=v, bound=(1 + rise * m.time) / 2)
    m.initial_state(q=[0], v=[1])
    return m


def pusher() -> sg.Model:
    """A block that an input pushes to and fro."""
    m = sg.Model("pusher")
    _x, y = m.coordinates("x y")
    u, w = m.velocities
    (F,) = m.inputs("F")
    m.lagrangian = (u**2 + w**2) / 2 - 10 * y
    m.force([F, 0])
    m.contact("floor", g_N=y, gamma_F=u, mu=0.3)
    m.initial_state(q=[0, 0])
    return m


@pytest.mark.parametrize("rise", [0.0, 1.0, -0.5])
@pytest.mark.parametrize("every", [1, 10])
def test_a_brake_slides_until_it_sticks(every: int, rise: float, stepper: Build) -> None:
    """Constant, rising and falling bounds: v = 1 - t/2 - rise t^2/4 is zero at the one event."""
    traj = stepper(brake, 2).simulate(t_end=4, dt=1e-2, every=every, parameters={"rise": rise})
    stop = 2.0 if rise == 0 else (-1 + np.sqrt(1 + 4 * rise)) / rise if rise > 0 else np.inf
    moving = (traj.t > 0) & (traj.t < stop - 0.011)
    assert set(traj["brake.state"][moving]) == {"slip"}
    assert set(traj["brake.state"][traj.t > stop + 0.011]) <= {"stick"}
    kinds = [(e.kind, e.contact) for e in traj.events]
    assert kinds == ([("stick", "brake")] if stop < 4 else [])
    for event in traj.events:
        assert event.t == pytest.approx(stop, abs=0.011)
        assert event.energy == 0


def test_slip_without_friction_is_slip(stepper: Build) -> None:
    traj = stepper(bouncing_ball.model, 2).simulate(
        t_end=0.2, dt=1e-2, q0={"y": 0.1}, v0=[3, 0, 0], parameters={"mu": 0.0}
    )
    assert set(traj["floor.state"][1:]) == {"slip"}
    assert traj["floor.state"][0] == "unknown"


def test_events_of_a_bouncing_ball(stepper: Build) -> None:
    """Closed forms: impacts at sqrt(2 h/g) and after, each with m (1 + e) v; e^2 of T is left."""
    compiled = stepper(bouncing_ball.model, 3)
    dt, e = 1e-4, 0.8
    traj = compiled.simulate(t_end=1.5, dt=dt, parameters={"e_N": e}, v0=[0, 0, 0], every=50)
    first = np.sqrt(2 * 0.9 / 9.81)
    times = first + np.concatenate([[0], np.cumsum(2 * first * e ** np.arange(1, 3))])
    impacts = [x for x in traj.events if x.kind == "impact"]
    assert [x.t for x in impacts] == pytest.approx(times[times < 1.5], abs=3 * dt)
    speed = 9.81 * first
    for k, event in enumerate(impacts):
        assert pytest.approx((1 + e) * speed * e**k, rel=2e-3) == event.P_N
        assert event.energy == pytest.approx((e**2 - 1) * (speed * e**k) ** 2 / 2, rel=4e-3)
    assert [x.kind for x in traj.events][:4] == ["impact", "open", "impact", "open"]
    assert traj.impacts.sum() == len(impacts)


def test_stick_slip_and_reversal(stepper: Build) -> None:
    """The input drives the block forward, lets it stop, and turns it round at full force."""
    compiled = stepper(pusher, 2)
    force = np.concatenate([np.full(30, 2.0), np.full(30, 8.0), np.full(15, -20.0), np.zeros(125)])
    traj = compiled.simulate(t_end=2, dt=1e-2, inputs=force)
    kinds = [(event.kind, round(event.t, 2)) for event in traj.events]
    # sticks at 2 N < mu m g = 3 N; v = 5 * 0.3 when it turns: 23 m/s^2 for 0.0652 s
    assert kinds[0] == ("slip", 0.31)
    assert kinds[1] == ("reverse", 0.67)
    assert kinds[-1][0] == "stick"
    assert [k for k, _ in kinds] == ["slip", "reverse", "stick"]
    assert traj["floor.force_F"][20] == pytest.approx(-2, abs=1e-12)
    assert traj["floor.force_F"][45] == pytest.approx(-3, abs=1e-12)


def test_a_body_at_rest_has_no_impacts(stepper: Build) -> None:
    traj = stepper(box.model, 2).simulate(t_end=0.5, dt=1e-2, q0=[0, 0.1, 0], v0=[0, 0, 0])
    assert traj.impacts.sum() == 0
    assert not [event for event in traj.events if event.kind == "impact"]


def test_forces_and_keys(stepper: Build) -> None:
    compiled = stepper(slider_crank.model, 2)
    traj = compiled.simulate(t_end=0.01, dt=1e-4, every=7)
    span = np.diff(traj.t)[:, None]
    joint = compiled.manifest["g_blocks"][0][0]
    assert traj[f"{joint}.force"][1:] == pytest.approx(traj[f"{joint}.P_g"][1:] / span, rel=1e-15)
    names = traj.keys()
    for name in names:
        assert len(traj[name]) == len(traj)
    with pytest.raises(KeyError, match=f"no column 'nothing'; there are: .*{joint}.force"):
        traj["nothing"]


def test_a_model_without_gaps_has_no_smallest_gap(stepper: Build) -> None:
    traj = stepper(brake, 2).simulate(t_end=0.1, dt=1e-2)
    assert np.all(np.isinf(traj.smallest_gap))


def test_files_hold_what_they_mean(tmp_path: Path, stepper: Build) -> None:
    compiled = stepper(bouncing_ball.model, 3)
    traj = compiled.simulate(t_end=1.1, dt=1e-2, every=3)
    again = sg.Trajectory.load(traj.save(tmp_path / "run.npz"), compiled)
    assert again.events == traj.events
    assert np.array_equal(again["floor.state"], traj["floor.state"])
    assert np.array_equal(again.energy_range, traj.energy_range)
    with np.load(tmp_path / "run.npz") as data:
        about = json.loads(str(data["about"]))
        assert np.array_equal(data["energy"], traj.energy)
        assert np.array_equal(data["g_N"], traj.g_N)
    assert about["format"] == 3
    assert about["columns"]["q"] == ["x", "y", "phi"]
    assert about["columns"]["P"] == ["floor.P_N", "floor.P_F"]
    assert about["units"]["mass"] == "kg"
    with traj.save(tmp_path / "run.csv").open(encoding="utf-8", newline="") as stream:
        head, *rows = csv.reader(stream)
    assert head[:4] == ["t", "x", "y", "phi"]
    assert len(rows) == len(traj)
    assert [float(r[head.index("y")]) for r in rows] == traj["y"].tolist()
    assert [r[head.index("floor.state")] for r in rows] == traj["floor.state"].tolist()
    with pytest.raises(sg.RunError, match=r"'.xyz' stands for no format; use .npz, .csv"):
        traj.save(tmp_path / "run.xyz")


def test_files_of_the_first_format_are_read(tmp_path: Path, stepper: Build) -> None:
    """As written before contact states and impacts were kept."""
    compiled = stepper(bouncing_ball.model, 3)
    traj = compiled.simulate(t_end=0.5, dt=1e-2)
    names = ("t", "q", "v", "u", "P", "residual", "smallest_gap")
    arrays = {name: traj._arrays[name] for name in names}
    about = {
        "format": 1,
        "model": traj.model,
        "model_hash": compiled.manifest["model_hash"],
        "stages": 3,
        "parameters": traj.parameters,
        "options": {},
        "seconds": 1.0,
    }
    counts = traj._arrays["counts"][:, :6]
    np.savez(tmp_path / "old.npz", about=np.array(json.dumps(about)), counts=counts, **arrays)
    old = sg.Trajectory.load(tmp_path / "old.npz", compiled)
    assert np.array_equal(old.q, traj.q)
    assert set(old["floor.state"]) == {"unknown"}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("contact", np.full((12, 1), 9)),
        ("contact", np.zeros((12, 1))),
        ("q", np.full((12, 3), "x")),
        ("counts", np.zeros((12, 3), int)),
    ],
)
def test_damaged_files_are_one_message(
    name: str, value: np.ndarray, tmp_path: Path, stepper: Build
) -> None:
    compiled = stepper(bouncing_ball.model, 3)
    traj = compiled.simulate(t_end=0.11, dt=1e-2)
    traj.save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as data:
        arrays = {key: data[key] for key in data.files} | {name: value}
    np.savez(tmp_path / "bad.npz", **arrays)
    with pytest.raises(sg.RunError, match="damaged"):
        sg.Trajectory.load(tmp_path / "bad.npz", compiled)


def test_the_simulator_is_the_run(stepper: Build) -> None:
    """Step by step, copied, pickled, with feedback: the same bits as a run with a controller."""
    compiled = stepper(pusher, 2)

    def control(t: float, q: np.ndarray, v: np.ndarray) -> list[float]:
        return [20 * np.sin(9 * t) - v[0]]

    run = compiled.simulate(t_end=1, dt=1e-2, inputs=control)
    sim = compiled.start(dt=1e-2)
    for k in range(100):
        if k == 40:
            sim = sim.copy()
        if k == 60:
            sim = pickle.loads(pickle.dumps(sim))
        sim.step(control(sim.t, sim.q, sim.v))
        assert np.array_equal(sim.q, run.q[k + 1])
        assert np.array_equal(sim.v, run.v[k + 1])
        assert np.array_equal(sim.P_F, run.P_F[k + 1])
        assert sim.state("floor") == run["floor.state"][k + 1]
    assert sim.t == run.t[-1]
    assert sim.energy == pytest.approx(run.energy[-1], rel=1e-15)
    assert sim.info["iterations"] == run.iterations[-1]
    sim.reset(q0={"x": 1.0})
    assert (sim.t, sim.steps) == (0, 0)
    assert sim.q.tolist() == [1, 0]


def test_a_simulator_records_and_fails_as_a_run(stepper: Build) -> None:
    compiled = stepper(bouncing_ball.model, 3)
    run = compiled.simulate(t_end=1, dt=1e-2)
    sim = compiled.start(dt=1e-2, record=True)
    sim.step(n=30)
    fork = sim.copy()
    sim.step(n=70)
    traj = sim.trajectory()
    assert np.array_equal(traj.q, run.q)
    assert np.array_equal(traj.iterations, run.iterations)
    assert traj.events == run.events
    assert len(fork.trajectory()) == 31
    assert pytest.approx(run.P_N[31:].sum(axis=0), rel=1e-14) == sim.P_N
    with pytest.raises(sg.RunError, match="nothing is recorded"):
        compiled.start(dt=1e-2).trajectory()
    with pytest.raises(sg.RunError, match="no inputs"):
        sim.step([1.0])
    with pytest.raises(sg.RunError, match="no contact 'wall'; it has: floor"):
        sim.state("wall")
    with pytest.raises(sg.RunError, match="dt = 0"):
        compiled.start(dt=0)
    before = sim.q
    sim._state.v[1] = float("nan")
    with pytest.raises(sg.StepError) as caught:
        sim.step(n=2)
    assert caught.value.status == "NONFINITE"
    assert np.array_equal(sim.q, before)
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)
    assert np.array_equal(again.trajectory.q, caught.value.trajectory.q)


def test_a_controller_that_fails_keeps_the_run(stepper: Build) -> None:
    def control(t: float, q: np.ndarray, v: np.ndarray) -> list[float]:
        return [1 / 0] if t > 0.5 else [5.0]

    with pytest.raises(ZeroDivisionError) as caught:
        stepper(pusher, 2).simulate(t_end=1, dt=1e-2, inputs=control)
    assert caught.value.trajectory.t[-1] == pytest.approx(0.51)  # type: ignore[attr-defined]


def test_batches_know_states_events_and_energies(stepper: Build) -> None:
    """A run of a batch is the run alone, thinned and whole; it survives a process pool."""
    compiled = stepper(bouncing_ball.model, 3)
    batch = compiled.simulate_batch(
        t_end=1.1, dt=1e-2, every=4, parameters={"e_N": [0.0, 0.5, 0.9]}, threads=2
    )
    batch = pickle.loads(pickle.dumps(batch))
    for k, e in enumerate((0.0, 0.5, 0.9)):
        alone = compiled.simulate(t_end=1.1, dt=1e-2, every=4, parameters={"e_N": e})
        mine = pickle.loads(pickle.dumps(batch.trajectory(k)))
        assert np.array_equal(mine["floor.state"], alone["floor.state"])
        assert np.array_equal(mine.energy_range, alone.energy_range)
        assert np.array_equal(mine.P_N, alone.P_N)
        assert mine.events == alone.events
        assert mine.t[-1] == alone.t[-1] == 1.1


def test_memory_is_estimated_before_a_run(stepper: Build, monkeypatch: pytest.MonkeyPatch) -> None:
    from signorini.runtime import memory

    monkeypatch.setattr(memory, "free_memory", lambda: 1_000_000)
    compiled = stepper(bouncing_ball.model, 3)
    with pytest.raises(sg.RunError, match=r"[\d.]+ MB.*every=(\d+)") as caught:
        compiled.simulate(t_end=2000, dt=1e-2)
    fits = int(str(caught.value).split("every=")[1].split(",")[0])
    assert len(compiled.simulate(t_end=1, dt=1e-2, every=fits)) == -(-100 // fits) + 1
    with pytest.raises(sg.RunError, match="would record"):
        compiled.simulate_batch(t_end=20, dt=1e-2, parameters={"e_N": np.linspace(0, 1, 100)})


def test_a_time_and_a_place_that_the_caller_sets_count(stepper: Build) -> None:
    """Between two steps in C: the next step starts there, and so does the grid of times."""
    compiled = stepper(bouncing_ball.model, 2)
    lib = compiled.library
    _, q, v = compiled.initial_state()
    state, work, info = compiled.c_state(0.0, q, v), lib.structs["work"](), lib.structs["info"]()
    params, options = compiled.c_params(compiled.parameters), compiled.c_options(RunOptions())
    u, h = lib.pointer(lib.array(np.zeros(1))), 1e-2

    def step() -> None:
        assert lib.call["step"](state, work, info, params, options, u, h) == 0

    for _ in range(3):
        step()
    assert state.t == 3 * h
    state.t, state.q[1] = 7.0, 2.0
    speed = state.v[1]
    for k in (1, 2):
        step()
        assert state.t == 7.0 + k * h
    fallen = 2 * h * speed - 9.81 / 2 * (2 * h) ** 2
    assert state.q[1] == pytest.approx(2 + fallen, abs=1e-14)
