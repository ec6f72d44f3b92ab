"""Run time of adapters, divided by the run time of hand-written loops: ``python -m benchmarks.seam``.

The adapter and the loop make the same steps of the engine, in turn. The ratio is the median of ratios of processor
times.
"""

from __future__ import annotations

import itertools
import math
import statistics
import sys
import time
import warnings
from collections.abc import Callable, Iterator

from benchmarks.arguments import parser, run
from benchmarks.seam_loops import LOOPS

from carom.engines.api import Disc, Scene
from carom.engines.registry import explain_unavailable_engine, load_adapter

ROUNDS = 31
DISCS = (2, 100)

#: Shortest round, in seconds. In such a round, the time to read the clock is negligible.
LEAST_ROUND_S = 0.02


def lattice(discs: int) -> Scene:
    """Return discs on a lattice that move apart. There is no contact, so all steps take the same time."""
    side = math.ceil(math.sqrt(discs))
    places = itertools.islice(itertools.product(range(side), repeat=2), discs)
    return Scene(
        name="lattice",
        discs=[Disc(position_m=(2.0 * x, 2.0 * y), velocity_m_s=(0.01 * x, 0.01 * y), radius_m=0.5) for x, y in places],
        duration_s=1.0,
    )


def _seconds(loop: Callable[[int], object], steps: int) -> float:
    # The processor time of this thread does not include the time of other processes.
    started = time.thread_time()
    loop(steps)
    return time.thread_time() - started


def ratio(name: str, discs: int, rounds: int = ROUNDS) -> tuple[float, float]:
    """Return the adapter's time divided by the loop's time, and the loop's smallest time per step in seconds."""
    scene, dt_s = lattice(discs), 1 / 240
    adapter = load_adapter(name)
    world = adapter.prepare(scene, adapter.profiles["tuned"].settings(dt_s))
    by_hand, close = LOOPS[name](scene, dt_s)
    try:
        steps = 16
        while _seconds(by_hand, steps) < LEAST_ROUND_S:
            steps *= 2
        world.advance(steps)
        pairs = [(_seconds(world.advance, steps), _seconds(by_hand, steps)) for _ in range(rounds)]
    finally:
        world.close()
        close()
    return statistics.median(ours / theirs for ours, theirs in pairs), min(theirs for _, theirs in pairs) / steps


def reuse_ratio(name: str, worlds: int = 20, rounds: int = 5) -> float:
    """Return the time to prepare a world like the previous world, divided by the time to prepare a different world."""
    adapter = load_adapter(name)
    settings = adapter.profiles["tuned"].settings(1 / 240)
    radii = itertools.count()

    def prepare(count: int, *, alike: bool) -> None:
        for k in range(count):
            radius = 0.4 if alike else 0.4 + 1e-6 * next(radii)
            discs = [
                Disc(position_m=(-1e-3 * k, 0), velocity_m_s=(1, 0), radius_m=radius),
                Disc(position_m=(2, 0.3), radius_m=0.5),
            ]
            adapter.prepare(Scene(name="sweep", discs=discs, duration_s=1), settings).close()

    prepare(2, alike=True)
    pairs = [
        (_seconds(lambda n: prepare(n, alike=True), worlds), _seconds(lambda n: prepare(n, alike=False), worlds))
        for _ in range(rounds)
    ]
    return statistics.median(again / anew for again, anew in pairs)


def lines() -> Iterator[str]:
    """Measure every installed engine, and yield the lines of the tables."""
    yield f"{'engine':10}{'discs':>6}{'adapter / by hand':>20}{'loop, us per step':>20}"
    for name, discs in itertools.product(LOOPS, DISCS):
        reason = explain_unavailable_engine(load_adapter(name).engine)
        if reason:
            yield f"{name:10}{discs:6d}  {reason}"
            continue
        found, step_s = ratio(name, discs)
        yield f"{name:10}{discs:6d}{found:20.3f}{step_s * 1e6:20.2f}"
    yield ""
    yield "time to prepare a world that differs only in its start state / time to prepare a world with other radii:"
    for name in LOOPS:
        if not explain_unavailable_engine(load_adapter(name).engine):
            yield f"{name:10}{reuse_ratio(name):26.3f}"


def main() -> None:
    """Print the table."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for line in lines():
            print(line)
            sys.stdout.flush()


if __name__ == "__main__":
    run(parser("benchmarks.seam", __doc__), main)
