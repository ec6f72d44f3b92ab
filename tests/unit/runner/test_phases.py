"""Phases: one scene at many parts of a step, against the closed form of what PIT misses."""

from __future__ import annotations

import math

import numpy as np
import pytest

import carom
from carom import Disc, Scene, solve_pic
from carom.errors import InputError
from carom.runner.phases import phase_values, pit_miss_probability, shifted_scenes
from carom.scenes import catalogue


def test_phases_are_spread_evenly_and_are_the_same_for_the_same_seed() -> None:
    """A hundred phases leave no gap twice as wide as an even spread would; seeds differ, and repeat themselves."""
    phases = sorted(phase_values(100, seed=3))
    gaps = np.diff([*phases, phases[0] + 1.0])
    assert gaps.max() < 2.0 / 100
    assert phase_values(100, seed=3) == phase_values(100, seed=3) != phase_values(100, seed=4)


def test_a_shifted_scene_is_the_same_scene_begun_later() -> None:
    """Each impact comes just as much earlier as the start was moved ahead, and is the same impact."""
    reference = solve_pic(catalogue()["paper/wrong-direction"].scene)
    dt = 1 / 24
    for one in shifted_scenes(reference, dt, phase_values(7)):
        shift = reference.impacts["time_s"] - one.reference.impacts["time_s"]
        # Positions of order 1 to half an ulp, over speeds of order 1, and through one more impact.
        np.testing.assert_allclose(shift, one.phase * dt, rtol=0, atol=1e-13)
        assert one.scene.duration_s == pytest.approx(reference.scene.duration_s - one.phase * dt, abs=1e-15)


def test_a_start_too_near_the_first_impact_is_taken_back_instead() -> None:
    """Where the way ahead is shorter than a step, the start is moved back by the rest of it."""
    scene = Scene(
        name="near",
        discs=[
            Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5),
            Disc(position_m=(1.25, 0), radius_m=0.5),
        ],
        duration_s=2.0,
    )
    (one,) = shifted_scenes(solve_pic(scene), 0.5, [0.75])
    assert one.reference.impacts["time_s"].tolist() == [0.25 + 0.125]


def missing(offset: float, advance: float) -> Scene:
    """Two discs of contact distance 1 at 10 frames a second, the relative advance a frame in contact distances."""
    return Scene(
        name="passing",
        discs=[
            Disc(position_m=(-4.0 * advance, 0.0), velocity_m_s=(10 * advance, 0.0), radius_m=0.5),
            Disc(position_m=(0.0, offset), radius_m=0.5),
        ],
        duration_s=1.0,
        frame_rate_hz=10.0,
    )


@pytest.mark.parametrize(("offset", "advance"), [(0.0, 2.0), (0.8, 0.9)])
def test_pit_misses_the_share_of_phases_that_the_closed_form_says(offset: float, advance: float) -> None:
    """Over 60 phases PIT's misses are the closed form's, to the discrepancy of the sequence.

    Points at multiples of the golden ratio have a discrepancy below (2 + log N)/N.
    """
    scene = missing(offset, advance)
    results = carom.cross_check([scene], ["pit"], dts=[0.1], profiles=["tuned"], timing=False, phases=60)
    spread = results.rows[0].spread
    assert spread is not None
    assert spread.phases == 60
    expected = max(0.0, 1.0 - math.sqrt(1 - offset**2) / advance)
    assert spread.pit_miss_probability == pytest.approx(expected, abs=1e-12)
    assert abs(spread.miss_probability - expected) <= (2 + math.log(60)) / 60


def test_the_closed_form_speaks_of_two_discs_that_meet_only() -> None:
    """Where nothing is to be missed, or more than two bodies are about, there is no closed form."""
    for name in ("classics/miss", "classics/touching-apart", "classics/sorting", "classics/galperin-100"):
        assert math.isnan(pit_miss_probability(catalogue()[name].scene, 1 / 60)), name


@pytest.mark.parametrize("phases", [-1, True, 2.5])
def test_a_number_of_phases_that_is_none_is_refused(phases: int) -> None:
    """A negative, fractional or logical number of phases is refused by name."""
    with pytest.raises(InputError, match="phases must be a whole number"):
        carom.cross_check([missing(0.0, 0.5)], ["pit"], phases=phases)
