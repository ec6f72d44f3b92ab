"""Conversion of lines of results.jsonl to and from JSON, and their JSON Schema.

A number that is NaN or infinite is written as null. Null is read as NaN if the field is a number. An enum is written as
its name in lower case.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from pydantic import (
    AllowInfNan,
    GetCoreSchemaHandler,
    PlainSerializer,
    PlainValidator,
    Strict,
    TypeAdapter,
    ValidationError,
    WithJsonSchema,
    WrapValidator,
)
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import CoreSchema, core_schema

from carom.comparator import Grade, LocalScore
from carom.comparator.grades import EARLIER_WORDS
from carom.errors import InputError
from carom.report.files import FORMATS
from carom.report.results_file.lines import RowLine, Summary
from carom.support.escaping import format_value, shorten

Line = TypeVar("Line", Summary, RowLine)

#: Fields of a score about spins, which are only written if a disc of the scene spins.
OF_SPINS = frozenset({"spin", "final_spin", "angular", "angular_excess", "arm"})

#: Names of fields that have another name in files of format 2.
_ALIASES: dict[str, list[list[str | int]]] = {
    "diverged_s": [["diverged_s"], ["parted_s"]],
    "pit_diverged_s": [["pit_diverged_s"], ["pit_parted_s"]],
}


def format_line(line: Summary | RowLine, *, spins: bool = True) -> str:
    """Return a line as strict JSON without a line break. If `spins` is true, the line has fields about spins."""
    leave_out = None if spins else {part: set(OF_SPINS) for part in ("total", "against_pit", "consistency")}
    kind: Any = type(line)  # `Any`, because mypy wrongly considers the class unhashable
    return _JSON(_build_type_adapter(kind).dump_python(line, mode="json", exclude=leave_out))


_JSON = json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode


def read_line(kind: type[Line], text: bytes, path: Path, number: int) -> Line:
    """Parse a line of a file. Fields that may be null may also be missing.

    Raises:
        InputError: The line is not JSON, or a field is missing or has a wrong type. The message names file, line and
            field.
    """
    try:
        return cast("Line", _build_type_adapter(cast("Any", kind)).validate_json(text))
    except ValidationError as error:
        raise _build_error(error, path, number) from None


def _build_error(error: ValidationError, path: Path, number: int) -> InputError:
    first = error.errors()[0]
    # Pydantic's location also contains names of types, which are not fields of the file.
    location = ".".join(str(part) for part in first["loc"] if not (isinstance(part, str) and not part.isidentifier()))
    message = first["msg"].removeprefix("Value error, ")
    problem = f"{shorten(location) or 'the line'}: {message}, got {format_value(first['input'])}"
    if first["type"] == "json_invalid":
        problem = f"invalid JSON ({first['ctx']['error']})"
    hints = ["`carom diff --schema` prints the schema of a line", "run the cross-check again"]
    return InputError(f"{path}, line {number}: {problem}", hints=hints)


def build_records_schema() -> dict[str, Any]:
    """Return the JSON Schema of a line, which is published as ``carom/results.schema.json``."""
    schema = TypeAdapter(_build_file_type(Summary | RowLine)).json_schema(
        mode="serialization", schema_generator=_Described
    )
    schema["$defs"]["Summary"]["properties"]["format"] = {"const": FORMATS["results"]}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"A line of Carom's results, format {FORMATS['results']}",
        **schema,
    }


class _Described(GenerateJsonSchema):
    """JSON Schema generator that gives fields no title, because a title would only repeat the field's name.

    Every number may be null, so a number that may be absent has the same schema as any other number. Fields with a
    default are also required, except those that a line may omit (`OF_SPINS`).
    """

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ARG002 - pydantic's signature
        return False

    def nullable_schema(self, schema: Any) -> dict[str, Any]:
        inner = self.generate_inner(schema["schema"])
        return inner if inner == _NULLABLE else super().nullable_schema(schema)

    def default_schema(self, schema: Any) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])

    def field_is_required(self, field: Any, total: bool) -> bool:  # noqa: ARG002 - pydantic's signature
        return field["name"] not in OF_SPINS


#: Properties that are written in addition to a class's fields, and ignored when a file is read.
_DERIVED: Mapping[type[Any], Mapping[str, Any]] = {LocalScore: {"grade": Grade}}


@cache
def _build_type_adapter(kind: type[Any]) -> TypeAdapter[Any]:
    return TypeAdapter(_build_file_type(kind))


def _build_file_type(hint: Any) -> Any:
    """Convert a Python type to the type of its value in JSON."""
    origin, parts = get_origin(hint), get_args(hint)
    if hint is float:
        return _NUMBER
    if hint in (int, str, bool):
        return Annotated[hint, Strict()]
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _build_enum_type(hint)
    if dataclasses.is_dataclass(hint):
        return Annotated[hint, _Fields()]
    if origin in (Union, UnionType):
        is_nullable = type(None) in parts  # if a field is nullable, null does not mean NaN
        kinds = tuple(_FINITE if is_nullable and part is float else _build_file_type(part) for part in parts)
        return Union[kinds]  # noqa: UP007 - the number of types varies
    if origin is tuple:
        return tuple[tuple(part if part is ... else _build_file_type(part) for part in parts)]  # type: ignore[misc] # made here
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return dict[parts[0], _build_file_type(parts[1])]  # type: ignore[misc, valid-type] # a type made here
    return hint


#: JSON Schema of a number that may be NaN, infinite or absent.
_NULLABLE = {"type": ["number", "null"], "description": "null: NaN, infinite or absent."}


_FINITE = Annotated[
    float,
    Strict(),
    AllowInfNan(allow_inf_nan=False),
    PlainSerializer(lambda value: value if math.isfinite(value) else None),
    WithJsonSchema(_NULLABLE),
]
_NUMBER = Annotated[_FINITE, WrapValidator(lambda value, read: math.nan if value is None else read(value))]


def _build_enum_type(kind: type[Enum]) -> Any:
    names = {member.name.lower(): member for member in kind}

    def read(name: object) -> Enum:
        present_name = EARLIER_WORDS.get(name, name) if isinstance(name, str) else None
        if present_name not in names:
            raise ValueError(f"must be one of {', '.join(names)}")
        return names[present_name]

    return Annotated[
        kind,
        PlainValidator(read),
        PlainSerializer(lambda member: member.name.lower()),
        WithJsonSchema({"enum": list(names)}),
    ]


@dataclass(frozen=True)
class _Fields:
    """Pydantic schema of a dataclass. Each field has the type of its value in JSON."""

    def __get_pydantic_core_schema__(self, kind: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        hints = get_type_hints(kind, include_extras=True)
        fields_by_name = {field.name: field for field in dataclasses.fields(kind)}
        fields = [
            core_schema.dataclass_field(
                name,
                _add_default(field, hints[name], handler(_build_file_type(hints[name]))),
                validation_alias=_ALIASES.get(name),
            )
            for name, field in fields_by_name.items()
        ]
        derived = [
            core_schema.computed_field(name, handler(_build_file_type(hint)))
            for name, hint in _DERIVED.get(kind, {}).items()
        ]
        arguments = core_schema.dataclass_args_schema(kind.__name__, fields, computed_fields=derived)
        return core_schema.dataclass_schema(
            kind, arguments, list(fields_by_name), ref=kind.__name__, frozen=True, slots="__slots__" in vars(kind)
        )


def _add_default(field: dataclasses.Field[Any], hint: Any, schema: CoreSchema) -> CoreSchema:
    """Add a default to the schema of a field that a line may lack."""
    if field.default_factory is not dataclasses.MISSING:
        return core_schema.with_default_schema(schema, default_factory=field.default_factory)
    if type(None) in get_args(hint):
        return core_schema.with_default_schema(schema, default=None)
    return core_schema.with_default_schema(schema, default=math.nan) if field.name in OF_SPINS else schema
