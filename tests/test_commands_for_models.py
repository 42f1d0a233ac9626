"""show, picture, gallery, growth: what they print and write, and what they refuse."""

import json
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from command import signorini
from signorini.codegen.derive.magnitude import magnitude
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.frontend.sx_to_sympy import to_sympy
from signorini.codegen.frontend.validate import freeze
from signorini.models import slope
from signorini.show import derived, latex
from signorini.studies import growth
from trap_models import forms, mixed_contacts, rheonomic

Ink = Callable[[Path], tuple[float, float, float, int]]


@pytest.mark.parametrize("make", [forms, mixed_contacts, rheonomic])
def test_shown_expressions_are_the_derived_ones(make: object) -> None:
    """Back in SymPy every expression has the value of its SX."""
    data = freeze(make())  # type: ignore[operator]
    derivation = Derivation(data)
    rng = np.random.default_rng(0)
    for name in ("L", "p_v", "L_q", "f", "W_N", "W_F", "chi_F", "guard", "bound"):
        expr = derivation[name]
        if not expr.numel():
            continue
        symbols = ca.symvar(expr)
        values = rng.uniform(0.2, 0.9, len(symbols))
        function = ca.Function("f", symbols, [ca.densify(expr)])
        exact = np.asarray(function.call(list(values))[0])
        shown = to_sympy(expr)
        there = {sp.Symbol(s.name(), real=True): v for s, v in zip(symbols, values, strict=True)}
        mine = np.array(shown.subs(there).evalf().tolist(), dtype=float)
        assert mine == pytest.approx(exact.reshape(mine.shape), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("make", [forms, mixed_contacts, rheonomic])
def test_magnitude_bounds_every_value(make: object) -> None:
    """Terms add up to no less than the sum; without differences they are the sum."""
    derivation = Derivation(freeze(make()))  # type: ignore[operator]
    for name in ("L_q", "f", "g_N"):
        expr = ca.densify(derivation[name])
        size = magnitude(expr)
        f = ca.Function("f", ca.symvar(ca.vertcat(expr, size)), [expr, size])
        rng = np.random.default_rng(0)
        for _ in range(20):
            value, bound = (np.asarray(x) for x in f.call(list(rng.uniform(-2, 2, f.n_in()))))
            assert np.all(np.abs(value) <= bound * (1 + 1e-14))
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    terms = ca.Function("terms", [x, y], [magnitude(3 * x - x * (y - 2) / (y - 1) + ca.sin(x - y))])
    # |3x| + |x| (|y| + 2) / |y - 1| + |sin(x - y)|
    assert float(terms(-1.0, 4.0)) == pytest.approx(3 + 6 / 3 + abs(np.sin(-5.0)))


def test_show(tmp_path: Path) -> None:
    result = signorini(tmp_path, "show", "slope")
    assert result.returncode == 0, result.stderr
    slip = "gamma_F = x_dot/sqrt(1 + exp(-2*x)) - y_dot*exp(-x)/sqrt(1 + exp(-2*x))"
    assert slip in result.stdout
    assert "W_F" in result.stdout
    one = signorini(tmp_path, "show", "slope", "--quantity", "g_N_q", "--latex")
    assert one.stdout.startswith("\\begin{align*}")
    assert "\\dot{x}" in latex(derived(slope.model()))
    wrong = signorini(tmp_path, "show", "slope", "--quantity", "nothing")
    assert wrong.returncode == 1
    assert "no such derived function" in wrong.stderr


def test_pictures(tmp_path: Path, ink: Ink) -> None:
    result = signorini(tmp_path, "picture", "rocking_block", "--out", "p.png")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    assert signorini(tmp_path, "gallery", "slope", "--out", "g").returncode == 0
    for path in (tmp_path / "p.png", tmp_path / "g" / "slope.png"):
        share, wide, high, colours = ink(path)
        assert 0.005 < share < 0.6, path
        assert min(wide, high) > 0.4, path
        assert colours >= 3, path  # poses from early to late
    wrong = signorini(tmp_path, "picture", "slope", "--out", "p.txt")
    assert wrong.returncode == 1
    assert ".png" in wrong.stderr


def test_growth(tmp_path: Path, ink: Ink) -> None:
    """The small end of the study: sizes as declared, files written, slopes of power laws found."""
    sizes = [growth.measure("boxes", n) for n in (1, 2)]
    assert [(s.n_q, s.contacts) for s in sizes] == [(3, 4), (6, 8)]
    assert all(s.compile_s > 0 and s.step_us > 0 for s in sizes)
    powers = [
        growth.Size("boxes", n, 3 * n, 4 * n, n, n, n**2.0, n**3.0, 5 * n**0.5, 7.0 * n)
        for n in (2, 4, 8)
    ]
    found = growth.exponents(powers)["boxes"]
    assert list(found.values()) == pytest.approx([1, 1, 2, 3, 0.5])
    growth.save(powers, tmp_path)
    assert json.loads((tmp_path / "growth.json").read_text())["sizes"][0]["count"] == 2
    assert "| boxes | 8 | 24 | 32 |" in (tmp_path / "growth.md").read_text()
    share, wide, high, colours = ink(tmp_path / "growth.png")
    assert 0.005 < share < 0.5
    assert min(wide, high) > 0.6
    assert colours >= 2
