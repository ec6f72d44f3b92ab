"""The horizon: beyond it nothing is compared globally, and up to it everything is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from tests.planted.faults import replayed

from carom import compare, solve_pic
from carom.comparator import Verdict
from carom.comparator.horizon import estimate_horizon
from carom.errors import InputError
from carom.scenes import catalogue


def test_what_lies_beyond_the_horizon_is_not_held_against_anybody() -> None:
    """An impact dropped within the horizon is missed; from impact 40 on passing through beyond it is nobody's fault."""
    reference = solve_pic(catalogue()["classics/gas"].scene)
    early = dataclasses.replace(reference, impacts=np.delete(reference.impacts, 5))
    late = replayed(reference, reference.impacts[:40].copy())
    assert compare(reference, early, horizon=20).missed == (5,)
    score = compare(reference, late, horizon=20)
    assert score.verdicts == (Verdict.CONFORMS,)
    assert (score.expected, score.beyond_horizon) == (20, len(reference.impacts) - 20)
    assert len(score.errors) == 20
    assert compare(reference, late).missed[0] == 40


def test_a_time_and_a_number_of_impacts_are_one_horizon() -> None:
    """A horizon by number of impacts and one by the time of the last of them are the same."""
    reference = solve_pic(catalogue()["classics/gas"].scene)
    by_time = compare(reference, reference, horizon=float(reference.impacts["time_s"][19]))
    assert by_time.expected == compare(reference, reference, horizon=20).expected == 20
    everything = compare(reference, reference, horizon=10**6)
    assert everything.horizon_s is None
    assert everything.beyond_horizon == 0


@pytest.mark.parametrize("horizon", [-1, -0.5, float("nan"), True])
def test_a_horizon_that_is_none_is_refused(horizon: float) -> None:
    """A negative horizon, NaN, or a truth value is refused by name."""
    reference = solve_pic(catalogue()["paper/late"].scene)
    with pytest.raises(InputError, match="horizon must be"):
        compare(reference, reference, horizon=horizon)


def test_short_scenes_are_believed_whole() -> None:
    """No horizon is estimated for scenes whose known answers PIC reproduces to rounding."""
    for entry in catalogue().values():
        if entry.known.impacts and entry.known.count == len(entry.known.impacts) and not entry.known.convention:
            assert estimate_horizon(solve_pic(entry.scene)) is None, entry.name


def test_the_estimate_ends_before_the_run_does_in_a_chaotic_gas() -> None:
    """Of sixteen discs for twenty seconds, tens to hundreds of impacts are believed, as certified runs have it.

    These were measured to be off by more than 1e-12 from impact 29 to 101 on, and by 1e-6 from 95 to 327 on, at packing
    .1 to .4.
    """
    gas = catalogue()["classics/gas"].scene.model_copy(update={"duration_s": 20.0})
    reference = solve_pic(gas)
    horizon = estimate_horizon(reference)
    assert horizon is not None
    believed = int(np.searchsorted(reference.impacts["time_s"], horizon, side="right"))
    assert 29 < believed < 327


def test_impacts_at_one_instant_far_apart_may_change_places() -> None:
    """Many discs that strike the walls at the very start do so in any order: that ends no horizon."""
    from carom.bench.gas import gas_scene

    reference = solve_pic(gas_scene(16, 0.3, duration_s=1.0, touching=True))
    assert (reference.impacts["time_s"] == 0.0).sum() > 1
    assert estimate_horizon(reference) is None
