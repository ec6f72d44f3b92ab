"""The group `tables`: scenes with walls that end, have corners, or are curved. Formulas give the answers.

Many bug reports are about such walls. `docs/theory/walls.md` derives the surface that discs hit. The group runs only if
the user names it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

from carom.catalogue.closed_forms import compute_after_wall, compute_fall, compute_wedge_impacts, unit
from carom.catalogue.entry import KnownAnswer, Staged
from carom.catalogue.groups.classics_walled import edges, stage_in_room
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, stage, stage_at_wall, to_vector
from carom.model.scene import Chain, Ring

_LAW = "Newton's law: an impact reverses the velocity along the normal"
_BUNIMOVICH = "Bunimovich, Comm. Math. Phys. 65 (1979) 295: the stadium"
_CROSSING = "the time from wall to wall is their distance divided by the speed"
_CHORDS = "All chords of the path subtend the same angle at the circle's centre"


def _build_stadium() -> Chain:
    """Return a stadium: straight sides of 4 m, and half circles of radius 2 m."""
    return edges(-2 - 2j, 2 - 2j, 2 + 2j, -2 + 2j, bulges=(0.0, 1.0, 0.0, 1.0), closed=True)


def _stage_around_polygon(
    places: Sequence[complex], speed: float, radius: float, wall: Chain | Ring, source: str
) -> Staged:
    """Build a scene in which a disc moves along a polygon, from the middle of a side, and meets a wall at each corner.

    At each impact, the velocity gets the direction of the polygon's next side, so no equation has to be solved.
    """
    sides = [later - place for place, later in zip(places, (*places[1:], places[0]), strict=True)]
    begin, duration = places[0] - sides[-1] / 2, abs(sides[-1]) / 2
    impacts = []
    for side in sides:
        impacts.append(build_impact(duration / speed, 0, -1, speed * unit(side)))
        duration += abs(side)
    discs = [build_disc(begin, speed * unit(sides[-1]), radius)]
    return stage(discs, impacts, source, walls=[wall], duration_s=duration / speed * 0.999)


def _bullet() -> Staged:
    """A disc with a radius of a millimetre meets a wall without thickness at a million metres per second."""
    discs, walls = [build_disc(-10 + 0.125j, 1e6, 1e-3)], [edges(-1j, 1j)]
    scene = build_scene(discs, walls=walls, duration_s=1e-3, frame_rate_hz=1e4)
    return build_staged(scene, [build_impact(9.999 / 1e6, 0, -1, -1e6)], f"{_LAW}; the path is 10 m less the radius")


def _stage_at_wall_end(offset: float) -> Staged:
    """Build a scene in which a disc flies to a wall's upper end.

    The disc's centre is `offset` radii higher than the end.
    """
    radius, speed, time = 0.25, 3.0, 0.51
    normal = complex(-math.sqrt(max(1.0 - offset * offset, 0.0)), offset)  # points from the end to the centre
    start = complex(0.0, radius * offset) + radius * normal.real - speed * time
    scene = build_scene([build_disc(start, speed, radius)], walls=[edges(-1j, 0)], duration_s=1.5)
    after = speed * complex(2.0 * offset**2 - 1.0, 2.0 * offset * math.sqrt(max(1.0 - offset**2, 0.0)))
    hits = [build_impact(time, 0, -1, after)] if offset < 1.0 else []
    formula = "after an impact at offset s, the velocity is (2 s^2 - 1, 2 s sqrt(1 - s^2)) times the speed"
    return build_staged(scene, hits, f"The normal points from the wall's end to the disc's centre; {formula}")


def _end_of_wall() -> Staged:
    """A disc meets the end of a thin wall off centre, and is deflected."""
    return _stage_at_wall_end(0.6)


def _end_grazed() -> Staged:
    """A disc grazes the end of a thin wall, and is deflected by 36 degrees."""
    return _stage_at_wall_end(0.95)


def _end_missed() -> Staged:
    """A disc flies past the end of a wall at a distance of a billionth of its radius, and meets nothing."""
    return _stage_at_wall_end(1.0 + 1e-9)


def _stage_in_corner(restitution: float) -> Staged:
    # Floats represent these numbers exactly, so that the disc meets both sides at exactly the same time.
    radius, velocity, time = 0.5, -1 - 1.5j, 65 / 64
    discs = [build_disc(complex(radius, radius) - velocity * time, velocity, radius)]
    after_first = compute_after_wall(velocity, 1j, restitution)
    impacts = [
        build_impact(time, 0, -1, after_first),
        build_impact(time, 0, -1, compute_after_wall(after_first, 1, restitution)),
    ]
    source = f"{_LAW}: both sides of a right angle together reverse a velocity, whichever side is first"
    return stage(discs, impacts, source, walls=[edges(9, 0, 9j)], wall_restitution=restitution, duration_s=2.5)


def _corner_at_once() -> Staged:
    """A disc meets both sides of a right-angled corner at one instant, and returns along its path."""
    return _stage_in_corner(1.0)


def _corner_with_losses() -> Staged:
    """A disc meets both sides of a right-angled corner at one instant, and loses the same fraction of speed at both."""
    return _stage_in_corner(0.6)


def _stage_in_wedge(degrees: float, start: complex, velocity: complex) -> Staged:
    """Build a scene with a disc in a wedge. `start` is relative to the apex of the wedge in which the centre moves."""
    angle, radius = math.radians(degrees), 0.125
    apex = radius * complex(1.0 / math.tan(angle / 2.0), 1.0)
    walls = [edges(64, 0, 64 * cmath.exp(1j * angle))]
    hits = compute_wedge_impacts(start, velocity, angle)
    duration = hits[-1].time_s * 1.1
    scene = build_scene([build_disc(apex + start, velocity, radius)], walls=walls, duration_s=duration)
    source = (
        "Unfolding: if impacts mirror the wedge and not the path, the path is straight (Tabachnikov, Geometry and "
        "Billiards, 2005)"
    )
    return build_staged(scene, [build_impact(hit.time_s, 0, -1, hit.velocity) for hit in hits], source)


def _wedge_of_sixty() -> Staged:
    """A disc thrown into a corner of 60 degrees has three impacts, and the order of the first two matters."""
    return _stage_in_wedge(60.0, 4 + 1j, -2 + 0.3j)


def _corner_of_forty_five() -> Staged:
    """A disc that meets both sides of a 45-degree corner at one instant returns along its path after four impacts."""
    radius, velocity, time = 0.25, 1.5 * cmath.exp(-0.9j * math.pi), 0.75
    apex = radius * complex(1.0 + math.sqrt(2.0), 1.0)
    walls = [edges(8, 0, 8 + 8j)]
    scene = build_scene([build_disc(apex - velocity * time, velocity, radius)], walls=walls, duration_s=2 * time)
    source = (
        "Reflections in two lines at an angle of pi/n form a group with 2 n elements. For even n a disc leaves the "
        "apex in the direction from which it came, whichever side it meets first"
    )
    end = (to_vector(apex - velocity * time),)
    return Staged(scene, KnownAnswer(source, count=4, final_velocity_m_s=(to_vector(-velocity),), final_position_m=end))


def _wedge_of_twelve() -> Staged:
    """A disc is thrown into a corner of 12 degrees, and comes out after 180/12 = 15 impacts."""
    return _stage_in_wedge(12.0, 5 + 0.4j, -2 + 0.2j)


def _star() -> Staged:
    """A disc in a circular container draws a five-pointed star for ever."""
    rho, radius = 1.0, 0.25
    places = [rho * cmath.exp(1j * math.tau * 2 * k / 5) for k in range(5)]
    return _stage_around_polygon(places, 1.5, radius, Ring(centre_m=(0, 0), radius_m=rho + radius), _CHORDS)


def _whispering_gallery() -> Staged:
    """A disc meets a circular wall at an angle of 0.001 radians: a hundred impacts on 12 degrees of the circle."""
    rho, radius, delta, count = 1.0, 0.25, 1e-3, 100
    velocity, chord = cmath.exp(1j * (math.pi / 2.0 + delta)), 2.0 * rho * math.sin(delta)
    discs = [build_disc(rho, complex(-math.sin(delta), math.cos(delta)), radius)]
    walls, duration = [Ring(centre_m=(0, 0), radius_m=rho + radius)], (count + 0.5) * chord
    # There are six frames between two impacts.
    scene = build_scene(discs, walls=walls, duration_s=duration, frame_rate_hz=3000.0)
    impacts = [build_impact(k * chord, 0, -1, velocity * cmath.exp(2j * delta * k)) for k in range(1, count + 1)]
    return build_staged(scene, impacts, f"{_CHORDS}; a chord at the angle a to a circle of radius r is 2 r sin(a) long")


def _stadium_across() -> Staged:
    """A disc bounces between the straight sides of a stadium."""
    return _stage_to_and_fro(0.5, 1j, 1.5)


def _stadium_along() -> Staged:
    """A disc bounces along the axis of a stadium, between the middles of its arcs."""
    return _stage_to_and_fro(0, 1, 3.5)


def _stage_to_and_fro(start: complex, velocity: complex, half_crossing_s: float) -> Staged:
    count = 8
    discs, duration = [build_disc(start, velocity, 0.5)], half_crossing_s * (2 * count)
    impacts = [build_impact(half_crossing_s * (2 * k + 1), 0, -1, velocity * (-1) ** (k + 1)) for k in range(count)]
    return stage(discs, impacts, f"{_BUNIMOVICH}; {_CROSSING}", walls=[_build_stadium()], duration_s=duration)


def _stadium_rhombus() -> Staged:
    """A disc moves along a rhombus in a stadium. Each impact on an arc increases errors of the disc's position."""
    return _stage_around_polygon([-1.5j, 3.5, 1.5j, -3.5], 1.25, 0.5, _build_stadium(), _BUNIMOVICH)


def _two_posts() -> Staged:
    """A disc bounces between two round posts. If the disc is off their axis, each impact deflects the disc more."""
    posts = [Ring(centre_m=(x, 0.0), radius_m=0.75) for x in (3.0, -3.0)]
    scene = build_scene([build_disc(0, 1, 0.25)], walls=posts, duration_s=24.0)
    impacts = [build_impact(2.0 + 4.0 * k, 0, -1 - k % 2, complex(-((-1) ** k))) for k in range(6)]
    return build_staged(scene, impacts, f"Sinai, Russ. Math. Surv. 25 (1970) 137; {_CROSSING}")


def _three_posts() -> Staged:
    """A disc moves along a triangle between three round posts. An error of position grows twelvefold at each impact."""
    centres = [6.0 / math.sqrt(3.0) * cmath.exp(1j * math.pi * (1 / 2 + 2 * k / 3)) for k in range(3)]
    # At contact, the disc is 1 m (the sum of both radii) from the post's centre, towards the middle of the triangle.
    places = [centre - unit(centre) for centre in centres]
    side = 6.0 - math.sqrt(3.0)
    begin, direction = (places[0] + places[1]) / 2, unit(places[1] - places[0])
    turn = cmath.exp(2j * math.pi / 3)
    impacts = [build_impact(side * (k + 0.5), 0, -1 - (k + 1) % 3, direction * turn ** (k + 1)) for k in range(3)]
    walls = [Ring(centre_m=to_vector(centre), radius_m=0.75) for centre in centres]
    source = (
        "Cvitanovic et al., ChaosBook: for posts of radius 1 at a distance of 6, the triangle's side is 6 - sqrt(3)"
    )
    return stage([build_disc(begin, direction, 0.25)], impacts, source, walls=walls, duration_s=side * 3)


def _box_of_edges() -> Staged:
    """A disc bounces in a box whose walls are four edges of finite length."""
    return stage_in_room(1.109375 + 0.765625j, 1.71875 + 0.6328125j, 0.25, 5.0, 3.0, 60.0)


def _fagnano() -> Staged:
    """A disc moves along the shortest closed path in an equilateral triangle, from middle to middle of its sides."""
    side, radius = 6.0, 0.25
    inner = side - 2.0 * math.sqrt(3.0) * radius  # length of a side of the triangle in which the centre moves
    middle = complex(side / 2.0, side / (2.0 * math.sqrt(3.0)))
    # The middles of the triangle's sides: below, to the upper right, to the upper left.
    half, turns = inner / (2.0 * math.sqrt(3.0)), (1j * math.pi * (-1 / 2 + 2 * k / 3) for k in range(3))
    places = [middle + half * cmath.exp(turn) for turn in turns]
    wall = edges(0, side, side * cmath.exp(1j * math.pi / 3), closed=True)
    source = "Fagnano, 1775: the shortest closed path connects the feet of the triangle's altitudes"
    return _stage_around_polygon(places, 1.0, radius, wall, source)


def _seam() -> Staged:
    """A disc glances off a floor of ten pieces in one line.

    The disc has only one impact, because it does not bump into the joints.
    """
    source, floor = f"{_LAW}; a floor in pieces acts like one floor", edges(-5, 5, pieces=10)
    return stage_at_wall(5 - 2j, 0.25, 1j, [floor], source, point=0.0625, time_s=0.51, duration_s=1.25)


def _peg() -> Staged:
    """A disc falls on a round peg a little off centre, as in the first row of Galton's board."""
    offset, height, reach, pull = 0.1, 2.0, 0.3, 10.0
    normal = complex(offset, math.sqrt(reach**2 - offset**2)) / reach
    time = math.sqrt(2.0 * (height - reach * normal.imag) / pull)
    after = compute_after_wall(-1j * pull * time, normal)
    duration = time + 0.2
    walls = [Ring(centre_m=(0, 0), radius_m=0.0, half_width_m=0.05)]
    scene = build_scene([build_disc(complex(offset, height), 0, 0.25)], walls=walls, pull=pull, duration_s=duration)
    left = duration - time
    end = compute_fall(reach * normal, after, left, -1j * pull)
    source = "Free fall to the circle that the centre can't enter; Newton's law at this circle"
    return build_staged(scene, [build_impact(time, 0, -1, after)], source, final=[end])


def _bowl() -> Staged:
    """A disc falls straight to the bottom of a round container, and rises to the same height each time."""
    pull, height = 8.0, 3.0
    fall, speed, count = math.sqrt(2.0 * height / pull), math.sqrt(2.0 * height * pull), 3
    discs = [build_disc(1j, 0, 0.25)]
    scene = build_scene(discs, walls=[Ring(centre_m=(0, 0), radius_m=2.25)], pull=pull, duration_s=2.0 * count * fall)
    impacts = tuple(build_impact((2 * k - 1) * fall, 0, -1, 1j * speed) for k in range(1, count + 1))
    source = "Galileo: the first fall takes sqrt(2 h / g), and each flight takes twice as long"
    return Staged(scene, KnownAnswer(source, impacts, count))
