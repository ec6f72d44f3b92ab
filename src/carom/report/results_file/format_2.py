"""Conversion of lines of results.jsonl from format 2 to 3. The formats differ in the words for diverged runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from carom.comparator.grades import EARLIER_WORDS
from carom.report.files import FORMATS

#: Number of the format that this module converts to the present one.
FORMAT = 2

#: Fields of format 2 that have another name in the present format.
_FIELDS = {"parted_s": "diverged_s", "pit_parted_s": "pit_diverged_s"}


def convert_line(line: Mapping[str, Any]) -> dict[str, Any]:
    """Replace the words and field names of format 2 in a line by the present ones.

    Other texts, such as names of scenes, are unchanged.
    """
    converters = {"format": lambda _: FORMATS["results"], "grade": _replace_word, "verdicts": _replace_verdicts}
    return {
        _FIELDS.get(name, name): converters[name](value) if name in converters else value
        for name, value in line.items()
    }


def _replace_verdicts(verdicts: Any) -> Any:
    """Replace words in the verdicts of a run (a list), or in the meanings of verdicts in the first line (a mapping)."""
    if isinstance(verdicts, list):
        return [_replace_verdicts(one) if isinstance(one, dict) else one for one in verdicts]
    if isinstance(verdicts, dict):
        return {_replace_word(name): _replace_word(value) for name, value in verdicts.items()}
    return verdicts


def _replace_word(word: Any) -> Any:
    return EARLIER_WORDS.get(word, word) if isinstance(word, str) else word
