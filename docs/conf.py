"""The documentation site: `sphinx-build docs site`."""

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
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "amsmath"]
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
