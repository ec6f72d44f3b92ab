"""Times, as intervals, at which two bodies meet. An impact is certain, undecided, or certainly does not happen.

The time is the root of a quadratic equation (`docs/theory/pic.md`). In this equation, time is measured from an instant
that is proven to be shortly before the impact. So the equation's constant term is nearly 0, and only the error of the
distance affects the root.

A driven body's path consists of straight parts with constant velocity, called *legs*. The legs are examined one by one.
An impact during one leg must come before the next leg starts.
"""

from __future__ import annotations

from flint import arb

from carom.model.trace import wall_index
from carom.solvers.certified.ball_arithmetic import ZERO, BallLeg, float_above
from carom.solvers.certified.contacts import gap_on_same_ground, meet_end
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.exact import do_graze
from carom.solvers.certified.meeting import Meeting, PairApproach, build_undecided, find_contacts
from carom.solvers.certified.sign_changes import build_squared_gap_powers
from carom.solvers.certified.wall_meetings import meet_feature, meet_straight


def meet(bodies: BallBodies, disc: int, body: int, instant_s: float) -> Meeting | None:
    """Return the next impact of a disc with another body; None if there is certainly no impact.

    `instant_s` is a lower bound of the impact's time.
    """
    if disc == body:
        return meet_end(bodies, disc, instant_s)
    if body < 0 and body in bodies.contacts.barred[disc]:
        return None
    driven = body if body < 0 or not bodies.movable[body] else disc  # the body that may have a prescribed motion
    for leg in bodies.legs_after(driven, instant_s):
        begin_s = instant_s if leg is None else max(instant_s, leg.begin_s)
        meeting = _meet_on_leg(bodies, disc, body, begin_s, leg)
        if meeting is None or leg is None or meeting.time < leg.end_s:
            if meeting is not None or leg is None:
                return meeting
        elif not meeting.time >= leg.end_s:
            return build_undecided(meeting.first, meeting.second, begin_s, meeting.time, resting=False, turning=True)
    return None


def _meet_on_leg(bodies: BallBodies, disc: int, body: int, instant_s: float, leg: BallLeg | None) -> Meeting | None:
    """Return the result of `meet`, as if a body with a prescribed motion kept the velocity of `leg` for ever."""
    if body >= 0:
        pair = min(disc, body), max(disc, body)
        curved = any(bodies.acceleration[i] is not None for i in pair)
        curved = curved or (bodies.falls and not all(bodies.movable[i] for i in pair))
        return _meet_on_curves(bodies, *pair, instant_s, leg) if curved else _meet_pair(bodies, *pair, instant_s)
    k = wall_index(body)
    if bodies.obstacles[k].kind is not None:
        return meet_feature(bodies, disc, body, instant_s, leg)
    return meet_straight(bodies, disc, body, instant_s, leg)


def _meet_on_curves(bodies: BallBodies, i: int, j: int, instant_s: float, leg: BallLeg | None) -> Meeting | None:
    """Return the impact of discs `i` < `j`, at least one on a curved path; None if there is certainly no impact."""
    law, (ax, ay), (bx, by) = bodies.laws.of_discs(i, j), bodies.acceleration_of(i), bodies.acceleration_of(j)
    pull = (bx - ax, by - ay)
    (xi, yi), (xj, yj) = bodies.centre(i, instant_s), bodies.centre(j, instant_s)
    (ui, vi), (uj, vj) = bodies.velocity(i, arb(instant_s), instant_s), bodies.velocity(j, arb(instant_s), instant_s)
    d, u = (xj - xi, yj - yi), (uj - ui, vj - vi)
    powers = gap_on_same_ground(bodies, i, j, instant_s, law.reach) or build_squared_gap_powers(d, u, pull, law.reach2)
    for wait, meeting in find_contacts(bodies, i, j, instant_s, powers, leg):
        if not meeting.decided:
            return meeting
        near = PairApproach(
            *bodies.centre_in_frame(i, instant_s), *bodies.centre_in_frame(j, instant_s), *d, *u, ZERO, wait, pull
        )
        x, y = near.offset()
        root = ZERO - x * (u[0] + pull[0] * wait) - y * (u[1] + pull[1] * wait)
        return meeting._replace(near=near._replace(root=root))
    return None


def _meet_pair(bodies: BallBodies, i: int, j: int, instant_s: float) -> Meeting | None:
    """Return the impact of discs `i` < `j` on straight paths; None if there is certainly no impact."""
    law = bodies.laws.of_discs(i, j)
    (xi, yi, vxi, vyi), (xj, yj, vxj, vyj) = bodies.state_in_frame(i, instant_s), bodies.state_in_frame(j, instant_s)
    dx, dy, ux, uy = xj - xi, yj - yi, vxj - vxi, vyj - vyi
    if dy.is_zero() and uy.is_zero():
        root, wait = _solve_on_line(dx, ux, law.reach)
    elif dx.is_zero() and ux.is_zero():
        root, wait = _solve_on_line(dy, uy, law.reach)
    else:
        b = dx * ux + dy * uy
        cross = dx * uy - dy * ux
        d = (ux * ux + uy * uy) * law.reach2 - cross * cross
        c = dx * dx + dy * dy - law.reach2
        if not (b < 0 and d > 0):
            if b >= 0 or d < 0 or d.is_zero() or do_graze(bodies, i, j):
                return None
            earliest = c.lower() / ((ZERO - b).upper() + d.upper().max(ZERO).sqrt())
            return build_undecided(i, j, instant_s, arb(instant_s) + earliest.lower().max(ZERO), resting=not b < 0)
        root = d.sqrt()
        wait = c / (root - b)
    if root is None:
        return None
    if wait is None:
        return build_undecided(i, j, instant_s, arb(instant_s), resting=True)
    time = arb(instant_s) + wait
    begin = bodies.find_last_impact_of_either(i, j, instant_s)
    if begin is not None and not time > begin:
        if (
            root.is_finite() and time + 2 * root / (ux * ux + uy * uy) < begin
        ):  # the discs already separate when the later path starts
            return None
        touching = bool((time - begin).is_zero()) and not bodies.are_at_start(i, j)
        # Discs that already overlap and approach each other meet at once.
        return build_undecided(i, j, instant_s, begin if time < instant_s else time, resting=True, proven=touching)
    near = PairApproach(xi, yi, xj, yj, dx, dy, ux, uy, root, wait)
    return Meeting(i, j, instant_s, time, float_above(time), near=near)


def _solve_on_line(d: arb, u: arb, reach: arb) -> tuple[arb | None, arb | None]:
    """Return `root` and `wait` (see `PairApproach`) of an impact along an axis.

    Without an impact, `root` is None. If the impact is undecided, `wait` is None.
    """
    if d > 0:
        gap, closing = d - reach, ZERO - u
    elif d < 0:
        gap, closing = ZERO - d - reach, u
    else:
        return ZERO, None
    if closing <= 0:
        return None, None
    return (closing * reach, gap / closing) if closing > 0 else (ZERO, None)
