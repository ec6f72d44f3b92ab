"""JSON lines read back: each held to the very type that declares what is written, field by field."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from enum import Enum
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import AllowInfNan, ConfigDict, Field, TypeAdapter, ValidationError, create_model

from carom.comparator import Verdict
from carom.errors import InputError
from carom.limits import LARGEST, SMALLEST
from carom.report.records import OF_SPINS, read_records
from carom.report.records_schema import CellLine, HeadLine, Step
from carom.text import shortened

__all__ = ["checked_records"]

#: Spins are told only where discs turn; nothing was tried in place of a profile's settings before one could.
_MAY_BE_MISSING = OF_SPINS | {"tried"}

#: What is no finite number was written as null.
_Float = Annotated[float, AllowInfNan(allow_inf_nan=False)] | None


def checked_records(path: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return what `carom.report.records.records` wrote: the head, and the rows, all of the types declared.

    A field that may be null may be missing: an earlier Carom did not write it.

    Raises:
        InputError: The file can't be read, is of another format, not whole, or a field is of another type: the message
            names line and field.
    """
    head, rows = read_records(path)
    for number, line in enumerate((head, *rows), start=1):
        try:
            _reader(CellLine if number > 1 else HeadLine).validate_python(line)
        except ValidationError as error:
            first = error.errors()[0]
            # The kinds of a union that were tried are no fields of the file.
            where = ".".join(
                str(part) for part in first["loc"] if not (isinstance(part, str) and not part.isidentifier())
            )
            said = f"{first['msg']}, got {shortened(repr(first['input']))}"
            raise InputError(
                f"{path}, line {number}: {shortened(where) or 'the line'}: {said}; `carom diff --schema` says what a "
                "line holds; run the cross-check again"
            ) from None
    return head, rows


@cache
def _reader(kind: type[Any]) -> TypeAdapter[Any]:
    return TypeAdapter(_as_written(kind))


def _as_written(hint: Any) -> Any:
    """Return the type of what is written for a declared type, as `records_schema` describes it."""
    origin, parts = get_origin(hint), get_args(hint)
    if hint is float:
        return _Float
    if hint == Step:
        return Annotated[float, Field(ge=SMALLEST, le=LARGEST)]  # those that a run can have
    if hint is Verdict:
        return str  # the head says what each means: a file may have others than this Carom
    if isinstance(hint, type) and issubclass(hint, Enum):
        return Literal[tuple(member.name.lower() for member in hint)]
    if dataclasses.is_dataclass(hint):
        return _model(hint)
    if origin in (Union, UnionType):
        return Union[tuple(_as_written(part) for part in parts)]  # noqa: UP007 - of as many as there are
    if origin is tuple:
        return list[_as_written(parts[0])]  # type: ignore[misc] # a type made here
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return dict[str, _as_written(parts[1])]  # type: ignore[misc] # a type made here
    return hint


def _model(kind: Any) -> Any:
    fields: dict[str, Any] = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        written = _as_written(hint)
        absent = name in _MAY_BE_MISSING or type(None) in get_args(written)
        fields[name] = (written | None if absent else written, None if absent else ...)
    return create_model(kind.__name__, __config__=ConfigDict(strict=True, extra="ignore"), **fields)
