"""The files of a report: what they need, where they may go, JSON of any result, and writing all of them or none."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import math
import os
from collections.abc import Mapping
from enum import Enum
from pathlib import Path

from carom.errors import InputError, MissingExtraError

__all__ = ["FORMATS", "as_json", "plain", "require_report_extra", "require_writable", "write_files"]

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


def require_writable(folder: Path) -> None:
    """See to it, before minutes of work, that a report can be written there; nothing is made yet.

    Raises:
        MissingExtraError: jinja2 or matplotlib, the extra `report`, is not installed.
        InputError: The folder, or the nearest one above it that exists, is no folder or can't be written to.
    """
    require_report_extra()
    existing = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
    if not existing.is_dir():
        raise InputError(f"the report can't be written into {folder}: {existing} is not a folder")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(f"the report can't be written into {folder}: no permission to write in {existing}")


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


def write_files(folder: Path, contents: Mapping[str, str | bytes]) -> Path:
    """Write files into a folder, which is made where it does not exist, in place of older ones; return the first.

    Each is written beside its place first; only when all are on the disk are they renamed.

    Raises:
        OSError: The folder can't be written to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    whole: list[tuple[Path, Path]] = []
    try:
        for name, content in contents.items():
            part = folder / f".{name}.{os.getpid()}.part"
            whole.append((part, folder / name))
            part.write_bytes(content.encode() if isinstance(content, str) else content)
        for part, path in whole:
            part.replace(path)
    finally:
        for part, _ in whole:
            part.unlink(missing_ok=True)
    return whole[0][1]
