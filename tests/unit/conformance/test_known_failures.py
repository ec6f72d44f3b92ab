"""The file of known failures: its form, and the names in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from carom.conformance.known_failures import check_names, load_known_failures
from carom.errors import InputError

SOUND = '[[known_failure]]\nreason = "it {}"\ncases = ["a::energy[tuned]", "a::hits[default-x]"]\n'
NAMES = ["a::energy[tuned]", "a::hits[default-x]", "a::times[default-x]"]


def test_each_case_has_its_entrys_reason(tmp_path: Path) -> None:
    """Every case of an entry is a known failure for the entry's reason; an empty file has none."""
    file = tmp_path / "known.toml"
    file.write_text(SOUND.format("leaks") + '[[known_failure]]\nreason = " slow "\ncases = ["b::start[tuned]"]\n')
    assert load_known_failures(file) == {
        "a::energy[tuned]": "it leaks",
        "a::hits[default-x]": "it leaks",
        "b::start[tuned]": "slow",
    }
    file.write_text("")
    assert load_known_failures(file) == {}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[known_failure]", "is not TOML: "),
        ("[[known]]\nreason = 'x'", "'known' is unknown"),
        ("known_failure = 3", "must be a list of tables"),
        ("known_failure = [3]", "known_failure 1: must be a table"),
        ("[[known_failure]]\nreason = 'x'\ncases = ['a']\nwhy = 'y'", "known_failure 1: 'why' is unknown"),
        ("[[known_failure]]\ncases = ['a']", "known_failure 1: reason must be a sentence that says why, got None"),
        ("[[known_failure]]\nreason = ' '\ncases = ['a']", "reason must be a sentence"),
        ("[[known_failure]]\nreason = 'x'\ncases = []", r"cases must be a list of names .* got \[\]"),
        ("[[known_failure]]\nreason = 'x'\ncases = [1]", "cases must be a list of names"),
        (SOUND + SOUND, "known_failure 2: 'a::energy.tuned.' is listed twice"),
    ],
)
def test_a_file_of_another_form_is_refused(tmp_path: Path, text: str, message: str) -> None:
    """What can't be read, or lacks a reason or cases, is an error that names file and entry."""
    file = tmp_path / "known.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=message) as error:
        load_known_failures(file)
    assert "known.toml" in str(error.value)


def test_names_are_held_against_the_cases_that_there_are() -> None:
    """A name of no case, or of one that is skipped, is an error; one of an engine not run this time is let be."""

    def check(name: str) -> None:
        check_names({name: "x"}, NAMES, {"a::times[default-x]": "no walls declared"}, {"a", "b"}, Path("known.toml"))

    check("a::energy[tuned]")
    check("b::whatever")
    with pytest.raises(InputError, match=r"there is no case 'a::enrgy\[tuned\]'; did you mean 'a::energy\[tuned\]'"):
        check("a::enrgy[tuned]")
    with pytest.raises(InputError, match="there is no case 'c::start'"):
        check("c::start")
    with pytest.raises(InputError, match="can't fail, it is skipped: no walls declared; take it out"):
        check("a::times[default-x]")
