"""The horizon, given, certified or estimated: nothing is compared globally beyond it, and everything up to it."""

import dataclasses
import math

import numpy as np
import pytest
from tests.cases import each
from tests.planted.faults import replayed
from tests.scene_builders import altered, disc_at, line, staged, sure, wall_at

import carom
from carom import CertifiedTrace, Chain, Trace, certify, compare, solve_pic
from carom.catalogue import catalogue
from carom.comparator import Grade, Verdict, compute_horizon
from carom.comparator.horizon import estimate_horizon
from carom.errors import InputError
from carom.studies.bench.gas import build_gas_scene

IMPACTS = 60
SCENE = build_gas_scene(16, 0.1, duration_s=100.0)


@pytest.fixture(scope="module")
def certified() -> CertifiedTrace:
    return certify(SCENE, max_impacts=IMPACTS)


@pytest.fixture(scope="module")
def pic() -> Trace:
    return solve_pic(SCENE, max_impacts=IMPACTS)


def test_float64_agrees_to_ten_digits_and_not_to_all(certified: CertifiedTrace, pic: Trace) -> None:
    """All 60 impacts of a dilute gas agree to 1e-6, but not all agree to 2e-15, because errors grow."""
    assert compute_horizon(certified, pic, tolerance=1e-6).agreed == IMPACTS
    assert compute_horizon(certified, pic, tolerance=2e-15).agreed < IMPACTS


@each("k", [0, 17, IMPACTS - 1])
def test_the_first_impact_that_is_off_ends_it(certified: CertifiedTrace, pic: Trace, k: int) -> None:
    """A time or a velocity off by more than the tolerance is where the horizon is, for NaN too."""
    for values in ({"time_s": pic.impacts["time_s"][k] + 1e-3}, {"velocity_first_after": (math.nan, 0.0)}):
        found = compute_horizon(certified, altered(pic, k, **values), tolerance=1e-6)
        assert (found.agreed, found.order_differs) == (k, None)
        assert found.end_s == (certified.trace.impacts["time_s"][k - 1] if k else 0.0)
        assert not found.covers_the_scene


def test_an_impact_of_other_bodies_is_where_the_order_differs(certified: CertifiedTrace, pic: Trace) -> None:
    """The first impact of a pair that the certified run does not have there is named."""
    other = 14 if pic.impacts["first"][25] != 14 else 13
    found = compute_horizon(certified, altered(pic, 25, first=other), tolerance=1e-6)
    assert (found.agreed, found.order_differs) == (25, 25)
    assert "differs from impact 26 on" in str(found)


def test_a_scene_of_a_closed_form_is_covered_to_its_end() -> None:
    """Where all impacts are certified and agree, the horizon is the end of the scene."""
    found = carom.horizon(staged("two", disc_at(0.0, 0.0, 1.0), disc_at(3.0, 0.3), duration_s=5.0))
    assert found.covers_the_scene
    assert (found.agreed, found.certified, found.end_s) == (1, 1, 5.0)


def test_discs_at_rest_that_a_driven_wall_strikes_are_covered() -> None:
    """What errors are compared with is the speed that the wall gives, where all discs are at rest at the start."""
    discs, press = (
        (disc_at(1.0, 0.0, r=0.1), disc_at(2.0, 0.05, r=0.1)),
        wall_at(0.0, 0.0, 1.0, 0.0, velocity_m_s=(0.3, 0.0)),
    )
    scene = staged("swept", *discs, press, duration_s=10.0)
    assert carom.horizon(scene).covers_the_scene


@pytest.mark.long
def test_a_horizon_ends_where_pic_says_that_a_disc_is_crushed() -> None:
    """Between edges, along which it goes, a certified run would follow it without end."""
    edges = [Chain(points_m=[(x, -1.0), (x, 1.0)], velocity_m_s=(-x / 4.0, 0.0)) for x in (0.0, 2.0)]
    found = carom.horizon(staged("crush", disc_at(1.0, 0.0, -1.0, 0.0625, r=0.25), *edges, duration_s=4.0))
    assert found.order_differs is None
    assert not found.complete
    assert found.certified > 250


def test_nothing_is_scored_beyond_the_horizon(pic: Trace) -> None:
    """Another path after the horizon does not touch the score; before it, it does. A run's own contradictions do."""
    horizon_s = float(pic.impacts["time_s"][29])
    gone = replayed(pic, pic.impacts[:45].copy())
    for observed in (pic, gone):
        score = compare(pic, observed, horizon=horizon_s)
        assert score.grade is Grade.EXACT
        assert (score.expected, len(score.errors), score.missed, score.spurious) == (30, 30, (), ())
        assert score.beyond_horizon == len(pic.impacts) - 30
        assert math.isnan(score.total.final_position)
    for broken in (altered(pic, 40, velocity_first_after=(99.0, 99.0)), dropped(pic, 45)):
        assert compare(pic, broken, horizon=horizon_s).grade is Grade.INACCURATE
    assert compare(pic, dropped(pic, 10), horizon=horizon_s).missed == (10,)
    assert compare(pic, dropped(pic, 45)).missed == (45,)
    assert compare(pic, gone).missed[0] == 45


def dropped(trace: Trace, at: int) -> Trace:
    """The trace with an impact that it does not report."""
    return dataclasses.replace(trace, impacts=np.delete(trace.impacts, at))


def test_a_horizon_at_the_end_changes_nothing(pic: Trace) -> None:
    """A horizon that covers the scene is no horizon."""
    whole, plain = compare(pic, pic, horizon=SCENE.duration_s), compare(pic, pic)
    assert repr((whole.errors, whole.findings)) == repr((plain.errors, plain.findings))  # NaN equals nothing
    assert whole.grade is plain.grade
    assert whole.horizon_s is None


def test_a_run_that_has_an_impact_less_or_more_is_not_covered() -> None:
    """A trace that lacks the last impact of a certified run, or has one more, differs from it there."""
    scene = line(0.0, 3.0, 6.0, velocities=(1.0, 0.0, 0.0))
    certified, whole = certify(scene), solve_pic(scene)
    assert len(certified) == len(whole.impacts) == 2
    shorter = dataclasses.replace(whole, impacts=whole.impacts[:1])
    longer = dataclasses.replace(whole, impacts=np.concatenate([whole.impacts, whole.impacts[1:]]))
    for trace, agreed in ((shorter, 1), (longer, 2)):
        found = compute_horizon(certified, trace)
        assert (found.agreed, found.order_differs) == (agreed, agreed)
        assert not found.covers_the_scene
    assert compute_horizon(certified, shorter).end_s == whole.impacts["time_s"][0]
    assert compute_horizon(certified, whole).covers_the_scene


@each("k", range(1, 5))
def test_an_impact_at_the_very_end_ends_no_horizon(k: int) -> None:
    """A row of discs whose last impact is at the scene's duration: a unit in the last place later, it is not there."""
    long = line(-1.0 - 0.1 * k, -4.3 - 0.7 * k, -9.1 - 1.7 * k, velocities=(-0.7, 0.0, 0.0), duration_s=100.0)
    scene = long.model_copy(update={"duration_s": float(solve_pic(long).impacts["time_s"][1])})
    assert len(solve_pic(scene).impacts) == 2
    assert estimate_horizon(solve_pic(scene)) is None


def test_bad_horizons_are_refused(certified: CertifiedTrace, pic: Trace) -> None:
    """0 is no tolerance, and two scenes are not compared."""
    with pytest.raises(InputError, match="tolerance must be above 0, got 0"):
        compute_horizon(certified, pic, tolerance=0)
    with pytest.raises(InputError, match="but the trace is not"):
        compute_horizon(certified, solve_pic(SCENE.model_copy(update={"name": "other"}), max_impacts=0))


def test_what_lies_beyond_the_horizon_is_not_held_against_anybody() -> None:
    """An impact dropped within the horizon is missed; impacts dropped beyond it, from 40 on, have no effect."""
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


@each("horizon", [-1, -0.5, float("nan"), True])
def test_a_horizon_that_is_none_is_refused(horizon: float) -> None:
    """A negative horizon, NaN, or a truth value is refused by name."""
    reference = solve_pic(catalogue()["paper/late"].scene)
    with pytest.raises(InputError, match=rf"horizon must be a number of impacts .* got {horizon}"):
        compare(reference, reference, horizon=horizon)


def test_short_scenes_are_believed_whole() -> None:
    """No horizon is estimated for scenes whose known answers PIC reproduces to rounding."""
    for entry in catalogue().values():
        if entry.known.impacts and entry.known.count == len(entry.known.impacts) and not entry.known.convention:
            assert estimate_horizon(solve_pic(entry.scene)) is None, entry.name


def test_the_estimate_ends_before_the_run_does_in_a_chaotic_gas() -> None:
    """Tens to hundreds of impacts of sixteen discs in twenty seconds are reliable, as in certified runs.

    Measured errors exceed 1e-12 from impact 29 to 101 on, and 1e-6 from impact 95 to 327 on, at packing .1 to .4.
    """
    gas = catalogue()["classics/gas"].scene.model_copy(update={"duration_s": 20.0})
    reference = solve_pic(gas)
    horizon = sure(estimate_horizon(reference))
    believed = int(np.searchsorted(reference.impacts["time_s"], horizon, side="right"))
    assert 29 < believed < 327


def test_impacts_at_one_instant_far_apart_may_change_places() -> None:
    """Many discs that strike the walls at the very start do so in any order: that ends no horizon."""
    reference = solve_pic(build_gas_scene(16, 0.3, duration_s=1.0, touching=True))
    assert (reference.impacts["time_s"] == 0.0).sum() > 1
    assert estimate_horizon(reference) is None
