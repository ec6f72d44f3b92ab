"""Runs under gravity: what rests, and what rounding may make of many bounces."""

import math
from fractions import Fraction
from typing import Any

from tests.cases import each

from carom import Chain, Disc, Outcome, Scene, solve_pic
from carom.solvers.event_driven.run import EventDrivenRun

GRAVITY = {"gravity_m_s2": (0.0, -1.0)}


def touching_the_floor(speed: float) -> Scene:
    """A disc 1,000 m from the origin that touches the floor and goes into it at a speed."""
    disc = Disc(position_m=(1000.0, 0.5), velocity_m_s=(0.0, -speed), radius_m=0.5)
    return Scene(name="floor", duration_s=1e-6, discs=[disc], walls=[_FLOOR], restitution=1.0, **GRAVITY)


_FLOOR: Any = {"point_m": (0.0, 0.0), "normal": (0.0, 1.0)}
#: The speed of a hop as high as the accuracy of its gap; the height is half of its square over 1 m/s^2. The gap is
#: known to 5 units in the last place of its coordinates and its radius, 1,000 + .5 + .5 m, as `carom.core.resolution`
#: derives it.
_HOP_M_S = math.sqrt(2 * 5 * 2.0**-52 * 1001.0)


@each("part, rests, impacts", [(0.9, True, 0), (1.1, False, 1)])
def test_a_disc_rests_if_its_hop_would_be_lower_than_its_gap_is_known_to(
    part: float, rests: bool, impacts: int
) -> None:
    """A tenth slower than that speed it rests, a tenth faster it bounces."""
    trace = solve_pic(touching_the_floor(part * _HOP_M_S))
    assert (trace.modes is not None, len(trace.impacts)) == (rests, impacts)


def test_many_bounces_on_an_immovable_disc_take_the_place_no_further_off_than_one() -> None:
    """Balanced on its top, an elastic disc comes back to the rim each time, in 300 bounces as in one."""
    discs = [Disc(position_m=(0.1, 0.1), radius_m=0.3, mass_kg=math.inf), Disc(position_m=(0.1, 1.3), radius_m=0.2)]
    run = EventDrivenRun(Scene(name="top", duration_s=1e3, discs=discs, **GRAVITY))
    worst = 0.0
    for impacts in range(1, 301):
        run.advance_to(1e3, impacts)
        (_, low), (_, high) = run.positions()
        worst = max(worst, abs((high - low) - 0.5))
    assert worst <= 4 * math.ulp(0.5)


#: Where discs begin, metres: at some one of these a rounding may be none.
_PLACES = (-0.4, -0.3, -0.2, -0.1, 0.1, 0.2, 0.3, 0.4)


def gap_after_a_fall(x: float, wall: Chain | Disc, reach: Fraction, height: Fraction) -> Fraction:
    """Return how far a disc's rim is from a wall after its first impact there, whose circle's centre is at a height."""
    disc = Disc(position_m=(x, 1.7), velocity_m_s=(0.1, 0.4), radius_m=0.25)
    discs, walls = ([wall, disc], []) if isinstance(wall, Disc) else ([disc], [wall])
    scene = Scene(name="fall", discs=discs, walls=walls, gravity_m_s2=(0.3, -9.81), duration_s=9.0)
    px, py = map(Fraction, solve_pic(scene, max_impacts=1).final_position_m[-1].tolist())
    return abs(px**2 + (py - height) ** 2 - reach**2) / (2 * reach)


@each("inside", [True, False])
def test_a_disc_is_set_on_an_arc_of_five_hundred_kilometres_as_on_a_floor(inside: bool) -> None:
    """At the impact the gap is that of rounded coordinates of a metre, not of the arc's radius."""
    bulge, thick = Fraction(1e-6), Fraction(3, 8)  # half width and the disc's radius
    points = [(-1, 0), (1, 0)] if inside else [(1, 0), (-1, 0)]  # the arc is on the right of its way
    arc = Chain(points_m=points, bulges=[float(bulge)], half_width_m=0.125)
    size, height = (1 + bulge**2) / (2 * bulge), (1 - bulge**2) / (2 * bulge)  # of a chord of two metres
    circle = (size - thick, height) if inside else (size + thick, -height)
    assert max(gap_after_a_fall(x, arc, *circle) for x in _PLACES) < Fraction(1, 2**52)


def test_a_disc_is_set_on_an_immovable_one_of_a_thousand_kilometres_as_on_a_floor() -> None:
    """At the impact the gap is that of rounded coordinates of a metre, not of the large disc's radius."""
    size = 1e6 + 0.7
    large = Disc(position_m=(0, -size), radius_m=size, mass_kg=math.inf)
    reach = Fraction(size) + Fraction(1, 4)
    assert max(gap_after_a_fall(x, large, reach, -Fraction(size)) for x in _PLACES) < Fraction(1, 2**52)


@each("bulge", [0.25, 1e-3, 1e-6, 1e-9])
@each("inside", [True, False])
def test_a_disc_comes_to_rest_on_an_arc_of_any_radius_when_it_does_on_a_floor(bulge: float, inside: bool) -> None:
    """For a fall of half a second and e = 1/2 that is after 3/2 of a second; the last reported hop is short."""
    points = [(-1, 0), (1, 0)] if inside else [(1, 0), (-1, 0)]
    middle = -bulge if inside else bulge  # half the chord times the bulge is how far the arc's middle is from it
    disc = Disc(position_m=(0, middle + 1.25), radius_m=0.25)
    arc = Chain(points_m=points, bulges=[bulge])
    scene = Scene(name="arc", discs=[disc], walls=[arc], wall_restitution=0.5, gravity_m_s2=(0, -8), duration_s=9.0)
    run = EventDrivenRun(scene)
    assert run.advance_to(9.0) is Outcome.AT_REST
    # It rests once v^2 <= 2 g gap, with a gap of 5 units in the last place of its coordinates and radius, 3/4 m:
    # the hops that are left out take v / g + v / 2 g + ...
    assert 0.0 <= 1.5 - run.time_s <= 2.0 * math.sqrt(2.0 * 5.0 * 2.0**-52 * 0.75 / 8.0)
