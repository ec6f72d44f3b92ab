"""Scores of discs that spin and rub: planted faults of which size and name follow by hand from the scenes' answers."""

import dataclasses
import math

import numpy as np
import pytest
from tests.cases import each
from tests.planted.faults import find_reason
from tests.scene_builders import alter_impact, disc_at, require_value, staged, wall_at

from carom import Scene, Trace, compare, solve_pic, solve_pit
from carom.catalogue import all_scenes
from carom.comparator import Grade, Score, Verdict
from carom.comparator.measure.simultaneous_impacts import find_admissible_outcomes, find_first_group

DT = 1 / 60


def find_scene(name: str) -> Scene:
    return all_scenes()[f"spin/{name}"].scene


def build_one_impact_run(name: str, velocity: tuple[float, float], spin: float, dt_s: float = DT) -> Trace:
    """The run of a disc that hits the floor once and leaves it like this, seen by a method with steps."""
    truth = solve_pic(find_scene(name))
    impacts, spins = truth.impacts.copy(), require_value(truth.spins).copy()
    impacts["velocity_first_after"], spins["first_after"] = velocity, spin
    left = truth.end_time_s - float(truth.impacts["time_s"][0])
    return dataclasses.replace(
        truth,
        method="planted",
        impacts=impacts,
        spins=spins,
        final_velocity_m_s=np.array([velocity]),
        final_spin_rad_s=np.array([spin]),
        final_position_m=np.array([[velocity[0] * left, 1.0 + velocity[1] * left]]),
        dt_s=dt_s,
    )


def score_run(name: str, observed: Trace) -> Score:
    scene = find_scene(name)
    pit = solve_pit(scene, frame_rate_hz=1.0 / observed.dt_s if observed.dt_s else None)
    return compare(solve_pic(scene), observed, sampling=pit)


@each("spin, error, arm", [(-2.002, 0.002, "1.001"), (2.0, 4.0, "-1"), (0.0, 2.0, "0")])
def test_wrong_spin_is_measured_and_inaccurate(spin: float, error: float, arm: str) -> None:
    """A run of 'grip' with only a wrong spin is INACCURATE, with a spin error of exactly that size."""
    # The disc comes at 5 m/s and leaves at (2, 2) with -2 rad/s. ANGULAR reports the arm at which friction seems to
    # act.
    result = score_run("grip", build_one_impact_run("grip", (2.0, 2.0), spin))
    assert result.grade is Grade.INACCURATE
    assert result.total.velocity <= 1e-15
    assert result.total.spin == pytest.approx(error / 5.0, rel=1e-12)
    assert result.total.final_spin == pytest.approx(error / 5.0, rel=1e-12)
    assert result.total.energy == pytest.approx(0.25 * (spin**2 - 4.0) / 12.5, abs=1e-14)
    assert {Verdict.WRONG_SPIN, Verdict.WRONG_LAST_SPIN, Verdict.ANGULAR} <= set(result.verdicts)
    assert not set(result.verdicts) & {Verdict.WRONG_VELOCITY, Verdict.SLID, Verdict.STUCK}
    assert f"as if friction acted at {arm} times its radius" in find_reason(result, Verdict.ANGULAR)
    assert result.price_paid == math.inf  # on a wall sampling costs PIT nothing
    assert f", spin {error / 5:.3g}" in str(result)


def test_friction_arm_close_to_the_radius_is_shown_as_difference() -> None:
    """A friction arm that is off by a millionth of the radius is reported as that distance from the rim."""
    # Friction turns the disc of 'grip' by -2 rad/s.
    for spin, side in ((-2.000002, "outside"), (-1.999998, "inside")):
        result = score_run("grip", build_one_impact_run("grip", (2.0, 2.0), spin))
        assert f"as if friction acted at 1e-6 of its radius {side} its rim" in find_reason(result, Verdict.ANGULAR)


@each("part", [0.9, 0.95, 1.05])
def test_spin_error_that_sampling_does_not_explain_is_inaccurate(part: float) -> None:
    """A run with a wrong tangential restitution is INACCURATE, although its velocity error is below PIT's."""
    scene = find_scene("superball-table")
    truth = solve_pic(scene)
    other = scene.model_copy(update={"wall_tangential_restitution": part * scene.wall_tangential_restitution})
    observed = dataclasses.replace(solve_pic(other), scene=scene, method="planted", dt_s=DT)
    impacts = truth.impacts.copy()
    impacts["velocity_first_after"] += 0.5
    pit = dataclasses.replace(truth, impacts=impacts, final_velocity_m_s=truth.final_velocity_m_s + 0.5)
    result = compare(truth, observed, sampling=pit)
    assert result.total.velocity < require_value(result.sampling).velocity
    assert result.total.spin > require_value(result.sampling).spin == 0.0
    assert result.grade is Grade.INACCURATE


#: With friction of 2 and a push of 6 a disc of 'grip' can lose 12 m/s, and 1 is enough to hold it. With 0.1 and a push
#: of 3 one of 'slide' loses 0.3 m/s, and 1 would be needed. As wrong as both are, they keep the angular momentum.
@each(
    "name, velocity, spin, verdict",
    [("grip", (3.0 - 12.0, 2.0), -24.0, Verdict.SLID), ("slide", (2.0, 1.0), -2.0, Verdict.STUCK)],
)
def test_wrong_branch_of_friction_is_reported(
    name: str, velocity: tuple[float, float], spin: float, verdict: Verdict
) -> None:
    """A disc that slides where friction would hold it, or sticks where it is too weak, is INACCURATE by name."""
    result = score_run(name, build_one_impact_run(name, velocity, spin))
    assert set(result.verdicts) & {Verdict.SLID, Verdict.STUCK, Verdict.ANGULAR} == {verdict}
    assert result.grade is Grade.INACCURATE


@each("name", ["edge", "throw-stick"])
def test_pic_and_pit_take_the_right_branch_of_friction(name: str) -> None:
    """PIC and PIT have no verdict on friction or spin, also exactly between sticking and sliding."""
    for trace in (solve_pic(find_scene(name)), solve_pit(find_scene(name))):
        result = score_run(name, trace)
        assert not set(result.verdicts) & {Verdict.SLID, Verdict.STUCK, Verdict.ANGULAR, Verdict.SPINS}


def test_friction_arm_shortened_by_the_overlap_is_explained() -> None:
    """Friction at 0.98 of the radius is reported; the overlap of a step of 1/60 s explains it, of 1/600 s not."""
    # The disc comes at 13**0.5 m/s: a step of 1/60 s explains an arm shorter by 0.06, one of 1/600 s by 0.006. The run
    # is INACCURATE because PIT, with full arms, has no such error on a wall.
    run = build_one_impact_run("slide", (2.7, 1.0), -0.6 * 0.98)
    result = score_run("slide", run)
    assert "as if friction acted at 0.98 times its radius" in find_reason(result, Verdict.ANGULAR)
    assert "more than the overlap gained" not in find_reason(result, Verdict.ANGULAR)
    assert require_value(result.consistency).arm == pytest.approx(0.98, rel=1e-12)
    assert require_value(result.consistency).angular_excess == 0.0
    assert result.grade is Grade.INACCURATE  # PIT, with full arms, has no such error on a wall
    shorter = build_one_impact_run("slide", (2.7, 1.0), -0.6 * 0.98, dt_s=1 / 600)
    assert "more than the overlap gained" in find_reason(score_run("slide", shorter), Verdict.ANGULAR)


def test_spin_that_changes_in_flight_is_reported() -> None:
    """A final spin that differs from that after the last impact gives SPINS, WRONG_LAST_SPIN and ENERGY_LOST."""
    run = build_one_impact_run("slide", (2.7, 1.0), -0.6)
    result = score_run("slide", dataclasses.replace(run, final_spin_rad_s=np.array([-0.5])))
    assert set(result.verdicts) == {Verdict.SPINS, Verdict.WRONG_LAST_SPIN, Verdict.ENERGY_LOST}
    assert require_value(result.consistency).spin.size == pytest.approx(0.1 / math.hypot(3, 2), rel=1e-12)
    assert result.grade is Grade.INACCURATE


def test_nan_spin_is_wrong() -> None:
    """NaN in a spin gives the verdict NOT_FINITE with its field, and the grade WRONG."""
    run = build_one_impact_run("slide", (2.7, 1.0), math.nan)
    result = score_run("slide", run)
    assert result.grade is Grade.WRONG
    assert "spin first_after of impact 0" in find_reason(result, Verdict.NOT_FINITE)
    assert result.total.spin == math.inf


def test_method_without_friction_is_inaccurate() -> None:
    """A frictionless bounce off a rough floor is INACCURATE, off by the effect of friction; the right one is EXACT."""
    result = score_run("slide", build_one_impact_run("slide", (3.0, 1.0), 0.0))
    assert result.grade is Grade.INACCURATE
    assert result.total.velocity == pytest.approx(0.3 / math.hypot(3, 2), rel=1e-12)
    assert result.total.spin == pytest.approx(0.6 / math.hypot(3, 2), rel=1e-12)
    result = score_run("slide", build_one_impact_run("slide", (2.7, 1.0), -0.6))
    assert (result.grade, result.verdicts) == (Grade.EXACT, (Verdict.CONFORMS,))


def test_velocity_error_is_relative_to_the_disc_not_its_rim() -> None:
    """The velocity error of a disc that spins at 1e6 rad/s is relative to the speed of discs, not of rims."""
    disc = disc_at(0.0, 2.0, 3.0, -2.0, r=1.0, spin_rad_s=1e6)
    truth = solve_pic(staged("top", disc, wall_at(0.0, 0.0, 0.0, 1.0), wall_friction=0.1, duration_s=1.0))
    velocity = truth.impacts["velocity_first_after"][0] + (1e-9, 0.0)
    result = compare(truth, alter_impact(truth, 0, velocity_first_after=velocity))
    assert result.total.velocity == pytest.approx(1e-9 / math.hypot(3, 2), rel=1e-6)
    assert result.scales.energy_j == pytest.approx(0.25 * 1e12)  # with that of the spin
    assert result.grade is not Grade.EXACT


def test_rough_corner_has_two_admissible_outcomes() -> None:
    """A rough right-angled corner has two admissible outcomes; PIC matches one, and reversed spins match neither."""
    trace = solve_pic(find_scene("corner"))
    group = require_value(find_first_group(trace))
    outcomes = find_admissible_outcomes(trace.scene, group, math.sqrt(13))
    motions = sorted(outcome.motion_m_s[0].tolist() for outcome in outcomes)
    np.testing.assert_allclose(motions, [(2.0, 2.0, 2.0), (22 / 9, 4 / 3, -22 / 9)], rtol=1e-15)
    result = compare(trace, trace)
    assert require_value(result.convention).matches
    turned = require_value(trace.spins).copy()
    turned["first_after"] *= -1.0
    wrong = require_value(compare(trace, dataclasses.replace(trace, spins=turned)).convention)
    assert not wrong.matches
