"""Functions of higher packages that lower packages call.

The package `carom` sets these functions when `carom` is imported.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

#: Returns the scene of the catalogue with a given full name.
find_scene: Callable[[str], Any]

#: Returns a function that shows a result, such as ``summary`` or ``plot``.
find_view: Callable[[str], Callable[..., Any]]
