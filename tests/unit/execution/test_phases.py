"""Phases: one scene at many parts of a step, against the closed form of what PIT misses."""

import math

import numpy as np
import pytest
from tests.cases import each, long_until
from tests.scene_builders import disc_at, require_value, run_cross_check, staged, wall_at

from carom import Scene, solve_pic
from carom.catalogue import catalogue
from carom.comparator.shifted_scenes import shift_start, solve_shifted_references
from carom.errors import InputError
from carom.execution.phases import compute_pit_miss_probability, generate_phases
from carom.model.walls import Leg


def test_phases_are_even_and_reproducible() -> None:
    """100 phases leave no gap twice as wide as an even spread, and depend only on the seed."""
    phases = sorted(generate_phases(100, seed=3))
    assert np.diff([*phases, phases[0] + 1.0]).max() < 2.0 / 100
    assert generate_phases(100, seed=3) == generate_phases(100, seed=3) != generate_phases(100, seed=4)


def test_start_near_the_first_impact_is_moved_back() -> None:
    """If the first impact is too near to start later, the start is moved back by the rest of the step."""
    scene = staged("near", disc_at(0, 0, 1, 0), disc_at(1.25, 0), duration_s=2.0)
    (one,) = solve_shifted_references(solve_pic(scene), 0.5, [0.75])
    assert one.impacts["time_s"].tolist() == [0.25 + 0.125]


def test_scene_that_cannot_start_earlier_starts_later() -> None:
    """A scene without an earlier state starts later, before its first impact, or is refused."""
    parting = staged("parting", disc_at(0, 0, -1, 0), disc_at(1, 0, 1, 0), disc_at(5, 0, -1, 0), duration_s=3.0)
    shifted = shift_start(parting, 0.1)
    assert shifted.duration_s == pytest.approx(2.9)
    assert shifted.discs[0].position_m[0] == pytest.approx(-0.1)
    with pytest.raises(InputError, match="can't begin 2 s earlier or later"):
        shift_start(parting, 2.0)


def build_dropped_scene() -> Scene:
    """A disc thrown along a floor from half a metre above it, 4 m/s^2 downwards; an immovable one is apart."""
    bodies = disc_at(0.0, 1.0, 2.0, 0.0), disc_at(-8.0, 1.0, m=math.inf), wall_at(0.0, 0.0, 0.0, 1.0)
    return staged("dropped", *bodies, gravity_m_s2=(0.0, -4.0), duration_s=1.0)


def test_shifted_start_of_a_falling_disc_is_on_its_parabola() -> None:
    """A start earlier or later is on the parabola ``h = 1/2 - g t^2/2``, ``v = -g t``; a fixed disc stays."""
    (later,) = solve_shifted_references(solve_pic(build_dropped_scene()), 0.25, [0.75])
    for scene, ahead_s in ((later.scene, 0.1875), (shift_start(build_dropped_scene(), 0.125), -0.125)):
        thrown, fixed = scene.discs
        assert thrown.position_m == (2.0 * ahead_s, 1.0 - 2.0 * ahead_s**2)
        assert thrown.velocity_m_s == (2.0, -4.0 * ahead_s)
        assert fixed == build_dropped_scene().discs[1]
        assert scene.duration_s == 1.0 - ahead_s
        # The floor is reached after sqrt(2 h / g) = 1/2 s.
        assert solve_pic(scene).impacts["time_s"][0] == pytest.approx(0.5 - ahead_s, abs=1e-15)


def build_passing_scene(offset: float, advance: float) -> Scene:
    """Two discs of contact distance 1 at 10 frames per second, the relative advance a frame in contact distances."""
    discs = disc_at(-4.0 * advance, 0.0, 10 * advance, 0.0), disc_at(0.0, offset)
    return staged("passing", *discs, duration_s=1.0, frame_rate_hz=10.0)


@each("offset, advance, phases", long_until(1, [(0.8, 0.9, 24), (0.8, 0.9, 60), (0.0, 2.0, 60)]))
def test_pit_misses_the_predicted_share_of_phases(offset: float, advance: float, phases: int) -> None:
    """PIT misses at the closed form's share of phases, within (2 + log N)/N, the golden ratio's discrepancy."""
    scene = build_passing_scene(offset, advance)
    results = run_cross_check([scene], ["pit"], dts=[0.1], profiles=["tuned"], phases=phases)
    spread = require_value(results.rows[0].spread)
    assert spread.phases == phases
    expected = max(0.0, 1.0 - math.sqrt(1 - offset**2) / advance)
    assert spread.pit_miss_probability == pytest.approx(expected, abs=1e-12)
    assert abs(spread.miss_probability - expected) <= (2 + math.log(phases)) / phases


def test_miss_probability_requires_two_discs_that_meet() -> None:
    """The closed form is NaN for scenes without an impact to miss (also at rest) or with more than two bodies."""
    for name in ("classics/miss", "classics/touching-apart", "classics/sorting", "classics/galperin-100"):
        assert math.isnan(compute_pit_miss_probability(catalogue()[name].scene, 1 / 60)), name
    at_rest = staged("rest", disc_at(0.0, 0.0), disc_at(2.0, 0.0), duration_s=1.0)
    assert math.isnan(compute_pit_miss_probability(at_rest, 1 / 60))


def test_miss_probability_requires_straight_paths() -> None:
    """The closed form is NaN for bent relative paths and impacts after the end, not for a common fall."""
    small, post = disc_at(-1.0, 0.0, 10.0, 0.0, r=0.1), disc_at(0.0, 0.1, r=0.1)
    fixed = post.model_copy(update={"mass_kg": math.inf})
    down = (0.0, -9.81)
    both, one = (staged("fall", small, other, duration_s=1.0, gravity_m_s2=down) for other in (post, fixed))
    straight, later = (staged("straight", small, post, duration_s=duration_s) for duration_s in (1.0, 0.05))
    assert compute_pit_miss_probability(straight, 1 / 5) == compute_pit_miss_probability(both, 1 / 5) > 0.5
    legs = (Leg(from_s=0.0, velocity_m_s=(0.0, 0.0)), Leg(from_s=0.05, velocity_m_s=(1.0, 0.0)))
    turning = staged("legs", small, fixed.model_copy(update={"driven": True, "legs": legs}), duration_s=1.0)
    assert all(math.isnan(compute_pit_miss_probability(scene, 1 / 5)) for scene in (one, later, turning))
