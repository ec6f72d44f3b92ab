"""Bug reports about seams, where two pieces of a floor or wall meet: a ball bumps, stops or bounces off at an angle.

A floor that consists of pieces must act like a single floor. Each wall of these scenes is one edge. Engines get the
edge in several pieces. The field `pieces` of the wall is the number of pieces. In most reports, a ball rolls over a
seam. Only impacts have known answers, so in these scenes the ball comes down slowly near a seam.
"""

from __future__ import annotations

import cmath
import math

from carom.catalogue.closed_forms import compute_after_wall, compute_fall
from carom.catalogue.entry import Staged
from carom.catalogue.groups.classics_walled import edges
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, stage

_LAW = "Newton's law: an impact reverses the velocity along the normal; a floor made of pieces acts like one floor"


def on_seam(
    velocity: complex, radius: float, half_length: float, pieces: int, *, along_m: float = 0.0, turn: complex = 1
) -> Staged:
    """Build a scene in which a disc meets a floor after half a second, at the x coordinate `along_m`.

    The floor is at height 0. Floor and disc are then rotated about the origin by `turn`, a complex number.
    """
    time = 0.5
    start = along_m + 1j * radius - velocity * time
    floor = edges(-half_length * turn, half_length * turn, pieces=pieces)
    scene = build_scene([build_disc(start * turn, velocity * turn, radius)], walls=[floor], duration_s=1.25)
    return build_staged(scene, [build_impact(time, 0, -1, compute_after_wall(velocity, 1j) * turn)], _LAW)


def channel(start: complex, velocity: complex, radius: float, width: float, length: float, pieces: int) -> Staged:
    """Build a scene in which a disc bounces along a channel between two walls that consist of pieces."""
    walls = [edges(-length / 2, length / 2, pieces=pieces)]
    walls.append(edges(complex(-length / 2, width), complex(length / 2, width), pieces=pieces))
    time, crossing_s = (start.imag - radius) / -velocity.imag, (width - 2 * radius) / abs(velocity.imag)
    impacts = [
        build_impact(time + k * crossing_s, 0, -1 - k % 2, complex(velocity.real, abs(velocity.imag) * (-1) ** k))
        for k in range(6)
    ]
    return stage([build_disc(start, velocity, radius)], impacts, _LAW, walls=walls, duration_s=time + 5.5 * crossing_s)


def rapier_95() -> Staged:
    """A ball comes down on a ramp of three pieces, next to a seam."""
    turn = cmath.exp(-1j * math.radians(20))
    return on_seam(3 - 0.5j, 0.25, 3, 3, along_m=-1.0625, turn=turn)


def rapier_404() -> Staged:
    """A ball comes down on a slope of many pieces, straight above a seam."""
    turn = cmath.exp(-1j * math.radians(35))
    return on_seam(1 - 2j, 0.3, 4, 8, turn=turn)


def godot_65204() -> Staged:
    """A ball falls on a floor of tiles and bounces, under gravity."""
    pull, time, end, radius, restitution = 9.81, 0.5, 0.875, 0.25, 0.6
    before = 2 - 1j - 1j * pull * time
    start = -0.125 + 1j * radius - (2 - 1j) * time + 0.5j * pull * time**2
    after = compute_after_wall(before, 1j, restitution)
    fields = {"wall_restitution": restitution, "pull": pull, "duration_s": end}
    scene = build_scene([build_disc(start, 2 - 1j, radius)], walls=[edges(-4, 4, pieces=16)], **fields)
    final = compute_fall(-0.125 + 1j * radius, after, end - time, -1j * pull)
    return build_staged(scene, [build_impact(time, 0, -1, after)], f"Free fall; {_LAW}", final=[final])
