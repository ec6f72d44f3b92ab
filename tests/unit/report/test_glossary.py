"""`carom explain`: the meaning of each word of a report."""

import re
from pathlib import Path

from tests.cases import each
from tests.command import carom_command

from carom.comparator.explanations import GRADE_CONDITIONS, VERDICT_CONDITIONS
from carom.comparator.grades import Grade
from carom.comparator.verdict import Verdict
from carom.report.glossary import find_meanings, list_meanings
from carom.report.outcome_marks import Mark

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "theory" / "scoring.md").read_text(encoding="utf-8")


def read_table(heading: str) -> list[tuple[str, str]]:
    """Return the rows of the page's table with this heading."""
    rows = re.findall(rf"^\| {heading} \| when \|\n\|[-| ]+\|\n((?:\|.*\n)+)", PAGE, re.MULTILINE)
    assert len(rows) == 1
    return re.findall(r"^\| (.+?) \| (.+) \|$", rows[0], re.MULTILINE)


def test_documented_verdicts_match_the_code() -> None:
    """Each verdict is explained, and the table in docs/theory/scoring.md has the same words: edit both."""
    assert list(VERDICT_CONDITIONS) == list(Verdict)
    assert sorted(read_table("verdict")) == sorted((one.value, when) for one, when in VERDICT_CONDITIONS.items())


def test_documented_grades_match_the_code() -> None:
    """Each grade is explained, and the table in docs/theory/scoring.md has the same words in the same order."""
    assert list(GRADE_CONDITIONS) == list(Grade)
    assert read_table("grade") == [(Mark[grade.name].word, when) for grade, when in GRADE_CONDITIONS.items()]


def test_every_word_of_a_report_is_explained() -> None:
    """Each verdict, grade and mark is found by its name, and every meaning is a complete sentence."""
    for word in {entry.word for entry in list_meanings()}:
        found = find_meanings(word)
        assert word in {entry.word for entry in found}
        assert all(str(entry).endswith(".") for entry in found), word


@each("word, near", [("mised", "'missed'"), ("inacurate", "'inaccurate'"), ("zzz", ""), ("NaN", "'not finite'")])
def test_misspelt_word_is_refused_with_the_nearest_one(word: str, near: str) -> None:
    """An unknown word ends with exit code 2 and the nearest word, or with the command that lists all words."""
    result = carom_command("explain", word)
    assert result.exit_code == 2
    assert f"no report uses the word {word!r}" in result.output
    assert (near or "`carom explain` lists the words") in result.output


@each(
    "word, meant",
    [
        ("tunnelling", "missed"),
        ("invented", "spurious"),
        ("parted inaccurate", "diverged inaccurate"),
        ("Velocities after an impact are wrong.", "wrong velocity"),
    ],
)
def test_synonyms_lead_to_words_of_reports(word: str, meant: str) -> None:
    """Words of the field, words of earlier versions and the sentence of a verdict lead to the word of reports."""
    assert [entry.word for entry in find_meanings(word)] == [meant]


def test_explain_command_lists_words() -> None:
    """`carom explain` without a word lists every meaning, one a line."""
    assert len(carom_command("explain").output.splitlines()) == len(list(list_meanings()))
