"""Measures how much run time PIC and PIT save by skipping bodies that can't touch."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.solvers.pic import solve_pic, start_pic_run
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import start_pit_run
from carom.solvers.run import build_trace

#: Smallest and largest number of rounds, and the seconds after which no further round begins. A round consists of one
#: run that skips needless tests, and one run without skipping.
_LEAST_ROUNDS, _ROUNDS, _ENOUGH_S = 3, 25, 0.3

#: Largest number of tests for contact in a run without skipping. A run with more tests would take too long.
MOST_TESTS = 20_000_000


class SkippedTime(NamedTuple):
    """Median run time with skipping, and median ratio of the run time without skipping to that with skipping."""

    with_skipping_s: float
    ratio: float


class SceneSkips(NamedTuple):
    """Time that PIC and PIT save in a scene. A value is None if the run without skipping would take too long."""

    pic: SkippedTime | None
    pit: SkippedTime | None
    dt_s: float


def measure_skips(reference: Trace, dt_s: float) -> SceneSkips:
    """Measure how much time PIC and PIT save in the scene of `reference`, with the step size `dt_s`."""
    scene = reference.scene
    return SceneSkips(measure_pic_saving(scene, reference), measure_pit_saving(scene, dt_s), dt_s)


def count_tests_per_frame(scene: Scene) -> int:
    """Return the number of pairs (of two discs, or of a disc and a wall) that a step tests if no pair is skipped."""
    discs = len(scene.discs)
    return discs * (discs - 1) // 2 + discs * len(scene.walls)


def is_closed_form(reference: Trace) -> bool:
    """Whether PIC solved the scene by the formula for two discs on straight paths.

    All other methods of PIC store in the trace how often discs enter another cell of a grid.
    """
    scene = reference.scene
    straight = not (any(scene.gravity_m_s2) or scene.damping_per_s or scene.table_deceleration_m_s2)
    return straight and "crossings" not in reference.counts


def measure_pic_saving(scene: Scene, reference: Trace) -> SkippedTime | None:
    """Measure the time that PIC saves.

    PIC solves two discs on straight paths by a formula. In other scenes, PIC saves time: after an impact, it computes
    new impact times only for the discs of this impact. Return None if the run without skipping would take too long.
    """
    if len(reference.impacts) * count_tests_per_frame(scene) > MOST_TESTS:
        return None
    until_s = min(scene.duration_s, reference.end_time_s)
    closed = is_closed_form(reference)

    def prepare(skipping: bool) -> Callable[[], object]:
        if closed:  # with and without skipping, the whole computation from scene to trace is timed
            return partial(solve_pic, scene) if skipping else partial(_run_event_driven, scene)
        return partial(start_pic_run(scene, all_pairs=not skipping).advance_to, until_s)

    return _measure(prepare)


def _run_event_driven(scene: Scene) -> Trace:
    run = start_pic_run(scene)
    return build_trace(run, "pic", scene, run.advance_to(scene.duration_s))


def measure_pit_saving(scene: Scene, dt_s: float) -> SkippedTime | None:
    """Measure the time that PIT saves by skipping pairs that can't touch, and frames in which no bodies can touch.

    Return None if the run without skipping would take too long.
    """
    if scene.step_count(dt_s) * count_tests_per_frame(scene) > MOST_TESTS:
        return None
    clock, end_s = FrameClock(rate_hz=1.0 / dt_s), scene.duration_s
    return _measure(lambda skipping: partial(start_pit_run(scene, clock, skipping=skipping).advance_to, end_s))


def _measure(prepare: Callable[[bool], Callable[[], object]]) -> SkippedTime:
    """Measure the run times with and without skipping, alternately. Preparation is not timed."""

    def measure_seconds(skipping: bool) -> float:
        run = prepare(skipping)
        began = time.perf_counter()
        run()
        return time.perf_counter() - began

    measure_seconds(True), measure_seconds(False)  # fill the caches
    rounds: list[tuple[float, float]] = []
    started = time.perf_counter()
    while len(rounds) < _LEAST_ROUNDS or (len(rounds) < _ROUNDS and time.perf_counter() - started < _ENOUGH_S):
        first = len(rounds) % 2 == 0  # the order alternates, since the second run of a round profits from filled caches
        seconds = {skipping: measure_seconds(skipping) for skipping in (first, not first)}
        rounds.append((seconds[True], seconds[False]))
    ratio = statistics.median(without_s / with_s for with_s, without_s in rounds)
    return SkippedTime(statistics.median(with_s for with_s, _ in rounds), ratio)
