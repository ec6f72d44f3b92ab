"""What holds of the sources and documents as they are read: names, sizes, words."""

import ast
import inspect
import re
import string
import tomllib
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

import carom

ROOT = Path(__file__).resolve().parents[2]
SOURCE = Path(carom.__file__).parent
HEADING = "| old word | new word |\n| --- | --- |\n"

#: Most lines of a function by package, about a screen; most arguments of a function.
MOST_LINES, MOST_PARAMETERS = {"cli/": 80, "studies/": 80, "execution/": 60}, 12
#: What must not be read, and what to write instead.
INSTEAD = {
    r"\b(hangs?|hung|hanging) on\b": "depends on",
    r"\berr(s|ed)?\b(?! ?=)": "is off by, has an error of",
    r"\bdearest\b": "most expensive",
    r"\b(hard|full) disc\b|\bdisc that is full\b|\bon the disc (before|when|from)\b": "disk",
}
SIGNS = str.maketrans(dict.fromkeys(string.punctuation, " "))
#: The documents are in British English; code has the words of the libraries that it calls.
AMERICAN = (
    r"(?i)\b(analyz|behavior|canceled|center|color|favor|fulfill|gray|honor|initializ|labeled|maximiz|minimiz|model(?:ed|ing)\b"
    r"|neighbor|normaliz|optimiz|organiz|recogniz|serializ|summariz|toward\b|traveled)\w*"
)


@cache
def modules() -> dict[str, str]:
    """The text of every module of the package, by its path."""
    return {str(path.relative_to(SOURCE)): path.read_text(encoding="utf-8") for path in SOURCE.rglob("*.py")}


@cache
def tree(path: str) -> ast.Module:
    """A module of the package as it is parsed."""
    return ast.parse(modules()[path])


@cache
def texts() -> dict[Path, str]:
    """Sources, adapters and documents, by their paths."""
    files = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
    for folder, endings in (
        ("src", ("py", "pyx", "pxd", "h", "c", "j2", "json")),
        ("adapters", ("py",)),
        ("docs", ("md", "py")),
    ):
        files += [path for ending in endings for path in (ROOT / folder).rglob(f"*.{ending}")]
    return {path.relative_to(ROOT): path.read_text(encoding="utf-8") for path in files}


def test_no_two_public_classes_have_one_name() -> None:
    """A class that a reader looks for by its name is found in one module."""
    found = defaultdict(list)
    for path, text in modules().items():
        for name in re.findall(r"^class ([A-Za-z]\w*)", text, flags=re.MULTILINE):
            found[name].append(path)
    assert len(found) > 100
    assert {name: places for name, places in found.items() if len(places) > 1} == {}


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    asked = function.args
    named = len(asked.posonlyargs) + len(asked.args) + len(asked.kwonlyargs)
    return named + (asked.vararg is not None) + (asked.kwarg is not None)


@pytest.mark.long
def test_functions_are_of_a_size_that_is_read() -> None:
    """No function of these rooms is longer than its room's, or takes more than a dozen arguments; a cross-check six."""
    functions = {
        f"{path}:{node.lineno} {node.name}": (node, most)
        for path in modules()
        for room, most in MOST_LINES.items()
        if path.startswith(room)
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    assert len(functions) > 200
    long = {name for name, (node, most) in functions.items() if (node.end_lineno or 0) - node.lineno >= most}
    many = {name for name, (node, _) in functions.items() if parameters(node) > MOST_PARAMETERS}
    assert (long, many) == (set(), set())
    assert len(inspect.signature(carom.cross_check).parameters) <= 6


def core_sources() -> dict[str, str]:
    """Return the text of each C source of the core, by its path; without those of the page."""
    core = SOURCE / "core"
    paths = {path.relative_to(core).as_posix(): path for path in core.rglob("*.[hc]")}
    return {name: path.read_text(encoding="utf-8") for name, path in paths.items() if not name.startswith("wasm/")}


def test_each_file_of_the_core_is_short_and_begins_with_what_it_contains() -> None:
    """One concept a file, at most 500 lines, after a comment about it; no file includes a header twice."""
    found = core_sources()
    assert len(found) > 40
    for name, text in found.items():
        assert len(text.splitlines()) <= 500, name
        assert re.match(r"/\* \S.*[.:]", text.partition("\n\n")[0].partition("*/")[0].replace("\n", " ")), name
        assert name.endswith(".c") or re.search(r"^#pragma once$", text, re.MULTILINE), name
        included = re.findall(r"^#include\s*(\S+)", text, re.MULTILINE)
        assert len(included) == len(set(included)), name


def test_the_core_includes_nothing_but_a_few_headers_of_c_and_allocates_nothing() -> None:
    """The core can be built for any target: it has no library, no allocation and no input or output."""
    allowed = {"float.h", "math.h", "stdbool.h", "stddef.h", "stdint.h", "string.h"}
    calls = re.compile(r"\b(malloc|calloc|realloc|free|printf|pow|sin|cos|exp|log|fma|fmin|fmax|floor|ceil)\(")
    for name, text in core_sources().items():
        if name != "binding_memory.h":  # of the bindings
            assert set(re.findall(r"#include <([^>]+)>", text)) <= allowed, name
            assert not calls.search(text), name


def test_compiled_modules_import_what_is_below_them() -> None:
    """The contracts of `pyproject.toml` hold of .pyx and .pxd files too, whose imports the linter does not see."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    layers = next(one["layers"] for one in settings["contracts"] if one.get("containers") == ["carom"])
    level = {name: number for number, layer in enumerate(layers) for name in layer.split(" | ")}
    seen = 0
    for path in (*SOURCE.rglob("*.pyx"), *SOURCE.rglob("*.pxd")):
        for package in re.findall(r"^\s*from carom\.(\w+)\S* c?import", path.read_text(encoding="utf-8"), re.MULTILINE):
            seen += 1
            assert level[path.relative_to(SOURCE).parts[0]] <= level[package], (path, package)
    assert seen > 10


@pytest.mark.long
def test_a_word_that_misleads_stands_nowhere() -> None:
    """A search for a term of the field finds it, and the result names the term."""
    words = re.compile("|".join(INSTEAD))  # all at once, four times as fast as one after the other
    found = [
        (str(path), hit[0], new)
        for path, text in texts().items()
        for hit in words.finditer(text)
        for old, new in INSTEAD.items()
        if re.compile(old).match(text, hit.start())
    ]
    assert found == []


def test_the_documents_are_in_british_english() -> None:
    """Sentences of documents have no American forms; code, and the names in it, are left out."""
    found = []
    for path, text in texts().items():
        if path.suffix == ".md":
            prose = re.sub(r"```.*?```|`[^`]*`|<[^>]*>", "", text, flags=re.DOTALL)
            found += [(str(path), hit[0]) for hit in re.finditer(AMERICAN, prose)]
    assert found == []


def test_numbers_are_rounded_for_a_reader_in_one_place() -> None:
    """Only `support.formatting` rounds for a reader: 17 digits are the very float, and what two modules cut goes on."""
    computed = {"studies/stress/attack.py", "report/replay.py"}
    found = [
        (path, ast.unparse(node))
        for path, text in modules().items()
        if path not in {"support/formatting.py", *computed} and re.search(r":\.\d+g", text)
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FormattedValue | ast.Constant)
        and re.search(r":\.\d+g\b", ast.unparse(node).replace(":.17g", ""))
    ]
    assert found == []


# CONTRIBUTING's table of words ----------------------------------------------------------------------------------------


def said(tree: ast.Module) -> str:
    """The text of a module that is no docstring, no comment and no `_EARLIER` word of files, a line a literal."""
    nodes = list(ast.walk(tree))
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {
        id(node.body[0].value)
        for node in nodes
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    kept = {
        id(one)
        for node in nodes
        if isinstance(node, ast.Assign) and any(getattr(target, "id", "") == "_EARLIER" for target in node.targets)
        for one in ast.walk(node)
    }
    literals = (node for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return "\n".join(str(node.value) for node in literals if id(node) not in docstrings | kept)


@cache
def plain(text: str) -> str:
    """A text in small letters without signs and ends of lines, also within its literals: quick to search."""
    return " ".join(text.lower().replace("\\n", " ").translate(SIGNS).split())


def uses(word: str, text: str) -> list[str]:
    """The places of a word in a text, with their surroundings."""
    if plain(word) not in plain(text):
        return []
    pattern = r"\b" + r"\s+".join(map(re.escape, word.split())) + r"\b"
    found = re.finditer(pattern, text, flags=re.IGNORECASE)
    return [text[max(match.start() - 40, 0) : match.end() + 40] for match in found]


def test_a_word_is_found_over_the_end_of_a_line_and_not_in_a_docstring() -> None:
    """The search sees a word that is broken over two lines, in f-strings too, and leaves docstrings alone."""
    source = '"""Held against."""\n\nx = f"{1} held\\nagainst PIC"\n'
    assert len(uses("held against", said(ast.parse(source)))) == 1
    assert uses("held against", "withheld against it") == []


def lost_strings(body: list[ast.stmt], *, documented: bool = True) -> list[int]:
    """The lines of strings that are statements and no docstrings: nobody reads them."""
    lines = []
    for k, node in enumerate(body):
        value = node.value if isinstance(node, ast.Expr) else None
        is_text = isinstance(value, ast.JoinedStr) or isinstance(getattr(value, "value", None), str)
        lines += [node.lineno] if is_text and not (documented and k == 0) else []
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):  # no expression is looked at, which is slow
            is_definition = isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
            lines += lost_strings(getattr(node, name, []), documented=is_definition)
    return lines


def test_no_half_of_a_message_is_lost() -> None:
    """A string on the line after an assignment or a return belongs to it only inside of brackets."""
    assert lost_strings(
        ast.parse('def f():\n    """Doc."""\n    text = "one half, "\n    f"{1} other half"\n').body
    ) == [4]
    adapters = {str(path): ast.parse(text) for path, text in texts().items() if str(path).startswith("adapters/")}
    assert len(adapters) > 10
    trees = {path: tree(path) for path in modules()} | adapters
    assert {path: lines for path, module in trees.items() if (lines := lost_strings(module.body))} == {}


@pytest.mark.long
def test_no_message_and_no_page_uses_an_old_word() -> None:
    """No string of the package, no template and no page that a user reads says it: of documents all but decisions."""
    rows = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition(HEADING)[2].partition("\n\n")[0]
    words = [(old.strip(), new.strip()) for _, old, new, _ in (row.split("|") for row in rows.strip().splitlines())]
    assert len(words) > 10
    bare = [plain(old) for old, _ in words]
    read = {path: said(tree(path)) for path, text in modules().items() if any(w in plain(text) for w in bare)}
    pages = [ROOT / "README.md", *(path for path in (ROOT / "docs").rglob("*.md") if "decisions" not in path.parts)]
    pages += (SOURCE / "report" / "templates").iterdir()
    read |= {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in pages}
    found = [
        (path, f"say {new!r}", use) for path, text in read.items() for old, new in words for use in uses(old, text)
    ]
    assert found == []
