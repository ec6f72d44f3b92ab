"""Speed and memory of PIC with many discs in a box: ``python -m benchmarks.pic [discs ...]``.

Each row times two runs in turn, each in its own interpreter, and prints the median and the quartiles of the ratios. The
column "x baseline" compares the run with the same run in another version of Carom. The column "recorded x" compares a
run that records all impacts with a run that records none. All times are processor times.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.arguments import count, parser, run
from benchmarks.baseline import Interpreter

_PACKINGS = (0.3, 0.6)
#: Discs and impacts of the small scenes, and the number of runs per timing.
_SMALL = ((2, 1, 2000), (3, 10, 400), (16, 100, 100), (16, 1000, 40), (128, 300, 40), (999, 1000, 10))


class Worker(Interpreter):
    """An interpreter that times a task, see `benchmarks.pic_worker`."""

    def __init__(self, python: str, *task: object) -> None:
        super().__init__(Path(__file__).with_name("pic_worker.py").read_text(encoding="utf-8"), python)
        self.ask(" ".join(map(str, task)))


def paired(one: Worker, other: Worker, size: int, repeats: int) -> tuple[float, str]:
    """Return the median time of worker `one`, and median and quartiles of the ratios of `other`'s time to this time."""
    times, ratios = [], []
    for k in range(repeats):
        if k % 2:
            (there,), (here,) = other.ask(str(size)), one.ask(str(size))
        else:
            (here,), (there,) = one.ask(str(size)), other.ask(str(size))
        times.append(here)
        ratios.append(there / here)
    low, middle, high = statistics.quantiles(ratios, n=4)
    return statistics.median(times), f"{middle:.2f} [{low:.2f} {high:.2f}]"


def kernel_rows(sizes: Sequence[int], baseline: str, impacts: int, repeats: int) -> None:
    """Print the speed, the cost of recording and the memory, for boxes with these numbers of discs."""
    print(f"{'discs':>9} {'packing':>8} {'impacts/s':>10} {'x baseline':>18} {'recorded x':>18} {'bytes/disc':>11}")
    for discs in sizes:
        for packing in _PACKINGS:
            with Worker(sys.executable, "gas", discs, packing, "none") as ours:
                beside = "-"
                if baseline:
                    with Worker(baseline, "gas", discs, packing, "none") as theirs:
                        _, beside = paired(ours, theirs, impacts, repeats)
                with Worker(sys.executable, "gas", discs, packing, "recorded") as recording:
                    seconds, cost = paired(ours, recording, impacts, repeats)
                (memory,) = ours.ask("bytes")
            rate = impacts / seconds
            print(f"{discs:9d} {packing:8.1f} {rate:10.3g} {beside:>18} {cost:>18} {memory:11.0f}", flush=True)


def small_rows(baseline: str, repeats: int) -> None:
    """Print the time of `solve_pic` for scenes with few discs."""
    print(f"{'discs':>9} {'impacts':>8} {'us/solve':>10} {'x baseline':>18}")
    for discs, impacts, solves in _SMALL:
        with Worker(sys.executable, "solve", discs, impacts) as ours:
            other = baseline or sys.executable
            with Worker(other, "solve", discs, impacts) as theirs:
                seconds, beside = paired(ours, theirs, solves, repeats)
        print(f"{discs:9d} {impacts:8d} {seconds / solves * 1e6:10.1f} {beside if baseline else '-':>18}", flush=True)


def start_seconds() -> float:
    """Return the time from starting Python to the first impacts, in seconds."""
    code = (
        "import math; from carom.studies.bench.gas import build_hard_disc_gas;"
        "from carom.solvers.event_driven.run import EventDrivenRun;"
        "EventDrivenRun(build_hard_disc_gas(16, .3)).advance_to(math.inf, 100)"
    )
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True)  # noqa: S603 - our own interpreter and our own text
    return time.perf_counter() - begin


def main(sizes: Sequence[int], baseline: str = "", impacts: int = 300_000, repeats: int = 9) -> None:
    """Print the tables."""
    print(
        f"from the start of Python to 100 impacts: {statistics.median(start_seconds() for _ in range(repeats)):.2f} s"
    )
    small_rows(baseline, repeats)
    kernel_rows(sizes, baseline, impacts, repeats)


if __name__ == "__main__":
    command = parser("benchmarks.pic", __doc__)
    sizes = (1_000, 100_000, 1_000_000)
    command.add_argument("sizes", nargs="*", type=count, default=sizes, metavar="discs", help="numbers of discs")
    command.add_argument(
        "--baseline", default="", metavar="PYTHON", help="Python interpreter with another version of Carom"
    )
    command.add_argument("--impacts", type=count, default=300_000, help="impacts per timing")
    command.add_argument("--repeats", type=count, default=9, help="number of timings")
    run(command, main)
