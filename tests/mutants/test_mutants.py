"""Planting and selecting faults, and processes with one fault."""

import os
import shutil
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from tests.mutants import running
from tests.mutants.__main__ import load_state, parse_reasons
from tests.mutants.packages import PACKAGES
from tests.mutants.planting import VARIABLE, iterate_faults, list_faults, list_sources, make_copy

ROOT = Path(__file__).parents[2]

SOURCE = '''
"""A module."""

from __future__ import annotations

LIMIT = 3


def middle(a: float, b: float) -> float:
    """Return what lies between a < b."""
    if a < b and not b < 0:
        return a + (b - a) / 2
    return min(a, b)
'''.lstrip()

SOURCE_C = """
/* A header: a < b. */

#include <stdbool.h>

/* Return what is between two numbers,
   if (a < b) { */
static inline double middle(double a, double b) {
    const double *smallest = &b;
    bool is_first = !(b < a); /* if (a < b) */
    if (is_first) {
        smallest = &a;
        return *smallest + 0.5 * (b - a);
    } else if (*smallest < a)
        return b;
    return (double)a;
}
""".lstrip()


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project of a Python module and a C header in the package of the physics, without a build."""
    root = tmp_path_factory.mktemp("project")
    (root / "src/carom/core").mkdir(parents=True)
    (root / "src/carom/__init__.py").write_text("")
    (root / "src/carom/core/__init__.py").write_text("")
    (root / "src/carom/core/middle.py").write_text(SOURCE)
    (root / "src/carom/core/feature.h").write_text(SOURCE_C)
    for name in ("adapters", "tests", "benchmarks", "build_backend", "docs"):
        (root / name).mkdir()
    for name in ("pyproject.toml", "setup.py", "README.md", "Makefile", "CHANGELOG.md", "CONTRIBUTING.md"):
        (root / name).write_text("")
    return root


def list_changes(project: Path, suffix: str) -> set[tuple[str, str]]:
    return {(fault.before, fault.after) for fault in list_faults(project) if fault.path.endswith(suffix)}


def test_faults_are_planted_in_statements_and_constants_only(project: Path) -> None:
    """Comparisons, operators, words, numbers and constants have faults; signatures and docstrings have none."""
    condition, sum_ = "if a < b and not b < 0:", "return a + (b - a) / 2"
    assert list_changes(project, ".py") == {
        ("LIMIT = 3", "LIMIT = 2 * (3)"),
        (condition, "if a <= b and not b < 0:"),
        (condition, "if a < b or not b < 0:"),
        (condition, "if a < b and b < 0:"),
        (condition, "if a < b and not b <= 0:"),
        (condition, "if a < b and not b < 1:"),
        (sum_, "return a - (b - a) / 2"),
        (sum_, "return a + (b + a) / 2"),
        (sum_, "return a + (b - a) * 2"),
        (sum_, "return a + (b - a) / (2 * 2)"),
        ("return min(a, b)", "return max(a, b)"),
    }


def test_faults_are_planted_in_c_statements_only(project: Path) -> None:
    """Faults in C are in statements, and not in comments, pointer stars and casts."""
    first, sum_ = "bool is_first = !(b < a); /* if (a < b) */", "return *smallest + 0.5 * (b - a);"
    assert list_changes(project, ".h") == {
        (first, "bool is_first = (b < a); /* if (a < b) */"),
        (first, "bool is_first = !(b <= a); /* if (a < b) */"),
        (sum_, "return *smallest - 0.5 * (b - a);"),
        (sum_, "return *smallest + (2 * 0.5) * (b - a);"),
        (sum_, "return *smallest + 0.5 + (b - a);"),
        (sum_, "return *smallest + 0.5 * (b + a);"),
        ("} else if (*smallest < a)", "} else if (*smallest <= a)"),
    }


def test_process_has_only_the_requested_fault(project: Path, tmp_path: Path) -> None:
    """Python and C compute the original results without a number; with a number, those of that fault."""
    faults, copy = [fault for fault in list_faults(project) if not fault.constant], tmp_path / "copy"
    make_copy(project, copy, list(enumerate(faults, start=1)))
    main = tmp_path / "main.c"
    main.write_text(
        '#include "carom/core/feature.h"\n#include <stdio.h>\n'
        'int main(void) { printf("%g %g\\n", middle(1.0, 4.0), middle(4.0, 1.0)); }\n'
    )
    code = "from carom.core.middle import middle; print('{:g} {:g}'.format(middle(1.0, 4.0), middle(4.0, 1.0)))"
    programs = {".py": [sys.executable, "-c", code]}
    if shutil.which("cc") is not None:
        programs[".h"] = [str(tmp_path / "main")]
        subprocess.run(["cc", "-std=c11", "-I", copy / "src", main, "-o", *programs[".h"], "-lpthread"], check=True)
    numbers = {fault.after: number for number, fault in enumerate(faults, start=1)}
    for suffix, after, expected in (
        (".py", None, "2.5 1\n"),
        (".py", "return a + (b - a) * 2", "7 1\n"),
        (".py", "return max(a, b)", "2.5 4\n"),
        (".h", None, "2.5 1\n"),
        (".h", "return *smallest - 0.5 * (b - a);", "-0.5 1\n"),
        (".h", "bool is_first = (b < a); /* if (a < b) */", "1 2.5\n"),
    ):
        number = str(numbers[after]) if after else "0"
        environment = {**os.environ, "PYTHONPATH": str(copy / "src"), VARIABLE: number}
        if suffix in programs:
            assert subprocess.check_output(programs[suffix], env=environment, text=True) == expected


def test_every_source_of_the_core_is_in_one_package() -> None:
    """Every source of the compiled core is in exactly one package; the WebAssembly sources are in none."""
    found = Counter(path for package in PACKAGES for path in list_sources(ROOT, package))
    for path in (ROOT / "src/carom/core").rglob("*"):
        if path.suffix in (".pyx", ".pxd", ".h", ".c"):
            assert found[path] == ("wasm" not in path.parts), path


def test_every_package_has_faults_and_existing_tests() -> None:
    """Every package has at least one place for a fault, and all its test files exist."""
    for package in PACKAGES:
        assert any(True for _ in iterate_faults(ROOT, package)), package
    missing = [
        test for package in PACKAGES.values() for test in package.tests if not (ROOT / test.split("::")[0]).exists()
    ]
    assert missing == []


def test_waiting_process_is_killed_by_clock_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that waits without an end and uses no processor time is killed and reported as "no end"."""

    def forever(*_: object) -> None:
        time.sleep(3600.0)
        os._exit(1)  # if nothing kills the process, the result is "a crash"

    monkeypatch.setattr(running, "_run", forever)
    assert running.run_with_fault([], 1, None, 0.01) == ("no end", {})


def test_state_file_of_an_earlier_version_is_refused(tmp_path: Path) -> None:
    """A state file whose rows have no package ends the program with the name of the file."""
    state = tmp_path / "mutants.jsonl"
    state.write_text('{"key": "a.py: x -> y", "room": "physics", "line": 3, "by": ""}\n', encoding="utf-8")
    with pytest.raises(SystemExit, match=r"state of an earlier version: delete .*mutants\.jsonl"):
        load_state(state, {"a.py: x -> y"})


def test_every_listed_fault_is_in_a_file_that_exists() -> None:
    """`docs/contributing/reliability.md` lists no fault of a deleted file."""
    keys = parse_reasons((ROOT / "docs/contributing/reliability.md").read_text(encoding="utf-8"))
    assert keys
    assert not [key for key in keys if not (ROOT / key.split(": ")[0]).exists()]
