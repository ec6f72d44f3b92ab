"""Glossary of reports: meanings of verdicts, grades and marks."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from dataclasses import dataclass

from carom.comparator.explanations import GRADE_CONDITIONS, VERDICT_CONDITIONS
from carom.comparator.grades import EARLIER_WORDS
from carom.errors import UnknownNameError
from carom.report.outcome_marks import GRADED, Mark
from carom.support.formatting import group_by

#: Common words and words of earlier versions, each with the word that reports use instead.
_ALSO = {"tunnelling": "missed", "tunneling": "missed", "invented": "spurious", **EARLIER_WORDS}


@dataclass(frozen=True)
class Meaning:
    """A word that a report uses.

    Attributes:
        word: The word.
        kind: "verdict", "grade" or "mark".
        sentence: The sentence that a report shows for the word.
        condition: The condition under which a report uses the word.
    """

    word: str
    kind: str
    sentence: str
    condition: str = ""

    def __str__(self) -> str:
        text = f"{self.word} ({self.kind}): {self.sentence}."
        return f"{text}\n  When: {self.condition}." if self.condition else text


def list_meanings() -> Iterator[Meaning]:
    """Yield the meanings of all words: grades from best to worst, other outcomes of runs, and verdicts."""
    for mark in Mark:
        grade = GRADED.get(mark)
        condition = "" if grade is None else GRADE_CONDITIONS[grade].replace("*", "")
        yield Meaning(mark.word, "grade" if grade is not None else "mark", mark.meaning, condition)
    for verdict, condition in VERDICT_CONDITIONS.items():
        yield Meaning(verdict.name.lower().replace("_", " "), "verdict", verdict.value, condition.replace("*", ""))


def find_meanings(word: str) -> list[Meaning]:
    """Return the meanings of all verdicts, grades and marks whose name or sentence is `word`.

    Raises:
        UnknownNameError: No report uses the word. The message names similar words.
    """
    normalised = _ALSO.get(_normalise_word(word), _normalise_word(word))
    entries = list(list_meanings())
    names = group_by((_normalise_word(name), entry) for entry in entries for name in (entry.word, entry.sentence))
    if normalised in names:
        return names[normalised]
    near = [names[name][0].word for name in difflib.get_close_matches(normalised, names, n=3, cutoff=0.5)]
    near += [entry.word for entry in entries if normalised and normalised in _normalise_word(entry.sentence)][:3]
    hint = " or ".join(repr(one) for one in dict.fromkeys(near))
    hints = [f"did you mean {hint}?" if near else "`carom explain` lists the words"]
    raise UnknownNameError(f"no report uses the word {word!r}", hints=hints)


def _normalise_word(word: str) -> str:
    return " ".join(word.lower().replace("_", " ").replace("-", " ").replace(",", " ").rstrip(".").split())
