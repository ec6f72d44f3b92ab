"""Cost of walls for discs that meet few of the walls: ``python -m benchmarks.walls [walls ...]``.

Discs fill 0.3 of a box. The benchmark compares this scene with scenes that have more walls: half-planes, or segments
that form a polygon. Walls "far" touch a large circle around the box, so discs hit none of these walls, and only the
number of walls costs time. Walls "around" are a polygon instead of the box, and discs hit all of these walls.

Each row times both scenes in turn, each in its own interpreter, and prints the median and the quartiles of the ratios
of processor time. With ``--baseline``, the row also shows the ratios of another version of Carom.
"""

from __future__ import annotations

import statistics
from contextlib import ExitStack
from itertools import product
from typing import TYPE_CHECKING

from benchmarks.arguments import count, parser, run
from benchmarks.baseline import Interpreter

if TYPE_CHECKING:
    from collections.abc import Sequence

_WALLS = (8, 100, 1000)
_SIZES = (100, 1000, 10_000)

#: For each line with a number of impacts, prints the seconds of these impacts.
_GAS = """
import dataclasses, math, sys, time
import numpy as np
from carom.model.chain_geometry import Outline
from carom.studies.bench.gas import build_hard_disc_gas
from carom.solvers.event_driven.run import EventDrivenRun
gas, walls = build_hard_disc_gas({discs}, 0.3), {walls}
if walls:
    side = max(x for x, _, _, _ in gas.walls)
    middle = side / 2
    far = side / 2**0.5 + 1 if {around} else side
    angles = 2 * math.pi * (np.arange(walls) + 0.5) / walls
    turned = [(math.cos(angle), math.sin(angle)) for angle in angles]
    more = tuple((middle + far * x, middle + far * y, -x, -y) for x, y in turned)
    if {segments}:
        half = far * math.tan(math.pi / walls)
        more = tuple(
            Outline(((x + half * ny, y - half * nx), (x - half * ny, y + half * nx)), (0.0,), 0.0)
            for x, y, nx, ny in more
        )
    gas = dataclasses.replace(gas, walls=more if {around} else (*gas.walls, *more))
run = EventDrivenRun(gas, record="none")
run.advance_to(math.inf, 20 * {discs})
for line in sys.stdin:
    last = run.impacts + int(line)
    begin = time.thread_time()
    run.advance_to(math.inf, last)
    print(time.thread_time() - begin, flush=True)
"""


def compare(discs: int, walls: int, kind: tuple[bool, bool], python: str | None, impacts: int, rounds: int) -> str:
    """Return the time with additional walls, divided by the time without them: median and quartiles.

    `kind` states whether the walls are segments, and whether they are around the discs.
    """
    segments, around = kind
    with ExitStack() as stack:
        box, more = (
            stack.enter_context(
                Interpreter(_GAS.format(discs=discs, walls=number, segments=segments, around=around), python)
            )
            for number in (0, walls)
        )
        ratios = [more.ask(str(impacts))[0] / box.ask(str(impacts))[0] for _ in range(rounds)]
    low, middle, high = statistics.quantiles(ratios, n=4)
    return f"{middle:.2f} [{low:.2f} {high:.2f}]"


def main(walls: Sequence[int], baseline: str, impacts: int, rounds: int) -> None:
    """Print the table."""
    print(f"{'discs':>7} {'walls':>6} {'':>19} {'times the box':>18}" + (f" {'baseline':>18}" if baseline else ""))
    for discs, number, segments, around in product(_SIZES, walls, (False, True), (False, True)):
        ratios = [
            compare(discs, number, (segments, around), python, impacts, rounds)
            for python in ([None, baseline] if baseline else [None])
        ]
        name = f"{('half-planes', 'segments')[segments]} {('far', 'around')[around]}"
        print(f"{discs:7d} {number:6d} {name:>19}" + "".join(f" {ratio:>18}" for ratio in ratios), flush=True)


if __name__ == "__main__":
    command = parser("benchmarks.walls", __doc__)
    command.add_argument("walls", nargs="*", type=count, default=_WALLS, help="numbers of additional walls")
    command.add_argument(
        "--baseline", default="", metavar="PYTHON", help="Python interpreter with another version of Carom"
    )
    command.add_argument("--impacts", type=count, default=100_000, help="impacts per timing")
    command.add_argument("--rounds", type=count, default=9, help="number of timings")
    run(command, main)
