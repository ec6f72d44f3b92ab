"""Times until two bodies meet on their free paths, from any state. The core computes the times."""

from __future__ import annotations

import math

from carom.comparator.stepwise import body_states
from carom.comparator.stepwise.scene_bodies import FiniteWall, Pair
from carom.core import primitives
from carom.core.wall_features import Mover


def compute_wait(state: body_states.BodyStates, pair: Pair, last: int = body_states.NO_FEATURE) -> float:
    """Return the seconds until two bodies meet; infinity if they never meet, 0 if they overlap and approach.

    `last` is the number of the finite wall's edge, end or corner that the disc has just met.
    """
    if state.bodies.slowing.table_m_s2:
        return _compute_wait_on_table(state, pair, last, None)
    wait = state.bodies.slowing.damping.to_damped(_compute_undamped_wait(state, pair, last))
    later = state.bodies.list_later_legs(pair, state.time_s)
    return wait if not later or state.time_s + wait < later[0].begin_s else compute_later_wait(state, pair)


def compute_later_wait(state: body_states.BodyStates, pair: Pair) -> float:
    """Return the seconds until two bodies meet after the next change in the prescribed motion of one of them."""
    for leg in state.bodies.list_later_legs(pair, state.time_s):
        state_on_leg = state.compute_later_state(leg.begin_s - state.time_s)
        wait = _compute_undamped_wait(state_on_leg, pair, body_states.NO_FEATURE)
        if state_on_leg.time_s + wait < leg.end_s:
            state.met |= {pair: state_on_leg.met[pair]} if pair in state_on_leg.met else {}
            return state_on_leg.time_s + wait - state.time_s
    return math.inf


def compute_wait_again(state: body_states.BodyStates, pair: Pair) -> float:
    """Return the seconds from an impact of two bodies until their next impact, if no third body strikes them.

    Two bodies can meet again if a prescribed motion changes the velocity of one of them. On a table, two bodies can
    also meet again, because the table slows each body in its own direction of motion.
    """
    if not state.bodies.slowing.table_m_s2:
        return compute_later_wait(state, pair)
    return _compute_wait_on_table(
        state, pair, body_states.NO_FEATURE, max(0.0, -state.measure_separation(pair).closing)
    )


def _compute_wait_on_table(state: body_states.BodyStates, pair: Pair, last: int, leaving: float | None) -> float:
    """Return the result of `compute_wait` for a scene with a table.

    `leaving` is the speed at which the bodies separate.
    """
    (i, j), bodies, moved, passed = pair, state.bodies, state.select_discs(pair), 0.0
    speeds = [math.hypot(*moved.motion_of(disc)[1]) for disc in moved.discs]
    longest_m = sum(speed * speed for speed in speeds) / (2.0 * bodies.slowing.table_m_s2)
    # If the gap is larger than `longest_m`, the two bodies stop before they meet. The factor 0.99 allows for rounding.
    if 0.99 * state.measure_separation(pair).gap > longest_m:
        return math.inf
    while True:
        stops = min(bodies.slowing.compute_stop_time(math.hypot(*moved.motion_of(disc)[1])) for disc in moved.discs)
        (x, y), (vx, vy) = moved.motion_of(i)
        pull = bodies.compute_table_acceleration(i, (vx, vy))
        if j < bodies.n:
            (ox, oy), (ux, uy) = moved.motion_of(j)
            other = bodies.compute_table_acceleration(j, (ux, uy))
            one = (x - ox, y - oy, vx - ux, vy - uy, bodies.radius[i])
            relative = (pull[0] - other[0], pull[1] - other[1])
            wait = primitives.disc_fall_time(*one, 0.0, 0.0, bodies.radius[j], *relative, leaving)
        elif isinstance(wall := bodies.walls[j - bodies.n], tuple):
            wait = primitives.wall_fall_time(x, y, vx, vy, bodies.radius[i], wall, *pull)
        else:
            disc = Mover.at((x, y), (vx, vy), bodies.radius[i])
            wait = _compute_fall_wait(state, pair, wall, disc, pull, last)
        if wait <= stops:
            return passed + wait
        if stops == math.inf:
            return math.inf
        moved.move_freely(stops)
        passed, leaving, last = passed + stops, None, body_states.NO_FEATURE


def _compute_undamped_wait(state: body_states.BodyStates, pair: Pair, last: int) -> float:
    """Return the result of `compute_wait` without damping, as if driven bodies kept their velocity."""
    (i, j), bodies = pair, state.bodies
    (x, y), (vx, vy) = state.motion_of(i)
    radius = bodies.radius[i]
    if j >= bodies.n:
        wall = bodies.walls[j - bodies.n]
        if not isinstance(wall, tuple):
            return _compute_finite_wall_wait(state, pair, wall, last)
        x, y = bodies.to_wall_frame(j - bodies.n, x, y, state.time_s)
        wx, wy = bodies.wall_velocity(j - bodies.n, state.time_s)
        vx, vy = vx - wx, vy - wy
        if not bodies.is_pulled(i):
            return primitives.wall_time(x, y, vx, vy, radius, wall)
        return primitives.wall_fall_time(x, y, vx, vy, radius, wall, *bodies.gravity)
    (ox, oy), (ux, uy) = state.motion_of(j)
    if bodies.is_pulled(i) == bodies.is_pulled(j):  # gravity accelerates both discs equally
        return primitives.pair_time(x, y, vx, vy, radius, ox, oy, ux, uy, bodies.radius[j])
    if bodies.is_pulled(i):
        return primitives.disc_fall_time(x, y, vx - ux, vy - uy, radius, ox, oy, bodies.radius[j], *bodies.gravity)
    return primitives.disc_fall_time(ox, oy, ux - vx, uy - vy, bodies.radius[j], x, y, radius, *bodies.gravity)


def _compute_finite_wall_wait(state: body_states.BodyStates, pair: Pair, wall: FiniteWall, last: int) -> float:
    disc = state.build_mover(*pair)
    if state.bodies.is_pulled(pair[0]):
        return _compute_fall_wait(state, pair, wall, disc, state.bodies.gravity, last)
    wait, feature, _ = wall.features.first_touch(disc, last)
    if feature != body_states.NO_FEATURE:
        state.met[pair] = feature
    return wait


def _compute_fall_wait(
    state: body_states.BodyStates,
    pair: Pair,
    wall: FiniteWall,
    disc: Mover,
    acceleration: tuple[float, float],
    last: int,
) -> float:
    leaving = 0.0
    if last != body_states.NO_FEATURE:
        nx, ny = wall.features.normal(last, disc)
        leaving = max(0.0, disc.ux[0] * nx + disc.uy[0] * ny)
    wait, feature = wall.features.first_fall(disc, *acceleration, last, leaving)
    if feature != body_states.NO_FEATURE:
        state.met[pair] = feature
    return wait
