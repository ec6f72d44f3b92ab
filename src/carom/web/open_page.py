"""Opens a page in the user's browser."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path


def open_page(page: Path) -> bool:
    """Open the page at an absolute path in a browser. Return False if no browser was found."""
    return _has_browser() and webbrowser.open(page.as_uri())


def _has_browser() -> bool:
    """Return whether there is a graphical display, or the user has named a browser in the variable BROWSER.

    Without either, Python might start a text browser in the terminal. Remote editors set the variable to a program that
    opens pages on the user's own machine, which needs no display here.
    """
    if sys.platform in {"win32", "darwin"}:
        return True
    return any(os.environ.get(name) for name in ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY"))
