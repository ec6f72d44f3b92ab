"""Declarations of options: type, default, bounds and help text, for the Python API and for the command line.

The options of a study (a command that runs many scenes) are a frozen dataclass. Each field is declared by
`declare_option`. Python and the command line reject an invalid value with the same message, except for the option's
name. This module imports neither NumPy nor Pydantic, so that `carom --help` is fast.
"""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import StrEnum
from functools import partial
from numbers import Real
from typing import Any, ClassVar, NamedTuple, Self

from carom.errors import InputError
from carom.support.escaping import build_name_hints, format_value
from carom.support.formatting import format_number
from carom.support.limits import LARGEST, LONGEST_S, MOST_MB, SMALLEST


class ValueKind(NamedTuple):
    """Kind of an option's values.

    Attributes:
        requirement: Text after "must be" in error messages, such as "a positive number".
        word: Word for the type in `--help`, such as NUMBER; empty for a flag.
        convert: Converts a value, from Python or from `parse`, to the form that a study uses. Raises TypeError,
            ValueError or OverflowError for an invalid value.
        parse: Converts a text of the command line to a value for `convert`. If the text contains several items of a
            list, the result is a tuple.
        gather: Converts all texts of a repeated command-line option to one value.
        range: Short description of the allowed values for `--help`; empty if `word` is enough.
    """

    requirement: str
    word: str
    convert: Callable[[Any], Any]
    parse: Callable[[str], Any] = lambda text: text
    gather: Callable[[Sequence[str]], Any] | None = None
    range: str = ""

    def build_error(self, name: str, value: Any) -> InputError:
        """Return the error for an invalid value of an option."""
        return InputError(f"{name} must be {self.requirement}, got {format_value(value)}")


def check_value(kind: ValueKind, name: str, value: Any) -> Any:
    """Check a value, and convert it to the form that a study uses.

    Raises:
        InputError: The value is invalid. The message contains the option's name and the requirement.
    """
    try:
        return kind.convert(value)
    except (TypeError, ValueError, OverflowError):
        raise kind.build_error(name, value) from None


class Option(NamedTuple):
    """One option.

    Attributes:
        kind: Kind of the option's value or, for a list, of each item.
        what: Description for `--help`.
        flags: Names on the command line, beginning with the name that is displayed; empty for an option that exists
            only in Python.
        many: Whether the option is a list.
        default: Description of the default for `--help`. If the description is empty, `--help` shows the default's
            value.
    """

    kind: ValueKind
    what: str
    flags: tuple[str, ...]
    many: bool
    default: str


def declare_option(
    default: Any, kind: ValueKind, description: str, *flags: str, many: bool = False, default_text: str = ""
) -> Any:
    """Declare a field of a study's options. If the default is None, `default_text` describes it for `--help`."""
    return dataclasses.field(default=default, metadata={"option": Option(kind, description, flags, many, default_text)})


def list_declared_options(options: type[DeclaredOptions] | DeclaredOptions) -> dict[str, Option]:
    """Return the options of a study by name."""
    return {field.name: field.metadata["option"] for field in dataclasses.fields(options)}


class DeclaredOptions:
    """Base class of a study's options: a frozen dataclass whose fields are declared by `declare_option`.

    Raises:
        InputError: A value is invalid; the message names the field and the value.
    """

    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]
    #: Names of options that affect results, but are not part of a result's key in the journal (file of finished
    #: results). A journal can be resumed only if the values of these options are unchanged.
    fixed_on_resume: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is not None or field.default is not None:
                object.__setattr__(self, field.name, _check_option(field.metadata["option"], field.name, value))

    @classmethod
    def parse_command_line(cls, texts: Mapping[str, Any], *, before: str = "--") -> Self:
        """Parse options of a command line.

        Args:
            texts: Text or list of texts of each option, by the field's name. An option that was not given is None or an
                empty list.
            before: Prefix of option names in messages. The pytest plug-in uses another prefix than ``--``.

        Raises:
            InputError: A value is invalid. The message contains the option's name on the command line.
        """
        values = {}
        for field_name, option in list_declared_options(cls).items():
            if (text := texts.get(field_name)) is not None and text != []:
                flag = option.flags[0].partition("/")[0].replace("--", before, 1)
                values[field_name] = _parse_text(option, flag, text)
        return cls(**values)

    @classmethod
    def build_from_arguments(cls, function: str, options: Mapping[str, Any], **fixed: Any) -> Self:
        """Build options from a function's keyword arguments.

        `fixed` contains options that callers of the function `function` can't set.

        Raises:
            InputError: A value is invalid, or an option is unknown.
        """
        known = [name for name in list_declared_options(cls) if name not in fixed]
        for name in options:
            if name not in known:
                hints = build_name_hints(name, known, f"there are: {', '.join(known)}")
                raise InputError(f"{function} has no option {name!r}", hints=hints)
        return cls(**fixed, **options)

    @property
    def stamp(self) -> dict[str, Any]:
        """Names and values of the options in `fixed_on_resume`."""
        return {name: getattr(self, name) for name in list_declared_options(self) if name in self.fixed_on_resume}


def _check_option(option: Option, name: str, value: Any) -> Any:
    if not option.many:
        return check_value(option.kind, name, value)
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise InputError(f"{name} must be a list, even for a single item, got {format_value(value)}")
    return tuple(check_value(option.kind, f"{name}[{k}]", item) for k, item in enumerate(value))


def _parse_text(option: Option, flag: str, text: Any) -> Any:
    values = []
    if option.kind.gather is not None:
        text = option.kind.gather(text)
    for part in text if option.many else [text]:
        try:
            parsed = option.kind.parse(part) if isinstance(part, str) else part
            items = parsed if isinstance(parsed, tuple) else (parsed,)
            values += [option.kind.convert(item) for item in items]
        except (TypeError, ValueError, OverflowError):
            raise option.kind.build_error(flag, part) from None
    return tuple(values) if option.many else values[0]


def build_whole_number_kind(minimum: int, maximum: int | None = None) -> ValueKind:
    """Return the `ValueKind` of whole numbers from `minimum` to `maximum`.

    If `maximum` is None, there is no upper limit.
    """

    def convert(value: Any) -> int:
        if isinstance(value, bool):
            raise TypeError
        if (found := operator.index(value)) < minimum or (maximum is not None and found > maximum):
            raise ValueError
        return found

    if maximum is None:
        span = f"{minimum} or more"
        return ValueKind(f"a whole number, {span}", "INTEGER", convert, int, range=span)
    requirement, span = f"a whole number from {minimum} to {maximum}", f"{minimum} to {format_bound(maximum)}"
    return ValueKind(requirement, "INTEGER", convert, int, range=span)


def format_bound(value: float) -> str:
    """Return a limit as a short text such as ``1e7`` or ``2^63 - 1``."""
    if isinstance(value, int) and value > 10**6:
        if value & (value - 1) == 0:
            return f"2^{value.bit_length() - 1}"
        if value & (value + 1) == 0:
            return f"2^{value.bit_length()} - 1"
    return f"{value:g}".replace("e+0", "e").replace("e+", "e") if isinstance(value, float) else str(value)


def build_measure_kind(
    description: str, word: str, lower: float, upper: float, *, parse: Callable[[str], Any] = float, span: str = ""
) -> ValueKind:
    """Return the `ValueKind` of finite numbers above `lower` and up to `upper`."""

    def convert(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, Real):
            raise TypeError
        if not lower < (found := float(value)) <= upper:
            raise ValueError
        return found

    return ValueKind(description, word, convert, parse, range=span or f"above {format_bound(lower)}")


def _build_limit_kind(unit: str, most: float) -> ValueKind:
    limit = f"at most {format_bound(most)}"
    description, span = f"a positive number of {unit}, {limit}", f"above 0, {limit}"
    return build_measure_kind(description, unit.upper(), 0.0, most, span=span)


def build_seconds_kind() -> ValueKind:
    """Return the `ValueKind` of time limits in seconds."""
    return _build_limit_kind("seconds", LONGEST_S)


def build_megabytes_kind() -> ValueKind:
    """Return the `ValueKind` of memory limits in megabytes."""
    return _build_limit_kind("megabytes", MOST_MB)


def build_step_kind(parse: Callable[[str], Any] | None = None, also: str = "") -> ValueKind:
    """Return the `ValueKind` of step sizes.

    `parse` parses a text of the command line. `also` is added to the description, and names other texts that `parse`
    accepts.
    """
    limits = f"{format_number(SMALLEST, 3)} to {format_number(LARGEST, 3)}"
    description, lower = f"a number of seconds such as 1/240 or 0.004 ({limits}){also}", math.nextafter(SMALLEST, 0.0)
    return build_measure_kind(description, "SECONDS", lower, LARGEST, parse=parse or parse_fraction, span="above 0")


def parse_fraction(text: str) -> float:
    """Read a number such as ``1/240`` or ``0.004``."""
    numerator, slash, denominator = text.partition("/")
    try:
        return float(numerator) / (float(denominator) if slash else 1.0)
    except ZeroDivisionError:
        raise ValueError from None


def _require_type(kind: type, value: Any) -> Any:
    if not isinstance(value, kind):
        raise TypeError
    return value


def build_name_kind() -> ValueKind:
    """Return the `ValueKind` of names. Any text is valid, since the study checks later whether the name exists."""
    return ValueKind("a name", "NAME", partial(_require_type, str))


def build_flag_kind() -> ValueKind:
    """Return the `ValueKind` of boolean options."""
    return ValueKind("True or False", "", partial(_require_type, bool))


def build_enum_kind(kinds: type[StrEnum]) -> ValueKind:
    """Return the `ValueKind` of an enumeration's members. A value may be a member or its name."""
    listed = ", ".join(one.value for one in kinds)
    return ValueKind(f"one of {listed}", "|".join(one.value for one in kinds), kinds)
