"""A page in the user's browser."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path


def open_page(page: Path) -> bool:
    """Ask a browser to open a page, given by its whole path; return whether one was asked."""
    return has_display() and webbrowser.open(page.as_uri())


def has_display() -> bool:
    """Whether there is a screen to open a browser on; a text browser would take the terminal."""
    if sys.platform in {"win32", "darwin"}:
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
