"""Timed part of `benchmarks.pic`, which passes this module as text to a Python interpreter.

The interpreter can have another version of Carom, so the module uses only functions whose interface does not change.
The first line of standard input is the task: "gas", discs, packing, and whether impacts are recorded; or "solve",
discs, and impacts. For each further line with a number of impacts or runs, the module prints their processor time in
seconds. For the line "bytes", the module prints the memory per disc.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable

from carom import Disc, Scene, solve_pic
from carom.solvers.event_driven.run import EventDrivenRun

try:
    from carom.studies.bench.gas import build_gas_scene, build_hard_disc_gas
except ImportError:  # In older versions the module has another name.
    from carom.bench.gas import gas_scene as build_gas_scene  # type: ignore[import-not-found, no-redef]
    from carom.bench.gas import hard_disc_gas as build_hard_disc_gas  # type: ignore[no-redef]

#: Impacts per disc before the timing starts. During these impacts, the initial lattice becomes disordered.
_MELT = 20
_MOST_MELT = 5_000_000


def _gas(discs: int, packing: float, recorded: bool) -> tuple[Callable[[int], float], Callable[[], float]]:
    """Return two functions for a box of discs: one times some impacts, the other returns the memory per disc."""
    start = build_hard_disc_gas(discs, packing)
    run = EventDrivenRun(start, record="none")
    run.advance_to(math.inf, min(_MELT * discs, _MOST_MELT))

    def advance(impacts: int) -> float:
        nonlocal run
        if recorded:  # The timing includes the arrays of a new log, but not the predictions at the start.
            run = EventDrivenRun(start, record="all", resume=run.state())
            run.advance_to(math.inf, run.impacts + 1)
        last = run.impacts + impacts
        begin = time.thread_time()
        run.advance_to(math.inf, last)
        if recorded:
            run.log.array()
            run.log.ambiguous()
        return time.thread_time() - begin

    return advance, lambda: run.bytes_per_disc


def _solve(discs: int, impacts: int) -> Callable[[int], float]:
    """Return a function that times runs of `solve_pic` on a small scene. A scene of two discs has no walls."""
    scene = build_gas_scene(discs, 0.3)
    if discs == 2:
        pair = [Disc(position_m=(x, 0.1 * x), velocity_m_s=(1.0 - x, 0.0), radius_m=0.5) for x in (0.0, 3.0)]
        scene = Scene(name="pair", discs=pair, duration_s=5.0)
    solve_pic(scene, max_impacts=impacts)

    def solve(times: int) -> float:
        begin = time.thread_time()
        for _ in range(times):
            solve_pic(scene, max_impacts=impacts)
        return time.thread_time() - begin

    return solve


def _main() -> None:
    kind, *rest = sys.stdin.readline().split()
    memory: Callable[[], float] = lambda: 0.0  # noqa: E731 - the other one is made where the run is
    if kind == "gas":
        timed, memory = _gas(int(rest[0]), float(rest[1]), rest[2] == "recorded")
    else:
        timed = _solve(int(rest[0]), int(rest[1]))
    print(0, flush=True)  # The number means that the worker is ready.
    for line in sys.stdin:
        print(memory() if line.strip() == "bytes" else timed(int(line)), flush=True)


if __name__ == "__main__":
    _main()
