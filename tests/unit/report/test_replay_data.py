"""Data of replays: runs and their impacts, as a page reads them."""

import dataclasses
import json
import math
import tomllib
from typing import Any

import numpy as np
import pytest
from tests.scene_builders import disc_at, require_value, run_cross_check, staged, wall_at

import carom
from carom.catalogue import find_scenes
from carom.comparator import Score
from carom.execution.results import Results
from carom.model.step_windows import LocalTruth
from carom.report.impact_rows import build_impact_rows
from carom.report.replay_data import build_replay_data, describe_run, find_first_fault


@pytest.fixture(scope="module")
def results() -> Results:
    scenes = find_scenes(("paper/missed", "paper/late", "classics/miss", "gravity/ladder"))
    return run_cross_check(scenes, ["pic", "pit"], dts=[1 / 24], profiles=["tuned"])


@pytest.fixture(scope="module")
def replays(results: Results) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for name, reference in results.references.items():
        rows = [row for row in results.rows if row.job.scene.name == name]
        runs = [
            (
                require_value(row.trace),
                require_value(row.score),
                describe_run(row, "", f"{name}/{row.job.method.name}", ""),
            )
            for row in rows
        ]
        found[name] = build_replay_data(reference, runs)
    return found


def test_replay_labels_missed_late_and_found_impacts(replays: dict[str, dict[str, Any]]) -> None:
    """PIT misses one impact and finds another one late, which are the runs' faults; PIC finds it in time."""
    runs = {run["key"]: run for data in replays.values() for run in data["runs"]}
    keys = ("paper/missed/pit/tuned", "paper/late/pit/tuned", "paper/late/pic/event-driven")
    for key, flag, cause in zip(
        keys, ("missed", "late", "found"), ("checking once per step", "checking once per step", ""), strict=True
    ):
        (impact,) = runs[key]["impacts"]
        assert (impact["flag"], impact["cause"]) == (flag, cause)
        assert (runs[key]["fault"] or {}).get("row") == (None if flag == "found" else 0)
    words = "overlap and approach each other for 24.9 ms, and a step lasts 41.7 ms: missed (checking once per step)."
    assert words in runs[keys[0]]["fault"]["said"]


def test_replay_lists_contact_modes_with_their_times() -> None:
    """A disc slides until ``u / (g f (1 + 1/k))`` and then rolls; a scene without lasting contact has no modes."""
    scene = find_scenes(("contact/slide-to-roll",))[0].scene
    (disc,) = scene.discs
    ((number, changes),) = build_replay_data(carom.solve_pic(scene), [])["modes"]
    pull, slip = -scene.gravity_m_s2[1], disc.velocity_m_s[0] + disc.radius_m * disc.spin_rad_s
    rolls_s = slip / (pull * scene.wall_friction * (1.0 + 1.0 / disc.inertia_factor))
    assert number == 0
    assert [word for _, word in changes] == ["slides", "rolls", ""]
    assert [time_s for time_s, _ in changes] == pytest.approx([0.0, rolls_s, scene.duration_s])
    assert build_replay_data(carom.solve_pic("paper/missed"), [])["modes"] == []


def test_cause_of_a_missed_impact_follows_from_the_states(results: Results) -> None:
    """The states before a missed impact decide its cause; without states only PIT's finding is reported."""
    row = next(row for row in results.rows if row.score and row.score.missed)
    score, trace, reference = require_value(row.score), require_value(row.trace), results.references["paper/missed"]
    own = require_value(trace.local_truth)

    def find_cause(truth: LocalTruth | None, score: Score = score) -> str:
        (found,) = build_impact_rows(reference, dataclasses.replace(trace, local_truth=truth), score)
        assert found["flag"] == "missed"
        return str(found["cause"])

    assert find_cause(None, dataclasses.replace(score, pit_missed=())) == "PIT finds this impact"
    assert find_cause(None) == "PIT also misses this impact"
    meetings = own.meetings.copy()
    causes = {True: "checking once per step", False: "the method itself: PIT finds the impact from the same state"}
    for pit_missed, cause in causes.items():
        meetings["pit_missed"] = pit_missed
        assert find_cause(dataclasses.replace(own, meetings=meetings)) == cause
    assert "earlier errors" in find_cause(dataclasses.replace(own, meetings=meetings[:0]))


def test_replay_contains_the_scene_as_a_file(replays: dict[str, dict[str, Any]]) -> None:
    """The scene file in a replay loads as the scene that was run."""
    for name, data in replays.items():
        assert carom.Scene(**tomllib.loads(data["file"])) == find_scenes([name])[0].scene


def test_replay_of_a_non_finite_run_is_valid_json(results: Results) -> None:
    """A run with NaN in its impacts and final state has a track for each disc, and its data contain no NaN."""
    row = next(row for row in results.rows if row.job.scene.name == "paper/late" and row.job.engine == "pit")
    lost = dict.fromkeys(("velocity_first_after", "velocity_second_after", "time_s"), math.nan)
    impacts = require_value(row.trace).impacts.copy()
    for name, value in lost.items():
        impacts[name] = value
    states: dict[str, Any] = {
        "final_position_m": np.full((2, 2), math.nan),
        "final_velocity_m_s": np.full((2, 2), math.inf),
    }
    broken = dataclasses.replace(require_value(row.trace), impacts=impacts, **states)
    for trace in (broken, dataclasses.replace(broken, samples=None)):
        reference = results.references["paper/late"]
        data = build_replay_data(reference, [(trace, carom.compare(reference, trace), {})])
        (run,) = json.loads(json.dumps(data, allow_nan=False))["runs"]
        assert all(len(track[0]) >= 1 for track in run["tracks"])


def test_replay_has_contact_point_and_overlap_time(results: Results) -> None:
    """The replay has the point where rims touch and the time between the roots of |p + v t| = reach."""
    reference = results.references["paper/missed"]
    one, other = reference.scene.discs
    place, passing = (np.subtract(getattr(other, name), getattr(one, name)) for name in ("position_m", "velocity_m_s"))
    reach = one.radius_m + other.radius_m
    begin_s, end_s = np.sort(np.roots([passing @ passing, 2 * place @ passing, place @ place - reach**2]).real)
    ((x, y, overlap_s),) = build_replay_data(reference, [])["meetings"]
    assert overlap_s == pytest.approx(end_s - begin_s, rel=1e-5)  # as it is rounded for the page
    for disc in (one, other):
        centre = np.add(disc.position_m, begin_s * np.array(disc.velocity_m_s))
        assert math.hypot(x - centre[0], y - centre[1]) == pytest.approx(disc.radius_m, rel=1e-5)


def test_replay_has_no_overlap_time_for_walls_and_falls() -> None:
    """An impact with a wall, and of a falling disc with a fixed one, has no overlap time."""
    to_wall = staged("to-wall", disc_at(0.0, 2.0, 2.0), wall_at(2.0, 0.0, -1.0, 0.0), duration_s=1.0)
    discs = disc_at(0.0, 2.0), disc_at(0.0, 0.0, m=math.inf)
    falling = staged("falling", *discs, gravity_m_s2=(0.0, -9.81), duration_s=0.6)
    for scene in (to_wall, falling):
        ((_, _, overlap_s), *_) = build_replay_data(carom.solve_pic(scene), [])["meetings"]
        assert overlap_s is None


def test_fault_without_a_miss_has_the_largest_velocity_error() -> None:
    """The fault is a missed impact, else the late or early one with the largest error, never an invented one."""
    rows: list[dict[str, Any]] = [
        {"flag": "late", "velocity": 0.01},
        {"flag": "late", "velocity": 0.4},
        {"flag": "found", "velocity": 0.9},
        {"flag": "early", "velocity": None},
    ]
    assert find_first_fault(rows) == 1
    assert find_first_fault([*rows, {"flag": "missed", "velocity": None}]) == 4
    assert find_first_fault([*rows, {"flag": "invented", "reported": None}]) == 1  # it has no instant to hold at
