"""Times, as intervals, at which a disc meets a half-plane, a face, a vertex or an arc.

`docs/theory/walls.md` derives the formulas. All states are relative to the wall. For a driven wall, each part of its
path with constant velocity is examined on its own.

A face (a straight side of a wall) is met like a half-plane. With gravity, the gap to a line is ``w + s t + a t^2 / 2``.
Where the gap is 0, its derivative is ``+-sqrt(D)`` with ``D = s^2 - 2 a w``. At an impact the derivative is negative,
so the only possible time is ``(-s - sqrt(D)) / a``.

A vertex, or an arc from outside, is met like another disc: at the earlier root of ``|d + t u| = R``. An arc from inside
is met at the later root. With gravity, the time is a root at which a polynomial of degree four decreases.

The point of contact with a finite wall must be on the edge. Near the joint of two edges, it can be undecided which edge
the disc meets. If the joint is smooth, both edges give nearly the same result. The intervals of the time and of the
state after the impact then include both results.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto
from fractions import Fraction
from typing import NamedTuple

from flint import arb, ctx

from carom.core.wall_parts import Between, Plane, Round
from carom.model.chain_geometry import Outline
from carom.model.scene import Scene
from carom.model.trace import wall_body, wall_index
from carom.solvers.certified.ball_arithmetic import SLACK, ZERO, BallLeg, ball, float_above
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.exact import do_graze, does_graze_wall
from carom.solvers.certified.meeting import Meeting, RoundApproach, Seam, WallApproach, build_undecided, find_contacts
from carom.solvers.certified.result import Degeneracy, Degenerate
from carom.solvers.certified.sign_changes import build_squared_gap_powers, find_falls

#: Precision, in bits, of the check for contact at the start. The precision of the check is far more than 64-bit input
#: needs.
_START_BITS = 2048


def meet_straight(bodies: BallBodies, i: int, second: int, instant_s: float, leg: BallLeg | None) -> Meeting | None:
    """Return the impact of disc `i` on a straight obstacle; None if there is certainly no impact.

    `leg` is the current part of the wall's path if the wall is driven.
    """
    is_pulled = bodies.acceleration[i] is not None or bodies.pulls[wall_index(second)]
    return (_fall_on_plane if is_pulled else _meet_plane)(bodies, i, second, instant_s, leg)


def _meet_plane(bodies: BallBodies, i: int, second: int, instant_s: float, leg: BallLeg | None) -> Meeting | None:
    """Return the impact of disc `i` on a half-plane or face, if gravity has no component along the normal."""
    law = bodies.laws.of_straight(wall_index(second), bodies.scene.discs[i].radius_m)
    x, y, vx, vy = bodies.subtract_leg(
        leg, instant_s, *bodies.centre_in_frame(i, instant_s), bodies.vx[i], bodies.vy[i]
    )
    speed = vx * law.nx + vy * law.ny
    if speed >= 0:
        return None
    gap = x * law.nx + y * law.ny - law.level
    if not speed < 0:  # the disc may move parallel to the wall: use the greatest possible speed towards the wall
        time = arb(instant_s) + (gap / (ZERO - speed.lower())).lower().max(ZERO)
        return build_undecided(i, second, instant_s, time, resting=not gap > 0)
    time = arb(instant_s) - gap / speed
    if time < instant_s:  # this root is before the start of the path, and there is no impact before `instant_s`
        return None
    begin = bodies.find_last_impact_of_either(i, second, instant_s)
    decided = begin is None or bool(time > begin)
    return Meeting(i, second, instant_s, time, float_above(time), decided, resting=not decided)


def _fall_on_plane(bodies: BallBodies, i: int, second: int, instant_s: float, leg: BallLeg | None) -> Meeting | None:
    """Return the impact of disc `i` on a half-plane or face, if its acceleration may have a component along the normal.

    The disc is in flight, or it slides, rolls or rests elsewhere.
    """
    k = wall_index(second)
    law, pulled = bodies.laws.of_straight(k, bodies.scene.discs[i].radius_m), bodies.pulls[k]
    x, y, vx, vy = bodies.relative_state(i, instant_s, leg)
    ax, ay = bodies.acceleration_of(i)
    gap, speed, pull = x * law.nx + y * law.ny - law.level, vx * law.nx + vy * law.ny, ax * law.nx + ay * law.ny
    if bodies.acceleration[i] is not None:
        for wait, meeting in find_contacts(bodies, i, second, instant_s, [gap, speed, pull / 2], leg):
            near = WallApproach(ZERO - speed - pull * wait, wait)
            return meeting._replace(near=near) if meeting.decided else meeting
        return None
    d = speed * speed - 2 * pull * gap
    if d < 0 or (d.is_zero() and pulled > 0) or _turns_back(bodies, i, k):
        return None
    begin = bodies.find_last_impact(i, second)
    if not d > 0:  # the disc may turn back where it touches the wall, or may rest on the wall
        root = d.lower().max(ZERO).sqrt().union(d.upper().sqrt())
        time = arb(instant_s) + (ZERO - speed - root) / pull
    else:
        root = d.sqrt()
        wait = 2 * gap / (root - speed) if speed < 0 else (ZERO - speed - root) / pull  # no terms cancel
        time = arb(instant_s) + wait
    if time < begin or (
        d > 0 and time < instant_s
    ):  # this root is before the start of the path, and there is no impact before `instant_s`
        return None
    if d > 0 and time > begin:
        return Meeting(i, second, instant_s, time, float_above(time), near=WallApproach(root, wait))
    earliest = time.lower().max(arb(instant_s)) if time.is_finite() else arb(instant_s)
    return build_undecided(i, second, instant_s, earliest, resting=d > 0 or pulled < 0)


def _turns_back(bodies: BallBodies, i: int, k: int) -> bool:
    """Return whether a disc on its initial path turns back (without impact) exactly where it touches a half-plane."""
    obstacle = bodies.obstacles[k]
    is_at_start = obstacle.kind is None and bodies.are_at_start(i) and not bodies.is_driven(k)
    return is_at_start and does_graze_wall(bodies, i, k)


class On(Enum):
    """Position of a point of contact relative to its edge."""

    INSIDE = auto()
    BEGIN = auto()
    END = auto()
    BESIDE = auto()
    OPEN = auto()  # not decided


class _Touch(NamedTuple):
    meeting: Meeting
    on: On


def meet_feature(bodies: BallBodies, i: int, second: int, instant_s: float, leg: BallLeg | None) -> Meeting | None:
    """Return the impact of disc `i` on a part of a finite wall; None if there is certainly no impact.

    `leg` is the current part of the wall's path if the wall is driven.
    """
    launch = bodies.contacts.launched[i]
    if launch is not None and launch.vertex == second:
        # When the disc flew off its surface, the gap and its rate of change were 0. The other coefficients give the
        # next contact.
        fall = next(find_falls(launch.powers), None)
        if fall is None:
            return None
        return_time = launch.time + fall.time
        if not fall.certain or not return_time.lower() > launch.time.upper():
            return build_undecided(i, second, instant_s, return_time.lower().max(arb(instant_s)), resting=False)
        instant_s = max(instant_s, float((launch.time + return_time) / 2))
    touch = _find_touch(bodies, i, second, instant_s, leg)
    if touch is None or touch.on is On.BESIDE:
        return None
    meeting = touch.meeting
    if touch.on is On.INSIDE or not meeting.decided:
        return meeting
    adjoining = dict(zip((On.BEGIN, On.END), bodies.obstacles[wall_index(second)].neighbours, strict=False))
    other = _find_touch(bodies, i, adjoining[touch.on], instant_s, leg) if touch.on in adjoining else None
    if other is None or not other.meeting.decided:
        return build_undecided(i, second, instant_s, meeting.time, resting=False)
    time = meeting.time.union(other.meeting.time)
    return meeting._replace(time=time, latest=float_above(time), near=Seam(meeting, other.meeting))


def _find_touch(bodies: BallBodies, i: int, second: int, instant_s: float, leg: BallLeg | None) -> _Touch | None:
    """Return the first contact of a disc with the line or the circle of an obstacle; None if there is none."""
    k = wall_index(second)
    shape = bodies.obstacles[k].shape
    curved = bodies.falls or bodies.acceleration[i] is not None
    if isinstance(shape, Round):
        if _passes_stop(bodies, i, k, shape):
            return None
        return (_fall_on_round if curved else _touch_round)(bodies, i, second, shape, instant_s, leg)
    x, y, vx, vy = bodies.relative_state(i, instant_s, leg)
    law = bodies.laws.of_straight(k, bodies.scene.discs[i].radius_m)
    straight = not bodies.pulls[k] and bodies.acceleration[i] is None
    if straight and x * law.nx + y * law.ny < law.level:  # the disc is behind the edge or beyond its end
        return None
    meeting = meet_straight(bodies, i, second, instant_s, leg)
    if meeting is None or shape.stretch is None:
        return None if meeting is None else _Touch(meeting, On.INSIDE)
    x, y = _compute_position_after(bodies, i, x, y, vx, vy, meeting.time - instant_s)
    return _Touch(meeting, _locate_foot(shape.stretch, x, y))


def _compute_position_after(bodies: BallBodies, i: int, x: arb, y: arb, vx: arb, vy: arb, wait: arb) -> tuple[arb, arb]:
    """Return the position of disc `i` after `wait` seconds."""
    if not bodies.falls and bodies.acceleration[i] is None:
        return x + vx * wait, y + vy * wait
    (gx, gy), half = bodies.acceleration_of(i), wait / 2
    return x + wait * (vx + gx * half), y + wait * (vy + gy * half)


def _passes_stop(bodies: BallBodies, i: int, k: int, shape: Round) -> bool:
    """Return whether disc `i` ignores a part, because the part acts only on discs that do not fit inside an arc."""
    reach = Fraction(bodies.scene.discs[i].radius_m) + bodies.obstacles[k].half_width
    return shape.stops_of is not None and reach**2 < shape.stops_of.radius2


def _fall_on_round(
    bodies: BallBodies, i: int, second: int, shape: Round, instant_s: float, leg: BallLeg | None
) -> _Touch | None:
    """Return the first contact of a disc on a curved path with an arc or vertex; None if there is none."""
    law = bodies.laws.of_round(wall_index(second), bodies.scene.discs[i].radius_m)
    if law.reach <= 0:
        return None
    x, y, ux, uy = bodies.relative_state(i, instant_s, leg)
    dx, dy, (gx, gy) = x - law.cx, y - law.cy, bodies.acceleration_of(i)
    powers = build_squared_gap_powers((dx, dy), (ux, uy), (gx, gy), law.reach2, inside=shape.inside)
    for wait, meeting in find_contacts(bodies, i, second, instant_s, powers, leg):
        px, py = _compute_position_after(bodies, i, dx, dy, ux, uy, wait)
        on = On.INSIDE if shape.sector is None else _locate_direction(shape.sector, px, py)
        if on is On.BESIDE:
            continue
        if not meeting.decided:
            return _Touch(meeting, on)
        closing = px * (ux + gx * wait) + py * (uy + gy * wait)
        root = closing if shape.inside else ZERO - closing
        return _Touch(meeting._replace(near=RoundApproach(law, px, py, root, wait)), on)
    return None


def _touch_round(
    bodies: BallBodies, i: int, second: int, shape: Round, instant_s: float, leg: BallLeg | None
) -> _Touch | None:
    law = bodies.laws.of_round(wall_index(second), bodies.scene.discs[i].radius_m)
    if law.reach <= 0:  # the disc does not fit inside the arc
        return None
    x, y, ux, uy = bodies.relative_state(i, instant_s, leg)
    dx, dy = x - law.cx, y - law.cy
    a, b, cross = ux * ux + uy * uy, dx * ux + dy * uy, dx * uy - dy * ux
    d = a * law.reach2 - cross * cross
    if d < 0 or a.is_zero() or (not shape.inside and (b >= 0 or d.is_zero() or do_graze(bodies, i, second))):
        return None
    c = dx * dx + dy * dy - law.reach2
    if c < 0 and not shape.inside:  # the disc is inside the full circle: behind the arc, or beyond the arc's end
        return None
    if not (d > 0 and law.reach > 0 and (shape.inside or b < 0)):
        # The time at which the disc is nearest to the centre is used, widened by the uncertainty of D.
        wait = ((ZERO - b) - _compute_upper_root(d)).union(_compute_upper_root(d) - b) / a
        if shape.sector is not None and _locate_direction(shape.sector, dx + ux * wait, dy + uy * wait) is On.BESIDE:
            return None
        earliest = arb(instant_s) + (wait.lower().max(ZERO) if wait.is_finite() else ZERO)
        return _Touch(build_undecided(i, second, instant_s, earliest, resting=shape.inside or not b < 0), On.OPEN)
    root = d.sqrt()
    later = ZERO - c / (b + root) if b > 0 else (root - b) / a
    wait = later if shape.inside else c / (root - b)
    px, py, time = dx + ux * wait, dy + uy * wait, arb(instant_s) + wait
    on = On.INSIDE if shape.sector is None else _locate_direction(shape.sector, px, py)
    begin = bodies.find_last_impact_of_either(i, second, instant_s)
    past = ZERO if shape.inside else 2 * root / a  # time for which the disc would be inside the circle
    if time < instant_s if begin is None else time + past < begin:
        return None
    if begin is not None and not time > begin:
        return _Touch(build_undecided(i, second, instant_s, begin if time < instant_s else time, resting=True), on)
    return _Touch(
        Meeting(i, second, instant_s, time, float_above(time), near=RoundApproach(law, px, py, root, wait)), on
    )


def _locate_foot(stretch: Between, x: arb, y: arb) -> On:
    """Return whether the nearest point of an edge's line to the point (x, y) is on the edge, at an end, or outside."""
    (ax, ay), (bx, by) = stretch
    ex, ey = ball(bx - ax), ball(by - ay)
    after_begin = ex * (x - ball(ax)) + ey * (y - ball(ay))
    after_end = ex * (x - ball(bx)) + ey * (y - ball(by))
    if after_begin < 0 or after_end > 0:
        return On.BESIDE
    if after_begin > 0 and after_end < 0:
        return On.INSIDE
    if after_end < 0:
        return On.BEGIN
    return On.END if after_begin > 0 else On.OPEN


def _locate_direction(sector: Between, x: arb, y: arb) -> On:
    """Return whether the direction (x, y) is inside, outside or at an end of an arc's sector."""
    (fx, fy), (lx, ly) = sector
    turns = []
    for ex, ey, end in ((fx, fy, On.BEGIN), (lx, ly, On.END)):
        turn = ball(ex) * y - ball(ey) * x
        if not (turn > 0 or turn < 0):
            along = ball(ex) * x + ball(ey) * y
            if not along < 0:
                return end if along > 0 else On.OPEN
        turns.append(turn)
    begin_turn, end_turn = turns
    is_inside, is_beside = (begin_turn > 0, end_turn < 0), (begin_turn < 0, end_turn > 0)
    is_reflex = fx * ly - fy * lx < 0
    if any(is_inside) if is_reflex else all(is_inside):
        return On.INSIDE
    if all(is_beside) if is_reflex else any(is_beside):
        return On.BESIDE
    return On.OPEN


def _compute_upper_root(square: arb) -> arb:
    """Return the square root of an interval's upper bound; 0 if the bound is negative."""
    return square.upper().max(ZERO).sqrt()


def find_finite_contact_at_start(scene: Scene, grounds: Mapping[int, int]) -> Degeneracy | None:
    """Return the first contact with a finite wall at the start that makes the motion uncertain; None for none.

    A disc's lasting contact with the wall below it is ignored. `grounds` maps the number of each disc in lasting
    contact to the disc's wall.

    The gap is an interval of many bits. If this interval contains positive and negative numbers, the result is marked
    as not proven.
    """
    with ctx.workprec(_START_BITS):
        bodies = BallBodies(scene)
        for i, disc in enumerate(scene.discs):
            size = SLACK * (max(map(abs, disc.position_m)) + disc.radius_m)
            near = {
                k
                for k, wall in enumerate(scene.arrays.walls if bodies.movable[i] else ())
                if not isinstance(wall, tuple) and grounds.get(i) != wall_body(k)
                if wall.compute_gap(*disc.position_m, disc.radius_m) <= size + SLACK * _find_farthest_coordinate(wall)
            }
            for number, obstacle in enumerate(bodies.obstacles):
                if obstacle.wall in near and (found := _check_start(bodies, i, number)) is not None:
                    kind, gap = found
                    proven = bool(gap.is_zero() or gap < 0)
                    pair = (wall_body(obstacle.wall), i)
                    return Degeneracy(kind, pair, 0.0, 0.0, proven=proven, bits=_START_BITS)
    return None


def _find_farthest_coordinate(wall: Outline) -> float:
    return max(map(abs, (*wall.box[0], *wall.box[1])))


def _check_start(bodies: BallBodies, i: int, number: int) -> tuple[Degenerate, arb] | None:
    """Return the kind of a contact at the start that makes the motion uncertain, and the gap; None for no contact."""
    shape, radius = bodies.obstacles[number].shape, bodies.scene.discs[i].radius_m
    x, y, ux, uy = bodies.relative_state(i, 0.0, bodies.legs_after(wall_body(number), 0.0)[0])
    gx, gy = bodies.gravity
    if isinstance(shape, Plane):
        law = bodies.laws.of_straight(number, radius)
        px, py = map(ball, shape.point)
        free, on = (x - px) * law.nx + (y - py) * law.ny, On.INSIDE
        gap, speed = x * law.nx + y * law.ny - law.level, ux * law.nx + uy * law.ny
        pull = arb(bodies.pulls[number])
        if shape.stretch is not None:
            on = _locate_foot(shape.stretch, x, y)
    else:
        reach = bodies.laws.of_round(number, radius)
        sign = -1 if shape.inside else 1
        dx, dy = x - reach.cx, y - reach.cy
        square = dx * dx + dy * dy
        free, gap, speed, pull = (
            sign * (square - ball(shape.radius2)),
            sign * (square - reach.reach2),
            sign * (dx * ux + dy * uy),
            sign * (ux * ux + uy * uy + dx * gx + dy * gy),
        )
        on = On.INSIDE if shape.sector is None else _locate_direction(shape.sector, dx, dy)
        if reach.reach <= 0 or _passes_stop(bodies, i, number, shape):
            return None
    if gap > 0 or free < 0 or on is On.BESIDE or speed > 0:
        return None
    if speed.is_zero():  # the disc slides or rests, or the surface curves away from it
        return (Degenerate.RESTING_CONTACT, gap) if pull < 0 or not (pull >= 0) else None
    return (Degenerate.OVERLAPPING_START if gap < 0 else Degenerate.TOUCHING_START), gap
