"""Escaping of untrusted text for a terminal, a browser, or a program that reads lines."""

from __future__ import annotations

import re
from collections.abc import Iterable

#: Begin of a line about an error: ``TypeError: ...``, ``Error [ERR_MODULE_NOT_FOUND]: ...``.
_ERROR = re.compile(r"[\w.]*(error|exception|panic)\b", re.IGNORECASE)

#: The last error of a program is searched in this many lines; the longest stack traces, those of node, have half of
#: that.
_LAST_LINES = 40

#: Characters that are not shown as such. They are control characters except tab and line feed, changes of the direction
#: of writing, further line ends, invisible characters, and halves of a surrogate pair.
_HIDDEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u2064\u2066-\u2069\ufeff\ud800-\udfff]"
)


def visible(text: str) -> str:
    r"""Return the text with each control character as its escape, ``\u001b`` say.

    These escapes are those of JSON, so JSON stays the same JSON; in XML, in Markdown and on a terminal they are text.
    """
    return _HIDDEN.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def shortened(text: str, most: int = 60) -> str:
    """Return the text as a message shows it: this many characters at most."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def last_words(printed: str) -> str:
    """Return the last line that begins as an error does, else the last line at all, 200 characters at most."""
    lines = [line for line in map(str.strip, printed.splitlines()) if line][-_LAST_LINES:]
    errors = [line for line in lines if _ERROR.match(line)]
    return (errors or lines or [""])[-1][:200]


def shown(value: object) -> str:
    """Return a value as a message shows it, in 60 characters."""
    try:
        text = repr(value)
    except ValueError:  # an integer of more digits than Python is willing to print
        return "an integer of too many digits"
    except RecursionError:
        return "a value nested too deeply to show"
    return text if len(text) <= 60 else f"{text[:57]}..."


def near(name: str, known: Iterable[str]) -> str:
    """Return a question that suggests a known name near an unknown one; empty where none is near."""
    import difflib  # here, because `import carom` loads this module, and few messages need it

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
    """Return whether a release is known to be older than another; one without a leading number is not."""
    return version[:1].isdigit() and release_numbers(version) < release_numbers(oldest)
