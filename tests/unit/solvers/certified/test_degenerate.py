"""Ties, grazes and contact, built exactly from Pythagorean triples: named as what they are, never guessed."""

import math
from decimal import Decimal
from typing import Any

import pytest
from tests.cases import each
from tests.scene_builders import sure

from carom import Chain, Disc, Outcome, Scene, Wall, certify, solve_pic
from carom.model.trace import ImpactRecord, Mode
from carom.solvers.certified.accumulation import _find_collapse
from carom.solvers.certified.recording import RecordedImpact, Recording
from carom.solvers.certified.result import Degeneracy, Degenerate, Ending

AXIS_BOX = [Wall(point_m=(0.0, 0.0), normal=(1.0, 0.0)), Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0))]


def disc(x: float, y: float, vx: float = 0.0, vy: float = 0.0, r: float = 2.5, m: float = 1.0) -> Disc:
    return Disc(position_m=(x, y), velocity_m_s=(vx, vy), radius_m=r, mass_kg=m)


def scene(*discs: Disc, **more: Any) -> Scene:
    return Scene(name="exact", discs=discs, **{"duration_s": 100.0} | more)


def stopped_at(found: Scene, **more: Any) -> Degeneracy:
    certified = certify(found, **more)
    assert certified.ending is Ending.DEGENERATE
    assert certified.trace.outcome is (
        Outcome.STANDSTILL
        if certified.degeneracy and certified.degeneracy.kind is Degenerate.COLLAPSE
        else Outcome.STOPPED
    )
    return sure(certified.degeneracy)


def test_a_disc_that_meets_two_at_one_instant_is_a_shared_instant() -> None:
    """3-4-5: a disc coming down the axis reaches contact, 5 apart, with both others at t = 6 exactly."""
    found = stopped_at(scene(disc(-3, 0), disc(3, 0), disc(0, 10, 0, -1)))
    assert found.kind is Degenerate.SHARED_INSTANT
    assert found.bodies == (0, 1, 2)
    assert found.proven
    assert found.earliest_s <= 6.0 <= found.latest_s
    assert found.latest_s - found.earliest_s < 1e-14


def test_a_tie_of_disjoint_pairs_commutes() -> None:
    """Two pairs that meet at t = 2 exactly, far apart, are both certified, and their order is said not to matter."""
    pairs = [disc(0, y, 1) for y in (0, 100)] + [disc(7, y) for y in (0, 100)]
    certified = certify(scene(*pairs))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [2.0, 2.0]
    assert certified.commuted == ((0, 1),)


def in_line_struck_from_both_ends(right: float) -> Scene:
    """Two discs at rest, their outer neighbours reaching both of them at t = 5 exactly."""
    return scene(disc(-10, 0, 1), disc(0, 0), disc(right, 0), disc(right + 10, 0, -1))


def test_a_tie_of_disjoint_pairs_that_touch_is_one_of_neighbours() -> None:
    """Struck at one instant, each of two touching discs is driven into the other: the third has no answer."""
    found = stopped_at(in_line_struck_from_both_ends(5.0))
    assert (found.kind, found.bodies) == (Degenerate.SIMULTANEOUS_NEIGHBOURS, (0, 1, 2, 3))
    assert found.proven
    assert found.earliest_s <= 5.0 <= found.latest_s


def test_the_same_neighbours_an_ulp_apart_commute_and_then_meet() -> None:
    """Apart by a unit in the last place of the outer disc, two impacts are independent; a third is half of it later."""
    right = 5.0 + math.ulp(15.0)
    certified = certify(in_line_struck_from_both_ends(right), max_impacts=3, digits=30)
    assert certified.commuted == ((0, 1),)
    pairs = {(int(impact["first"]), int(impact["second"])) for impact in certified.trace.impacts[:2]}
    assert pairs == {(0, 1), (2, 3)}
    assert (certified.trace.impacts["first"][2], certified.trace.impacts["second"][2]) == (1, 2)
    assert Decimal(certified.decimals[2][0]) - 5 == pytest.approx(Decimal((right - 5.0) / 2), rel=Decimal("1e-12"))


def test_a_tie_with_an_immovable_disc_in_common_commutes() -> None:
    """An immovable disc is not changed by an impact, so two discs may strike it at once."""
    certified = certify(scene(disc(0, 0, m=math.inf), disc(-10, 0, 1), disc(10, 0, -1)))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [5.0, 5.0]


def test_orthogonal_walls_commute_in_their_corner() -> None:
    """A disc that reaches both walls of a corner at one instant is turned back by both."""
    certified = certify(scene(disc(6, 6, -1, -1, r=2.0), walls=AXIS_BOX))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [4.0, 4.0]
    assert certified.trace.final_velocity_m_s.tolist() == [[1.0, 1.0]]


def test_walls_at_any_other_angle_do_not_commute() -> None:
    """Two walls of 3-4-5 met at one instant: the order of the impacts would decide."""
    walls = [Wall(point_m=(0.0, 0.0), normal=(0.6, 0.8)), Wall(point_m=(0.0, 0.0), normal=(-0.6, 0.8))]
    found = stopped_at(scene(disc(0, 20, 0, -1, r=4.0), walls=walls))
    assert found.kind is Degenerate.SHARED_INSTANT
    assert found.bodies == (-2, -1, 0)
    assert found.proven


@each("x, y, vx, vy", [(-20, 5, 1, 0), (-20.0, 0.0, 4.0, 3.0), (12.0, -16.0, 0.0, 1.0)])
def test_an_exact_graze_on_first_paths_is_no_impact(x: float, y: float, vx: float, vy: float) -> None:
    """Passing at exactly the contact distance of 5 (or 12) changes nothing, whatever the direction; D = 0 exactly."""
    distance = abs(x * vy - y * vx) / math.hypot(vx, vy)
    certified = certify(scene(disc(x, y, vx, vy, r=distance / 2), disc(0, 0, r=distance / 2)))
    assert certified.ending is Ending.COMPLETED
    assert len(certified) == 0


def test_a_graze_of_a_ceiling_is_told_where_no_ball_has_the_bits() -> None:
    """Thrown up by v^2 / 2 g with v = 1 + 2^-40 and g = v / 2: the square of v has 81 bits, of 64 that are allowed."""
    v = 1 + 2.0**-40
    ceiling = Wall(point_m=(0.0, v + 2.5), normal=(0.0, -1.0))
    found = scene(disc(0, 0, 0, v), walls=[ceiling], gravity_m_s2=(0.0, -v / 2), duration_s=4.0)
    certified = certify(found, digits=6, max_precision_bits=64)
    assert (certified.ending, len(certified)) == (Ending.COMPLETED, 0)


def test_a_graze_that_no_precision_decides_is_reported_with_what_came_before() -> None:
    """Struck by a disc of half its mass, a disc leaves at 2/3 m/s, no dyadic number, and grazes a third one exactly."""
    certified = certify(scene(disc(-10, 0, 1), disc(0, 0, m=2.0), disc(20, 5)), tie_bits=1024)
    assert certified.trace.impacts["time_s"].tolist() == [5.0]
    assert certified.ending is Ending.DEGENERATE
    found = sure(certified.degeneracy)
    assert (found.kind, found.bodies, found.proven) == (Degenerate.GRAZE, (1, 2), False)
    assert found.bits >= 1024
    # 20 m at 2/3 m/s after 5 s; it may not touch at all, so there is no latest.
    assert found.earliest_s == pytest.approx(35.0, abs=1e-14)
    assert found.latest_s == math.inf


def test_a_touching_start_in_motion_is_named() -> None:
    """Two discs at exactly the contact distance that approach: the state has no past, so it is reported."""
    found = stopped_at(scene(disc(0, 0, 1), disc(3, 4)))
    assert (found.kind, found.bodies, found.earliest_s) == (Degenerate.TOUCHING_START, (0, 1), 0.0)
    wall = stopped_at(scene(disc(2.5, 5, -1), walls=AXIS_BOX))
    assert (wall.kind, wall.bodies) == (Degenerate.TOUCHING_START, (-1, 0))


def test_a_start_that_overlaps_by_rounding_is_named() -> None:
    """Touching in decimal numbers, overlapping in binary ones: said to be so."""
    left, right = disc(0.1, 0, 1, r=0.1), disc(0.3, 0, r=0.1)
    overlap = scene(left, right)
    assert stopped_at(overlap).kind in (Degenerate.OVERLAPPING_START, Degenerate.TOUCHING_START)
    below = scene(disc(0, 0, 1), disc(math.nextafter(5.0, 0.0), 0))
    assert stopped_at(below).kind is Degenerate.OVERLAPPING_START


def test_a_disc_driven_into_its_neighbour_is_resting_contact() -> None:
    """The first of two touching discs is struck: that pair's impact has no unique answer, and the first is kept."""
    certified = certify(scene(disc(-10, 0, 1), disc(0, 0), disc(5, 0)))
    assert certified.trace.impacts["time_s"].tolist() == [5.0]
    assert sure(certified.degeneracy).kind is Degenerate.RESTING_CONTACT
    assert sure(certified.degeneracy).bodies == (0, 1, 2)
    assert sure(certified.degeneracy).proven


def test_inelastic_collapse_is_named_and_does_not_hang() -> None:
    """Three equal discs below e = 7 - 4 sqrt(3) collide without end (McNamara and Young, 1992)."""
    found = stopped_at(scene(disc(-12, 0, 1), disc(0, 0), disc(13, 0, -1), restitution=0.0625), time_budget_s=120.0)
    assert found.kind is Degenerate.COLLAPSE
    assert found.bodies == (0, 1, 2)
    assert found.latest_s - found.earliest_s <= 2 * math.ulp(found.latest_s)


class Known:
    """Bodies of whose states so much is known."""

    def __init__(self, found: Scene) -> None:
        self.scene = found

    def state_bits(self, body: int) -> int:
        return 100 + body


def collapse_of(*times_s: float) -> Degeneracy | None:
    """Return what is made of impacts of two discs that lose energy, at such times."""
    found = scene(disc(-12, 0, 1), disc(0, 0), restitution=0.5)
    log = Recording(found, 15)
    still = (0.0, 0.0)
    for time_s in times_s:
        record = ImpactRecord(time_s, 0, 1, (1.0, 0.0), still, still, still, still)
        log.rows.append(RecordedImpact(record, record, ()))
    return _find_collapse(log, Known(found))  # type: ignore[arg-type] # all that is asked of bodies


def test_a_collapse_is_twenty_impacts_for_each_pair_of_bodies_within_two_units_of_the_clock() -> None:
    """Of two discs 80: one less, or one that is three units in the last place earlier, is no collapse yet."""
    last = 1.5
    one, two, three = (last - k * math.ulp(last) for k in (1, 2, 3))
    for early in (one, two):
        found = sure(collapse_of(*[early] * 40, *[last] * 40))
        assert (found.kind, found.bodies, found.earliest_s, found.latest_s) == (
            Degenerate.COLLAPSE,
            (0, 1),
            early,
            last,
        )
        assert (found.bits, found.proven) == (100, False)
    assert collapse_of(*[two] * 39, *[last] * 40) is None
    assert collapse_of(three, *[two] * 39, *[last] * 40) is None


def arriving_at_35_s(duration_s: float) -> Scene:
    """Struck after 5 s by a disc of half its mass, a disc covers 20 m at 2/3 m/s, no dyadic number."""
    return scene(disc(-10, 0, 1), disc(0, 0, m=2.0), disc(25, 0), duration_s=duration_s)


def test_an_impact_that_no_precision_tells_from_the_end_is_reported() -> None:
    """The second impact is at exactly the scene's duration, which balls around 2/3 can't show: the first is kept."""
    certified = certify(arriving_at_35_s(35.0))
    assert certified.trace.impacts["time_s"].tolist() == [5.0]
    assert certified.ending is Ending.DEGENERATE
    found = sure(certified.degeneracy)
    assert (found.kind, found.bodies, found.proven) == (Degenerate.AT_THE_END, (1, 2), False)
    assert found.bits >= 512
    assert found.earliest_s <= 35.0 <= found.latest_s


def test_what_comes_to_rest_in_a_corner_is_reported_and_kept() -> None:
    """Both walls of a turned corner of restitution 0 take all speed: the balls around it hold both signs."""
    walls = [Wall(point_m=(0.0, 0.0), normal=(3.0, 4.0)), Wall(point_m=(0.0, 0.0), normal=(-4.0, 3.0))]
    certified = certify(scene(disc(0.2, 3, 0.3, -1, r=0.5), walls=walls, wall_restitution=0.0))
    assert len(certified) == 2
    assert certified.ending is Ending.DEGENERATE
    assert sure(certified.degeneracy).kind is Degenerate.RESTING_CONTACT


@each("scale", [2.0**-500, 1.0, 2.0**500])
def test_no_size_is_too_small_or_too_large(scale: float) -> None:
    """Lengths and speeds may be near the ends of float64's range: what overflows there is left to the balls."""
    discs = (disc(0, 0, 3 * scale, 0, r=scale), disc(10 * scale, scale, r=scale))
    certified = certify(scene(*discs))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [pytest.approx((10 - math.sqrt(3)) / 3, rel=1e-15)]


IRRATIONAL = 7 - math.sqrt(24)
#: Scenes next to those that no precision decides, often by an ulp, and the first discs of their impacts.
DECIDED: dict[str, tuple[Scene, list[int]]] = {
    "the second of a tie is farther": (
        scene(disc(math.nextafter(-3.0, -4.0), 0), disc(3, 0), disc(0, 10, 0, -1)),
        [1, 0],
    ),
    "the second of a tie is nearer": (
        scene(disc(math.nextafter(-3.0, 0.0), 0), disc(3, 0), disc(0, 10, 0, -1)),
        [0, 1],
    ),
    "nearer than a graze": (scene(disc(-20, math.nextafter(5.0, 0.0), 1), disc(0, 0)), [0]),
    "farther than a graze": (scene(disc(-20, math.nextafter(5.0, 9.0), 1), disc(0, 0)), []),
    "struck, nearer than a graze": (
        scene(disc(-10, 0, 1), disc(0, 0, m=2.0), disc(20, math.nextafter(5.0, 0.0))),
        [0, 1],
    ),
    "struck, farther than a graze": (
        scene(disc(-10, 0, 1), disc(0, 0, m=2.0), disc(20, math.nextafter(5.0, 9.0))),
        [0],
    ),
    "touching and parting": (scene(disc(0, 0, -1), disc(3, 4)), []),
    "touching at rest": (scene(disc(0, 0), disc(3, 4)), []),
    "three above 7 - 4 sqrt(3)": (
        scene(disc(-12, 0, 1), disc(0, 0), disc(13, 0, -1), restitution=0.125),
        [0, 1, 0, 1, 0],
    ),
    "at the very end": (scene(disc(0, 0, 1), disc(7, 0), duration_s=2.0), [0]),
    "after the end": (scene(disc(0, 0, 1), disc(7, 0), duration_s=math.nextafter(2.0, 1.0)), []),
    "after an end that balls do not hold": (arriving_at_35_s(math.nextafter(35.0, 0.0)), [0]),
    "before an end that balls do not hold": (arriving_at_35_s(math.nextafter(35.0, 36.0)), [0, 1]),
    "after an irrational end": (scene(disc(0, 0, 1), disc(7, 1), duration_s=IRRATIONAL - 4e-16 * 8), []),
    "before an irrational end": (scene(disc(0, 0, 1), disc(7, 1), duration_s=IRRATIONAL + 4e-16 * 8), [0]),
}


@each("case, expected", [(name, expected) for name, (_, expected) in DECIDED.items()])
def test_beside_what_no_precision_decides_all_is_decided(case: str, expected: list[int]) -> None:
    """A unit in the last place away on either side, or where discs part or rest, the run is certified to its end."""
    certified = certify(DECIDED[case][0])
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["first"].tolist() == expected


def test_disc_that_spins_in_place_comes_to_rest_when_rolling_resistance_has_stopped_its_spin() -> None:
    """Slip and rim speed are equal, so they end at the same instant: after omega r k / (c g), k the inertia factor."""
    scene = Scene(
        name="spinning in place",
        discs=[Disc(position_m=(0.0, 0.5), radius_m=0.5, inertia_factor=0.25, spin_rad_s=3.0)],
        walls=[Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0))],
        gravity_m_s2=(0.0, -2.0),
        wall_rolling_resistance=0.125,
        duration_s=10.0,
    )
    for trace in (certify(scene).trace, solve_pic(scene)):
        assert trace.modes is not None
        assert [Mode(after) for after in trace.modes["after"]] == [Mode.SLIDE, Mode.REST]
        assert trace.modes["time_s"].tolist() == [0.0, 3.0 * 0.5 * 0.25 / (0.125 * 2.0)]


def test_an_undecidable_end_of_a_contact_mode_ends_the_run_only_when_it_comes() -> None:
    """A disc slides at 2 m/s, is slowed by 1 m/s2, and stops exactly over the end of its wall, after 2 s and 2 m."""
    scene = Scene(
        name="stops over the end",
        discs=[Disc(position_m=(0.0, 0.5), velocity_m_s=(2.0, 0.0), radius_m=0.5, inertia_factor=math.inf)],
        walls=[Chain(points_m=[(2.0, 0.0), (-4.0, 0.0)])],
        gravity_m_s2=(0.0, -2.0),
        wall_friction=0.5,
        duration_s=10.0,
    )
    certified = certify(scene)
    assert certified.degeneracy is not None
    assert certified.degeneracy.earliest_s <= 2.0 <= certified.degeneracy.latest_s
    assert certified.trace.modes is not None
    assert [Mode(after) for after in certified.trace.modes["after"]] == [Mode.SLIDE]
    before = certify(scene.model_copy(update={"duration_s": 1.0}))
    assert before.ending is Ending.COMPLETED
    assert before.trace.final_position_m.tolist() == [[1.5, 0.5]]
