"""Runs whose step sizes a tolerance chooses: how exact they are, what they say of themselves."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from command import signorini
from signorini.codegen.frontend.errors import GenerationError
from signorini.locate import find_model
from signorini.models import bead_on_hoop, conveyor_oscillator, slope
from signorini.runtime.errors import RunError
from signorini.runtime.options import RunOptions
from signorini.runtime.tolerance import control_of
from signorini.studies.tolerances import SCENES
from signorini.verify.event_driven import EventDriven

Build = Callable[..., sg.Stepper]


def cart() -> sg.Model:
    """A mass on a spring that an input pushes: with an input held its motion is a closed form."""
    m = sg.Model("cart")
    (x,), (v,) = m.coordinates("x", units="m"), m.velocities
    (push,) = m.inputs("push")
    m.lagrangian = v**2 / 2 - 2 * x**2
    m.force([push])
    m.initial_state(q=[0.5])
    return m


def swing(x: float, v: float, u: float, t: float) -> tuple[float, float]:
    """Its state after t: x'' = u - 4 x."""
    a, b = x - u / 4, v / 2
    c, s = np.cos(2 * t), np.sin(2 * t)
    return u / 4 + a * c + b * s, 2 * (b * c - a * s)


class Stepping:
    """Single steps of a stepper by its C functions, a tolerance choosing their sizes."""

    def __init__(self, stepper: sg.Stepper, t_end: float, error: float, **options: Any) -> None:
        self.stepper, self.lib = stepper, stepper.library
        par = stepper.check_parameters(options.pop("parameters", None))
        t, q, v = stepper.initial_state(par)
        chosen = RunOptions(error=error, **options)
        self.state = stepper.c_state(t, q, v)
        self.work, self.info = (self.lib.structs[x]() for x in ("work", "info"))
        self.params, self.options = stepper.c_params(par), stepper.c_options(chosen)
        self.control = control_of(stepper, chosen, t, t_end)

    def go(self, name: str, t_end: float) -> int:
        structs = (self.state, self.work, self.info, self.params, self.options)
        status: int = self.lib.call[name](*structs, None, t_end, self.control)
        return status

    @property
    def end(self) -> np.ndarray:
        return np.concatenate([self.lib.kept(self.state.q), self.lib.kept(self.state.v)])


@pytest.mark.parametrize("s", [pytest.param(2, marks=pytest.mark.thorough), 3])
@pytest.mark.parametrize("eventful", [False, True], ids=["smooth", "impact"])
def test_the_estimate_is_the_error(stepper: Build, s: int, eventful: bool) -> None:
    """Of single steps of a bead on a hoop, ever smaller, in free motion and over its first impact.

    The error is found by much smaller steps, in the norm of the estimate.
    """
    made = stepper(bead_on_hoop.model, s, events="located")
    hit = made.simulate(t_end=0.8, dt=0.8 / 512, events="located").events[0].t
    for size in 0.8 / 2.0 ** np.arange(3, 6 if s == 3 else 7):
        start = hit - size / 3 if eventful else hit / 4
        there = made.simulate(t_end=start, error=1e-13)
        one, fine = Stepping(made, 1.0, 1e3), Stepping(made, 1.0, 1e-13)
        for each in (one, fine):
            each.state = made.c_state(start, there.q[-1], there.v[-1])
        one.control.h = 10.0
        assert one.go("step_within", start + size) <= 2
        assert one.control.steps == 1
        assert (one.info.n_events > 0) == eventful
        assert fine.go("advance_to", start + size) <= 2
        scale = np.repeat([1.0, one.control.span], made.sizes["n_q"])
        ratio = one.control.estimate / float(np.max(np.abs(one.end - fine.end) * scale))
    # what is estimated converges to what it is an estimate of
    assert abs(np.log(ratio)) < 0.35


@pytest.mark.parametrize("wish", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(
    ("model", "t_end"), [(bead_on_hoop.model, 2.0), (conveyor_oscillator.model, 10.5)]
)
def test_runs_are_as_exact_as_asked(stepper: Build, model: Any, t_end: float, wish: float) -> None:
    """Through impacts, stick and slip, against the motion by events."""
    made = stepper(model, 3, events="located")
    traj = made.simulate(t_end=t_end, error=wish)
    t, q, v = made.initial_state()
    motion = EventDriven(model(), 1e-6)
    at = (t, q, v, np.zeros(0), list(made.parameters.values()))
    exact, _ = motion.run(at, t_end, t_end / 40)
    off = float(np.max(np.abs(traj.q[-1] - exact)))
    assert off < max(10 * wish, 1e-9)
    assert traj.t[-1] == t_end
    assert traj.estimate[-1] <= wish
    assert traj.missed == 0
    assert len(traj.t) == traj.steps + 1
    assert [e.kind for e in traj.events if e.kind in ("impact", "slip", "stick")] == [
        kind for _, _, kind in motion.events if kind in ("impact", "slip", "stick")
    ]


@pytest.mark.thorough
@pytest.mark.parametrize("name", SCENES)
def test_shipped_models_are_as_exact_as_asked(name: str) -> None:
    """Against five stages and a wish of 1e-11."""
    exact = sg.build(find_model(name), stages=5, events="located")
    end = exact.simulate(t_end=SCENES[name], error=1e-11).q[-1]
    made = sg.build(find_model(name), stages=4, events="located")
    for wish in (1e-3, 1e-6, 1e-10):
        traj = made.simulate(t_end=SCENES[name], error=wish)
        assert float(np.max(np.abs(traj.q[-1] - end))) < 10 * wish


def test_an_event_in_a_long_step_is_no_blind_spot(stepper: Build) -> None:
    """Stick for long, then slip: both ways of taking a step must not share a segment.

    While the mass sticks every step is exact, so that steps become as long as they may; the first
    one with the event ends long after it.
    """
    made = stepper(conveyor_oscillator.model, 3, events="located")
    one = Stepping(made, 10.5, 1e3)
    one.control.h = 6.0
    assert one.go("step_within", 6.0) <= 2  # sticks until 5
    assert one.control.n_parts >= 3
    ends = np.array(one.control.parts[: one.control.n_parts])
    assert ends[0] == pytest.approx(2.5, abs=1e-6) or ends[0] == pytest.approx(3.0)
    assert one.control.estimate > 1e-6  # and slips for long: that is not exact


def test_rows_of_a_grid_hold_the_inputs(stepper: Build) -> None:
    """Rows lie on the grid, and each interval has its own input."""
    made = stepper(cart, 3)
    u = np.array([1.0, -2.0, 0.5, 3.0])
    traj = made.simulate(t_end=2.0, dt=0.5, error=1e-9, inputs=u)
    assert traj.t.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    x, v = 0.5, 0.0
    for k in range(4):
        x, v = swing(x, v, u[k], 0.5)
        assert traj.q[k + 1, 0] == pytest.approx(x, abs=1e-9)
        assert traj.v[k + 1, 0] == pytest.approx(v, abs=1e-8)
    asked = made.simulate(t_end=2.0, dt=0.5, error=1e-9, inputs=lambda t, q, v: [u[int(t / 0.5)]])
    assert np.array_equal(asked.q, traj.q)
    assert np.all(np.diff(traj.estimate) > 0)
    thinned = made.simulate(t_end=2.0, dt=0.5, error=1e-9, inputs=u, every=3)
    assert thinned.t.tolist() == [0.0, 1.5, 2.0]
    assert np.array_equal(thinned.q[-1], traj.q[-1])
    assert thinned.iterations.sum() == traj.iterations.sum()


def test_states_between_rows_are_as_exact(stepper: Build) -> None:
    made = stepper(cart, 3)
    traj = made.simulate(t_end=2.0, error=1e-8)
    assert len(traj.t) < 100
    times = np.linspace(0, 2, 41)
    exact = np.array([swing(0.5, 0.0, 0.0, t) for t in times])
    q, v = traj(times)
    assert np.abs(q[:, 0] - exact[:, 0]).max() < 1e-8
    assert np.abs(v[:, 0] - exact[:, 1]).max() < 1e-7


def test_batches_are_the_runs(stepper: Build) -> None:
    made = stepper(bead_on_hoop.model, 3, events="located")
    speeds = [0.0, 1.0, 3.0]
    batch = made.simulate_batch(t_end=1.0, dt=0.25, error=1e-7, v0={"theta": speeds}, threads=2)
    for k, speed in enumerate(speeds):
        alone = made.simulate(t_end=1.0, dt=0.25, error=1e-7, v0={"theta": speed})
        one = batch.trajectory(k)
        for name in ("t", "q", "v", "P_N", "estimate", "iterations"):
            assert np.array_equal(getattr(one, name), getattr(alone, name)), name
        assert one.events == alone.events
    assert batch.missed is not None
    assert batch.missed.tolist() == [0, 0, 0]


@pytest.mark.thorough
@pytest.mark.parametrize("rows", [{}, {"dt": 0.25}])
def test_derivatives_hold_the_steps(stepper: Build, rows: dict[str, float]) -> None:
    """Through an impact: those of small equal steps; forward and back agree."""
    made = stepper(bead_on_hoop.model, 3, derivatives=True)
    of = ("q0", "v0", "parameters", "t0")
    plain = made.simulate(t_end=1.0, dt=1e-3, events="located", derivatives="forward", of=of)
    traj = made.simulate(t_end=1.0, error=1e-9, derivatives="forward", of=of, **rows)
    assert traj.differentiable is True
    for name in of:
        assert np.abs(traj.dq[name][-1] - plain.dq[name][-1]).max() < 1e-6
        assert len(traj.dq[name]) == len(traj.t)
    back = made.simulate(t_end=1.0, error=1e-9, derivatives="adjoint", **rows)
    weights = np.linspace(1, 2, len(back.t))[:, None] * np.ones(made.sizes["n_q"])
    gradient = back.gradient(weights)
    assert "dt" not in gradient
    for name in of:
        forward = sum(w @ d for w, d in zip(weights, traj.dq[name], strict=True))
        assert np.allclose(gradient[name], forward, rtol=1e-9, atol=1e-12), name


def test_gradients_by_inputs_are_of_their_intervals(stepper: Build) -> None:
    made = stepper(cart, 3, derivatives=True)
    u = np.array([1.0, -2.0, 0.5])
    run: dict[str, Any] = {"t_end": 1.5, "dt": 0.5, "error": 1e-9}
    traj = made.simulate(inputs=u, derivatives="adjoint", **run)
    found = traj.gradient([1.0])["inputs"]
    assert found.shape == (3, 1)
    for k in range(3):
        moved = [made.simulate(inputs=u + s * np.eye(3)[k], **run).q[-1, 0] for s in (1, -1)]
        assert found[k, 0] == pytest.approx((moved[0] - moved[1]) / 2, abs=1e-8)


def test_a_scale_says_what_one_means(stepper: Build) -> None:
    """An error in units of 2^-7 is that of a wish 2^7 times smaller."""
    made = stepper(cart, 3)
    plain = made.simulate(t_end=2.0, error=2.0**-27)
    for scale in ({"x": 2.0**-7}, 2.0**-7, [2.0**-7]):
        scaled = made.simulate(t_end=2.0, error=2.0**-20, scale=scale)
        assert np.array_equal(scaled.t, plain.t)
        assert np.array_equal(scaled.estimate, 2.0**7 * plain.estimate)


def test_what_cannot_be_had_is_said() -> None:
    """A force that leaps although the model vouches that it does not: the run goes on and warns."""
    m = sg.Model("leap")
    (x,) = m.coordinates("x", units="m")
    m.lagrangian = m.velocities[0] ** 2 / 2
    m.force([sg.smooth(sp.Piecewise((1, x > sp.Rational(1, 5)), (-3, True)))])
    m.initial_state(q=[0.0], v=[1.5])
    with pytest.warns(UserWarning, match=r"1 of \d+ steps.*less exact than error = 1e-09.*however"):
        traj = sg.build(m, stages=2).simulate(t_end=0.25, error=1e-9)
    assert traj.missed == 1
    assert traj.estimate[-1] > 1e-9


@pytest.mark.thorough
def test_a_step_that_cannot_be_solved_is_kept() -> None:
    """A force that ends at x = 1: the step replays at the size that was tried last."""
    m = sg.Model("edge")
    (x,) = m.coordinates("x", units="m")
    m.lagrangian = m.velocities[0] ** 2 / 2
    m.force([sp.log(1 - x)])
    m.initial_state(q=[0.0], v=[2.0])
    made = sg.build(m, stages=2)
    with pytest.raises(sg.StepError) as caught:
        made.simulate(t_end=1.0, error=1e-6)
    step = caught.value.step
    assert step.status == "NONFINITE"
    assert "error" not in step.options
    assert 0 < step.h <= 2.0**-19
    assert 1e-2 > 1 - caught.value.trajectory.q[-1, 0] > 0


def test_refusals(stepper: Build) -> None:
    made = stepper(cart, 3)
    for arguments, words in (
        ({}, "neither dt nor error"),
        ({"error": 0.0}, r"error = 0\.0: give an error > 0"),
        ({"error": 1e-6, "t_end": 0.0}, "end after the start"),
        ({"dt": 0.1, "scale": 2.0}, "scale is given without error"),
        ({"error": 1e-6, "scale": {"y": 1.0}}, "no coordinate 'y'"),
        ({"error": 1e-6, "scale": -1.0}, "numbers > 0"),
        ({"error": 1e-6, "record": "stages"}, "steps of one size"),
        ({"error": 1e-6, "inputs": lambda t, q, v: [0.0]}, "give dt, too"),
        ({"error": 1e-6, "derivatives": "forward", "of": ("dt",)}, "hold them as they are"),
    ):
        with pytest.raises(RunError, match=words):
            made.simulate(**{"t_end": 1.0, **arguments})
    with pytest.raises(RunError, match="one by one"):
        made.simulate_batch(t_end=1.0, dt=0.1, error=1e-6, derivatives="forward")
    for other in (
        lambda: made.start(dt=0.1, error=1e-6),
        lambda: made.step(0.0, [0.5], [0.0], 0.1, error=1e-6),
        lambda: made.problem("position", [0.0] * 4, [], 0.1, error=1e-6),
    ):
        with pytest.raises(RunError, match="leave them out"):
            other()
    with pytest.raises(RunError, match="scheme lobatto"):
        stepper(slope.model, 2, scheme="moreau").simulate(t_end=1.0, error=1e-6)
    for arguments in ({"stages": "auto"}, {"error": 1e-3}, {"t_end": 1.0}):
        with pytest.raises(GenerationError, match="auto"):
            sg.build(cart(), **arguments)


def test_c_refuses_what_is_none(stepper: Build) -> None:
    """Wrong numbers in the struct of the caller are a status, and leave the state as it was."""
    made = stepper(bead_on_hoop.model, 3, events="located")
    wrong = made.library.statuses.index("BAD_ARGUMENT")
    for name, value in (
        ("error", 0.0), ("error", float("nan")), ("span", -1.0), ("h", -1.0), ("h", float("inf")),
    ):  # fmt: skip
        one = Stepping(made, 1.0, 1e-6)
        setattr(one.control, name, value)
        before = bytes(one.state)
        assert one.go("step_within", 1.0) == wrong
        assert one.go("advance_to", 1.0) == wrong
        assert bytes(one.state) == before
    one = Stepping(made, 1.0, 1e-6)
    one.control.scale[0] = 0.0
    assert one.go("step_within", 1.0) == wrong
    one.control.scale[0] = 1.0
    assert one.go("step_within", 0.0) == wrong  # no time left
    assert one.go("step_within", float("nan")) == wrong
    one.options.events = 0  # captured steps have another order
    assert one.go("step_within", 1.0) == wrong


def test_advance_adds_up_what_steps_report(stepper: Build) -> None:
    """To a time in one call, or step by step: the same state, percussions, events, counts."""
    made = stepper(bead_on_hoop.model, 3, events="located")
    whole, single = Stepping(made, 2.0, 1e-7), Stepping(made, 2.0, 1e-7)
    assert whole.go("advance_to", 2.0) <= 2
    P, iterations, times = np.zeros(made.sizes["n_R"]), 0, []
    while single.state.t < 2.0:
        assert single.go("step_within", 2.0) <= 2
        P += single.lib.kept(single.info.P)[: made.sizes["n_R"]]
        iterations += single.info.iterations
        times += [single.info.events[k].t for k in range(single.info.n_events)]
    assert np.array_equal(whole.end, single.end)
    assert np.allclose(whole.lib.kept(whole.info.P)[: made.sizes["n_R"]], P, rtol=1e-14, atol=0)
    plain = made.simulate(t_end=2.0, dt=1e-3, events="located")
    assert P[0] == pytest.approx(plain.P_N.sum(), rel=1e-5)
    assert P[0] > 1e-3
    assert whole.info.iterations == iterations
    assert [whole.info.events[k].t for k in range(whole.info.n_events)] == times
    assert whole.control.steps == single.control.steps > 5
    assert whole.state.t == 2.0


def test_scratch_of_the_caller_does_not_matter(stepper: Build) -> None:
    """Results are the same whatever stands in the work struct and in the parts of the control."""
    made = stepper(bead_on_hoop.model, 3, events="located")
    ends = []
    for byte in (0, 0xFF):
        one = Stepping(made, 1.0, 1e-7)
        ctypes.memset(ctypes.byref(one.work), byte, ctypes.sizeof(one.work))
        for name in ("whole", "split", "parts", "sum", "before", "n_parts", "iterations"):
            field = getattr(type(one.control), name)
            at = ctypes.addressof(one.control) + field.offset
            ctypes.memset(at, byte, field.size)
        assert one.go("advance_to", 1.0) <= 2
        ends.append(one.end)
    assert np.array_equal(*ends)


def test_equal_steps_that_are_small_enough(stepper: Build) -> None:
    """The step found is as exact as asked, and twice as large it would not be; it keeps energy."""
    made = stepper(cart, 3)
    wish = 1e-6
    h = made.step_size(t_end=3.0, error=wish)
    n = round(3.0 / h)
    assert n * h == pytest.approx(3.0, rel=1e-14)

    def off(steps: int) -> float:
        traj = made.simulate(t_end=3.0, dt=3.0 / steps)
        exact = np.array([swing(0.5, 0.0, 0.0, t)[0] for t in traj.t])
        return float(np.max(np.abs(traj.q[:, 0] - exact)))

    assert off(n) < 1.2 * wish < off(n // 2)
    with pytest.raises(RunError, match="end after"):
        made.step_size(t_end=0.0, error=wish)
    with pytest.raises(RunError, match="below rounding"):
        made.step_size(t_end=1.0, error=1e-30)


@pytest.mark.thorough
def test_stages_that_cost_least() -> None:
    """Few for a coarse wish, many for a fine one, by the operations that the runs take."""
    few = sg.build(slope.model(), stages="auto", error=1e-2, t_end=2.2)
    many = sg.build(slope.model(), stages="auto", error=1e-9, t_end=2.2)
    assert few.stages < many.stages

    def work(s: int, error: float) -> float:
        made = sg.build(slope.model(), stages=s, events="located")
        cost = made.manifest["footprint"]
        each = cost["values"] + cost["derivatives"] + 2 * cost["products"]
        return float(made.simulate(t_end=2.2, error=error).iterations.sum() * each)

    for chosen, error in ((few.stages, 1e-2), (many.stages, 1e-9)):
        assert work(chosen, error) == min(work(s, error) for s in (3, 4, 5) if s >= chosen - 1)


def test_files_keep_estimates(stepper: Build, tmp_path: Path) -> None:
    made = stepper(cart, 3)
    traj = made.simulate(t_end=2.0, error=1e-8)
    again = sg.Trajectory.load(traj.save(tmp_path / "run.npz"), made)
    assert np.array_equal(again.estimate, traj.estimate)
    assert again.options["error"] == 1e-8
    q, v = again(1.234)
    assert np.array_equal(np.concatenate([q, v]), np.concatenate(traj(1.234)))
    with pytest.raises(AttributeError, match="error="):
        _ = made.simulate(t_end=1.0, dt=0.1).estimate


@pytest.mark.thorough
def test_on_the_command_line(tmp_path: Path) -> None:
    told = signorini(
        tmp_path, "run", "bouncing_ball", "--error", "1e-8", "--json", "--t-end", "1.1"
    ).stdout
    assert '"steps": 4' in told
    swept = signorini(
        tmp_path, "sweep", "bouncing_ball", "--over", "e_N=0,0.5", "--error", "1e-8",
        "--dt", "0.5", "--t-end", "1", "--workers", "1", "--out", str(tmp_path / "s.zarr"),
    )  # fmt: skip
    assert swept.returncode == 0, swept.stderr
    import zarr

    q = np.asarray(zarr.open_group(str(tmp_path / "s.zarr"), mode="r")["q"])
    made = sg.build(find_model("bouncing_ball"), events="located")
    for k, e_N in enumerate((0.0, 0.5)):
        alone = made.simulate(t_end=1.0, dt=0.5, error=1e-8, parameters={"e_N": e_N})
        assert np.array_equal(q.reshape(2, 3, -1)[k], alone.q)


def test_time_in_the_forces() -> None:
    """A force that depends on time: steps fit it wherever they begin."""

    def driven() -> sg.Model:
        m = sg.Model("driven")
        m.coordinates("x", units="m")
        m.lagrangian = m.velocities[0] ** 2 / 2
        m.force([sp.cos(5 * m.time)])
        m.initial_state(q=[0.0])
        return m

    traj = sg.build(driven(), stages=2).simulate(t0=1.0, t_end=4.0, error=1e-6)
    t = traj.t
    exact = (np.cos(5.0) - np.cos(5 * t)) / 25 - (t - 1) * np.sin(5.0) / 5
    assert np.abs(traj.q[:, 0] - exact).max() < 1e-6
