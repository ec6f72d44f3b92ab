"""Finds the prose of source files: docstrings, comments, messages and help texts, each with its line.

Doctests and literal blocks are left out. A field of an f-string counts as one word.
"""

from __future__ import annotations

import ast
import inspect
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("src", "adapters", "benchmarks", "docs", "tests")
ENDINGS = {".py", ".pyx", ".pxd", ".c", ".h"}
#: Smallest number of words of prose. A string with fewer words is a name, a key or a piece of code.
LEAST_WORDS = 4

_SECTION = re.compile(r"^(Args|Attributes|Raises|Returns|Yields|Example|Examples|Note|Warning):$", re.MULTILINE)
_ENTRY = re.compile(r"^ {4}\*{0,2}[\w.]+(?: \([^)]*\))?: ", re.MULTILINE)
_DOCTEST = re.compile(r"^ *>>> .*(?:\n *\S.*)*", re.MULTILINE)
_LITERAL_BLOCK = re.compile(r"::\n\n(?: {4,}.*\n?|\n)+")
_WORD = re.compile(r"[\"'(\[]*[A-Za-z][A-Za-z'\u2019-]*[\"')\],.;:!?]*")
_CODE = re.compile(r"^ *(def \w+\(|import \w)", re.MULTILINE)
_DIRECTIVE = re.compile(r"^(noqa|type: |pragma|fmt: |pylint|mypy: |ruff: )")
_CODE_OF_C = re.compile(r"^ *#(include|define) ", re.MULTILINE)
_COMMENT_OF_C = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_FILE_OF_TABLE = re.compile(r"^ *[\w/]+\.(?:[ch]|py[xd])\b.*  \S.*$", re.MULTILINE)
_LITERAL_OF_C = re.compile(r'"(?:[^"\\\n]|\\.)*"')


class Passage(NamedTuple):
    """Text that people read, and the line on which it starts."""

    line: int
    text: str


def source_paths() -> Iterator[str]:
    """Yield the paths of the checked files, relative to the repository's root."""
    for path in sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*")):
        name = path.relative_to(ROOT).as_posix()
        if path.suffix in ENDINGS and "node_modules" not in path.parts:
            yield name


def passages(name: str, source: str) -> Iterator[Passage]:
    """Yield docstrings and comments of a file, and strings of Python files outside of tests.

    Double backticks become single backticks.
    """
    yield from (Passage(line, text.replace("``", "`")) for line, text in _passages(name, source))


def _passages(name: str, source: str) -> Iterator[Passage]:
    if name.endswith(".py"):
        yield from _strings(ast.parse(source), docstrings_only=name.startswith("tests/"))
        yield from _comments(source)
    elif name.endswith((".pyx", ".pxd")):
        yield from _docstrings_of_cython(source)
        yield from _comments(source)
    else:
        yield from _comments_of_c(source)


def _strings(tree: ast.Module, docstrings_only: bool) -> Iterator[Passage]:
    parts = set[int]()  # Identities of constants that are parts of strings that were already read.
    for node in ast.walk(tree):
        match node:
            case ast.Expr(ast.Constant(value=str(text)) as docstring):
                parts.add(id(docstring))
                yield Passage(docstring.lineno, prose_of_docstring(inspect.cleandoc(text)))
                continue
            case ast.Dict(keys):
                parts.update(map(id, keys))  # The keys of dictionaries are names, not prose.
                continue
            case ast.JoinedStr(values):
                parts.update(map(id, values))
                text = "".join(str(part.value) if isinstance(part, ast.Constant) else "Code" for part in values)
            case ast.Constant(value=str(text)) if id(node) not in parts:
                pass
            case _:
                continue
        if not docstrings_only and is_prose(text):
            yield Passage(node.lineno, text)


def prose_of_docstring(docstring: str) -> str:
    """Return a docstring without section titles, names of entries and code. Each entry of a section is a paragraph."""
    text = _LITERAL_BLOCK.sub(".\n\n", _DOCTEST.sub("", docstring))
    return _ENTRY.sub("\n", _SECTION.sub("", text))


def is_prose(text: str) -> bool:
    """Return whether a string has enough words, consists mainly of words, and is not code."""
    words = text.split()
    plain = sum(bool(_WORD.fullmatch(word)) for word in words)
    return plain >= LEAST_WORDS and plain >= 0.6 * len(words) and not _CODE.search(text)


def _comments(source: str) -> Iterator[Passage]:
    """Yield comments. Consecutive lines that contain only comments are one comment."""
    block = Passage(0, "")
    end = -1
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT or _DIRECTIVE.match(text := token.string.lstrip("#:").strip()):
            continue
        line, alone = token.start[0], token.line.lstrip().startswith("#")
        if alone and line == end + 1:
            block = Passage(block.line, f"{block.text}\n{text}")
        else:
            if block.text:
                yield block
            block = Passage(line, text)
        end = line if alone else -1
    if block.text:
        yield block


def _docstrings_of_cython(source: str) -> Iterator[Passage]:
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.STRING and token.string.startswith('"""'):
            if _CODE_OF_C.search(token.string):
                continue
            yield Passage(token.start[0], prose_of_docstring(inspect.cleandoc(token.string.strip('"'))))


def _comments_of_c(source: str) -> Iterator[Passage]:
    """Yield comments, without tables of file names. Comments with no code between them are one comment."""
    source = _LITERAL_OF_C.sub(lambda found: "0" * len(found[0]), source)
    for found in re.finditer(rf"(?:(?:{_COMMENT_OF_C.pattern})\s*?\n?[ \t]*)+", source, re.DOTALL):
        text = re.sub(r"^[ \t]*(/\*+|\*+/|\*|//+)?[ \t]?|\*/", "", found[0], flags=re.MULTILINE)
        yield Passage(source.count("\n", 0, found.start()) + 1, _FILE_OF_TABLE.sub("", text))
