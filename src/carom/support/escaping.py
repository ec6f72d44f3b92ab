"""Escaping of untrusted text for a terminal, a browser, or a program that reads lines."""

from __future__ import annotations

import re
from collections.abc import Iterable

#: Start of a line about an error: ``TypeError: ...``, ``Error [ERR_MODULE_NOT_FOUND]: ...``.
_ERROR = re.compile(r"[\w.]*(error|exception|panic)\b", re.IGNORECASE)

#: Number of lines that are searched for the last error of a program. The longest stack traces, by node, have half as
#: many.
_LAST_LINES = 40

#: Characters that are shown as escapes. These are control characters except tab and line feed, changes of the direction
#: of writing, further line ends, invisible characters, and halves of a surrogate pair.
_HIDDEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u2064\u2066-\u2069\ufeff\ud800-\udfff]"
)


def visible(text: str) -> str:
    r"""Return the text with each control character as an escape, such as ``\u001b``.

    JSON has the same escapes, so JSON text keeps its meaning. In XML, in Markdown and on a terminal they are plain
    text.
    """
    return _HIDDEN.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def shortened(text: str, most: int = 60) -> str:
    """Return the text with at most `most` characters, for a message."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def last_words(printed: str) -> str:
    """Return the last line that begins like an error, or else the last line; 200 characters at most."""
    lines = [line for line in map(str.strip, printed.splitlines()) if line][-_LAST_LINES:]
    errors = [line for line in lines if _ERROR.match(line)]
    return (errors or lines or [""])[-1][:200]


def shown(value: object) -> str:
    """Return a value as text for a message, 60 characters at most."""
    try:
        text = repr(value)
    except ValueError:  # the value is an integer with more digits than Python prints
        return "an integer with too many digits"
    except RecursionError:
        return "a value nested too deeply to show"
    return text if len(text) <= 60 else f"{text[:57]}..."


def near(name: str, known: Iterable[str]) -> str:
    """Return a question that suggests the known name nearest to an unknown one; empty if none is near."""
    import difflib  # imported here, because `import carom` loads this module, and few messages need it

    found = difflib.get_close_matches(name, list(known), n=1)
    return f"did you mean {found[0]!r}?" if found else ""


def named_hints(name: str, known: Iterable[str], there_are: str) -> tuple[str, ...]:
    """Return the hints of an error about an unknown name: a near one, and all known ones."""
    return tuple(filter(None, (near(name, known), there_are)))


def release_numbers(version: str) -> tuple[int, ...]:
    """Return the leading numbers of a release, without zeros at the end: 4.0.0rc1 counts as 4."""
    found = re.match(r"[0-9]+(\.[0-9]+)*", version)
    numbers = [int(number) for number in found[0].split(".")] if found else []
    while numbers and not numbers[-1]:
        numbers.pop()
    return tuple(numbers)


def is_older(version: str, oldest: str) -> bool:
    """Return whether a release is known to be older than another; False if it has no leading number."""
    return version[:1].isdigit() and release_numbers(version) < release_numbers(oldest)
