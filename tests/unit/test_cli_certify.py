"""`carom certify` and `carom run --certify`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.command import carom_command, told
from tests.validation.enclosed import from_enclosures


def test_a_scene_is_printed_with_its_proven_digits() -> None:
    """The slanted wall is met at .63 s; thirty digits are shown where thirty are asked for."""
    result = carom_command("certify", "classics/slanted-wall", "--digits", "30")
    assert result.exit_code == 0, result.output
    assert "0.6300000000000000" in result.output or "0.62999999999999" in result.output
    assert "certified to 30 digits for 1 impact, to 1.5 s of 1.5 s" in result.output
    assert "Certified to the end of the scene." in result.output


def test_spins_are_printed_where_something_turns() -> None:
    """Between two rough plates a disc leaves the first rolling, with -2 rad/s; elsewhere there is no such column."""
    result = carom_command("certify", "spin/plates")
    assert result.exit_code == 0, result.output
    assert "spins after, rad/s" in result.output
    assert "-2.0" in result.output
    assert "spins" not in carom_command("certify", "classics/slanted-wall").output


def test_a_degenerate_scene_is_named_and_is_exit_code_1() -> None:
    """What has no certain answer is a sentence with its bodies, and what came before it is kept."""
    result = carom_command("certify", "classics/cradle-touching")
    assert result.exit_code == 1
    assert "two bodies already in contact are driven together: disc 0, disc 1, disc 2" in result.output
    assert "certified to 15 digits for 1 impact" in result.output


def test_json_and_files_hold_the_whole_run(tmp_path: Path) -> None:
    """Both are the document that `from_enclosures` reads."""
    result = carom_command("certify", "classics/box", "--max-impacts", "5", "--json", "--out", tmp_path)
    assert result.exit_code == 0
    assert json.loads(result.output) == json.loads((tmp_path / "classics.box.json").read_text())
    assert len(from_enclosures(json.loads(result.output))) == 5


@pytest.mark.long
def test_a_cross_check_says_how_far_its_reference_is_certified() -> None:
    """Beside a scene of many discs stands the impact up to which it is certified, and asked for, beside any."""
    arguments = ("run", "-e", "pic", "--dt", "1/60", "--no-timing")
    by_default = told(carom_command(*arguments, "classics/cradle-gaps", "classics/head-on"))
    assert "certified to impact 4" in by_default
    assert "certified to impact 1" not in by_default
    asked = told(carom_command(*arguments, "classics/head-on", "--certify"))
    assert "classics/head-on: certified to impact 1, the last; float64 agrees to 1e-09 in all of them." in asked
