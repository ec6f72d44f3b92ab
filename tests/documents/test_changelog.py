"""Fragments of the changelog: each change's own file, and what `make changelog` makes of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from docs.figures.changelog import ROOT, assemble

CHANGELOG = "# Changelog\n\n## 0.2.0 (unreleased)\n\n- Older.\n\n## 0.1.0\n\n- First.\n"


def test_fragments_come_first_in_the_newest_section_and_are_gone(tmp_path: Path) -> None:
    """By their names, above what stands there; what tells of fragments stays, and a second time nothing changes."""
    log = tmp_path / "CHANGELOG.md"
    log.write_text(CHANGELOG)
    fragments = tmp_path / "fragments"
    fragments.mkdir()
    for name, text in (("b", "- Second\n  line.\n"), ("a", "- One.\n"), ("README", "no list\n")):
        (fragments / f"{name}.md").write_text(text)
    for _ in range(2):
        assemble(log, fragments)
        assert log.read_text() == CHANGELOG.replace("- Older.", "- One.\n- Second\n  line.\n- Older.")
        assert [path.name for path in fragments.iterdir()] == ["README.md"]


def test_what_is_no_list_or_has_no_place_is_refused_and_kept(tmp_path: Path) -> None:
    """A fragment that begins as no list, and a changelog without a section, are errors; no file is changed."""
    log, fragments = tmp_path / "CHANGELOG.md", tmp_path / "fragments"
    fragments.mkdir()
    for changelog, fragment in ((CHANGELOG, "Words.\n"), ("# Changelog\n", "- Words.\n")):
        log.write_text(changelog)
        (fragments / "a.md").write_text(fragment)
        with pytest.raises(ValueError, match=r"a fragment is a list|no section"):
            assemble(log, fragments)
        assert (log.read_text(), (fragments / "a.md").read_text()) == (changelog, fragment)


def test_the_fragments_of_this_repository_can_be_assembled(tmp_path: Path) -> None:
    """Those that lie here now are lists, and the changelog has a section for them."""
    fragments = tmp_path / "fragments"
    fragments.mkdir()
    for path in (ROOT / "changelog.d").glob("*.md"):
        (fragments / path.name).write_text(path.read_text("utf-8"))
    log = tmp_path / "CHANGELOG.md"
    log.write_text((ROOT / "CHANGELOG.md").read_text("utf-8"))
    (fragments / "a-new-one.md").write_text("- A new one.\n")
    assemble(log, fragments)
    assert log.read_text().count("\n- A new one.\n") == 1
