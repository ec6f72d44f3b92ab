"""Cost of starting processes, and of checking scenes for overlaps: ``python -m benchmarks.start``.

Each row shows the median processor time. With ``--baseline``, the row also shows the time of another version of Carom,
measured in turn. Memory is the growth of a process's peak memory.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.arguments import count, parser, run

_PYDANTIC = (
    "from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, Strict, "
    "ValidationError, WithJsonSchema"
)
_FIRST_SOLVE = (
    "from carom import Disc, Scene, solve_pic; "
    "solve_pic(Scene(name='first', duration_s=5, discs=["
    "Disc(position_m=(3 * k, 0.1 * k), velocity_m_s=(1 - k, 0), radius_m=0.5) for k in range(3)]))"
)
_RUN = ("-m", "carom", "run", "--fail-on", "never")
#: Name of a row, and arguments of Python. The times include child processes.
_PROCESSES = (
    ("python", ("-c", "pass")),
    ("import numpy, pydantic", ("-c", f"import numpy; {_PYDANTIC}")),
    ("both and an empty pydantic model", ("-c", f"import numpy; {_PYDANTIC}\nclass Empty(BaseModel): pass")),
    ("import carom, first solve", ("-c", _FIRST_SOLVE)),
    ("carom --help", ("-m", "carom", "--help")),
    ("one cell: pymunk on paper/missed", (*_RUN, "paper/missed", "-e", "pymunk", "-p", "tuned", "--dt", "1/24")),
)
#: Rows that take half a minute each, and the largest number of their measurements.
_SUITES = (
    ("carom run --no-timing", (*_RUN, "--no-timing")),
    ("carom run", _RUN),
)
_MOST_SUITES = 3
_ARRANGEMENTS = ("grid", "column", "random", "ratio 1:1e6", "outlier", "one place, immovable", "one place")
#: Time limit of the baseline, in seconds. The baseline's time may grow with the square of the number of discs.
_PATIENCE_S = 20.0


def process_seconds(command: list[str]) -> float:
    """Return the processor time of a process, in seconds."""
    before = os.times()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - an interpreter that the user names
    after = os.times()
    return sum(after[2:4]) - sum(before[2:4])


def worker(python: str, *task: object, patience_s: float | None = None) -> tuple[float, float, str] | None:
    """Return seconds, MiB and outcome of a task of `benchmarks.start_worker`; None after the time limit."""
    source = Path(__file__).with_name("start_worker.py").read_text(encoding="utf-8")
    try:
        done = subprocess.run(  # noqa: S603 - an interpreter that the user names, and our own text
            [python, "-c", source, *map(str, task)], check=True, capture_output=True, text=True, timeout=patience_s
        )
    except subprocess.TimeoutExpired:
        return None
    seconds, memory, ended = done.stdout.strip().split("\t")
    return float(seconds), float(memory), ended


def process_rows(baseline: str, repeats: int) -> None:
    """Print the processor times of processes."""
    print(f"{'process':32} {'ms':>8} {'baseline ms':>12}")
    for name, arguments in (*_PROCESSES, *_SUITES):
        ours, theirs = [], []
        for _ in range(repeats if (name, arguments) in _PROCESSES else min(repeats, _MOST_SUITES)):
            ours.append(process_seconds([sys.executable, *arguments]))
            if baseline:
                theirs.append(process_seconds([baseline, *arguments]))
        beside = f"{1e3 * statistics.median(theirs):.0f}" if theirs else "-"
        print(f"{name:32} {1e3 * statistics.median(ours):8.0f} {beside:>12}", flush=True)


def check_rows(tasks: list[tuple[str, str, int]], baseline: str, repeats: int) -> None:
    """Print processor time and memory of checks: a row per task, arrangement and number of discs."""
    print(f"{'task':7} {'arrangement':21} {'discs':>8} {'s':>8} {'MiB':>6} {'baseline s':>11} {'MiB':>6}  outcome")
    for task in tasks:
        ours, theirs = [], []
        for _ in range(repeats):
            ours.append(worker(sys.executable, *task))
            if baseline and None not in theirs:
                theirs.append(worker(baseline, *task, patience_s=_PATIENCE_S))
        what, arrangement, discs = task
        seconds, memory = _medians(ours)
        if None in theirs:
            beside = f"{'> ' + format(_PATIENCE_S, '.0f'):>11} {'-':>6}"
        elif theirs:
            beside = "{:11.3f} {:6.0f}".format(*_medians(theirs))
        else:
            beside = f"{'-':>11} {'-':>6}"
        ended = ours[0][2] if ours[0] else ""
        print(f"{what:7} {arrangement:21} {discs:8d} {seconds:8.3f} {memory:6.0f} {beside}  {ended}", flush=True)


def _medians(rows: Sequence[tuple[float, float, str] | None]) -> tuple[float, float]:
    done = [row for row in rows if row is not None]
    return statistics.median(row[0] for row in done), statistics.median(row[1] for row in done)


def main(discs: int, many: int, baseline: str = "", repeats: int = 9) -> None:
    """Print the tables."""
    process_rows(baseline, repeats)
    tasks = [("check", arrangement, discs) for arrangement in _ARRANGEMENTS]
    tasks += [("scene", "grid", discs), ("scene", "one place", discs), ("load", "grid", discs)]
    tasks += [("arrays", arrangement, many) for arrangement in _ARRANGEMENTS]
    check_rows(tasks, baseline, repeats)


if __name__ == "__main__":
    command = parser("benchmarks.start", __doc__)
    command.add_argument("--discs", type=count, default=100_000, help="number of discs of scenes")
    command.add_argument("--many", type=count, default=1_000_000, help="number of discs as arrays")
    command.add_argument(
        "--baseline", default="", metavar="PYTHON", help="Python interpreter with another version of Carom"
    )
    command.add_argument("--repeats", type=count, default=9, help="number of measurements")
    run(command, main)
