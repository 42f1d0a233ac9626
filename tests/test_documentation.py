"""Every Python block of README and documentation runs as it stands."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import signorini as sg
import sympy as sp

ROOT = Path(__file__).resolve().parent.parent


PAGES = [
    f"docs/{name}.md" for name in ("overview", "bodies", "laws", "seeing", "tutorial", "howto")
]


@pytest.mark.parametrize("page", PAGES)
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


@pytest.mark.thorough
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    """Every page is reached, every link and docstring is read; all public names have a place."""
    pytest.importorskip("sphinx", reason="pip install 'signorini[docs]'")
    result = subprocess.run(
        [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", ROOT / "docs", tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    for page in tmp_path.rglob("*.html"):
        for source in re.findall(r'<img[^>]* src="([^":]+)"', page.read_text(encoding="utf-8")):
            assert (page.parent / source).is_file(), f"{page.name} shows {source}"
    python = (tmp_path / "reference" / "python.html").read_text(encoding="utf-8")
    missing = [n for n in sg.__all__ if not n.startswith("_") and f"signorini.{n}" not in python]
    # Modules are documented under the name that they are defined with.
    assert [n for n in missing if f">{n}<" not in python] == []
    commands = (tmp_path / "reference" / "commands.html").read_text(encoding="utf-8")
    for name in ("run", "view", "new", "check", "generate", "doctor", "sweep", "stress"):
        assert f"signorini {name}" in commands


def test_links_between_pages_lead_somewhere() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    for page in pages:
        for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), (page.name, target)
