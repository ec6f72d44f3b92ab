"""What makes one set of settings better than another."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each

from carom.catalogue import find_scenes
from carom.comparator import Grade, compare
from carom.engines.registry import load_adapter
from carom.execution.engine_run import observe_run
from carom.solvers.pic import solve_pic
from carom.studies.tune.evaluate import judge_score
from carom.studies.tune.objective import Judged, Merit, compute_error_on_scale, compute_merit

SCENES = 5
MERITS = st.builds(
    Merit,
    wrong=st.integers(0, SCENES),
    behind=st.integers(0, SCENES),
    error=st.integers(0, 100),
    cost=st.floats(1e-3, 1e3),
)


@given(MERITS, MERITS)
def test_the_number_of_a_merit_has_its_order(one: Merit, other: Merit) -> None:
    """The single number for an optimiser has the same order; nearly equal costs may have one number."""
    if one < other:
        assert one.to_number(SCENES) <= other.to_number(SCENES)
        if (one.wrong, one.behind, one.error) != (other.wrong, other.behind, other.error):
            assert one.to_number(SCENES) < other.to_number(SCENES)


def test_a_scene_wrong_outranks_every_error_and_cost() -> None:
    """Wrong scenes count first, then those neither exact nor close, then the error, then the cost."""
    order = [
        [Judged(Grade.EXACT, 0.0, seconds=9.0)] * 2,
        [Judged(Grade.CLOSE, 1e-3, seconds=1.0), Judged(Grade.EXACT, 0.0, seconds=1.0)],
        [Judged(Grade.SAMPLED, 0.5, seconds=1.0), Judged(Grade.EXACT, 0.0, seconds=1.0)],
        [Judged(Grade.INACCURATE, 5.0, seconds=1.0), Judged(Grade.EXACT, 0.0, seconds=1.0)],
        [Judged(Grade.WRONG, 0.0, seconds=0.1), Judged(Grade.EXACT, 0.0, seconds=0.1)],
    ]
    first = [Judged(Grade.EXACT, 0.0, seconds=1.0)] * 2
    merits = [compute_merit(judged, first) for judged in order]
    assert merits == sorted(merits)
    assert len({*merits}) == len(merits)


def test_the_cost_is_the_median_of_ratios_to_the_first_profile() -> None:
    """Each scene's seconds are divided by its own of the first profile; what was not timed is left out."""
    first = [Judged(Grade.EXACT, 0.0, seconds=s) for s in (1.0, 2.0, 4.0, math.nan)]
    own = [Judged(Grade.EXACT, 0.0, seconds=s) for s in (3.0, 4.0, 4.0, 1.0)]
    assert compute_merit(own, first).cost == 2.0
    assert compute_merit(own).cost == 1.0


@each(
    "judged, part",
    [
        (Judged(Grade.SAMPLED, 1.0), 0.5),
        (Judged(Grade.EXACT, 0.0), 0.0),
        (Judged(Grade.EXACT, 1e-12), 0.0),
        (Judged(Grade.CLOSE, 1e-6), 0.25),
        (Judged(Grade.INACCURATE, math.inf), 1.0),
        (Judged(Grade.EXACT, math.nan), 0.0),  # no impact, and none found
        (Judged(Grade.INACCURATE, math.nan), 1.0),
        (Judged(Grade.WRONG, 0.0), 1.0),
        (Judged(None), 1.0),
    ],
)
def test_an_error_is_a_part_of_a_scale_of_ratios(judged: Judged, part: float) -> None:
    """PIT's error is the middle, rounding the one end and anything the other; NaN is what the grade says."""
    assert compute_error_on_scale(judged) == pytest.approx(part, abs=1e-12)


def test_what_was_not_run_counts_as_wrong() -> None:
    """A setting with which an engine crashes has not found that scene's impacts: it is no way to fewer scenes wrong."""
    assert compute_merit([Judged(None, reason="crashed")]) == compute_merit([Judged(Grade.WRONG)])


def test_a_run_that_parted_is_judged_by_its_steps() -> None:
    """Which impacts a parted trajectory has is chance: what it misses and pays is read from its own states."""
    scene = find_scenes(["paper/late"])[0].scene
    pit = observe_run(load_adapter("pit"), scene, "tuned", 1 / 24)
    score = compare(solve_pic(scene), pit, sampling=pit)
    assert score.local_truth is not None
    steps = replace(score.local_truth, missed=2, invented=3, ratio=(0.5, 0.75))
    whole = replace(score, price_paid=7.0, missed=(0,), local_truth=steps)
    parted = judge_score(replace(whole, grade=Grade.PARTED, parted_s=0.25))
    assert (parted.price, parted.missed, parted.spurious) == (0.75, 2, 3)
    assert (judge_score(whole).price, judge_score(whole).missed, judge_score(whole).spurious) == (7.0, 1, 0)
    assert not parted.wrong
    assert parted.behind
