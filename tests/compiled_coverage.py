"""Coverage of the compiled code: ``make coverage-compiled``; ``python -m tests.compiled_coverage`` hands on arguments.

The extension is built once more, into ``build/coverage``, with counters for the lines of the core and of the .pyx and
.pxd files. The tests run on that build, and gcov reports which lines and branches they reached. A line that several
modules inline counts once: as reached if any of them reached it.

Branches are those of the C code: a comparison in a loop has two, a chain of `and` one pair a link; and in what Python
calls (`def`) there is one more for each error that Cython looks for.
"""

import json
import os
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build/coverage"

#: What is run where nothing else is asked for.
TESTS = ("tests/unit", "tests/validation")

#: Counts of each line, and of each of its branches, by file.
Lines = dict[str, dict[int, int]]
Branches = dict[str, dict[tuple[int, int], int]]


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


def collect() -> tuple[Lines, Branches]:
    """Return the counts of all sources, over all modules."""
    lines: Lines = defaultdict(lambda: defaultdict(int))
    branches: Branches = defaultdict(lambda: defaultdict(int))
    for notes in sorted(BUILD.rglob("*.gcno")):
        for source in run_gcov(notes):
            name = source_name(str(source["file"]))
            if name is None:
                continue
            for line in source["lines"]:
                lines[name][line["line_number"]] += line["count"]
                for k, branch in enumerate(line["branches"]):
                    branches[name][line["line_number"], k] += branch["count"]
    return lines, branches


def source_name(file: str) -> str | None:
    """Return a source's path in the package; None for what Cython wrote, for headers of others, and for the probe."""
    if not file.endswith((".pyx", ".pxd", ".h", ".c")):
        return None
    path = next((path for path in (ROOT / file, ROOT / "src" / file) if path.exists()), None)
    return path.relative_to(ROOT / "src").as_posix() if path and path.is_relative_to(ROOT / "src" / "carom") else None


def format_share(counts: list[int]) -> str:
    """Return how many are above 0, of how many, as a table shows it."""
    reached = sum(count > 0 for count in counts)
    return f"{reached:6d} of {len(counts):5d} {100 * reached / max(len(counts), 1):5.1f} %"


def format_table(lines: Lines, branches: Branches) -> str:
    """Return a row for each source: lines and branches reached, and the lines that were not."""
    rows = [f"{'source':48}{'lines':>24}{'branches':>24}  lines never reached"]
    for name in sorted(lines):
        never = ", ".join(str(number) for number, count in sorted(lines[name].items()) if count == 0)
        reached = format_share(list(lines[name].values())), format_share(list(branches[name].values()))
        rows.append(f"{name:48}{reached[0]:>24}{reached[1]:>24}  {never}")
    every_line = [count for counts in lines.values() for count in counts.values()]
    every_branch = [count for counts in branches.values() for count in counts.values()]
    rows.append(f"{'all':48}{format_share(every_line):>24}{format_share(every_branch):>24}")
    return "\n".join(rows)


def main(arguments: list[str]) -> int:
    """Build, run the tests, print the table; return what pytest returned."""
    library = build()
    command = [sys.executable, "-m", "pytest", "-q", "-n", "auto", "--dist", "worksteal", *(arguments or TESTS)]
    done = subprocess.run(command, cwd=ROOT, check=False, env={**os.environ, "PYTHONPATH": str(library)})
    sys.stdout.write(format_table(*collect()) + "\n")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
