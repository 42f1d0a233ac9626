"""Parts that differ in their numbers share one text, and each has its numbers in it."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
import signorini as sg
from hypothesis import given, settings
from hypothesis import strategies as st
from signorini.bodies import Planar, inertia
from signorini.codegen import composition
from signorini.codegen.alike import Form, generalise
from signorini.codegen.composition import compose
from signorini.codegen.frontend.validate import freeze

X = ca.SX.sym("x", 3)
ROLES = {X[k].element_hash(): k for k in range(3)}
UNARY = (ca.sin, ca.fabs, lambda a: -a, lambda a: a * a)
BINARY = (
    lambda a, b: a + b,
    lambda a, b: a - b,
    lambda a, b: a * b,
    lambda a, b: a / (2 + b * b),
    ca.fmax,
)
# What is drawn is a tree without numbers; they are filled in from a list, one after another.
TREES = st.recursive(
    st.one_of(st.integers(0, 2), st.just("number")),
    lambda inner: st.one_of(
        st.tuples(st.sampled_from(range(len(UNARY))), inner),
        st.tuples(st.sampled_from(range(len(BINARY))), inner, inner),
    ),
    max_leaves=12,
)
NUMBERS = st.lists(st.integers(3, 40), min_size=12, max_size=12)


def fill(tree: Any, numbers: list[float]) -> ca.SX:
    if tree == "number":
        return ca.SX(numbers.pop() / 4 + 0.3)
    if isinstance(tree, int):
        return X[tree]
    operation, *operands = tree
    chosen = (UNARY if len(operands) == 1 else BINARY)[operation]
    return chosen(*(fill(operand, numbers) for operand in operands))


def value(column: list[ca.SX], symbols: ca.SX, at: np.ndarray) -> np.ndarray:
    return np.asarray(ca.Function("f", [symbols], [ca.vertcat(*column)])(at)).ravel()


@settings(max_examples=200)
@given(st.lists(TREES, min_size=1, max_size=3), st.lists(NUMBERS, min_size=2, max_size=4))
def test_what_is_alike_has_its_own_numbers(trees: list[Any], draws: list[list[int]]) -> None:
    """Whatever numbers coincide: with its constants the common expression is each of those that it
    stands for."""
    columns = []
    for numbers in draws:
        left = [float(n) for n in numbers]
        columns.append([fill(tree, left * 3) for tree in trees])
    groups: dict[object, list[int]] = {}
    forms = [Form(column, ROLES) for column in columns]
    for k, form in enumerate(forms):
        groups.setdefault(form.key(0, len(trees)), []).append(k)
    at = np.array([0.7, -0.4, 1.3])
    for members in groups.values():
        common, own, constants = generalise([forms[k] for k in members], "own")
        assert len(set(map(str, ca.vertsplit(own)))) == own.numel()
        for k, numbers_of in zip(members, constants, strict=True):
            found = value(common, ca.vertcat(X, own), np.concatenate([at, numbers_of]))
            np.testing.assert_allclose(found, value(columns[k], X, at), rtol=1e-12, atol=1e-12)


def test_numbers_that_are_equal_in_all_stay_numbers() -> None:
    forms = [Form([k * X[0] + 3.5 * X[1] + k * X[2]], ROLES) for k in (2.5, 4.5)]
    (common,), own, constants = generalise(forms, "own")
    assert own.numel() == 1
    assert constants == [(2.5,), (4.5,)]
    assert "3.5" in str(common)


def test_what_is_equal_is_so_in_its_numbers_too() -> None:
    """Those within a function, those in front, and where they stand."""
    x, y = X[0], X[1]
    forms = [Form([expression], ROLES) for expression in (
        ca.sin(2.5 * x) + y, ca.sin(3.5 * x) + y, 2 * ca.sin(2.5 * x) + y, ca.sin(2.5 * x) + 2 * y,
    )]  # fmt: skip
    assert len({form.key(0, 1) for form in forms}) == 1
    assert len({form.said(0, 1) for form in forms}) == 4
    assert Form([y + ca.sin(2.5 * x)], ROLES).said(0, 1) == forms[0].said(0, 1)


def test_numbers_that_nobody_wrote_count_too() -> None:
    """1, -1 and what stands behind a minus; a product has one number."""
    columns = (X[0] - X[1], 2.5 * X[0] + X[1], -X[0] - 3 * X[1], X[1] + 2 * (0.5 * X[0]))
    forms = [Form([4.0 * ca.sin(x), x * x], ROLES) for x in columns]
    assert len({form.key(0, 2) for form in forms}) == 1
    common, own, constants = generalise(forms, "own")
    assert own.numel() <= 3  # one more for the sign of a sum
    at = np.array([0.7, -0.4, 1.3])
    for x, numbers in zip(columns, constants, strict=True):
        found = value(common, ca.vertcat(X, own), np.concatenate([at, numbers]))
        np.testing.assert_allclose(found, value([4.0 * ca.sin(x), x * x], X, at), rtol=1e-14)


@pytest.mark.parametrize(
    "other",
    [
        2.5 * X[0] + 3.5 * X[2],
        2.5 * X[0] * X[1],
        ca.sin(2.5 * X[0]) + 3.5 * X[1],
        X[0] ** 3.3,
    ],
    ids=str,
)
def test_other_forms_are_told_apart(other: ca.SX) -> None:
    """Other operations, other symbols, and powers, whose derivatives depend on the number."""
    form = X[0] ** 2.3 if "pow" in str(other) else 4.5 * X[0] + 1.5 * X[1]
    assert Form([form], ROLES).key(0, 1) != Form([other], ROLES).key(0, 1)


def crates() -> sg.Model:
    """Crates of three sizes, masses and frictions, two of them equal."""
    m = sg.Model("crates", symbols="casadi")
    (mu,) = m.parameters(mu=0.4)
    world = Planar(m, gravity=(0, -9.81))
    start: dict[str, float] = {}
    for k, (mass, wide) in enumerate(((1.0, 0.4), (2.0, 0.5), (1.5, 0.7), (2.0, 0.5))):
        crate = world.body(f"b{k}", mass, inertia.rectangle(mass, wide, 0.3))
        for j, (x, y) in enumerate(((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))):
            corner = crate.point(wide * x, 0.3 * y)
            world.contact(
                f"b{k}_{j}", corner, world.plane(), mu=(0.5 + mass / 4) * mu, e_N=0.1 * mass
            )
        start |= {f"b{k}_x": 2.0 * k, f"b{k}_y": 0.3, f"b{k}_phi": 0.2 * k}
    m.initial_state(q=start)
    return m


def test_parts_that_differ_in_numbers_are_of_one_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their constants are the numbers of each; where there is little to share they stay apart."""
    apart = compose(freeze(crates()))
    assert apart.kind_of == (0, 1, 2, 1)
    assert set(apart.constants) == {()}
    monkeypatch.setattr(composition, "_WORTH", 0)
    found = compose(freeze(crates()))
    assert found.kind_of == (0, 0, 0, 0)
    assert found.drawn_alike
    assert found.constants[1] == found.constants[3]
    assert len(set(found.constants)) == 3
    assert 0 < found.kinds[0].own.numel() == len(found.constants[0])


def test_each_part_has_its_constants(
    monkeypatch: pytest.MonkeyPatch, stepper: Callable[..., sg.Stepper]
) -> None:
    """The crates move as crates whose numbers stand in their text."""
    plain = stepper(crates, 2, events="located")
    reference = plain.simulate(t_end=0.6, dt=2e-3, events="located")
    monkeypatch.setattr(composition, "_WORTH", 0)
    shared = sg.build(crates(), stages=2, events="located")
    assert {part["kind"] for part in shared.manifest["parts"]} == {0}
    traj = shared.simulate(t_end=0.6, dt=2e-3, events="located")
    np.testing.assert_allclose(traj.q, reference.q, atol=1e-9)
    assert len(traj.events) == len(reference.events) > 10


@pytest.mark.thorough
def test_functions_of_each_part_are_those_of_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(composition, "_WORTH", 0)
    assert sg.check(crates(), stages=[2]).passed
