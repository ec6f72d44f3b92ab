"""Types of a scene's fields, and the base class of scenes and their parts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Annotated, Any, ClassVar

from pydantic import (
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    SerializerFunctionWrapHandler,
    ValidationError,
    WithJsonSchema,
    model_serializer,
)
from pydantic_core import ErrorDetails, core_schema

from carom.errors import Problem, SceneError
from carom.support.escaping import format_value
from carom.support.formatting import format_number
from carom.support.limits import LARGEST, ORDINARY, SMALLEST, format_limits


def _to_plain(value: object) -> object:
    """Convert a NumPy scalar or array to a plain number or list. Return other values unchanged."""
    tolist = getattr(value, "tolist", None)
    return tolist() if callable(tolist) else value


def _parse_infinity(value: object) -> object:
    return math.inf if value == "inf" else _to_plain(value)


def _check_mass(mass: float) -> float:
    if LARGEST < mass < math.inf:
        raise ValueError(format_limits(SMALLEST, LARGEST))
    return mass


def _check_inertia(factor: float) -> float:
    if not (1.0 / ORDINARY <= factor <= 1.0 or factor == math.inf):
        span = f"from {format_number(1.0 / ORDINARY, 3)} to 1, where all mass is in the rim"
        raise ValueError(f'must be {span}, or "inf" for a disc that cannot turn')
    return factor


def _normalise_vector(vector: tuple[float, float]) -> tuple[float, float]:
    x, y = vector
    if vector == (0.0, 0.0):
        raise ValueError("must not be of length zero")
    # A unit vector must stay unchanged, so that a saved wall equals the loaded wall. Because of rounding, the length of
    # a unit vector differs from 1 by at most 3 * 2^-53. The computation of the length rounds again.
    if abs(math.hypot(x, y) - 1.0) <= 6 * 2.0**-53:
        return vector
    # The computed length of a very small or very large vector could underflow or overflow. So the vector is first
    # divided by its larger component.
    largest = max(abs(x), abs(y))
    x, y = x / largest, y / largest
    length = math.hypot(x, y)
    return (x / length, y / length)


class CoreSchema:
    """Annotation that contains a type's schema. Pydantic takes long to derive a schema from other annotations."""

    def __init__(self, schema: core_schema.CoreSchema) -> None:
        self._schema = schema

    def __get_pydantic_core_schema__(self, _kind: Any, _handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return self._schema


def _build_number_schema(lower: float | None = None, upper: float | None = None) -> core_schema.CoreSchema:
    number = core_schema.float_schema(strict=True, ge=lower, le=upper, allow_inf_nan=False)
    return core_schema.no_info_before_validator_function(_to_plain, number)


def _build_vector_schema(number: core_schema.CoreSchema) -> core_schema.CoreSchema:
    return core_schema.no_info_before_validator_function(_to_plain, core_schema.tuple_schema([number, number]))


def _build_schema_with_infinity(check: Callable[[float], float], lower: float | None = None) -> core_schema.CoreSchema:
    """Return the schema of numbers that can be infinite. JSON has no infinity, so files contain the string "inf"."""

    def write(value: float) -> float | str:
        return "inf" if math.isinf(value) else value

    number = core_schema.float_schema(strict=True, ge=lower, allow_inf_nan=True)
    as_text = core_schema.plain_serializer_function_ser_schema(write, when_used="json")
    parsed = core_schema.no_info_before_validator_function(_parse_infinity, number)
    return core_schema.no_info_after_validator_function(check, parsed, serialization=as_text)


Number = Annotated[float, CoreSchema(_build_number_schema(-LARGEST, LARGEST))]
Vector = Annotated[tuple[float, float], CoreSchema(_build_vector_schema(_build_number_schema(-LARGEST, LARGEST)))]
Positive = Annotated[float, CoreSchema(_build_number_schema(SMALLEST, LARGEST))]
Coefficient = Annotated[float, CoreSchema(_build_number_schema(0, 1))]
NonNegative = Annotated[float, CoreSchema(_build_number_schema(0, LARGEST))]
SignedCoefficient = Annotated[float, CoreSchema(_build_number_schema(-1, 1))]
Mass = Annotated[
    float,
    CoreSchema(_build_schema_with_infinity(_check_mass, SMALLEST)),
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": SMALLEST, "maximum": LARGEST}, {"const": "inf"}]}),
]
Inertia = Annotated[
    float,
    CoreSchema(_build_schema_with_infinity(_check_inertia)),
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": 1.0 / ORDINARY, "maximum": 1}, {"const": "inf"}]}),
]
_PAIR = _build_vector_schema(_build_number_schema())
Direction = Annotated[
    tuple[float, float], CoreSchema(core_schema.no_info_after_validator_function(_normalise_vector, _PAIR))
]


class Model(BaseModel):
    """Base class of scenes and their parts. Instances are immutable, and invalid fields raise a `SceneError`."""

    #: Names of fields that are left out of files and hashes if they have their default values.
    left_out: ClassVar[tuple[str, ...]] = ()

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="strings")

    def __init__(self, /, **data: Any) -> None:  # a file may have a field called "self"
        try:
            super().__init__(**data)
        except ValidationError as error:
            items = error.errors(include_url=False)
            has_more = any(getattr(item.get("ctx", {}).get("error"), "more", False) for item in items)
            raise SceneError([*_list_problems(items)], more=has_more) from None

    @model_serializer(mode="wrap")
    def _drop_defaults(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields: dict[str, Any] = handler(self)
        for name in self.left_out:
            if getattr(self, name) == type(self).model_fields[name].default:
                fields.pop(name, None)
        return fields


def _list_problems(items: Iterable[ErrorDetails]) -> Iterator[Problem]:
    for item in items:
        location = tuple(item["loc"])
        cause = item.get("ctx", {}).get("error")
        if isinstance(cause, SceneError):  # an error of a scene's part: add the location of the part
            for problem in cause.problems:
                yield problem._replace(field=location + problem.field)
            continue
        match item["type"]:
            case "extra_forbidden":
                yield Problem(location, "is not a field of a scene", ("see `carom scenes --schema`",))
            case "too_long" | "too_short":
                yield Problem(location, f"must hold two numbers, got {format_value(item['input'])}")
            case "greater_than_equal" if item["ctx"]["ge"] == SMALLEST and not item["input"] > 0:
                yield Problem(location, f"must be greater than 0, got {format_value(item['input'])}")
            case "greater_than_equal" if item["ctx"]["ge"] == SMALLEST:
                yield Problem(location, f"{format_limits(SMALLEST, LARGEST)}, got {format_value(item['input'])}")
            case "greater_than_equal" | "less_than_equal" if LARGEST in map(abs, item["ctx"].values()):
                yield Problem(location, f"{format_limits(0.0, LARGEST)}, got {format_value(item['input'])}")
            case _:
                yield Problem(location, describe_error(item))


def describe_error(item: ErrorDetails) -> str:
    """Return a message in plain words for an error of Pydantic about a value."""
    match item["type"]:
        case "missing":
            return "is required, but missing"
        case "extra_forbidden":
            return "is not known"
        case "tuple_type" | "list_type":
            return f"must be a list, got {format_value(item['input'])}"
    message = item["msg"]
    for prefix in ("Value error, ", "Input should ", "String should "):
        message = message.removeprefix(prefix)
    if item["type"] == "value_error" and not message.startswith("must"):  # the message is already a complete sentence
        return message
    message = message if message.startswith("must") else f"must {message}"
    return f"{message}, got {format_value(item['input'])}"
