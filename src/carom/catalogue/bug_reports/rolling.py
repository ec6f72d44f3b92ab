"""Bug reports about friction: spin at impacts, bodies that never stop, and bodies that creep instead of resting."""

from __future__ import annotations

import math

from carom.catalogue.entry import KnownAnswer, KnownImpact, Staged
from carom.catalogue.groups.classics_walled import FLOOR
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged
from carom.model.scene import Disc
from carom.model.trace import Vector

_SPHERE = 0.4
_LAW = (
    "Coulomb's law with the coefficient c of rolling resistance: a rolling disc of inertia factor k slows down by v' = "
    "-c g/(1 + k)"
)

#: Time of the impacts with friction, in seconds.
_HIT_S = 0.25


def mbsim_49() -> Staged:
    """A disc without spin bounces on a rough floor. After the impact, the disc spins as if it rolled on the floor."""
    radius, along, down, restitution, k = 0.5, 1.0, 2.0, 0.5, 0.5
    start = Disc(position_m=(0.0, radius + down * _HIT_S), velocity_m_s=(along, -down), radius_m=radius)
    scene = build_scene([start], walls=[FLOOR], wall_friction=0.5, wall_restitution=restitution, duration_s=2 * _HIT_S)
    after = (along / (1 + k), restitution * down)
    spin = -after[0] / radius
    hit = KnownImpact(_HIT_S, 0, -1, after, spin_first_after=spin)
    source = "Cross, Am. J. Phys. 70 (2002) 1093: a disc that does not slide in the impact then rolls at v/(1 + k)"
    return Staged(scene, KnownAnswer(source, (hit,), 1, (after,), final_spin_rad_s=(spin,)))


def tailuge_298() -> Staged:
    """In a cut shot the balls stick by friction, so the object ball does not leave along the line of centres."""
    radius, speed, k, (nx, ny) = 0.028575, 2.0, 0.4, (0.8, 0.6)
    discs = [
        Disc(position_m=(-speed * _HIT_S, 0.0), velocity_m_s=(speed, 0.0), radius_m=radius, inertia_factor=k),
        Disc(position_m=(2 * radius * nx, 2 * radius * ny), radius_m=radius, inertia_factor=k),
    ]
    scene = build_scene(discs, friction=0.5, duration_s=2 * _HIT_S)
    normal, tangential = speed * nx, speed * ny / (2 * (1 + 1 / k))  # a seventh of the slip, which is -speed * ny
    object_velocity = (normal * nx + tangential * ny, normal * ny - tangential * nx)
    after, spin = ((speed - object_velocity[0], -object_velocity[1]), object_velocity), tangential / k / radius
    hit = KnownImpact(_HIT_S, 0, 1, *after, spin, spin)
    source = (
        "Alciatore, billiards TP A.14: for e = 1, the tangent of the throw angle is a seventh of that of the cut angle"
    )
    return Staged(scene, KnownAnswer(source, (hit,), 1, after, final_spin_rad_s=(spin, spin)))


def _stage_on_floor(
    source: str,
    body: Disc,
    distance_m: float,
    duration_s: float,
    *,
    along: float = 0.0,
    rim: float = 0.0,
    fall: float = 0.0,
    pull: float = 9.81,
    frame_rate_hz: float = 60.0,
    **of_wall: float,
) -> Staged:
    """Build a scene with a disc on the line y = 0. The disc's position, speed and rim speed at the end are known.

    By default, the disc is at rest at the end. For a slope, gravity is tilted, and the line stays level. `fall` is the
    tangent of the slope.
    """
    long = math.hypot(1.0, fall)
    fields = {f"wall_{law}": value for law, value in ({"restitution": 0.0} | of_wall).items()}
    times, gravity = {"frame_rate_hz": frame_rate_hz, "duration_s": duration_s}, (pull * fall / long, -pull / long)
    scene = build_scene([body], walls=[FLOOR], gravity_m_s2=gravity, **times, **fields)
    end: Vector = (distance_m, body.radius_m)
    spins = (rim / body.radius_m,) if scene.arrays.turns else None
    count = None if scene.wall_restitution else 0
    return Staged(scene, KnownAnswer(source, (), count, ((along, 0.0),), (end,), final_spin_rad_s=spins))


def _build_ball(along: float, *, rolls: bool, radius_m: float = 0.5, inertia: float = _SPHERE) -> Disc:
    spin = -along / radius_m if rolls else 0.0
    return build_disc(complex(0.0, radius_m), along, radius_m, spin_rad_s=spin, inertia_factor=inertia)


def rolls_out(along: float, resists: float, friction: float, fall: float = 0.0, source: str = _LAW) -> Staged:
    """Build a scene in which a ball rolls until it stops, on a floor whose slope has the tangent `fall`.

    The ball stops in the middle of the scene's duration.
    """
    slower = (resists - fall) * 9.81 / math.hypot(1.0, fall) / (1.0 + _SPHERE)
    distance_m, duration_s, ball = along**2 / (2.0 * slower), 2.0 * along / slower, _build_ball(along, rolls=True)
    laws = {"friction": friction, "rolling_resistance": resists}
    return _stage_on_floor(source, ball, distance_m, duration_s, fall=fall, **laws)


def cannon_293() -> Staged:
    """A sphere rolls down a slope and stops there: its rolling resistance exceeds gravity along the slope."""
    source = (
        "On a slope of angle a, a rolling disc has v' = (g sin a - c g cos a)/(1 + k); a disc stays at rest if tan a "
        "is at most c"
    )
    return rolls_out(1.0, 0.2, 0.8, fall=0.1, source=source)


def cannon_345() -> Staged:
    """A sphere that is thrown along the ground slides, then rolls, then stops."""
    along, friction, resists, g = 3.0, 0.8, 0.1, 9.82
    slid = along / (g * (friction + (friction - resists) / _SPHERE))
    rolled, slower = along - friction * g * slid, resists * g / (1.0 + _SPHERE)
    source, ball = f"{_LAW}; a sliding disc has v' = -f g and (R w)' = (f - c) g/k", _build_ball(along, rolls=False)
    distance_m = along * slid - friction * g * slid**2 / 2.0 + rolled**2 / (2.0 * slower)
    duration_s = 2.0 * (slid + rolled / slower)
    return _stage_on_floor(source, ball, distance_m, duration_s, pull=g, friction=friction, rolling_resistance=resists)


def nphysics_204() -> Staged:
    """A sphere at rest on a gentle slope does not start to roll, because of rolling resistance."""
    source = (
        "A sphere stays at rest if the slope's tangent is below the coefficients of friction and rolling resistance"
    )
    body = _build_ball(0.0, rolls=True)
    return _stage_on_floor(source, body, 0.0, 5.0, fall=0.05, friction=0.5, rolling_resistance=0.1)


def reactphysics3d_13() -> Staged:
    """A sphere rolls on a floor with a small rolling resistance, and stops after 5 s."""
    return rolls_out(5.0 * 0.02 * 9.81 / (1.0 + _SPHERE), 0.02, 0.3)


def box2d_617() -> Staged:
    """A disc without rolling resistance rolls for ever at the same speed."""
    along, duration_s = 3.0, 10.0
    source = "Without slip, friction has no effect"
    body, distance_m = _build_ball(along, rolls=True, radius_m=1.0, inertia=0.5), along * duration_s
    return _stage_on_floor(source, body, distance_m, duration_s, along=along, rim=-along, pull=10.0, friction=0.2)


def pooltool_39() -> Staged:
    """A pool ball that starts at 5 m/s without spin slides 3 m in 0.73 s, and then rolls."""
    along, friction, g, duration_s = 5.0, 0.2, 9.81, 1.0
    slid = 2.0 * along / (7.0 * friction * g)
    source, rolls = "A sliding sphere begins to roll after 2v/(7 f g), at 5/7 of its speed", 5.0 / 7.0 * along
    distance_m = 12.0 * along**2 / (49.0 * friction * g) + rolls * (duration_s - slid)
    ball = _build_ball(along, rolls=False, radius_m=0.028575)
    return _stage_on_floor(source, ball, distance_m, duration_s, along=rolls, rim=-rolls, friction=friction)


def brax_58() -> Staged:
    """A rolling sphere hits an equal sphere at rest.

    In the end, the first sphere rolls at 2/7 and the second at 5/7 of the initial speed.
    """
    along, gap, friction, g, duration_s, radius = 3.0, 1.5, 0.2, 9.81, 2.0, 0.5
    impact_s, changed = gap / along, 2.0 * along / 7.0
    slid = changed / (friction * g)
    rolls_s, slides_m = duration_s - impact_s - slid, changed * slid / 2.0
    target = build_disc(complex(2.0 * radius + gap, radius), 0, radius, inertia_factor=_SPHERE)
    discs, laws = [_build_ball(along, rolls=True), target], {"wall_friction": friction, "wall_restitution": 0.0}
    scene = build_scene(discs, walls=[FLOOR], pull=g, duration_s=duration_s, **laws)
    rolling = (2.0 * along / 7.0, 5.0 * along / 7.0)
    ways = (gap + slides_m + rolling[0] * rolls_s, 2.0 * radius + gap + along * slid - slides_m + rolling[1] * rolls_s)
    source = (
        "Equal elastic spheres exchange velocities and keep their spins. Friction then conserves the angular momentum "
        "of each sphere about its contact point, so the spheres roll at 2/7 and 5/7 of v"
    )
    hit = build_impact(impact_s, 0, 1, 0, along, -along / radius, 0.0)
    final = [(complex(x, radius), speed) for x, speed in zip(ways, rolling, strict=True)]
    spins = (-rolling[0] / radius, -rolling[1] / radius)
    return build_staged(scene, [hit], source, final=final, spins=spins)


def brax_151() -> Staged:
    """An elastic ball that lies on the ground stays there."""
    source, body = "A body at rest stays at rest", build_disc(0.1j, 0, 0.1)
    return _stage_on_floor(source, body, 0.0, 3.0, pull=9.8, restitution=1.0, frame_rate_hz=100.0)


def bullet3_2117() -> Staged:
    """A ball that rolls at an angle to both axes keeps its direction until it stops."""
    resists, g, speed, duration_s = 0.02, 9.81, 0.5, 2.5
    slower = resists * g / (1.0 + _SPHERE)
    left, distance_m = speed - slower * duration_s, speed * duration_s - slower * duration_s**2 / 2.0
    direction = 0.8 + 0.6j
    ball = build_disc(0, speed * direction, 0.028575)
    scene = build_scene([ball], table_deceleration_m_s2=slower, duration_s=duration_s)
    source = "The friction of a rolling ball acts against its motion, so the speed decreases by c g/(1 + k) each second"
    return build_staged(scene, [], source, final=[(distance_m * direction, left * direction)])


def matter_613() -> Staged:
    """A block on a slope below its angle of friction stays at rest."""
    block = _build_ball(0.0, rolls=True, inertia=math.inf)
    source = "Coulomb: a block stays at rest if the slope's tangent is at most f"
    return _stage_on_floor(source, block, 0.0, 5.0, fall=0.25, friction=0.5)


def bounces_out(height_m: float, restitution: float, more_s: float) -> Staged:
    """Build a scene in which a ball is dropped, bounces infinitely often in finite time, and then rests for a while."""
    ball = build_disc(complex(0.0, 0.5 + height_m), 0, 0.5)
    rests_s = math.sqrt(2.0 * height_m / 9.81) * (1.0 + restitution) / (1.0 - restitution)
    source = "Geometric series: if the first fall takes the time t, all bounces end at the time t (1 + e)/(1 - e)"
    return _stage_on_floor(source, ball, 0.0, rests_s + more_s, restitution=restitution)
