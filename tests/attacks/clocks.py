"""Wrong clocks of engines: most count milliseconds or longer units, others stop, jump or run backwards."""

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from random import Random
from typing import Any
from unittest import mock

from tests.attacks.guard import try_act
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
    """Wrong clocks of engines.

    Carom shows a time or a message, and times the other engines.
    """
    del folder
    while True:
        shown, dt_s = _draw_clock_values(rng), SCENE.duration_s / rng.choice((1, 20, 300))
        methods = tuple((Method(name, "tuned"), dt_s) for name in rng.sample(("clocked", "pit"), 2))
        lost = try_act(partial(_find_loss, shown, methods), limit_s=LONGEST_S)
        yield lost and f"{lost}, of a clock that shows {shown[:8]}, in steps of {dt_s} s"


def _draw_clock_values(draw: Random) -> tuple[Any, ...]:
    """Return what a clock shows, one value after each call, and the last for ever."""
    tick, odd = draw.choice(TICKS), draw.random() < 0.3
    now, shown = 0.0, []
    for _ in range(draw.choice((1, 2, 10, 200))):
        now += tick * draw.choice((0, 0, 1, 1, 2, 1000))
        shown.append(draw.choice(ODD) if odd and draw.random() < 0.1 else now)
    return tuple(shown)


def _find_loss(shown: tuple[Any, ...], methods: tuple[tuple[Method, float], ...]) -> str:
    """Return what is wrong after a timing pass; empty where nothing is."""

    def load(name: str) -> Any:
        return Adapter(*shown) if name == "clocked" else load_adapter(name)

    with mock.patch.object(timing_pass, "load_adapter", load):
        answer = TimeScene(SCENE, methods, rounds=3).run(InProcessPool())
    if answer.value is None:
        return f"nothing is timed: {answer.reason[:200]!r}"
    timed = {method.engine: cell for (method, _), cell in answer.value.timings}
    untimed = {method.engine: why for (method, _), why in answer.value.untimed}
    if "pit" not in timed or ("clocked" in timed) is ("clocked" in untimed):
        return f"timed are {[*timed]}, and not timed {untimed}"
    if "clocked" in untimed:
        told = "too short to time" in untimed["clocked"] or "seconds of a world" in untimed["clocked"]
        return "" if told else f"no sentence: {untimed['clocked'][:200]!r}"
    median = timed["clocked"].advance_s.median
    return "" if 0.0 < median < math.inf else f"it took {median} s"
