"""Two clocks, of making a world and of its steps: a clock that is too coarse or impossible is reported."""

import math
from collections.abc import Mapping
from itertools import count
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.scene_builders import disc_at, require_value, staged
from tests.unit.execution.stubs import Makes, Still

from carom import Scene
from carom.catalogue import all_scenes
from carom.engines.api import AdapterError, Engine, Observation
from carom.engines.registry import load_adapter
from carom.execution.job import Method, UnsupportedError
from carom.execution.timing import time_run
from carom.studies.bench import timing_pass
from carom.studies.bench.timing_pass import TimeScene

DT_S = 1 / 60


class World(Still):
    """A world whose clock shows given values, one after each call."""

    settings: Mapping[str, Any] = {"dt_s": DT_S}

    def __init__(self, scene: Scene, shown: tuple[Any, ...]) -> None:
        self.scene, self.shown, self.calls = scene, shown, 0

    @property
    def seconds(self) -> Any:
        return self.shown[min(self.calls, len(self.shown) - 1)]

    def advance(self, steps: int) -> None:
        del steps
        self.calls += 1

    def observe(self) -> Observation:
        count = len(self.scene.discs)
        return Observation(np.zeros((count, 2)), np.zeros((count, 2)))


class Adapter(Makes):
    name, engine = "clocked", Engine("Clocked")

    def __init__(self, *shown: Any) -> None:
        self.shown = shown

    def prepare(self, scene: Scene, settings: Any) -> World:
        del settings
        return World(scene, self.shown)


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


@each("shown", [(0.0,), (0.0, math.inf), (0.0, 0.0, 0.001)])
def test_coarse_clock_affects_only_its_own_timing(monkeypatch: pytest.MonkeyPatch, shown: tuple[float, ...]) -> None:
    """In a timing pass an engine with an unusable clock is left out with the reason, and PIT is timed."""
    found = lambda name: Adapter(*shown) if name == "clocked" else load_adapter(name)  # noqa: E731 - of one line
    monkeypatch.setattr(timing_pass, "load_adapter", found)
    asked = [(Method("clocked", "tuned"), DT_S), (Method("pit", "tuned"), DT_S)]
    timing = require_value(TimeScene(SCENE, tuple(asked), rounds=3).run(InProcessPool()).value)
    timed = {method.engine for (method, _), _ in timing.timings}
    untimed = {method.engine: why for (method, _), why in timing.untimed}
    assert "pit" in timed
    if "clocked" in untimed:
        assert "too short to time" in untimed["clocked"] or "seconds of a world" in untimed["clocked"]
    else:
        (found_timing,) = (cell for (method, _), cell in timing.timings if method.engine == "clocked")
        assert found_timing.advance_s.median > 0.0


class Timed(World):
    """Shows an hour for its making, and a quarter of a second more for each step; at its end its disc drifts."""

    seconds = 3600.0

    def __init__(self, scene: Scene, drift_m_s: float) -> None:
        super().__init__(scene, ())
        self.drift_m_s = drift_m_s

    def advance(self, steps: int) -> None:
        self.seconds += 0.25 * steps

    def observe(self) -> Observation:
        return Observation(np.zeros((1, 2)), np.full((1, 2), self.drift_m_s))


class TimedAdapter(Adapter):
    """Each of its worlds ends by so much faster than the one before."""

    def __init__(self, drift_m_s: float = 0.0) -> None:
        self.made, self.drift_m_s = count(), drift_m_s

    def prepare(self, scene: Scene, settings: Any) -> World:
        del settings
        return Timed(scene, self.drift_m_s * next(self.made))


ONE = staged("one", disc_at(0, 0), duration_s=2.0)


def test_world_clock_counts_from_the_first_step() -> None:
    """The time that a world's clock showed before the first step, here an hour, is not part of the timing."""
    for call in (False, True):
        timing = time_run(TimedAdapter(), ONE, "tuned", 0.5, call=call)
        assert (timing.advance_s, timing.runs) == (4 * 0.25, 3)
        assert timing.prepare_s < 3600.0


def test_different_final_states_are_counted() -> None:
    """Three equal runs have one final state, and three runs that differ by 1e-300 m/s have three."""
    assert [time_run(TimedAdapter(drift), ONE, "tuned", 0.5).ends for drift in (0.0, 1e-300)] == [1, 3]


def test_timing_stops_after_two_runs_that_agree() -> None:
    """With `agreed=0.1` two equal times in a row end the timing; without it three runs are made."""
    assert [time_run(TimedAdapter(), ONE, "tuned", 0.5, agreed=part).runs for part in (0.0, 0.1)] == [3, 2]
