"""`carom explain`: the meaning of each word of a report."""

from tests.cases import each
from tests.command import carom_command

from carom.report.glossary import find_meanings, list_meanings


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
