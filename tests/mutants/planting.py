"""Faults: replaced operators, comparisons, words, numbers and constants in the text of Python, Cython and C.

A tool for Python alone would omit the compiled core, which contains most of the numerics. In a copy of the sources each
place becomes ``(another if chosen(7) else itself)``, in C ``(chosen(7) ? another : itself)``. One build contains many
faults, and an environment variable selects the fault of a process.
"""

import keyword
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from tests.mutants.packages import PACKAGES

#: Environment variable with the number of a process's fault.
VARIABLE = "CAROM_FAULT"

_PAIRS = ("< <=", "> >=", "== !=", "+ -", "and or", "&& ||", "True False", "true false", "min max", "greater lesser")
_OTHER = {one: other for pair in _PAIRS for one, other in (pair.split(), pair.split()[::-1])} | {"*": "+", "/": "*"}
#: Ends of operands: a token before a binary operator.
_ENDS = re.compile(r"[\w\])]$")
_HEAD = r"\s+(?:(?:if|elif|while|return)\s|(?:cdef (?:double|bint) )?[\w.\[\]]+ [-+*]?= )"
_STATEMENT = re.compile(rf"^(?P<head>{_HEAD})(?P<what>[^#]+?)(?P<tail>:?)$")
_CONSTANT = re.compile(r"^(?P<head>_?[A-Z][A-Z_0-9]*(?:: \w+)? = )(?P<what>-?[\d._e*-]+)$")
_FUNCTION = re.compile(r"^\s*(?:async def|def|cdef|cpdef) .*\($|^\s*(?:def|cdef|cpdef) .*\(.*\).*:$")
#: An expression that is written twice must not contain an address, a cast, another assignment or a loop.
_LEFT_OUT = re.compile(
    r"(?:^|[(,=\s])&\s*[a-z]|<\w[\w ]*\**>| = |<<|:=|lambda|yield|await|\bfor\b|unlikely|likely|sizeof|range\("
)

#: A statement of C on one line; a comment may follow. The values of braces and of `static` are constants.
_C_HEAD = r"\s+(?:return |(?:\}? ?else )?if \(|while \(|(?!static )(?:(?:const )?\w+ \**)?[\w.\[\]>-]+ [-+*/]?= (?!\{))"
_C_STATEMENT = re.compile(rf"^(?P<head>{_C_HEAD})(?P<what>.+?)(?P<tail>(?:;|\)|\) \{{)(?:\s*/\*.*\*/)?)$")
#: A token of Python or C; a string is one, so that its content has no faults.
_TOKEN = re.compile(
    r"""'[^']*'|"[^"]*"|0x[\da-f.]+p[-+]?\d+|\.?\d[\d.]*(?:e[-+]?\d+)?\w*|\w+|"""
    r"""->|<<|>>|&&|\*\*|//|\|\||[<>=!]=|\+\+|--|[-+*/%&|^]=|\S"""
)
#: Likewise in C: no cast to a pointer, and no other assignment.
_C_LEFT_OUT = re.compile(r"\w \*+\)| = |\+\+|--")

_SWITCH_H = """
#ifndef CAROM_PLANTED_H
#define CAROM_PLANTED_H

#include <pthread.h>
#include <stdlib.h>

static int carom_fault = -1;

static void carom_fault_again(void) {
    carom_fault = -1;
}

static int carom_has_fault(int number) {
    if (carom_fault < 0) {
        const char *chosen = getenv("CAROM_FAULT");
        carom_fault = chosen ? atoi(chosen) : 0;
        pthread_atfork(NULL, NULL, carom_fault_again);
    }
    return carom_fault == number;
}

#endif
"""
_SWITCH_PXD = """
cdef extern from "carom/planted.h":
    bint has_fault "carom_has_fault" (int number) noexcept nogil
"""
_SWITCH_PYTHON = f'''
"""Number of the fault of this process."""
import os
NUMBER = [int(os.environ.get("{VARIABLE}", "0"))]
'''


class Fault(NamedTuple):
    """A fault in one line.

    Attributes:
        package: The package whose tests must notice it.
        path: The source, from the project's root.
        line: Number of the line, from 1.
        before: The line without its indentation.
        after: The line with the fault.
        constant: The name of the constant of a module that has another value; empty for a place in a function.
    """

    package: str
    path: str
    line: int
    before: str
    after: str
    constant: str = ""

    @property
    def key(self) -> str:
        """Identity of the fault as long as the line exists, wherever in the file."""
        return f"{self.path}: {self.before} -> {self.after}"


def list_faults(root: Path) -> list[Fault]:
    """Return all possible faults of all packages, by path and line."""
    return list({fault.key: fault for package in PACKAGES for fault in iterate_faults(root, package)}.values())


def iterate_faults(root: Path, package: str) -> Iterator[Fault]:
    """Yield the possible faults of one package."""
    for path in sorted(list_sources(root, package)):
        if path.suffix in (".py", ".pyx", ".pxd"):
            yield from _faults_of(package, path.relative_to(root).as_posix(), path.read_text())
        elif path.suffix in (".h", ".c"):
            yield from _faults_of_c(package, path.relative_to(root).as_posix(), path.read_text())


def list_sources(root: Path, package: str) -> set[Path]:
    """Return the sources of a package."""
    patterns = PACKAGES[package].sources
    found = {path for pattern in patterns if pattern[0] != "!" for path in root.glob(pattern)}
    return found - {path for pattern in patterns if pattern[0] == "!" for path in root.glob(pattern[1:])}


def _faults_of_c(package: str, path: str, text: str) -> Iterator[Fault]:
    known, commented = {*re.findall(r"\w+", text), "true", "false"}, False
    for number, line in enumerate(text.splitlines(), start=1):
        place = None if commented else _C_STATEMENT.match(line)
        commented = line.rfind("/*") > line.rfind("*/") or (commented and "*/" not in line)
        if place is None or not _is_whole(place["what"]) or _C_LEFT_OUT.search(place["what"]):
            continue
        for other in _alternatives(place["what"], known):
            yield Fault(package, path, number, line.strip(), f"{place['head']}{other}{place['tail']}".strip())


def _faults_of(package: str, path: str, text: str) -> Iterator[Fault]:
    lines, known = text.splitlines(), {*re.findall(r"\w+", text), *keyword.kwlist, "min", "max"}
    for number, (line, inside) in enumerate(zip(lines, _in_functions(lines), strict=True), start=1):
        constant = _CONSTANT.match(line)
        if constant and path.endswith(".py"):
            name, value = line.split(":" if ": " in line.split("=")[0] else " ", 1)[0], constant["what"]
            yield Fault(package, path, number, line, f"{constant['head']}2 * ({value})", name)
        place = _STATEMENT.match(line) if inside else None
        if place is not None and not _LEFT_OUT.search(place["what"]) and ": " not in place["what"]:
            for other in _alternatives(place["what"], known):
                after = f"{place['head']}{other}{place['tail']}"
                yield Fault(package, path, number, line.strip(), after.strip())


def _in_functions(lines: list[str]) -> Iterator[bool]:
    """Whether each line is in the body of a function, and in no docstring."""
    depth, quoted = -1, False
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if line.strip() and indent <= depth and not line.strip().startswith(")"):
            depth = -1
        if depth < 0 and not quoted and _FUNCTION.match(line):
            depth = indent
            yield False
        else:
            yield depth >= 0 and not quoted and '"""' not in line and _is_whole(line)
        quoted ^= line.count('"""') % 2 == 1


def _is_whole(line: str) -> bool:
    """Whether a line is a complete statement with closed brackets."""
    return all(line.count(a) == line.count(b) for a, b in ("()", "[]", "{}")) and not line.rstrip().endswith(
        (",", "\\")
    )


def _alternatives(expression: str, known: set[str]) -> Iterator[str]:
    """Yield the expression with one token replaced, for each token; new names must occur in the source."""
    for token in _TOKEN.finditer(expression):
        text, begin, end = token[0], token.start(), token.end()
        other, first = _OTHER.get(text), text.lstrip(".")[:1]
        if first.isidentifier() and other not in known:
            other = None
        if text in ("not", "!"):
            other, end = "", end + (text == "not")
        elif first.isdigit():
            other = "1" if text in ("0", "0.0") else f"(2 * {text})"
        elif not first.isidentifier() and not _ENDS.search(expression[:begin].rstrip()):
            continue  # a sign, a star before arguments, or what a pointer points to
        if other is not None:
            yield expression[:begin] + other + expression[end:]


def make_copy(root: Path, copy: Path, faults: list[tuple[int, Fault]]) -> None:
    """Copy the project, plant these numbered faults in the copy, and build its extension."""
    shutil.rmtree(copy, ignore_errors=True)
    for name in ("src", "adapters", "tests", "benchmarks", "build_backend", "docs"):
        shutil.copytree(root / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", "*.so", "node_modules"))
    for name in ("pyproject.toml", "setup.py", "README.md", "Makefile", "CHANGELOG.md", "CONTRIBUTING.md"):
        shutil.copy(root / name, copy / name)
    (copy / "src/carom/planted.h").write_text(_SWITCH_H)
    (copy / "src/carom/planted.pxd").write_text(_SWITCH_PXD)
    (copy / "src/carom/planted.py").write_text(_SWITCH_PYTHON)
    by_path: dict[str, list[tuple[int, Fault]]] = {}
    for number, fault in faults:
        by_path.setdefault(fault.path, []).append((number, fault))
    for path, planted in by_path.items():
        _plant(copy / path, planted)
    if (copy / "src/carom/core/built.pyx").exists():
        subprocess.run([sys.executable, "setup.py", "--quiet", "build_ext", "--inplace"], cwd=copy, check=True)


def _plant(path: Path, planted: list[tuple[int, Fault]]) -> None:
    """Replace the lines of faults by lines with both values; running.py changes constants by name."""
    lines, is_c, is_python = path.read_text().splitlines(), path.suffix in (".h", ".c"), path.suffix == ".py"
    statement = _C_STATEMENT if is_c else _STATEMENT
    for number, fault in planted:
        if fault.constant:
            continue
        place, other = statement.match(lines[fault.line - 1]), statement.match(f"    {fault.after}")
        if place is None or other is None:
            raise ValueError(f"{fault.path}:{fault.line} is no place for a fault")
        # The two values of a condition in C must have one type, and one of them may be a pointer.
        is_condition = place["head"].rstrip().endswith("(") or place["head"].split()[0] in ("if", "elif", "while")
        truth = "" if is_python or not is_condition else "!!" if is_c else "<bint>"
        one, two = f"{truth}({other['what']})", f"{truth}({place['what']})"
        chosen = f"NUMBER[0] == {number}" if is_python else f"has_fault({number})"
        switched = f"(carom_has_fault({number}) ? {one} : {two})" if is_c else f"({one} if {chosen} else {two})"
        lines[fault.line - 1] = f"{place['head']}{switched}{place['tail']}"
    docstring = "\n".join(lines).split('"""')[:2]
    head, at = "from carom.planted cimport has_fault", "".join(docstring).count("\n") + 1
    if is_c:
        head = '#include "carom/planted.h"'
        at = next(k for k, line in enumerate(lines) if line.startswith("#include"))
    elif is_python:
        head = "from carom.planted import NUMBER"
        at = next((k + 1 for k, line in enumerate(lines) if line.startswith("from __future__")), at)
    path.write_text("\n".join([*lines[:at], head, *lines[at:]]) + "\n")
