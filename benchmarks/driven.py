"""Cost of a driven wall: ``python -m benchmarks.driven [discs ...]``.

Discs fill 0.3 of a box, and one wall of the box recedes at a thousandth of the discs' speed. The run is compared with a
run in a box at rest, and with a run that tests all pairs of bodies. Each row prints the median and the quartiles of the
ratios of processor time per impact.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from benchmarks.arguments import count, parser, run

from carom import Disc, Scene, Wall
from carom.solvers.pic import start_pic_run
from carom.studies.bench.gas import build_hard_disc_gas

if TYPE_CHECKING:
    from carom.solvers.run import Run

_SIZES = (3, 10, 30, 100, 300)
_LONG_S = 1e9


def gas(discs: int, speed: float) -> Scene:
    """Return discs in a box whose first wall recedes at `speed`."""
    drawn = build_hard_disc_gas(discs, 0.3)
    free = [
        Disc(position_m=(x, y), velocity_m_s=(u, v), radius_m=r)
        for (x, y), (u, v), r in zip(
            drawn.position_m.tolist(), drawn.velocity_m_s.tolist(), drawn.radius_m.tolist(), strict=True
        )
    ]
    walls = [Wall(point_m=(x, y), normal=(nx, ny)) for x, y, nx, ny in drawn.half_planes()]
    nx, ny = walls[0].normal
    recedes = walls[0].model_copy(update={"velocity_m_s": (-speed * nx, -speed * ny)})
    return Scene(name="gas", discs=free, walls=[recedes, *walls[1:]], duration_s=_LONG_S)


def seconds(of: Run, impacts: int) -> float:
    """Return the mean processor time of the next impacts, in seconds."""
    begin = time.thread_time()
    of.advance_to(_LONG_S, of.counts["impacts"] + impacts)
    return (time.thread_time() - begin) / impacts


def main(discs: Sequence[int], impacts: int, rounds: int) -> None:
    """Print the table."""
    print(f"{'discs':>7} {'times the box at rest':>24} {'all pairs / kernel':>24}")
    for number in discs:
        driven = gas(number, 1e-3)
        runs = [start_pic_run(driven), start_pic_run(driven, all_pairs=True), start_pic_run(gas(number, 0.0))]
        told = []
        for _ in range(rounds):
            compiled, at_rest = (seconds(one, 100 * impacts) for one in (runs[0], runs[2]))
            told.append((compiled / at_rest, seconds(runs[1], impacts) / compiled))
        columns = (statistics.quantiles(ratios, n=4) for ratios in zip(*told, strict=True))
        row = "".join(f" {f'{middle:.2f} [{low:.2f} {high:.2f}]':>24}" for low, middle, high in columns)
        print(f"{number:7d}{row}", flush=True)


if __name__ == "__main__":
    command = parser("benchmarks.driven", __doc__)
    command.add_argument("discs", nargs="*", type=count, default=_SIZES, help="numbers of discs")
    command.add_argument("--impacts", type=count, default=200, help="impacts per timing")
    command.add_argument("--rounds", type=count, default=9, help="number of timings")
    run(command, main)
