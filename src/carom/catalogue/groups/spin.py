"""The group `spin`: scenes with friction and spin. The answers come from formulas or cited sources.

By default, discs have radius 1 m, mass 1 kg and inertia factor k = 1/2, so that spin and rim speed are the same number.
Answers are fractions that were computed by hand, or by formulas of the sources. `docs/theory/friction.md` derives the
law of friction. The group runs only if the user names it.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

from carom.catalogue.entry import KnownAnswer, KnownImpact, Staged
from carom.catalogue.groups.classics_walled import FLOOR, upright
from carom.catalogue.staging import build_scene
from carom.model.scene import Disc, Wall
from carom.model.trace import Vector

_CROSS = (
    "Cross, Am. J. Phys. 70 (2002) 1093: a disc that sticks leaves at v/(1 + k); a disc that slides loses f (1 + e) "
    "w_n (k: inertia factor, w_n: speed along the normal)"
)
_ALCIATORE = "Alciatore, billiards TP A.14: tan(throw) is the smaller of f and k/(1 + k) tan(cut)/(1 + e)"
_GARWIN = (
    "Garwin, Am. J. Phys. 37 (1969) 88: a superball reverses its slip: for k = 1/2, (v, w) becomes (v - 2 w, -4 v - "
    "w)/3"
)

#: Time of the first impact of most scenes, in seconds. The time is not on a boundary between steps, because there
#: rounding would decide which step detects the impact.
_FIRST_S = 0.42
#: A coefficient of friction so large that discs never slide in these scenes. PyBullet supports no larger coefficient.
_GRIP = 10.0


def _build_disc(contact: Vector, velocity: Vector, time_s: float = _FIRST_S, **fields: Any) -> Disc:
    """Return a disc that moves straight and reaches the position `contact` at `time_s`."""
    start = (contact[0] - velocity[0] * time_s, contact[1] - velocity[1] * time_s)
    return Disc(position_m=start, velocity_m_s=velocity, radius_m=1.0, **fields)


def _stage_on_floor(
    velocity: Vector, after: Vector, spin_after: Fraction | float, source: str, inertia: float = 0.5, **fields: Any
) -> Staged:
    """Build a scene in which a disc hits a level floor once."""
    disc = _build_disc((0.0, 1.0), velocity, inertia_factor=inertia)
    scene = build_scene([disc], walls=[FLOOR], duration_s=1.0, **fields)
    spin = float(spin_after)
    hit = KnownImpact(_FIRST_S, 0, -1, after, spin_first_after=spin)
    return Staged(scene, KnownAnswer(source, (hit,), 1, (after,), final_spin_rad_s=(spin,)))


def _stage_two_discs(
    normal: Vector, velocity: Vector, spin: float, after: tuple[Vector, Vector], spins_after: Vector, **fields: Any
) -> Staged:
    """Build a scene in which a spinning disc hits another disc at rest."""
    first = _build_disc((0.0, 0.0), velocity, spin_rad_s=spin)
    second = Disc(position_m=(2.0 * normal[0], 2.0 * normal[1]), radius_m=1.0)
    scene = build_scene([first, second], duration_s=1.0, **fields)
    hit = KnownImpact(_FIRST_S, 0, 1, *after, *spins_after)
    return Staged(scene, KnownAnswer(_ALCIATORE, (hit,), 1, after, final_spin_rad_s=spins_after))


def _grip() -> Staged:
    """A disc without spin hits a rough floor, and friction makes it spin as if it rolled on the floor."""
    return _stage_on_floor((3.0, -4.0), (2.0, 2.0), -2.0, _CROSS, wall_friction=2.0, wall_restitution=0.5)


def _slide() -> Staged:
    """A disc slides during its impact on a floor. Friction is a tenth of the normal impulse, so the spin is small."""
    return _stage_on_floor((3.0, -2.0), (2.7, 1.0), Fraction(-3, 5), _CROSS, wall_friction=0.1, wall_restitution=0.5)


def _edge() -> Staged:
    """A disc hits a floor exactly at the limit between sticking and sliding, where both give the same result."""
    return _stage_on_floor((0.9, -2.0), (0.6, 1.0), Fraction(-3, 5), _CROSS, wall_friction=0.1, wall_restitution=0.5)


_LEMBCKE = (
    "S. Lembcke, Chipmunk forum, 24 October 2016, on a carom striker that can't turn: v decreases by at most f (1 + "
    "e) w_n, where w_n is the speed along the normal"
)


def _striker_stick() -> Staged:
    """A striker that can't turn sticks at the cushion by friction, and loses its speed along the cushion."""
    fields = {"wall_friction": 0.6, "wall_restitution": 0.9}
    return _stage_on_floor((10.0, -10.0), (0.0, 9.0), 0.0, _LEMBCKE, math.inf, **fields)


def _striker_slide() -> Staged:
    """A striker that can't turn slides along the cushion, and its speed along the cushion falls from 10 to 4.3 m/s."""
    fields = {"wall_friction": 0.3, "wall_restitution": 0.9}
    return _stage_on_floor((10.0, -10.0), (4.3, 9.0), 0.0, _LEMBCKE, math.inf, **fields)


def _throw_slide() -> Staged:
    """In a cut shot with little friction, the object disc leaves 2.86 degrees off the line of centres."""
    after = ((42 / 25, -56 / 25), (83 / 25, 56 / 25))
    return _stage_two_discs((0.8, 0.6), (5.0, 0.0), 0.0, after, (0.4, 0.4), friction=0.05)


def _throw_stick() -> Staged:
    """In a cut shot with much friction the discs stick. The object disc leaves 7.13 degrees off the line of centres."""
    return _stage_two_discs((0.8, 0.6), (5.0, 0.0), 0.0, ((1.5, -2.0), (3.5, 2.0)), (1.0, 1.0), friction=1.0)


def _gearing() -> Staged:
    """In a cut shot, the spin makes the rims move at the same speed, so friction of any size has no effect."""
    return _stage_two_discs((0.8, 0.6), (5.0, 0.0), 3.0, ((1.8, -2.4), (3.2, 2.4)), (3.0, 0.0), friction=10.0)


def _english_stick() -> Staged:
    """A spinning disc hits another head-on: the discs stick by friction, and the struck disc is thrown sideways."""
    return _stage_two_discs((1.0, 0.0), (2.0, 0.0), 6.0, ((0.0, -1.0), (2.0, 1.0)), (4.0, -2.0), friction=10.0)


def _english_slide() -> Staged:
    """A spinning disc hits another head-on: the discs slide, and friction throws the struck disc sideways a little."""
    return _stage_two_discs((1.0, 0.0), (2.0, 0.0), 6.0, ((0.0, -0.2), (2.0, 0.2)), (5.6, -0.4), friction=0.1)


def _stage_between_plates(
    states: list[tuple[float, float]], along: float, across: float, gap: float, source: str, **fields: Any
) -> Staged:
    """Build a scene with a disc between two elastic plates. `states` contains speed and spin after each impact."""
    flight = gap / across
    walls = [FLOOR, Wall(point_m=(0.0, 2.0 + gap), normal=(0.0, -1.0))]
    start = Disc(position_m=(0.0, 1.0 + gap / 2), velocity_m_s=(along, -across), radius_m=1.0)
    first_s = gap / 2 / across
    duration_s = first_s + (len(states) - 0.5) * flight
    scene = build_scene([start], walls=walls, wall_friction=_GRIP, duration_s=duration_s, **fields)
    impacts, x, last_impact_s, speed = [], 0.0, 0.0, along
    for n, (v, w) in enumerate(states):
        time = first_s + n * flight
        x, last_impact_s, speed = x + speed * (time - last_impact_s), time, v
        impacts.append(KnownImpact(time, 0, -1 - n % 2, (v, (across, -across)[n % 2]), spin_first_after=w))
    left = duration_s - last_impact_s
    up = (across, -across)[(len(states) - 1) % 2]
    y = (1.0, 1.0 + gap)[(len(states) - 1) % 2] + up * left
    end = ((states[-1][0], up),)
    known = KnownAnswer(source, tuple(impacts), len(states), end, ((x + speed * left, y),))
    return Staged(scene, known)


def _plates() -> Staged:
    """A disc bounces between two rough plates. At every bounce its speed along the plates falls to a third."""
    states = [(2.0 / 3.0**n, (-2.0, 2.0)[n % 2] / 3.0**n) for n in range(5)]
    source = f"{_CROSS}; a disc that rolls on one plate slips at 2 v on the other plate, so v' = v (1 - k)/(1 + k)"
    return _stage_between_plates(states, 3.0, 2.0, 0.937, source)


def _bounce_to_roll() -> Staged:
    """A disc thrown along a floor slides at three bounces, sticks at the fourth, and finally rolls on the floor."""
    pull, drop = 2.0, 0.25  # the first impact is after half a second, at 1 m/s; later flights take 1/2 s, 1/4 s, ...
    disc = Disc(position_m=(0.0, 1.0 + drop), velocity_m_s=(2.0, 0.0), radius_m=1.0)
    scene = build_scene([disc], walls=[FLOOR], wall_friction=0.25, wall_restitution=0.5, pull=pull, duration_s=2.0)
    along = [Fraction(13, 8), Fraction(23, 16), Fraction(43, 32), *[Fraction(4, 3)] * 5]
    spins = [Fraction(-3, 4), Fraction(-9, 8), Fraction(-21, 16), *[Fraction(-4, 3)] * 5]
    impacts = [
        KnownImpact(1.5 - 0.5**n, 0, -1, (float(v), 0.5 ** (n + 1)), spin_first_after=float(w))
        for n, (v, w) in enumerate(zip(along, spins, strict=True))
    ]
    source = f"{_CROSS}, at impact speeds 1, 1/2, 1/4, ... m/s; all bounces end at 1.5 s"
    return Staged(scene, KnownAnswer(source, tuple(impacts), None, ((4 / 3, 0.0),), final_spin_rad_s=(-4 / 3,)))


def _compute_superball_states(states: int) -> list[tuple[float, float]]:
    """Return speed and spin (v, w) after each impact of a superball that is thrown under a table at 1 m/s."""
    v, w = Fraction(1), Fraction(0)
    found = []
    for n in range(states):
        side = -1 if n % 2 else 1  # the table acts like a floor upside down, so spins change their sign
        v, w = (v - side * 2 * w) / 3, (-side * 4 * v - w) / 3
        found.append((float(v), float(w)))
    return found


def _superball_table() -> Staged:
    """A superball is thrown under a table. The ball bounces off floor, table and floor, and comes back to the hand."""
    return _stage_between_plates(_compute_superball_states(3), 1.0, 2.0, 1.0, _GARWIN, wall_tangential_restitution=1.0)


def _superball_hop() -> Staged:
    """A superball whose rim speed is twice its speed hops to and fro between two spots for ever."""
    # The first impact is after half a second, at 4 m/s. Each flight takes a second.
    pull, drop, duration = 8.0, 1.0, 2.75
    disc = Disc(position_m=(-0.5, 1.0 + drop), velocity_m_s=(1.0, 0.0), radius_m=1.0, spin_rad_s=2.0)
    laws = {"wall_friction": _GRIP, "wall_tangential_restitution": 1.0, "pull": pull}
    scene = build_scene([disc], walls=[FLOOR], duration_s=duration, **laws)
    signs = (-1.0, 1.0, -1.0)
    impacts = [KnownImpact(0.5 + n, 0, -1, (sign, 4.0), spin_first_after=2.0 * sign) for n, sign in enumerate(signs)]
    left = duration - impacts[-1].time_s
    # The spots are x = 0, where the ball first lands, and x = -1, because the ball leaves the first spot to the left.
    end = (-left, 1.0 + 4.0 * left - pull * left * left / 2)
    velocity = (-1.0, 4.0 - pull * left)
    return Staged(scene, KnownAnswer(_GARWIN, tuple(impacts), 3, (velocity,), (end,), final_spin_rad_s=(-2.0,)))


def _strip() -> Staged:
    """A superball bounces 500 times between two plates. The ball moves to and fro and never escapes."""
    turn, rounds = math.acos(-7 / 9), 250
    states = []
    for n in range(rounds):
        v, w = math.cos(n * turn), math.sin(n * turn) * math.sqrt(2.0)
        next_state = (math.cos((n + 1) * turn), math.sin((n + 1) * turn) * math.sqrt(2.0))
        states += [((v - 2 * w) / 3, (-4 * v - w) / 3), next_state]
    source = (
        "Broomhead & Gutkin, Physica D 67 (1993) 188: two impacts rotate (v, sqrt(k) R w) by the angle whose cosine is "
        "((1 - k)^2 - 4 k)/(1 + k)^2 = -7/9"
    )
    return _stage_between_plates(states, 1.0, 4.0, 0.02, source, wall_tangential_restitution=1.0)


def _corner() -> Staged:
    """A disc meets both walls of a right-angled corner at once. With friction, the order of the walls has an effect."""
    walls = [FLOOR, upright(0.0, 1)]
    scene = build_scene([_build_disc((1.0, 1.0), (-3.0, -2.0))], walls=walls, wall_friction=0.25, duration_s=1.0)
    # The side wall has the lower number, so its impact is applied first. The wall's friction could change the velocity
    # by up to 6/4 m/s, but a change of 2/3 m/s already ends the sliding.
    impacts = (
        KnownImpact(_FIRST_S, 0, -2, (3.0, -4 / 3), spin_first_after=-4 / 3),
        KnownImpact(_FIRST_S, 0, -1, (22 / 9, 4 / 3), spin_first_after=-22 / 9),
    )
    convention = (
        "the disc hits both walls at one instant, and with friction the order matters. If the side wall is first, the "
        "disc leaves at (22/9, 4/3) m/s and -22/9 rad/s. If the floor is first, the disc leaves at (2, 2) m/s and 2 "
        "rad/s. Here the side wall is first, because impacts are ordered by (time, first, second)"
    )
    known = KnownAnswer(_CROSS, impacts, 2, ((22 / 9, 4 / 3),), final_spin_rad_s=(-22 / 9,), convention=convention)
    return Staged(scene, known)
