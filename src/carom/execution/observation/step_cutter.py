"""Shortens an engine's steps so that they end when bodies begin to touch, according to the engine's contact test.

An engine detects an impact at a step boundary, up to a step late. If bodies newly touch after a step, `Cutter` restores
the state before the step and bisects the step's length. The bisection finds the shortest length after which bodies
touch. The engine, not Carom, moves bodies and tests for contact.

Bodies that touch and separate again within a step are not found, because contact is tested only at step boundaries.
"""

from __future__ import annotations

from collections.abc import Iterator

from carom.engines.api import CuttableWorld, World
from carom.errors import AdapterError

#: Largest number of pieces of a step. Only a step with infinitely many impacts reaches this number.
MOST_PIECES = 10_000


class Cutter:
    """Advances a world step by step. Each step is divided into pieces, which end when bodies begin to touch.

    Attributes:
        world: The world, initially at time 0.
        pieces: Number of pieces so far.
        probes: Number of trial steps, which were taken to find the end of a piece and then undone.
        has_too_many_pieces: Whether a step was given up because it needed more than `MOST_PIECES` pieces.
    """

    def __init__(self, world: World) -> None:
        if not isinstance(world, CuttableWorld):
            needs = "a located profile needs a world with the methods cut, touching, save and restore"
            page = "see docs/reference/adapters.md#located-profiles"
            raise AdapterError(f"{needs}, but this world lacks some of them; {page}")
        self.world = world
        self.pieces, self.probes, self.has_too_many_pieces = 0, 0, False
        self._known: frozenset[tuple[int, int]] = frozenset()

    def take_step(self, start_s: float, end_s: float) -> Iterator[float]:
        """Take one step in pieces, and yield the time at the end of each piece."""
        world, now_s = self.world, start_s
        for _ in range(MOST_PIECES):
            length = end_s - now_s
            state = world.save()
            found = self._try(length)
            new_contacts = found - self._known
            if new_contacts:
                length = self._bisect(state, now_s, length, new_contacts)
                world.restore(state)
                found = self._try(length)
            # The last piece ends exactly at the step boundary, not at a sum of rounded lengths.
            now_s = now_s + length if new_contacts else end_s
            self._known = found
            self.pieces += 1
            yield now_s
            if now_s >= end_s:
                return
        self.has_too_many_pieces = True

    def _try(self, length_s: float) -> frozenset[tuple[int, int]]:
        self.world.cut(length_s)
        self.world.advance(1)
        found = self.world.touching()
        if not isinstance(found, frozenset | set):
            raise AdapterError(f"touching() must return a frozenset of pairs, got a {type(found).__name__}")
        return found

    def _bisect(
        self, state: object, now_s: float, touching_s: float, new_contacts: frozenset[tuple[int, int]]
    ) -> float:
        """Return the shortest length of a step, in seconds, after which one of the pairs touches."""
        apart_s = 0.0
        while True:
            middle_s = apart_s + (touching_s - apart_s) / 2
            if not now_s + apart_s < now_s + middle_s < now_s + touching_s:
                return touching_s
            self.world.restore(state)
            self.probes += 1
            if self._try(middle_s) & new_contacts:
                touching_s = middle_s
            else:
                apart_s = middle_s
