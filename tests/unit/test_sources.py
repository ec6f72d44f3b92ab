"""What holds of the sources and documents as they are read: names, sizes, words."""

import ast
import inspect
import re
import string
import tomllib
from functools import cache
from pathlib import Path

import pytest

import carom

ROOT = Path(__file__).resolve().parents[2]
SOURCE = Path(carom.__file__).parent

#: Most lines of a function by package, about a screen; most arguments of a function.
MOST_LINES, MOST_PARAMETERS = {"cli/": 80, "studies/": 80, "execution/": 60}, 12
#: Old words of messages and pages, and what to write instead.
OLD_WORDS = {
    "so many": "n, this many",
    "so large a part": "this fraction",
    "where nothing turns": "if no disc spins",
    "may be believed": "is reliable",
    "whoever": "who, the caller, the user",
    "let in": "accepted",
    "with your rights": "with your permissions",
    "go on with the journal": "continue from the journal",
    "laid over each other": "overlaid",
    "final place": "final position",
    "goes by the scene": "depends on the scene",
    "what is none": "anything else",
    "beside": "next to, with, in addition to, compared with",
    "exact, 32 bits": "exact (float32)",
    "error by PIT's": "error / PIT's",
    "an answer that is longer is none": "longer answers are refused",
    "a number that is none": "a number that is not finite",
    "looks once a step": "checks for overlap once per step",
    "looking once a step": "checking once per step",
    "looks once a frame": "checks for overlap once per frame",
    "looking once a frame": "checking once per frame",
    "price paid": "error / PIT's",
    "what must happen": "exact",
    "gives way": "fails",
    "stands to the end": "passes",
    "relations that need no truth": "invariances",
    "scenes from real complaints": "scenes of reported bugs",
    "impacts are lost": "impacts are missed or spurious",
    "impacts lost": "impacts missed or spurious",
    "0.9 dt": "0.9 steps",
    "parted": "diverged",
}
#: Tables of the package with words of earlier versions.
EARLIER_TABLES = {"_EARLIER", "EARLIER_WORDS"}
SIGNS = str.maketrans(dict.fromkeys(string.punctuation, " "))
#: The documents are in British English; code has the words of the libraries that it calls.
AMERICAN = (
    r"(?i)\b(analyz|behavior|canceled|center|color|favor|fulfill|gray|honor|initializ|labeled|maximiz|minimiz|model(?:ed|ing)\b"
    r"|neighbor|normaliz|optimiz|organiz|recogniz|serializ|summariz|toward\b|traveled)\w*"
)


@cache
def read_modules() -> dict[str, str]:
    """The text of every module of the package, by its path."""
    return {str(path.relative_to(SOURCE)): path.read_text(encoding="utf-8") for path in SOURCE.rglob("*.py")}


@cache
def parse_module(path: str) -> ast.Module:
    """A module of the package as it is parsed."""
    return ast.parse(read_modules()[path])


@cache
def read_texts() -> dict[Path, str]:
    """Sources, adapters and documents, by their paths."""
    files = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
    for folder, endings in (
        ("src", ("py", "pyx", "pxd", "h", "c", "j2", "json")),
        ("adapters", ("py",)),
        ("docs", ("md", "py")),
    ):
        files += [path for ending in endings for path in (ROOT / folder).rglob(f"*.{ending}")]
    return {path.relative_to(ROOT): path.read_text(encoding="utf-8") for path in files}


def count_parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    asked = function.args
    named = len(asked.posonlyargs) + len(asked.args) + len(asked.kwonlyargs)
    return named + (asked.vararg is not None) + (asked.kwarg is not None)


@pytest.mark.long
def test_functions_are_short_and_have_few_parameters() -> None:
    r"""Functions have at most 80 lines in `cli` and `studies` and 60 in `execution`, and at most 12 parameters.

    `carom.cross_check` has at most 6.
    """
    functions = {
        f"{path}:{node.lineno} {node.name}": (node, most)
        for path in read_modules()
        for room, most in MOST_LINES.items()
        if path.startswith(room)
        for node in ast.walk(parse_module(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    assert len(functions) > 200
    long = {name for name, (node, most) in functions.items() if (node.end_lineno or 0) - node.lineno >= most}
    many = {name for name, (node, _) in functions.items() if count_parameters(node) > MOST_PARAMETERS}
    assert (long, many) == (set(), set())
    assert len(inspect.signature(carom.cross_check).parameters) <= 6


def read_core_sources() -> dict[str, str]:
    """Return the text of each C source of the core, by its path; without those of the page."""
    core = SOURCE / "core"
    paths = {path.relative_to(core).as_posix(): path for path in core.rglob("*.[hc]")}
    return {name: path.read_text(encoding="utf-8") for name, path in paths.items() if not name.startswith("wasm/")}


def test_core_files_are_short_and_begin_with_a_description() -> None:
    r"""Each C file of the core has at most 500 lines and begins with a comment on its content.

    Headers have `#pragma once`, and no file includes a header twice.
    """
    found = read_core_sources()
    assert len(found) > 40
    for name, text in found.items():
        assert len(text.splitlines()) <= 500, name
        assert re.match(r"/\* \S.*[.:]", text.partition("\n\n")[0].partition("*/")[0].replace("\n", " ")), name
        assert name.endswith(".c") or re.search(r"^#pragma once$", text, re.MULTILINE), name
        included = re.findall(r"^#include\s*(\S+)", text, re.MULTILINE)
        assert len(included) == len(set(included)), name


def test_core_uses_few_c_headers_and_no_allocation() -> None:
    """The C core can be built for any target: it includes six standard headers and never allocates or prints."""
    allowed = {"float.h", "math.h", "stdbool.h", "stddef.h", "stdint.h", "string.h"}
    calls = re.compile(r"\b(malloc|calloc|realloc|free|printf|pow|sin|cos|exp|log|fma|fmin|fmax|floor|ceil)\(")
    for name, text in read_core_sources().items():
        if name != "binding_memory.h":  # of the bindings
            assert set(re.findall(r"#include <([^>]+)>", text)) <= allowed, name
            assert not calls.search(text), name


def test_compiled_modules_follow_the_import_layers() -> None:
    """Layers of `pyproject.toml` also hold for .pyx and .pxd files, whose imports the linter does not read."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    layers = next(one["layers"] for one in settings["contracts"] if one.get("containers") == ["carom"])
    level = {name: number for number, layer in enumerate(layers) for name in layer.split(" | ")}
    seen = 0
    for path in (*SOURCE.rglob("*.pyx"), *SOURCE.rglob("*.pxd")):
        for package in re.findall(r"^\s*from carom\.(\w+)\S* c?import", path.read_text(encoding="utf-8"), re.MULTILINE):
            seen += 1
            assert level[path.relative_to(SOURCE).parts[0]] <= level[package], (path, package)
    assert seen > 10


def test_documents_are_in_british_english() -> None:
    """The text of Markdown documents has no American spelling; code in it is not checked."""
    found = []
    for path, text in read_texts().items():
        if path.suffix == ".md":
            prose = re.sub(r"```.*?```|`[^`]*`|<[^>]*>", "", text, flags=re.DOTALL)
            found += [(str(path), hit[0]) for hit in re.finditer(AMERICAN, prose)]
    assert found == []


def test_numbers_are_rounded_for_display_in_one_module() -> None:
    """Only `support.formatting` rounds for display; 17 digits, and rounding within two calculations, are allowed."""
    computed = {"studies/stress/stress_test.py", "report/replay_data.py"}
    found = [
        (path, ast.unparse(node))
        for path, text in read_modules().items()
        if path not in {"support/formatting.py", *computed} and re.search(r":\.\d+g", text)
        for node in ast.walk(parse_module(path))
        if isinstance(node, ast.FormattedValue | ast.Constant)
        and re.search(r":\.\d+g\b", ast.unparse(node).replace(":.17g", ""))
    ]
    assert found == []


# Old words ------------------------------------------------------------------------------------------------------------


def collect_strings(tree: ast.Module) -> str:
    """The text of a module that is no docstring, no comment and no earlier word of files, a line a literal."""
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
        if isinstance(node, ast.Assign) and any(getattr(target, "id", "") in EARLIER_TABLES for target in node.targets)
        for one in ast.walk(node)
    }
    literals = (node for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return "\n".join(str(node.value) for node in literals if id(node) not in docstrings | kept)


@cache
def normalise_text(text: str) -> str:
    """A text in small letters without signs and ends of lines, also within its literals: quick to search."""
    return " ".join(text.lower().replace("\\n", " ").translate(SIGNS).split())


def find_uses(word: str, text: str) -> list[str]:
    """The places of a word in a text, with their surroundings."""
    if normalise_text(word) not in normalise_text(text):
        return []
    pattern = r"\b" + r"\s+".join(map(re.escape, word.split())) + r"\b"
    found = re.finditer(pattern, text, flags=re.IGNORECASE)
    return [text[max(match.start() - 40, 0) : match.end() + 40] for match in found]


def find_unused_strings(body: list[ast.stmt], *, documented: bool = True) -> list[int]:
    """The lines of strings that are statements and no docstrings: nobody reads them."""
    lines = []
    for k, node in enumerate(body):
        value = node.value if isinstance(node, ast.Expr) else None
        is_text = isinstance(value, ast.JoinedStr) or isinstance(getattr(value, "value", None), str)
        lines += [node.lineno] if is_text and not (documented and k == 0) else []
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):  # no expression is looked at, which is slow
            is_definition = isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
            lines += find_unused_strings(getattr(node, name, []), documented=is_definition)
    return lines


@pytest.mark.long
def test_no_string_is_an_unused_statement() -> None:
    """A string on the line after an assignment is lost without brackets; no module has such a string."""
    assert find_unused_strings(
        ast.parse('def f():\n    """Doc."""\n    text = "one half, "\n    f"{1} other half"\n').body
    ) == [4]
    adapters = {str(path): ast.parse(text) for path, text in read_texts().items() if str(path).startswith("adapters/")}
    assert len(adapters) > 10
    trees = {path: parse_module(path) for path in read_modules()} | adapters
    assert {path: lines for path, module in trees.items() if (lines := find_unused_strings(module.body))} == {}


@pytest.mark.long
def test_no_message_or_page_uses_an_old_word() -> None:
    """Strings, templates, README and documents except decisions use no old word of the table in CONTRIBUTING.md."""
    bare = [normalise_text(old) for old in OLD_WORDS]
    read = {
        path: collect_strings(parse_module(path))
        for path, text in read_modules().items()
        if any(w in normalise_text(text) for w in bare)
    }
    pages = [ROOT / "README.md", *(path for path in (ROOT / "docs").rglob("*.md") if "decisions" not in path.parts)]
    pages += (SOURCE / "report" / "templates").iterdir()
    read |= {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in pages}
    found = [
        (path, f"say {new!r}", use)
        for path, text in read.items()
        for old, new in OLD_WORDS.items()
        for use in find_uses(old, text)
    ]
    assert found == []
