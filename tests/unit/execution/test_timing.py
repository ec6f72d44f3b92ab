"""Timing of runs by an engine's own clock: clocks that are too coarse or invalid are reported."""

import math
from collections.abc import Mapping
from itertools import count
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.unit.execution.stubs import Makes, Still

from carom import Scene
from carom.catalogue import all_scenes
from carom.engines.api import AdapterError, Engine, Observation
from carom.execution.job import UnsupportedError
from carom.execution.timing import time_run

DT_S = 1 / 60


class World(Still):
    """A world whose clock shows given values, one after each call with steps; all its discs have one velocity."""

    settings: Mapping[str, Any] = {"dt_s": DT_S}

    def __init__(self, scene: Scene, shown: tuple[Any, ...], speed_m_s: float) -> None:
        self.scene, self.shown, self.speed_m_s, self.calls = scene, shown, speed_m_s, 0

    @property
    def seconds(self) -> Any:
        return self.shown[min(self.calls, len(self.shown) - 1)]

    def advance(self, steps: int) -> None:
        self.calls += min(steps, 1)

    def observe(self) -> Observation:
        shape = len(self.scene.discs), 2
        return Observation(np.zeros(shape), np.full(shape, self.speed_m_s))


class Adapter(Makes):
    """Each of its worlds is faster than the one before by `faster_m_s`."""

    name, engine = "clocked", Engine("Clocked")

    def __init__(self, *shown: Any, faster_m_s: float = 0.0) -> None:
        self.shown, self.faster_m_s, self.made = shown, faster_m_s, count()

    def prepare(self, scene: Scene, settings: Any) -> World:
        del settings
        return World(scene, self.shown, self.faster_m_s * next(self.made))


SCENE = all_scenes()["paper/missed"].scene


def test_clock_that_shows_no_time_is_too_coarse() -> None:
    """Steps that take 0 s by the world's clock are refused as too short to time, unless `zero` allows it."""
    with pytest.raises(UnsupportedError, match=r"too short to time: the clock shows 0 s for .* steps"):
        time_run(Adapter(0.0), SCENE, "tuned", DT_S)
    assert time_run(Adapter(0.0), SCENE, "tuned", DT_S, zero=True).advance_s == 0.0
    assert time_run(Adapter(0.0, 0.001), SCENE, "tuned", DT_S).advance_s == 0.001


@each(
    "begun, shown",
    [
        *((begun, 1.0) for begun in ("1", None, math.nan, -math.inf, -(10**400))),
        *((0.0, shown) for shown in (math.inf, math.nan, -1.0, "1", None)),
    ],
)
def test_invalid_clock_value_is_refused(begun: Any, shown: Any) -> None:
    """A clock that is infinite, NaN, falling or no number raises an AdapterError, before or after a step."""
    with pytest.raises(AdapterError, match="seconds of a world must be a finite number that never decreases, got"):
        time_run(Adapter(begun, shown), SCENE, "tuned", DT_S)


def test_clock_counts_from_the_first_step_until_two_times_agree() -> None:
    """The hour that a clock shows before the first step is not timed; two equal times may end the timing."""
    for call, agreed, runs in ((False, 0.0, 3), (True, 0.0, 3), (False, 0.1, 2)):
        timing = time_run(Adapter(3600.0, 3601.0), SCENE, "tuned", DT_S, call=call, agreed=agreed)
        assert (timing.advance_s, timing.runs) == (1.0, runs)
        assert timing.prepare_s < 3600.0


def test_different_final_states_are_counted() -> None:
    """Three equal runs have one final state, and three runs that differ by 1e-300 m/s have three."""
    adapters = (Adapter(0.0, 1.0, faster_m_s=speed) for speed in (0.0, 1e-300))
    assert [time_run(adapter, SCENE, "tuned", DT_S).ends for adapter in adapters] == [1, 3]
