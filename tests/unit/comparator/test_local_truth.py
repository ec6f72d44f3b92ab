"""Every step of a run compared with PIC from the run's own state: what must hold of the catalogue, and of blocks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.stage import disc_at, staged, wall_at

from carom import Scene
from carom.comparator import Grade, local_truth
from carom.comparator.local_truth import analysis
from carom.comparator.local_truth.activity import Activity, activity_of
from carom.comparator.local_truth.block import Block
from carom.comparator.local_truth.rest import Rest
from carom.comparator.local_truth.score import local_score
from carom.comparator.scales import scales_of
from carom.registry import load_adapter
from carom.runs.observe import observe_run
from carom.scenes.catalogue import all_scenes
from carom.solvers.pic import pic_run, solve_pic
from carom.studies.bench.gas import gas_scene
from carom.trace import Outcome
from carom.windows import LocalTruth, States

SHORT = [name for name in all_scenes() if name.startswith(("paper/", "classics/"))]
each_scene = pytest.mark.parametrize(
    "name", [*SHORT, *(pytest.param(name, marks=pytest.mark.long) for name in all_scenes() if name not in SHORT)]
)


def steps_of(scene: Scene, name: str) -> LocalTruth:
    found = observe_run(load_adapter(name), scene, "tuned", 1.0 / scene.frame_rate_hz).local_truth
    assert found is not None
    return found


def states_of(scene: Scene, dt_s: float) -> States:
    """PIC's states at every step boundary, by its solver."""
    run, count = pic_run(scene), scene.step_count(dt_s)
    times = np.arange(count + 1, dtype=np.float64) * dt_s
    place, velocity = [scene.arrays.position_m], [scene.arrays.velocity_m_s]
    for time_s in times[1:]:
        run.advance_to(float(time_s))
        place.append(run.positions().copy())
        velocity.append(run.velocities().copy())
    return States(times, np.array(place), np.array(velocity), None)


@each_scene
def test_each_step_of_pic_is_exact(name: str) -> None:
    """PIC's own steps agree with PIC from each of its states: in crowds, under gravity, with spin, at rest."""
    scene = all_scenes()[name].scene
    reference = solve_pic(scene, max_impacts=2000)
    steps = steps_of(scene, "pic")
    if reference.outcome is Outcome.CRUSHED:  # in the step in which that comes impacts have no end
        steps = replace(steps, windows=steps.windows[steps.windows["end_s"] <= reference.end_time_s])
    score = local_score(steps, scales_of(scene, reference), 64)
    assert (score.missed, score.invented, score.early, score.ahead, score.drifts) == (0, 0, 0, 0, 0)
    # At a tie PIC from a state that is an ulp away may take the other admissible order.
    assert score.grade is Grade.EXACT or (reference.ambiguous and score.grade is Grade.SAMPLED)


@each_scene
def test_a_run_that_only_samples_pays_the_price_and_no_more(name: str) -> None:
    """PIT's steps are off by what PIT pays from the same state and lateness, to 1e-9, and miss what PIT misses."""
    scene = all_scenes()[name].scene
    score = local_score(steps_of(scene, "pit"), scales_of(scene, solve_pic(scene, max_impacts=2000)), 64)
    assert (score.invented, score.early, score.drifts) == (0, 0, 0)
    assert score.missed_by_pit == score.missed
    assert not score.ratio[1] > 1.0 + 1e-9  # NaN where nothing stands alone


def test_blocks_of_any_size_find_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that is looked at in many blocks has the windows, meetings and slips of one that is looked at in one."""
    scene = all_scenes()["classics/gas"].scene
    states = states_of(scene, 1 / 60)
    whole = local_truth(scene, states, dt_s=1 / 60)
    monkeypatch.setattr(analysis, "_NUMBERS", 1)
    pieces = local_truth(scene, states, dt_s=1 / 60)
    assert len(whole.windows) > 20
    for name in ("windows", "meetings", "slips"):
        one, other = getattr(pieces, name), getattr(whole, name)
        assert [
            field for field in one.dtype.names if not np.array_equal(one[field], other[field], equal_nan=True)
        ] == []
    assert (pieces.steps, pieces.until_s) == (whole.steps, whole.until_s)


@pytest.mark.long
def test_a_crowd_is_looked_at_about_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a dense gas a window is open at any boundary; states go as blocks end still, and none is worked out thrice."""
    scene = gas_scene(100, packing=0.5, duration_s=400 / 60)
    sizes: list[int] = []

    def counted(block: Block, rest: Rest) -> Activity:
        sizes.append(len(block))
        return activity_of(block, rest)

    monkeypatch.setattr(analysis, "_NUMBERS", 1)
    monkeypatch.setattr(analysis, "activity_of", counted)
    found = steps_of(scene.model_copy(update={"frame_rate_hz": 60.0}), "pit")
    begins, ends = found.windows["begin_s"], found.windows["end_s"]
    middle_s = np.arange(10, 390) / 60
    assert np.mean([np.any((begins < t) & (ends > t)) for t in middle_s]) > 0.9
    assert found.steps == 400
    assert sum(sizes) < 2 * 400


def test_sinking_adds_up_over_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball that sinks slowly for a whole run has sunk as deep as it has, however often it was looked at."""
    disc = disc_at(0, 0.5, r=0.5)
    scene = staged("sinking", disc, wall_at(0, 0, 0, 1), duration_s=10.0, gravity_m_s2=(0.0, -10.0))
    times = np.arange(601, dtype=np.float64) / 60
    place = np.stack([np.zeros_like(times), 0.5 - 0.01 * times], axis=1)[:, None]
    states = States(times, place, np.zeros_like(place))
    whole = local_truth(scene, states, dt_s=1 / 60)
    monkeypatch.setattr(analysis, "_NUMBERS", 1)
    pieces = local_truth(scene, states, dt_s=1 / 60)
    assert whole.sunk_radii == pytest.approx(0.1 / 0.5, rel=1e-9)
    assert (pieces.sunk_radii, pieces.resting_steps) == (whole.sunk_radii, whole.resting_steps)


def test_a_pass_is_counted_once_however_long_it_lasts() -> None:
    """A ball that falls through the floor, and on for a hundred steps, has missed one impact."""
    scene, dt_s = all_scenes()["gravity/bouncing-ball"].scene, 1 / 60
    times = np.arange(scene.step_count(dt_s) + 1, dtype=np.float64) * dt_s
    start, gravity = scene.arrays, np.array(scene.gravity_m_s2)
    place = start.position_m + start.velocity_m_s * times[:, None, None] + gravity * (times**2 / 2)[:, None, None]
    velocity = start.velocity_m_s + gravity * times[:, None, None]
    score = local_score(
        local_truth(scene, States(times, place, velocity), dt_s=dt_s), scales_of(scene, solve_pic(scene)), 64
    )
    assert score.missed == 1
    assert score.grade is Grade.WRONG
    assert not math.isnan(score.first_missed_s)
