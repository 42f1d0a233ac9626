"""Every study at reduced size meets its claims; claims that are wrong are told."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command import signorini
from signorini.codegen.frontend.errors import GenerationError
from signorini.studies import (
    figures,
    invariants,
    law_orders,
    limits,
    located,
    located_orders,
    paper,
    reproduce,
    tolerances,
)
from signorini.studies.claims import Claim, markdown, near

Ink = Callable[[Path], tuple[float, float, float, int]]

REDUCED = {
    "fig3": lambda: paper.fig3(stages=(2, 3)),
    "fig4": lambda: paper.fig4(stages=(2, 3)),
    "fig6": lambda: paper.fig6(stages=(2,), t_end=0.05),
    "fig8": paper.fig8,
    "fig9": lambda: paper.fig9(stages=(2, 3, 4), halvings=8, finest=4e-4),
    "orders": lambda: limits.orders(stages=(2, 3), counts=(20, 40, 80)),
    "full order": lambda: limits.full_order(stages=(2, 3)),
    "lost impacts": lambda: limits.lost_impacts(stages=(2, 4), phases=100),
    "bilateral": lambda: limits.bilateral(stages=(3,)),
    "energy": lambda: invariants.energy(steps=20_000),
    "reversibility": invariants.reversibility,
    "work": lambda: invariants.work_precision(stages=(2, 3), halvings=3),
    "moreau": lambda: invariants.second_scheme(halvings=5),
    "high orders": lambda: invariants.high_orders(stages=(6,)),
    "located orders": lambda: located_orders.orders(
        scenes=located_orders.SCENES[:2], stages=(2, 3, 5)
    ),
    "law orders": lambda: law_orders.orders(
        scenes=tuple(s for s in law_orders.SCENES if s.text in ("pressed by a contact", "one way"))
    ),
    "located": lambda: located.located(bounces=1000, frequencies=19),
    "tolerances": lambda: tolerances.wishes(
        scenes={"conveyor_oscillator": 10.5}, asked=(1e-4, 1e-6), stages=(3,), steps=1000
    ),
}


LONG = {"full order", "located orders", "law orders", "located", "tolerances"}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.thorough) if n in LONG else n for n in REDUCED]
)
def test_study(name: str, tmp_path: Path, ink: Ink) -> None:
    study = REDUCED[name]()
    assert study.name == name
    assert study.claims or name == "work"
    assert [f"{c.study}: {c.text}: {c.numbers}" for c in study.claims if not c.met] == []
    for path in figures.draw(study, tmp_path):
        if path.suffix == ".pdf":
            assert path.read_bytes().startswith(b"%PDF")
            continue
        share, wide, high, colours = ink(path)
        assert 0.002 < share < 0.6, path
        assert min(wide, high) > 0.5, path
        assert colours >= 2, path


def test_every_study_has_its_test() -> None:
    assert set(REDUCED) == set(reproduce.STUDIES) == set(figures.FIGURES)


def test_a_wrong_stepper_misses_its_claims(monkeypatch: pytest.MonkeyPatch) -> None:
    """Verdicts come from data: with another friction coefficient claims of case 2 are missed."""
    original = paper.stepper("ball", 3).simulate

    def other(**arguments: object) -> object:
        arguments["parameters"] = {**arguments["parameters"], "mu": 0.24}  # type: ignore[dict-item]
        return original(**arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(paper.stepper("ball", 3), "simulate", other)
    missed = [c for c in paper.fig4(stages=(3,)).claims if not c.met]
    assert any("slip-stick" in c.text for c in missed)


def test_claims() -> None:
    assert Claim("s", "t", 1.0, "<=", 1.0).met
    assert not Claim("s", "t", math.nan, "<=", 1.0).met
    assert not Claim("s", "t", math.nan, ">=", 1.0).met
    assert not near("s", "t", 2.0, 1.0, 0.5).met
    table = markdown([near("s", "a | b", 2.0, 1.0, 0.5)])
    assert "**missed**" in table
    assert "a \\| b" in table


def test_sliding_reference_is_converged() -> None:
    assert np.abs(limits.slid(0.8, 500) - limits.slid(0.8, 1000)).max() < 1e-9


def test_command(tmp_path: Path) -> None:
    result = signorini(tmp_path, "reproduce", "fig8", "bilateral", "--out", "o")
    assert result.returncode == 0, result.stdout + result.stderr
    assert "10 of 10 claims met" in result.stdout
    assert (tmp_path / "o" / "fig8.pdf").is_file()
    result_file = json.loads((tmp_path / "o" / "results.json").read_text())
    assert all(row["met"] for row in result_file["claims"])
    assert result_file["machine"]["compiler"]
    with pytest.raises(GenerationError, match="no study 'fig5'"):
        reproduce.chosen(("fig5",))


@pytest.mark.slow
def test_full_size(tmp_path: Path) -> None:
    """Every claim of every study at full size."""
    claims = reproduce.reproduce(("all",), tmp_path, lambda text: None)
    assert [f"{c.study}: {c.text}: {c.numbers}" for c in claims if not c.met] == []
    assert len(list(tmp_path.glob("*.pdf"))) == len(reproduce.STUDIES)
