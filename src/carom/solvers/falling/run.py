"""A PIC run under gravity: event-driven, plain Python, for up to some hundred discs."""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.falling.bodies import FallingBodies
from carom.solvers.falling.clock import START, Instant
from carom.solvers.impact_log import ImpactLog, standstill_impacts
from carom.solvers.options import require_goal
from carom.trace import Outcome, wall_body, wall_index

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from carom.solvers.run import Progress, Start
    from carom.trace import ImpactRecord

__all__ = ["BallisticRun"]

#: Impacts between two calls of `progress`: a tenth of a second or so.
_CHUNK = 2000


class BallisticRun:
    """A PIC run under gravity: `carom.solvers.run.Run`.

    It ends before its time where a disc comes to rest: see `carom.trace.Outcome.AT_REST` and `notes`.
    """

    def __init__(self, start: Start) -> None:
        self.bodies = FallingBodies(start)
        self.log = ImpactLog(start)
        self.time_s = 0.0
        self.impacts = 0
        self.predictions = 0
        self.notes: tuple[str, ...] = ()
        self._now = START
        self._ended: Outcome | None = None
        self._unresolved = 0
        self._standstill = standstill_impacts(len(self.bodies) + len(self.bodies.walls))
        self._version = [0] * len(self.bodies)
        #: Instant, bodies, their versions, and whether they meet then, or may meet then at the earliest.
        self._events: list[tuple[Instant, int, int, int, int, bool]] = []
        for i in range(len(self.bodies)):
            self._predict(i, range(i + 1, len(self.bodies)))

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Carry out every impact up to and including `time_s`, or until there have been `max_impacts` in all.

        Args:
            time_s: Seconds from the start; infinity for as long as there are impacts.
            max_impacts: Number of impacts, counted from the start of the run; None for no limit.
            progress: Called now and then with the number of impacts so far and the time reached.

        Raises:
            InputError: `time_s` is NaN, or `max_impacts` no number of impacts.
        """
        require_goal(time_s, max_impacts)
        end = (time_s, 0.0)
        outcome = Outcome.COMPLETED
        while self._ended is None and self._events and (event := self._events[0])[0] <= end:
            instant, i, j, version_i, version_j, certain = event
            stands = self._version[i] == version_i and (j < 0 or self._version[j] == version_j)
            if stands and certain and max_impacts is not None and self.impacts >= max_impacts:
                outcome = Outcome.MAX_IMPACTS
                break
            heapq.heappop(self._events)
            if stands and not certain:
                self._expect(self.bodies.next_pair_impact(i, j), i, j)
            elif stands:
                self._now = max(self._now, instant)
                if j < 0:
                    self._meet_wall(i, wall_index(j))
                else:
                    self._meet_disc(i, j)
                if progress is not None and self.impacts % _CHUNK == 0:
                    progress(self.impacts, self._now[0])
        outcome = self._ended or outcome
        if outcome is Outcome.COMPLETED and time_s < math.inf:
            self._now = max(self._now, end)
        self.time_s = max(self.time_s, self._now[0])
        return outcome

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.all_at(self._now)[0]

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.all_at(self._now)[1]

    def spins(self) -> NDArray[np.float64] | None:
        """Spins now, radians a second, shape ``(n,)``; None in a scene in which nothing turns."""
        return self.bodies.spins()

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Number of impacts of each disc so far, with discs, immovable ones and walls, shape ``(n,)``."""
        bodies = [body for record in self.log.records for body in (record.first, record.second) if body >= 0]
        return np.bincount(np.array(bodies, np.int64), minlength=len(self.bodies)).astype(np.int64)

    @property
    def counts(self) -> dict[str, int]:
        """Work counts."""
        return {"impacts": self.impacts, "predictions": self.predictions}

    def _predict(self, i: int, others: Iterable[int]) -> None:
        """Predict the impacts of disc `i` with the other discs given and with all walls."""
        bodies = self.bodies
        self.predictions += 1
        for j in others:
            if i == j:
                continue
            a, b = (i, j) if i < j else (j, i)
            earliest = bodies.earliest_on_fixed(a, b)
            if earliest is None:
                self._expect(bodies.next_pair_impact(a, b), a, b)
            else:
                self._expect(earliest, a, b, certain=False)
        for k in range(len(bodies.walls)):
            self._expect(bodies.next_wall_impact(i, k), i, wall_body(k))

    def _expect(self, instant: Instant, i: int, j: int, *, certain: bool = True) -> None:
        if instant[0] < math.inf:
            event = (instant, i, j, self._version[i], self._version[j] if j >= 0 else 0, certain)
            heapq.heappush(self._events, event)

    def _meet_disc(self, i: int, j: int) -> None:
        bodies = self.bodies
        for one, other in ((i, j), (j, i)):
            bodies.bring_to(one, self._now)
            if bodies.inverse_mass[other] == 0.0 and self._rests_on_fixed(one, other):
                return
        bodies.last_partner[i], bodies.last_partner[j] = j, i
        record = bodies.collide_pair(i, j)
        resolution_s = bodies.resolution_s(record)
        for one, other in ((i, j), (j, i)):
            if bodies.inverse_mass[other] == 0.0:
                bodies.leave_fixed(one, other, record)
        self._carried_out(record._replace(time_s=self._now[0]), resolution_s, (i, j))

    def _meet_wall(self, i: int, k: int) -> None:
        bodies = self.bodies
        again = bodies.last_partner[i] == wall_body(k)
        last = bodies.instant[i] if again else None
        bodies.bring_to(i, self._now)
        approach, pull, gap_m = bodies.contact_with_wall(i, k)
        if self._is_at_rest(approach, pull, gap_m, last):
            bodies.leave_wall(i, k, 0.0)
            self._end_at_rest(f"disc {i}", f"wall {k}", approach > 0.0 and 0.0 < bodies.wall_restitution < 1.0)
            return
        record = bodies.bounce(i, k, approach)
        # Where a disc comes back to the wall that it has left, its time does not depend on a rounded gap.
        self._carried_out(record, 0.0 if again else bodies.resolution_s(record), (i,))

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

    def _carried_out(self, record: ImpactRecord, resolution_s: float, changed: tuple[int, ...]) -> None:
        ambiguous = self.log.add(record, resolution_s)
        self.impacts += 1
        # Bodies that are pressed together by others collide without end, and soon faster than arithmetic can tell.
        self._unresolved = self._unresolved + 1 if ambiguous else 0
        if self.log.at_standstill or self._unresolved > self._standstill:
            self._ended = Outcome.STANDSTILL
            self.notes = ("impact after impact comes sooner than the arithmetic can tell",)
            return
        movable = [body for body in changed if self.bodies.inverse_mass[body] > 0.0]
        for body in movable:
            self._version[body] += 1
        for done, body in enumerate(movable):
            self._predict(body, (other for other in range(len(self.bodies)) if other not in movable[:done]))
