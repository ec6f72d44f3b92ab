"""Coverage of the compiled code: ``make coverage-compiled``. Arguments are pytest's.

The extension is built once more, into ``build/coverage``, with counters for the lines of the core and of the .pyx and
.pxd files. The tests run on that build, and gcov reports which lines and branches they executed. A line that several
modules inline counts once: as executed if one of them executed it.

Branches are those of the C code. A comparison has two, and a chain of `and` has two for each part. Functions that
Python calls (`def`) have one more for each error that Cython checks for.
"""

import json
import os
import shutil
import subprocess
import sys
from collections import defaultdict
from collections.abc import Collection
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build/coverage"

#: Tests that run without arguments.
TESTS = ("tests/unit", "tests/validation")

#: How often each line was executed (number 0), and each of its branches (from 1), by file, line and number.
Counts = dict[str, dict[tuple[int, int], int]]


def build() -> Path:
    """Build the package with counters, and return its path."""
    shutil.rmtree(BUILD, ignore_errors=True)
    library = BUILD / "lib"
    command = [sys.executable, "setup.py", "--quiet", "build", "--build-base", str(BUILD), "--build-lib", str(library)]
    environment = {**os.environ, "CAROM_COVERAGE": "1"}
    subprocess.run(command, cwd=ROOT, check=True, env=environment)
    return library


def run_gcov(notes: Path) -> list[dict[str, Any]]:
    """Return gcov's report of an object file, source by source."""
    command = ["gcov", "--json-format", "--stdout", "--branch-probabilities", str(notes)]
    files: list[dict[str, Any]] = json.loads(subprocess.check_output(command, stderr=subprocess.DEVNULL))["files"]
    return files


def collect() -> Counts:
    """Return the counts of all sources, over all modules."""
    counts: Counts = defaultdict(lambda: defaultdict(int))
    for notes in sorted(BUILD.rglob("*.gcno")):
        for source in run_gcov(notes):
            name = find_source_name(str(source["file"]))
            if name is None:
                continue
            for line in source["lines"]:
                for k, place in enumerate((line, *line["branches"])):
                    counts[name][line["line_number"], k] += place["count"]
    return counts


def find_source_name(file: str) -> str | None:
    """Return the path of a source in the package; None for generated code, and for sources outside the package."""
    if not file.endswith((".pyx", ".pxd", ".h", ".c")):
        return None
    path = next((path for path in (ROOT / file, ROOT / "src" / file) if path.exists()), None)
    return path.relative_to(ROOT / "src").as_posix() if path and path.is_relative_to(ROOT / "src" / "carom") else None


def format_share(counts: list[int]) -> str:
    """Return how many counts are above 0, of how many, and this as a percentage."""
    reached = sum(count > 0 for count in counts)
    return f"{reached:6d} of {len(counts):5d} {100 * reached / max(len(counts), 1):5.1f} %"


def format_row(name: str, counts: Collection[tuple[tuple[int, int], int]]) -> str:
    """Return the row of a source: how many of its lines and branches were executed."""
    lines = [count for (_, branch), count in counts if branch == 0]
    branches = [count for (_, branch), count in counts if branch > 0]
    return f"{name:48}{format_share(lines):>24}{format_share(branches):>24}"


def format_table(counts: Counts) -> str:
    """Return a row for each source, with the lines that were never executed."""
    rows = [f"{'source':48}{'lines':>24}{'branches':>24}  lines never executed"]
    for name, of_source in sorted(counts.items()):
        never = [str(line) for (line, branch), count in sorted(of_source.items()) if branch == count == 0]
        rows.append(f"{format_row(name, of_source.items())}  {', '.join(never)}")
    return "\n".join([*rows, format_row("all", [row for of_source in counts.values() for row in of_source.items()])])


def main(arguments: list[str]) -> int:
    """Build, run the tests, print the table; return what pytest returned."""
    library = build()
    command = [sys.executable, "-m", "pytest", "-q", "-n", "auto", "--dist", "worksteal", *(arguments or TESTS)]
    done = subprocess.run(command, cwd=ROOT, check=False, env={**os.environ, "PYTHONPATH": str(library)})
    sys.stdout.write(format_table(collect()) + "\n")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
