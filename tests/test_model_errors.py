"""Every wrong model is refused by name: model, equation, symbol or value, remedy."""

from collections.abc import Callable

import casadi as ca
import pytest
import signorini as sg
import sympy as sp
from signorini.codegen.frontend.validate import freeze


def base(symbols: str = "sympy") -> sg.Model:
    """A correct model for each case to spoil."""
    m = sg.Model("case", symbols=symbols)
    _x, y = m.coordinates("x y")
    vx, vy = m.velocities
    (mass,) = m.parameters(mass=1.0)
    m.inputs("u1")
    m.lagrangian = mass / 2 * (vx**2 + vy**2) - mass * 9.81 * y
    m.initial_state(q=[0, 1])
    return m


def no_lagrangian(m: sg.Model) -> None:
    m.L = None


def foreign(m: sg.Model) -> None:
    m.L = m.L + sp.Symbol("stiffness") * m.q[0] ** 2


def look_alike(m: sg.Model) -> None:
    m.contact("c", g_N=sp.Symbol("y") - 1)


def other_world(m: sg.Model) -> None:
    m.force([ca.SX.sym("x"), 0])


def twice(m: sg.Model) -> None:
    m.parameters(x=1.0)


def twice_contact(m: sg.Model) -> None:
    m.contact("c", g_N=m.q[1])
    m.contact("c", g_N=m.q[0])


def not_affine(m: sg.Model) -> None:
    m.velocity_constraint("roll", m.v[0] * m.v[1])


def slip_not_affine(m: sg.Model) -> None:
    m.contact("c", g_N=m.q[1], gamma_F=sp.sqrt(m.v[0] ** 2 + 1))


def gap_with_velocity(m: sg.Model) -> None:
    m.contact("c", g_N=m.q[1] + m.v[1])


def constraint_with_velocity(m: sg.Model) -> None:
    m.constraint("bar", m.q[0] + m.v[1])


def gap_with_input(m: sg.Model) -> None:
    m.contact("c", g_N=m.q[1] - m.u[0])


def lagrangian_with_input(m: sg.Model) -> None:
    m.L = m.L + m.u[0] * m.q[0]


def massless(m: sg.Model) -> None:
    m.L = m.v[0] ** 2 / 2


def dependent_velocities(m: sg.Model) -> None:
    m.L = (m.v[0] + m.v[1]) ** 2 / 2


def force_shape(m: sg.Model) -> None:
    m.force([0, 0, 0])


def force_name(m: sg.Model) -> None:
    m.force({"z": 1})


def three_slips(m: sg.Model) -> None:
    m.contact("c", g_N=m.q[1], gamma_F=[m.v[0], m.v[1], m.v[0]])


def matrix_gap(m: sg.Model) -> None:
    m.contact("c", g_N=sp.Matrix([m.q[0], m.q[1]]))


def kink(m: sg.Model) -> None:
    m.contact("c", g_N=sp.Abs(m.q[0]) - 1)


def kink_in_lagrangian(m: sg.Model) -> None:
    m.L = m.L + sp.Piecewise((m.q[0], m.q[0] > 0), (0, True))


def restitution(m: sg.Model) -> None:
    m.contact("c", g_N=m.q[1], e_N=1.2)


def tangential_restitution(m: sg.Model) -> None:
    m.contact("c", g_N=m.q[1], gamma_F=m.v[0], e_F=-0.1)


def negative_friction(m: sg.Model) -> None:
    m.contact("c", g_N=m.q[1], gamma_F=m.v[0], mu=-0.1)


def friction_of_state(m: sg.Model) -> None:
    m.contact("c", g_N=m.q[1], gamma_F=m.v[0], mu=m.q[0] - 1)


def default_friction(m: sg.Model) -> None:
    (mu,) = m.parameters(mu=-1.0)
    m.contact("c", g_N=m.q[1], gamma_F=m.v[0], mu=mu)


def negative_bound(m: sg.Model) -> None:
    m.friction("brake", gamma_F=m.v[0], bound=-2)


def friction_without_slip(m: sg.Model) -> None:
    m.friction("brake", gamma_F=None, bound=1)


def no_start(m: sg.Model) -> None:
    m.start = None


def short_start(m: sg.Model) -> None:
    m.initial_state(q=[0])


def start_of_state(m: sg.Model) -> None:
    m.initial_state(q=[0, m.q[0]])


def keyword(m: sg.Model) -> None:
    m.parameters(register=1.0)


def cpp_keyword(m: sg.Model) -> None:
    m.coordinates("template")


def libm(m: sg.Model) -> None:
    m.inputs("sin")


def macro(m: sg.Model) -> None:
    m.parameters(NAN=1.0)


def not_an_identifier(m: sg.Model) -> None:
    m.coordinates("2x")


def injection(m: sg.Model) -> None:
    m.coordinates("x;system")


def time_name(m: sg.Model) -> None:
    m.parameters(t=1.0)


def no_c_function(m: sg.Model) -> None:
    m.force([sp.besselj(0, m.q[0]), 0])


def function_of_time(m: sg.Model) -> None:
    m.force([sp.Function("x")(m.time), 0])


def complex_number(m: sg.Model) -> None:
    m.force([sp.I * m.q[0], 0])


def infinite(m: sg.Model) -> None:
    m.force([sp.oo, 0])


def nan_at_start(m: sg.Model) -> None:
    m.L = m.L + sp.log(m.q[0])


def empty_constraint(m: sg.Model) -> None:
    m.constraint("bar", [])


def constraint_without_coordinates(m: sg.Model) -> None:
    m.constraint("bar", m.par[0] - 1)


def parameter_value(m: sg.Model) -> None:
    m.parameters(k=float("inf"))


def parameter_bounds(m: sg.Model) -> None:
    m.parameters(k=sg.par(-1, min=0))


def open_piecewise(m: sg.Model) -> None:
    m.force([sp.Piecewise((m.q[0], m.q[0] > 0)), 0])


def huge_number(m: sg.Model) -> None:
    m.force([sp.Integer(10) ** 400 * m.q[0], 0])


CASES: list[tuple[Callable[[sg.Model], None], list[str]]] = [
    (no_lagrangian, ["lagrangian", "missing"]),
    (foreign, ["Lagrangian", "stiffness"]),
    (look_alike, ["g_N of contact 'c'", "'y'", "elsewhere"]),
    (other_world, ["force on 'x'", "CasADi"]),
    (twice, ["'x'", "twice"]),
    (twice_contact, ["'c'", "twice"]),
    (not_affine, ["velocity_constraint 'roll'", "affine", "x_dot"]),
    (slip_not_affine, ["gamma_F of contact 'c'", "affine", "x_dot"]),
    (gap_with_velocity, ["g_N of contact 'c'", "velocity 'y_dot'", "a velocity goes into gamma_F"]),
    (constraint_with_velocity, ["constraint 'bar'", "velocity 'y_dot'"]),
    (gap_with_input, ["g_N of contact 'c'", "input 'u1'"]),
    (lagrangian_with_input, ["Lagrangian", "input 'u1'"]),
    (massless, ["Lagrangian", "singular", "y_dot"]),
    (dependent_velocities, ["Lagrangian", "singular", "x_dot", "y_dot"]),
    (force_shape, ["force", "3 entries", "2 coordinates"]),
    (force_name, ["force", "'z'", "x y"]),
    (three_slips, ["gamma_F of contact 'c'", "3 components"]),
    (matrix_gap, ["g_N of contact 'c'", "shape"]),
    (kink, ["g_N of contact 'c'", "Abs(x)", "smooth"]),
    (kink_in_lagrangian, ["Lagrangian", "Piecewise", "smooth"]),
    (restitution, ["e_N of contact 'c'", "1.2", "[0, 1]"]),
    (tangential_restitution, ["e_F of contact 'c'", "-0.1"]),
    (negative_friction, ["mu of contact 'c'", "-0.1", ">= 0"]),
    (friction_of_state, ["mu of contact 'c'", "at the initial state", ">= 0"]),
    (default_friction, ["mu of contact 'c'", "-1", "default"]),
    (negative_bound, ["bound of friction 'brake'", "-2"]),
    (friction_without_slip, ["friction 'brake'", "slip"]),
    (no_start, ["initial_state", "missing"]),
    (short_start, ["initial_state", "1 entries", "2 coordinates"]),
    (start_of_state, ["initial value of 'y'", "coordinate 'x'"]),
    (keyword, ["'register'", "keyword of C"]),
    (cpp_keyword, ["'template'", "keyword of C++"]),
    (libm, ["'sin'", "function of the C"]),
    (macro, ["'NAN'", "macro"]),
    (not_an_identifier, ["'2x'", "identifier"]),
    (injection, ["'x;system'", "identifier"]),
    (time_name, ["'t'", "twice", "time"]),
    (no_c_function, ["force on 'x'", "besselj", "C99"]),
    (function_of_time, ["force on 'x'", "x(t)", "coordinates"]),
    (complex_number, ["force on 'x'", "imaginary"]),
    (infinite, ["force on 'x'", "oo"]),
    (nan_at_start, ["Lagrangian", "initial state"]),
    (empty_constraint, ["constraint 'bar'", "no equation"]),
    (constraint_without_coordinates, ["constraint 'bar'", "no coordinate"]),
    (parameter_value, ["parameter 'k'", "inf"]),
    (parameter_bounds, ["parameter 'k'", "-1", "bounds"]),
    (huge_number, ["force on 'x'", "1e308"]),
    (open_piecewise, ["force on 'x'", "True"]),
]


@pytest.mark.parametrize(("spoil", "words"), CASES, ids=[c[0].__name__ for c in CASES])
def test_wrong_models_are_named(spoil: Callable[[sg.Model], None], words: list[str]) -> None:
    with pytest.raises(sg.ModelError) as caught:
        m = base()
        spoil(m)
        freeze(m)
    message = str(caught.value)
    for word in ["model 'case'", *words]:
        assert word in message, message
    assert message.endswith(".")
    assert caught.value.remedy


def test_the_spoiled_models_were_correct_before() -> None:
    assert freeze(base()).n_q == 2
    assert freeze(base("casadi")).n_q == 2


def test_casadi_models_are_checked_too() -> None:
    m = base("casadi")
    m.contact("c", g_N=ca.fabs(m.q[1]) - 1)
    with pytest.raises(sg.ModelError, match="smooth"):
        freeze(m)
    m = base("casadi")
    m.force([ca.SX.sym("k"), 0])
    with pytest.raises(sg.ModelError, match="unknown symbol 'k'"):
        freeze(m)
    m = base("casadi")
    m.force([sp.Symbol("x"), 0])
    with pytest.raises(sg.ModelError, match="SymPy expression"):
        freeze(m)


@pytest.mark.parametrize("symbols", ["sympy", "casadi"])
def test_smooth_vouches(symbols: str) -> None:
    m = base(symbols)
    x = m.q[0]
    bump = (
        sp.Piecewise((x**3, x > 0), (0, True)) if symbols == "sympy" else ca.if_else(x > 0, x**3, 0)
    )
    m.contact("c", g_N=m.q[1] + sg.smooth(bump))
    assert freeze(m).n_N == 1


def test_affine_in_disguise_is_accepted() -> None:
    m = base()
    m.velocity_constraint("roll", (m.v[0] + 1) ** 2 - m.v[0] ** 2 - 1)
    assert freeze(m).n_gamma == 1


def test_quaternion_with_plain_kinetic_energy_is_refused() -> None:
    """scheme.md 6.1: a unit quaternion has a singular mass matrix."""
    m = sg.Model("spin")
    p = sp.Matrix(m.coordinates("p0 p1 p2 p3"))
    v = sp.Matrix(m.velocities)
    H = sp.Matrix(
        [[-p[1], p[0], p[3], -p[2]], [-p[2], -p[3], p[0], p[1]], [-p[3], p[2], -p[1], p[0]]]
    )
    omega = 2 * H * v
    m.constraint("unit", p.dot(p) - 1)
    m.initial_state(q=[1, 0, 0, 0], v=[0, 1, 2, 3])
    m.L = omega.dot(omega) / 2
    with pytest.raises(sg.ModelError, match="quaternion"):
        freeze(m)
    m.L = omega.dot(omega) / 2 + 2 * p.dot(v) ** 2
    assert freeze(m).n_g == 1


@pytest.mark.parametrize(
    "options",
    [{"stages": 1}, {"stages": 2.5}, {"scheme": "euler"}, {"precision": "half"}, {"prefix": "a b"},
     {"prefix": "sg_x"}, {"prefix": "a__b"}],
    ids=str,
)  # fmt: skip
def test_options_are_checked_before_anything_is_written(options: dict, tmp_path) -> None:
    with pytest.raises(sg.GenerationError):
        sg.generate(base(), tmp_path / "out", **options)
    assert not list(tmp_path.iterdir())


def test_a_foreign_folder_is_not_overwritten(tmp_path) -> None:
    (tmp_path / "Makefile").write_text("mine")
    with pytest.raises(sg.GenerationError, match="Makefile"):
        sg.generate(base(), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["Makefile"]


@pytest.mark.parametrize(
    "given", [None, "ball", 5, sg.Model, base], ids=["none", "text", "number", "class", "function"]
)
def test_what_is_no_model_is_refused(given: object) -> None:
    for use in (sg.build, sg.check):
        with pytest.raises(sg.ModelError, match=r"signorini\.Model"):
            use(given)  # type: ignore[operator]


def test_a_parameter_may_be_called_self() -> None:
    m = base()
    (symbol,) = m.parameters(self=2.0)
    assert symbol.name == "self"
