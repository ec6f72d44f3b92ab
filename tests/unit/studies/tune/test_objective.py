"""Comparison of two sets of settings."""

import math
from dataclasses import replace

import pytest
from tests.cases import each

from carom.catalogue import find_scenes
from carom.comparator import Grade, compare
from carom.engines.registry import load_adapter
from carom.execution.observation.engine_run import observe_run
from carom.solvers.pic import solve_pic
from carom.studies.tune.evaluate import summarise_score
from carom.studies.tune.objective import SceneResult, compute_error_on_scale, compute_merit


def test_merit_ranks_wrong_scenes_before_errors_and_cost() -> None:
    """Merits and their numbers rank by wrong scenes, then scenes neither exact nor close, then the error and cost."""
    exact = SceneResult(Grade.EXACT, 0.0, seconds=1.0)
    order = [
        [replace(exact, seconds=9.0)] * 2,
        [SceneResult(Grade.CLOSE, 1e-3, seconds=1.0), exact],
        [SceneResult(Grade.SAMPLED, 0.5, seconds=1.0), exact],
        [SceneResult(Grade.INACCURATE, 5.0, seconds=1.0), exact],
        [SceneResult(Grade.INACCURATE, math.inf, seconds=1.0)] * 2,
        [SceneResult(Grade.WRONG, 0.0, seconds=0.1), replace(exact, seconds=0.1)],
    ]
    first = [exact] * 2
    merits = [compute_merit(results, first) for results in order]
    assert merits == sorted(merits)
    numbers = [merit.to_number(len(first)) for merit in merits]
    assert numbers == sorted(numbers)
    assert len({*merits}) == len({*numbers}) == len(merits)


def test_cost_is_median_time_ratio_to_first_profile() -> None:
    """The cost is the median of each scene's time relative to the first profile; untimed scenes are left out."""
    first = [SceneResult(Grade.EXACT, 0.0, seconds=s) for s in (1.0, 2.0, 4.0, math.nan)]
    own = [SceneResult(Grade.EXACT, 0.0, seconds=s) for s in (3.0, 4.0, 4.0, 1.0)]
    assert compute_merit(own, first).cost == 2.0
    assert compute_merit(own).cost == 1.0


@each(
    "result, part",
    [
        (SceneResult(Grade.SAMPLED, 1.0), 0.5),
        (SceneResult(Grade.EXACT, 0.0), 0.0),
        (SceneResult(Grade.EXACT, 1e-12), 0.0),
        (SceneResult(Grade.CLOSE, 1e-6), 0.25),
        (SceneResult(Grade.INACCURATE, math.inf), 1.0),
        (SceneResult(Grade.EXACT, math.nan), 0.0),  # no impact, and none found
        (SceneResult(Grade.INACCURATE, math.nan), 1.0),
        (SceneResult(Grade.WRONG, 0.0), 1.0),
        (SceneResult(None), 1.0),
    ],
)
def test_error_scale_maps_rounding_to_0_and_pit_to_one_half(result: SceneResult, part: float) -> None:
    """Rounding is 0, PIT's error 0.5, an infinite error or a wrong scene 1, and NaN 0 only for an exact run."""
    assert compute_error_on_scale(result) == pytest.approx(part, abs=1e-12)


def test_diverged_run_is_scored_by_single_steps() -> None:
    """A diverged run is scored by its single steps; it is neither wrong nor exact nor close."""
    scene = find_scenes(["paper/late"])[0].scene
    pit = observe_run(load_adapter("pit"), scene, "tuned", 1 / 24)
    score = compare(solve_pic(scene), pit, sampling=pit)
    assert score.local_truth is not None
    steps = replace(score.local_truth, missed=2, invented=3, ratio=(0.5, 0.75))
    whole = replace(score, price_paid=7.0, missed=(0,), local_truth=steps)
    diverged = summarise_score(replace(whole, grade=Grade.DIVERGED, diverged_s=0.25))
    assert (diverged.error_ratio, diverged.missed, diverged.spurious) == (0.75, 2, 3)
    plain = summarise_score(whole)
    assert (plain.error_ratio, plain.missed, plain.spurious) == (7.0, 1, 0)
    assert (diverged.is_wrong, diverged.is_imprecise) == (False, True)
