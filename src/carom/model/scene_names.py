"""Finds scenes of the catalogue by name.

`carom.model` can't import the catalogue, so `carom` registers the function that finds scenes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_find: Callable[[str], Any]


def set_scene_finder(find: Callable[[str], Any]) -> None:
    """Register the function that returns the scene with a given full name."""
    global _find  # noqa: PLW0603 - set once, by the package when it is imported
    _find = find


def find_scene(name: str) -> Any:
    """Return the scene of the catalogue with a given full name.

    Raises:
        UnknownNameError: The catalogue has no scene of this name. The message contains the nearest name.
    """
    return _find(name)
