"""Tracks: where each disc of a run is at any time, in few numbers."""

from __future__ import annotations

import numpy as np
import pytest
from tests.lengths import long_after

import carom
from carom.pages.paths import extent_of
from carom.pages.tracks import SHARPNESS, observed_tracks, reference_tracks
from carom.runs.pool import InProcess
from carom.runs.reference import reference_trace
from carom.scenes import all_scenes
from carom.trace import Trace
from carom.walls import drive_of

GROUPS = sorted({name.partition("/")[0] for name in all_scenes()})


@pytest.mark.parametrize("group", long_after(2, GROUPS))
def test_the_bodies_of_every_impact_touch(group: str) -> None:
    """At each impact of the reference its two bodies touch, to 1e-9 of the scene's extent."""
    for scene in (entry.scene for name, entry in all_scenes().items() if name.startswith(f"{group}/")):
        trace = reference_trace(scene)
        assert isinstance(trace, Trace)
        tracks, near = reference_tracks(trace), 1e-9 * extent_of(trace)
        for impact in trace.impacts:
            when = np.array([impact["time_s"]])
            first, second = int(impact["first"]), int(impact["second"])
            place = tracks[first].at(when)[0]
            if second >= 0:
                gap = float(np.linalg.norm(tracks[second].at(when)[0] - place)) - scene.discs[second].radius_m
            else:
                wall = scene.walls[-1 - second]
                place = place - drive_of(wall.legs, wall.velocity_m_s).moved_at(when[0])  # as seen from the wall
                if isinstance(wall, carom.Wall):
                    gap = float(np.dot(place - np.array(wall.point_m), wall.normal))
                else:
                    gap = wall.outline.gap(float(place[0]), float(place[1]), 0.0)
            assert abs(gap - scene.discs[first].radius_m) <= near


@pytest.mark.parametrize("name", long_after(1, ["paper/missed", "classics/gas", "gravity/box", "gravity/ladder"]))
def test_a_sampled_run_stands_where_its_states_are(name: str) -> None:
    """A track passes every state that was kept, to `SHARPNESS` of the extent, and holds no more knots than states."""
    scene = all_scenes()[name].scene
    results = carom.cross_check([scene], ["pit"], profiles=["tuned"], dts=[1 / 60], timing=False, pool=InProcess())
    trace = results.rows[0].trace
    assert trace is not None
    assert trace.samples is not None
    extent_m = extent_of(results.references[name])
    times = trace.samples.time_s[trace.samples.time_s < trace.end_time_s]
    for disc, track in enumerate(observed_tracks(trace, extent_m)):
        away = track.at(times) - trace.samples.position_m[: len(times), disc]
        assert np.abs(away).max() <= SHARPNESS * extent_m
        assert len(track.time_s) <= len(times) + len(trace.impacts) + 2


def test_a_track_flies_a_parabola_between_its_knots() -> None:
    """Halfway through a fall of one second the disc has fallen a quarter of the way, whatever the knots say."""
    scene = carom.Scene(
        name="fall", duration_s=1.0, gravity_m_s2=(0.0, -8.0), discs=[carom.Disc(position_m=(0.0, 0.0), radius_m=0.5)]
    )
    (track,) = reference_tracks(carom.solve_pic(scene))
    assert track.at(np.array([0.0, 0.5, 1.0]))[:, 1] == pytest.approx([0.0, -1.0, -4.0], abs=1e-15)
