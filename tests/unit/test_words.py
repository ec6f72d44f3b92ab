"""Words that the field has better ones for stand nowhere in the sources and documents."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

#: What must not be read, and what to write instead.
INSTEAD = {
    r"\b(hangs?|hung|hanging) on\b": "depends on",
    r"\berr(s|ed)?\b(?! ?=)": "is off by, has an error of",
    r"\bdearest\b": "most expensive",
    r"\b(hard|full) disc\b|\bdisc that is full\b|\bon the disc (before|when|from)\b": "disk",
}


def texts() -> Iterator[tuple[Path, str]]:
    files = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
    for folder, endings in (("src", ("py", "pyx", "pxd", "j2")), ("adapters", ("py",)), ("docs", ("md", "py"))):
        files += [path for ending in endings for path in (ROOT / folder).rglob(f"*.{ending}")]
    for path in files:
        yield path, path.read_text(encoding="utf-8")


@pytest.mark.parametrize("word", INSTEAD)
def test_a_word_that_misleads_stands_nowhere(word: str) -> None:
    """Whoever searches for the term of the field finds it; the message says which that is."""
    found = [f"{path.relative_to(ROOT)}: {hit[0]!r}" for path, text in texts() for hit in re.finditer(word, text)]
    assert not found, f"write {INSTEAD[word]!r} instead"
