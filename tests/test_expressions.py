"""What a symbolic user writes: every operation means the same in C, for people and in the
reference; everything else is answered with the remedy."""

import cmath
import copy
import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import mpmath as mp
import numpy as np
import pytest
import signorini as sg
import sympy as sp
from signorini.codegen.frontend.operations import OPERATIONS, PLUMBING
from signorini.codegen.frontend.sx_to_sympy import to_sympy
from signorini.codegen.frontend.terms import unique_nodes
from signorini.verify import expressions
from sympy.codegen import cfunctions


def test_one_list_of_operations() -> None:
    """The reference knows every operation of the list, by its own meaning; nothing knows more."""
    numbers = {o.op for o in OPERATIONS}
    for module in (cmath, mp):
        known = set(expressions._operations(module))
        assert known - PLUMBING == numbers


def alone(m: sg.Model, k: int) -> sg.Model:
    """A model with one of the outputs: the others may have no value at a point of its domain."""
    other = copy.copy(m)
    other.outputs = [m.outputs[k]]
    return other


def test_every_operation_means_the_same() -> None:
    """C against the reference and against what people are shown, at points of the domain."""
    m = sg.Model("operations", symbols="casadi")
    x, y = m.coordinates("x y")
    m.lagrangian = sum(v**2 for v in m.velocities) / 2
    chosen = []
    for operation in OPERATIONS:
        value = (
            ca.SX.unary(operation.op, x)
            if operation.arity == 1
            else ca.SX.binary(operation.op, x, y)
        )
        if operation.op == ca.OP_CONSTPOW:
            value = x**1.7
        chosen.append(operation)
        m.output(f"o{len(chosen) - 1}", value)
    m.initial_state(q=[0.5, 0.5])
    compiled = sg.build(m, stages=2)
    symbols = [ca.SX.sym("x"), ca.SX.sym("y")]
    rng = np.random.default_rng(1)
    for k, operation in enumerate(chosen):
        for _ in range(4):
            at = [rng.uniform(*domain) for domain in operation.domain]
            if operation.domain[0] == (0.0, 1.0):
                at[0] = float(rng.integers(2))
            q = np.array([*at, 0.5][:2])
            mine = compiled.evaluate("outputs", 0.0, q)[k]
            other = expressions.Expressions(alone(m, k)).value("outputs", 0.0, q, [0, 0], [], [])[0]
            assert mine == pytest.approx(other, rel=1e-13, abs=1e-15), operation.name
            expr = ca.substitute(m.outputs[k][1], ca.vertcat(x, y), ca.vertcat(*symbols))
            shown = to_sympy(expr)[0]
            # truth values stand for themselves; what SymPy lacks is shown by its name in C
            logical = operation.domain[0] == (0.0, 1.0)
            if not logical and not shown.atoms(sp.core.function.AppliedUndef):
                truth = shown.subs(dict(zip(sp.symbols("x y", real=True), q, strict=True)))
                number = float(bool(truth)) if truth in (sp.true, sp.false) else float(truth)
                assert number == pytest.approx(mine, rel=1e-12, abs=1e-14), operation.name


FUNCTIONS: dict[str, tuple[Callable[[Any], Any], Callable[[float], Any], float]] = {
    "log1p": (cfunctions.log1p, mp.log1p, 1e-9),
    "expm1": (cfunctions.expm1, mp.expm1, 1e-9),
    "exp2": (cfunctions.exp2, lambda x: mp.mpf(2) ** x, 1.3),
    "log2": (cfunctions.log2, lambda x: mp.log(x, 2), 1.3),
    "log10": (cfunctions.log10, mp.log10, 1.3),
    "cbrt": (cfunctions.Cbrt, lambda x: -mp.cbrt(-mp.mpf(x)), -1.3),
    "hypot": (lambda x: cfunctions.hypot(x, 2), lambda x: mp.hypot(x, 2), 1.3),
    "fma": (lambda x: cfunctions.fma(x, 3, 2), lambda x: 3 * mp.mpf(x) + 2, 1.3),
    "erf": (sp.erf, mp.erf, 0.7),
    "erfc": (sp.erfc, mp.erfc, 3.5),
    "erfc near zero": (sp.erfc, mp.erfc, -0.4),
    "gamma": (sp.gamma, mp.gamma, 3.3),
    "gamma below zero": (sp.gamma, mp.gamma, -1.7),
    "loggamma": (sp.loggamma, mp.loggamma, 7.1),
}


def test_functions_of_c99() -> None:
    """Values and derivatives against mpmath, in one model."""
    m = sg.Model("functions")
    q = m.coordinates(" ".join(f"x{k}" for k in range(len(FUNCTIONS))))
    m.lagrangian = sum(v**2 for v in m.velocities) / 2
    m.force([f(x) for (f, _, _), x in zip(FUNCTIONS.values(), q, strict=True)])
    start = [at for _, _, at in FUNCTIONS.values()]
    m.initial_state(q=[sp.Float(x) for x in start])
    compiled = sg.build(m, stages=2)
    force = compiled.evaluate("f", 0.0, start)
    slope = np.diag(compiled.evaluate("f_q", 0.0, start))
    for k, (name, (_, exact, at)) in enumerate(FUNCTIONS.items()):
        assert force[k] == pytest.approx(float(exact(at)), rel=2e-14), name
        assert slope[k] == pytest.approx(float(mp.diff(exact, at)), rel=1e-11), name


@pytest.mark.parametrize("symbols", ["sympy", "casadi"])
def test_the_norm_knows_its_derivative_at_zero(symbols: str) -> None:
    """-c |v| v: derivative zero at rest, c (|v| 1 + v v^T / |v|) elsewhere."""
    m = sg.Model("drag", symbols=symbols)
    m.coordinates("x y")
    v = m.velocities
    size = sg.norm(list(v))
    m.lagrangian = (v[0] ** 2 + v[1] ** 2) / 2
    m.force([-size * v[0], -size * v[1]])
    m.initial_state(q=[0, 0])
    compiled = sg.build(m, stages=2)
    assert np.array_equal(compiled.evaluate("f_v", 0.0, [0, 0], [0, 0]), np.zeros((2, 2)))
    at = np.array([0.6, -0.8])
    expected = -(np.eye(2) + np.outer(at, at))
    assert compiled.evaluate("f_v", 0.0, [0, 0], at) == pytest.approx(expected, rel=1e-14)
    # v = v_0 / (1 + v_0 t)
    traj = compiled.simulate(t_end=2, dt=1e-2, v0=[1, 0])
    assert traj.v[-1] == pytest.approx([1 / 3, 0], abs=1e-5)
    assert sg.check(m, stages=(2,))


def test_a_derivative_that_is_no_number_is_named() -> None:
    m = sg.Model("drag")
    x, y = m.coordinates("x y")
    vx, vy = m.velocities
    m.lagrangian = (vx**2 + vy**2) / 2 - 10 * y
    m.force([-sp.sqrt(vx**2 + vy**2) * vx, 0])
    m.contact("floor", g_N=y - x / 10**6)
    m.initial_state(q=[0, 1])
    compiled = sg.build(m, stages=2)
    with pytest.raises(
        sg.StepError, match=r"force on 'x' with respect to '.*_dot' is .*sg\.norm"
    ) as e:
        compiled.simulate(t_end=1, dt=1e-2)
    assert e.value.status == "NONFINITE"
    assert len(e.value.trajectory) == 1


def deep(depth: int) -> sp.Expr:
    e = x = sp.Symbol("x", real=True)
    for _ in range(depth):
        e = sp.Rational(6, 10) * sp.sin(e) + sp.cos(e) / 2
    return e.subs(x, x)


def test_shared_terms_are_looked_at_once() -> None:
    """The number of different terms grows by a constant a level, that of paths doubles."""
    counts = [len(list(unique_nodes(deep(k)))) for k in (4, 8, 12)]
    assert counts[2] - counts[1] == counts[1] - counts[0]
    nested = sp.Symbol("x", real=True)
    for k in range(3000):
        nested = sp.Add(
            sp.Mul(nested, sp.Symbol("x", real=True), evaluate=False), k, evaluate=False
        )
    assert len(list(unique_nodes(nested))) < 4 * 3000


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda x, k: sp.Derivative(sp.sin(x), x), r"\.doit\(\).*from_lagrangian"),
        (lambda x, k: sp.Integral(sp.sin(k), (k, 0, x)), r"\.doit\(\)"),
        (lambda x, k: sp.Sum(x**k, (k, 1, 3)), r"\.doit\(\)"),
        (lambda x, k: sp.Function("h")(x), r"h\(x\).*\.subs\(h\(x\)"),
        (lambda x, k: sp.MatrixSymbol("A", 2, 2)[0, 1] * x, r"A\[0, 1\].*m\.parameters"),
        (lambda x, k: sp.Indexed("c", 3) * x, r"c\[3\].*m\.parameters"),
        (lambda x, k: sp.besselj(0, x), r"besselj\(0, x\).*C99"),
        (lambda x, k: sp.Matrix([[x]]), r"\(1, 1\).*\[0\]"),
        (lambda x, k: (x,), r"tuple of one symbol.*\(x,\) ="),
        (lambda x, k: sp.I * x, "imaginary"),
        (lambda x, k: sp.Piecewise((x, x > 0)), r"no value.*last condition True"),
    ],
)
def test_remedies(make: Callable[[Any, Any], Any], words: str) -> None:
    m = sg.Model("remedies")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2
    m.force([make(x, sp.Symbol("k"))])
    m.initial_state(q=[0.5])
    with pytest.raises(sg.ModelError, match=f"(?s){words}"):
        sg.build(m)


def test_remedies_in_the_other_world() -> None:
    def model(force: Callable[[Any], Any]) -> sg.Model:
        m = sg.Model("casadi_world", symbols="casadi")
        (x,) = m.coordinates("x")
        (v,) = m.velocities
        m.lagrangian = v**2 / 2
        m.force([force(x)])
        m.initial_state(q=[0.5])
        return m

    grid = np.linspace(-1, 1, 21)
    for force, words in (
        (lambda x: -ca.interpolant("t", "bspline", [grid], np.tanh(grid))(x), "call of a CasADi"),
        (lambda x: ca.MX.sym("z"), r"MX.*f\.expand"),
        (lambda x: sp.Symbol("x") * 2, "SymPy expression in a model"),
        (lambda x: (x,), "tuple of one symbol"),
    ):
        with pytest.raises(sg.ModelError, match=f"(?s){words}"):
            sg.build(model(force))


def test_numbers_of_any_length() -> None:
    m = sg.Model("rational")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    big = sp.Rational(10**400 + 1, 3 * 10**400)
    m.lagrangian = v**2 / 2 - big * x**2
    m.initial_state(q=[1])
    assert sg.build(m, stages=2).evaluate("L_q", 0.0, [1.0])[0] == pytest.approx(-2 / 3, rel=1e-15)
    assert math.isfinite(float(big))
