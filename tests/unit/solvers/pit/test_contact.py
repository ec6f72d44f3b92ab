"""Contacts after restitution 0 in PIT: no impact is a rounding error, and every push is found."""

import cmath
import math
import random
from typing import Any

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, drive_on_legs, staged, wall_at
from tests.unit.solvers.pit.run_forms import assert_identical

from carom import Chain, Disc, Ring, Scene, solve_pit
from carom.model.walls import AnyWall
from carom.solvers.pit.clock import FrameClock

RATE_HZ = 240.0
KINDS = ("disc", "circle", "point", "half-plane", "edge", "arc")
Legs = list[tuple[float, complex]]


def build_driven(kind: str, at: complex, normal: complex, radius: float, legs: Legs) -> Disc | AnyWall:
    """Return a driven body whose surface has its outward normal at `at + radius * normal`."""
    drive = drive_on_legs(*((from_s, (velocity.real, velocity.imag)) for from_s, velocity in legs))
    top = at + radius * normal
    if kind == "disc":
        return disc_at(at.real, at.imag, r=radius, m=math.inf, driven=True, **drive)
    if kind in {"circle", "point"}:
        return Ring(centre_m=(at.real, at.imag), radius_m=radius if kind == "circle" else 0.0, **drive)
    if kind == "half-plane":
        return wall_at(top.real, top.imag, normal.real, normal.imag, **drive)
    ends = [top - 40j * normal, top + 40j * normal] if kind == "edge" else [at + radius * 1j, at - radius * 1j]
    bulge = {} if kind == "edge" else {"bulges": [1.0 if normal.real < 0.0 else -1.0]}
    return Chain(points_m=[(end.real, end.imag) for end in ends], **bulge, **drive)


def build_contact(
    kind: str, rng: random.Random, far_m: float, fast_m_s: float, slips: Legs, *more: Disc, **fields: Any
) -> tuple[Scene, complex, complex]:
    """Return a disc of radius 0.5 that hits a driven body at 0.5 s, the normal, and where the disc then is.

    The velocities of the later legs are relative to the body's first velocity, and times the normal: imaginary parts
    are along the tangent.
    """
    normal = cmath.exp(1j * rng.uniform(-4.0, 4.0))
    radius = 0.0 if kind == "point" else rng.uniform(0.5, 2.0)
    at = complex(rng.uniform(-far_m, far_m), rng.uniform(-far_m, far_m))
    before = complex(rng.uniform(-fast_m_s, fast_m_s), rng.uniform(-fast_m_s, fast_m_s))
    place, velocity = at + (radius + 1.499) * normal, before - 2.0 * normal
    legs = [(0.0, before), *((from_s, before + slip * normal) for from_s, slip in slips)]
    first = disc_at(place.real, place.imag, velocity.real, velocity.imag, r=0.5)
    driven = build_driven(kind, at, normal, radius, legs)
    fields = {"restitution": 0.0, "wall_restitution": 0.0, "duration_s": 3.0} | fields
    return staged("contact", first, driven, *more, **fields), normal, place


def list_struck_bodies(scene: Scene) -> list[int]:
    """Return the second bodies of all impacts, which are the same in every form of a run."""
    found: list[int] = assert_identical(scene, FrameClock(rate_hz=RATE_HZ)).log.array()["second"].tolist()
    return found


def count_impacts(scene: Scene) -> int:
    return len(list_struck_bodies(scene))


def draw_slips(rng: random.Random) -> Legs:
    """Return legs along the tangent, in one direction or with the disc."""
    side = rng.choice([-1j, 1j])
    return [(from_s, side * rng.choice([0.0, rng.uniform(0.0, 1.0)])) for from_s in (0.75, 1.0, 1.5, 2.25)]


@each("kind", KINDS)
@each("far_m, fast_m_s", [(50.0, 1.0), (1000.0, 1.0), (50.0, 1000.0)])
def test_legs_along_the_contact_cause_no_impact(kind: str, far_m: float, fast_m_s: float) -> None:
    """A body that keeps its speed along the normal has one impact, far from the origin and at high speeds too."""
    for seed in range(10):
        rng = random.Random(seed)
        assert count_impacts(build_contact(kind, rng, far_m, fast_m_s, draw_slips(rng))[0]) == 1, seed


@each("kind", KINDS)
def test_leg_between_two_frames_causes_no_impact(kind: str) -> None:
    """PIT does not see a leg on which the body approaches for half a frame. Then the body slides."""
    for seed in range(10):
        rng = random.Random(seed)
        begin_s = (240 + 0.25) / RATE_HZ
        slips = [(begin_s, 1e-3 + 0j), (begin_s + 0.5 / RATE_HZ, 0.1j * rng.choice([-1.0, 1.0]))]
        assert count_impacts(build_contact(kind, rng, 50.0, 0.0, slips)[0]) == 1, seed


@each("kind", ["half-plane", "edge"])
def test_disc_that_falls_along_a_driven_wall_has_one_impact(kind: str) -> None:
    """Gravity pulls a disc along a wall that slides the same way or back."""
    for seed in range(10):
        rng = random.Random(seed)
        pull = 1j * cmath.exp(1j * random.Random(seed).uniform(-4.0, 4.0))
        slips = [(1.0, -0.1j), (1.5, 0j), (2.0, 0.3j)]
        scene, _, _ = build_contact(kind, rng, 50.0, 0.0, slips, gravity_m_s2=(pull.real, pull.imag))
        assert count_impacts(scene) == 1, seed


@each("kind", ["disc", "circle", "point"])
def test_disc_hit_along_the_tangent_does_not_hit_the_body_again(kind: str) -> None:
    """A second disc hits the touching disc along the tangent at 1.5 s: two impacts in all."""
    for seed in range(10):
        rng, same = random.Random(seed), random.Random(seed)
        _, normal, place = build_contact(kind, same, 50.0, 0.0, [])
        other = place - normal + 1j * normal * (0.5 + 0.25 + 1.5 * 1.3)
        velocity = -1.3j * normal
        more = disc_at(other.real, other.imag, velocity.real, velocity.imag, r=0.25)
        scene, _, _ = build_contact(kind, rng, 50.0, 0.0, [(0.75, 0j)], more, restitution=0.0, duration_s=2.0)
        assert count_impacts(scene) == 2, seed


@each("kind", KINDS)
@each("push_m_s", [1e-9, 1e-6, 1e-3])
@each("slip_m_s", [0.0, 0.1])
def test_push_is_an_impact_at_its_first_frame(kind: str, push_m_s: float, slip_m_s: float) -> None:
    """If a touching wall starts to approach a disc slowly, PIT reports an impact at the frame at which it starts."""
    for seed in range(10):
        rng = random.Random(seed)
        scene, _, _ = build_contact(kind, rng, 1.0, 0.0, [(1.0, push_m_s + 1j * slip_m_s)], duration_s=1.25)
        times = solve_pit(scene, frame_rate_hz=RATE_HZ).impacts["time_s"].tolist()
        assert times[:2] == pytest.approx([0.5, 1.0], abs=1.01 / RATE_HZ), seed
        assert times[1] == pytest.approx(1.0, abs=1e-12)


def test_pushes_in_many_small_steps_do_not_move_a_disc_into_another_one() -> None:
    """Far from the origin a pusher presses a disc against an immovable one, 1e-6 m/s faster each 1/120 s."""
    far_m, step_m_s, count = 1e6, 1e-6, 2000
    steps = [(42.0 + k / 120.0, (-step_m_s * (k + 1), 0.0)) for k in range(count)]
    legs = drive_on_legs((0.0, (0.0, 0.0)), (40.5, (0.0, -80.0)), (41.0, (-58.05, 0.0)), *steps)
    scene = staged(
        "ramp",
        disc_at(far_m, 0.0, m=math.inf),
        disc_at(far_m + 40.9, 0.0, -1.0, 0.0),
        disc_at(far_m + 60.0, 40.0, m=math.inf, driven=True, **legs),
        restitution=0.0,
        duration_s=42.0 + count / 120.0,
    )
    trace = solve_pit(scene, frame_rate_hz=RATE_HZ)
    first_s = next(float(row["time_s"]) for row in trace.impacts if row["second"] == 2)
    pushed = [row for row in trace.impacts if row["first"] == 0 and row["time_s"] >= first_s]
    assert len(pushed) > count / 2
    speed_m_s = step_m_s * count
    assert trace.final_position_m[1][0] - far_m > 1.0 - 1.0 / RATE_HZ - speed_m_s * count / 120.0


@each("tilt, far_m", [(1e-9, 0.0), (1e-7, 2.0**20), (1e-5, 2.0**30)])
def test_tilted_tap_presses_a_disc_on_a_floor(tilt: float, far_m: float) -> None:
    """A disc that is slightly higher pushes a disc on a floor along the floor, and a little into it."""
    first, second = disc_at(far_m, 0.75, 0.0, -1.0), disc_at(far_m + 3.0, 0.5 + tilt, -1.0, 0.0)
    scene = staged(
        "tap", first, second, wall_at(far_m, 0.0, 0.0, 1.0), restitution=0.0, wall_restitution=0.0, duration_s=4.0
    )
    assert solve_pit(scene, frame_rate_hz=256.0).impacts["second"].tolist()[:3] == [-1, 1, -1]


@each("far_m, slip_m_s, rise_m_s", [(2.0**10, 1.0, 1e-10), (2.0**10, 1e-6, 1e-15), (2.0**17, 1e-3, 1e-11)])
def test_approach_that_slip_hides_does_not_deepen_the_overlap(far_m: float, slip_m_s: float, rise_m_s: float) -> None:
    """A driven disc zigzags below a disc, and rises more slowly than the rounded normal resolves."""
    count = 4000
    legs = [(2.0 + k / 64.0, (slip_m_s * (-1.0) ** k, rise_m_s)) for k in range(count)]
    driven = disc_at(far_m, 0.0, m=math.inf, driven=True, **drive_on_legs((0.0, (0.0, 0.0)), *legs))
    scene = staged(
        "zigzag", driven, disc_at(far_m, 2.0, 0.0, -1.0), restitution=0.0, duration_s=2.0 + (count - 1) / 64.0
    )
    trace = solve_pit(scene, frame_rate_hz=256.0)
    (first_x, first_y), (second_x, second_y) = trace.final_position_m.tolist()
    frames = 256.0 * scene.duration_s
    resolution_m = frames * 2.0**-52 * 2.0 * far_m
    assert math.hypot(second_x - first_x, second_y - first_y) >= 1.0 - 1.0 / 256.0 - resolution_m


@each("push_m_s", [1e-12, 1e-9, 1e-6])
def test_push_from_another_side_is_found(push_m_s: float) -> None:
    """A driven disc stops a disc that came at 100 m/s, goes round it, and slowly pushes it from below."""
    legs = ((41.0, (0.0, -4.0)), (41.5, (2.0, 0.0)), (42.0, (0.0, 2.004)), (42.5, (0.0, push_m_s)))
    driven = disc_at(1000.0, 0.0, m=math.inf, driven=True, **drive_on_legs((0.0, (0.0, 0.0)), *legs))
    scene = staged("side", driven, disc_at(5001.0, 0.0, -100.0, 0.0), restitution=0.0, duration_s=45.0)
    assert solve_pit(scene, frame_rate_hz=RATE_HZ).impacts["time_s"].tolist() == [40.0, 42.5]


def test_weak_gravity_does_not_pull_a_fast_disc_through_the_floor() -> None:
    """A disc that bounces between two walls 10,000 times stays on the floor, although it rounds its speed each time."""
    walls = [wall_at(0, 0, 0, 1), wall_at(-1, 0, 1, 0, restitution=1.0), wall_at(1, 0, -1, 0, restitution=1.0)]
    disc = disc_at(0.0, 0.75, 30.0, -0.5, r=0.5)
    scene = staged("floor", disc, *walls, wall_restitution=0.0, gravity_m_s2=(0.0, -1e-8), duration_s=350.0)
    trace = solve_pit(scene, frame_rate_hz=256.0)
    assert len(trace.impacts) > 10_000
    assert trace.final_position_m[0][1] == pytest.approx(0.5, abs=1e-6)  # the floor is hit without overlap at 0.5 s


def test_slow_push_after_an_impact_with_fast_sliding_is_found() -> None:
    """A disc is hit while it slides at 100 m/s. A push of 2e-6 m/s, slower than rounding of the impact, is found later.

    The driven disc then moves with the other disc and pushes it for 500 s, which is 1 mm. The overlap grows by less
    than a hundredth of this.
    """
    hit_s, frame_s, slip = 64.0, 1.0 / 256.0, 100.0
    drive = drive_on_legs((0.0, (0.0, 0.0)), (hit_s + frame_s / 2, (0.0, 2 * slip)), (hit_s + frame_s, (2e-6, slip)))
    driven = disc_at(0.0, 0.0, r=0.5, m=math.inf, driven=True, **drive)
    other = disc_at(0.999 + hit_s, -slip * hit_s, -1.0, slip, r=0.5)
    trace = solve_pit(staged("push", driven, other, restitution=0.0, duration_s=hit_s + 500.0), frame_rate_hz=256.0)
    overlap_m = 1.0 - math.dist(*trace.final_position_m)
    assert len(trace.impacts) > 1
    assert overlap_m == pytest.approx(0.001, abs=1e-5)


def test_tap_along_a_wall_causes_no_rounding_impacts() -> None:
    """A disc that is stopped by a wall, and then pushed exactly along it by another disc, has two impacts."""
    scene = staged(
        "along",
        disc_at(84.318359375, 16.75, 3.0, 0.0),
        disc_at(95.005859375, 11.439453125, 0.0, 1.0, r=0.25),
        wall_at(95.5, 16.75, -1.0, 0.0),
        restitution=0.0,
        wall_restitution=0.0,
        duration_s=100.0,
    )
    assert solve_pit(scene, frame_rate_hz=RATE_HZ).impacts["second"].tolist() == [-1, 1]


def test_disc_that_slides_over_points_of_a_straight_chain_has_one_impact() -> None:
    """Edges on one line are one surface, so that sliding from one edge to the next causes no impact by rounding."""
    ramp = Chain(points_m=[(4.0 * k, 3.0 * k) for k in range(-2, 3)])
    scene = staged("ramp", disc_at(0.0, 2.0, 1.0, -1.0), ramp, wall_restitution=0.0, duration_s=20.0)
    assert len(solve_pit(scene, frame_rate_hz=RATE_HZ).impacts) == 1


def test_stop_of_a_driven_body_after_a_long_flight_causes_no_rounding_impact() -> None:
    """The rounding errors of positions at an impact count as long as the contact lasts, also if all bodies are slow."""
    legs = drive_on_legs((0.0, (0.0, 0.0)), (9.0, (-0.8, 0.6)))
    scene = staged(
        "stop",
        disc_at(0.0, 0.0, m=math.inf, driven=True, **legs),
        disc_at(90.0, 120.0, -12.0, -16.0),
        restitution=0.0,
        duration_s=10.0,
    )
    assert len(solve_pit(scene, frame_rate_hz=RATE_HZ).impacts) == 1


def test_disc_slightly_past_a_point_of_a_straight_chain_hits_the_surface() -> None:
    """Near a joint, rounding makes the joint as near as the surface, but the normal is that of the surface."""
    chain = Chain(points_m=[(-8.0, 0.0), (0.0, 0.0), (8.0, 0.0)])
    disc = disc_at(1e-9 - 4.0, 1.498046875, 4.0, -1.0, r=0.5)
    scene = staged("joint", disc, chain, wall_restitution=0.0, duration_s=2.0)
    impacts = solve_pit(scene, frame_rate_hz=256.0).impacts
    assert impacts["normal"].tolist() == [[0.0, -1.0]]


def test_slow_push_after_an_impact_on_the_end_of_an_edge_is_found() -> None:
    """The rounding error of the normal at an edge's end does not count on the straight edge."""
    slide, push_m_s = 8.0, 1e-7
    legs = [(0.0, (0.0, 0.0))]
    legs += [(65.0 + k / 8, (slide if k % 2 else -slide, push_m_s)) for k in range(80)]
    chain = Chain(points_m=[(0.0, 0.0), (414.0, 0.0)], **drive_on_legs(*legs))
    disc = disc_at(-256.0, 64.060546875, 4.0, -1.0, r=0.0625)
    scene = staged("end", disc, chain, wall_restitution=0.0, duration_s=75.0)
    times_s = solve_pit(scene, frame_rate_hz=256.0).impacts["time_s"]
    assert 65.0 <= times_s[1] < 65.1


def test_tap_on_one_of_two_discs_in_contact_causes_no_rounding_impact() -> None:
    """Rounding errors that later impacts have left on either of two discs count in their contact."""
    discs = (disc_at(1.498779296875, 0.0, -1.0, 0.0, r=0.5), disc_at(2.498779296875, -2.997802734375, -1.0, 1.0, r=0.5))
    scene = staged("tap", *discs, wall_at(0.0, 0.0, 1.0, 0.0), restitution=0.0, wall_restitution=0.0, duration_s=4.0)
    impacts = solve_pit(scene, frame_rate_hz=RATE_HZ).impacts
    assert impacts[["first", "second"]].tolist() == [(0, -1), (0, 1), (1, -1)]


def test_bodies_whose_squares_underflow_meet_in_every_form() -> None:
    """Frames are not skipped if a lower bound of the time of impact underflows."""
    tiny = 1e-80
    discs = disc_at(0.0, 0.0, r=tiny / 2, m=math.inf), disc_at(2 * tiny, 0.0, -tiny, r=tiny / 2)
    assert count_impacts(staged("tiny", *discs, duration_s=6.0)) == 1


def test_sliding_into_a_perpendicular_wall_adds_one_impact() -> None:
    """A disc that slides along a driven wall into a perpendicular one has one impact with each wall."""
    # The second impact changes nothing along the normal of the first wall.
    floor, side = wall_at(0, 0, 0, 1, velocity_m_s=(0.0, 0.1)), wall_at(3, 0, -1, 0, velocity_m_s=(0.3, 0.0))
    for k in range(20):
        disc = disc_at(0.0, 1.0, 1.7 + 0.0137 * k, -1.3 - 0.0071 * k, r=0.3)
        scene = staged("corner", disc, floor, side, wall_restitution=0.0, duration_s=6.0)
        assert list_struck_bodies(scene) == [-1, -2]


def test_disc_meets_the_inside_of_an_arc_repeatedly() -> None:
    """A disc in a half-circle bowl with restitution 0 has over 20 impacts with it in 2 s."""
    bodies = disc_at(0.3, 0.0, 0.7, -1.0, r=0.25), Chain(points_m=[(-2.0, 0.0), (2.0, 0.0)], bulges=[1.0])
    assert len(list_struck_bodies(staged("bowl", *bodies, wall_restitution=0.0, duration_s=2.0))) > 20


def test_joined_discs_do_not_collide_again_on_a_floor() -> None:
    """Two discs that move together after an inelastic impact do not collide again when both land on a floor."""
    for k in range(20):
        first, second = disc_at(0.0, 1.0, 1.1 + 0.0137 * k, -0.3, m=1.3), disc_at(2.0, 1.0, 0.0, -0.3, m=1.7)
        bodies = first, second, wall_at(0.0, 0.2, 0.0, 1.0)
        scene = staged("side by side", *bodies, restitution=0.0, wall_restitution=0.0, duration_s=4.0)
        assert list_struck_bodies(scene) == [1, -1, -1]


@each("turned", [1, 1j, -1, -1j])
@each("at", [0j, 16.0 + 8.0j, -16.0 - 8.0j])
def test_disc_sent_back_by_a_wall_strikes_an_overlapped_disc_again(turned: complex, at: complex) -> None:
    """A disc that PIT lets overlap an immovable one strikes it again after a ceiling has sent it back."""
    # The first impact is at the first frame, at a quarter of a metre of overlap. All numbers are exact in floats.
    place, velocity, top, down = at + turned * (-1.25 - 0.0625j), turned * (32.0 + 4.0j), at + turned * 1j, turned * -1j
    first = disc_at(place.real, place.imag, velocity.real, velocity.imag, r=0.5)
    second = disc_at(at.real, at.imag, r=0.5, m=math.inf)
    ceiling = wall_at(top.real, top.imag, down.real, down.imag)
    scene = staged("back", first, second, ceiling, restitution=0.0, wall_restitution=1.0, duration_s=1.0)
    assert solve_pit(scene, frame_rate_hz=64.0).impacts["second"].tolist() == [1, -1, 1]


def test_discs_of_equal_velocity_on_a_table_collide_once() -> None:
    """Two discs that move together after an inelastic impact on a decelerating table do not collide again."""
    for k in range(20):
        first, second = disc_at(0.0, 0.0, 1.3 + 0.0113 * k, 0.0, r=0.5, m=1.7), disc_at(1.5, 0.0, r=0.5)
        scene = staged("together", first, second, restitution=0.0, table_deceleration_m_s2=0.2, duration_s=3.0)
        assert list_struck_bodies(scene) == [1]
