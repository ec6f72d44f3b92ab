"""PIT with skipping, without it, and in another environment: ``python -m benchmarks.pit [discs ...]``.

A gas at packing .3, 60 frames per second; processor time, medians of alternating runs.
"""

from __future__ import annotations

import statistics
from contextlib import ExitStack
from typing import TYPE_CHECKING

from benchmarks.arguments import count, parser, run
from benchmarks.baseline import Interpreter

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Answers the number of frames by the seconds that they took; written for this Carom and for older ones.
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

#: Numbers of discs, from two, where skipping saves least, to where a frame of the plain loop takes seconds.
_SIZES = (2, 16, 64, 1000, 100_000)
#: Frames a round, times the discs: enough to take some hundredths of a second; and tests a round of plain looping.
_DISC_FRAMES, _TESTS = 300_000, 2_000_000_000


def compare(discs: int, baseline: str, rounds: int) -> str:
    """Return a line: milliseconds a frame, plain over skipping, and the baseline's best form over skipping."""
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
    heads = f"{'discs':>8} {'frames':>7} {'ms a frame':>10} {'plain, times it':>16}"
    print(heads + (f" {'baseline, times it':>20}" if baseline else ""))
    for discs in sizes:
        print(compare(discs, baseline, rounds), flush=True)


if __name__ == "__main__":
    command = parser("benchmarks.pit", __doc__)
    command.add_argument("sizes", nargs="*", type=count, default=_SIZES, metavar="discs", help="sizes of the gas")
    command.add_argument("--baseline", default="", metavar="PYTHON", help="the interpreter of another environment")
    command.add_argument("--rounds", type=count, default=9, help="alternating runs, of which medians are taken")
    run(command, main)
