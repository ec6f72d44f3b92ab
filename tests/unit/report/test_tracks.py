"""Tracks, drawn paths and angles: positions and rotations of discs at any time."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, run_cross_check, staged

import carom
from carom import Scene, Wall, compare, solve_pic
from carom.catalogue import all_scenes
from carom.execution.scene_reference import solve_reference
from carom.model.trace import Trace, wall_index
from carom.model.walls import build_drive
from carom.report.replay_data import build_replay_data
from carom.report.tracks import (
    SHARPNESS,
    build_exact_paths,
    build_observed_paths,
    build_observed_tracks,
    build_reference_tracks,
    compute_extent,
    compute_turnings,
)


def compute_gap(scene: Scene, impact: Any, places: Sequence[Any]) -> float:
    """Return the gap between a disc and the body that it strikes, for given centres of the discs."""
    first, second = int(impact["first"]), int(impact["second"])
    here, radius = places[0], scene.discs[first].radius_m
    if second >= 0:
        return float(np.hypot(*(places[1] - here))) - radius - scene.discs[second].radius_m
    wall = scene.walls[wall_index(second)]
    here = here - build_drive(wall.legs, wall.velocity_m_s).moved_at(impact["time_s"])  # as seen from the wall
    if isinstance(wall, Wall):
        return float(np.dot(here - np.array(wall.point_m), wall.normal)) - radius
    return wall.outline.compute_gap(float(here[0]), float(here[1]), radius)


@each("one_in", release_after(1, [9, 1]))
def test_bodies_touch_at_every_impact(one_in: int) -> None:
    """At each impact of the reference the bodies touch within 1e-9 of the extent, in replays and pictures."""
    scenes = [entry.scene for entry in all_scenes().values()][::one_in]
    for scene in scenes:
        trace = require_value(solve_reference(scene)) if len(scene.discs) > 16 else solve_pic(scene, max_impacts=100)
        assert isinstance(trace, Trace)
        tracks, near = build_reference_tracks(trace), 1e-9 * compute_extent(trace)
        paths = build_exact_paths(trace) if len(scene.discs) <= 16 else None
        positions = [iter(points) for _, points in paths.impacts] if paths else []
        for impact in trace.impacts:
            bodies = [body for body in (int(impact["first"]), int(impact["second"])) if body >= 0]
            played = [tracks[body].positions_at(np.array([impact["time_s"]]))[0] for body in bodies]
            drawn = [next(positions[body]) for body in bodies] if paths else played
            assert max(abs(compute_gap(scene, impact, places)) for places in (played, drawn)) <= near, scene.name


@each("name", release_after(1, ["paper/missed", "classics/gas", "gravity/box", "gravity/ladder"]))
def test_track_passes_every_sampled_position(name: str) -> None:
    """A track passes every sample within `SHARPNESS` of the extent and has few more knots than samples."""
    results = run_cross_check([all_scenes()[name].scene], ["pit"], profiles=["tuned"], dts=[1 / 60])
    trace = require_value(results.rows[0].trace)
    extent_m = compute_extent(results.references[name])
    samples = require_value(trace.samples)
    times = samples.time_s[samples.time_s < trace.end_time_s]
    for disc, track in enumerate(build_observed_tracks(trace, extent_m)):
        away = track.positions_at(times) - samples.position_m[: len(times), disc]
        assert np.abs(away).max() <= SHARPNESS * extent_m
        assert len(track.time_s) <= len(times) + len(trace.impacts) + 2


def test_observed_path_has_a_point_per_step() -> None:
    """The path of PIT has a point for each of its 24 steps and the start, and ends in the final state."""
    trace = require_value(run_cross_check(["paper/late"], ["pit"], dts=[1 / 24]).rows[0].trace)
    for disc, (times, points) in enumerate(build_observed_paths(trace).lines):
        assert (len(times), times[-1]) == (25, trace.end_time_s)
        np.testing.assert_allclose(points[-1], trace.final_position_m[disc])


def test_track_is_a_parabola_between_its_knots() -> None:
    """Halfway through a fall of 1 s the disc has fallen a quarter of the way."""
    scene = staged("fall", disc_at(0.0, 0.0), duration_s=1.0, gravity_m_s2=(0.0, -8.0))
    (track,) = build_reference_tracks(carom.solve_pic(scene))
    assert track.positions_at(np.array([0.0, 0.5, 1.0]))[:, 1] == pytest.approx([0.0, -1.0, -4.0], abs=1e-15)


# How discs turn: angles worked out by hand from spins -----------------------------------------------------------------


def test_disc_turns_by_its_spin_between_impacts() -> None:
    """A disc turns at 6 rad/s up to the impact and at 4 after it; the struck disc turns at -2 rad/s, from rest."""
    entry = all_scenes()["spin/english-stick"]
    trace, hit_s, end_s = solve_pic(entry.scene), entry.known.impacts[0].time_s, entry.scene.duration_s
    first, second = compute_turnings(trace)
    np.testing.assert_allclose([first.time_s, second.time_s], [[0.0, hit_s, end_s]] * 2, rtol=1e-15)
    np.testing.assert_allclose(first.angle_rad, [0.0, 6 * hit_s, 6 * hit_s + 4 * (end_s - hit_s)], rtol=1e-14)
    np.testing.assert_allclose(second.angle_rad, [0.0, 0.0, -2 * (end_s - hit_s)], rtol=1e-14)
    assert first.angle_at(end_s - 0.25) == pytest.approx(first.angle_rad[-1] - 1.0)
    assert build_observed_paths(trace).turned[0].angle_at(0.25) == pytest.approx(1.5)


def test_disc_with_a_spin_of_nan_stops_turning() -> None:
    """After an impact with a spin of NaN the angle stays the same, so that no NaN reaches the page."""
    trace = solve_pic(all_scenes()["spin/english-stick"].scene)
    spins = require_value(trace.spins).copy()
    spins["first_after"] = math.nan
    first, _ = compute_turnings(dataclasses.replace(trace, spins=spins))
    assert first.angle_rad[0] == 0.0
    assert first.angle_rad[1] == first.angle_rad[2] > 2.0


def test_replay_shows_error_and_cause_of_a_wrong_spin() -> None:
    """An impact with right velocities and a wrong spin has the spin's error and "the method itself" as the cause."""
    trace = solve_pic(all_scenes()["spin/grip"].scene)
    spins = require_value(trace.spins).copy()
    spins["first_after"] = -1.0
    wrong = dataclasses.replace(trace, spins=spins, dt_s=1 / 60)
    (row,) = build_replay_data(trace, [(wrong, compare(trace, wrong), {})])["runs"][0]["impacts"]
    assert row["spin"] == pytest.approx(0.2)
    assert row["cause"] == "the method itself"
