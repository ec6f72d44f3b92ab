"""The file of known failures, brought up to date by a run."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from carom.conformance.known_failures import load_known_failures
from carom.conformance.written import TO_BE_WRITTEN, WrittenFailures, write_known_failures

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


def written(file: Path, failed: dict[str, str], passed: set[str]) -> WrittenFailures:
    entries = load_known_failures(file) if file.exists() else ()
    return write_known_failures(file, entries, failed, passed, VERSIONS, HERE)


def test_a_run_without_news_leaves_every_letter(tmp_path: Path) -> None:
    """Where nothing new failed and what is known to fail did, the file is the same."""
    file = tmp_path / "known.toml"
    file.write_text(FILE)
    assert written(file, {}, set()) == WrittenFailures((), (), ())
    assert file.read_text() == FILE


def test_what_passes_leaves_and_what_stands_keeps_its_reason(tmp_path: Path) -> None:
    """A case that passes is taken out; other cases, entries, reasons and comments stay; an empty entry goes."""
    file = tmp_path / "known.toml"
    file.write_text(FILE)
    assert written(file, {}, {"a::energy[tuned]"}).dropped == ("a::energy[tuned]",)
    text = file.read_text()
    assert text.startswith("# What the engine can't do.\n\n# Issue 12.\n[[known_failure]]\n")
    assert FILE[FILE.index("# Slow") :] in text
    assert [(one.reason, one.cases) for one in load_known_failures(file)] == [
        ("it leaks", ("a::energy[default]",)),
        ("slow", ("a::times[default-x]",)),
    ]
    written(file, {}, {"a::energy[default]"})
    assert [one.reason for one in load_known_failures(file)] == ["slow"]


def test_what_fails_joins_by_what_it_fails_by(tmp_path: Path) -> None:
    """Cases whose failures differ in numbers alone share an entry, whose reason is to be written."""
    file = tmp_path / "known.toml"
    file.write_text("# Nothing is known yet.\n")
    failed = {"a::hits[default-x]": "2 missed", "a::hits[tuned-x]": "3 missed", "a::start[tuned]": "moves by 1e-3 m"}
    done = written(file, failed, set())
    assert done.added == done.without_reason == tuple(failed)
    assert file.read_text().startswith("# Nothing is known yet.\n\n[[known_failure]]\n")
    assert [(one.reason, one.cases, one.versions) for one in load_known_failures(file)] == [
        (f"{TO_BE_WRITTEN}; 2 missed", ("a::hits[default-x]", "a::hits[tuned-x]"), ""),
        (f"{TO_BE_WRITTEN}; moves by 1e-3 m", ("a::start[tuned]",), ""),
    ]


def test_a_case_of_another_platform_joins_for_this_release_here(tmp_path: Path) -> None:
    """Where the file lists a case for another platform, its new entry holds here alone, so that no case has two."""
    file = tmp_path / "known.toml"
    file.write_text(FILE)
    written(file, {"a::times[default-x]": "late"}, set())
    entry = load_known_failures(file)[-1]
    assert (entry.versions, entry.platform, entry.cases) == ("7.3.1", HERE, ("a::times[default-x]",))


@pytest.mark.parametrize(
    "text",
    [
        'known_failure = [{reason = "one", cases = ["a::b"]}, {reason = "two", cases = ["a::c"]}]',
        '[[known_failure]]\nreason = """\n[[known_failure]]\n"""\ncases = ["a::b", "a::c"]',
        '[["known_failure"]]\nreason = "one"\ncases = ["a::b", "a::c"]',
    ],
)
def test_a_file_of_another_form_is_written_as_entries(text: str, tmp_path: Path) -> None:
    """However TOML spells the list, what is written holds the same reasons and the cases that are left."""
    file = tmp_path / "known.toml"
    file.write_text(text)
    before = {name: one.reason for one in load_known_failures(file) for name in one.cases}
    written(file, {"a::d": "new"}, {"a::b"})
    after = {name: one.reason for one in load_known_failures(file) for name in one.cases}
    assert after == {"a::c": before["a::c"], "a::d": f"{TO_BE_WRITTEN}; new"}


@pytest.mark.long
@pytest.mark.parametrize("workers", [(), ("-n", "2")])
def test_a_run_writes_the_file_and_the_next_one_passes(
    project: Path, run_pytest: Pytest, workers: tuple[str, ...]
) -> None:
    """What fails is written, alone or in several processes; a second run passes, and says how many reasons lack."""
    file = project / "known.toml"
    file.write_text('[[known_failure]]\nreason = "it used to"\ncases = ["hangs::declares-profiles"]\n')
    chosen = ("--carom-engine", "hangs", "--carom-time-limit", "1", "--carom-known-failures=known.toml")
    these = ("-k", "start or declares", *workers)
    done = run_pytest(*chosen, "--write-known-failures", *these)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "known.toml: 2 known failures added, 1 dropped; 2 have a reason to be written" in done.stdout
    assert {name for one in load_known_failures(file) for name in one.cases} == {
        "hangs::start[default]",
        "hangs::start[tuned]",
    }
    done = run_pytest(*chosen, *these)
    assert done.returncode == 0, done.stdout + done.stderr
