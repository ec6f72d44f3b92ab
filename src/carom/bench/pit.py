"""PIT with and without skipping, on the hard-disc gas and on two discs: ``python -m carom.bench.pit [discs ...]``."""

from __future__ import annotations

import statistics
import time
from typing import TYPE_CHECKING

from carom import Disc, Scene
from carom.bench.arguments import count, parser, run
from carom.bench.gas import gas_scene
from carom.solvers.pit.frames import FrameSampledRun, ManyDiscsRun, SkippingRun, solve_pit
from carom.trace import impact_array

if TYPE_CHECKING:
    from collections.abc import Sequence

    from carom.solvers.pit.frames import PitRun

__all__ = ["main"]

_RATE_HZ = 60.0
_PACKING = 0.3


def _seconds(run: PitRun, first: int, frames: int) -> float:
    begin = time.perf_counter()
    run.advance_frames([k / _RATE_HZ for k in range(first, first + frames)])
    return time.perf_counter() - begin


def compare_gas(discs: int, plain_frames: int, rounds: int = 3) -> str:
    """Return a line of the table: both runs in turn, frame for frame, and whether they end in the same bits."""
    scene = gas_scene(discs, _PACKING)
    plain, fast = FrameSampledRun(scene), ManyDiscsRun(scene)
    ratios, plain_s, fast_s = [], [], []
    for k in range(rounds):
        plain_s.append(_seconds(plain, 1 + k * plain_frames, plain_frames))
        fast_s.append(_seconds(fast, 1 + k * plain_frames, plain_frames))
        ratios.append(plain_s[-1] / fast_s[-1])
    same = impact_array(plain.log.records).tobytes() == impact_array(fast.log.records).tobytes()
    same = same and plain.positions().tobytes() == fast.positions().tobytes()
    frames = rounds * plain_frames
    return (
        f"{discs:7d} {frames:7d} {len(fast.log.records):8d} {plain.pair_tests:12d} {fast.pair_tests:11d}"
        f"{plain.pair_tests / fast.pair_tests:9.0f}x {1e3 * statistics.median(plain_s) / plain_frames:9.3g}"
        f"{1e3 * statistics.median(fast_s) / plain_frames:9.3g}{statistics.median(ratios):9.0f}x {same!s:>6}"
    )


def compare_two_discs() -> str:
    """Return a line on two discs that meet once in a hundred seconds."""
    scene = Scene(
        name="two discs",
        discs=[
            Disc(position_m=(0.0, 0.0), velocity_m_s=(1.0, 0.0), radius_m=0.5),
            Disc(position_m=(60.5, 0.2), radius_m=0.5),
        ],
        duration_s=100.0,
    )
    ratios = []
    for _ in range(5):
        begin = time.perf_counter()
        plain = solve_pit(scene, skipping=False)
        middle = time.perf_counter()
        fast = solve_pit(scene)
        ratios.append((middle - begin) / (time.perf_counter() - middle))
    same = plain.impacts.tobytes() == fast.impacts.tobytes()
    counts = fast.counts
    return (
        f"two discs, one impact: {counts['frames_looked_at']} of {counts['frames']} frames looked at, "
        f"{statistics.median(ratios):.0f}x faster, same bits: {same}"
    )


def compare_few(discs: int) -> str:
    """Return a line on the size from which on arrays pay: plain floats and arrays on one gas."""
    scene = gas_scene(discs, _PACKING)
    few, many = SkippingRun(scene), ManyDiscsRun(scene)
    return f"{discs:7d} discs: plain floats take {_seconds(few, 1, 300) / _seconds(many, 1, 300):.2g} of arrays' time"


def main(sizes: Sequence[int]) -> None:
    """Print the tables."""
    print(compare_two_discs())
    print(
        f"{'discs':>7} {'frames':>7} {'impacts':>8} {'tests, plain':>12} {'skipping':>11} {'fewer':>9} {'ms/frame':>9}"
        f"{'skipping':>9} {'faster':>9} {'same':>6}"
    )
    for discs in sizes:
        print(compare_gas(discs, max(1, 20_000 // discs // 4)), flush=True)
    for discs in (8, 16, 32, 64):
        print(compare_few(discs), flush=True)


if __name__ == "__main__":
    command = parser("carom.bench.pit", __doc__)
    command.add_argument("sizes", nargs="*", type=count, default=(100, 1000), metavar="discs", help="sizes of the gas")
    run(command, main)
