"""The optional dependencies of a written report, the extra `report`."""

from __future__ import annotations

import importlib.util

from carom.errors import MissingExtraError

__all__ = ["require_report_extra"]


def require_report_extra() -> None:
    """See to it that jinja2 and matplotlib are there.

    Raises:
        MissingExtraError: One of them is not installed.
    """
    for module in ("jinja2", "matplotlib"):
        if importlib.util.find_spec(module) is None:
            raise MissingExtraError(f"a report needs {module}, which is not installed: pip install 'carom[report]'")
