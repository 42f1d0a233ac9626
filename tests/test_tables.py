"""Tables: splines against closed forms and a second derivation, in expressions and in C."""

import pickle
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
import signorini as sg
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from signorini.codegen.frontend.table import Table
from signorini.verify.splines import Spline
from trap_models import BUMPS, DRAG, GROUND, tabulated

ENDS = ("natural", "not-a-knot", "periodic")


def derivatives(table: Table, order: int, *at: float) -> float:
    """A derivative in the first argument, by CasADi's differentiation."""
    x = [ca.SX.sym(letter) for letter in "xy"[: len(at)]]
    value = table(*x)
    for _ in range(order):
        value = ca.jacobian(value, x[0])
    return float(ca.Function("f", x, [value])(*at))


def test_a_cubic_is_reproduced() -> None:
    x = np.array([-1.0, -0.4, 0.3, 1.0, 2.5, 3.0])
    table = sg.table(x, 1 - 2 * x + 0.5 * x**3, ends="not-a-knot")
    for at in (-1.0, -0.7, 0.3, 0.9, 2.999, 3.0):
        exact = (1 - 2 * at + 0.5 * at**3, -2 + 1.5 * at**2, 3 * at)
        for order, value in enumerate(exact):
            assert derivatives(table, order, at) == pytest.approx(value, abs=1e-13), (at, order)
    # beyond the ends the curvature stays: a parabola that touches the cubic to second order
    for end, at in ((-1.0, -1.8), (3.0, 4.0)):
        value = (1 - 2 * end + 0.5 * end**3) + (-2 + 1.5 * end**2) * (at - end)
        assert table(at) == pytest.approx(value + 1.5 * end * (at - end) ** 2, rel=1e-13)


def test_a_product_of_cubics_is_reproduced() -> None:
    x, y = np.array([0.0, 0.5, 0.7, 1.5, 2.0]), np.array([-2.0, -1.0, 0.5, 1.0])
    f = np.outer(x**3 - x, 1 + y**2 - y**3)
    table = sg.table((x, y), f, ends="not-a-knot")
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    value = table(a, b)
    both = ca.Function("f", [a, b], [value, ca.jacobian(ca.jacobian(value, a), b)])
    rng = np.random.default_rng(0)
    for at in rng.uniform((0, -2), (2, 1), (20, 2)):
        got, mixed = (float(z) for z in both(*at))
        assert got == pytest.approx((at[0] ** 3 - at[0]) * (1 + at[1] ** 2 - at[1] ** 3), abs=1e-13)
        exact = (3 * at[0] ** 2 - 1) * (2 * at[1] - 3 * at[1] ** 2)
        assert mixed == pytest.approx(exact, abs=1e-12)


def test_a_natural_table_goes_on_straight() -> None:
    table = sg.table([0, 1, 3, 4], [0, 2, -1, 5])
    for end, step in ((0.0, -1.0), (4.0, 1.0)):
        slope = derivatives(table, 1, end)
        assert derivatives(table, 2, end) == pytest.approx(0, abs=1e-12)
        assert table(end + 7 * step) == pytest.approx(table(end) + 7 * step * slope, rel=1e-13)


def test_two_points_are_a_straight_line() -> None:
    assert sg.table([1, 3], [2, 8])(10) == pytest.approx(29, rel=1e-14)


def test_a_periodic_table_repeats() -> None:
    x = np.linspace(0, 2 * np.pi, 41)
    table = sg.table(x, np.append(np.sin(x[:-1]), 0.0), ends="periodic")
    for at in (0.3, 2.0, 6.2):
        assert table(at) == pytest.approx(np.sin(at), abs=2e-6)  # h^4 / 384
        assert table(at - 6 * np.pi) == pytest.approx(table(at), abs=1e-14)
    for order in (0, 1, 2):  # smooth across the end
        before, behind = derivatives(table, order, -1e-9), derivatives(table, order, 1e-9)
        assert before == pytest.approx(behind, abs=1e-8)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(0.05, 3), min_size=3, max_size=9),
    st.integers(0, 2**32 - 1),
    st.sampled_from(ENDS),
    st.sampled_from(ENDS),
)
def test_tables_agree_with_a_second_derivation(
    steps: list[float], seed: int, first: str, second: str
) -> None:
    """Slopes at the points (here) and moments (`verify.splines`) give the same functions."""
    rng = np.random.default_rng(seed)
    x = np.cumsum([rng.normal(), *steps])
    y = np.cumsum([rng.normal(), *rng.uniform(0.2, 1, 4)])
    f = rng.normal(size=(x.size, y.size))
    for k, kind in enumerate((first, second)):
        if kind == "periodic":
            np.swapaxes(f, 0, k)[-1] = np.swapaxes(f, 0, k)[0]
    table = sg.table((x, y), f, ends=(first, second))
    spline = Spline(table)
    np.testing.assert_allclose(
        table.cells[..., 2:].reshape(spline.coefficients.shape),
        spline.coefficients,
        rtol=1e-9,
        atol=1e-9 * np.max(np.abs(spline.coefficients)),
    )
    # the values at the points, from either side; two continuous derivatives
    line = sg.table(x, f[:, 0], ends=first)
    size = np.max(np.abs(line.cells))
    for point, value in zip(x, f[:, 0], strict=True):
        assert line(point) == pytest.approx(value, abs=1e-12 * size)
        for order in (1, 2):
            sides = [derivatives(line, order, point + d * 1e-11) for d in (-1, 1)]
            assert sides[0] == pytest.approx(sides[1], abs=1e-8 * size)


@pytest.mark.parametrize("world", ["sympy", "casadi"])
def test_functions_in_c(world: str, stepper: Callable[..., sg.Stepper]) -> None:
    """Force, gap and potential of a model, far beyond the tables and at their points, too."""
    compiled = stepper(tabulated if world == "sympy" else tabulated_in_casadi)
    rng = np.random.default_rng(3)
    places = [*rng.uniform(-9, 9, (20, 2)), *((p, q) for p in DRAG.points[0] for q in (0.0, 1.0))]
    for x, vx in places:
        q, v = [x, 0.4], [vx, -0.2]
        assert compiled.evaluate("f", 0.0, q, v)[0] == pytest.approx(-0.1 * DRAG(vx), rel=1e-13)
        gap = 0.4 - GROUND(x)
        assert compiled.evaluate("g_N", 0.0, q)[0] == pytest.approx(gap, rel=1e-12, abs=1e-13)
        energy = 0.5 * (vx**2 + 0.04) + 9.81 * 0.4 + 0.1 * BUMPS(x, 0.4)
        assert float(compiled.evaluate("energy", 0.0, q, v)) == pytest.approx(energy, rel=1e-13)


def tabulated_in_casadi() -> sg.Model:
    return tabulated("casadi")


def test_a_bead_on_a_table_moves_as_on_the_cubic(stepper: Callable[..., sg.Stepper]) -> None:
    """A constraint y = h(x): from a table of a cubic, and from the cubic itself."""
    x_end = []
    for model in (wire_table, wire_cubic):
        trajectory = stepper(model).simulate(dt=0.01, t_end=1.0)
        x_end.append(trajectory.q[-1])
    np.testing.assert_allclose(x_end[0], x_end[1], rtol=1e-12)
    assert abs(x_end[0][0] - 0.2) > 0.3


def _wire(name: str, h: Callable[[sp.Expr], sp.Expr]) -> sg.Model:
    m = sg.Model(name)
    x, y = m.coordinates("x y")
    vx, vy = m.velocities
    m.lagrangian = (vx**2 + vy**2) / 2 - 9.81 * y
    m.constraint("wire", y - h(x))
    m.initial_state(q=[0.2, 0.2**3 - 0.2], v=[0, 0])
    return m


def wire_table() -> sg.Model:
    x = np.linspace(-2, 2, 6)
    return _wire("wire_table", sg.table(x, x**3 - x, ends="not-a-knot"))


def wire_cubic() -> sg.Model:
    return _wire("wire_cubic", lambda x: x**3 - x)


def test_the_check_passes() -> None:
    assert sg.check(tabulated(), stages=(2,))


def test_text_grows_by_the_numbers_alone(tmp_path: object) -> None:
    lines = []
    for n in (5, 50):
        x = np.linspace(0, 1, n)
        folder = sg.generate(_wire("wire", sg.table(x, 0 * x + 0.008 - 0.2)), f"{tmp_path}/{n}")
        text = (folder / "wire.c").read_text().splitlines()
        lines.append([line for line in text if not line.startswith("    ") or "[" in line])
    assert abs(len(lines[0]) - len(lines[1])) <= 2


def test_models_with_tables_pickle() -> None:
    for world in ("sympy", "casadi"):
        model = tabulated(world)
        again = pickle.loads(pickle.dumps(model))
        before, after = (
            str(sg.build(m, stages=2).evaluate("g_N", 0.0, [0.3, 1.0])) for m in (model, again)
        )
        assert before == after


def test_derivatives_that_a_user_takes() -> None:
    x = sp.Symbol("x", real=True)
    table = sg.table([0, 1, 2, 4], [0, 1, -1, 2], name="curve")
    slope = sp.diff(table(x**2), x)
    assert str(slope) == "2*x*curve_x(x**2)"
    m = sg.Model("rod")
    (q,) = m.coordinates("q")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2
    m.force([slope.subs(x, q)])
    m.initial_state(q=[0.8], v=[0])
    force = sg.build(m, stages=2).evaluate("f", 0.0, [0.8], [0.0])
    assert force[0] == pytest.approx(1.6 * derivatives(table, 1, 0.64), rel=1e-13)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (([0, 1, 1], [0, 1, 2]), "must increase: 1 is followed by 1"),
        (([0, 1, 2], [0, 1]), "3 of them, but values have shape"),
        (([0, 1, float("nan")], [0, 1, 2]), "points must be finite"),
        (([0, 1, 2], [0, 1, float("inf")]), "values must be finite"),
        (([0], [1]), "2 to 2000 numbers are needed"),
        (("ab", [1, 2]), "no array of numbers"),
        (([0, 1], [[1, 2], [3, 4]]), "as a pair"),
        ((([0, 1], [0, 1], [0, 1]), [[1, 2], [3, 4]]), "as a pair"),
        ((3, [[1, 2], [3, 4]]), "as a pair"),
        (([0, 1], np.zeros((2, 2, 2))), "3 dimensions"),
        (((np.arange(200.0), np.arange(200.0)), np.zeros((200, 200))), "more than 10000 cells"),
    ],
)
def test_what_is_no_table_is_refused(arguments: tuple[object, object], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        sg.table(*arguments)


def test_options_and_arguments_are_checked() -> None:
    with pytest.raises(ValueError, match="choose from natural, not-a-knot, periodic"):
        sg.table([0, 1], [0, 1], ends="clamped")
    with pytest.raises(ValueError, match="the last values of points must be the first ones"):
        sg.table([0, 1, 2], [0, 1, 2], ends="periodic")
    with pytest.raises(ValueError, match="4 to 2000 numbers are needed with ends='not-a-knot'"):
        sg.table([0, 1, 2], [0, 1, 2], ends="not-a-knot")
    with pytest.raises(ValueError, match="keyword of C"):
        sg.table([0, 1], [0, 1], name="double")
    table = sg.table([0, 1], [0, 1])
    with pytest.raises(TypeError, match="takes 1 arguments, not 2"):
        table(1, 2)
    with pytest.raises(TypeError, match="is no scalar"):
        table(ca.MX.sym("x"))
    with pytest.raises(TypeError, match="is no scalar"):
        table(ca.SX.sym("x", 2))
    m = sg.Model("rod")
    coordinate = m.coordinates("q")
    with pytest.raises(sg.ModelError, match="tuple of one symbol"):
        table(coordinate)


def test_two_tables_of_one_name_are_refused() -> None:
    m = sg.Model("rod")
    (q,) = m.coordinates("q")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2
    m.force([sg.table([0, 1], [0, 1], name="a")(q) + sg.table([0, 1], [0, 2], name="a")(q)])
    m.initial_state(q=[0], v=[0])
    with pytest.raises(sg.ModelError, match="a second table called 'a'"):
        sg.build(m, stages=2)
