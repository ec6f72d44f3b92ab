"""The compiled run gives what the plain loop gives, to the bit, and leaves out what can find nothing."""

import math
from functools import cache

import pytest
from tests.cases import each
from tests.scene_builders import build_line_scene, disc_at, staged, wall_at
from tests.unit.solvers.pit.run_forms import (
    assert_identical,
    collect_bits,
    list_compiled_forms,
    run_to_end,
)

from carom import Chain, solve_pit
from carom.solvers.pit.clock import FrameClock
from carom.studies.bench.gas import build_gas_scene


def test_parting_discs_that_rounding_brings_together_collide() -> None:
    """Discs in contact that part, but that rounding moves towards each other, collide after some frames."""
    # The coordinates straddle 2^30, beyond which floats are `unit` apart, and before it half as much. At .45 of a unit
    # per frame the second disc does not move; at .4, the first moves by half a unit. No y coordinate changes.
    unit, far = 2.0**-22, 2.0**30
    slide = 0.05 * unit * 0.6 / 0.8 * (1 - 2.0**-20)  # a little less than what would cancel the parting along x
    places = ((far - 0.3, 1.5 * far), (far + 0.3, 1.5 * far + 0.8))
    velocities = ((0.4 * unit, 0.4 * unit), (0.45 * unit, 0.4 * unit - slide))
    discs = [disc_at(*at, *velocity, r=0.5 + 2.0**-24) for at, velocity in zip(places, velocities, strict=True)]
    scene = staged("parting", *discs, duration_s=100.0)
    run = assert_identical(scene, FrameClock(rate_hz=1.0))
    assert 0.0 < run.log.array()["time_s"][0] < 50.0


@pytest.mark.long
def test_skipping_bounds_are_renewed_over_150000_frames() -> None:
    """Discs that meet after 150,000 frames are tested in 2 to 20 frames, with the bits of the plain loop."""
    # Bounds on skipping are renewed before rounding can exceed their margin.
    scene = build_line_scene(0.0, 1000.0, velocities=(0.4, -0.26), restitution=0.5, duration_s=1600.0)
    clock = FrameClock(rate_hz=100.0)
    assert len(assert_identical(scene, clock).log) == 1
    looked_at = run_to_end(scene, clock, list_compiled_forms()["default"]).counts["frames_looked_at"]
    assert 160_000 // 2**16 <= looked_at <= 20


def test_distant_discs_are_tested_in_at_most_5_of_6000_frames() -> None:
    """Two discs that meet once in 6000 frames are tested in at most 5 of them; the others are skipped."""
    scene = build_line_scene(0.0, 60.5, velocities=(1.0, 0.0), duration_s=100.0)
    counts = run_to_end(scene, FrameClock(rate_hz=60.0), list_compiled_forms()["default"]).counts
    assert counts["frames"] == 6000
    assert counts["frames_looked_at"] <= 5
    assert counts["frames_looked_at"] + counts["frames_skipped"] == 6000


def test_skipping_saves_99_percent_of_the_pair_tests() -> None:
    """For 1000 discs at packing 0.3 and 60 Hz, the default run makes at most 1% of the plain loop's pair tests."""
    scene = build_gas_scene(1000, 0.3, duration_s=0.5)
    clock = FrameClock(rate_hz=60.0)
    fast, plain = (run_to_end(scene, clock, list_compiled_forms()[name]) for name in ("default", "plain"))
    assert collect_bits(fast) == collect_bits(plain)
    assert len(plain.log) > 100
    assert fast.counts["pair_tests"] * 100 <= plain.counts["pair_tests"]


def test_plain_loop_makes_every_test_at_every_frame() -> None:
    """At each frame the plain loop tests all pairs of 20 discs, and each disc with each wall. Skipping tests fewer."""
    scene = build_gas_scene(20, 0.3, duration_s=1.0)
    clock = FrameClock(rate_hz=60.0)
    counts, fewer = (run_to_end(scene, clock, list_compiled_forms()[name]).counts for name in ("plain", "default"))
    assert counts["frames_looked_at"] == counts["frames"]
    assert counts["pair_tests"] == counts["frames"] * (20 * 19 // 2 + 20 * len(scene.walls))
    assert fewer["pair_tests"] < counts["pair_tests"]


def test_default_run_stops_skipping_where_it_does_not_pay() -> None:
    """Where all discs are due at every frame, the default run makes at most 10% more tests than the plain loop."""
    discs = [disc_at(k, 0.0, 50.0 * (-1) ** k) for k in range(12)]
    walls = [wall_at(-0.5, 0, 1, 0), wall_at(11.5, 0, -1, 0)]
    scene = staged("crush", *discs, *walls, duration_s=40.0)
    clock = FrameClock(rate_hz=20.0)
    run = run_to_end(scene, clock, list_compiled_forms()["default"])
    tests = 800 * (12 * 11 // 2 + 12 * 2)
    assert collect_bits(run) == collect_bits(run_to_end(scene, clock))
    assert run.counts["pair_tests"] <= 1.1 * tests
    assert run_to_end(scene, clock, list_compiled_forms()["always skipping"]).counts["pair_tests"] > 1.5 * tests


def test_signs_of_zeros_match_the_plain_loop() -> None:
    """All forms give the same signs of zeros for resting, immovable and moving discs, also at the start."""
    discs = [
        disc_at(-0.0, 0.0, -0.0),
        disc_at(-0.0, 3.0, 0.0, -1.0),
        disc_at(-0.0, -3.0, -0.0, -0.0, m=math.inf),
        disc_at(9.0, -0.0, -0.0, 1.0),
    ]
    scene = staged("zeros", *discs, duration_s=10.0)
    assert_identical(scene, FrameClock(rate_hz=3.0))
    start = [form(scene, FrameClock(rate_hz=3.0)) for form in list_compiled_forms().values()]
    assert {collect_bits(run) for run in start} == {
        collect_bits(run_to_end(scene.model_copy(update={"duration_s": 0.0}), FrameClock()))
    }


@cache
def find_meeting_time_s(*bulges: float) -> float:
    """When a disc meets a floor of one edge, in all forms."""
    disc = disc_at(0.3, 2.0, 0.1, -1.003, r=0.25)
    floor = Chain(points_m=[(-1, 0), (1, 0)], bulges=bulges)
    scene = staged("floor", disc, floor, duration_s=2.0)
    (time_s,) = assert_identical(scene, FrameClock(rate_hz=1000.0)).log.array()["time_s"].tolist()
    return float(time_s)


@each("bulge", [1e-3, -1e-6, 1e-15, 1e-9, -1e-12])
def test_nearly_flat_arc_is_met_like_a_segment(bulge: float) -> None:
    """A disc at 1 m/s meets an arc with a bulge of 1e-15 to 1e-3 like a segment, within the arc's height."""
    # The arc's middle is off the segment by the bulge, in metres, at a metre a second; and a frame more or less.
    assert abs(find_meeting_time_s(bulge) - find_meeting_time_s()) <= abs(bulge) + 1.5e-3 * (abs(bulge) > 1e-4)


def test_distant_pairs_at_coarse_coordinates_all_collide() -> None:
    """At 2^37 m, 24 pairs that start 24 m apart and close at 64 m/s all collide at 23/64 s."""
    # There rounding can move discs out of their cells at once.
    discs = [
        disc_at(2.0**37 + 96 * (k % 8) + 24 * side, 48 * (k // 8), 32 - 64 * side) for k in range(24) for side in (0, 1)
    ]
    trace = solve_pit(staged("far", *discs, duration_s=1.0), frame_rate_hz=64.0)
    assert trace.impacts["time_s"].tolist() == [23 / 64] * 24


@each("exponent", [26, 31, 35, 37])
def test_far_end_of_a_chain_does_not_change_the_edge_that_is_hit(exponent: int) -> None:
    """A disc that hits a corner of a chain hits the same edge in all forms, however long an edge is."""
    corner = Chain(points_m=[(-24.0, 7.0), (0.0, 0.0), (-7.0 * 2.0**exponent, -24.0 * 2.0**exponent)])
    scene = staged("corner", disc_at(0.56, 1.92, -0.28, -0.96), corner, duration_s=1.75)
    assert len(assert_identical(scene, FrameClock(rate_hz=64.0)).log) == 1


@each("gravity_m_s2", [1.0, 1.0 / (1.0 + 2.0**-34)])
def test_disc_that_starts_to_fall_onto_a_disc_hits_it_at_the_next_frame(gravity_m_s2: float) -> None:
    r"""A disc at rest on an immovable disc overlaps it at the next frame, 1/8 s later, under any gravity.

    At the second gravity, the largest relative acceleration with its margin is exactly 1 m/s^2.
    """
    discs = disc_at(0.0, 0.0, m=math.inf), disc_at(0.0, 1.0)
    scene = staged("onto", *discs, gravity_m_s2=(0.0, -gravity_m_s2), duration_s=1.0)
    assert assert_identical(scene, FrameClock(rate_hz=8.0)).log.array()["time_s"][0] == 0.125
