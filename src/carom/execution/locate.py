"""Cutting an engine's steps so that they end where bodies begin to touch, by the engine's own contact test.

An engine that is only looked at at step boundaries sees an impact up to a step late. Its steps can be cut instead: a
step after which bodies touch that did not touch before is taken again with half the length, and again, until two
lengths are left that the clock can't tell apart, the longer of which ends in contact and the shorter does not. So the
engine is asked for its own motion and its own answer to "do they touch now?"; no formula of Carom's takes part.

Bodies that touch only between two boundaries are not found: where to look is decided by the step, as without cutting.
"""

from __future__ import annotations

from collections.abc import Iterator

from carom.engines.api import CuttableWorld, World
from carom.errors import AdapterError

#: Impacts without end at one instant cut a step into pieces without end. No scene has this many in one step.
MOST_PIECES = 10_000


class Cutter:
    """Takes a world forward in pieces of steps, and counts.

    Attributes:
        world: The world; at time 0.
        pieces: Pieces taken so far.
        probes: Steps that were taken to find where a piece must end, and taken back.
        stuck: Whether a step was given up for its pieces without end.
    """

    def __init__(self, world: World) -> None:
        if not isinstance(world, CuttableWorld):
            told = "a located profile needs a world with cut, touching, save and restore; this one has not"
            raise AdapterError(f"{told}; see docs/reference/adapters.md#located-profiles")
        self.world = world
        self.pieces, self.probes, self.stuck = 0, 0, False
        self._known: frozenset[tuple[int, int]] = frozenset()

    def step(self, start_s: float, end_s: float) -> Iterator[float]:
        """Take one step, and yield the time at the end of each piece of it."""
        world, now_s, pieces = self.world, start_s, 0
        while now_s < end_s:
            if pieces == MOST_PIECES:
                self.stuck = True
                return
            length = end_s - now_s
            state = world.save()
            found = self._try(length)
            begun = found - self._known
            if begun:
                length = self._bisect(state, now_s, length, begun)
                world.restore(state)
                found = self._try(length)
            # Free flight adds up to the boundary itself, not to a sum of rounded pieces.
            now_s = now_s + length if begun else end_s
            self._known = found
            pieces += 1
            self.pieces += 1
            yield now_s

    def _try(self, length_s: float) -> frozenset[tuple[int, int]]:
        self.world.cut(length_s)
        self.world.advance(1)
        found = self.world.touching()
        if not isinstance(found, frozenset | set):
            raise AdapterError(f"touching() must return a frozenset of pairs, got a {type(found).__name__}")
        return found

    def _bisect(self, state: object, now_s: float, touching_s: float, begun: frozenset[tuple[int, int]]) -> float:
        """Return the shortest piece, to the resolution of the clock, after which one of the pairs touches."""
        apart_s = 0.0
        while True:
            middle_s = apart_s + (touching_s - apart_s) / 2
            if not now_s + apart_s < now_s + middle_s < now_s + touching_s:
                return touching_s
            self.world.restore(state)
            self.probes += 1
            if self._try(middle_s) & begun:
                touching_s = middle_s
            else:
                apart_s = middle_s
