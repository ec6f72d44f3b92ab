"""The file of known failures: its form, the names in it, and how a run brings it up to date."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.cases import each

from carom.conformance.known_failures import (
    TO_BE_WRITTEN,
    KnownFailure,
    KnownFailuresFile,
    find_platform_name,
    load_known_failures,
)
from carom.errors import InputError

SOUND = '[[known_failure]]\nreason = "it {}"\ncases = ["a::energy[tuned]", "a::hits[default-x]"]\n'
ENTRY = "[[known_failure]]\nreason = 'x'\ncases = ['a']\n"
PLATFORMS = ("linux-x86_64", "linux-aarch64", "darwin-arm64")
NAMES = ["a::energy[tuned]", "a::hits[default-x]", "a::times[default-x]"]


def test_known_failure_has_the_reason_of_its_entry(tmp_path: Path) -> None:
    """Each case of an entry is a known failure with the entry's reason; an empty file has no entries."""
    file = tmp_path / "known.toml"
    file.write_text(SOUND.format("leaks") + '[[known_failure]]\nreason = " slow "\ncases = ["b::start[tuned]"]\n')
    reasons = {"a::energy[tuned]": "it leaks", "a::hits[default-x]": "it leaks", "b::start[tuned]": "slow"}
    assert KnownFailuresFile(file, load_known_failures(file), {"a": "1", "b": ""}, "linux-x86_64").reasons == reasons
    file.write_text("")
    assert load_known_failures(file) == ()


@each(
    "text, message",
    [
        ("[[known_failure]", "is not TOML: "),
        ("[[known]]\nreason = 'x'", "'known' is unknown"),
        ("known_failure = 3", "must be a list of tables"),
        ("known_failure = [3]", "known_failure 1: must be a table"),
        ("[[known_failure]]\ncases = ['a']", "known_failure 1: reason must be a sentence, got None"),
        ("[[known_failure]]\nreason = 'x'\ncases = []", r"cases must be a list of names .* got \[\]"),
        (
            ENTRY + "platform = 'linux-aarch46'",
            "known_failure 1: platform must be .* got 'linux-aarch46'; did you mean 'aarch64'",
        ),
        (ENTRY + "platform = 'Linux'", "got 'Linux'; .*there are: linux, darwin, freebsd; this is "),
        (ENTRY + "versions = '>=7,'", "versions: a version must begin"),
        (ENTRY + "versions = 7", "versions must be a range such as"),
        (ENTRY + "version = '7'", "known_failure 1: 'version' is unknown; there are: reason"),
        (SOUND + SOUND, "known_failure 2: 'a::energy.tuned.' is listed twice"),
    ],
)
def test_malformed_known_failures_file_is_refused(tmp_path: Path, text: str, message: str) -> None:
    """A malformed file or entry is refused with the name of the file and the cause."""
    file = tmp_path / "known.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=message) as error:
        load_known_failures(file)
    assert "known.toml" in str(error.value)


def list_file(case: str) -> KnownFailuresFile:
    return KnownFailuresFile(Path("known.toml"), (KnownFailure("x", (case,)),), {"a": "1", "b": "1"})


@each(
    "case, message",
    [
        ("a::enrgy[tuned]", r"there is no case 'a::enrgy\[tuned\]'; did you mean 'a::energy\[tuned\]'"),
        ("c::start", "there is no case 'c::start'"),
        ("a::times[default-x]", "can't fail, because it is skipped: no walls declared; remove it"),
    ],
)
def test_unknown_or_skipped_case_in_file_is_refused(case: str, message: str) -> None:
    """A listed case that does not exist or is skipped is refused; cases of engines that are not run are ignored."""
    names = {**dict.fromkeys(NAMES, ""), "a::times[default-x]": "no walls declared"}
    for listed in ("a::energy[tuned]", "b::whatever"):
        list_file(listed).check_names(names, {"a", "b"})
    with pytest.raises(InputError, match=message):
        list_file(case).check_names(names, {"a", "b"})


@each(
    "versions, holds",
    [
        (">=7,<8", {"7.0", "7.3.1", "7.0.0rc1"}),
        ("7.3.1", {"7.3.1"}),
        (">6.9", {"7.0", "7.3.1", "8", "7.0.0rc1"}),
        ("6.9..7.0", {"6.9", "7.0", "7.0.0rc1"}),
    ],
)
def test_entry_applies_only_to_its_releases(versions: str, holds: set[str]) -> None:
    """An entry applies to releases that meet all its conditions; a release candidate counts as its release."""
    entry = KnownFailure("x", ("a::b",), versions=versions)
    assert {one for one in ("6.9", "7.0", "7.3.1", "8", "7.0.0rc1") if entry.is_valid_for(one, "linux-x86_64")} == holds


@each(
    "platform, holds",
    [("linux", ["linux-x86_64", "linux-aarch64"]), ("linux-aarch64", ["linux-aarch64"]), ("", [*PLATFORMS])],
)
def test_entry_applies_only_to_its_platform(platform: str, holds: list[str]) -> None:
    """An entry for a system applies to all its machines, one for a system and machine only to that machine."""
    entry = KnownFailure("x", ("a::b",), platform=platform)
    assert [one for one in PLATFORMS if entry.is_valid_for("1", one)] == holds


def test_case_in_two_entries_needs_disjoint_releases(tmp_path: Path) -> None:
    """A case can be listed twice only for disjoint releases of a known version, also by platform."""
    file = tmp_path / "known.toml"
    entry = "[[known_failure]]\nreason = '{}'\ncases = ['a::b']\nversions = '{}'\n"
    file.write_text(entry.format("old", "<7") + entry.format("new", ">=7"))
    entries = load_known_failures(file)
    assert KnownFailuresFile(file, entries, {"a": "6.4"}).reasons == {"a::b": "old"}
    assert KnownFailuresFile(file, entries, {"a": "7.1"}).reasons == {"a::b": "new"}
    file.write_text(entry.format("old", "<=7") + entry.format("new", ">=7"))
    with pytest.raises(InputError, match=r"known_failure 2: 'a::b' is listed twice for release 7\.0"):
        _ = KnownFailuresFile(file, load_known_failures(file), {"a": "7.0"}).reasons
    file.write_text(f"[[known_failure]]\nreason = 'x'\ncases = ['a::b']\nplatform = '{find_platform_name()}'\n")
    assert KnownFailuresFile(file, load_known_failures(file), {"a": ""}).reasons == {"a::b": "x"}
    file.write_text(entry.format("x", ">=7"))
    with pytest.raises(InputError, match=r"known\.toml: known_failure 1: versions = '>=7' can't be compared"):
        _ = KnownFailuresFile(file, load_known_failures(file), {"a": ""}).reasons
    assert KnownFailuresFile(file, load_known_failures(file), {"c": ""}).reasons == {}


#: As `run_pytest` of the fixture.
Pytest = Callable[..., "subprocess.CompletedProcess[str]"]

FILE = """# What the engine can't do.

# Issue 12.
[[known_failure]]
reason = "it leaks"   # since the move
cases = ["a::energy[tuned]",
         "a::energy[default]"]

# Slow machines.
[[known_failure]]
reason = "slow"
platform = "linux-aarch64"
cases = ["a::times[default-x]"]
"""
VERSIONS, HERE = {"a": "7.3.1"}, "linux-x86_64"


def update_file(file: Path, failed: dict[str, str], passed: set[str]) -> list[str]:
    entries = load_known_failures(file) if file.exists() else ()
    return KnownFailuresFile(file, entries, VERSIONS, HERE).write(file, failed, passed)


def test_passing_case_is_removed_and_other_entries_stay(tmp_path: Path) -> None:
    """A case that passes is removed, and its entry if empty; without changes the file keeps its exact text."""
    file = tmp_path / "known.toml"
    file.write_text(FILE)
    assert update_file(file, {}, set()) == []
    assert file.read_text() == FILE
    update_file(file, {}, {"a::energy[tuned]"})
    text = file.read_text()
    assert text.startswith("# What the engine can't do.\n\n# Issue 12.\n[[known_failure]]\n")
    assert FILE[FILE.index("# Slow") :] in text
    entries = [(one.reason, one.cases) for one in load_known_failures(file)]
    assert entries == [("it leaks", ("a::energy[default]",)), ("slow", ("a::times[default-x]",))]
    update_file(file, {}, {"a::energy[default]"})
    assert [one.reason for one in load_known_failures(file)] == ["slow"]


def test_new_failures_are_grouped_by_message(tmp_path: Path) -> None:
    """New failures whose messages differ only in numbers share one entry, with a reason still to be written."""
    file = tmp_path / "known.toml"
    file.write_text("# Nothing is known yet.\n")
    failed = {"a::hits[default-x]": "2 missed", "a::hits[tuned-x]": "3 missed", "a::start[tuned]": "moves by 1e-3 m"}
    assert update_file(file, failed, set()) == list(failed)
    assert file.read_text().startswith("# Nothing is known yet.\n\n[[known_failure]]\n")
    assert [(one.reason, one.cases, one.versions) for one in load_known_failures(file)] == [
        (f"{TO_BE_WRITTEN}; 2 missed", ("a::hits[default-x]", "a::hits[tuned-x]"), ""),
        (f"{TO_BE_WRITTEN}; moves by 1e-3 m", ("a::start[tuned]",), ""),
    ]


def test_case_listed_for_other_platform_gets_entry_for_this_one(tmp_path: Path) -> None:
    """A failing case that is listed for another platform gets an entry for this release and platform only."""
    file = tmp_path / "known.toml"
    file.write_text(FILE)
    update_file(file, {"a::times[default-x]": "late"}, set())
    entry = load_known_failures(file)[-1]
    assert (entry.versions, entry.platform, entry.cases) == ("7.3.1", HERE, ("a::times[default-x]",))


@each(
    "text",
    [
        'known_failure = [{reason = "one", cases = ["a::b"]}, {reason = "two", cases = ["a::c"]}]',
        '[[known_failure]]\nreason = """\n[[known_failure]]\n"""\ncases = ["a::b", "a::c"]',
        '[["known_failure"]]\nreason = "one"\ncases = ["a::b", "a::c"]',
    ],
)
def test_any_toml_spelling_of_entries_is_rewritten(text: str, tmp_path: Path) -> None:
    """However TOML spells the entries, the rewritten file keeps the reasons of the cases that remain."""
    file = tmp_path / "known.toml"
    file.write_text(text)
    before = {name: one.reason for one in load_known_failures(file) for name in one.cases}
    update_file(file, {"a::d": "new"}, {"a::b"})
    after = {name: one.reason for one in load_known_failures(file) for name in one.cases}
    assert after == {"a::c": before["a::c"], "a::d": f"{TO_BE_WRITTEN}; new"}


@pytest.mark.long
@pytest.mark.parametrize("workers", [(), ("-n", "2")])
def test_run_after_writing_known_failures_passes(project: Path, run_pytest: Pytest, workers: tuple[str, ...]) -> None:
    """An engine that hangs fails; after `--write-known-failures` has written this failure, the next run passes."""
    file = project / "known.toml"
    file.write_text('[[known_failure]]\nreason = "it used to"\ncases = ["hangs::declares-profiles"]\n')
    chosen = ("--carom-engine", "hangs", "--carom-time-limit", "1", "--carom-known-failures=known.toml")
    these = ("-k", "start or declares", *workers)
    done = run_pytest(*chosen, "--write-known-failures", *these)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "no answer within 1 s" in done.stdout
    assert "known.toml: 1 known failures added, 1 dropped; cases that need a reason: 1" in done.stdout
    assert {name for one in load_known_failures(file) for name in one.cases} == {"hangs::start[tuned]"}
    done = run_pytest(*chosen, *these)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " 0 failed, 0 skipped, 1 known failures" in done.stdout
