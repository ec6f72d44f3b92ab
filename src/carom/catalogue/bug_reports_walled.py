"""Complaints about walls and tables: sticking, corners, slow and repeated bounces, a break shot."""

from __future__ import annotations

import cmath
import math

from carom.catalogue.bug_report import Symptom, complained, loses_energy, misses, never_bounces
from carom.catalogue.classics_walled import bounces_in_a_box, box_walls
from carom.catalogue.closed_forms import after_impact, answered, disc, dot, impact, scene_of, unit
from carom.catalogue.entry import KnownAnswer, KnownImpact, Staged
from carom.model.scene import Wall

_MIRROR = "Each wall reverses the velocity across it, times its restitution"


def _wall_on_the_right(
    *, radius_m: float, velocity: complex, gap_m: float, duration_s: float, rate_hz: float, restitution: float = 1.0
) -> Staged:
    """Stage a disc at the origin that meets one wall."""
    scene = scene_of(
        discs=[disc(0j, velocity, radius_m)],
        walls=[Wall(point_m=(radius_m + gap_m, 0.0), normal=(-1.0, 0.0))],
        wall_restitution=restitution,
        duration_s=duration_s,
        frame_rate_hz=rate_hz,
    )
    after = complex(-restitution * velocity.real, velocity.imag)
    return answered(scene, [impact(gap_m / velocity.real, 0, -1, after)], _MIRROR)


def _in_a_box(
    *, start: complex, velocity: complex, radius: float, width: float, height: float, duration: float
) -> Staged:
    """Stage a disc in an elastic box. `start` is relative to the box's lower left corner."""
    scene = scene_of(discs=[disc(start, velocity, radius)], walls=box_walls(width, height), duration_s=duration)
    inner = start - complex(radius, radius)
    impacts = bounces_in_a_box(inner, velocity, width - 2 * radius, height - 2 * radius, duration)
    return answered(scene, impacts, "Unfolding: the path is one straight line through a lattice of boxes")


@never_bounces(
    thread="https://github.com/bulletphysics/bullet3/issues/3094",
    reported="With restitution 1 a ball sticks to a wall instead of bouncing. The maintainer names predictive "
    "contacts as the cause, and settings that cure it.",
    made="Ball, wall, speed and step are those of the script in the thread.",
)
def _bullet3_3094() -> Staged:
    """A ball at 1 m/s meets a wall a metre away."""
    return _wall_on_the_right(radius_m=0.2, velocity=1 + 0j, gap_m=0.8, duration_s=1.5, rate_hz=240.0)


@never_bounces(
    thread="https://github.com/bulletphysics/bullet3/issues/4341",
    reported="With steps of 0.2 ms a convex hull does not bounce; with the standard step, or as a box, it does.",
    made="The step is from the thread. A disc replaces the hull, and it does not fall.",
)
def _bullet3_4341() -> Staged:
    """A disc bounces off a wall of restitution 1/2 in steps of 0.2 ms."""
    return _wall_on_the_right(radius_m=0.1, velocity=2 + 0j, gap_m=0.1, restitution=0.5, duration_s=0.1, rate_hz=5000.0)


@never_bounces(
    thread="https://github.com/erincatto/box2d/pull/654",
    reported="Impacts slower than a velocity threshold, 1 m/s by default, were inelastic whatever the "
    "restitution; this change lets users set the threshold.",
    made="The thread has no scene; all sizes are chosen here.",
)
def _box2d_654() -> Staged:
    """A disc meets a wall at half a metre a second, elastically."""
    return _wall_on_the_right(radius_m=0.25, velocity=0.5 + 0.2j, gap_m=0.3, duration_s=1.25, rate_hz=60.0)


@never_bounces(
    thread="https://github.com/dimforge/rapier/issues/919",
    reported="With a larger prediction distance balls stop bouncing almost at once: contacts that are found early "
    "skip the restitution.",
    made="The thread drops balls; here one flies at a wall, without gravity. All sizes are chosen here.",
)
def _rapier_919() -> Staged:
    """A ball bounces off a wall of restitution .7."""
    return _wall_on_the_right(radius_m=0.5, velocity=6 + 0j, gap_m=2.03, restitution=0.7, duration_s=0.75, rate_hz=60.0)


@loses_energy(
    thread="https://github.com/dimforge/rapier/issues/615",
    reported="A perfectly elastic ball without gravity loses velocity at every bounce. The cause was friction, which "
    "is on by default.",
    made="The thread has no sizes; all are chosen here.",
)
def _rapier_615() -> Staged:
    """An elastic ball bounces in a box, without gravity."""
    return _in_a_box(start=0.7 + 0.6j, velocity=4.1 + 2.3j, radius=0.2, width=3.0, height=2.0, duration=5.0)


@complained(
    thread="https://github.com/ekiefl/pooltool/issues/217",
    reported="A ball meets two cushions at nearly one instant; only one impact is processed, and the ball leaves.",
    symptom=Symptom.ESCAPES,
    made="Table, position, direction and speed are from the thread; the ball has pooltool's radius and no friction.",
)
def _pooltool_217() -> Staged:
    """A ball moves straight into a corner, and meets two walls at one instant."""
    radius, side, part = 0.028575, 4.5, math.sqrt(2.0)
    scene = scene_of(discs=[disc(1 + 1j, complex(part, part), radius)], walls=box_walls(side, side), duration_s=3.5)
    time = (side - radius - 1) / part
    impacts = [impact(time, 0, -4, complex(part, -part)), impact(time, 0, -2, complex(-part, -part))]
    return answered(scene, impacts, f"{_MIRROR}; at a right angle neither impact changes the other")


@complained(
    thread="https://github.com/ekiefl/pooltool/issues/217",
    reported="A ball that is placed against a cushion and shot towards it also passes through.",
    symptom=Symptom.ESCAPES,
    made="The case is from the thread; the radius is a power of two, so that ball and cushion touch exactly.",
)
def _pooltool_217_touching() -> Staged:
    """A ball that touches a cushion is shot towards it."""
    radius, side = 0.03125, 4.5
    scene = scene_of(
        discs=[disc(complex(side - radius, 1), 1.5 + 0.5j, radius)],
        walls=box_walls(side, side),
        duration_s=1.0,
    )
    return answered(scene, [impact(0.0, 0, -2, -1.5 + 0.5j)], f"{_MIRROR}: at once")


@complained(
    package="Nimble Physics",
    thread="https://github.com/keenon/nimblephysics/issues/143",
    reported="Two balls and a wall, restitution 1, no gravity: the velocities after the impacts are wrong.",
    made="Radius, wall, step and restitution are from the thread. The thread's positions and speeds could not be "
    "read, so they are chosen here.",
)
def _nimble_143() -> Staged:
    """A ball bounces off a wall, and meets the ball that follows it."""
    radius, wall, first, second, v1, v2 = 0.1, 1.1, 0.5, 0.0, 1.0, 0.5
    scene = scene_of(
        discs=[disc(complex(first, 0), complex(v1, 0), radius), disc(complex(second, 0), complex(v2, 0), radius)],
        walls=[Wall(point_m=(wall, 0.0), normal=(-1.0, 0.0))],
        duration_s=1.25,
        frame_rate_hz=100.0,
    )
    at_wall = (wall - radius - first) / v1
    met = at_wall + (wall - radius - (second + v2 * at_wall) - 2 * radius) / (v1 + v2)
    impacts = [impact(at_wall, 0, -1, complex(-v1, 0)), impact(met, 0, 1, complex(v2, 0), complex(-v1, 0))]
    # After this impact the first ball goes to the wall once more.
    where = wall - radius - v1 * (met - at_wall)
    again = met + (wall - radius - where) / v2
    impacts.append(impact(again, 0, -1, complex(-v2, 0)))
    impacts = [known for known in impacts if known.time_s < scene.duration_s]
    return answered(scene, impacts, f"{_MIRROR}; equal masses exchange velocities")


@misses(
    thread="https://github.com/ekiefl/pooltool/issues/154",
    reported="In a break the cue ball passes through another ball: the collision is missed.",
    made="Speed and direction are from the thread. The thread's rack has random positions, this one regular ones; "
    "friction and cushions are left out.",
)
def _pooltool_154() -> Staged:
    """A cue ball breaks a loosely racked triangle of fifteen balls."""
    radius, gap, speed, angle = 0.028575, 1e-3, 3.262213, math.radians(81.83468)
    pitch = 2 * radius + gap
    apex = 0.5 + 1.5j
    velocity = cmath.rect(speed, angle)
    discs = [disc(0.5 + 0.5j, velocity, radius)]
    places = [complex(k - row / 2, row * math.sqrt(3) / 2) * pitch for row in range(5) for k in range(row + 1)]
    discs += [disc(apex + place, 0j, radius) for place in places]
    scene = scene_of(discs=discs, duration_s=1.0, frame_rate_hz=240.0)
    start = complex(*scene.discs[0].position_m)
    first: tuple[float, int] | None = None
    for k, struck in enumerate(scene.discs[1:], 1):
        apart = complex(*struck.position_m) - start
        along = dot(apart, velocity) / speed
        missed = abs(apart) ** 2 - along**2
        if missed < 4 * radius**2:
            time = (along - math.sqrt(4 * radius**2 - missed)) / speed
            first = min(first or (time, k), (time, k))
    if first is None:
        return answered(scene, [], "The path of the cue ball passes every ball")
    time, struck_number = first
    normal = unit(complex(*scene.discs[struck_number].position_m) - start - velocity * time)
    after = after_impact(1.0, velocity, 1.0, 0j, normal)
    known = KnownImpact(time, 0, struck_number, (after[0].real, after[0].imag), (after[1].real, after[1].imag))
    source = "The first impact by the quadratic of the straight path; after it energy is kept, and nothing overlaps"
    return Staged(scene, KnownAnswer(source, (known,), final_kinetic_energy_j=0.5 * speed**2))


@loses_energy(
    thread="https://github.com/liabru/matter-js/issues/626",
    reported="One particle in a container, with restitution 1 and no friction, becomes slower at each wall.",
    made="The thread has no sizes; all are chosen here.",
)
def _matter_626() -> Staged:
    """A particle bounces in a box without losing energy."""
    return _in_a_box(start=1.3 + 0.9j, velocity=2.3 + 1.7j, radius=0.1, width=4.0, height=3.0, duration=10.0)


@never_bounces(
    thread="https://github.com/piqnt/planck.js/issues/217",
    reported="A ball of restitution 1 that moves slowly and diagonally, as in Pong, sticks to walls instead of "
    "bouncing off.",
    made="The thread gives no numbers; all are chosen here, below Planck's threshold of 1 m/s.",
)
def _planck_217() -> Staged:
    """A ball moves slowly and diagonally through a box."""
    return _in_a_box(start=0.9 + 0.7j, velocity=0.6 + 0.45j, radius=0.125, width=2.0, height=1.5, duration=8.0)


@never_bounces(
    thread="https://github.com/4ian/GDevelop/issues/1219",
    reported="Slow balls stop bouncing off walls and glide along them.",
    made="The thread gives no numbers; all are chosen here.",
)
def _gdevelop_1219() -> Staged:
    """A ball approaches a wall at 0.4 m/s while it moves along the wall at 0.7 m/s."""
    return _wall_on_the_right(radius_m=0.25, velocity=0.4 + 0.7j, gap_m=0.31, duration_s=2.0, rate_hz=60.0)


@never_bounces(
    thread="https://github.com/Scirra/Construct-bugs/issues/3900",
    reported="At 50 pixels a second or less a ball no longer bounces; at 51 it does.",
    made="The speed is from the thread, at the engine's 50 pixels a metre; the sizes are chosen here.",
)
def _construct_3900() -> Staged:
    """A ball approaches a wall at 1 m/s."""
    return _wall_on_the_right(radius_m=0.5, velocity=1 + 0j, gap_m=0.51, duration_s=1.25, rate_hz=60.0)


@complained(
    thread="https://github.com/bulletphysics/bullet3/issues/2483",
    reported="A fast ball passes through a wall. With continuous detection it bounces, but loses a part of its speed "
    "that depends on where it began.",
    at_least=0.1,
    made="The thread gives restitution 1 and no gravity; speed and sizes are chosen here.",
)
def _bullet3_2483() -> Staged:
    """A ball meets a wall elastically, at many times its size per step."""
    return _wall_on_the_right(radius_m=0.1, velocity=100 + 0j, gap_m=5.13, duration_s=0.1, rate_hz=60.0)


@complained(
    thread="https://github.com/dyn4j/dyn4j/issues/87",
    reported="A billiard ball between two walls gets stuck in one of them.",
    symptom=Symptom.ESCAPES,
    made="Ball, walls, position, speed and the ball's restitution are from the thread; the second ball is left out.",
)
def _dyn4j_87() -> Staged:
    """A billiard ball bounces between two walls, and loses a tenth of its speed at each."""
    radius, speed, left, right, restitution = 0.028575, 2.0, -0.4, 1.9, 0.9
    place, time, impacts, duration = -0.3, 0.0, list[KnownImpact](), 4.0
    while (time := time + ((right - radius - place) if speed > 0 else (place - left - radius)) / abs(speed)) < duration:
        place, wall = (right - radius, -2) if speed > 0 else (left + radius, -1)
        speed *= -restitution
        impacts.append(impact(time, 0, wall, complex(speed, 0)))
    walls = [Wall(point_m=(left, 0.0), normal=(1.0, 0.0)), Wall(point_m=(right, 0.0), normal=(-1.0, 0.0))]
    scene = scene_of(
        discs=[disc(-0.3 + 0j, 2 + 0j, radius)], walls=walls, wall_restitution=restitution, duration_s=duration
    )
    return answered(scene, impacts, f"{_MIRROR}: the walls' distance over a speed that falls by a factor")


@never_bounces(
    thread="https://github.com/tainicom/Aether.Physics2D/issues/106",
    reported="A cue ball of restitution 1 does not bounce off anything.",
    made="Mass and restitution are from the thread; the sizes are chosen here.",
)
def _aether_106() -> Staged:
    """A cue ball meets a cushion at an angle."""
    return _wall_on_the_right(radius_m=0.03, velocity=1.5 + 0.8j, gap_m=0.77, duration_s=1.0, rate_hz=60.0)


@complained(
    thread="https://github.com/schteppe/p2.js/issues/156",
    reported="A pool ball that meets a cushion at 45 degrees leaves at 40, and after a few bounces moves straight to "
    "and fro. Without friction and rotation it was right.",
    at_least=0.05,
    made="The angle is from the thread; the sizes are chosen here, and there is no friction.",
)
def _p2_156() -> Staged:
    """A ball meets a cushion at 45 degrees."""
    return _wall_on_the_right(radius_m=0.03, velocity=1.25 + 1.25j, gap_m=0.63, duration_s=1.0, rate_hz=60.0)


@loses_energy(
    package="GAMA",
    thread="https://github.com/gama-platform/gama/issues/556",
    reported="With restitution 1 everywhere balls lose speed, most if a ball meets a wall and a ball almost at once.",
    made="The thread has no numbers; all are chosen here.",
)
def _gama_556() -> Staged:
    """A ball bounces off a wall, and almost immediately meets the ball that follows it."""
    radius, wall, gap, slit, speed = 0.25, 2.0, 0.5, 0.01, 2.0
    first = wall - radius - gap
    second = first - 2 * radius - slit
    scene = scene_of(
        discs=[disc(complex(first, 0), complex(speed, 0), radius), disc(complex(second, 0), complex(speed, 0), radius)],
        walls=[Wall(point_m=(wall, 0.0), normal=(-1.0, 0.0))],
        duration_s=0.75,
    )
    at_wall = gap / speed
    met = at_wall + slit / (2 * speed)  # the balls approach at twice the speed
    back = met + slit / (2 * speed)  # the first returns by half of the slit
    impacts = [
        impact(at_wall, 0, -1, complex(-speed, 0)),
        impact(met, 0, 1, complex(speed, 0), complex(-speed, 0)),
        impact(back, 0, -1, complex(-speed, 0)),
    ]
    return answered(scene, impacts, f"{_MIRROR}; equal masses exchange velocities")
