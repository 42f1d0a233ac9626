"""The documentation site: `sphinx-build docs site`."""

import importlib
import re
from pathlib import Path
from typing import Any

from signorini.version import __version__

project = "signorini"
author = "the signorini developers"
project_copyright = "the signorini developers"
release = version = __version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
    "cyclopts.sphinx_ext",
]
html_theme = "furo"
html_title = "signorini"
templates_path: list[str] = []
exclude_patterns = ["many_runs/README.md"]
myst_enable_extensions = ["html_image", "colon_fence", "deflist", "dollarmath", "amsmath"]
myst_heading_anchors = 3
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_mock_imports = [
    "jax",
    "torch",
]  # optional extras; their functions are described all the same
nitpicky = False
html_extra_path = ["extra"]


def write_gallery(_: Any) -> None:
    """A page for every shipped model: what moves, equations, number, source."""
    here = Path(__file__).parent
    folder = here / "gallery"
    folder.mkdir(exist_ok=True)
    table = (here / "models.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| \[(\w+)\]\(\S+\) \| (.*) \| (.*) \| (.*) \|$", table, re.MULTILINE)
    for name, seen, number, source in rows:
        model = importlib.import_module(f"signorini.models.{name}").model()
        page = here / "extra" / "moving" / f"{name}.html"
        shown = f"![{name}](../pictures/{name}.png)"
        if page.is_file():
            shown = (
                f'<iframe src="../moving/{name}.html" title="{name} moves" '
                'style="width:100%;height:42rem;border:1px solid #d8dde3" loading="lazy">'
                "</iframe>\n\n"
                f'<a href="../moving/{name}.html">The page alone</a>'
            )
        text = (
            f"# {name}\n\n{seen[0].upper()}{seen[1:]}.\n\n{shown}\n\n"
            f"The number that its test holds it to: {number} ({source}).\n\n"
            f"{model._repr_markdown_()}\n\n"
            f"```{{literalinclude}} ../../models/{name}.py\n:language: python\n```\n"
        )
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    listed = "\n".join(name for name, *_ in rows)
    pictures = "\n".join(
        f'<a href="{name}.html"><img src="../_images/{name}.png" width="32%" alt="{name}"></a>'
        for name, *_ in rows
    )
    (folder / "index.md").write_text(
        "# Gallery\n\nEvery shipped model: a motion to play with, its equations, the number "
        "that it is held to, its source.\n\n"
        f"```{{raw}} html\n{pictures}\n```\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n",
        encoding="utf-8",
    )


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("config-inited", lambda app, _: write_gallery(app))
