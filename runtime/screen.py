"""Where a page is shown: below a notebook's cell, or in the browser."""

import html
import sys
import tempfile
import webbrowser
from pathlib import Path
from typing import Any


class InCell:
    """A page that a notebook shows below the cell."""

    def __init__(self, text: str) -> None:
        self._text = text

    def _repr_html_(self) -> str:
        page = html.escape(self._text, quote=True)
        return f'<iframe srcdoc="{page}" style="width:100%;height:560px;border:0"></iframe>'


def show_page(text: str, name: str) -> Any:
    """Show a page.

    Returns
    -------
    InCell in a notebook, else the path of the file that the browser was asked to open
    """
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    if shell is not None and "IPKernelApp" in shell.config:
        return InCell(text)
    folder = Path(tempfile.mkdtemp(prefix="signorini-"))
    target = folder / f"{name}.html"
    target.write_text(text, encoding="utf-8")
    if not webbrowser.open(target.as_uri()):
        sys.stderr.write(f"note: no browser could be opened; the page is {target}\n")
    return target
