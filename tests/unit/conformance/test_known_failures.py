"""The file of known failures: its form, and the names in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from carom.conformance.known_failures import KnownFailure, check_names, here, known_reasons, load_known_failures
from carom.errors import InputError

SOUND = '[[known_failure]]\nreason = "it {}"\ncases = ["a::energy[tuned]", "a::hits[default-x]"]\n'
NAMES = ["a::energy[tuned]", "a::hits[default-x]", "a::times[default-x]"]


def test_each_case_has_its_entrys_reason(tmp_path: Path) -> None:
    """Every case of an entry is a known failure for the entry's reason; an empty file has none."""
    file = tmp_path / "known.toml"
    file.write_text(SOUND.format("leaks") + '[[known_failure]]\nreason = " slow "\ncases = ["b::start[tuned]"]\n')
    assert known_reasons(load_known_failures(file), {"a": "1", "b": ""}, "linux-x86_64", file) == {
        "a::energy[tuned]": "it leaks",
        "a::hits[default-x]": "it leaks",
        "b::start[tuned]": "slow",
    }
    file.write_text("")
    assert load_known_failures(file) == ()


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
        (
            "[[known_failure]]\nreason = 'x'\ncases = ['a']\nplatform = 'linux-aarch46'",
            "known_failure 1: platform must be .* got 'linux-aarch46'; did you mean 'aarch64'",
        ),
        (
            "[[known_failure]]\nreason = 'x'\ncases = ['a']\nplatform = 'Linux'",
            "got 'Linux'; .*there are: linux, darwin, freebsd; this is ",
        ),
        ("[[known_failure]]\nreason = 'x'\ncases = ['a']\nplatform = ''", "platform must be a system"),
        ("[[known_failure]]\nreason = 'x'\ncases = ['a']\nplatform = 3", "platform must be a system"),
        ("[[known_failure]]\nreason = 'x'\ncases = ['a']\nversions = ''", "versions: a version must begin"),
        ("[[known_failure]]\nreason = 'x'\ncases = ['a']\nversions = '>=7,'", "versions: a version must begin"),
        ("[[known_failure]]\nreason = 'x'\ncases = ['a']\nversions = '~=7'", "versions: a version must begin"),
        ("[[known_failure]]\nreason = 'x'\ncases = ['a']\nversions = 7", "versions must be a range such as"),
        ("[[known_failure]]\nreason = 'x'\ncases = ['a']\nversion = '7'", "'version' is unknown; there are: reason"),
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
        entries = [KnownFailure("x", (name,))]
        skipped = {"a::times[default-x]": "no walls declared"}
        check_names(entries, {name}, NAMES, skipped, {"a", "b"}, Path("known.toml"))

    check("a::energy[tuned]")
    check("b::whatever")
    with pytest.raises(InputError, match=r"there is no case 'a::enrgy\[tuned\]'; did you mean 'a::energy\[tuned\]'"):
        check("a::enrgy[tuned]")
    with pytest.raises(InputError, match="there is no case 'c::start'"):
        check("c::start")
    with pytest.raises(InputError, match="can't fail, it is skipped: no walls declared; take it out"):
        check("a::times[default-x]")


@pytest.mark.parametrize(
    ("versions", "holds"),
    [
        (">=7,<8", {"7.0", "7.3.1", "7.0.0rc1"}),
        ("7.3.1", {"7.3.1"}),
        (">6.9", {"7.0", "7.3.1", "8", "7.0.0rc1"}),
        ("6.9..7.0", {"6.9", "7.0", "7.0.0rc1"}),
    ],
)
def test_an_entry_holds_of_the_releases_that_it_names(versions: str, holds: set[str]) -> None:
    """Each condition must be met by the numbers of the release; a candidate counts as its release."""
    entry = KnownFailure("x", ("a::b",), versions=versions)
    assert {one for one in ("6.9", "7.0", "7.3.1", "8", "7.0.0rc1") if entry.applies(one, "linux-x86_64")} == holds


def test_an_entry_holds_on_the_platform_that_it_names() -> None:
    """A system holds on each of its machines; a system and a machine on that one alone."""
    places = ("linux-x86_64", "linux-aarch64", "darwin-arm64")
    for asked, holds in (("linux", places[:2]), ("linux-aarch64", places[1:2]), ("", places)):
        entry = KnownFailure("x", ("a::b",), platform=asked)
        assert tuple(one for one in places if entry.applies("1", one)) == holds


def test_two_entries_of_one_case_must_hold_of_different_releases(tmp_path: Path) -> None:
    """A case has one reason for one release on one platform; ranges that both hold it are an error that names it.

    What a message calls this platform is accepted by the file; a range can't be judged where nobody tells a release.
    """
    file = tmp_path / "known.toml"
    entry = "[[known_failure]]\nreason = '{}'\ncases = ['a::b']\nversions = '{}'\n"
    file.write_text(entry.format("old", "<7") + entry.format("new", ">=7"))
    entries = load_known_failures(file)
    assert known_reasons(entries, {"a": "6.4"}, here(), file) == {"a::b": "old"}
    assert known_reasons(entries, {"a": "7.1"}, here(), file) == {"a::b": "new"}
    file.write_text(entry.format("old", "<=7") + entry.format("new", ">=7"))
    with pytest.raises(InputError, match=r"known_failure 2: 'a::b' is listed twice for release 7\.0"):
        known_reasons(load_known_failures(file), {"a": "7.0"}, here(), file)
    file.write_text(f"[[known_failure]]\nreason = 'x'\ncases = ['a::b']\nplatform = '{here()}'\n")
    assert known_reasons(load_known_failures(file), {"a": ""}, here(), file) == {"a::b": "x"}
    file.write_text(entry.format("x", ">=7"))
    with pytest.raises(InputError, match=r"known\.toml: known_failure 1: versions = '>=7' can't be judged"):
        known_reasons(load_known_failures(file), {"a": ""}, here(), file)
    assert known_reasons(load_known_failures(file), {"c": ""}, here(), file) == {}
