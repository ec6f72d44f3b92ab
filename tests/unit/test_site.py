"""The site has everything in it: every public name, every decision."""

from __future__ import annotations

import re
from pathlib import Path

import carom
import carom.adapter

DOCS = Path(__file__).resolve().parents[2] / "docs"


def described(page: str) -> list[str]:
    """Return the names that the reference on this page describes."""
    return re.findall(r"^::: (\S+)$", (DOCS / "api" / page).read_text(encoding="utf-8"), re.MULTILINE)


def test_every_public_name_of_carom_is_described_once() -> None:
    """The reference has each name of `carom.__all__`, and of these nothing else."""
    pages = ("carom.md", "scenes.md", "methods.md")
    found = [name.removeprefix("carom.") for page in pages for name in described(page)]
    assert sorted(name for name in found if "." not in name) == carom.__all__


def test_every_public_name_of_the_seam_is_described_once() -> None:
    """What `carom.adapter` shares with `carom` is described there, the rest on the seam's own page."""
    page = (DOCS / "api" / "adapter.md").read_text(encoding="utf-8")
    own = [name.removeprefix("carom.adapter.") for name in described("adapter.md")]
    shared = re.findall(r"\[`\w+`\]\[carom\.(\w+)\]", page)
    assert sorted(own + shared) == sorted(carom.adapter.__all__)


def test_every_decision_is_listed() -> None:
    """The list of decisions has each by its number, in order."""
    listed = re.findall(r"^(\d+)\. \[.+\]\((.+)\)$", (DOCS / "decisions" / "README.md").read_text(), re.MULTILINE)
    assert [name for _, name in listed] == sorted(path.name for path in (DOCS / "decisions").glob("0*.md"))
    assert [int(number) for number, _ in listed] == [int(name[:4]) for _, name in listed]
