"""Long functions are written in pieces: the same statements, the same bits."""

import re
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from compilers import STRICT, compiler, run
from signorini.codegen.c import pieces
from signorini.codegen.c.build import emit_spec
from signorini.codegen.c.emit import render
from signorini.codegen.frontend.validate import freeze
from trap_models import mixed_contacts


def test_a_function_in_pieces_computes_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every statement once, in its order; what a later piece needs is handed on."""
    data = freeze(mixed_contacts())
    whole = emit_spec(data, stages=2)
    monkeypatch.setattr(pieces, "LONGEST", 40)
    monkeypatch.setattr(pieces, "_PIECE", 12)
    cut = emit_spec(data, stages=2)
    before = {f.name: f for f in whole.kinds[0].helpers}
    after = {f.name: f for f in cut.kinds[0].helpers}
    assert set(before) < set(after)
    divided = [name for name in before if f"{name}_1" in after]
    assert len(divided) >= 3
    for name in divided:
        count = sum(bool(re.fullmatch(rf"{name}_\d+", other)) for other in after)
        own = [after[f"{name}_{k + 1}"] for k in range(count)]
        statements = [
            line
            for piece in own
            for section in piece.sections
            for line in section.lines
            if not re.match(r"terms_between\[\d+\] = \w+;$", line)
        ]
        f = before[name]
        assert statements == [*f.temporaries, *(line for s in f.sections for line in s.lines)]
    assert any("terms_between[" in alias for f in after.values() for alias in f.aliases)
    sg.generate(mixed_contacts(), tmp_path / "whole", stages=2)
    folder = tmp_path / "cut"
    folder.mkdir()
    for file, text in render(cut).items():
        (folder / file).write_text(text)
    for name in ("gcc", "clang"):
        run(compiler(name), *STRICT, "-c", "mixed_contacts.c", cwd=folder)
    one, other = (sg.load(tmp_path / name) for name in ("whole", "cut"))
    runs = [s.simulate(t_end=0.2, dt=1e-2) for s in (one, other)]
    np.testing.assert_array_equal(runs[0].q, runs[1].q)
    np.testing.assert_array_equal(runs[0].P_F, runs[1].P_F)
