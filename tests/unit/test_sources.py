"""What holds of the sources and documents as they are read: names, sizes, words."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

import carom

ROOT = Path(__file__).resolve().parents[2]
SOURCE = Path(carom.__file__).parent

#: Most lines of a function by package, about a screen.
MOST_LINES = {"cli/": 80, "studies/": 80, "execution/": 60}
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


@pytest.mark.long
def test_functions_are_short() -> None:
    """Functions have at most 80 lines in `cli` and `studies`, and 60 in `execution`."""
    functions = {
        f"{path}:{node.lineno} {node.name}": (node, most)
        for path in read_modules()
        for package, most in MOST_LINES.items()
        if path.startswith(package)
        for node in ast.walk(parse_module(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    assert len(functions) > 200
    assert [name for name, (node, most) in functions.items() if (node.end_lineno or 0) - node.lineno >= most] == []


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
    for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")):
        prose = re.sub(r"```.*?```|`[^`]*`|<[^>]*>", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
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
    adapters = {str(path): ast.parse(path.read_text(encoding="utf-8")) for path in (ROOT / "adapters").rglob("*.py")}
    assert len(adapters) > 10
    trees = {path: parse_module(path) for path in read_modules()} | adapters
    assert {path: lines for path, module in trees.items() if (lines := find_unused_strings(module.body))} == {}
