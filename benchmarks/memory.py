"""Memory and time of commands that read or write large files of results: ``python -m benchmarks.memory [rows]``.

The first file contains the rows of the committed sample many times, each time with other names of scenes. In the second
file, one of twenty rows has larger errors. Each printed row shows a command: elapsed time, processor time (with child
processes), the largest memory of a process, and the size of the file of results.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.arguments import count, parser, run

SAMPLE = Path(__file__).parents[1] / "reports" / "sample" / "results.jsonl"
#: Every 20th row of the second file has larger errors.
CHANGED = 20
_READ = (
    "import sys, pathlib; from carom.report.results_file.results_jsonl import read_records; "
    "read_records(pathlib.Path(sys.argv[1]))"
)


def write_copies(path: Path, rows: int, *, changed: bool) -> None:
    """Write a results.jsonl with copies of the sample's rows. Scenes have new names in each copy."""
    head, *lines = (json.loads(line) for line in SAMPLE.read_text(encoding="utf-8").splitlines())
    names = [f" {k}" for k in range(-(-rows // len(lines)))]
    whole = {
        **head,
        "rows": rows,
        "scenes": {f"{scene}{name}": fields for name in names for scene, fields in head["scenes"].items()},
        "sampling": [{**one, "scene": f"{one['scene']}{name}"} for name in names for one in head["sampling"]],
    }
    with path.open("w", encoding="utf-8") as file:
        for line in (whole, *_copies(lines, names, rows, changed)):
            file.write(json.dumps(line, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n")


def _copies(lines: list[dict[str, Any]], names: list[str], rows: int, changed: bool) -> Iterator[dict[str, Any]]:
    for k in range(rows):
        line = dict(lines[k % len(lines)])
        line["scene"] += names[k // len(lines)]
        if changed and k % CHANGED == 0 and line["total"]:
            line["total"] = {**line["total"], "velocity": 2.0 * (line["total"]["velocity"] or 0.0) + 1e-3}
        yield line


def measure(*command: str) -> tuple[float, float, float]:
    """Run a command. Return elapsed seconds, seconds of processor time, and the megabytes of its largest process."""
    began = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)  # noqa: S603 - this Python
    _, status, used = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - began
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise OSError(f"{' '.join(command)} ended with exit code {process.returncode}")
    return seconds, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main(rows: int, *, suite: bool) -> None:
    """Print a row for each command."""
    carom = (sys.executable, "-m", "carom")
    print(f"{'command':24} {'seconds':>9} {'processor':>9} {'peak MB':>8} {'file MB':>8}")
    with tempfile.TemporaryDirectory(prefix="carom-memory-") as place:
        old, new, page = (Path(place) / name for name in ("old.jsonl", "new.jsonl", "page.html"))
        write_copies(old, rows, changed=False)
        write_copies(new, rows, changed=True)
        report = Path(place) / "report"
        tasks: dict[str, tuple[tuple[str, ...], Path]] = {
            f"read {rows:,} rows": ((sys.executable, "-c", _READ, str(old)), old),
            "carom diff": ((*carom, "diff", str(old), str(new)), new),
            "carom diff --page": ((*carom, "diff", str(old), str(new), "--page", str(page)), page),
            "carom report": ((*carom, "report", str(old)), old),
            "carom report --page": ((*carom, "report", str(old), "--page", f"{page}.html"), Path(f"{page}.html")),
        }
        if suite:
            words = ("run", "--no-timing", "--fail-on", "never", "--report", str(report))
            tasks["carom run --no-timing"] = ((*carom, *words), report / "index.html")
        for name, (command, file) in tasks.items():
            seconds, processor_s, megabytes = measure(*command)
            size = file.stat().st_size / 1e6
            print(f"{name:24} {seconds:9.1f} {processor_s:9.1f} {megabytes:8.0f} {size:8.1f}", flush=True)


if __name__ == "__main__":
    arguments = parser("benchmarks.memory", __doc__)
    arguments.add_argument("rows", nargs="?", type=count, default=100_000, help="rows of results.jsonl")
    arguments.add_argument("--suite", action="store_true", help="also run the built-in scenes")
    run(arguments, main)
