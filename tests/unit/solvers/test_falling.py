"""Runs under gravity: what rests, and what rounding may make of many bounces."""

import math
from fractions import Fraction

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at

from carom import Chain, Disc, Outcome, Scene, solve_pic
from carom.solvers.event_driven.run import EventDrivenRun

GRAVITY = {"gravity_m_s2": (0.0, -1.0)}


def build_touching_scene(speed: float) -> Scene:
    """A disc 1,000 m from the origin that touches the floor and goes into it at a speed."""
    return staged("floor", disc_at(1000.0, 0.5, 0.0, -speed), wall_at(0.0, 0.0, 0.0, 1.0), duration_s=1e-6, **GRAVITY)


#: The speed of a hop as high as the accuracy of its gap; the height is half of its square over 1 m/s^2. The gap is
#: known to 5 units in the last place of its coordinates and its radius, 1,000 + .5 + .5 m, as `carom.core.resolution`
#: derives it.
_HOP_M_S = math.sqrt(2 * 5 * 2.0**-52 * 1001.0)


@each("part, rests, impacts", [(0.9, True, 0), (1.1, False, 1)])
def test_disc_rests_if_its_hop_is_below_the_accuracy_of_its_gap(part: float, rests: bool, impacts: int) -> None:
    """A disc on a floor rests at 0.9 times the speed of a hop as high as its gap's accuracy, and bounces at 1.1."""
    trace = solve_pic(build_touching_scene(part * _HOP_M_S))
    assert (trace.modes is not None, len(trace.impacts)) == (rests, impacts)


@each("part", [0.5, 1e-3, 2.0])
def test_impact_from_below_makes_a_disc_hop_off_the_floor(part: float) -> None:
    """A disc on a floor that is hit from below hops, also lower than the accuracy of its gap.

    Another disc hits this disc at the top of its own flight. The other centre is lower by a small part of the distance
    of the centres: the sine of the normal's angle. At equal masses and restitution 1, the disc takes over the speed 1
    m/s times the cosine along the normal. At 1 m/s^2 a hop lasts twice its upward speed.
    """
    sine = part * _HOP_M_S
    place = 0.5 - 0.8 * sine  # height of the other disc at the impact
    discs = disc_at(1000.0, 0.5, r=0.5), disc_at(999.1, place - 0.005, 1.0, 0.1, r=0.3)
    floor = wall_at(0.0, 0.0, 0.0, 1.0, restitution=0.0)
    trace = solve_pic(staged("floor", *discs, floor, duration_s=0.2, **GRAVITY))
    assert trace.impacts[["first", "second"]].tolist() == [(0, 1), (0, -1)]
    struck_s, landed_s = trace.impacts["time_s"].tolist()
    hop_s = 2.0 * sine * math.sqrt(1.0 - sine**2)
    assert landed_s - struck_s == pytest.approx(hop_s, rel=1e-3)


def test_300_bounces_on_an_immovable_disc_do_not_drift() -> None:
    """A disc that bounces on top of an immovable one is at the contact distance within 4 ulp at 300 impacts."""
    discs = disc_at(0.1, 0.1, r=0.3, m=math.inf), disc_at(0.1, 1.3, r=0.2)
    run = EventDrivenRun(staged("top", *discs, duration_s=1e3, **GRAVITY))
    worst = 0.0
    for impacts in range(1, 301):
        run.advance_to(1e3, impacts)
        (_, low), (_, high) = run.positions()
        worst = max(worst, abs((high - low) - 0.5))
    assert worst <= 4 * math.ulp(0.5)


#: Where discs begin, in metres: at some one of these a rounding may be none.
_PLACES = (-0.4, -0.3, -0.2, -0.1, 0.1, 0.2, 0.3, 0.4)


def compute_gap_after_fall(x: float, wall: Chain | Disc, reach: Fraction, height: Fraction) -> Fraction:
    """Return how far a disc's rim is from a wall after its first impact there, whose circle's centre is at a height."""
    scene = staged("fall", wall, disc_at(x, 1.7, 0.1, 0.4, r=0.25), gravity_m_s2=(0.3, -9.81), duration_s=9.0)
    px, py = map(Fraction, solve_pic(scene, max_impacts=1).final_position_m[-1].tolist())
    return abs(px**2 + (py - height) ** 2 - reach**2) / (2 * reach)


@each("inside", [True, False])
def test_gap_at_impact_on_a_500_km_arc_is_that_on_a_floor(inside: bool) -> None:
    """At an impact with an arc of radius 500 km the gap is below 2^-52 m, as on a floor."""
    bulge, thick = Fraction(1e-6), Fraction(3, 8)  # half width and the disc's radius
    points = [(-1, 0), (1, 0)] if inside else [(1, 0), (-1, 0)]  # the arc is on the right of its way
    arc = Chain(points_m=points, bulges=[float(bulge)], half_width_m=0.125)
    size, height = (1 + bulge**2) / (2 * bulge), (1 - bulge**2) / (2 * bulge)  # of a chord of two metres
    circle = (size - thick, height) if inside else (size + thick, -height)
    assert max(compute_gap_after_fall(x, arc, *circle) for x in _PLACES) < Fraction(1, 2**52)


def test_gap_at_impact_on_a_1000_km_disc_is_that_on_a_floor() -> None:
    """At an impact with an immovable disc of radius 1000 km the gap is below 2^-52 m, as on a floor."""
    size = 1e6 + 0.7
    large, reach = disc_at(0, -size, r=size, m=math.inf), Fraction(size) + Fraction(1, 4)
    assert max(compute_gap_after_fall(x, large, reach, -Fraction(size)) for x in _PLACES) < Fraction(1, 2**52)


@each("bulge", [0.25, 1e-3, 1e-6, 1e-9])
@each("inside", [True, False])
def test_disc_rests_on_an_arc_at_the_same_time_as_on_a_floor(bulge: float, inside: bool) -> None:
    """A disc with e = 0.5 that falls for half a second rests after 1.5 s on an arc of any radius."""
    points = [(-1, 0), (1, 0)] if inside else [(1, 0), (-1, 0)]
    middle = -bulge if inside else bulge  # half the chord times the bulge is how far the arc's middle is from it
    bodies = disc_at(0, middle + 1.25, r=0.25), Chain(points_m=points, bulges=[bulge])
    run = EventDrivenRun(staged("arc", *bodies, wall_restitution=0.5, gravity_m_s2=(0, -8), duration_s=9.0))
    assert run.advance_to(9.0) is Outcome.AT_REST
    # It rests once v^2 <= 2 g gap, with a gap of 5 units in the last place of its coordinates and radius, 3/4 m:
    # the hops that are left out take v / g + v / 2 g + ...
    assert 0.0 <= 1.5 - run.time_s <= 2.0 * math.sqrt(2.0 * 5.0 * 2.0**-52 * 0.75 / 8.0)
