"""The browser that opens pages in tests."""

import shutil
from typing import Any

import pytest


def find_browser() -> tuple[Any, str]:
    """What drives a browser, and Chromium; the test is skipped where they are missing."""
    api = pytest.importorskip("playwright.sync_api", reason="pip install playwright")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("chromium is not installed: apt-get install chromium")
    return api.sync_playwright(), chromium
