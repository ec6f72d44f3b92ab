"""Escaping of untrusted text for a terminal, a browser, or a program that reads lines."""

from __future__ import annotations

import re
from collections.abc import Iterable

#: Start of a line about an error, such as ``TypeError: ...`` or ``Error [ERR_MODULE_NOT_FOUND]: ...``.
_ERROR = re.compile(r"[\w.]*(error|exception|panic)\b", re.IGNORECASE)

#: Number of last lines of a program's output in which Carom searches for an error message. The longest stack traces,
#: which Node prints, have half as many lines.
_LAST_LINES = 40

#: Characters that are shown as escapes: control characters except tab and line feed, marks of text direction, unusual
#: line ends, invisible characters, and lone surrogates.
_HIDDEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u2064\u2066-\u2069\ufeff\ud800-\udfff]"
)

#: All ASCII characters that are not escaped.
_VISIBLE = b"\t\n" + bytes(range(0x20, 0x7F))


def escape_controls(text: str) -> str:
    r"""Return the text with each control character replaced by an escape such as ``\u001b``.

    JSON has the same escapes, so the meaning of a JSON text stays the same. In XML, in Markdown and on terminals,
    people see the escapes.
    """
    if text.isascii() and not text.encode().translate(None, _VISIBLE):  # ten times as fast as `sub` for long texts
        return text
    return _HIDDEN.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def shorten(text: str, max_length: int = 60) -> str:
    """Return the text for a message, cut to at most `max_length` characters."""
    return text if len(text) <= max_length else f"{text[: max_length - 3]}..."


def find_last_message(printed: str) -> str:
    """Return the last line that begins like an error, or else the last line, cut to 200 characters."""
    lines = [line for line in map(str.strip, printed.splitlines()) if line][-_LAST_LINES:]
    return ([line for line in lines if _ERROR.match(line)] or lines or [""])[-1][:200]


def format_value(value: object) -> str:
    """Return a value as text for a message, cut to at most 60 characters."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to print very long integers
        return "an integer with too many digits"
    except RecursionError:
        return "a value nested too deeply to show"
    return shorten(text)


def suggest_name(name: str, known: Iterable[str]) -> str:
    """Return "did you mean ...?" with the known name most similar to `name`, or an empty text if none is similar."""
    import difflib  # an import at the top would make `import carom` slower

    found = difflib.get_close_matches(name, list(known), n=1)
    return f"did you mean {found[0]!r}?" if found else ""


def build_name_hints(name: str, known: Iterable[str], there_are: str) -> tuple[str, ...]:
    """Return the hints of an error about an unknown name: a similar known name, if any, and the text `there_are`."""
    return tuple(filter(None, (suggest_name(name, known), there_are)))


def parse_release_numbers(version: str) -> tuple[int, ...]:
    """Return the leading numbers of a version, without zeros at the end. For example, 4.0.0rc1 gives (4,)."""
    found = re.match(r"[0-9]+(\.[0-9]+)*", version)
    numbers = [int(number) for number in found[0].split(".")] if found else []
    while numbers and not numbers[-1]:
        numbers.pop()
    return tuple(numbers)


def is_older(version: str, oldest: str) -> bool:
    """Return whether the release `version` is older than `oldest`; False if `version` does not start with a digit."""
    return version[:1].isdigit() and parse_release_numbers(version) < parse_release_numbers(oldest)
