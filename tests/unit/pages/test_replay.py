"""Replays: what a page is given of a run, and of each of its impacts."""

from __future__ import annotations

import base64
import dataclasses
import gzip
import json
import math
import tomllib
from typing import Any

import numpy as np
import pytest

import carom
from carom.pages.grid import build_grid
from carom.pages.replay import impact_rows, replay_data, scene_replays
from carom.runs.pool import InProcess
from carom.runs.results import Results
from carom.scenes import find_scenes


@pytest.fixture(scope="module")
def results() -> Results:
    scenes = find_scenes(("paper/missed", "paper/late", "classics/miss", "gravity/ladder"))
    return carom.cross_check(scenes, ["pic", "pit"], dts=[1 / 24], profiles=["tuned"], timing=False, pool=InProcess())


@pytest.fixture(scope="module")
def replays(results: Results) -> dict[str, dict[str, Any]]:
    found = scene_replays(results, build_grid(results))
    return {name: json.loads(gzip.decompress(base64.b64decode(data))) for name, data in found}


def test_every_graded_cell_has_a_replay(results: Results, replays: dict[str, dict[str, Any]]) -> None:
    """Each row at a scene's own frame rate that was scored is one of the scene's replays, by a key of its own."""
    graded = {
        f"{row.job.scene.name}/{row.job.engine}/{row.job.profile}"
        for row in results.rows
        if row.score is not None and row.job.refinement == 0
    }
    assert {run["key"] for data in replays.values() for run in data["runs"]} == graded


def test_an_impact_is_told_as_what_became_of_it(replays: dict[str, dict[str, Any]]) -> None:
    """PIT misses the impact of the first case, and finds that of the second late: it looks once a step."""
    runs = {run["key"]: run["impacts"] for data in replays.values() for run in data["runs"]}
    (missed,) = runs["paper/missed/pit/tuned"]
    (late,) = runs["paper/late/pit/tuned"]
    (found,) = runs["paper/late/pic/tuned"]
    assert (missed["flag"], missed["cause"]) == ("missed", "looking once a step")
    assert (late["flag"], late["cause"]) == ("late", "looking once a step")
    assert late["reported"] > late["true"]
    assert (found["flag"], found["became"], found["cause"]) == ("found", "found", "")


def test_why_an_impact_is_missed_is_told_by_the_states(results: Results) -> None:
    """Without states, what PIT does is said and no more; a run that its own states lead elsewhere did not pass by."""
    row = next(row for row in results.rows if row.score and row.score.missed)
    score, trace, reference = row.score, row.trace, results.references["paper/missed"]
    assert score is not None
    assert trace is not None
    assert trace.local_truth is not None
    unseen = dataclasses.replace(trace, local_truth=None)
    (found,) = impact_rows(reference, unseen, dataclasses.replace(score, pit_missed=()))
    assert (found["flag"], found["cause"]) == ("missed", "PIT finds it")
    (found,) = impact_rows(reference, unseen, score)
    assert found["cause"] == "PIT misses it, too"
    meetings = trace.local_truth.meetings.copy()
    for pit_missed, cause in ((True, "looking once a step"), (False, "the method's own: PIT finds it from there")):
        meetings["pit_missed"] = pit_missed
        truth = dataclasses.replace(trace.local_truth, meetings=meetings)
        (found,) = impact_rows(reference, dataclasses.replace(trace, local_truth=truth), score)
        assert found["cause"] == cause
    elsewhere = dataclasses.replace(trace.local_truth, meetings=meetings[:0])
    (found,) = impact_rows(reference, dataclasses.replace(trace, local_truth=elsewhere), score)
    assert "errors before this impact led it elsewhere" in found["cause"]


def test_the_scene_goes_with_it_as_a_file(replays: dict[str, dict[str, Any]]) -> None:
    """What is offered for copying loads as the scene that was run."""
    for name, data in replays.items():
        assert carom.Scene(**tomllib.loads(data["file"])) == find_scenes([name])[0].scene


def test_the_same_results_give_the_same_text(results: Results) -> None:
    """Packing has no clock in it: a report made twice is the same file."""
    grid = build_grid(results)
    assert list(scene_replays(results, grid)) == list(scene_replays(results, grid))


def test_a_run_that_is_not_finite_plays_as_far_as_it_is(results: Results) -> None:
    """Where an engine's numbers end in NaN, the replay ends with the last place that is known, as plain JSON."""
    row = next(row for row in results.rows if row.job.scene.name == "paper/late" and row.job.engine == "pit")
    assert row.trace is not None
    impacts = row.trace.impacts.copy()
    for name in ("velocity_first_after", "velocity_second_after", "time_s"):
        impacts[name] = math.nan
    broken = dataclasses.replace(
        row.trace,
        impacts=impacts,
        final_position_m=np.full((2, 2), math.nan),
        final_velocity_m_s=np.full((2, 2), math.inf),
    )
    for trace in (broken, dataclasses.replace(broken, samples=None)):
        reference = results.references["paper/late"]
        score = carom.compare(reference, trace)
        data = replay_data(reference, [(trace, score, {})])
        (run,) = json.loads(json.dumps(data, allow_nan=False))["runs"]
        assert all(len(track[0]) >= 1 for track in run["tracks"])
