"""Ties, grazes and contact, built exactly from Pythagorean triples: named as what they are, never guessed."""

import math
from decimal import Decimal
from typing import Any

import pytest
from tests.cases import each
from tests.scene_builders import require_value

from carom import Chain, Disc, Outcome, Scene, Wall, certify, solve_pic
from carom.model.trace import ImpactRecord, Mode
from carom.solvers.certified.accumulation import _find_collapse
from carom.solvers.certified.recording import RecordedImpact, Recording
from carom.solvers.certified.result import Degeneracy, Degenerate, Ending

AXIS_BOX = [Wall(point_m=(0.0, 0.0), normal=(1.0, 0.0)), Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0))]


def build_disc(x: float, y: float, vx: float = 0.0, vy: float = 0.0, r: float = 2.5, m: float = 1.0) -> Disc:
    return Disc(position_m=(x, y), velocity_m_s=(vx, vy), radius_m=r, mass_kg=m)


def build_scene(*discs: Disc, **more: Any) -> Scene:
    return Scene(name="exact", discs=discs, **{"duration_s": 100.0} | more)


def certify_to_degeneracy(found: Scene, **more: Any) -> Degeneracy:
    certified = certify(found, **more)
    assert certified.ending is Ending.DEGENERATE
    assert certified.trace.outcome is (
        Outcome.STANDSTILL
        if certified.degeneracy and certified.degeneracy.kind is Degenerate.COLLAPSE
        else Outcome.STOPPED
    )
    return require_value(certified.degeneracy)


def test_disc_that_meets_two_discs_at_once_is_a_shared_instant() -> None:
    """A disc that reaches two others at exactly 6 s stops the run with a proven SHARED_INSTANT."""
    found = certify_to_degeneracy(build_scene(build_disc(-3, 0), build_disc(3, 0), build_disc(0, 10, 0, -1)))
    assert found.kind is Degenerate.SHARED_INSTANT
    assert found.bodies == (0, 1, 2)
    assert found.proven
    assert found.earliest_s <= 6.0 <= found.latest_s
    assert found.latest_s - found.earliest_s < 1e-14


def test_tie_of_disjoint_pairs_commutes() -> None:
    """Two distant pairs that meet at exactly 2 s are both certified and reported to commute."""
    pairs = [build_disc(0, y, 1) for y in (0, 100)] + [build_disc(7, y) for y in (0, 100)]
    certified = certify(build_scene(*pairs))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [2.0, 2.0]
    assert certified.commuted == ((0, 1),)


def build_row_struck_from_both_ends(right: float) -> Scene:
    """Two discs at rest, their outer neighbours reaching both of them at t = 5 exactly."""
    return build_scene(build_disc(-10, 0, 1), build_disc(0, 0), build_disc(right, 0), build_disc(right + 10, 0, -1))


def test_tie_of_touching_pairs_is_simultaneous_neighbours() -> None:
    """Two touching discs struck from both sides at exactly 5 s stop with a proven SIMULTANEOUS_NEIGHBOURS."""
    found = certify_to_degeneracy(build_row_struck_from_both_ends(5.0))
    assert (found.kind, found.bodies) == (Degenerate.SIMULTANEOUS_NEIGHBOURS, (0, 1, 2, 3))
    assert found.proven
    assert found.earliest_s <= 5.0 <= found.latest_s


def test_neighbours_one_ulp_apart_commute_and_then_meet() -> None:
    r"""Two discs 1 ulp apart that are struck from both sides have commuting impacts, and then meet.

    They meet after half of the time that the gap takes at 1 m/s.
    """
    right = 5.0 + math.ulp(15.0)
    certified = certify(build_row_struck_from_both_ends(right), max_impacts=3, digits=30)
    assert certified.commuted == ((0, 1),)
    pairs = {(int(impact["first"]), int(impact["second"])) for impact in certified.trace.impacts[:2]}
    assert pairs == {(0, 1), (2, 3)}
    assert (certified.trace.impacts["first"][2], certified.trace.impacts["second"][2]) == (1, 2)
    assert Decimal(certified.decimals[2][0]) - 5 == pytest.approx(Decimal((right - 5.0) / 2), rel=Decimal("1e-12"))


def test_tie_that_shares_an_immovable_disc_is_certified() -> None:
    """Two discs that strike an immovable one at exactly 5 s are both certified."""
    certified = certify(build_scene(build_disc(0, 0, m=math.inf), build_disc(-10, 0, 1), build_disc(10, 0, -1)))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [5.0, 5.0]


def test_impacts_in_a_right_angled_corner_are_certified() -> None:
    """A disc that reaches both walls of a right-angled corner at 4 s is turned back by both."""
    certified = certify(build_scene(build_disc(6, 6, -1, -1, r=2.0), walls=AXIS_BOX))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [4.0, 4.0]
    assert certified.trace.final_velocity_m_s.tolist() == [[1.0, 1.0]]


def test_impacts_in_an_oblique_corner_are_a_shared_instant() -> None:
    """A disc that reaches both walls of an oblique corner at once stops the run with a proven SHARED_INSTANT."""
    walls = [Wall(point_m=(0.0, 0.0), normal=(0.6, 0.8)), Wall(point_m=(0.0, 0.0), normal=(-0.6, 0.8))]
    found = certify_to_degeneracy(build_scene(build_disc(0, 20, 0, -1, r=4.0), walls=walls))
    assert found.kind is Degenerate.SHARED_INSTANT
    assert found.bodies == (-2, -1, 0)
    assert found.proven


@each("x, y, vx, vy", [(-20, 5, 1, 0), (-20.0, 0.0, 4.0, 3.0), (12.0, -16.0, 0.0, 1.0)])
def test_exact_graze_on_initial_paths_is_no_impact(x: float, y: float, vx: float, vy: float) -> None:
    """Discs that pass at exactly the contact distance have no impact, in any direction."""
    distance = abs(x * vy - y * vx) / math.hypot(vx, vy)
    certified = certify(build_scene(build_disc(x, y, vx, vy, r=distance / 2), build_disc(0, 0, r=distance / 2)))
    assert certified.ending is Ending.COMPLETED
    assert len(certified) == 0


def test_exact_graze_of_a_ceiling_is_decided_with_64_bits() -> None:
    r"""A disc that is thrown exactly as high as a ceiling has no impact, though 64 bits cannot hold v^2.

    It is thrown up by v^2 / 2 g with v = 1 + 2^-40 and g = v / 2: the square of v has 81 bits.
    """
    v = 1 + 2.0**-40
    ceiling = Wall(point_m=(0.0, v + 2.5), normal=(0.0, -1.0))
    found = build_scene(build_disc(0, 0, 0, v), walls=[ceiling], gravity_m_s2=(0.0, -v / 2), duration_s=4.0)
    certified = certify(found, digits=6, max_precision_bits=64)
    assert (certified.ending, len(certified)) == (Ending.COMPLETED, 0)


def test_undecidable_graze_is_reported_with_earlier_impacts() -> None:
    r"""An exact graze at 2/3 m/s stops the run with an unproven GRAZE from 35 s on, and keeps earlier impacts.

    Struck by a disc of half its mass, a disc moves at 2/3 m/s, no dyadic number. At least 1024 bits are tried.
    """
    certified = certify(build_scene(build_disc(-10, 0, 1), build_disc(0, 0, m=2.0), build_disc(20, 5)), tie_bits=1024)
    assert certified.trace.impacts["time_s"].tolist() == [5.0]
    assert certified.ending is Ending.DEGENERATE
    found = require_value(certified.degeneracy)
    assert (found.kind, found.bodies, found.proven) == (Degenerate.GRAZE, (1, 2), False)
    assert found.bits >= 1024
    # 20 m at 2/3 m/s after 5 s; it may not touch at all, so there is no latest.
    assert found.earliest_s == pytest.approx(35.0, abs=1e-14)
    assert found.latest_s == math.inf


def test_approaching_bodies_that_touch_at_the_start_are_reported() -> None:
    """Discs, or a disc and a wall, that touch at the start and approach stop the run with TOUCHING_START."""
    found = certify_to_degeneracy(build_scene(build_disc(0, 0, 1), build_disc(3, 4)))
    assert (found.kind, found.bodies, found.earliest_s) == (Degenerate.TOUCHING_START, (0, 1), 0.0)
    wall = certify_to_degeneracy(build_scene(build_disc(2.5, 5, -1), walls=AXIS_BOX))
    assert (wall.kind, wall.bodies) == (Degenerate.TOUCHING_START, (-1, 0))


def test_start_that_overlaps_by_rounding_is_reported() -> None:
    r"""Discs that overlap by 1 ulp at the start stop the run with OVERLAPPING_START.

    Discs that touch in decimal numbers are reported as touching or overlapping.
    """
    left, right = build_disc(0.1, 0, 1, r=0.1), build_disc(0.3, 0, r=0.1)
    overlap = build_scene(left, right)
    assert certify_to_degeneracy(overlap).kind in (Degenerate.OVERLAPPING_START, Degenerate.TOUCHING_START)
    below = build_scene(build_disc(0, 0, 1), build_disc(math.nextafter(5.0, 0.0), 0))
    assert certify_to_degeneracy(below).kind is Degenerate.OVERLAPPING_START


def test_struck_disc_that_touches_another_is_resting_contact() -> None:
    r"""A strike on the first of two touching discs stops the run with a proven RESTING_CONTACT.

    The impact at 5 s is kept.
    """
    certified = certify(build_scene(build_disc(-10, 0, 1), build_disc(0, 0), build_disc(5, 0)))
    assert certified.trace.impacts["time_s"].tolist() == [5.0]
    assert require_value(certified.degeneracy).kind is Degenerate.RESTING_CONTACT
    assert require_value(certified.degeneracy).bodies == (0, 1, 2)
    assert require_value(certified.degeneracy).proven


def test_inelastic_collapse_is_reported() -> None:
    r"""Three equal discs with e below 7 - 4 sqrt(3) stop the run with COLLAPSE, within 2 ulp of its time.

    They collide infinitely often (McNamara and Young, 1992).
    """
    found = certify_to_degeneracy(
        build_scene(build_disc(-12, 0, 1), build_disc(0, 0), build_disc(13, 0, -1), restitution=0.0625),
        time_budget_s=120.0,
    )
    assert found.kind is Degenerate.COLLAPSE
    assert found.bodies == (0, 1, 2)
    assert found.latest_s - found.earliest_s <= 2 * math.ulp(found.latest_s)


class Known:
    """Bodies of whose states so much is known."""

    def __init__(self, found: Scene) -> None:
        self.scene = found

    def state_bits(self, body: int) -> int:
        return 100 + body


def find_collapse_of(*times_s: float) -> Degeneracy | None:
    """Return what is made of impacts of two discs that lose energy, at such times."""
    found = build_scene(build_disc(-12, 0, 1), build_disc(0, 0), restitution=0.5)
    log = Recording(found, 15)
    still = (0.0, 0.0)
    for time_s in times_s:
        record = ImpactRecord(time_s, 0, 1, (1.0, 0.0), still, still, still, still)
        log.rows.append(RecordedImpact(record, record, ()))
    return _find_collapse(log, Known(found))  # type: ignore[arg-type] # all that is asked of bodies


def test_collapse_of_two_discs_needs_80_impacts_within_2_ulp() -> None:
    """Two discs collapse after 80 impacts within 2 ulp of time; 79 impacts, or 3 ulp, are no collapse yet."""
    last = 1.5
    one, two, three = (last - k * math.ulp(last) for k in (1, 2, 3))
    for early in (one, two):
        found = require_value(find_collapse_of(*[early] * 40, *[last] * 40))
        assert (found.kind, found.bodies, found.earliest_s, found.latest_s) == (
            Degenerate.COLLAPSE,
            (0, 1),
            early,
            last,
        )
        assert (found.bits, found.proven) == (100, False)
    assert find_collapse_of(*[two] * 39, *[last] * 40) is None
    assert find_collapse_of(three, *[two] * 39, *[last] * 40) is None


def build_arrival_at_35_s(duration_s: float) -> Scene:
    """Struck after 5 s by a disc of half its mass, a disc covers 20 m at 2/3 m/s, no dyadic number."""
    return build_scene(build_disc(-10, 0, 1), build_disc(0, 0, m=2.0), build_disc(25, 0), duration_s=duration_s)


def test_undecidable_impact_at_the_end_is_reported() -> None:
    r"""An impact at exactly the scene's end that balls cannot prove stops the run with AT_THE_END.

    The earlier impact at 5 s is kept. The second is due at 35 s, at 2/3 m/s, no dyadic number.
    """
    certified = certify(build_arrival_at_35_s(35.0))
    assert certified.trace.impacts["time_s"].tolist() == [5.0]
    assert certified.ending is Ending.DEGENERATE
    found = require_value(certified.degeneracy)
    assert (found.kind, found.bodies, found.proven) == (Degenerate.AT_THE_END, (1, 2), False)
    assert found.bits >= 512
    assert found.earliest_s <= 35.0 <= found.latest_s


def test_rest_in_an_inelastic_corner_is_resting_contact() -> None:
    """A disc that loses all speed in a turned corner with e = 0 has two impacts, then RESTING_CONTACT."""
    walls = [Wall(point_m=(0.0, 0.0), normal=(3.0, 4.0)), Wall(point_m=(0.0, 0.0), normal=(-4.0, 3.0))]
    certified = certify(build_scene(build_disc(0.2, 3, 0.3, -1, r=0.5), walls=walls, wall_restitution=0.0))
    assert len(certified) == 2
    assert certified.ending is Ending.DEGENERATE
    assert require_value(certified.degeneracy).kind is Degenerate.RESTING_CONTACT


@each("scale", [2.0**-500, 1.0, 2.0**500])
def test_lengths_and_speeds_of_any_size_are_certified(scale: float) -> None:
    """Scenes with lengths and speeds of 2^-500, 1 and 2^500 are certified with the same impact time."""
    discs = (build_disc(0, 0, 3 * scale, 0, r=scale), build_disc(10 * scale, scale, r=scale))
    certified = certify(build_scene(*discs))
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.impacts["time_s"].tolist() == [pytest.approx((10 - math.sqrt(3)) / 3, rel=1e-15)]


IRRATIONAL = 7 - math.sqrt(24)
#: Scenes next to those that no precision decides, often by an ulp, and the first discs of their impacts.
DECIDED: dict[str, tuple[Scene, list[int]]] = {
    "the second of a tie is farther": (
        build_scene(build_disc(math.nextafter(-3.0, -4.0), 0), build_disc(3, 0), build_disc(0, 10, 0, -1)),
        [1, 0],
    ),
    "the second of a tie is nearer": (
        build_scene(build_disc(math.nextafter(-3.0, 0.0), 0), build_disc(3, 0), build_disc(0, 10, 0, -1)),
        [0, 1],
    ),
    "nearer than a graze": (build_scene(build_disc(-20, math.nextafter(5.0, 0.0), 1), build_disc(0, 0)), [0]),
    "farther than a graze": (build_scene(build_disc(-20, math.nextafter(5.0, 9.0), 1), build_disc(0, 0)), []),
    "struck, nearer than a graze": (
        build_scene(build_disc(-10, 0, 1), build_disc(0, 0, m=2.0), build_disc(20, math.nextafter(5.0, 0.0))),
        [0, 1],
    ),
    "struck, farther than a graze": (
        build_scene(build_disc(-10, 0, 1), build_disc(0, 0, m=2.0), build_disc(20, math.nextafter(5.0, 9.0))),
        [0],
    ),
    "touching and parting": (build_scene(build_disc(0, 0, -1), build_disc(3, 4)), []),
    "touching at rest": (build_scene(build_disc(0, 0), build_disc(3, 4)), []),
    "three above 7 - 4 sqrt(3)": (
        build_scene(build_disc(-12, 0, 1), build_disc(0, 0), build_disc(13, 0, -1), restitution=0.125),
        [0, 1, 0, 1, 0],
    ),
    "at the very end": (build_scene(build_disc(0, 0, 1), build_disc(7, 0), duration_s=2.0), [0]),
    "after the end": (build_scene(build_disc(0, 0, 1), build_disc(7, 0), duration_s=math.nextafter(2.0, 1.0)), []),
    "after an end that balls do not hold": (build_arrival_at_35_s(math.nextafter(35.0, 0.0)), [0]),
    "before an end that balls do not hold": (build_arrival_at_35_s(math.nextafter(35.0, 36.0)), [0, 1]),
    "after an irrational end": (
        build_scene(build_disc(0, 0, 1), build_disc(7, 1), duration_s=IRRATIONAL - 4e-16 * 8),
        [],
    ),
    "before an irrational end": (
        build_scene(build_disc(0, 0, 1), build_disc(7, 1), duration_s=IRRATIONAL + 4e-16 * 8),
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
    r"""A disc that spins in place rests after exactly w r k / (c g), in certified runs and in PIC.

    Its slip and its rim speed are equal, so they end at the same instant. k is the inertia factor, c the rolling
    resistance.
    """
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


def test_undecidable_end_of_a_contact_mode_stops_the_run_only_then() -> None:
    r"""An undecidable end of a contact mode at 2 s stops a certified run there; a run to 1 s completes.

    A disc slides at 2 m/s, is slowed by 1 m/s^2, and stops exactly over the end of its wall, after 2 m.
    """
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


def test_paths_that_cross_only_before_the_later_impact_have_no_impact() -> None:
    r"""Two discs that bounce off others within one float of time, and then separate, never meet.

    Their new paths, extended backwards, cross between the two bounces. Before its bounce, the second disc is not on
    its new path. At the closest, ``(1 - 2^-111)^2 + 2^-104`` exceeds the squared contact distance, which is 1.
    """
    aside, late, fixed = 2.0**-111, 2.0**-52, math.inf
    posts = build_disc(aside, -0.75, r=0.25, m=fixed), build_disc(1.0, 0.75, r=0.25, m=fixed)
    discs = build_disc(aside, 1.0, 0.0, -1.0, r=0.5), build_disc(1.0, -1.0 - late, 0.0, 1.0, r=0.5)
    certified = certify(build_scene(*posts, *discs, duration_s=2.0))
    assert certified.ending is Ending.COMPLETED
    assert [(row["first"], row["second"]) for row in certified.trace.impacts] == [(0, 2), (1, 3)]
