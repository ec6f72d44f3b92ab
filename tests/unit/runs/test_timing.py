"""Two clocks: what a world takes to be made, and what its steps take."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count

import numpy as np
from tests.stage import disc_at, staged

from carom.adapter import Capabilities, Engine, Observation, Profile, Setting
from carom.runs.timing import time_run
from carom.scene import Scene


class Timed:
    """A world that counts an hour for its making and a quarter of a second for each step."""

    settings: Mapping[str, Setting] = {}

    def __init__(self, drift: float = 0.0) -> None:
        self.seconds, self.drift = 3600.0, drift

    def advance(self, steps: int) -> None:
        self.seconds += 0.25 * steps

    def observe(self) -> Observation:
        return Observation(np.zeros((1, 2)), np.full((1, 2), self.drift))

    def close(self) -> None:
        pass


class TimedAdapter:
    name = "timed"
    engine = Engine("Timed")
    capabilities = Capabilities()
    profiles: Mapping[str, Profile] = {"tuned": Profile("As it is.", lambda dt_s: {"dt_s": dt_s})}

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> Timed:
        del scene, settings
        return Timed()


def test_a_world_s_own_clock_counts_from_the_first_step() -> None:
    """What an engine's clock showed before, from making the world or from a call of none, is no part of the steps."""
    scene = staged("one", disc_at(0, 0), duration_s=2.0)
    for call in (False, True):
        timing = time_run(TimedAdapter(), scene, "tuned", 0.5, call=call)
        assert (timing.advance_s, timing.runs) == (4 * 0.25, 3)
        assert timing.prepare_s < 3600.0


class DriftingAdapter(TimedAdapter):
    """Each of its worlds ends a little faster than the one before."""

    def __init__(self) -> None:
        self.made = count()

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> Timed:
        del scene, settings
        return Timed(1e-300 * next(self.made))


def test_ends_that_differ_in_a_bit_are_counted() -> None:
    """A method that repeats has one end, and one whose runs differ by 1e-300 m/s as many as there were runs."""
    scene = staged("one", disc_at(0, 0), duration_s=2.0)
    assert time_run(TimedAdapter(), scene, "tuned", 0.5).ends == 1
    assert time_run(DriftingAdapter(), scene, "tuned", 0.5).ends == 3
