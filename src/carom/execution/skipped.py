"""What Carom's own methods skip in a scene, and what that saves: measured by running them with and without."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.solvers.pic import pic_run, solve_pic
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import pit_run
from carom.solvers.run import trace_of

#: Runs of each form, alternately, for the median of their ratios; fewer once so many seconds are full.
_LEAST_ROUNDS, _ROUNDS, _ENOUGH_S = 3, 25, 0.3

#: Tests of pairs and walls that a run without skipping may make; with more it is not worth the wait.
MOST_TESTS = 20_000_000


class SkippedTime(NamedTuple):
    """Run time with skipping, seconds, and how many times that the run takes without it: medians of the same rounds."""

    with_s: float
    ratio: float


class SceneSkips(NamedTuple):
    """What PIC and PIT save in a scene; None where the run without skipping is not worth the wait."""

    pic: SkippedTime | None
    pit: SkippedTime | None
    dt_s: float


def measure_skips(reference: Trace, dt_s: float) -> SceneSkips:
    """Return what PIC and PIT at a step save in the scene of a reference."""
    scene = reference.scene
    return SceneSkips(measure_pic_saving(scene, reference), measure_pit_saving(scene, dt_s), dt_s)


def tests_per_frame(scene: Scene) -> int:
    """Return how many pairs, and discs at walls, there are to test."""
    discs = len(scene.discs)
    return discs * (discs - 1) // 2 + discs * len(scene.walls)


def is_closed_form(reference: Trace) -> bool:
    """Whether PIC solved a scene by the closed form of two discs, which counts no crossings of cells."""
    scene = reference.scene
    straight = not (any(scene.gravity_m_s2) or scene.damping_per_s or scene.table_deceleration_m_s2)
    return straight and "crossings" not in reference.counts


def measure_pic_saving(scene: Scene, reference: Trace) -> SkippedTime | None:
    """Return what PIC saves by the closed form, or else by predicting only the discs of an impact again.

    None where all pairs are too many.
    """
    if len(reference.impacts) * tests_per_frame(scene) > MOST_TESTS:
        return None
    until_s = min(scene.duration_s, reference.end_time_s)
    closed = is_closed_form(reference)

    def prepare(skipping: bool) -> Callable[[], object]:
        if closed:  # both from the scene to the trace
            return partial(solve_pic, scene) if skipping else partial(_event_driven, scene)
        return partial(pic_run(scene, all_pairs=not skipping).advance_to, until_s)

    return _measured(prepare)


def _event_driven(scene: Scene) -> Trace:
    run = pic_run(scene)
    return trace_of(run, "pic", scene, run.advance_to(scene.duration_s))


def measure_pit_saving(scene: Scene, dt_s: float) -> SkippedTime | None:
    """Return what PIT saves by skipping frames and pairs that can't touch; None where the plain loop is too long."""
    if scene.step_count(dt_s) * tests_per_frame(scene) > MOST_TESTS:
        return None
    clock = FrameClock(rate_hz=1.0 / dt_s)
    return _measured(lambda skipping: partial(pit_run(scene, clock, skipping=skipping).advance_to, scene.duration_s))


def _measured(prepare: Callable[[bool], Callable[[], object]]) -> SkippedTime:
    """Time runs with and without skipping in turn; preparing them is no part of it."""

    def seconds(skipping: bool) -> float:
        run = prepare(skipping)
        began = time.perf_counter()
        run()
        return time.perf_counter() - began

    seconds(True), seconds(False)  # warm
    rounds: list[tuple[float, float]] = []
    started = time.perf_counter()
    while len(rounds) < _LEAST_ROUNDS or (len(rounds) < _ROUNDS and time.perf_counter() - started < _ENOUGH_S):
        first = len(rounds) % 2 == 0  # each form is the first in every other round: the second finds warm caches
        taken = {skipping: seconds(skipping) for skipping in (first, not first)}
        rounds.append((taken[True], taken[False]))
    ratio = statistics.median(plain_s / with_s for with_s, plain_s in rounds)
    return SkippedTime(statistics.median(with_s for with_s, _ in rounds), ratio)
