"""The horizon (given, certified or estimated): all impacts before the horizon are compared globally, and none after."""

import dataclasses
import math

import numpy as np
import pytest
from tests.cases import each
from tests.planted.faults import drop_impact, replay_impacts
from tests.scene_builders import alter_impact, build_line_scene, disc_at, require_value, staged, wall_at

import carom
from carom import CertifiedTrace, Chain, Trace, certify, compare, solve_pic
from carom.catalogue import catalogue
from carom.comparator import Grade, compute_horizon
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


def test_pic_agrees_with_60_certified_impacts_to_1e_6(certified: CertifiedTrace, pic: Trace) -> None:
    """All 60 impacts of PIC in a dilute gas agree with certified ones to 1e-6, but not all to 2e-15."""
    assert compute_horizon(certified, pic, tolerance=1e-6).agreed == IMPACTS
    assert compute_horizon(certified, pic, tolerance=2e-15).agreed < IMPACTS


@each("k", [0, 17, IMPACTS - 1])
def test_first_deviating_impact_ends_the_horizon(certified: CertifiedTrace, pic: Trace, k: int) -> None:
    """The horizon ends before the first impact whose time or velocity is off by more than the tolerance, or NaN."""
    for values in ({"time_s": pic.impacts["time_s"][k] + 1e-3}, {"velocity_first_after": (math.nan, 0.0)}):
        found = compute_horizon(certified, alter_impact(pic, k, **values), tolerance=1e-6)
        assert (found.agreed, found.order_differs) == (k, None)
        assert found.end_s == (certified.trace.impacts["time_s"][k - 1] if k else 0.0)
        assert not found.covers_the_scene


@each("side", ["first_after", "second_after"])
def test_wrong_spin_ends_the_horizon(side: str) -> None:
    """The horizon ends before an impact after which a spin is off by more than the tolerance, relative to the speed."""
    scene = carom.scene("spin/throw-stick")
    certified, pic = certify(scene), solve_pic(scene)
    assert compute_horizon(certified, pic, tolerance=1e-6).agreed == 1
    spins = require_value(pic.spins).copy()
    spins[side][0] += 1e-3
    found = compute_horizon(certified, dataclasses.replace(pic, spins=spins), tolerance=1e-6)
    assert (found.agreed, found.order_differs) == (0, None)


def test_horizon_ends_where_the_order_of_impacts_differs(certified: CertifiedTrace, pic: Trace) -> None:
    """An impact of other bodies than the certified one ends the horizon and is named."""
    other = 14 if pic.impacts["first"][25] != 14 else 13
    found = compute_horizon(certified, alter_impact(pic, 25, first=other), tolerance=1e-6)
    assert (found.agreed, found.order_differs) == (25, 25)
    assert "differs from impact 26 on" in str(found)


def test_fully_certified_scene_is_covered_to_its_end() -> None:
    """If all impacts are certified and agree, the horizon is the end of the scene."""
    found = carom.horizon(staged("two", disc_at(0.0, 0.0, 1.0), disc_at(3.0, 0.3), duration_s=5.0))
    assert found.covers_the_scene
    assert (found.agreed, found.certified, found.end_s) == (1, 1, 5.0)
    # If all discs rest at the start, errors are relative to the speed that a driven wall gives.
    discs = disc_at(1.0, 0.0, r=0.1), disc_at(2.0, 0.05, r=0.1)
    press = wall_at(0.0, 0.0, 1.0, 0.0, velocity_m_s=(0.3, 0.0))
    assert carom.horizon(staged("swept", *discs, press, duration_s=10.0)).covers_the_scene


@pytest.mark.long
def test_horizon_ends_where_a_disc_is_crushed() -> None:
    """A horizon between closing edges ends at the crush, after over 250 certified impacts."""
    # A certified run alone would follow the disc without end.
    edges = [Chain(points_m=[(x, -1.0), (x, 1.0)], velocity_m_s=(-x / 4.0, 0.0)) for x in (0.0, 2.0)]
    found = carom.horizon(staged("crush", disc_at(1.0, 0.0, -1.0, 0.0625, r=0.25), *edges, duration_s=4.0))
    assert found.order_differs is None
    assert not found.complete
    assert found.certified > 250


def test_nothing_is_scored_beyond_the_horizon(pic: Trace) -> None:
    """Beyond the horizon only contradictions of a run with itself count; a missed impact before it counts."""
    horizon_s = float(pic.impacts["time_s"][29])
    gone = replay_impacts(pic, pic.impacts[:45].copy())
    for observed in (pic, gone):
        score = compare(pic, observed, horizon=horizon_s)
        assert score.grade is Grade.EXACT
        assert (score.expected, len(score.errors), score.missed, score.spurious) == (30, 30, (), ())
        assert score.beyond_horizon == len(pic.impacts) - 30
        assert math.isnan(score.total.final_position)
    for broken in (alter_impact(pic, 40, velocity_first_after=(99.0, 99.0)), drop_impact(pic, 45)):
        assert compare(pic, broken, horizon=horizon_s).grade is Grade.INACCURATE
    assert compare(pic, drop_impact(pic, 10), horizon=horizon_s).missed == (10,)
    assert compare(pic, drop_impact(pic, 45)).missed == (45,)
    assert compare(pic, gone).missed[0] == 45


def test_run_with_a_missing_or_extra_impact_is_not_covered() -> None:
    """A trace without the last certified impact, or with one more, differs from the certified run there."""
    scene = build_line_scene(0.0, 3.0, 6.0, velocities=(1.0, 0.0, 0.0))
    certified, whole = certify(scene), solve_pic(scene)
    assert len(certified) == len(whole.impacts) == 2
    shorter = drop_impact(whole, 1)
    longer = dataclasses.replace(whole, impacts=np.concatenate([whole.impacts, whole.impacts[1:]]))
    for trace, agreed in ((shorter, 1), (longer, 2)):
        found = compute_horizon(certified, trace)
        assert (found.agreed, found.order_differs) == (agreed, agreed)
        assert not found.covers_the_scene
    assert compute_horizon(certified, shorter).end_s == whole.impacts["time_s"][0]
    assert compute_horizon(certified, whole).covers_the_scene


@each("k", range(1, 5))
def test_impact_at_the_end_of_the_scene_ends_no_horizon(k: int) -> None:
    """A row of discs whose last impact is at exactly the scene's duration has no estimated horizon."""
    # One ulp later the impact would be outside of the scene.
    places = -1.0 - 0.1 * k, -4.3 - 0.7 * k, -9.1 - 1.7 * k
    long = build_line_scene(*places, velocities=(-0.7, 0.0, 0.0), duration_s=100.0)
    scene = long.model_copy(update={"duration_s": float(solve_pic(long).impacts["time_s"][1])})
    assert len(solve_pic(scene).impacts) == 2
    assert estimate_horizon(solve_pic(scene)) is None


def test_invalid_tolerance_scene_or_horizon_is_refused(certified: CertifiedTrace, pic: Trace) -> None:
    """A tolerance of 0, a trace of another scene, or a horizon that is not 0 or more raises an InputError."""
    with pytest.raises(InputError, match="tolerance must be above 0, got 0"):
        compute_horizon(certified, pic, tolerance=0)
    with pytest.raises(InputError, match="but the trace is not"):
        compute_horizon(certified, solve_pic(SCENE.model_copy(update={"name": "other"}), max_impacts=0))
    for horizon in (-1, -0.5, math.nan, True):
        with pytest.raises(InputError, match=rf"horizon must be a number of impacts .* got {horizon}"):
            compare(pic, pic, horizon=horizon)


def test_horizon_by_count_equals_horizon_by_time() -> None:
    """A horizon of 20 impacts equals one at the time of the 20th; more impacts than there are is no horizon."""
    reference = solve_pic(catalogue()["classics/gas"].scene)
    by_time = compare(reference, reference, horizon=float(reference.impacts["time_s"][19]))
    assert by_time.expected == compare(reference, reference, horizon=20).expected == 20
    everything = compare(reference, reference, horizon=10**6)
    assert everything.horizon_s is None
    assert everything.beyond_horizon == 0


def test_scenes_with_known_answers_have_no_estimated_horizon() -> None:
    """No horizon is estimated for scenes whose known answers PIC reproduces to rounding."""
    for entry in catalogue().values():
        if entry.known.impacts and entry.known.count == len(entry.known.impacts) and not entry.known.convention:
            assert estimate_horizon(solve_pic(entry.scene)) is None, entry.name


def test_estimated_horizon_of_a_gas_is_between_29_and_327_impacts() -> None:
    """The estimated horizon of a gas of sixteen discs is between 29 and 327 impacts, as in certified runs."""
    # Measured errors exceed 1e-12 from impact 29 to 101 on, and 1e-6 from impact 95 to 327 on, at packing .1 to .4.
    gas = catalogue()["classics/gas"].scene.model_copy(update={"duration_s": 20.0})
    reference = solve_pic(gas)
    horizon = require_value(estimate_horizon(reference))
    believed = int(np.searchsorted(reference.impacts["time_s"], horizon, side="right"))
    assert 29 < believed < 327


def test_order_of_simultaneous_wall_impacts_ends_no_horizon() -> None:
    """Discs that strike the walls at 0 s in any order do not end the estimated horizon."""
    gas = build_gas_scene(16, 0.3, duration_s=1.0)
    touching = [disc.model_copy(update={"radius_m": 0.5}) for disc in gas.discs]
    reference = solve_pic(gas.model_copy(update={"discs": touching}))
    assert (reference.impacts["time_s"] == 0.0).sum() > 1
    assert estimate_horizon(reference) is None


def test_no_part_of_a_graze_within_rounding_is_reliable() -> None:
    """If the only impact is a graze that a change of one unit in the last place removes, the horizon is 0."""
    offset = math.nextafter(-1.1, 0.0)  # from -0.1: by rounding less than the contact distance of 1
    reference = solve_pic(staged("graze", disc_at(-3.0, -0.1, 1.0), disc_at(0.0, offset), duration_s=10.0))
    assert len(reference.impacts) == 1
    assert estimate_horizon(reference) == 0.0
