"""How results show themselves: the report does it, found by name when it is asked, so that nothing here imports it."""

from __future__ import annotations

import importlib
from typing import Any

__all__ = ["Shown"]


def _report(module: str) -> Any:
    return importlib.import_module(f"carom.report.{module}")


class Shown:
    """A result that is shown in a few lines. A dataclass of its kind is declared with ``repr=False``."""

    def __repr__(self) -> str:
        text: str = _report("summary").summary(self)
        return text

    def __str__(self) -> str:
        return repr(self)
