"""Damped runs are judged by the law with damping: what is right is exact or sampled, and what is not is found."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest
from tests.lengths import long_after

from carom import Scene, Trace, compare, solve_pic
from carom.comparator import Grade, Verdict
from carom.comparator.local_truth.score import local_score
from carom.comparator.scales import scales_of
from carom.registry import load_adapter
from carom.runs.observe import observe_run
from carom.scenes import find_scenes
from carom_adapters.pic import PicAdapter

if TYPE_CHECKING:
    from carom.adapter import Setting, World
    from carom.comparator.compare import Score

DT_S = 1 / 240
SCENES = [entry.scene for entry in find_scenes(["contact/damped-*"]) if len(entry.known.impacts)]
each_scene = pytest.mark.parametrize("scene", long_after(2, reversed(SCENES)), ids=lambda scene: scene.name)


class OtherwiseDamped(PicAdapter):
    """PIC of a scene with another rate of damping."""

    def __init__(self, factor: float) -> None:
        self._factor = factor

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Run the scene with that rate."""
        rate = self._factor * scene.damping_per_s
        return super().prepare(scene.model_copy(update={"damping_per_s": rate}), settings)


@cache
def own(scene: Scene) -> tuple[Trace, Trace]:
    """PIC's and PIT's traces."""
    return solve_pic(scene), observe_run(load_adapter("pit"), scene, "tuned", DT_S)


def judged(scene: Scene, adapter: PicAdapter) -> Score:
    reference, sampling = own(scene)
    return compare(reference, observe_run(adapter, scene, "tuned", DT_S), sampling=sampling)


def fastest_rim(scene: Scene) -> float:
    """What steps are off by is told over a disc's speed, of its rim too where that is faster: how much faster."""
    disc, trace = scene.discs[0], solve_pic(scene)
    ratios = [abs(disc.spin_rad_s) * disc.radius_m / math.hypot(*disc.velocity_m_s)]
    if trace.spins is not None:
        after = trace.impacts["velocity_first_after"]
        ratios += (np.abs(trace.spins["first_after"]) * disc.radius_m / np.hypot(*after.T)).tolist()
    return max(1.0, *ratios)


@each_scene
def test_the_right_rate_is_exact(scene: Scene) -> None:
    """PIC of the scene itself is exact, step by step and as a whole, and nothing is said against it."""
    score = judged(scene, OtherwiseDamped(1.0))
    assert score.grade is Grade.EXACT
    assert score.verdicts == (Verdict.CONFORMS,)


@each_scene
@pytest.mark.parametrize("factor", long_after(1, [1.01, 0.0, 0.99, 2.0]))
def test_another_rate_is_no_better_than_inaccurate(scene: Scene, factor: float) -> None:
    """A run damped by another rate, or not at all, changes velocities where nothing is met, by that much a step."""
    score = judged(scene, OtherwiseDamped(factor))
    assert score.grade in {Grade.INACCURATE, Grade.WRONG, Grade.PARTED_INACCURATE}
    assert Verdict.TURNS in score.verdicts
    assert score.local_truth is not None
    # A step keeps exp(-factor c dt) of a velocity instead of exp(-c dt), of the larger of its two ends.
    rate = scene.damping_per_s * DT_S
    slipped = abs(math.exp(-factor * rate) - math.exp(-rate)) * fastest_rim(scene)
    assert score.local_truth.slipped == pytest.approx(slipped, rel=1e-6)


@each_scene
def test_damping_of_the_first_order_is_inaccurate(scene: Scene) -> None:
    """What keeps 1 - c dt of a velocity in each step, as engines do, is found: by (c dt)^2 / 2 a step."""
    rate = scene.damping_per_s * DT_S
    score = judged(scene, OtherwiseDamped(-math.log1p(-rate) / rate))
    assert score.grade is Grade.INACCURATE
    assert score.local_truth is not None
    assert score.local_truth.slipped == pytest.approx(rate**2 / 2 * fastest_rim(scene), rel=rate)


@each_scene
def test_a_wrong_coefficient_is_found_under_damping(scene: Scene) -> None:
    """A run with another restitution is inaccurate, and off by that at each impact that stands alone."""
    fields = ["restitution", "wall_restitution"]
    wrong = Scene(**{**dict(scene), **{name: getattr(scene, name) * 0.9 for name in fields}})

    class Other(PicAdapter):
        def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
            del scene
            return super().prepare(wrong, settings)

    score = judged(scene, Other())
    assert score.local_truth is not None
    assert score.local_truth.grade in {Grade.INACCURATE, Grade.WRONG}
    if scene.name != "contact/damped-slide":  # of rubbing impacts no restitution is worked out
        e = scene.wall_restitution if scene.walls else scene.restitution
        assert score.local_truth.restitution[1] == pytest.approx(0.1 * e, rel=1e-9)


@each_scene
def test_a_late_run_of_a_damped_scene_is_late_by_as_much(scene: Scene) -> None:
    """A run that finds every first impact half a step late, and is right in all else, is late by half a step."""
    found = observe_run(load_adapter("pit"), scene, "tuned", DT_S)
    assert found.local_truth is not None
    score = local_score(found.local_truth, scales_of(scene, solve_pic(scene, max_impacts=2000)), 64)
    first = solve_pic(scene).impacts["time_s"][0]
    due = -first / DT_S % 1.0
    meeting = found.local_truth.meetings[0]
    assert meeting["due_s"] == pytest.approx(first, rel=1e-12)
    assert found.local_truth.windows["late_steps"][0] == pytest.approx(due, abs=1e-7)
    assert 0.0 <= score.late_steps[1] <= 1.0


def test_effective_times_of_an_engine_are_those_of_damped_paths() -> None:
    """States alone, without what a method says of its impacts, give PIC's instants and velocities back."""
    from carom.adapter import Contact, Observation

    (scene,) = (scene for scene in SCENES if scene.name == "contact/damped-pair")

    class Silent(PicAdapter):
        def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
            world = super().prepare(scene, settings)
            observe = world.observe

            def seen() -> Observation:
                now = observe()
                told = tuple(
                    Contact(one.first, one.second, one.time_s // DT_S * DT_S, one.normal, 1.0) for one in now.contacts
                )
                return replace(now, contacts=told)

            world.observe = seen  # type: ignore[method-assign] # as an engine would be seen
            return world

    trace, truth = observe_run(Silent(), scene, "tuned", DT_S), solve_pic(scene)
    assert trace.effective_time_s == pytest.approx(truth.impacts["time_s"], rel=1e-12)
    for name in ("velocity_first_before", "velocity_second_before", "velocity_first_after", "velocity_second_after"):
        assert trace.impacts[name] == pytest.approx(truth.impacts[name], rel=1e-11, abs=1e-12)
