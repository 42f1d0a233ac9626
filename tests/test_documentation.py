"""Every Python block of README and documentation runs as it stands."""

import re
from pathlib import Path

import pytest
import signorini as sg
import sympy as sp

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.parametrize("page", ["README.md", "docs/bodies.md", "docs/seeing.md"])
def test_blocks_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (ROOT / page).read_text(encoding="utf-8")
    names: dict[str, object] = {"sg": sg, "sp": sp}
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) >= 2
    for block in blocks:
        if "sg.load(" in block:
            sg.generate(names["model"](), "ball_c")  # type: ignore[operator]
        exec(compile(block, page, "exec"), names)
    made = [names[n]() for n in ("model", "wheel") if n in names]  # type: ignore[operator]
    for model in made:
        u = [0.0] * len(model.input_names)
        traj = sg.build(model, stages=2).simulate(
            t_end=0.2, dt=1e-2, inputs=(lambda t, q, v, u=u: u) if u else None
        )
        assert len(traj.t) == 21


def test_collection_is_documented() -> None:
    """Table and picture of every shipped model."""
    from signorini.locate import shipped

    text = (ROOT / "docs" / "models.md").read_text(encoding="utf-8")
    for name in shipped():
        assert f"(../models/{name}.py)" in text, name
        assert (ROOT / "docs" / "pictures" / f"{name}.png").is_file(), name
