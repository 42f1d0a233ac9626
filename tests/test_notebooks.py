"""The notebooks run from top to bottom, and show something."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


@pytest.mark.thorough
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run(path: Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    book = nbformat.read(path, as_version=4)
    assert all(not cell.get("outputs") for cell in book.cells)  # kept without results
    nbclient.NotebookClient(book, timeout=300, kernel_name="python3").execute()
    kinds = {
        kind
        for cell in book.cells
        for output in cell.get("outputs", [])
        for kind in output.get("data", {})
    }
    assert "image/png" in kinds
    words = [o for cell in book.cells for o in cell.get("outputs", []) if o.get("name") == "stderr"]
    assert not words


def test_there_are_notebooks() -> None:
    assert {"first_model", "contact_data", "identification"} <= {path.stem for path in NOTEBOOKS}
