"""Link the source folders below build/typing/signorini, the layout that type checkers follow.

The package maps top-level folders to sub-packages, which mypy cannot see in an editable install.
"""

import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PARTS = (
    *("benchmarks", "bodies", "codegen", "models", "runtime", "stress", "studies", "templates"),
    "verify",
    "view",
)


def make_tree() -> Path:
    """Build the tree anew and return its root."""
    tree = ROOT / "build" / "typing"
    shutil.rmtree(tree, ignore_errors=True)
    package = tree / "signorini"
    package.mkdir(parents=True)
    for source in [*(ROOT / "api").iterdir(), *(ROOT / part for part in PARTS)]:
        if source.name != "__pycache__":
            (package / source.name).symlink_to(source)
    return tree


if __name__ == "__main__":
    make_tree()
