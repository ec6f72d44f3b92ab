"""Search for bodies that rest on each other under gravity, and for the depth to which they sink into each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.comparator.stepwise.near_pairs import RESTING_GAP, NearPairs
from carom.comparator.stepwise.scene_bodies import Pair
from carom.comparator.stepwise.step_block import Block

Flags = NDArray[np.bool_]

#: Two bodies that gravity presses together count as resting while their speed along the normal is at most the speed
#: gained by falling for this many steps. One step suffices for engines that correct velocities. Engines that correct
#: positions need two and a half (measured with Box2D and MuJoCo `default`, 8 starting states each).
RESTING_STEPS = 2.5


class _RestState(NamedTuple):
    """State of two bodies that rest on each other.

    Attributes:
        start_gap_m: Overlap when the pair began to rest, as a negative number; 0 without overlap.
        until_s: End of the last step in which the pair rested.
        unexplained_depth_m: Depth of the overlap, minus the depth that falling from rest in each step explains.
    """

    start_gap_m: float
    until_s: float
    unexplained_depth_m: float


@dataclass(eq=False)
class RestHistory:
    """Largest depth to which resting bodies have sunk so far, and the intervals in which they rest.

    Attributes:
        sunk_radii: Largest depth, divided by the contact distance of the pair; 0 if no pair sank.
        sinks_s: Time at which a pair first sank deeper than it would by falling from rest in each step; NaN if no pair
            did.
        resting_intervals_s: For each pair, the time intervals in which the pair rests and the motion of one of its
            bodies changes in each step.
    """

    sunk_radii: float = 0.0
    sinks_s: float = math.nan
    resting_intervals_s: dict[Pair, list[tuple[float, float]]] = field(default_factory=dict)
    _rested: dict[Pair, _RestState] = field(default_factory=dict)

    def add(self, block: Block, relative: NearPairs, resting: Flags) -> None:
        """Add steps in order of time. Steps that were already added are ignored."""
        times = block.states.time_s
        allowed = 0.5 * block.bodies.pull * block.dt_s**2
        # Bodies that hop on each other may overlap by the distance that the largest resting speed covers in a step.
        hop_m = RESTING_STEPS * 2.0 * allowed
        for row, column in np.argwhere(resting).tolist():
            pair, step = relative.pairs[column], relative.begin + row
            begin_s, end_s = float(times[step]), float(times[step + 1])
            gap_m, before_m = float(relative.gap[row + 1, column]), float(relative.gap[row, column])
            known = self._rested.get(pair)
            if known is not None and known.until_s > begin_s:
                continue
            if any(block.velocity_changed[step, body] for body in pair if body < block.bodies.n):
                spans = self.resting_intervals_s.setdefault(pair, [])
                joined_s = spans.pop()[0] if spans and spans[-1][1] == begin_s else begin_s
                spans.append((joined_s, end_s))
            if known is None or known.until_s < begin_s:
                known = _RestState(min(before_m, 0.0), begin_s, 0.0)
            # The unexplained depths of all steps add up. The sum decreases in steps in which the pair sinks less or
            # rises.
            unexplained_depth_m = max(known.unexplained_depth_m + min(before_m, 0.0) - min(gap_m, 0.0) - allowed, 0.0)
            self._rested[pair] = _RestState(known.start_gap_m, end_s, unexplained_depth_m)
            self.sunk_radii = max(self.sunk_radii, (known.start_gap_m - gap_m) / block.bodies.reach(pair))
            if unexplained_depth_m > hop_m + relative.gap_rounding[row, column]:
                self.sinks_s = float(np.fmin(self.sinks_s, begin_s))


def find_resting_pairs(block: Block, together: Sequence[NearPairs]) -> list[Flags]:
    """Find the steps in which pairs rest. Return an array of shape ``(steps, pairs)`` for each item of `together`.

    A disc rests on a body if gravity presses it against this body. A resting disc also rests on other bodies that it
    touches, such as the second wall of a corner.
    """
    movable, pull = block.scene.arrays.movable, block.bodies.pull
    if not (pull and together):
        return [np.zeros(relative.wait.shape, np.bool_) for relative in together]
    touching, pressed = [], []
    discs = [relative.list_discs(block.bodies.n) for relative in together]
    for relative, (first, second) in zip(together, discs, strict=True):
        closing, contact = np.abs(relative.closing), np.array([block.bodies.reach(pair) for pair in relative.pairs])
        slow = RESTING_STEPS * pull * block.dt_s + relative.speed_rounding
        falls = (relative.second >= block.bodies.n) | (movable[first] != movable[second])
        near = falls & (relative.gap[:-1] <= RESTING_GAP * contact)
        touching.append(near & (closing[:-1] <= slow) & (closing[1:] <= slow))
        # The direction of gravity relative to a wall has the rounding error of the wall's normal.
        pressed.append(touching[-1] & (relative.closing_acceleration[:-1] > block.place_unit * pull))
    held = np.zeros((len(together[0].wait), block.bodies.n), np.bool_)
    for flags, (first, second) in zip(pressed, discs, strict=True):
        rows, columns = np.nonzero(flags)
        held[rows, first[columns]] = held[rows, second[columns]] = True
    return [flags & (held[:, first] | held[:, second]) for flags, (first, second) in zip(touching, discs, strict=True)]
