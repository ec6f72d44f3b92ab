"""Clocks that an engine could have, coarse ones above all: whatever they show, a timing pass ends and times the others.

The adapter's clock is drawn by lot: it counts whole milliseconds or coarser, stands still, jumps, runs back, or shows
what is no number.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any
from unittest import mock

from tests.attacks.guard import HangError, limit_time
from tests.in_process_pool import InProcessPool
from tests.unit.execution.test_timing import SCENE, Adapter

from carom.engines.registry import load_adapter
from carom.execution.job import Method
from carom.studies.bench import timing_pass
from carom.studies.bench.timing_pass import TimeScene

#: A timing pass takes a second or two of processor time.
LONGEST_S = 60.0
#: What a clock ticks by, in seconds.
TICKS = (1e-9, 1e-3, 1e-2, 1.0)
#: What it shows once in a while.
ODD: tuple[Any, ...] = (math.inf, -math.inf, math.nan, -1e-3, 1e300, 5e-324, None, "1", True, 10**400)


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Time a scene by such a clock, and PIT."""
    del folder
    while True:
        seed = rng.random()
        lost = _find_loss(Random(seed))
        yield lost and f"seed {seed!r}: {lost}"


def _draw_clock_values(draw: Random) -> tuple[Any, ...]:
    """Return what a clock shows, one value after each call, and the last for ever."""
    tick, odd = draw.choice(TICKS), draw.random() < 0.3
    now, shown = 0.0, []
    for _ in range(draw.choice((1, 2, 10, 200))):
        now += tick * draw.choice((0, 0, 1, 1, 2, 1000))
        shown.append(draw.choice(ODD) if odd and draw.random() < 0.1 else now)
    return tuple(shown)


def _find_loss(draw: Random) -> str:
    """Return what is wrong after a timing pass; empty where nothing is."""
    shown, dt_s = _draw_clock_values(draw), SCENE.duration_s / draw.choice((1, 20, 300))
    asked = tuple((Method(name, "tuned"), dt_s) for name in draw.sample(("clocked", "pit"), 2))

    def found(name: str) -> Any:
        return Adapter(*shown) if name == "clocked" else load_adapter(name)

    try:
        with limit_time(LONGEST_S), mock.patch.object(timing_pass, "load_adapter", found):
            answer = TimeScene(SCENE, asked, rounds=3).run(InProcessPool())
    except HangError:
        return f"no end after {LONGEST_S:g} s, of a clock that shows {shown[:8]}"
    except Exception as error:  # noqa: BLE001 - this is what is looked for
        return f"{type(error).__name__}: {str(error)[:200]!r}, of a clock that shows {shown[:8]}"
    if answer.value is None:
        return f"nothing is timed: {answer.reason[:200]!r}, of a clock that shows {shown[:8]}"
    timed = {method.engine: cell for (method, _), cell in answer.value.timings}
    untimed = {method.engine: why for (method, _), why in answer.value.untimed}
    if "pit" not in timed:
        return f"PIT is not timed: {untimed.get('pit')!r}"
    if ("clocked" in timed) is ("clocked" in untimed):
        return "it is both timed and not, or neither"
    if "clocked" in untimed:
        told = "too short to time" in untimed["clocked"] or "seconds of a world" in untimed["clocked"]
        return "" if told else f"no sentence: {untimed['clocked'][:200]!r}"
    median = timed["clocked"].advance_s.median
    return "" if 0.0 < median < math.inf else f"it took {median} s, of a clock that shows {shown[:8]}"
