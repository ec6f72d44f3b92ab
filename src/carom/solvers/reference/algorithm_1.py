"""Algorithm 1 of the paper that inspired Carom: PIT, for discs and half-planes on straight paths.

Each pair of bodies is tested for overlap at each frame, and not between frames. If two bodies overlap and approach each
other, they get new velocities along the line of centres. Positions are not corrected. So an impact is up to a frame
late, and its normal is the line of centres of the overlapping discs. PIT misses an impact if the overlap begins and
ends between two frames.

This module is for reading and tests. `carom.solve_pit` returns exactly the same numbers, but skips frames at
which no impact is possible, and supports all bodies and motions. After impacts with restitution 0, `carom.solve_pit`
also ignores approaches that are only rounding errors; this module does not ignore them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom.errors import InputError
from carom.model.disc_arrays import HalfPlane
from carom.model.scene import Scene, to_scene
from carom.model.trace import ImpactRecord, Vector, wall_body
from carom.solvers.pit.clock import FrameClock
from carom.solvers.request import compute_frames


@dataclass
class MovingDisc:
    """State of a disc at the current frame.

    Attributes:
        x: x coordinate of the centre, in metres.
        y: y coordinate of the centre, in metres.
        vx: x component of the velocity, in m/s.
        vy: y component of the velocity, in m/s.
        radius: Radius, in metres.
        inverse_mass: 1 divided by the mass; 0 for an immovable disc.
        last_partner: Number of the body that this disc met last. Walls have negative numbers.
    """

    x: float
    y: float
    vx: float
    vy: float
    radius: float
    inverse_mass: float
    last_partner: int | None = None

    @property
    def velocity(self) -> Vector:
        """The velocity as a pair of components."""
        return self.vx, self.vy

    def move(self, seconds: float) -> None:
        """Move the disc along its straight path."""
        if self.inverse_mass > 0.0:
            self.x += self.vx * seconds
            self.y += self.vy * seconds


def run_algorithm_1(
    scene: Scene | str, *, frame_rate_hz: float | None = None
) -> tuple[list[ImpactRecord], list[MovingDisc]]:
    """Run a scene of discs and half-planes by Algorithm 1. Return the impacts in order, and the discs at the end.

    Args:
        scene: The scene, or its name in the catalogue.
        frame_rate_hz: Frames per second; None for the scene's frame rate.

    Raises:
        InputError: The frame rate is not a positive number, or the scene has friction, curved paths, or bodies other
            than discs and half-planes.
    """
    scene = to_scene(scene)
    _require_simple(scene)
    clock = FrameClock(rate_hz=compute_frames(scene, frame_rate_hz)[0])
    discs = [
        MovingDisc(*disc.position_m, *disc.velocity_m_s, disc.radius_m, 1.0 / disc.mass_kg) for disc in scene.discs
    ]
    walls = scene.arrays.half_planes()
    impacts: list[ImpactRecord] = []
    now_s = 0.0
    for frame in range(clock.count_frames_before(scene.duration_s)):
        _move(discs, clock.time_s(frame) - now_s)
        now_s = clock.time_s(frame)
        for i, first in enumerate(discs):
            for j, second in enumerate(discs[i + 1 :], i + 1):
                if do_discs_interfere(first, second) and not (_has_just_met(first, j) and _has_just_met(second, i)):
                    impacts.append(collide_discs(first, second, i, j, now_s, scene.restitution))
        for i, disc in enumerate(discs):
            for k, wall in enumerate(walls):
                if does_wall_interfere(disc, wall) and not _has_just_met(disc, wall_body(k)):
                    impacts.append(collide_wall(disc, wall, i, k, now_s, scene.wall_restitution))
    _move(discs, scene.duration_s - now_s)
    return impacts, discs


def do_discs_interfere(first: MovingDisc, second: MovingDisc) -> bool:
    """Return whether two discs overlap or touch, and approach each other.

    At each frame, PIT tests whether bodies overlap and approach each other.
    """
    if first.inverse_mass == second.inverse_mass == 0.0:
        return False
    dx, dy = second.x - first.x, second.y - first.y
    approach = dx * (second.vx - first.vx) + dy * (second.vy - first.vy) < 0.0
    return approach and math.sqrt(dx * dx + dy * dy) <= first.radius + second.radius


def does_wall_interfere(disc: MovingDisc, wall: HalfPlane) -> bool:
    """Return whether a disc overlaps or touches a half-plane, and approaches it."""
    x, y, nx, ny = wall
    approaches = disc.vx * nx + disc.vy * ny < 0.0
    return approaches and (disc.x - x) * nx + (disc.y - y) * ny <= disc.radius


def collide_discs(first: MovingDisc, second: MovingDisc, i: int, j: int, time_s: float, e: float) -> ImpactRecord:
    """Apply an impact along the line of centres to two discs. Return the record of the impact.

    Let d be the vector from the first centre to the second. The impulse on the first disc is ``f d``. The formula for f
    contains ``d.d`` and no square root, so that the rounding of a root does not change the energy.
    """
    dx, dy = second.x - first.x, second.y - first.y
    along = dx * (second.vx - first.vx) + dy * (second.vy - first.vy)
    f = (1.0 + e) * along / ((dx * dx + dy * dy) * (first.inverse_mass + second.inverse_mass))
    before = first.velocity, second.velocity
    first.vx += f * first.inverse_mass * dx
    first.vy += f * first.inverse_mass * dy
    second.vx -= f * second.inverse_mass * dx
    second.vy -= f * second.inverse_mass * dy
    first.last_partner, second.last_partner = j, i
    distance = math.sqrt(dx * dx + dy * dy)
    return ImpactRecord(time_s, i, j, (dx / distance, dy / distance), *before, first.velocity, second.velocity)


def collide_wall(disc: MovingDisc, wall: HalfPlane, i: int, k: int, time_s: float, e: float) -> ImpactRecord:
    """Apply an impact on a half-plane to a disc. Return the record of the impact."""
    _, _, nx, ny = wall
    along, before = disc.vx * nx + disc.vy * ny, disc.velocity
    disc.vx -= (1.0 + e) * along * nx
    disc.vy -= (1.0 + e) * along * ny
    disc.last_partner = wall_body(k)
    return ImpactRecord(time_s, i, wall_body(k), (-nx, -ny), before, (0.0, 0.0), disc.velocity, (0.0, 0.0))


def _move(discs: list[MovingDisc], seconds: float) -> None:
    for disc in discs:
        disc.move(seconds)


def _has_just_met(disc: MovingDisc, partner: int) -> bool:
    """Return whether the disc is immovable or last met this partner.

    If the result is true for both bodies of a pair, the two do not approach each other.
    """
    return disc.inverse_mass == 0.0 or disc.last_partner == partner


def _require_simple(scene: Scene) -> None:
    arrays = scene.arrays
    bends = scene.gravity_m_s2 != (0.0, 0.0) or scene.damping_per_s or scene.table_deceleration_m_s2
    if bends or arrays.turns or arrays.driven or not arrays.has_plain_walls:
        raise InputError("Algorithm 1 is for discs and half-planes on straight paths, without friction; use solve_pit")
