"""Opens a page in the user's browser."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path


def open_page(page: Path) -> bool:
    """Open a page, given by its absolute path, in a browser; return whether a browser was found."""
    return has_display() and webbrowser.open(page.as_uri())


def has_display() -> bool:
    """Whether there is a display for a browser. A text browser would block the terminal."""
    if sys.platform in {"win32", "darwin"}:
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
