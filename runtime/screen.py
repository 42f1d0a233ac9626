"""Where a page is shown: below a notebook's cell, or in the browser."""

import html
import sys
import tempfile
import webbrowser
from pathlib import Path
from typing import Any


def show_page(text: str, name: str) -> Any:
    """Show a page.

    Returns
    -------
    IPython.display.HTML in a notebook, else the path of the file that the browser was asked to open
    """
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    if shell is not None and "IPKernelApp" in shell.config:
        from IPython.display import HTML

        frame = html.escape(text, quote=True)
        return HTML(f'<iframe srcdoc="{frame}" style="width:100%;height:560px;border:0"></iframe>')
    folder = Path(tempfile.mkdtemp(prefix="signorini-"))
    target = folder / f"{name}.html"
    target.write_text(text, encoding="utf-8")
    webbrowser.open(target.as_uri())
    return target
