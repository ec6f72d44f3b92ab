"""Helpers for the files of reports: format versions, required packages, and conversion of results to JSON."""

from __future__ import annotations

import base64
import dataclasses
import gzip
import importlib.util
import json
import math
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import TYPE_CHECKING

from carom.errors import MissingExtraError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

#: Format version of each kind of file. A version increases if a field is removed or changes its meaning, but not if a
#: field is added.
FORMATS = {"results": 3, "bench": 1, "growth": 2, "stress": 4}


def find_missing_package() -> str | None:
    """Return the name of jinja2 or matplotlib if it is not installed; None if both are installed."""
    return next((name for name in ("jinja2", "matplotlib") if importlib.util.find_spec(name) is None), None)


def require_report_extra() -> None:
    """Raise an error if jinja2 or matplotlib is not installed.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
    """
    if name := find_missing_package():
        raise MissingExtraError(f"a report needs {name}, which is not installed", hints=["pip install 'carom[report]'"])


def pack_data(data: object) -> str:
    """Pack data as text for the script of a page: JSON that is compressed with gzip and encoded as base64."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()


def to_json_types(value: object) -> object:
    """Convert a result to JSON types. An enum becomes its name, and a number that is not finite becomes null."""
    if isinstance(value, Enum):
        return value.name.lower()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {name: to_json_types(item) for name, item in fields_of(value).items()}
    if isinstance(value, Mapping):
        return {str(key): to_json_types(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_json_types(item) for item in value]
    number = value.item() if hasattr(value, "item") else value  # convert a NumPy scalar
    return None if isinstance(number, float) and not math.isfinite(number) else number


def fields_of(result: DataclassInstance) -> dict[str, object]:
    """Return the fields of a result by name, without converting their values."""
    return {field.name: getattr(result, field.name) for field in dataclasses.fields(result)}


def format_json(kind: str, result: DataclassInstance, leave_out: Sequence[str] = (), **content: object) -> str:
    """Return the text of a strict JSON file.

    The file contains `content`, and the fields of a result except those in `leave_out`.
    """
    result_fields = {name: value for name, value in fields_of(result).items() if name not in leave_out}
    fields = to_json_types({"format": FORMATS[kind], **result_fields, **content})
    return json.dumps(fields, ensure_ascii=False, allow_nan=False, indent=1) + "\n"
