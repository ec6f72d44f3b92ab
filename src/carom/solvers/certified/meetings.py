"""When two bodies meet, as a ball: certified to meet, certified never to, or not decided at this precision.

The time is solved from a float64 instant that is a proven lower bound of it, and nearly equal to it: with the quadratic
of `docs/physics.md`, in which D does not change along the paths, and c is nearly 0, so that the root's error is that of
the distance alone.

Under gravity the gap to a wall is ``w + s t + a t^2 / 2``. Its derivative where it is 0 is plus or minus the root of
``D = s^2 - 2 a w``, so a path reaches the wall from the front at one instant at most: ``(-s - sqrt(D)) / a``.
"""

from __future__ import annotations

from flint import arb

from carom.solvers.certified.ball_bodies import ZERO, BallBodies
from carom.solvers.certified.exact import exactly_grazing, exactly_grazing_wall, pull_along_wall
from carom.solvers.certified.finite_walls import meet_finite, meet_plane
from carom.solvers.certified.floats import float_above
from carom.solvers.certified.meeting import Meeting, PairApproach, WallApproach, undecided
from carom.trace import wall_index


def meet(bodies: BallBodies, disc: int, body: int, at: float) -> Meeting | None:
    """Return the impact of a disc on another body, known not to be before `at`; None where it certainly never comes."""
    if body >= 0:
        return _meet_pair(bodies, min(disc, body), max(disc, body), at)
    if bodies.obstacles[wall_index(body)].kind is not None:
        return meet_finite(bodies, disc, body, at)
    falls_on = bodies.falls and pull_along_wall(bodies.scene, wall_index(body))
    return _fall_on_wall(bodies, disc, body, at) if falls_on else meet_plane(bodies, disc, body, at)


def _fall_on_wall(bodies: BallBodies, i: int, second: int, at: float) -> Meeting | None:
    """Return the impact of disc `i` on a wall along a parabola."""
    k = wall_index(second)
    law = bodies.wall_law(k, bodies.scene.discs[i].radius_m)
    x, y = bodies.place(i, at)
    vx, vy = bodies.velocity(i, arb(at))
    gx, gy = bodies.gravity
    gap, speed, pull = x * law.nx + y * law.ny - law.level, vx * law.nx + vy * law.ny, gx * law.nx + gy * law.ny
    d = speed * speed - 2 * pull * gap
    if d < 0 or d.is_zero() or (bodies.untouched(i) and exactly_grazing_wall(bodies.scene, i, k)):
        return None
    begin = bodies.since(i, second)
    if not d > 0:  # turns back where it may just touch; or it may lie on the wall
        root = d.lower().max(ZERO).sqrt().union(d.upper().sqrt())
        time = arb(at) + (ZERO - speed - root) / pull
    else:
        root = d.sqrt()
        wait = 2 * gap / (root - speed) if speed < 0 else (ZERO - speed - root) / pull  # what subtracts nothing
        time = arb(at) + wait
    if time < begin or (d > 0 and time < at):  # before this path, which is known to be free of impacts until `at`
        return None
    if d > 0 and time > begin:
        return Meeting(i, second, at, time, float_above(time), near=WallApproach(root, wait))
    earliest = time.lower().max(arb(at)) if time.is_finite() else arb(at)
    return undecided(i, second, at, earliest, resting=d > 0 or pull_along_wall(bodies.scene, k) < 0)


def _meet_pair(bodies: BallBodies, i: int, j: int, at: float) -> Meeting | None:
    """Return the impact of discs `i` < `j`."""
    law = bodies.pair_law(i, j)
    (xi, yi), (xj, yj) = bodies.moved(i, at), bodies.moved(j, at)
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
            return undecided(i, j, at, arb(at) + earliest.lower().max(ZERO), resting=not b < 0)
        root = d.sqrt()
        wait = c / (root - b)
    if root is None:
        return None
    if wait is None:
        return undecided(i, j, at, arb(at), resting=True)
    time = arb(at) + wait
    begin = bodies.began(i, j, at)
    if begin is not None and not time > begin:
        if root.is_finite() and time + 2 * root / (ux * ux + uy * uy) < begin:  # had parted before the paths began
            return None
        touching = bool((time - begin).is_zero()) and not bodies.untouched(i, j)
        # Where they overlap already, and are driven together, they meet at once.
        return undecided(i, j, at, begin if time < at else time, resting=True, proven=touching)
    near = PairApproach(xi, yi, xj, yj, dx, dy, ux, uy, root, wait)
    return Meeting(i, j, at, time, float_above(time), near=near)


def _on_a_line(d: arb, u: arb, reach: arb) -> tuple[arb | None, arb | None]:
    """Return root and wait of an impact along an axis: no root where it never comes, no wait where undecided."""
    if d > 0:
        gap, closing = d - reach, ZERO - u
    elif d < 0:
        gap, closing = ZERO - d - reach, u
    else:
        return ZERO, None
    if closing <= 0:
        return None, None
    return (closing * reach, gap / closing) if closing > 0 else (ZERO, None)
