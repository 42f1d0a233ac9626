"""Models that fall into parts: what nothing couples moves as if it were alone."""

from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import signorini as sg
from compilers import STRICT, compiler, run
from hypothesis import given, settings
from hypothesis import strategies as st
from signorini.bodies import Planar, Spatial, inertia
from signorini.codegen.composition import compose
from signorini.codegen.frontend.validate import freeze
from signorini.runtime.library import SUCCESS
from signorini.runtime.options import RunOptions
from signorini.runtime.stability import stable_step


def add_box(m: sg.Model, world: Planar, name: str) -> dict[str, float]:
    """A box above a floor, which jams a little less than it slides."""
    box = world.body(name, 1.0, inertia.rectangle(1.0, 0.4, 0.2))
    for j, (x, y) in enumerate(((-0.2, -0.1), (0.2, -0.1), (0.2, 0.1), (-0.2, 0.1))):
        world.contact(f"{name}_{j}", box.point(x, y), world.plane(), mu=0.3, e_N=0.2)
    return {f"{name}_y": 0.5}


def add_pendulum(m: sg.Model, name: str) -> None:
    """A pendulum between dry friction in its hinge and a stop: another kind of part."""
    (phi,) = m.coordinates(f"{name}_phi", units="rad")
    rate = m.velocities[-1]
    m.lagrangian += rate**2 / 2 + 9.81 * ca.cos(phi)
    m.friction(f"{name}_hinge", gamma_F=rate, bound=0.05)
    m.contact(f"{name}_stop", g_N=phi + 0.3, e_N=0.6)


def mixed(count: int) -> sg.Model:
    """Boxes, and pendulums declared between them."""
    m = sg.Model("mixed", symbols="casadi")
    world = Planar(m, gravity=(0, -9.81))
    start: dict[str, float] = {}
    for k in range(count):
        start |= add_box(m, world, f"b{k}")
        if k % 2 == 0:
            add_pendulum(m, f"p{k}")
            start[f"p{k}_phi"] = 0.4
    m.initial_state(q=start)
    return m


def mixed_three() -> sg.Model:
    return mixed(3)


def box_alone() -> sg.Model:
    m = sg.Model("box_alone", symbols="casadi")
    m.initial_state(q=add_box(m, Planar(m, gravity=(0, -9.81)), "b0"))
    return m


def pendulum_alone() -> sg.Model:
    m = sg.Model("pendulum_alone", symbols="casadi")
    m.lagrangian = 0
    add_pendulum(m, "p0")
    m.initial_state(q=[0.4])
    return m


def same_as_alone(
    together: sg.Stepper,
    alone: Callable[[str], sg.Stepper],
    q0: np.ndarray,
    v0: np.ndarray,
    events: str,
    steps: int,
) -> list[sg.Trajectory]:
    """Run the model, and each part alone from the same start; compare every bit."""
    traj = together.simulate(t_end=steps * 5e-3, dt=5e-3, q0=q0, v0=v0, events=events)
    singles = []
    for part in together.manifest["parts"]:
        own = list(part["coordinates"])
        single = alone(part["name"]).simulate(
            t_end=steps * 5e-3, dt=5e-3, q0=q0[own], v0=v0[own], events=events
        )
        np.testing.assert_array_equal(traj.q[:, own], single.q)
        np.testing.assert_array_equal(traj.v[:, own], single.v)
        n_N = together.sizes["n_N"]
        first = together.sizes["n_g"] + together.sizes["n_gamma"]
        normal = [r - first for r in part["rows"] if first <= r < first + n_N]
        np.testing.assert_array_equal(traj.P_N[:, normal], single.P_N)
        slip = [r - first - n_N for r in part["rows"] if r >= first + n_N]
        np.testing.assert_array_equal(traj.P_F[:, slip], single.P_F)
        singles.append(single)
    np.testing.assert_array_equal(traj.iterations, sum(s.iterations for s in singles))
    np.testing.assert_allclose(traj.energy, sum(s.energy for s in singles), rtol=1e-12)
    finite = [s.smallest_gap for s in singles]
    np.testing.assert_array_equal(traj.smallest_gap, np.min(finite, axis=0))
    times = sorted(event.t for s in singles for event in s.events)
    found = [event.t for event in traj.events]
    assert sorted(found) == times
    # but for the rounding of t + h at the end of a step
    assert len(found) < 2 or np.diff(found).min() >= -1e-12
    seen = {(event.t, event.kind, event.contact[2:]) for s in singles for event in s.events}
    assert {(event.t, event.kind, event.contact[2:]) for event in traj.events} == seen
    return singles


@pytest.mark.parametrize("events", ["captured", "located"])
def test_bodies_apart_move_as_if_alone(events: str, stepper: Callable[..., sg.Stepper]) -> None:
    together = stepper(mixed_three, 2, events="located")
    own = {
        "b": stepper(box_alone, 2, events="located"),
        "p": stepper(pendulum_alone, 2, events="located"),
    }
    rng = np.random.default_rng(5)
    q0 = together.initial_state()[1] + 0.0
    v0 = rng.normal(size=q0.size)
    angles = [k for k, name in enumerate(together.manifest["coordinates"]) if name[0] == "b"][2::3]
    q0[angles] = rng.uniform(-1, 1, len(angles))
    singles = same_as_alone(together, lambda name: own[name[0]], q0, v0, events, 160)
    assert any(event.kind == "impact" for s in singles for event in s.events)
    assert together.parts == ("b0", "p0_phi", "b1", "b2", "p2_phi")


def boxes_in_space(count: int) -> sg.Model:
    m = sg.Model("boxes_in_space", symbols="casadi")
    world = Spatial(m, gravity=(0, 0, -9.81))
    start = {}
    for k in range(count):
        box = world.body(f"b{k}", 1.0, inertia.cuboid(1.0, 0.4, 0.3, 0.2))
        for j in range(8):
            x, y, z = (((j >> i & 1) - 0.5) * size for i, size in enumerate((0.4, 0.3, 0.2)))
            world.contact(f"c{k}_{j}", box.point(x, y, z), world.plane(), mu=0.3, e_N=0.2)
        start |= {f"b{k}_x": float(k), f"b{k}_z": 0.5}
    world.initial_state(q=start)
    return m


@pytest.mark.thorough
@pytest.mark.parametrize("count", [2, 8, 64])
@pytest.mark.parametrize("events", ["captured", "located"])
def test_boxes_in_space_move_as_if_alone(count: int, events: str) -> None:
    together = sg.build(boxes_in_space(count), stages=2, events="located")
    single = sg.build(boxes_in_space(1), stages=2, events="located")
    rng = np.random.default_rng(count)
    q0 = together.initial_state()[1] + 0.0
    v0 = 0.5 * rng.normal(size=q0.size)
    for k in range(count):
        p = rng.normal(size=4)
        p /= np.linalg.norm(p)
        rate = v0[7 * k + 3 : 7 * k + 7]
        q0[7 * k + 3 : 7 * k + 7] = p
        v0[7 * k + 3 : 7 * k + 7] = rate - p * (p @ rate)
    singles = same_as_alone(together, lambda name: single, q0, v0, events, 200)
    assert len(singles) == count == len(set(together.parts))
    assert len({s.q.tobytes() for s in singles}) == count  # each moves in its own way
    assert all(any(event.kind == "impact" for event in s.events) for s in singles)


def assorted(compliant: bool) -> sg.Model:
    """A free coordinate first, a linkage without contacts, a rigid and a yielding body, a body
    called like a variable of C; terms of L that move nothing."""
    m = sg.Model("assorted", symbols="casadi")
    (free,) = m.coordinates("free")
    x, y = m.coordinates("x y")
    (part,) = m.coordinates("part")
    (soft,) = m.coordinates("soft")
    rate, u, v, w, s = m.velocities
    (length,) = m.parameters(length=0.5)
    (push,) = m.inputs("push")
    m.lagrangian = (
        (rate**2 + u**2 + v**2 + 2 * w**2 + s**2) / 2
        - 9.81 * (part - length)
        - 3 * (1 - ca.cos(free))
        - (soft - 0.3) * 9.81
        + ca.sin(m.time) * length
        + 7
    )
    m.force({"free": push, "x": -0.1 * u})
    m.constraint("rod", x**2 + y**2 - 1)
    m.contact("hard", g_N=part, e_N=0.5)
    m.contact("pad", g_N=soft, compliance=1e-3 if compliant else None, e_N=0)
    m.friction("rub", gamma_F=s, bound=0.2)
    m.initial_state(q=[0.1, 1.0, 0.0, 0.3, 0.2], v=[0.0, 0.0, 0.7, 0.0, 0.0])
    return m


def test_kinds_that_have_nothing_of_a_function(stepper: Callable[..., sg.Stepper]) -> None:
    """A linkage has no force of L: its rows are zero, whatever stands beside them."""
    together = stepper(assorted_yielding, 2)
    t, q, v = together.initial_state()
    expected = np.array([-3 * np.sin(q[0]), 0.0, 0.0, -9.81, -9.81])
    np.testing.assert_allclose(together.evaluate("L_q", t, q, v), expected, atol=1e-14)
    np.testing.assert_array_equal(together.evaluate("e_N", t, q), [0.5, 0.0, 0.0])
    data = freeze(assorted_yielding())
    L = ca.Function("L", [data.t, data.q, data.v, data.par], [data.L])
    assert together.evaluate("L", 0.3, q, v) == pytest.approx(float(L(0.3, q, v, 0.5)), rel=1e-14)


def assorted_yielding() -> sg.Model:
    return assorted(True)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("compliant", "options"),
    [(True, {}), (False, {"events": "located"}), (False, {"scheme": "moreau"})],
)
def test_assorted_parts_are_checked(compliant: bool, options: dict[str, str]) -> None:
    """Also the energy, of which a part has what moves with it, and the first what moves nothing."""
    m = assorted(compliant)
    report = sg.check(m, stages=[2], **options)
    assert report, str(report)


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["gcc", "g++", "clang"])
@pytest.mark.parametrize("make", [lambda: assorted(False), lambda: mixed(2)])
def test_no_warnings_in_models_of_several_parts(
    name: str, make: Callable[[], sg.Model], tmp_path: Path
) -> None:
    m = make()
    folder = sg.generate(m, tmp_path / "m", stages=2, events="located")
    flags = STRICT if name != "g++" else [f for f in STRICT if "prototypes" not in f][1:]
    how = ["-x", "c++", "-std=c++11"] if name == "g++" else []
    for file in (m.name, f"{m.name}_model"):
        said = run(compiler(name), *flags, *how, "-c", f"{file}.c", "-o", f"{file}.o", cwd=folder)
        assert not said
        assert (folder / f"{file}.o").stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"events": "located"}, {"scheme": "moreau"}])
def test_models_of_several_parts_are_checked(options: dict[str, str]) -> None:
    """Every function, residual and Jacobian against NumPy, which knows nothing of parts."""
    report = sg.check(mixed(2), stages=[2], **options)
    assert report, str(report)


def test_stages_and_functions_of_several_parts(stepper: Callable[..., sg.Stepper]) -> None:
    together = stepper(mixed_three, 2, events="located")
    t, q, v = together.initial_state()
    n = together.sizes
    M = together.evaluate("p_v", t, q, v)
    rows = {name: k for k, name in enumerate(together.manifest["coordinates"])}
    assert M[rows["p2_phi"], rows["p2_phi"]] == 1.0
    assert np.count_nonzero(M) == n["n_q"]
    W_N = together.evaluate("W_N", t, q)
    contacts = [c["name"] for c in together.manifest["contacts"] if c["normal"] >= 0]
    assert W_N[rows["p2_phi"], contacts.index("p2_stop")] == 1.0
    assert W_N[rows["b1_y"], contacts.index("b1_2")] == 1.0
    assert np.count_nonzero(W_N[rows["b1_y"]]) == 4
    energy = together.evaluate("energy", t, q, v)
    assert energy == pytest.approx(3 * 9.81 * 0.5 - 2 * 9.81 * np.cos(0.4), rel=1e-14)
    data = freeze(mixed_three())
    drawn = ca.Function("drawn", [data.q], [data.places])
    at = np.random.default_rng(3).normal(size=n["n_q"])
    assert data.places.shape[0] > 20
    np.testing.assert_array_equal(together.evaluate("shapes", t, at), np.array(drawn(at)))
    traj = together.simulate(t_end=0.05, dt=5e-3, record="stages")
    assert np.isfinite(traj.Q).all()
    np.testing.assert_array_equal(traj.Q[:, -1], traj.q[1:])


def test_the_stable_step_is_that_of_the_stiffest_part(stepper: Callable[..., sg.Stepper]) -> None:
    together = stepper(mixed_three, 2, events="located")
    q = together.initial_state()[1] + 0.0
    alone = stepper(pendulum_alone, 2, events="located")
    angles = {"p2_phi": 0.3, "p0_phi": -0.2}
    for name, value in angles.items():
        q[together.manifest["coordinates"].index(name)] = value
    steps = [
        stable_step(alone, 0.0, np.array([value]), np.zeros(1), None, {})
        for value in angles.values()
    ]
    found = stable_step(together, 0.0, q, np.zeros_like(q), None, {})
    assert steps[1] < steps[0] < np.inf  # the last part is not the stiffest
    assert found == pytest.approx(steps[1], rel=1e-12)


def test_a_part_that_fails_is_named(stepper: Callable[..., sg.Stepper]) -> None:
    together = stepper(mixed_three, 2, events="located")
    names = together.manifest["coordinates"]
    _, q, v = together.initial_state()
    low = q + 0.0
    low[names.index("b1_y")] = 0.08
    with pytest.raises(sg.RunError, match="b1_"):
        together.simulate(t_end=0.1, dt=5e-3, q0=low)
    # all others rest, the last part runs into its stop
    q[[k for k, name in enumerate(names) if name.endswith("_y")]] = 0.1
    q[names.index("p0_phi")] = 0.0
    v = v + 0.0
    v[names.index("p2_phi")] = -200.0
    with pytest.raises(sg.StepError, match="in the part 'p2_phi'"):
        together.simulate(t_end=0.1, dt=5e-3, q0=q, v0=v, max_iterations=2, max_halvings=0)


def test_a_step_that_fails_changes_no_part(stepper: Callable[..., sg.Stepper]) -> None:
    together = stepper(mixed_three, 2, events="located")
    lib = together.library
    names = together.manifest["coordinates"]
    t, q, v = together.initial_state()
    work, info = lib.structs["work"](), lib.structs["info"]()
    par = together.c_params(together.check_parameters(None))
    state = together.c_state(t, q, v)
    empty = lib.pointer(lib.array(np.zeros(1)))
    for options, fails in (
        (RunOptions.of({}), False),
        (RunOptions.of({"max_iterations": 2}), True),
    ):
        before = bytes(state)
        if fails:  # the first two parts have moved before the third is tried
            state.q[names.index("b0_y")] = state.q[names.index("b1_y")] = 5.0
            state.v[names.index("p2_phi")] = -200.0
            before = bytes(state)
        status = lib.call["step"](state, work, info, par, together.c_options(options), empty, 5e-3)
        assert (status > SUCCESS) == fails
        assert (bytes(state) == before) == fails
    assert together.parts[info.failed] == "p2_phi"


# --- what couples --------------------------------------------------------------------------------


def parts_of(m: sg.Model) -> list[tuple[int, ...]]:
    return [part.coordinates for part in compose(freeze(m)).parts]


def points(count: int) -> tuple[sg.Model, tuple[ca.SX, ...], tuple[ca.SX, ...]]:
    """Points on lines, each above a stop of its own."""
    m = sg.Model("points", symbols="casadi")
    q = m.coordinates(" ".join(f"x{k}" for k in range(count)))
    m.lagrangian = sum(v**2 / 2 for v in m.velocities)
    for k, x in enumerate(q):
        m.contact(f"stop{k}", g_N=x, e_N=0.5)
    m.initial_state(q=[1.0] * count)
    return m, q, m.velocities


APART = [(0,), (1,), (2,), (3,)]
JOINED = [(0,), (1, 3), (2,)]


def test_nothing_couples_points() -> None:
    m, _, _ = points(4)
    composition = compose(freeze(m))
    assert [part.coordinates for part in composition.parts] == APART
    assert composition.kind_of == (0, 0, 0, 0)


def _potential(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    m.lagrangian -= (q[1] - q[3]) ** 2


def _inertia(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    (mass,) = m.parameters(mass=2.0)
    m.lagrangian = mass * (m.lagrangian + v[1] * v[3] / 4)


def _force(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    m.force([0, -v[3], 0, 0])


def _constraint(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    m.constraint("rod", q[1] - q[3])


def _velocity_constraint(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    m.velocity_constraint("gear", v[1] - v[3])


def _contact(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    m.contact("pair", g_N=q[1] - q[3] + 0.5)


def _slip(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    m.contact("rub", g_N=q[1] + 1, gamma_F=v[3], mu=0.3)


def _bound(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    m.friction("brake", gamma_F=v[1], bound=1 + q[3] ** 2)


def _guard(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    m.contact("door", g_N=q[1] + 2, guard=q[3])


def _pressed(m: sg.Model, q: tuple[ca.SX, ...], v: tuple[ca.SX, ...]) -> None:
    m.contact("shoe", g_N=q[1] + 2)
    m.friction("drum", gamma_F=v[3], mu=0.2, pressed_by="shoe")


@pytest.mark.parametrize(
    "couple",
    [
        *(_potential, _inertia, _force, _constraint, _velocity_constraint),
        *(_contact, _slip, _bound, _guard, _pressed),
    ],
)
def test_what_couples(couple: Callable[..., None]) -> None:
    m, q, v = points(4)
    couple(m, q, v)
    assert parts_of(m) == JOINED


def test_what_is_drawn_alike() -> None:
    m, q, _ = points(4)
    for k in range(4):
        m.shape([(q[k], 0), (q[k], 1)])
    m.shape([(0, 0), (1, 0)])
    assert compose(freeze(m)).drawn_alike
    m.shape([(q[0], q[1])])
    assert not compose(freeze(m)).drawn_alike
    m, q, _ = points(4)
    m.shape([(q[2], 0)])
    composition = compose(freeze(m))
    assert composition.kind_of == (0, 0, 0, 0)
    assert not composition.drawn_alike


def test_rows_of_one_declaration_stay_together() -> None:
    m, q, _ = points(4)
    m.constraint("both", [q[1] - 1.0, q[3] - 1.0])
    assert parts_of(m) == JOINED


def test_what_no_force_touches_needs_no_step_of_its_own() -> None:
    """Coordinates without constraints and contacts are one part: one linear system."""
    m = sg.Model("free", symbols="casadi")
    x, _, z, _ = m.coordinates("x y z w")
    m.lagrangian = sum(v**2 / 2 for v in m.velocities)
    m.contact("a", g_N=x)
    m.contact("b", g_N=z)
    m.initial_state(q=[1.0] * 4)
    assert parts_of(m) == [(0,), (1, 3), (2,)]


def test_what_each_part_has_of_the_lagrangian() -> None:
    """Signs and factors of nested sums reach every term."""
    m = sg.Model("nested", symbols="casadi")
    x, y, z = m.coordinates("x y z")
    u, v, w = m.velocities
    (k,) = m.parameters(k=3.0)
    m.lagrangian = (
        u**2 / 2 - (ca.cos(y) - 2 * (v**2 - k * (-(w**2) + ca.sin(z)))) - (-(x**4) - y) / k
    )
    for name, gap in (("a", x), ("b", y), ("c", z)):
        m.contact(name, g_N=gap)
    m.initial_state(q=[1.0] * 3)
    shares = [part.data for part in compose(freeze(m)).parts]
    at = {"q": 0.7, "v": -1.3, "k": 3.0}
    found = [
        float(ca.Function("L", [d.q, d.v, d.par], [d.L])(at["q"], at["v"], at["k"])) for d in shares
    ]
    assert found == pytest.approx(
        [
            1.3**2 / 2 + 0.7**4 / 3,
            -np.cos(0.7) + 2 * 1.3**2 + 0.7 / 3,
            -6 * (-(1.3**2) + np.sin(0.7)),
        ],
        rel=1e-14,
    )


@pytest.mark.parametrize("what", ["mass", "restitution", "gap", "parameter", "law"])
def test_other_numbers_are_another_kind(what: str) -> None:
    m, q, v = points(4)
    if what == "mass":
        m.lagrangian += v[2] ** 2 / 8
    if what == "gap":
        m.contact("more", g_N=q[2] + 1e-3)
    if what == "restitution":
        m.contacts[2] = m.contacts[2].__class__(**{**m.contacts[2].__dict__, "e_N": 0.25})
    if what == "parameter":
        (a,) = m.parameters(a=1.0)
        m.lagrangian -= a * q[2] ** 2
    if what == "law":
        m.friction("hinge", gamma_F=v[2], bound=1.0)
    assert compose(freeze(m)).kind_of == (0, 0, 1, 0)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(2, 7).flatmap(
        lambda n: st.tuples(
            st.just(n),
            st.lists(
                st.tuples(st.integers(0, n - 1), st.integers(0, n - 1), st.sampled_from("LFgcs")),
                max_size=6,
            ),
        )
    )
)
def test_parts_are_the_components_of_the_graph(
    drawn: tuple[int, list[tuple[int, int, str]]],
) -> None:
    n, edges = drawn
    m, q, v = points(n)
    label = list(range(n))
    for k, (i, j, how) in enumerate(edges):
        if i == j:
            continue
        if how == "L":
            m.lagrangian -= ca.cos(q[i]) * q[j]
        elif how == "F":
            m.force([-v[j] if c == i else 0 for c in range(n)])
        elif how == "g":
            m.constraint(f"g{k}", q[i] * q[j] - 1)
        elif how == "c":
            m.contact(f"c{k}", g_N=q[i] + q[j] + 5)
        else:
            m.friction(f"s{k}", gamma_F=v[i] - v[j], bound=1.0)
        old, new = label[j], label[i]
        label = [new if x == old else x for x in label]
    groups = {x: tuple(k for k in range(n) if label[k] == x) for x in label}
    assert sorted(parts_of(m)) == sorted(groups.values())
    composition = compose(freeze(m))
    # the parts of L add up to it
    data = freeze(m)
    f = ca.Function("f", [data.q, data.v], [data.L])
    at = np.random.default_rng(0).normal(size=(2, n))
    total = sum(
        float(
            ca.Function("p", [part.data.q, part.data.v], [part.data.L])(
                at[0, list(part.coordinates)], at[1, list(part.coordinates)]
            )
        )
        for part in compose(data).parts
    )
    assert total == pytest.approx(float(f(*at)), rel=1e-12, abs=1e-12)
    assert len(composition.kinds) <= len(composition.parts)
