"""Time of impact of a disc and a straight face under uniform gravity.

The gap is the quadratic of `carom.physics.wall_time_falling`, and the impact its falling root: there is one at most, so
a disc whose foot is not on the edge by then never meets the face on this path.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.double_double import Pair, pair_product
from carom.physics.face_time import across, face_gap, from_point, is_before_face
from carom.physics.pair_time import discriminant_from_gap
from carom.physics.wall_time_falling import descent_time, return_time

if TYPE_CHECKING:
    from carom.physics.features import Face, Mover, Point


def face_pull(face: Face, gravity: Point) -> Pair:
    """Return gravity's part along a face's normal times the face's length; negative towards the face."""
    return across(*face.along, (gravity[0], 0.0), (gravity[1], 0.0))


def face_time_falling(disc: Mover, face: Face, gravity: Point, leaving: float | None = None) -> float:
    """Return the seconds until a falling disc touches a face, infinity where it never does; as `descent_time` does.

    Where the disc has just hit the face, `leaving` is the speed at which it leaves it, 0 or more: the gap is then 0,
    whatever rounding has made of it.
    """
    pull = face_pull(face, gravity)
    if leaving is not None:
        if not pull[0] < 0.0:
            return math.inf
        wait = return_time(pair_product((leaving, 0.0), face.length), pull)
        return wait if foot_is_on(disc, face, wait, gravity) else math.inf
    gap, speed = face_gap(disc, face), across(*face.along, disc.ux, disc.uy)
    if gap[0] <= 0.0:
        if is_before_face(disc, face):
            return descent_time(gap, speed, pull)
        if not speed[0] > 0.0 or not pull[0] < 0.0:  # next to it or behind, from where only a fall back leads onto it
            return math.inf
        if not discriminant_from_gap(speed, (2.0 * gap[0], 2.0 * gap[1]), pull)[0] > 0.0:
            return math.inf
    wait = descent_time(gap, speed, pull)
    return wait if wait < math.inf and foot_is_on(disc, face, wait, gravity) else math.inf


def foot_is_on(disc: Mover, face: Face, time: float, gravity: Point) -> bool:
    """Whether a falling disc's foot is on the edge at a time; where rounding decides, face and vertex agree."""
    (ex, _), (ey, _) = face.along
    gx, gy = gravity
    moved_x, moved_y = time * (disc.ux[0] + 0.5 * gx * time), time * (disc.uy[0] + 0.5 * gy * time)
    x, y = from_point(disc.x, face.a[0])[0] + moved_x, from_point(disc.y, face.a[1])[0] + moved_y
    to_x, to_y = from_point(disc.x, face.b[0])[0] + moved_x, from_point(disc.y, face.b[1])[0] + moved_y
    return ex * x + ey * y >= 0.0 >= ex * to_x + ey * to_y
