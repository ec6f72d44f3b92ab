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


#: The documents are in British English; code has the words of the libraries that it calls.
AMERICAN = (
    r"(?i)\b(analyz|behavior|canceled|center|color|favor|fulfill|gray|honor|initializ|labeled|maximiz|minimiz|model(?:ed|ing)\b"
    r"|neighbor|normaliz|optimiz|organiz|recogniz|serializ|summariz|toward\b|traveled)\w*"
)


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


def test_the_documents_are_in_british_english() -> None:
    """No American form stands in a document's sentences; code, and the names in it, are left out."""
    found = []
    for path, text in texts():
        if path.suffix == ".md":
            prose = re.sub(r"```.*?```|`[^`]*`|<[^>]*>", "", text, flags=re.DOTALL)
            found += [f"{path.relative_to(ROOT)}: {hit[0]!r}" for hit in re.finditer(AMERICAN, prose)]
    assert not found
