"""Speed and memory of event-driven PIC on the hard-disc gas: ``python -m carom.bench.pic [discs ...]``."""

from __future__ import annotations

import math
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence

import numpy as np

from carom import Disc, Scene, solve_pic
from carom.bench.arguments import count, parser, run
from carom.bench.gas import hard_disc_gas
from carom.physics.pair_time import approach, encounter, separation
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.kernel_state import KernelState, compiled_kernel
from carom.solvers.layout import OWN_TIME, RADIUS, ROW, TOTAL, VX, VY, Column, X, Y

__all__ = ["main"]

#: Impacts a disc before the clock starts, in which the lattice melts; and impacts that are timed, three times over.
_MELT = 20
_TIMED = 1_000_000


def impacts_per_second(discs: int, packing: float) -> tuple[float, float]:
    """Return the median of three timings, and the bytes a disc."""
    run = EventDrivenRun(hard_disc_gas(discs, packing), record="none", compiled=True)
    run.advance_to(math.inf, min(_MELT * discs, 5_000_000))
    rates = []
    for _ in range(3):
        begin, before = time.process_time(), run.impacts
        run.advance_to(math.inf, before + _TIMED)
        rates.append((run.impacts - before) / (time.process_time() - begin))
    return statistics.median(rates), run.bytes_per_disc


def pair_event_time(body: Column, i: int, j: int) -> float:
    """Return the time at which discs `i` and `j` meet, by the plain form alone."""
    a, o = i * ROW, j * ROW
    start = body[a + OWN_TIME] if body[a + OWN_TIME] > body[o + OWN_TIME] else body[o + OWN_TIME]
    wait, other_wait = start - body[a + OWN_TIME], start - body[o + OWN_TIME]
    dx = (body[o + X] + body[o + VX] * other_wait) - (body[a + X] + body[a + VX] * wait)
    dy = (body[o + Y] + body[o + VY] * other_wait) - (body[a + Y] + body[a + VY] * wait)
    ux, uy = body[o + VX] - body[a + VX], body[o + VY] - body[a + VY]
    b, _ = approach(dx, dy, ux, uy)
    c, _ = separation(dx, dy, body[a + RADIUS] + body[o + RADIUS])
    d, _ = encounter(dx, dy, ux, uy, body[a + RADIUS] + body[o + RADIUS])
    if not (b < 0.0 and d > 0.0):
        return math.inf
    return float(start + (c / (math.sqrt(d) - b) if c > 0.0 else 0.0))


def accuracy_cost(discs: int, packing: float) -> float:
    """Return the share of the run time that the full accuracy of the time of impact takes: a median of nine."""
    kernels = (compiled_kernel(), compiled_kernel(pair_event_time))
    states = [KernelState.of(hard_disc_gas(discs, packing)) for _ in kernels]
    for kernel, state in zip(kernels, states, strict=True):
        state.run(kernel, np.zeros(0), math.inf, _MELT * discs)
    shares = []
    for _ in range(9):
        seconds = []
        for kernel, state in zip(kernels, states, strict=True):
            begin = time.process_time()
            state.run(kernel, np.zeros(0), math.inf, int(state.columns.tally[TOTAL]) + _TIMED // 4)
            seconds.append(time.process_time() - begin)
        shares.append(1.0 - seconds[1] / seconds[0])
    return statistics.median(shares)


def start_seconds() -> float:
    """Return the time from starting Python to the first impacts of the compiled kernel, seconds."""
    code = (
        "import math; from carom.bench.gas import hard_disc_gas; from carom.solvers.event_driven import EventDrivenRun;"
        "EventDrivenRun(hard_disc_gas(16, .3), compiled=True).advance_to(math.inf, 100)"
    )
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True)  # noqa: S603 - our own interpreter and our own text
    return time.perf_counter() - begin


def two_disc_microseconds() -> float:
    """Return the time of one solve of two discs from Python, microseconds."""
    scene = Scene(
        name="two discs",
        discs=[
            Disc(position_m=(0.0, 0.0), velocity_m_s=(1.0, 0.0), radius_m=0.5),
            Disc(position_m=(3.0, 0.2), radius_m=0.5),
        ],
        duration_s=5.0,
    )
    timings = []
    for _ in range(9):
        begin = time.perf_counter()
        for _ in range(200):
            solve_pic(scene)
        timings.append((time.perf_counter() - begin) / 200)
    return min(timings) * 1e6


def main(sizes: Sequence[int]) -> None:
    """Print the tables."""
    print(f"first or warm start, from nothing to 100 impacts: {start_seconds():.2f} s; again: {start_seconds():.2f} s")
    print(f"two discs, one solve: {two_disc_microseconds():.0f} us")
    print(f"share of the full accuracy of the time of impact, 1,000 discs: {accuracy_cost(1000, 0.3):.1%}")
    print(f"{'discs':>9} {'packing':>8} {'impacts/s':>12} {'bytes/disc':>11}")
    for discs in sizes:
        for packing in (0.3, 0.6):
            rate, memory = impacts_per_second(discs, packing)
            print(f"{discs:9d} {packing:8.1f} {rate:12.3g} {memory:11.0f}", flush=True)


if __name__ == "__main__":
    command = parser("carom.bench.pic", __doc__)
    sizes = (1_000, 100_000, 1_000_000)
    command.add_argument("sizes", nargs="*", type=count, default=sizes, metavar="discs", help="sizes of the gas")
    run(command, main)
