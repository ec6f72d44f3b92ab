"""Plant faults in the numerics, one at a time, and list those that no test notices.

    python -m tests.mutants --faults 150 --minutes 30

The command first tries the faults that the document of `--write` lists, then random faults, equally many in each
package. It records each result in `--state` and tries no fault twice, so an interrupted run can continue. If a line
changes, its faults count as new. A row of the document keeps its reason until a test notices the fault.
"""

import argparse
import json
import os
import random
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.mutants.packages import PACKAGES
from tests.mutants.planting import Fault, list_faults, make_copy
from tests.mutants.running import JOB

_ROOT = Path(__file__).parents[2]
_COPY = _ROOT / "build/mutants"
_BEGIN, _END = "<!-- mutants: begin -->", "<!-- mutants: end -->"
#: A row of the document: a fault that no test notices, and the reason.
_ROW = re.compile(r"^- `(?P<path>[^`]+)`: `(?P<before>[^`]+)` as `(?P<after>[^`]+)`(?:: (?P<why>.+))?$", re.MULTILINE)


def main() -> None:
    """Run the command, and print the table of faults."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", type=int, default=200, help="number in all, with those of earlier runs")
    parser.add_argument("--minutes", type=float, default=30.0, help="begin no fault after this time")
    parser.add_argument("--package", choices=PACKAGES, action="append", help="only these packages")
    parser.add_argument("--state", type=Path, default=_ROOT / "reports/mutants.jsonl", help="file of results")
    parser.add_argument("--write", type=Path, help="document in which the table is replaced")
    options = parser.parse_args()
    packages = options.package or list(PACKAGES)
    faults = list_faults(_ROOT)
    reasons = parse_reasons(options.write.read_text()) if options.write else {}
    tried = load_state(options.state, {fault.key for fault in faults})
    numbered = list(enumerate(faults, start=1))
    wanted = [
        pair for pair in select_faults(numbered, packages, options.faults, set(reasons)) if pair[1].key not in tried
    ]
    if wanted:
        print(f"{len(faults)} places for a fault; {len(tried)} tried before, {len(wanted)} to try", flush=True)
        make_copy(_ROOT, _COPY, wanted)
        _run(wanted, options.state, 60.0 * options.minutes)
        tried = load_state(options.state, {fault.key for fault in faults})
    table = _table(faults, tried, reasons)
    print(table)
    if options.write:
        text = options.write.read_text()
        before, after = text.split(_BEGIN)[0], text.split(_END)[1]
        options.write.write_text(f"{before}{_BEGIN}\n{table}\n{_END}{after}")


def load_state(state: Path, keys: set[str]) -> dict[str, dict[str, str]]:
    """Return the results of the faults that still exist, by key.

    The program ends if an earlier version has written the file.
    """
    if not state.exists():
        return {}
    rows = [json.loads(line) for line in state.read_text().splitlines()]
    if any("package" not in row for row in rows):
        sys.exit(f"state of an earlier version: delete {state}")
    return {row["key"]: row for row in rows if row["key"] in keys}


def parse_reasons(text: str) -> dict[str, str]:
    """Return the reasons of the faults that a document lists, by key; a missing reason is empty."""
    return {f"{row['path']}: {row['before']} -> {row['after']}": row["why"] or "" for row in _ROW.finditer(text)}


def select_faults(
    faults: list[tuple[int, Fault]], packages: list[str], count: int, first: set[str]
) -> list[tuple[int, Fault]]:
    """Return equally many faults of each package, in random order.

    All faults whose keys are in `first` come first. Faults are spread over as many lines as possible.
    """
    wanted = []
    for package in packages:
        mine = [pair for pair in faults if pair[1].package == package]
        random.Random(package).shuffle(mine)
        lines: Counter[tuple[str, int]] = Counter()
        turns = dict[str, tuple[bool, int]]()
        for _, fault in mine:
            turns[fault.key] = (fault.key not in first, lines[fault.path, fault.line])
            lines[fault.path, fault.line] += 1
        mine.sort(key=lambda pair: turns[pair[1].key])
        least = sum(fault.key in first for _, fault in mine)
        wanted += mine[: max(least, -(-count // len(packages)))]
    return wanted


def _run(wanted: list[tuple[int, Fault]], state: Path, seconds: float) -> None:
    """Try faults in the copy, one after another."""
    state.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("w", suffix=".json") as job:
        json.dump({"faults": wanted, "seconds": seconds, "results": str(state.resolve())}, job)
        job.flush()
        tests = sorted({test for _, fault in wanted for test in PACKAGES[fault.package].tests})
        words = ["-m", "pytest", "-q", "-s", "-p", "no:cacheprovider", "-p", "tests.mutants.running"]
        command = [sys.executable, *words, *tests]
        paths = os.pathsep.join(str(_COPY / name) for name in ("src", "adapters", "."))
        environment = {**os.environ, "PYTHONPATH": paths, JOB: job.name, "PYTHONDONTWRITEBYTECODE": "1"}
        subprocess.run(command, cwd=_COPY, env=environment, check=False)


def _table(faults: list[Fault], tried: dict[str, dict[str, str]], reasons: dict[str, str]) -> str:
    """Return the counts of each package, and the unnoticed faults with their reasons."""
    by_key = {fault.key: fault for fault in faults}
    lines = ["| package | places | tried | noticed | not noticed |", "| --- | ---: | ---: | ---: | ---: |"]
    for package in [*PACKAGES, "all"]:
        mine = [row for row in tried.values() if package in ("all", row["package"])]
        noticed = sum(bool(row["by"]) for row in mine)
        places = sum(package in ("all", fault.package) for fault in faults)
        lines.append(f"| {package} | {places:,} | {len(mine):,} | {noticed:,} | {len(mine) - noticed:,} |")
    left = [by_key[key] for key, row in tried.items() if not row["by"]]
    whys = {key: f": {why}" for key, why in reasons.items() if why}
    lines += ["", *(f"- `{f.path}`: `{f.before}` as `{f.after}`{whys.get(f.key, '')}" for f in sorted(left))]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
