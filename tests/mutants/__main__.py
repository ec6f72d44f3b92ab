"""Plant faults in the numerics, one at a time, and say which no test notices.

    python -m tests.mutants --faults 150 --minutes 30

Those that the document of `--write` lists are tried first; others are drawn at random, as many of each package.
What was tried is kept in `--state` and not tried again, so the command goes on where it was ended; a line that has
changed since is another place. A row of the document keeps its reason as long as its fault goes unnoticed.
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
_BEGIN, _END = "<!-- mutants: begin -->", "<!-- mutants: end -->"
#: A fault that no test notices, and why.
_ROW = re.compile(r"^- `(?P<path>[^`]+)`: `(?P<before>[^`]+)` as `(?P<after>[^`]+)`(?:: (?P<why>.+))?$", re.MULTILINE)


def main() -> None:
    """Carry out the command, and print what no test notices."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--faults", type=int, default=200, help="how many in all, one a package at least, those tried before among them"
    )
    parser.add_argument("--minutes", type=float, default=30.0, help="begin none later than this")
    parser.add_argument("--package", choices=PACKAGES, action="append", help="these packages alone")
    parser.add_argument("--state", type=Path, default=_ROOT / "reports/mutants.jsonl", help="what was tried")
    parser.add_argument("--copy", type=Path, default=_ROOT / "build/mutants", help="where the copy is made")
    parser.add_argument("--write", type=Path, help="put the table into this document")
    asked = parser.parse_args()
    packages = asked.package or list(PACKAGES)
    faults = list_faults(_ROOT)
    reasons = parse_reasons(asked.write.read_text()) if asked.write else {}
    tried = load_state(asked.state, {fault.key for fault in faults})
    numbered = list(enumerate(faults, start=1))
    wanted = [
        pair for pair in select_faults(numbered, packages, asked.faults, set(reasons)) if pair[1].key not in tried
    ]
    if wanted:
        print(f"{len(faults)} places for a fault; {len(tried)} tried before, {len(wanted)} to try", flush=True)
        make_copy(_ROOT, asked.copy, wanted)
        _run(wanted, asked.copy, asked.state, 60.0 * asked.minutes)
        tried = load_state(asked.state, {fault.key for fault in faults})
    table = _table(faults, tried, reasons)
    print(table)
    if asked.write:
        text = asked.write.read_text()
        before, after = text.split(_BEGIN)[0], text.split(_END)[1]
        asked.write.write_text(f"{before}{_BEGIN}\n{table}\n{_END}{after}")


def load_state(state: Path, keys: set[str]) -> dict[str, dict[str, str]]:
    """Return what was found of the faults that there still are, by key.

    The program ends if an earlier version has written the file.
    """
    if not state.exists():
        return {}
    rows = [json.loads(line) for line in state.read_text().splitlines()]
    if any("package" not in row for row in rows):
        sys.exit(f"state of an earlier version: delete {state}")
    return {row["key"]: row for row in rows if row["key"] in keys}


def parse_reasons(text: str) -> dict[str, str]:
    """Return the reasons of the faults that a document lists, by key; empty for one that has none."""
    return {f"{row['path']}: {row['before']} -> {row['after']}": row["why"] or "" for row in _ROW.finditer(text)}


def select_faults(
    faults: list[tuple[int, Fault]], packages: list[str], count: int, first: set[str]
) -> list[tuple[int, Fault]]:
    """Return as many faults of each package, in the order drawn.

    Those whose keys are in `first` come first, all of them; no line of a package more often than needed.
    """
    wanted = []
    for package in packages:
        mine = [pair for pair in faults if pair[1].package == package]
        random.Random(package).shuffle(mine)
        lines: Counter[tuple[str, int]] = Counter()
        turns = []
        for pair in mine:
            turns.append((lines[pair[1].path, pair[1].line], pair))
            lines[pair[1].path, pair[1].line] += 1
        ordered = sorted(turns, key=lambda turn: (turn[1][1].key not in first, turn[0]))
        least = sum(pair[1].key in first for pair in mine)
        wanted += [pair for _, pair in ordered][: max(least, -(-count // len(packages)))]
    return wanted


def _run(wanted: list[tuple[int, Fault]], copy: Path, state: Path, seconds: float) -> None:
    """Try faults in the copy, one process after another."""
    state.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("w", suffix=".json") as job:
        json.dump({"faults": wanted, "seconds": seconds, "results": str(state.resolve())}, job)
        job.flush()
        tests = sorted(
            {
                test
                for _, fault in wanted
                for test in PACKAGES[fault.package].tests
                if (copy / test.split("::")[0]).exists()
            }
        )
        options = "-m pytest -q -s -p no:cacheprovider -p tests.mutants.running"
        command = [sys.executable, *options.split(), *tests]
        paths = os.pathsep.join(str(copy / name) for name in ("src", "adapters", "."))
        environment = {**os.environ, "PYTHONPATH": paths, JOB: job.name, "PYTHONDONTWRITEBYTECODE": "1"}
        subprocess.run(command, cwd=copy, env=environment, check=False)


def _table(faults: list[Fault], tried: dict[str, dict[str, str]], reasons: dict[str, str]) -> str:
    """Return how many were tried and noticed in each package, and those that were not, each with its reason."""
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
