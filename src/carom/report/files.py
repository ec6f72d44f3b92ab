"""The files of a report: what they need, and JSON of any result."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import math
from collections.abc import Mapping
from enum import Enum

from carom.errors import MissingExtraError

__all__ = ["FORMATS", "as_json", "plain", "require_report_extra"]

#: By kind of file. Raised when a field changes its meaning or goes; a new field does not raise it.
FORMATS = {"results": 2, "bench": 1, "growth": 1, "stress": 1}


def require_report_extra() -> None:
    """See to it that jinja2 and matplotlib are there.

    Raises:
        MissingExtraError: One of them is not installed.
    """
    for module in ("jinja2", "matplotlib"):
        if importlib.util.find_spec(module) is None:
            raise MissingExtraError(f"a report needs {module}, which is not installed: pip install 'carom[report]'")


def plain(value: object) -> object:
    """Return a result as JSON has it: objects and lists, an enum by its name, null for what is no finite number."""
    if isinstance(value, Enum):
        return value.name.lower()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    number = value.item() if hasattr(value, "item") else value  # of NumPy
    return None if isinstance(number, float) and not math.isfinite(number) else number


def as_json(kind: str, **content: object) -> str:
    """Return a file of strict JSON of a kind that has a format."""
    fields = plain({"format": FORMATS[kind], **content})
    return json.dumps(fields, ensure_ascii=False, allow_nan=False, indent=1) + "\n"
