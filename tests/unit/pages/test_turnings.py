"""How discs turn in replays and pictures: angles worked out by hand from spins."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from carom import compare, solve_pic
from carom.pages.paths import observed_paths
from carom.pages.replay import replay_data
from carom.pages.tracks import turnings
from carom.scenes import all_scenes


def test_a_disc_turns_by_its_spin_from_impact_to_impact() -> None:
    """At 6 rad/s to the impact, then at 4: and the disc that was struck at -2, from rest."""
    entry = all_scenes()["spin/english-stick"]
    trace, hit_s, end_s = solve_pic(entry.scene), entry.known.impacts[0].time_s, entry.scene.duration_s
    first, second = turnings(trace)
    np.testing.assert_allclose([first.time_s, second.time_s], [[0.0, hit_s, end_s]] * 2, rtol=1e-15)
    np.testing.assert_allclose(first.angle_rad, [0.0, 6 * hit_s, 6 * hit_s + 4 * (end_s - hit_s)], rtol=1e-14)
    np.testing.assert_allclose(second.angle_rad, [0.0, 0.0, -2 * (end_s - hit_s)], rtol=1e-14)
    assert first.at(end_s - 0.25) == pytest.approx(first.angle_rad[-1] - 1.0)
    assert observed_paths(trace).turned[0].at(0.25) == pytest.approx(1.5)


def test_nothing_turns_without_spins() -> None:
    """A scene without friction and spin has no marks: neither in a replay nor in a picture."""
    trace = solve_pic(all_scenes()["paper/late"].scene)
    assert turnings(trace) == ()
    data = replay_data(trace, [(trace, compare(trace, trace), {})])
    assert data["turned"] == data["runs"][0]["turned"] == []


def test_a_disc_whose_spin_is_no_number_turns_no_further() -> None:
    """An engine's NaN must not reach the page, which has no number for it."""
    trace = solve_pic(all_scenes()["spin/english-stick"].scene)
    assert trace.spins is not None
    spins = trace.spins.copy()
    spins["first_after"] = math.nan
    first, _ = turnings(dataclasses.replace(trace, spins=spins))
    assert first.angle_rad[0] == 0.0
    assert first.angle_rad[1] == first.angle_rad[2] > 2.0


def test_the_replay_says_how_wrong_a_spin_is_and_why() -> None:
    """An impact whose velocities are right and whose spin is not has the error beside it, and the cause."""
    trace = solve_pic(all_scenes()["spin/grip"].scene)
    assert trace.spins is not None
    spins = trace.spins.copy()
    spins["first_after"] = -1.0
    wrong = dataclasses.replace(trace, spins=spins, dt_s=1 / 60)
    (row,) = replay_data(trace, [(wrong, compare(trace, wrong), {})])["runs"][0]["impacts"]
    assert row["spin"] == pytest.approx(0.2)
    assert row["cause"] == "the method's own"
