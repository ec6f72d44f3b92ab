"""Runs under gravity: hops that are about as low as the accuracy of a gap, and rest."""

import math

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at

from carom import Chain, Outcome, Scene, solve_pic
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
