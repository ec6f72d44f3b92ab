"""The words of messages and documents: what CONTRIBUTING's table calls an old word is used by none."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEADING = "| old word | new word |\n| --- | --- |\n"


def table() -> list[tuple[str, str]]:
    """The rows of the table, old and new."""
    rows = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition(HEADING)[2].partition("\n\n")[0]
    return [(old.strip(), new.strip()) for _, old, new, _ in (row.split("|") for row in rows.strip().splitlines())]


def documents() -> Iterator[Path]:
    """What a user reads: README and pages; no decisions or changelog, which tell of their day, and no kept outputs."""
    yield ROOT / "README.md"
    yield from sorted(path for path in (ROOT / "docs").rglob("*.md") if "decisions" not in path.parts)


def said(source: str) -> str:
    """The text of a module that is no docstring and no comment, a line a literal."""
    tree = ast.parse(source)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    literals = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return "\n".join(str(node.value) for node in literals if id(node) not in docstrings)


def uses(word: str, text: str) -> list[str]:
    """The places where a text says a word, with what stands around them."""
    pattern = r"\b" + r"\s+".join(map(re.escape, word.split())) + r"\b"
    found = re.finditer(pattern, text, flags=re.IGNORECASE)
    return [text[max(match.start() - 40, 0) : match.end() + 40] for match in found]


@cache
def texts() -> dict[str, str]:
    """What may say no old word, by its path: strings of the package, templates, documents."""
    found = {path: said(path.read_text(encoding="utf-8")) for path in (ROOT / "src" / "carom").rglob("*.py")}
    templates = (ROOT / "src" / "carom" / "pages" / "templates").iterdir()
    found |= {path: path.read_text(encoding="utf-8") for path in (*templates, *documents())}
    return {str(path.relative_to(ROOT)): text for path, text in found.items()}


def test_a_word_is_found_over_the_end_of_a_line_and_not_in_a_docstring() -> None:
    """The search sees a word that is broken over two lines, in f-strings too, and leaves docstrings alone."""
    source = '"""Held against."""\n\nx = f"{1} held\\nagainst PIC"\n'
    assert len(uses("held against", said(source))) == 1
    assert uses("held against", "withheld against it") == []


def test_no_message_and_no_page_uses_an_old_word() -> None:
    """No string of the package, no template and no page of the documents says it."""
    said = texts().items()
    assert [
        f"{name}: say {new!r}: {found}" for name, text in said for old, new in table() for found in uses(old, text)
    ] == []
