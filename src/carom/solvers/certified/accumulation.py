"""Detection of collapse and crush: infinitely many impacts in a finite time.

Collapse and crush are inferred from many past impacts, without a proof.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flint import arb

from carom.model.trace import wall_body, wall_index
from carom.solvers.certified.crushed_row import CRUSH, crush_in_a_row
from carom.solvers.certified.floats import float_above
from carom.solvers.certified.obstacles import Plane
from carom.solvers.certified.result import Degeneracy, Degenerate

if TYPE_CHECKING:
    from carom.solvers.certified.ball_bodies import BallBodies
    from carom.solvers.certified.recording import Recording

#: Impacts count as a collapse if there are at least this many, times the square of the number of their bodies, within
#: two floats of one time. Three equal discs that do not collapse have at most some 600 impacts.
_COLLAPSE = 20


def without_end(log: Recording, bodies: BallBodies) -> Degeneracy | None:
    """Return the collapse or crush that the last impacts form; None if they form neither."""
    return _collapse(log, bodies) or _crush(log, bodies) or crush_in_a_row(log, bodies)


def _collapse(log: Recording, bodies: BallBodies) -> Degeneracy | None:
    """Return the collapse that the last impacts form, if any."""
    scene = bodies.scene
    if not log.rows or not (scene.restitution < 1 or any(material.restitution < 1 for material in bodies.materials)):
        return None
    latest = log.rows[-1].values.time_s
    earliest = math.nextafter(math.nextafter(latest, 0.0), 0.0)
    involved: set[int] = set()
    count = 0
    for row in reversed(log.rows):
        if row.values.time_s < earliest:
            break
        involved |= {row.values.first, row.values.second}
        count += 1
    if count < _COLLAPSE * len(involved) ** 2:
        return None
    known = min(bodies.state_bits(body) for body in involved if body >= 0)
    first = log.rows[-count].values.time_s
    return Degeneracy(Degenerate.COLLAPSE, tuple(sorted(involved)), first, latest, proven=False, bits=known)


def _crush(log: Recording, bodies: BallBodies) -> Degeneracy | None:
    """Return the crush of a disc between two half-planes that approach each other, if it had many impacts with both.

    Finite walls are ignored, because a disc can escape past their ends. If the normals of the half-planes are exactly
    opposite, the sum of the disc's two gaps does not depend on its position.
    """
    last = [row.values for row in log.rows[-CRUSH:]]
    if not bodies.fastest_drive or len(last) < CRUSH or len({(row.first, row.second) for row in last}) > 2:
        return None
    disc, walls = last[-1].first, [row.second for row in last[-2:]]
    if walls[0] == walls[1] or max(walls) >= 0:
        return None
    room = rate = arb(0)
    normals, ends_s = [], []
    for wall in walls:
        k = next(k for k, obstacle in enumerate(bodies.obstacles) if obstacle.wall == wall_index(wall))
        shape = bodies.obstacles[k].shape
        if not isinstance(shape, Plane) or shape.stretch is not None:
            return None
        law = bodies.wall_law(k, bodies.scene.discs[disc].radius_m)
        leg = bodies.legs_from(wall_body(k), last[-1].time_s)[0]
        normals.append(shape.normal)
        room = room - law.level
        if leg is not None:
            room, rate = room - leg.x * law.nx - leg.y * law.ny, rate - leg.vx * law.nx - leg.vy * law.ny
            ends_s.append(leg.end_s)
    (ax, ay), (bx, by) = normals
    if (ax, ay) != (-bx, -by) or not rate < 0:
        return None
    end = room / (arb(0) - rate)
    if not all(end < end_s for end_s in ends_s) or end > bodies.scene.duration_s:
        return None
    bodies_of_it = tuple(sorted({disc, *walls}))
    known = bodies.state_bits(disc)
    return Degeneracy(Degenerate.CRUSH, bodies_of_it, last[-1].time_s, float_above(end), proven=False, bits=known)
