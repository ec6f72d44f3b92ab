"""Which pairs meet, push or rest in which step: found for all steps of a block at once."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.broad_phase import near_pairs, near_walls
from carom.comparator.local_truth.bodies import BodyStates, Law, Pair, exact_run
from carom.scene import Scene
from carom.windows import States

__all__ = ["MARGIN_STEPS", "Activity", "Block", "activity_of"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: An engine may answer a meeting so many steps ahead (speculative margins), or still push after it (soft contacts).
MARGIN_STEPS = 2.0

#: A pair that gravity presses together rests while it closes or parts by no more than what it falls in so many steps:
#: an engine that holds velocities shows one step's fall or none, one that holds places two and a half at most
#: (Box2D and MuJoCo `default`, 8 starts each).
RESTING_STEPS = 2.5

#: It rests at a distance of up to this part of the contact distance: margins of engines are below a hundredth.
RESTING_GAP = 0.02

#: An engine may answer a meeting by a margin of length, however many fine steps ahead (Box2D `default`: 1 cm before a
#: wall, a tenth of the smallest discs of the catalogue). A turn is such an answer where the disc closes on something no
#: further away than this part of the contact distance, and parts from it after; else it turned with nothing near.
_AHEAD_GAP = 0.25

#: The two instants of a step are right to half a unit in the last place each, and so is their difference.
_CLOCK = 2.0**-51

#: Steps whose near pairs are looked for together: boxes round so much of a path are little larger than a disc.
_TOGETHER = 16


@dataclass(frozen=True)
class Block:
    """Some steps of a run as arrays, with what rounding allows.

    Attributes:
        scene: The scene.
        law: What it says of its bodies.
        states: The states, one more than there are steps.
        dt_s: The run's step, seconds; a piece of a located run is shorter.
        step_s: Length of each step, shape ``(k,)``.
        pull: Gravity's acceleration of each disc, shape ``(n, 2)``.
        unit: What a velocity may be off by from rounding in a step, over its own size.
        place_unit: The same of a place.
        agreement: What two velocities may differ by that agree, over their size.
        own_speed: Greatest speed of each disc at either end of each step, shape ``(k, n)``.
        place_rounding: What rounding makes of each disc's place in each step, metres, shape ``(k, n)``.
        turned: In which steps which discs' velocities or spins changed by more than rounding, shape ``(k, n)``.
        turned_by: By how much velocities did, metres a second, shape ``(k, n)``.
        spun_by: By how much rims did, metres a second.
        moved_by: How far places came out from the free path, metres.
    """

    scene: Scene
    law: Law
    states: States
    dt_s: float
    step_s: Array
    pull: Array
    unit: float
    place_unit: float
    agreement: float
    own_speed: Array
    place_rounding: Array
    turned: Flags
    turned_by: Array
    spun_by: Array
    moved_by: Array

    @classmethod
    def of(
        cls, scene: Scene, law: Law, states: States, dt_s: float, unit: float, place_unit: float, agreement: float
    ) -> Block:
        """Return a block of steps; `unit`, `place_unit` and `agreement` as above."""
        h = np.diff(states.time_s)[:, None]
        p, v = states.position_m, states.velocity_m_s
        radius = scene.arrays.radius_m
        pull = np.where(scene.arrays.movable[:, None], np.array(law.gravity), 0.0)
        fallen = pull * h[..., None]
        turned_by = np.hypot(*np.moveaxis(v[1:] - v[:-1] - fallen, 2, 0))
        moved_by = np.hypot(*np.moveaxis(p[1:] - p[:-1] - v[:-1] * h[..., None] - 0.5 * fallen * h[..., None], 2, 0))
        rims = np.zeros(p.shape[:2]) if states.spin_rad_s is None else radius * states.spin_rad_s
        spun_by = np.abs(np.diff(rims, axis=0))
        speed = np.hypot(*np.moveaxis(v, 2, 0))
        own_speed = np.maximum(speed[1:], speed[:-1]) + np.hypot(*pull.T) * h
        own_rim = np.maximum(own_speed, np.maximum(np.abs(rims[1:]), np.abs(rims[:-1])))
        far = np.max(np.abs(p), axis=2) + radius
        reach = np.maximum(far[1:], far[:-1]) + own_speed * h
        clock_s = _CLOCK * states.time_s[1:, None]
        turned = (turned_by > unit * own_speed) | (spun_by > unit * own_rim)
        return cls(
            scene=scene,
            law=law,
            states=states,
            dt_s=dt_s,
            step_s=h[:, 0],
            pull=pull,
            unit=unit,
            place_unit=place_unit,
            agreement=agreement,
            own_speed=own_speed,
            place_rounding=place_unit * reach + own_speed * clock_s,
            turned=turned,
            turned_by=turned_by,
            spun_by=spun_by,
            moved_by=moved_by,
        )

    def __len__(self) -> int:
        return len(self.step_s)

    def state(self, step: int, discs: tuple[int, ...] | list[int]) -> BodyStates:
        """Return the state of some discs at the start of a step; the last state is that of one step more."""
        p, v, spins = self.states.position_m[step], self.states.velocity_m_s[step], self.states.spin_rad_s
        return BodyStates(
            self.law,
            {i: (float(p[i, 0]), float(p[i, 1])) for i in discs},
            {i: (float(v[i, 0]), float(v[i, 1])) for i in discs},
            {i: 0.0 if spins is None else float(spins[step, i]) for i in discs},
        )

    def answers_ahead(self, step: int, disc: int) -> bool:
        """Whether a disc that turns in a step closes on something near before, and parts from it after."""
        everyone = [disc, *(other for other in range(self.law.n) if other != disc)]
        before, after = self.state(step, everyone), self.state(step + 1, everyone)
        for pair in self.law.pairs_of(everyone):
            if pair[0] != disc:
                break  # pairs of the first disc come first
            contact = before.contact(pair)
            near = contact.closing > 0.0 and contact.gap <= _AHEAD_GAP * self.law.reach(pair)
            if near and after.contact(pair).closing <= 0.0:
                return True
        return False


@dataclass
class Activity:
    """What the pairs of a block do, step by step.

    Attributes:
        due: Of each step, the pairs that are active in it, each with the seconds from the step's start to the meeting;
            NaN of a pair that only pushes.
        follows: Steps and pairs that meet as a consequence of another meeting in the same step.
        resting: In which steps which discs are held by what they rest on, shape ``(k, n)``.
        overlapping: In which steps which discs begin in overlap, shape ``(k, n)``.
        sunk_m: The deepest that a resting pair sank, metres; `sunk_radii` over its contact distance.
        sinks: The first step by which a pair had sunk deeper than by falling for each step anew; None where none did.
    """

    resting: Flags
    overlapping: Flags
    due: dict[int, dict[Pair, float]] = field(default_factory=lambda: defaultdict(dict))
    follows: set[tuple[int, Pair]] = field(default_factory=set)
    sunk_m: float = 0.0
    sunk_radii: float = 0.0
    sinks: int | None = None


@dataclass(frozen=True)
class _Relative:
    """Pairs of one kind over some steps: arrays of shape ``(steps + 1, pairs)``, or with one step less.

    Attributes:
        begin: Number of the first step.
        pairs: The pairs.
        gap: Distance of the rims at each state.
        closing: Speed at which they close at each state.
        wait: Seconds from each step's start to the meeting, infinity for none.
        pulled: Gravity's part in their relative motion, metres a second squared, shape ``(pairs,)``.
        touching: What rounding makes of a gap, metres.
        still: What rounding makes of a speed, metres a second.
    """

    begin: int
    pairs: list[Pair]
    gap: Array
    closing: Array
    wait: Array
    pulled: Array
    touching: Array
    still: Array


class _Rested(NamedTuple):
    """How a pair rests: the gap at first, or 0, the last step, and how much deeper it is than by falling."""

    top_m: float
    last: int
    faster_m: float


def activity_of(block: Block) -> Activity:
    """Find the pairs that meet, push or rest in each step of a block."""
    shape = block.turned.shape
    found = Activity(resting=np.zeros(shape, np.bool_), overlapping=np.zeros(shape, np.bool_))
    sunk: dict[Pair, _Rested] = {}
    for begin in range(0, len(block), _TOGETHER):
        end = min(begin + _TOGETHER, len(block))
        together = [*_disc_pairs(block, begin, end), *_wall_pairs(block, begin, end)]
        near = [pair for relative in together for pair in relative.pairs]
        for relative in together:
            _take(block, relative, found, sunk)
        _take_consequences(block, found, near, range(begin, end))
    for step in list(found.due):
        _drop_bystanders(block, found, step)
    return found


def _reach(block: Block, begin: int, end: int) -> tuple[Array, Array]:
    """Centres and reaches of discs so that what may meet or push in these steps overlaps."""
    p = block.states.position_m[begin : end + 1]
    low, high = np.min(p, axis=0), np.max(p, axis=0)
    longest = float(np.max(block.step_s[begin:end]))
    # A third body may hand its speed on within the step.
    fastest = float(np.max(block.own_speed[begin:end])) + block.law.pull * longest
    ahead = 2.0 * fastest * longest
    own = (1.0 + MARGIN_STEPS) * longest * np.max(block.own_speed[begin:end], axis=0)
    radius = block.scene.arrays.radius_m
    reach = radius * (1.0 + RESTING_GAP) + 0.5 * np.hypot(*(high - low).T) + np.maximum(own, 0.5 * ahead)
    return 0.5 * (low + high), reach


def _disc_pairs(block: Block, begin: int, end: int) -> Iterator[_Relative]:
    arrays, law = block.scene.arrays, block.law
    centre, reach = _reach(block, begin, end)
    p, v = block.states.position_m[begin : end + 1], block.states.velocity_m_s[begin : end + 1]
    for first, second in near_pairs(centre, reach, arrays.movable):
        if not len(first):
            continue
        d, u = p[:, second] - p[:, first], v[:, second] - v[:, first]
        contact = arrays.radius_m[first] + arrays.radius_m[second]
        distance, b = np.hypot(d[..., 0], d[..., 1]), np.sum(d * u, axis=2)
        gap = distance - contact
        with np.errstate(divide="ignore", invalid="ignore"):
            closing = np.where(distance > 0.0, -b / distance, 0.0)
        pairs = list(zip(first.tolist(), second.tolist(), strict=True))
        pulled = np.where(arrays.movable[first] != arrays.movable[second], law.pull, 0.0)
        some = block.place_rounding[begin:end]
        touching = some[:, first] + some[:, second]
        speeds = block.own_speed[begin:end]
        still = block.unit * np.maximum(speeds[:, first], speeds[:, second])
        with np.errstate(divide="ignore", invalid="ignore"):
            a, c = np.sum(u * u, axis=2)[:-1], (gap * (distance + contact))[:-1]
            root = b[:-1] ** 2 - a * c
            wait = np.where((b[:-1] < 0.0) & (root > 0.0), c / (-b[:-1] + np.sqrt(np.maximum(root, 0.0))), np.inf)
        wait = np.where((b[:-1] < 0.0) & (gap[:-1] <= touching), 0.0, wait)
        wait = np.where((gap[:-1] <= touching) & (closing[:-1] <= still), np.inf, np.maximum(wait, 0.0))
        _fall_on_fixed(block, begin, pairs, pulled, gap, wait)
        yield _Relative(begin, pairs, gap, closing, wait, pulled, touching, still)


def _fall_on_fixed(block: Block, begin: int, pairs: list[Pair], pulled: Array, gap: Array, wait: Array) -> None:
    """Put in the waits of discs that fall onto immovable ones, which are near enough: there the path is no line."""
    for column in np.flatnonzero(pulled > 0.0).tolist():
        i, j = pairs[column]
        fast = block.own_speed[begin : begin + len(wait), [i, j]].max(axis=1)
        h = block.step_s[begin : begin + len(wait)]
        wait[:, column] = np.inf
        for row in np.flatnonzero(gap[:-1, column] < (1.0 + MARGIN_STEPS) * 2.0 * fast * h).tolist():
            wait[row, column] = block.state(begin + row, (i, j)).wait((i, j))


def _wall_pairs(block: Block, begin: int, end: int) -> Iterator[_Relative]:
    arrays, law = block.scene.arrays, block.law
    centre, reach = _reach(block, begin, end)
    p, v = block.states.position_m[begin : end + 1], block.states.velocity_m_s[begin : end + 1]
    walls = np.array(arrays.walls, dtype=np.float64).reshape(-1, 4)
    for disc, wall in near_walls(centre, reach, arrays.movable, walls):
        if not len(disc):
            continue
        plane = walls[wall]
        normal = plane[:, 2:]
        gap = np.sum((p[:, disc] - plane[:, :2]) * normal, axis=2) - arrays.radius_m[disc]
        speed = np.sum(v[:, disc] * normal, axis=2)
        pull = normal @ np.array(law.gravity)
        far = block.place_unit * np.max(np.abs(plane[:, :2]), axis=1)
        touching, still = block.place_rounding[begin:end, disc] + far, block.unit * block.own_speed[begin:end, disc]
        g, s = gap[:-1], speed[:-1]
        with np.errstate(divide="ignore", invalid="ignore"):
            straight = np.where(s < 0.0, g / -s, np.inf)
            root = s * s - 2.0 * pull * g
            high = np.sqrt(np.maximum(root, 0.0))
            # The root at which the gap closes, without cancellation.
            bent = np.where(s < 0.0, 2.0 * g / (-s + high), (s + high) / -pull)
            bent = np.where((root < 0.0) | ((pull > 0.0) & (s >= 0.0)), np.inf, bent)
            wait = np.where(pull == 0.0, straight, bent)
        wait = np.where((g <= touching) & (s < -still), 0.0, wait)
        wait = np.where((g <= touching) & (s >= -still) & (pull == 0.0), np.inf, np.maximum(wait, 0.0))
        pairs = [(i, law.n + k) for i, k in zip(disc.tolist(), wall.tolist(), strict=True)]
        pulled = np.full(len(pairs), law.pull)
        yield _Relative(begin, pairs, gap, -speed, wait, pulled, touching, still)


def _take(block: Block, relative: _Relative, found: Activity, sunk: dict[Pair, _Rested]) -> None:
    """Enter which of these pairs are active, and which rest, in which steps."""
    begin, steps = relative.begin, len(relative.wait)
    h = block.step_s[begin : begin + steps, None]
    gap, closing, wait, n = relative.gap, relative.closing, relative.wait, block.law.n
    first = [i for i, _ in relative.pairs]
    second = [j if j < n else i for i, j in relative.pairs]
    contact = np.array([block.law.reach(pair) for pair in relative.pairs])
    slow = RESTING_STEPS * relative.pulled * block.dt_s + relative.still
    resting = (
        (relative.pulled > 0.0)
        & (gap[:-1] <= RESTING_GAP * contact)
        & (np.abs(closing[:-1]) <= slow)
        & (np.abs(closing[1:]) <= slow)
    )
    meets = (wait <= h) & ~resting
    turned = block.turned[begin : begin + steps]
    pushed = turned[:, first] | turned[:, second]
    near = (wait <= (1.0 + MARGIN_STEPS) * h) | (gap[:-1] <= relative.touching) | (gap[1:] <= relative.touching)
    for row, column in np.argwhere((meets | (pushed & near)) & ~resting).tolist():
        due_s = float(wait[row, column]) if meets[row, column] else np.nan
        found.due[begin + row][relative.pairs[column]] = due_s
    for row, column in np.argwhere(gap[:-1] < -relative.touching).tolist():
        found.overlapping[begin + row, [body for body in relative.pairs[column] if body < n]] = True
    allowed = 0.5 * block.law.pull * block.dt_s**2
    for row, column in np.argwhere(resting).tolist():
        pair, step = relative.pairs[column], begin + row
        for body in pair:
            if body < n:
                found.resting[step, body] = True
        gap_m, before_m = float(gap[row + 1, column]), float(gap[row, column])
        known = sunk.get(pair)
        if known is None or known.last != step - 1:
            known = _Rested(min(before_m, 0.0), step - 1, 0.0)
        # What sinks beyond falling for each step anew adds up; what is held, or comes up, takes off from it.
        faster_m = max(known.faster_m + min(before_m, 0.0) - min(gap_m, 0.0) - allowed, 0.0)
        sunk[pair] = _Rested(known.top_m, step, faster_m)
        deep = known.top_m - gap_m
        found.sunk_m = max(found.sunk_m, deep)
        found.sunk_radii = max(found.sunk_radii, deep / contact[column])
        # Where it hops, it may be found as deep as it falls in a step at the speed that counts as rest.
        hop_m = RESTING_STEPS * 2.0 * allowed
        if faster_m > hop_m + relative.touching[row, column] and found.sinks is None:
            found.sinks = step


def _take_consequences(block: Block, found: Activity, near: list[Pair], steps: range) -> None:
    """Enter what meets as a consequence of another meeting in the same step, among what can reach each other in it."""
    law = block.law
    for step in steps:
        active = found.due.get(step)
        if not active or len(near) < 2 or all(np.isnan(due_s) for due_s in active.values()):
            continue
        seconds = float(block.step_s[step])
        fastest = float(np.max(block.own_speed[step]))
        everyone = block.state(step, sorted({body for pair in near for body in pair if body < law.n}))
        reachable = [pair for pair in near if everyone.contact(pair).gap <= 2.0 * fastest * seconds]
        for cluster in _clusters(law, reachable):
            if active.keys() >= set(cluster) or not any(active.get(pair, np.nan) >= 0.0 for pair in cluster):
                continue
            discs = sorted({body for pair in cluster for body in pair if body < law.n})
            met, _ = exact_run(block.state(step, discs), cluster, seconds, 0.0)
            for one in met:
                if one.pair not in active and one.contact.closing > (RESTING_STEPS + 0.5) * law.pull * seconds:
                    active[one.pair] = one.time_s
                    found.follows.add((step, one.pair))


def _drop_bystanders(block: Block, found: Activity, step: int) -> None:
    """Take out pairs that merely overlap and part while a meeting of one of them explains that it is turned."""
    active, n = found.due[step], block.law.n
    met = {body for pair, due_s in active.items() if due_s >= 0.0 for body in pair if body < n}
    unexplained = set(np.flatnonzero(block.turned[step]).tolist()) - met
    for pair in [pair for pair, due_s in active.items() if np.isnan(due_s) and not unexplained.intersection(pair)]:
        del active[pair]
    if not active:
        del found.due[step]


def _clusters(law: Law, pairs: list[Pair]) -> list[list[Pair]]:
    """Return the pairs in groups that share no movable disc."""
    parent: dict[int, int] = {}

    def find(body: int) -> int:
        while parent.setdefault(body, body) != body:
            parent[body] = parent[parent[body]]
            body = parent[body]
        return body

    for i, j in pairs:
        if law.movable(i) and law.movable(j):
            parent[find(i)] = find(j)
    groups: dict[int, list[Pair]] = defaultdict(list)
    for i, j in pairs:
        groups[find(i if law.movable(i) else j)].append((i, j))
    return list(groups.values())
