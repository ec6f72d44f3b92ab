"""Times, as balls, at which a disc meets a half-plane, or the line of a face, on a straight path or a parabola.

With gravity the gap is ``w + s t + a t^2 / 2``. Where the gap is 0, its derivative is ``+-sqrt(D)`` with ``D = s^2 - 2
a w``. At an impact the derivative is negative, so the only possible time is ``(-s - sqrt(D)) / a``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flint import arb

from carom.model.trace import wall_index
from carom.solvers.certified.ball_bodies import BallBodies
from carom.solvers.certified.exact import exactly_grazing_wall
from carom.solvers.certified.floats import float_above
from carom.solvers.certified.legs import ZERO
from carom.solvers.certified.meeting import Meeting, WallApproach, contacts_ahead, undecided

if TYPE_CHECKING:
    from carom.solvers.certified.legs import BallLeg


def to_plane(bodies: BallBodies, i: int, second: int, at: float, leg: BallLeg | None) -> Meeting | None:
    """Return the impact of disc `i` on a straight obstacle; None if there is certainly none.

    `leg` is the motion of the wall.
    """
    if bodies.acceleration[i] is not None:
        return _glide_to_plane(bodies, i, second, at, leg)
    return (_fall_on_plane if bodies.pulls[wall_index(second)] else _meet_plane)(bodies, i, second, at, leg)


def _glide_to_plane(bodies: BallBodies, i: int, second: int, at: float, leg: BallLeg | None) -> Meeting | None:
    """Return the impact of disc `i`, which is in contact with another straight obstacle."""
    law = bodies.wall_law(wall_index(second), bodies.scene.discs[i].radius_m)
    x, y, vx, vy = bodies.seen(i, at, leg)
    gap, speed = x * law.nx + y * law.ny - law.level, vx * law.nx + vy * law.ny
    pull = bodies.pull(i)[0] * law.nx + bodies.pull(i)[1] * law.ny
    for wait, meeting in contacts_ahead(bodies, i, second, at, [gap, speed, pull / 2], leg):
        return meeting._replace(near=WallApproach(ZERO - speed - pull * wait, wait)) if meeting.decided else meeting
    return None


def _meet_plane(bodies: BallBodies, i: int, second: int, at: float, leg: BallLeg | None) -> Meeting | None:
    """Return the impact of disc `i` if gravity has no component along the normal."""
    law = bodies.wall_law(wall_index(second), bodies.scene.discs[i].radius_m)
    x, y, vx, vy = bodies.less(leg, at, *bodies.moved(i, at), bodies.vx[i], bodies.vy[i])
    speed = vx * law.nx + vy * law.ny
    if speed >= 0:
        return None
    gap = x * law.nx + y * law.ny - law.level
    if not speed < 0:  # the disc may move along the wall: its greatest possible speed gives the earliest time
        time = arb(at) + (gap / (ZERO - speed.lower())).lower().max(ZERO)
        return undecided(i, second, at, time, resting=not gap > 0)
    time = arb(at) - gap / speed
    if time < at:  # before this path, which has no impact before `at`
        return None
    begin = bodies.began(i, second, at)
    decided = begin is None or bool(time > begin)
    return Meeting(i, second, at, time, float_above(time), decided, resting=not decided)


def _fall_on_plane(bodies: BallBodies, i: int, second: int, at: float, leg: BallLeg | None) -> Meeting | None:
    """Return the impact of disc `i` if gravity has a component along the normal."""
    k = wall_index(second)
    law, pulled = bodies.wall_law(k, bodies.scene.discs[i].radius_m), bodies.pulls[k]
    x, y, vx, vy = bodies.seen(i, at, leg)
    gx, gy = bodies.gravity
    gap, speed, pull = x * law.nx + y * law.ny - law.level, vx * law.nx + vy * law.ny, gx * law.nx + gy * law.ny
    d = speed * speed - 2 * pull * gap
    if d < 0 or (d.is_zero() and pulled > 0) or _grazes(bodies, i, k):
        return None
    begin = bodies.since(i, second)
    if not d > 0:  # the disc may turn back where it touches the wall, or may rest on the wall
        root = d.lower().max(ZERO).sqrt().union(d.upper().sqrt())
        time = arb(at) + (ZERO - speed - root) / pull
    else:
        root = d.sqrt()
        wait = 2 * gap / (root - speed) if speed < 0 else (ZERO - speed - root) / pull  # without cancellation
        time = arb(at) + wait
    if time < begin or (d > 0 and time < at):  # before this path, which is known to have no impact before `at`
        return None
    if d > 0 and time > begin:
        return Meeting(i, second, at, time, float_above(time), near=WallApproach(root, wait))
    earliest = time.lower().max(arb(at)) if time.is_finite() else arb(at)
    return undecided(i, second, at, earliest, resting=d > 0 or pulled < 0)


def _grazes(bodies: BallBodies, i: int, k: int) -> bool:
    """Return whether a disc on its initial path turns back exactly where it touches a half-plane at rest: no impact."""
    obstacle = bodies.obstacles[k]
    asked = obstacle.kind is None and bodies.untouched(i) and not bodies.is_driven(k)
    return asked and exactly_grazing_wall(bodies, i, k)
