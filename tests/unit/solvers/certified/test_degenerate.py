"""Ties, grazes and contact, built exactly from Pythagorean triples: named as what they are, never guessed."""

import math
from decimal import Decimal
from functools import partial
from typing import Any

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom import Chain, Disc, Outcome, Scene, Wall, certify, solve_pic
from carom.model.trace import Mode
from carom.solvers.certified.result import Degeneracy, Degenerate, Ending

AXIS_BOX = wall_at(0.0, 0.0, 1.0, 0.0), wall_at(0.0, 0.0, 0.0, 1.0)
VALLEY = wall_at(0, 0, 0.6, 0.8), wall_at(0, 0, -0.6, 0.8)
disc = partial(disc_at, r=2.5)


def build_scene(*bodies: Disc | Wall, **more: Any) -> Scene:
    return staged("exact", *bodies, **{"duration_s": 100.0} | more)


def certify_to_degeneracy(scene: Scene, **more: Any) -> Degeneracy:
    certified = certify(scene, **more)
    found = require_value(certified.degeneracy)
    assert certified.ending is Ending.DEGENERATE
    ended = Outcome.STANDSTILL if found.kind is Degenerate.COLLAPSE else Outcome.STOPPED
    assert certified.trace.outcome is ended
    return found


def build_struck_row(right: float) -> Scene:
    """Two discs at rest, their outer neighbours reaching both of them at t = 5 exactly."""
    return build_scene(disc(-10, 0, 1), disc(0, 0), disc(right, 0), disc(right + 10, 0, -1))


#: Scenes of which an instant has no certain answer: its kind and bodies, when it is, and the impacts before it.
DEGENERATE: dict[str, tuple[Scene, str, tuple[int, ...], float, list[float]]] = {
    "meets two": (build_scene(disc(-3, 0), disc(3, 0), disc(0, 10, 0, -1)), "SHARED_INSTANT", (0, 1, 2), 6.0, []),
    "struck from both sides": (build_struck_row(5.0), "SIMULTANEOUS_NEIGHBOURS", (0, 1, 2, 3), 5.0, []),
    "oblique corner": (build_scene(disc(0, 20, 0, -1, r=4.0), *VALLEY), "SHARED_INSTANT", (-2, -1, 0), 15.0, []),
    "touching discs": (build_scene(disc(0, 0, 1), disc(3, 4)), "TOUCHING_START", (0, 1), 0.0, []),
    "at a wall": (build_scene(disc(2.5, 5, -1), *AXIS_BOX), "TOUCHING_START", (-1, 0), 0.0, []),
    "struck": (build_scene(disc(-10, 0, 1), disc(0, 0), disc(5, 0)), "RESTING_CONTACT", (0, 1, 2), 5.0, [5.0]),
}


@each("name", DEGENERATE)
def test_proven_degeneracy_stops_the_run_at_its_instant(name: str) -> None:
    """A proven degeneracy stops the run with its kind, bodies and instant to 1e-14 s, and keeps earlier impacts."""
    scene, kind, bodies, instant_s, earlier_s = DEGENERATE[name]
    found = certify_to_degeneracy(scene)
    assert (found.kind, found.bodies, found.proven) == (Degenerate[kind], bodies, True)
    assert found.earliest_s <= instant_s <= found.latest_s < found.earliest_s + 1e-14
    assert certify(scene).trace.impacts["time_s"].tolist() == earlier_s


#: Scenes of two impacts at one instant whose order makes no difference, and that instant.
COMMUTING = {
    "distant pairs": (build_scene(disc(0, 0, 1), disc(0, 100, 1), disc(7, 0), disc(7, 100)), 2.0),
    "at an immovable disc": (build_scene(disc(0, 0, m=math.inf), disc(-10, 0, 1), disc(10, 0, -1)), 5.0),
    "in a right-angled corner": (build_scene(disc(6, 6, -1, -1, r=2.0), *AXIS_BOX), 4.0),
}


@each("name", COMMUTING)
def test_ties_whose_order_is_irrelevant_are_certified(name: str) -> None:
    """Impacts of one instant that do not change each other are both certified, and reported to commute."""
    scene, time_s = COMMUTING[name]
    certified = certify(scene)
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [time_s] * 2
    assert certified.commuted == ((0, 1),)
    if scene.walls:  # both turn the disc back
        assert certified.trace.final_velocity_m_s.tolist() == [[1.0, 1.0]]


def test_neighbours_one_ulp_apart_commute_and_then_meet() -> None:
    """Two discs 1 ulp apart that are struck from both sides have commuting impacts, and then meet."""
    # They meet after half of the time that the gap takes at 1 m/s.
    right = 5.0 + math.ulp(15.0)
    certified = certify(build_struck_row(right), max_impacts=3, digits=30)
    assert certified.commuted == ((0, 1),)
    pairs = {(int(impact["first"]), int(impact["second"])) for impact in certified.trace.impacts[:2]}
    assert pairs == {(0, 1), (2, 3)}
    assert (certified.trace.impacts["first"][2], certified.trace.impacts["second"][2]) == (1, 2)
    assert Decimal(certified.decimals[2][0]) - 5 == pytest.approx(Decimal((right - 5.0) / 2), rel=Decimal("1e-12"))


@each("x, y, vx, vy", [(-20, 5, 1, 0), (-20.0, 0.0, 4.0, 3.0), (12.0, -16.0, 0.0, 1.0)])
def test_exact_graze_on_initial_paths_is_no_impact(x: float, y: float, vx: float, vy: float) -> None:
    """Discs that pass at exactly the contact distance have no impact, in any direction."""
    distance = abs(x * vy - y * vx) / math.hypot(vx, vy)
    certified = certify(build_scene(disc(x, y, vx, vy, r=distance / 2), disc(0, 0, r=distance / 2)))
    assert certified.ending is Ending.COMPLETED
    assert len(certified) == 0


def test_exact_graze_of_a_ceiling_is_decided_with_64_bits() -> None:
    """A disc that is thrown exactly as high as a ceiling has no impact, though 64 bits cannot hold v^2."""
    # It is thrown up by v^2 / 2 g with v = 1 + 2^-40 and g = v / 2: the square of v has 81 bits.
    v = 1 + 2.0**-40
    ceiling = wall_at(0.0, v + 2.5, 0.0, -1.0)
    found = build_scene(disc(0, 0, 0, v), ceiling, gravity_m_s2=(0.0, -v / 2), duration_s=4.0)
    certified = certify(found, digits=6, max_precision_bits=64)
    assert (certified.ending, len(certified)) == (Ending.COMPLETED, 0)


def test_undecidable_graze_is_reported_with_earlier_impacts() -> None:
    """An exact graze at 2/3 m/s stops the run with an unproven GRAZE from 35 s on, and keeps earlier impacts."""
    # Struck by a disc of half its mass, a disc moves at 2/3 m/s, no dyadic number. At least 1024 bits are tried.
    certified = certify(build_scene(disc(-10, 0, 1), disc(0, 0, m=2.0), disc(20, 5)), tie_bits=1024)
    assert certified.trace.impacts["time_s"].tolist() == [5.0]
    assert certified.ending is Ending.DEGENERATE
    found = require_value(certified.degeneracy)
    assert (found.kind, found.bodies, found.proven) == (Degenerate.GRAZE, (1, 2), False)
    assert found.bits >= 1024
    # 20 m at 2/3 m/s after 5 s; it may not touch at all, so there is no latest.
    assert found.earliest_s == pytest.approx(35.0, abs=1e-14)
    assert found.latest_s == math.inf


def test_start_that_overlaps_by_rounding_is_reported() -> None:
    """An overlap of 1 ulp at the start is OVERLAPPING_START; a touch in decimals may be reported as a touch, too."""
    left, right = disc(0.1, 0, 1, r=0.1), disc(0.3, 0, r=0.1)
    overlap = build_scene(left, right)
    assert certify_to_degeneracy(overlap).kind in (Degenerate.OVERLAPPING_START, Degenerate.TOUCHING_START)
    below = build_scene(disc(0, 0, 1), disc(math.nextafter(5.0, 0.0), 0))
    assert certify_to_degeneracy(below).kind is Degenerate.OVERLAPPING_START


def test_inelastic_collapse_is_reported() -> None:
    """Three equal discs with e below 7 - 4 sqrt(3) stop the run with COLLAPSE, within 2 ulp of its time."""
    # They collide infinitely often (McNamara and Young, 1992).
    scene = build_scene(disc(-12, 0, 1), disc(0, 0), disc(13, 0, -1), restitution=0.0625)
    found = certify_to_degeneracy(scene, time_budget_s=120.0)
    assert (found.kind, found.bodies) == (Degenerate.COLLAPSE, (0, 1, 2))
    assert found.latest_s - found.earliest_s <= 2 * math.ulp(found.latest_s)


def build_arrival_at_35_s(duration_s: float) -> Scene:
    """Struck after 5 s by a disc of half its mass, a disc covers 20 m at 2/3 m/s, no dyadic number."""
    return build_scene(disc(-10, 0, 1), disc(0, 0, m=2.0), disc(25, 0), duration_s=duration_s)


def test_undecidable_impact_at_the_end_is_reported() -> None:
    """An impact at exactly the scene's end that balls cannot prove stops the run with AT_THE_END."""
    # The earlier impact at 5 s is kept. The second is due at 35 s, at 2/3 m/s, no dyadic number.
    found = certify_to_degeneracy(build_arrival_at_35_s(35.0))
    assert certify(build_arrival_at_35_s(35.0)).trace.impacts["time_s"].tolist() == [5.0]
    assert (found.kind, found.bodies, found.proven) == (Degenerate.AT_THE_END, (1, 2), False)
    assert found.bits >= 512
    assert found.earliest_s <= 35.0 <= found.latest_s


def test_rest_in_an_inelastic_corner_is_resting_contact() -> None:
    """A disc that loses all speed in a turned corner with e = 0 has two impacts, then RESTING_CONTACT."""
    walls = wall_at(0.0, 0.0, 3.0, 4.0), wall_at(0.0, 0.0, -4.0, 3.0)
    certified = certify(build_scene(disc(0.2, 3, 0.3, -1, r=0.5), *walls, wall_restitution=0.0))
    assert len(certified) == 2
    assert certified.ending is Ending.DEGENERATE
    assert require_value(certified.degeneracy).kind is Degenerate.RESTING_CONTACT


IRRATIONAL = 7 - math.sqrt(24)
#: Scenes next to those that no precision decides, often by an ulp, and the first discs of their impacts.
DECIDED: dict[str, tuple[Scene, list[int]]] = {
    "the second of a tie is farther": (
        build_scene(disc(math.nextafter(-3.0, -4.0), 0), disc(3, 0), disc(0, 10, 0, -1)),
        [1, 0],
    ),
    "the second of a tie is nearer": (
        build_scene(disc(math.nextafter(-3.0, 0.0), 0), disc(3, 0), disc(0, 10, 0, -1)),
        [0, 1],
    ),
    "nearer than a graze": (build_scene(disc(-20, math.nextafter(5.0, 0.0), 1), disc(0, 0)), [0]),
    "farther than a graze": (build_scene(disc(-20, math.nextafter(5.0, 9.0), 1), disc(0, 0)), []),
    "struck, nearer than a graze": (
        build_scene(disc(-10, 0, 1), disc(0, 0, m=2.0), disc(20, math.nextafter(5.0, 0.0))),
        [0, 1],
    ),
    "struck, farther than a graze": (
        build_scene(disc(-10, 0, 1), disc(0, 0, m=2.0), disc(20, math.nextafter(5.0, 9.0))),
        [0],
    ),
    "touching and parting": (build_scene(disc(0, 0, -1), disc(3, 4)), []),
    "touching at rest": (build_scene(disc(0, 0), disc(3, 4)), []),
    "three above 7 - 4 sqrt(3)": (
        build_scene(disc(-12, 0, 1), disc(0, 0), disc(13, 0, -1), restitution=0.125),
        [0, 1, 0, 1, 0],
    ),
    "at the very end": (build_scene(disc(0, 0, 1), disc(7, 0), duration_s=2.0), [0]),
    "after the end": (build_scene(disc(0, 0, 1), disc(7, 0), duration_s=math.nextafter(2.0, 1.0)), []),
    "after an end that balls do not hold": (build_arrival_at_35_s(math.nextafter(35.0, 0.0)), [0]),
    "before an end that balls do not hold": (build_arrival_at_35_s(math.nextafter(35.0, 36.0)), [0, 1]),
    "after an irrational end": (
        build_scene(disc(0, 0, 1), disc(7, 1), duration_s=IRRATIONAL - 4e-16 * 8),
        [],
    ),
    "before an irrational end": (
        build_scene(disc(0, 0, 1), disc(7, 1), duration_s=IRRATIONAL + 4e-16 * 8),
        [0],
    ),
}


@each("case, expected", [(name, expected) for name, (_, expected) in DECIDED.items()])
def test_scenes_one_ulp_from_undecidable_ones_are_certified(case: str, expected: list[int]) -> None:
    """Scenes next to undecidable ones, often by 1 ulp, are certified to their end with the expected impacts."""
    certified = certify(DECIDED[case][0])
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["first"].tolist() == expected


def test_disc_that_spins_in_place_rests_when_its_spin_has_stopped() -> None:
    """A disc that spins in place rests after exactly w r k / (c g), in certified runs and in PIC."""
    # Its slip and its rim speed are equal, so they end at the same instant. k is the inertia factor, c the rolling
    # resistance.
    disc, floor = disc_at(0.0, 0.5, inertia_factor=0.25, spin_rad_s=3.0), wall_at(0.0, 0.0, 0.0, 1.0)
    scene = build_scene(disc, floor, gravity_m_s2=(0.0, -2.0), wall_rolling_resistance=0.125)
    for trace in (certify(scene).trace, solve_pic(scene)):
        modes = require_value(trace.modes)
        assert [Mode(after) for after in modes["after"]] == [Mode.SLIDE, Mode.REST]
        assert modes["time_s"].tolist() == [0.0, 3.0 * 0.5 * 0.25 / (0.125 * 2.0)]


def test_undecidable_end_of_a_contact_mode_stops_the_run_only_then() -> None:
    """An undecidable end of a contact mode at 2 s stops a certified run there; a run to 1 s completes."""
    # A disc slides at 2 m/s, is slowed by 1 m/s^2, and stops exactly over the end of its wall, after 2 m.
    disc, wall = disc_at(0.0, 0.5, 2.0, inertia_factor=math.inf), Chain(points_m=[(2.0, 0.0), (-4.0, 0.0)])
    scene = staged("over the end", disc, wall, gravity_m_s2=(0.0, -2.0), wall_friction=0.5, duration_s=10.0)
    certified, before = certify(scene), certify(scene.model_copy(update={"duration_s": 1.0}))
    found = require_value(certified.degeneracy)
    assert found.earliest_s <= 2.0 <= found.latest_s
    assert [Mode(after) for after in require_value(certified.trace.modes)["after"]] == [Mode.SLIDE]
    assert before.ending is Ending.COMPLETED
    assert before.trace.final_position_m.tolist() == [[1.5, 0.5]]


def test_paths_that_cross_only_before_the_later_impact_have_no_impact() -> None:
    r"""Two discs that bounce off others within one float of time, and then separate, never meet.

    Their new paths, extended backwards, cross between the two bounces. Before its bounce, the second disc is not on
    its new path. At the closest, ``(1 - 2^-111)^2 + 2^-104`` exceeds the squared contact distance, which is 1.
    """
    aside, late, fixed = 2.0**-111, 2.0**-52, math.inf
    posts = disc_at(aside, -0.75, r=0.25, m=fixed), disc_at(1.0, 0.75, r=0.25, m=fixed)
    discs = disc_at(aside, 1.0, 0.0, -1.0, r=0.5), disc_at(1.0, -1.0 - late, 0.0, 1.0, r=0.5)
    certified = certify(build_scene(*posts, *discs, duration_s=2.0))
    assert certified.ending is Ending.COMPLETED
    assert [(row["first"], row["second"]) for row in certified.trace.impacts] == [(0, 2), (1, 3)]
