"""Opens a page in the user's browser."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path


def open_page(page: Path) -> bool:
    """Open the page at an absolute path in a browser. Return False if no browser was found."""
    return has_display() and webbrowser.open(page.as_uri())


def has_display() -> bool:
    """Return whether there is a graphical display.

    Without a graphical display, Python might start a text browser in the terminal.
    """
    if sys.platform in {"win32", "darwin"}:
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
