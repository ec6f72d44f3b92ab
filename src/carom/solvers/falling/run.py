"""A PIC run under gravity: by all pairs, in plain Python, for up to some hundred discs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

from carom.solvers.falling.bodies import FallingBodies
from carom.solvers.options import ALWAYS
from carom.solvers.plain.run import AllPairsRun
from carom.trace import Outcome, wall_index

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from carom.solvers.plain.instants import Instant
    from carom.solvers.run import Progress, Start
    from carom.trace import ImpactRecord

__all__ = ["BallisticRun"]


class BallisticRun(AllPairsRun):
    """A PIC run under gravity: `carom.solvers.run.Run`.

    It ends before its time where a disc comes to rest: see `carom.trace.Outcome.AT_REST` and `notes`. The arguments are
    those of `AllPairsRun`, except for the contact time of the TC model.
    """

    bodies: FallingBodies
    epoch_impacts: ClassVar[float] = math.inf  # instants are pairs, which need no epochs

    def __init__(self, start: Start, *, record: str = "all", window_s: tuple[float, float] = ALWAYS) -> None:
        self._bounded: set[tuple[int, int]] = set()  # bodies that meet at the instant kept of them at the earliest
        self._unresolved = 0
        super().__init__(start, record=record, window_s=window_s)

    def _bodies_of(self, start: Start) -> FallingBodies:
        return FallingBodies(start)

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Carry out every impact up to and including `time_s`, or until there have been `max_impacts` in all.

        Arguments and errors are those of `AllPairsRun.advance_to`.
        """
        outcome = super().advance_to(time_s, max_impacts, progress)
        if outcome is Outcome.COMPLETED and time_s < math.inf:
            self._now = max(self._now, (time_s, 0.0))
        return outcome

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.all_at(self._now)[0]

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.all_at(self._now)[1]

    @property
    def counts(self) -> dict[str, int]:
        """Work counts: impacts, and predictions of discs, with those at the start."""
        return {"impacts": self.impacts, "predictions": len(self.bodies) + self._counts["predictions"]}

    def _next_impact(self) -> tuple[Instant, int, int]:
        """Return the instant and the bodies of the impact that comes first, solving what is bounded before it."""
        while (found := super()._next_impact())[1:] in self._bounded:
            self._bounded.remove(found[1:])
            super()._expect(*found[1:])
        return found

    def _expect(self, first: int, second: int) -> None:
        """Solve for the impact of two bodies, or bound it, where solving costs much."""
        earliest = None if second < 0 else self.bodies.earliest_on_fixed(first, second)
        if earliest is None:
            super()._expect(first, second)
        else:
            self._instants[:, first, len(self.bodies.walls) + second] = earliest
            self._bounded.add((first, second))

    def _collide(self, first: int, second: int, moved: list[int]) -> tuple[ImpactRecord, float] | None:  # noqa: ARG002
        return self._meet_wall(first, wall_index(second)) if second < 0 else self._meet_disc(first, second)

    def _meet_disc(self, i: int, j: int) -> tuple[ImpactRecord, float] | None:
        bodies = self.bodies
        for one, other in ((i, j), (j, i)):
            bodies.bring_to(one, self._now)
            if bodies.inverse_mass[other] == 0.0 and self._rests_on_fixed(one, other):
                return None
        bodies.last_partner[i], bodies.last_partner[j] = j, i
        record = bodies.collide_pair(i, j)
        resolution_s = bodies.resolution_s(record)
        for one, other in ((i, j), (j, i)):
            if bodies.inverse_mass[other] == 0.0:
                bodies.leave_fixed(one, other, record)
        return record._replace(time_s=self._now[0]), resolution_s

    def _meet_wall(self, i: int, k: int) -> tuple[ImpactRecord, float] | None:
        bodies = self.bodies
        again = bodies.returns_to(i, k)
        last = bodies.instant[i] if again else None
        bodies.bring_to(i, self._now)
        approach, pull, gap_m = bodies.contact_with_wall(i, k, again)
        if self._is_at_rest(approach, pull, gap_m, last):
            bodies.leave_wall(i, k, 0.0)
            self._end_at_rest(f"disc {i}", f"wall {k}", approach > 0.0 and 0.0 < bodies.restitution_of_wall(k) < 1.0)
            return None
        record = bodies.bounce(i, k, approach)
        # Where a disc comes back to the wall that it has left, its time does not depend on a rounded gap.
        return record, 0.0 if again else bodies.resolution_s(record)

    def _rests_on_fixed(self, i: int, fixed: int) -> bool:
        """End the run, and say so, where disc `i` rests on an immovable one."""
        approach, pull, gap_m = self.bodies.contact_with_fixed(i, fixed)
        rests = self._is_at_rest(approach, pull, gap_m, None)
        if rests:
            self._end_at_rest(f"disc {i}", f"disc {fixed}", approach > 0.0 and 0.0 < self.bodies.restitution < 1.0)
        return rests

    def _is_at_rest(self, approach: float, pull: float, gap_m: float, last: Instant | None) -> bool:
        """Whether the impact that has come is none: the disc rests on the other body.

        Gravity presses it there (`pull` below 0), and either it does not approach; or it comes back from its `last`
        bounce on it, and the flight was shorter than the clock can tell; or it comes from elsewhere, and this speed
        makes a hop that is lower than the gap is known to.
        """
        if not pull < 0.0 or not approach > 0.0:
            return pull < 0.0
        return last[0] == self._now[0] if last is not None else approach * approach <= -2.0 * pull * gap_m

    def _end_at_rest(self, body: str, other: str, infinitely_many: bool) -> None:
        what, why = ("comes to rest", ", after infinitely many impacts") if infinitely_many else ("rests", "")
        self.notes = (f"{body} {what} on {other}{why}",)
        self._ended = Outcome.AT_REST

    def _keep(self, record: ImpactRecord, resolution_s: float) -> None:
        kept, feature = self.options.keeps(record.time_s), self.bodies.feature_of(record)
        ambiguous = self.log.add(record, resolution_s, kept=kept, feature=feature)
        # Bodies that are pressed together by others collide without end, and soon faster than arithmetic can tell.
        self._unresolved = self._unresolved + 1 if ambiguous else 0
        if max(self._at_instant, self._unresolved) > self._standstill:
            self._ended = Outcome.STANDSTILL
            self.notes = ("impact after impact comes sooner than the arithmetic can tell",)
