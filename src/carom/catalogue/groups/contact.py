"""Scenes of the group `contact` in which discs slide, roll, rest or slow down. Formulas give the answers.

Sliding, rolling and resting follow Coulomb's law; see `docs/theory/contact.md`. The group runs only if the user names
it.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from carom.catalogue.entry import KnownAnswer, KnownImpact, Staged
from carom.catalogue.groups.classics_walled import FLOOR, edges, upright
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged
from carom.model.scene import Disc, Wall
from carom.model.trace import Vector, wall_body

# Discs that gravity presses on a wall --------------------------------------------------------------------------------

_RADIUS_M, _G = 0.5, 10.0
_ROLLING = (
    "Rolling resistance is a torque of at most c P R (P: contact force, R: radius), so u' = -c g/(1 + k) for a disc of "
    "inertia factor k; Ai et al., Powder Technol. 206 (2011) 269, model A"
)
_COULOMB = (
    "Coulomb's law: friction is f times the contact force while a disc slips, and at most that while the disc rolls"
)


_build_floor_scene = partial(build_scene, walls=[FLOOR], pull=_G, wall_restitution=0.0)


def _stage_on_wall(
    source: str,
    answer: tuple[float, float, float],
    duration_s: float,
    *,
    fall: float = 0.0,
    along: float = 0.0,
    rim: float = 0.0,
    into: float = 0.0,
    up: float = 0.0,
    count: int | None = 0,
    inertia: float = 0.5,
    **laws: Any,
) -> Staged:
    """Build a scene with a disc on a wall through the origin that slopes down to the right.

    Args:
        source: Source of the answer.
        answer: Position along the wall, speed and rim speed at the end, in metres and metres per second.
        duration_s: Duration of the scene.
        fall: Tangent of the wall's slope. Slopes with a rational sine and cosine have rational answers.
        along: Speed along the wall at the start.
        rim: Rim speed (spin times radius) at the start, counterclockwise.
        into: Speed towards the wall at the start.
        up: Height at the start, in metres.
        count: Number of impacts.
        inertia: Inertia factor of the disc.
        laws: Coefficients of the wall, such as restitution and friction; by default the restitution is 0.
    """
    nx, ny = fall / math.hypot(1.0, fall), 1.0 / math.hypot(1.0, fall)

    def at(tangential: float, off: float) -> Vector:
        return (tangential * ny + off * nx, off * ny - tangential * nx)

    start = {"position_m": at(0.0, _RADIUS_M + up), "velocity_m_s": at(along, -into)}
    body = Disc(**start, radius_m=_RADIUS_M, spin_rad_s=rim / _RADIUS_M, inertia_factor=inertia)
    wall = Wall(point_m=(0.0, 0.0), normal=(nx, ny))
    laws = {"wall_restitution": 0.0, **laws}
    scene = build_scene([body], walls=[wall], pull=_G, duration_s=duration_s, **laws)
    spins = (answer[2] / _RADIUS_M,) if scene.arrays.turns else None
    place, velocity = (at(answer[0], _RADIUS_M),), (at(answer[1], 0.0),)
    return Staged(scene, KnownAnswer(source, (), count, velocity, place, final_spin_rad_s=spins))


def _drop() -> Staged:
    """A ball that falls and moves sideways bounces infinitely often until 3/sqrt(5) s, and then slides."""
    source = "Geometric series: if the first fall takes the time t, all bounces end at the time t (1 + e)/(1 - e)"
    return _stage_on_wall(source, (4.0, 1.0, 0.0), 4.0, along=1.0, up=1.0, count=None, wall_restitution=0.5)


def _bounce_to_roll() -> Staged:
    """A disc bounces infinitely often, stops slipping at its fourth bounce, and rolls after 1/5 s."""
    source = (
        "Geometric series: the disc slides in the first bounces and sticks by friction in the others; see "
        "docs/theory/contact.md"
    )
    answer = (1157 / 3840 + 4 / 3, 4 / 3, -4 / 3)
    laws: dict[str, Any] = {"wall_restitution": 0.5, "wall_friction": 0.25}
    return _stage_on_wall(source, answer, 1.2, along=2.0, into=1.0, count=None, **laws)


def _lands_sliding() -> Staged:
    """A disc still slips after infinitely many sliding bounces. The disc then slides, and rolls after 19/10 s."""
    source = "Geometric series: the disc slides in all bounces; see docs/theory/contact.md"
    slides = 57 / 10 * 17 / 10 - 17 / 10 * 17 / 10 / 2
    answer = (29 / 25 + slides + 4.0, 4.0, -4.0)
    return _stage_on_wall(source, answer, 2.9, along=6.0, into=1.0, count=None, wall_restitution=0.5, wall_friction=0.1)


def _between_thresholds() -> Staged:
    """A disc that bounces down a slope still slips when the bounces end, and rolls only after 3/8 s."""
    source = (
        "Slip ends during bounces on slopes up to f (1 + 1/k)(1 + e)/2 = 0.675, and in lasting contact on slopes up to "
        "f (1 + 1/k) = 0.9; this slope is 0.75"
    )
    rolled, rolling_s = 11 / 40 + 31 / 20 / 8 + 36 / 10 / 128, 1.0
    answer = (rolled + 2 * rolling_s + 4 * rolling_s**2 / 2, 2.0 + 4 * rolling_s, -2.0 - 4 * rolling_s)
    fields = {"fall": 0.75, "along": 0.75, "into": 1.0, "wall_restitution": 0.5, "wall_friction": 0.3}
    return _stage_on_wall(source, answer, 0.375 + rolling_s, count=None, **fields)


def _slide_to_roll() -> Staged:
    """A disc that slides at first rolls after 1/2 s, at two thirds of its initial speed."""
    return _stage_on_wall(_COULOMB, (17 / 4, 2.0, -2.0), 2.0, along=3.0, wall_friction=0.2)


def _sphere_slides_to_roll() -> Staged:
    """A sphere that slides at first keeps five sevenths of its speed, like a billiard ball."""
    answer = (3 * 3 / 7 - 9 / 49 + 15 / 7 * (2 - 3 / 7), 15 / 7, -15 / 7)
    return _stage_on_wall(_COULOMB, answer, 2.0, along=3.0, inertia=0.4, wall_friction=0.2)


def _comes_back() -> Staged:
    """A disc with much backspin reverses its motion after 1/4 m, and rolls back from 1 s on."""
    return _stage_on_wall(_COULOMB, (-1.0, -1.0, 1.0), 2.0, along=1.0, rim=5.0, wall_friction=0.2)


def _incline_rolls() -> Staged:
    """A disc is released on a slope and rolls, at two thirds of gravity's acceleration along the slope."""
    return _stage_on_wall(_COULOMB, (2.0, 4.0, -4.0), 1.0, fall=0.75, wall_friction=0.3)


def _incline_slips() -> Staged:
    """On a slope with too little friction for rolling, a disc slips from the start, faster and faster."""
    return _stage_on_wall(_COULOMB, (11 / 5, 22 / 5, -16 / 5), 1.0, fall=0.75, wall_friction=0.2)


def _incline_edge() -> Staged:
    """On a slope with just enough friction for rolling, a slipping disc moves like a rolling disc."""
    return _stage_on_wall(_COULOMB, (2.0, 4.0, -4.0), 1.0, fall=0.75, wall_friction=0.25)


def _stops() -> Staged:
    """A disc that does not turn slides until it stops, after the distance v^2/(2 f g)."""
    return _stage_on_wall(_COULOMB, (1.5, 0.0, 0.0), 5.0, along=3.0, inertia=math.inf, wall_friction=0.3)


def _holds() -> Staged:
    """A disc that does not turn stays at rest on a slope below its angle of friction."""
    return _stage_on_wall(_COULOMB, (0.0, 0.0, 0.0), 5.0, fall=0.75, inertia=math.inf, wall_friction=0.8)


def _rolling_resistance() -> Staged:
    """A disc that rolls on a floor with rolling resistance stops after 5/2 s and 5/4 m."""
    laws: dict[str, Any] = {"wall_friction": 0.3, "wall_rolling_resistance": 3 / 50}
    return _stage_on_wall(_ROLLING, (5 / 4, 0.0, 0.0), 5.0, along=1.0, rim=-1.0, **laws)


def _rolling_resistance_holds() -> Staged:
    """A disc does not begin to roll on a slope whose tangent is below the coefficient of rolling resistance."""
    return _stage_on_wall(_ROLLING, (0.0, 0.0, 0.0), 5.0, fall=0.75, wall_friction=0.8, wall_rolling_resistance=0.76)


def _rolling_resistance_on_a_slope() -> Staged:
    """A disc rolls down a slope, and rolling resistance reduces its acceleration."""
    source = f"{_ROLLING}; on a slope of angle a, u' = (g sin a - c g cos a)/(1 + k)"
    return _stage_on_wall(source, (1.2, 2.4, -2.4), 1.0, fall=0.75, wall_friction=0.8, wall_rolling_resistance=0.3)


def _block() -> Staged:
    """Rolling resistance exceeds friction, so a disc slides without turning, and stops like a block."""
    laws: dict[str, Any] = {"wall_friction": 0.3, "wall_rolling_resistance": 0.4}
    return _stage_on_wall(_ROLLING, (1.5, 0.0, 0.0), 5.0, along=3.0, **laws)


def _lands_rolling() -> Staged:
    """A disc lands rolling, and rolling resistance slows the disc at each bounce and afterwards, until it stops."""
    e, w, c, k = 0.5, 1.0, 0.06, 0.5
    along, lost_speed = 2.0, c * (1 + e) * w / (1 - e) / (1 + k)
    ways = [2.0 / _G * w * e**n * (along - lost_speed * (1 - e**n)) for n in range(1, 70)]
    landed = along - lost_speed
    distance_m = math.fsum(ways) + landed * landed * (1 + k) / (2 * c * _G)
    source = (
        "Geometric series of the bounces; then the disc stops after v^2 (1 + k)/(2 c g) metres: docs/theory/contact.md"
    )
    laws: dict[str, Any] = {"wall_restitution": e, "wall_friction": 0.3, "wall_rolling_resistance": c}
    return _stage_on_wall(source, (distance_m, 0.0, 0.0), 6.0, along=along, rim=-along, into=w, count=None, **laws)


def _struck() -> Staged:
    """A rolling disc strikes an equal disc at rest, stops, and then follows the other disc, like a billiard ball."""
    discs = [build_disc(0.5j, 3, 0.5, spin_rad_s=-6.0), build_disc(2 + 0.5j, 0, 0.5)]
    scene = _build_floor_scene(discs, wall_friction=0.2, duration_s=3.0)
    source = f"{_COULOMB}; the impact exchanges the velocities and keeps the spins"
    final = [(41 / 12 + 0.5j, 1), (91 / 12 + 0.5j, 2)]
    return build_staged(scene, [build_impact(1 / 3, 0, 1, 0, 3, -6.0, 0.0)], source, final=final, spins=(-2.0, -4.0))


def _edge() -> Staged:
    """A disc rolls over the end of an edge at 3 m/s, so fast that it flies off instead of turning about the end."""
    speed, end, duration = 3.0, 1.0, 1.0
    flight_s = duration - end / speed
    discs = [build_disc(complex(0.0, _RADIUS_M), speed, _RADIUS_M, spin_rad_s=-6.0)]
    scene = _build_floor_scene(discs, walls=[edges(-5, end)], wall_friction=0.5, duration_s=duration)
    source = "Galileo: the disc flies on a parabola; at u^2 = 9 > g R = 5 a disc can't turn about the end of the edge"
    end_state = complex(speed * duration, _RADIUS_M - _G * flight_s * flight_s / 2), complex(speed, -_G * flight_s)
    return build_staged(scene, [], source, final=[end_state], spins=(-6.0,))


def _pressed() -> Staged:
    """A disc falls onto a disc that rests on the floor. The order of impacts decides whether the disc leaves again."""
    discs = [build_disc(0.5j, 0, 0.5), build_disc(1.7j, 0, 0.5)]
    scene = _build_floor_scene(discs, restitution=0.5, duration_s=1.0)
    impacts = (KnownImpact(0.2, 0, 1, (0.0, -1.5), (0.0, -0.5)), KnownImpact(0.2, 0, wall_body(0), (0.0, 0.0)))
    convention = (
        "If impacts are applied one after the other, each pair of impacts leaves a quarter of the speed, so both discs "
        "end at rest. If all impacts are applied at once, as in engines, the upper disc leaves at 1 m/s. Here impacts "
        "are applied one after the other"
    )
    known = KnownAnswer("Newton's law of restitution, one impact after the other", impacts, convention=convention)
    return Staged(scene, known)


def _stage_in_corner(spin: float, source: str, place_m: float, speed: float, after: float | None) -> Staged:
    discs = [build_disc(0.5 + 0.5j, 0, 0.5, spin_rad_s=spin)]
    walls = [FLOOR, upright(0.0, 1)]
    scene = _build_floor_scene(discs, walls=walls, wall_friction=0.25, duration_s=3.0)
    spins = None if after is None else (after,)
    return build_staged(scene, [], source, final=[(complex(place_m, 0.5), speed)], spins=spins)


def _corner() -> Staged:
    """A disc spins in a corner of floor and wall, and its centre stays there. PIC can't compute contact in a corner."""
    source = (
        "Irodov, Problems in General Physics: the spin decreases at the rate f (1 + f)/(1 + f^2) g/(k R), and is 0 "
        "after 17/10 s and 17 rad; the centre stays at rest"
    )
    return _stage_in_corner(20.0, source, 0.5, 0.0, None)


def _out_of_a_corner() -> Staged:
    """A disc in a corner spins so that friction drives it out of the corner, and it rolls after 4/3 s."""
    slides, speed = 4 / 3, 10 / 3
    distance_m = 0.5 + 2.5 * slides * slides / 2 + speed * (3.0 - slides)
    return _stage_in_corner(-20.0, _COULOMB, distance_m, speed, -2.0 * speed)


# On a table -----------------------------------------------------------------------------------------------------------


def _table_stop() -> Staged:
    """A table decelerates a disc by 4/10 m/s2, and the disc stops after 5/2 s and 5/4 m."""
    scene = build_scene([build_disc(0, 0.8 + 0.6j, 0.25)], table_deceleration_m_s2=0.4, duration_s=4.0)
    return build_staged(scene, [], "Galileo: the distance is v^2/(2 a)", final=[(1 + 0.75j, 0)])


def _table_pair() -> Staged:
    """A disc slides 3/2 m, hits an equal disc at rest and passes its velocity on. The other disc stops after 1/2 m."""
    discs = [build_disc(0, 2, 0.25), build_disc(2, 0, 0.25)]
    scene = build_scene(discs, table_deceleration_m_s2=1.0, duration_s=3.0)
    source = "Galileo: each distance s reduces v^2 by 2 a s; equal elastic discs exchange velocities"
    return build_staged(scene, [build_impact(1.0, 0, 1, 0, 1)], source, final=[(1.5, 0), (2.5, 0)])
