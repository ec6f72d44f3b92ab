"""When two bodies meet, as a ball: certified to meet, certified never to, or not decided at this precision.

The time is solved from a float64 instant that is a proven lower bound of it, and nearly equal to it. With d and u the
relative position and velocity there, ``a t^2 + 2 b t + c = 0`` has its earlier root at ``t = c / (-b + sqrt(D))``; c is
nearly 0, so the root's error is that of the distance alone. ``D = a R^2 - (d x u)^2`` stands in place of
``b^2 - a c``, since the cross product does not change along the paths.

Under gravity the gap to a wall is ``w + s t + a t^2 / 2``. Its derivative where it is 0 is plus or minus the root of
``D = s^2 - 2 a w``, so a path reaches the wall from the front at one instant at most: ``(-s - sqrt(D)) / a``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flint import arb

from carom.solvers.certified.bodies import ZERO, BallBodies, BallImpact, PairLaw
from carom.solvers.certified.exact import exactly_grazing, exactly_grazing_wall, pull_along_wall

__all__ = ["Meeting", "float_above", "float_below", "meet_pair", "meet_wall"]


def float_below(ball: arb) -> float:
    """Return a float64 no greater than anything in a ball of numbers from 0."""
    lower = ball.lower()
    value = float(lower)  # python-flint 0.9 rounds to the nearest, which may be above
    return value if value <= lower else math.nextafter(value, 0.0)


def float_above(ball: arb) -> float:
    """Return a float64 no less than anything in a ball of numbers from 0."""
    upper = ball.upper()
    value = float(upper)
    return value if value >= upper else math.nextafter(value, math.inf)


class Meeting(NamedTuple):
    """A possible impact of two bodies on their present paths.

    Attributes:
        first: Disc.
        second: Disc, of a higher number, or wall.
        at: Float64 instant from which it was solved, seconds; the impact is not before it.
        time: Ball that holds the time of impact; where undecided, that of the earliest it could be.
        latest: Float64 no less than anything in `time`.
        decided: Whether the impact is certain.
        resting: Whether it is undecided because the bodies may be in contact already, rather than for a graze.
        proven: Whether the contact is certain, and it is only the order of impacts that has no answer.
        fall: Root of D and time from `at` of an impact on a wall that gravity has a part along; else None.
        pair: What a pair's impact needs besides: positions of both at `at`, relative position and velocity, the root of
            D and the time from `at`; None for a wall.
    """

    first: int
    second: int
    at: float
    time: arb
    latest: float
    decided: bool
    resting: bool = False
    proven: bool = False
    pair: tuple[arb, ...] | None = None
    fall: tuple[arb, arb] | None = None

    def carry_out(self, bodies: BallBodies) -> BallImpact:
        """Give both bodies the state after this impact, and return it."""
        if self.fall is not None:
            return bodies.settle_falling(self.first, -1 - self.second, self.at, self.time, self.latest, *self.fall)
        if self.second < 0:
            return bodies.settle_wall(self.first, -1 - self.second, self.at, self.time, self.latest)
        return _collide(bodies, self)


def meet_wall(bodies: BallBodies, i: int, k: int, at: float) -> Meeting | None:
    """Return the impact of disc `i` on wall `k`, known not to be before `at`; None where it certainly never comes."""
    if bodies.falls and pull_along_wall(bodies.scene, k):
        return _fall_on_wall(bodies, i, k, at)
    law = bodies.wall_law(k, bodies.scene.discs[i].radius_m)
    vx, vy = bodies.vx[i], bodies.vy[i]
    speed = vx * law.nx + vy * law.ny
    if speed >= 0:
        return None
    x, y = bodies.moved(i, at)
    gap = x * law.nx + y * law.ny - law.level
    second = -1 - k
    if not speed < 0:  # along the wall: at the earliest as fast as the ball of its speed allows
        toward = ZERO - speed.lower()
        resting = not gap > 0
        time = arb(at) + (gap / toward).lower().max(ZERO)
        return Meeting(i, second, at, time, float_above(time), False, resting)
    time = arb(at) - gap / speed
    if time < at:  # before this path, which is known to be free of impacts until then
        return None
    begin = bodies.began(i, second, at)
    decided = begin is None or bool(time > begin)
    return Meeting(i, second, at, time, float_above(time), decided, resting=not decided)


def _fall_on_wall(bodies: BallBodies, i: int, k: int, at: float) -> Meeting | None:
    """Return the impact of disc `i` on wall `k` along a parabola."""
    second = -1 - k
    gap, speed, pull = _fall_of_gap(bodies, i, k, at)
    d = speed * speed - 2 * pull * gap
    away = pull_along_wall(bodies.scene, k) > 0
    if d < 0 or d.is_zero() or (bodies.untouched(i) and exactly_grazing_wall(bodies.scene, i, k)):
        return None
    begin = bodies.since(i, second)
    if not d > 0:  # turns back where it may just touch; or it may lie on the wall
        least, most = d.lower().max(ZERO).sqrt(), d.upper().sqrt()
        time = arb(at) + (ZERO - speed - least.union(most)) / pull
        if time < begin:
            return None
        time = _earliest(time, at)
        return Meeting(i, second, at, time, float_above(time), False, resting=not away)
    wait = _wait(gap, speed, pull, d)
    time = arb(at) + wait
    if time < begin or time < at:  # before this path, which is known to be free of impacts until `at`
        return None
    if not time > begin:
        time = _earliest(time, at)
        return Meeting(i, second, at, time, float_above(time), False, resting=True)
    return Meeting(i, second, at, time, float_above(time), True, fall=(d.sqrt(), wait))


def _fall_of_gap(bodies: BallBodies, i: int, k: int, at: float) -> tuple[arb, arb, arb]:
    """Return gap, speed and acceleration along a wall's normal at an exact instant, times the normal's length."""
    law = bodies.wall_law(k, bodies.scene.discs[i].radius_m)
    x, y = bodies.place(i, at)
    vx, vy = bodies.velocity(i, arb(at))
    gx, gy = bodies.gravity
    return x * law.nx + y * law.ny - law.level, vx * law.nx + vy * law.ny, gx * law.nx + gy * law.ny


def _wait(gap: arb, speed: arb, pull: arb, d: arb) -> arb:
    """Return the time until the gap closes; of two forms of it, the one that subtracts nothing."""
    return 2 * gap / (d.sqrt() - speed) if speed < 0 else (ZERO - speed - d.sqrt()) / pull


def _earliest(time: arb, at: float) -> arb:
    """Return the least of what a time may be that is not before `at`."""
    return time.lower().max(arb(at)) if time.is_finite() else arb(at)


def meet_pair(bodies: BallBodies, i: int, j: int, at: float) -> Meeting | None:
    """Return the impact of discs `i` < `j`, known not to be before `at`; None where it certainly never comes."""
    law = bodies.pair_law(i, j)
    xi, yi = bodies.moved(i, at)
    xj, yj = bodies.moved(j, at)
    dx, dy = xj - xi, yj - yi
    ux, uy = bodies.vx[j] - bodies.vx[i], bodies.vy[j] - bodies.vy[i]
    if dy.is_zero() and uy.is_zero():
        root, wait = _on_a_line(dx, ux, law.reach)
    elif dx.is_zero() and ux.is_zero():
        root, wait = _on_a_line(dy, uy, law.reach)
    else:
        b = dx * ux + dy * uy
        cross = dx * uy - dy * ux
        d = (ux * ux + uy * uy) * law.reach2 - cross * cross
        c = dx * dx + dy * dy - law.reach2
        if not (b < 0 and d > 0):
            if b >= 0 or d < 0 or d.is_zero() or (bodies.untouched(i, j) and exactly_grazing(bodies.scene, i, j)):
                return None
            earliest = c.lower() / ((ZERO - b).upper() + d.upper().max(ZERO).sqrt())
            time = arb(at) + earliest.lower().max(ZERO)
            return Meeting(i, j, at, time, float_above(time), False, resting=not b < 0)
        root = d.sqrt()
        wait = c / (root - b)
    if root is None:
        return None
    if wait is None:
        return Meeting(i, j, at, arb(at), float_above(arb(at)), False, resting=True)
    time = arb(at) + wait
    begin = bodies.began(i, j, at)
    if begin is not None and not time > begin:
        if root.is_finite() and _already_apart(wait, root, ux, uy, at, begin):
            return None
        touching = bool((time - begin).is_zero()) and not bodies.untouched(i, j)
        if time < at:  # they overlap: driven together, they meet at once
            time = begin
        return Meeting(i, j, at, time, float_above(time), False, resting=True, proven=touching)
    latest = float_above(time)
    return Meeting(i, j, at, time, latest, True, pair=(xi, yi, xj, yj, dx, dy, ux, uy, root, wait))


def _on_a_line(d: arb, u: arb, reach: arb) -> tuple[arb | None, arb | None]:
    """Return the root of D and the time from now of an impact along an axis; no root where it never comes."""
    if d > 0:
        gap, closing = d - reach, ZERO - u
    elif d < 0:
        gap, closing = ZERO - d - reach, u
    else:
        return ZERO, None
    if closing <= 0:
        return None, None
    if not closing > 0:
        return ZERO, None
    return closing * reach, gap / closing


def _already_apart(wait: arb, root: arb, ux: arb, uy: arb, at: float, begin: arb) -> bool:
    """Whether the bodies, on their paths extended backwards, had parted again before the paths began."""
    parted = arb(at) + wait + 2 * root / (ux * ux + uy * uy)
    return bool(parted < begin)


def _collide(bodies: BallBodies, meeting: Meeting) -> BallImpact:
    """Carry out the impact of two discs. At contact ``d.u = -sqrt(D)`` and ``|d| = R``: neither is computed again."""
    i, j = meeting.first, meeting.second
    assert meeting.pair is not None  # noqa: S101 - a decided meeting of two discs holds it
    xi, yi, xj, yj, dx, dy, ux, uy, root, wait = meeting.pair
    law = bodies.pair_law(i, j)
    time = meeting.time
    before = (*bodies.velocity(i, time), *bodies.velocity(j, time)) if bodies.falls else None
    vxi, vyi, vxj, vyj = bodies.vx[i], bodies.vy[i], bodies.vx[j], bodies.vy[j]
    if dy.is_zero() and uy.is_zero():
        nx, ny = (law.reach if dx > 0 else ZERO - law.reach), ZERO
        vxi, vxj, xi, xj = _exchange(law, vxi, vxj, xi, xj, nx)
    elif dx.is_zero() and ux.is_zero():
        nx, ny = ZERO, (law.reach if dy > 0 else ZERO - law.reach)
        vyi, vyj, yi, yj = _exchange(law, vyi, vyj, yi, yj, ny)
    else:
        nx, ny = dx + ux * wait, dy + uy * wait
        if bodies.movable[i]:
            push = law.push_i * root
            px, py = push * nx, push * ny
            vxi, vyi, xi, yi = vxi - px, vyi - py, xi + px * wait, yi + py * wait
        if bodies.movable[j]:
            push = law.push_j * root
            px, py = push * nx, push * ny
            vxj, vyj, xj, yj = vxj + px, vyj + py, xj - px * wait, yj - py * wait
    for disc, x, y, vx, vy in ((i, xi, yi, vxi, vyi), (j, xj, yj, vxj, vyj)):
        if bodies.movable[disc]:
            bodies.x[disc], bodies.y[disc], bodies.vx[disc], bodies.vy[disc] = x, y, vx, vy
    bodies.note_pair(i, j, meeting.at, meeting.time, meeting.latest)
    after = (*bodies.velocity(i, time), *bodies.velocity(j, time)) if bodies.falls else (vxi, vyi, vxj, vyj)
    return BallImpact(i, j, time, nx, ny, law.reach, after, before)


def _exchange(law: PairLaw, vi: arb, vj: arb, xi: arb, xj: arb, contact: arb) -> tuple[arb, arb, arb, arb]:
    """Return velocities and positions after an impact along one axis, each a mean of what was before.

    In ``x + share (gap)`` the error of x would count twice; as a mean of both positions it hardly grows.
    """
    return (
        law.keep_i * vi + law.share_i * vj,
        law.keep_j * vj + law.share_j * vi,
        law.keep_i * xi + law.share_i * (xj - contact),
        law.keep_j * xj + law.share_j * (xi + contact),
    )
