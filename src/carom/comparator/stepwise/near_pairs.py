"""Search for near pairs: bodies that are so close that they may meet, push or rest in some steps."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carom.comparator.scales import compute_lengths
from carom.comparator.stepwise.scene_bodies import Pair
from carom.comparator.stepwise.step_block import Block
from carom.comparator.stepwise.waits import compute_wait
from carom.model.broad_phase import find_near_pairs, find_near_walls
from carom.model.disc_arrays import STANDS, list_wall_lengths
from carom.model.prescribed_motion import Drive

Array = NDArray[np.float64]
Bodies = NDArray[np.intp]
Flags = NDArray[np.bool_]

#: Largest number of steps between a meeting and a change of velocities. An engine may change velocities before the
#: meeting (speculative margins), or still push bodies apart after the meeting (soft contacts).
MARGIN_STEPS = 2.0

#: A body may rest at a gap of up to this fraction of the contact distance. Engines keep gaps below a hundredth.
RESTING_GAP = 0.02


@dataclass(frozen=True, eq=False)
class NearPairs:
    """Pairs of discs, or of discs and walls, in some steps. Arrays have a column per pair, and a row per state or step.

    Attributes:
        begin: Number of the first step.
        first: Number of the first body of each pair, a disc.
        second: Number of the second body of each pair, a disc or a wall.
        gap: Gap between the bodies at each state, in metres; negative if they overlap.
        closing: Speed at which the bodies approach at each state, in metres per second.
        wait: Seconds from each step's start until the bodies meet; infinity if they do not meet.
        closing_acceleration: Acceleration by which gravity brings the bodies together at each state, in metres per
            second squared. Negative if gravity separates the bodies, and 0 for two discs that both fall.
        gap_rounding: Rounding error of a gap, in metres.
        speed_rounding: Rounding error of a speed, in metres per second.
    """

    begin: int
    first: Bodies
    second: Bodies
    gap: Array
    closing: Array
    wait: Array
    closing_acceleration: Array
    gap_rounding: Array
    speed_rounding: Array

    @cached_property
    def pairs(self) -> list[Pair]:
        """The pairs."""
        return list(zip(self.first.tolist(), self.second.tolist(), strict=True))

    def list_discs(self, count: int) -> tuple[Bodies, Bodies]:
        """Return the discs of each pair in a scene of `count` discs.

        For a pair with a wall, both numbers are the disc's.
        """
        return self.first, np.where(self.second < count, self.second, self.first)

    def find_within_reach(self, block: Block) -> Flags:
        """Return, for each step and pair, whether the two bodies are near enough to meet in the step.

        Pairs that only meet if a third body strikes one of the two in this step are included.
        """
        bodies, steps = block.bodies, slice(self.begin, self.begin + len(self.wait))
        h = block.step_s[steps, None]
        own_speed = block.own_speed[steps] + bodies.fastest_wall
        fastest = np.maximum.reduce(own_speed, axis=1, keepdims=True)
        reach_ahead = h * (own_speed + np.maximum((1.0 + MARGIN_STEPS) * own_speed, fastest + bodies.pull * h))
        reach_ahead += RESTING_GAP * block.scene.arrays.radius_m
        one, other = self.list_discs(bodies.n)
        reach = reach_ahead[:, one] + np.where(one != other, reach_ahead[:, other], 0.0)
        within_reach: Flags = self.gap[:-1] <= reach
        return within_reach


def find_disc_pairs(block: Block, begin: int, end: int) -> Iterator[NearPairs]:
    """Yield the pairs of discs that are near each other in the steps from `begin` to `end`."""
    arrays, bodies = block.scene.arrays, block.bodies
    centre, reach = _bound_paths(block, begin, end)
    p, v = block.states.position_m[begin : end + 1], block.states.velocity_m_s[begin : end + 1]
    for first, second in find_near_pairs(centre, reach, arrays.movable):
        if not len(first):
            continue
        d, u = p[:, second] - p[:, first], v[:, second] - v[:, first]
        contact = arrays.radius_m[first] + arrays.radius_m[second]
        distance, b = compute_lengths(d), _multiply(d, u)
        gap = distance - contact
        # d points from the first to the second disc. Gravity along d brings the discs together if only the first disc
        # is movable, and gravity against d if only the second disc is movable.
        falls = arrays.movable[first].astype(float) - arrays.movable[second]
        with np.errstate(divide="ignore", invalid="ignore"):
            closing = np.where(distance > 0.0, -b / distance, 0.0)
            pulled = np.where(distance > 0.0, falls * (d @ np.array(bodies.gravity)) / distance, 0.0)
        place_rounding = block.place_rounding[begin:end]
        gap_rounding = place_rounding[:, first] + place_rounding[:, second]
        speeds = block.own_speed[begin:end]
        speed_rounding = block.unit * np.maximum(speeds[:, first], speeds[:, second])
        with np.errstate(divide="ignore", invalid="ignore"):
            a, c = _multiply(u[:-1], u[:-1]), (gap * (distance + contact))[:-1]
            root = b[:-1] ** 2 - a * c
            wait = np.where((b[:-1] < 0.0) & (root > 0.0), c / (-b[:-1] + np.sqrt(np.maximum(root, 0.0))), np.inf)
            wait = bodies.slowing.damping.to_damped_array(wait)
        wait = np.where((b[:-1] < 0.0) & (gap[:-1] <= gap_rounding), 0.0, wait)
        wait = np.where((gap[:-1] <= gap_rounding) & (closing[:-1] <= speed_rounding), np.inf, np.maximum(wait, 0.0))
        bent = np.flatnonzero((falls != 0.0) & (bodies.pull > 0.0) | (bodies.slowing.table_m_s2 > 0.0))
        near = NearPairs(begin, first, second, gap, closing, wait, pulled, gap_rounding, speed_rounding)
        _meet_on_bent_paths(block, near, bent.tolist())
        yield near


def find_wall_pairs(block: Block, begin: int, end: int) -> Iterator[NearPairs]:
    """Yield the pairs of a disc and a wall that are near each other in the steps from `begin` to `end`."""
    moving = defaultdict[Drive, list[int]](list)
    for k, drive in enumerate(block.bodies.wall_drives):
        moving[drive].append(k)
    for drive, numbers in moving.items():
        yield from _find_pairs_with_walls(block, begin, end, drive, numbers)


def _find_pairs_with_walls(
    block: Block, begin: int, end: int, drive: Drive, walls_of_it: list[int]
) -> Iterator[NearPairs]:
    """Yield the near pairs of discs and walls in some steps. All walls of `walls_of_it` have the motion `drive`."""
    arrays, bodies = block.scene.arrays, block.bodies
    centre, reach = _bound_paths(block, begin, end, drive)
    p, v = _compute_relative_motion(block, begin, end, drive)
    speeds = block.own_speed[begin:end] + drive.fastest
    bends = len(drive.legs) > 1 or bodies.slowing.table_m_s2 > 0.0
    one_by_one = [k for k in walls_of_it if bends or not isinstance(arrays.walls[k], tuple)]
    yield from _find_one_by_one(block, begin, end, centre, reach, one_by_one)
    numbers = np.array([k for k in walls_of_it if k not in one_by_one], dtype=np.intp)
    walls = np.array([arrays.walls[k] for k in numbers], dtype=np.float64).reshape(-1, 4)
    for disc, wall in find_near_walls(centre, reach, arrays.movable, walls):
        if not len(disc):
            continue
        plane = walls[wall]
        normal = plane[:, 2:]
        gap = _multiply(p[:, disc] - plane[:, :2], normal) - arrays.radius_m[disc]
        speed = _multiply(v[:, disc], normal)
        pull = normal @ np.array(bodies.gravity)
        far = block.place_unit * np.max(np.abs(plane[:, :2]), axis=1)
        gap_rounding, speed_rounding = block.place_rounding[begin:end, disc] + far, block.unit * speeds[:, disc]
        g, s = gap[:-1], speed[:-1]
        with np.errstate(divide="ignore", invalid="ignore"):
            straight = bodies.slowing.damping.to_damped_array(np.where(s < 0.0, g / -s, np.inf))
            root = s * s - 2.0 * pull * g
            high = np.sqrt(np.maximum(root, 0.0))
            # Use the solution at which the gap closes, in a form that avoids subtracting nearly equal numbers.
            bent = np.where(s < 0.0, 2.0 * g / (-s + high), (s + high) / -pull)
            bent = np.where((root < 0.0) | ((pull > 0.0) & (s >= 0.0)), np.inf, bent)
            wait = np.where(pull == 0.0, straight, bent)
        wait = np.where((g <= gap_rounding) & (s < -speed_rounding), 0.0, wait)
        wait = np.where((g <= gap_rounding) & (s >= -speed_rounding) & (pull == 0.0), np.inf, np.maximum(wait, 0.0))
        pulled = np.broadcast_to(-pull, gap.shape)
        yield NearPairs(begin, disc, bodies.n + numbers[wall], gap, -speed, wait, pulled, gap_rounding, speed_rounding)


def _find_one_by_one(
    block: Block, begin: int, end: int, centre: Array, reach: Array, numbers: list[int]
) -> Iterator[NearPairs]:
    """Yield the near pairs of discs and the given walls in some steps, and solve each pair separately."""
    arrays, bodies = block.scene.arrays, block.bodies
    for k in numbers:
        wall = arrays.walls[k]
        speeds = block.own_speed[begin:end] + bodies.wall_drives[k].fastest
        far = block.place_unit * max(map(abs, list_wall_lengths(wall)))
        for i in np.flatnonzero(arrays.movable).tolist():
            x, y = centre[i].tolist()
            if isinstance(wall, tuple):
                away = (x - wall[0]) * wall[2] + (y - wall[1]) * wall[3]
            else:
                away = wall.compute_gap(x, y, 0.0)
            if away > float(reach[i]):
                continue
            pair = (i, bodies.n + k)
            separations = [block.state(step, (i,)).measure_separation(pair) for step in range(begin, end + 1)]
            gap, closing = (np.array([[getattr(one, name)] for one in separations]) for name in ("gap", "closing"))
            gap_rounding, speed_rounding = block.place_rounding[begin:end, [i]] + far, block.unit * speeds[:, [i]]
            wait = np.full((end - begin, 1), np.inf)
            near = gap[:-1, 0] < (1.0 + MARGIN_STEPS) * 2.0 * speeds[:, i] * block.step_s[begin:end]
            for row in np.flatnonzero(near).tolist():
                wait[row, 0] = compute_wait(block.state(begin + row, (i,)), pair)
            touches = gap[:-1] <= gap_rounding
            wait = np.where(touches & (closing[:-1] > speed_rounding), 0.0, wait)
            wait = np.where(touches & (closing[:-1] <= speed_rounding) & (wait == 0.0), np.inf, wait)
            pulled = np.array([[one.normal] for one in separations]) @ np.array(bodies.gravity)
            yield NearPairs(
                begin, np.array([i]), np.array([bodies.n + k]), gap, closing, wait, pulled, gap_rounding, speed_rounding
            )


def _multiply(one: Array, other: Array) -> Array:
    """Return the scalar products of vectors, whose two components are the last axis."""
    products: Array = one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1]
    return products


def _compute_relative_motion(block: Block, begin: int, end: int, drive: Drive) -> tuple[Array, Array]:
    """Return positions and velocities of discs in some steps, relative to a wall with the motion `drive`."""
    p, v = block.states.position_m[begin : end + 1], block.states.velocity_m_s[begin : end + 1]
    if drive.is_stationary:
        return p, v
    times_s = block.states.time_s[begin : end + 1].tolist()
    displacement, speed = ([compute(time_s) for time_s in times_s] for compute in (drive.moved_at, drive.velocity_at))
    return p - np.array(displacement)[:, None], v - np.array(speed)[:, None]


def _bound_paths(block: Block, begin: int, end: int, drive: Drive = STANDS) -> tuple[Array, Array]:
    """Return the centre and radius of a circle around each disc's path, relative to a wall with the motion `drive`.

    If two discs may meet or push each other, their circles overlap. If a disc may meet a wall, its circle overlaps the
    wall.
    """
    p, _ = _compute_relative_motion(block, begin, end, drive)
    own_speed = block.own_speed[begin:end] + drive.fastest
    low, high = np.minimum.reduce(p), np.maximum.reduce(p)
    longest = float(np.maximum.reduce(block.step_s[begin:end]))
    greatest = np.maximum.reduce(own_speed)
    # A third body may strike one of the two bodies within the step and pass its speed on.
    fastest = float(np.maximum.reduce(greatest)) + block.bodies.pull * longest
    most_way = 2.0 * fastest * longest
    own_way = (1.0 + MARGIN_STEPS) * longest * greatest
    radius = block.scene.arrays.radius_m
    reach = radius * (1.0 + RESTING_GAP) + 0.5 * np.hypot(*(high - low).T) + np.maximum(own_way, 0.5 * most_way)
    return 0.5 * (low + high), reach


def _meet_on_bent_paths(block: Block, near: NearPairs, columns: Sequence[int]) -> None:
    """Compute when near pairs meet on curved paths: discs that fall onto immovable bodies, and pairs on a table."""
    steps = slice(near.begin, near.begin + len(near.wait))
    for column in columns:
        i, j = near.pairs[column]
        fast = block.own_speed[steps, [i, j]].max(axis=1)
        near.wait[:, column] = np.inf
        close = near.gap[:-1, column] < (1.0 + MARGIN_STEPS) * 2.0 * fast * block.step_s[steps]
        for row in np.flatnonzero(close).tolist():
            near.wait[row, column] = compute_wait(block.state(near.begin + row, (i, j)), (i, j))
