"""Damping against known answers: the group `contact`, and what checking once per frame costs there."""

from __future__ import annotations

import numpy as np
import pytest
from tests.lengths import each

from carom import compare, solve_pic, solve_pit
from carom.comparator.grades import Grade
from carom.comparator.shift import begun_earlier
from carom.pages.tracks import SHARPNESS, reference_tracks
from carom.scenes import CatalogueScene, find_scenes

SCENES = find_scenes(["contact/damped-*"])
#: What rounding may leave of an answer, over the scene's sizes.
ROUNDING = 1e-12


@each("entry", SCENES)
def test_pit_of_a_damped_scene_pays_for_sampling_alone(entry: CatalogueScene) -> None:
    """PIC agrees with itself to rounding, and PIT is called sampled: nothing of damping is held against it."""
    truth, pit = solve_pic(entry.scene), solve_pit(entry.scene, frame_rate_hz=60.0)
    assert compare(truth, truth).grade is Grade.EXACT
    score = compare(truth, pit, sampling=pit)
    assert score.grade is (Grade.SAMPLED if len(truth.impacts) else Grade.EXACT)
    assert score.consistency is not None
    # Of speeds over the scene's; rounding of a few steps.
    assert max(score.consistency.velocity.size, score.consistency.spin.size) < ROUNDING


@each("entry", SCENES)
def test_a_damped_scene_that_begins_earlier_goes_on_the_same(entry: CatalogueScene) -> None:
    """Begun a thousandth of a second earlier, every impact is that much later and the end the same."""
    truth, moved = solve_pic(entry.scene), solve_pic(begun_earlier(entry.scene, 1e-3))
    assert moved.impacts["time_s"] == pytest.approx(truth.impacts["time_s"] + 1e-3, abs=ROUNDING)
    assert moved.final_position_m == pytest.approx(truth.final_position_m, abs=ROUNDING)
    assert moved.final_velocity_m_s == pytest.approx(truth.final_velocity_m_s, abs=ROUNDING)


@each("entry", SCENES)
def test_what_is_drawn_is_where_damped_discs_are(entry: CatalogueScene) -> None:
    """Between its knots a drawn path is off by no more than its sharpness, of the greatest way of a flight."""
    times = np.linspace(0.0, entry.scene.duration_s, 97).tolist()
    trace = solve_pic(entry.scene, sample_times_s=times)
    assert trace.samples is not None
    assert len(trace.samples.time_s) == 97
    way = np.ptp(np.concatenate([trace.samples.position_m, [trace.final_position_m]]), axis=0).max()
    for disc, track in enumerate(reference_tracks(trace)):
        off = np.abs(track.at(trace.samples.time_s) - trace.samples.position_m[:, disc]).max()
        assert off <= 2.0 * SHARPNESS * way  # of both axes
