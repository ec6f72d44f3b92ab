"""The page as one file."""

from __future__ import annotations

from pathlib import Path

__all__ = ["SOURCES"]

SOURCES = Path(__file__).parent
