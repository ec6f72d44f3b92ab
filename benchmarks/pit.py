"""Speed of PIT with and without skipping frames, and of another version: ``python -m benchmarks.pit [discs ...]``.

The discs fill 0.3 of a box, and PIT makes 60 frames per second. The times are medians of processor times.
"""

from __future__ import annotations

import statistics
from contextlib import ExitStack
from typing import TYPE_CHECKING

from benchmarks.arguments import count, parser, run
from benchmarks.baseline import Interpreter

if TYPE_CHECKING:
    from collections.abc import Sequence

#: For each line with a number of frames, prints the seconds of these frames. It works with older versions of Carom.
_GAS = """
import sys, time
from carom.solvers.pit.clock import FrameClock
try:
    from carom.solvers.pit.solve import start_pit_run
    from carom.studies.bench.gas import build_gas_scene
except ImportError:
    from carom.bench.gas import gas_scene as build_gas_scene
    from carom.solvers.pit.solve import pit_run as start_pit_run
run = start_pit_run(build_gas_scene(int({discs!r}), 0.3), FrameClock(rate_hz=60.0), skipping={skipping!r})
for line in sys.stdin:
    begin = time.process_time()
    run.advance_frames(int(line))
    print(time.process_time() - begin, flush=True)
"""

#: Numbers of discs. Skipping saves least with two discs. With the largest number, a frame of the loop without skipping
#: takes seconds.
_SIZES = (2, 16, 64, 1000, 100_000)
#: Number of frames per round, multiplied by the number of discs: a round takes some hundredths of a second. Largest
#: number of tests of pairs in a round of the loop without skipping.
_DISC_FRAMES, _TESTS = 300_000, 2_000_000_000


def compare(discs: int, baseline: str, rounds: int) -> str:
    """Return a line: milliseconds per frame with skipping, and the ratios of two other times to this time.

    The other times are the time of the loop without skipping, and the time of the baseline.
    """
    frames = max(3, _DISC_FRAMES // discs)
    plain_frames = max(1, min(frames, _TESTS // discs**2))
    forms = [(True, frames, None), (False, plain_frames, None)] + ([(True, frames, baseline)] if baseline else [])
    with ExitStack() as stack:
        processes = [
            (stack.enter_context(Interpreter(_GAS.format(discs=discs, skipping=skipping), python)), count)
            for skipping, count, python in forms
        ]
        seconds = [[process.ask(str(count))[0] / count for process, count in processes] for _ in range(rounds)]
    skipping_s, plain_s, *before = (statistics.median(column) for column in zip(*seconds, strict=True))
    line = f"{discs:8d} {frames:7d} {1e3 * skipping_s:10.4g} {plain_s / skipping_s:16.3g}"
    return line + "".join(f" {before_s / skipping_s:20.3g}" for before_s in before)


def main(sizes: Sequence[int], baseline: str, rounds: int) -> None:
    """Print the table."""
    heads = f"{'discs':>8} {'frames':>7} {'ms a frame':>10} {'unskipped ratio':>16}"
    print(heads + (f" {'baseline ratio':>20}" if baseline else ""))
    for discs in sizes:
        print(compare(discs, baseline, rounds), flush=True)


if __name__ == "__main__":
    command = parser("benchmarks.pit", __doc__)
    command.add_argument("sizes", nargs="*", type=count, default=_SIZES, metavar="discs", help="numbers of discs")
    command.add_argument(
        "--baseline", default="", metavar="PYTHON", help="Python interpreter with another version of Carom"
    )
    command.add_argument("--rounds", type=count, default=9, help="number of timings")
    run(command, main)
