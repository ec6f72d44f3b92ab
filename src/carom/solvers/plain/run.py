"""PIC by all pairs, on plain floats: every two bodies are solved for, and the earliest impact is carried out.

It has no cells, no bounds and no queue, so it is what the event-driven kernel is held to, bit for bit; and it serves
where that is not there. A disc's stored position is that of its last impact, and its position at any time is computed
from there: so it does not matter in how many pieces a run is taken.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from carom.extension import Patience
from carom.solvers.impact_log import ImpactLog, crushing_note, gliding_note, standstill_impacts
from carom.solvers.options import ALWAYS, RunOptions, require_goal
from carom.solvers.plain.bodies import Bodies, require_supported
from carom.solvers.plain.instants import NEVER, START, Instant
from carom.solvers.plain.squeeze import Squeezes
from carom.trace import Outcome, wall_body, wall_index

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from carom.solvers.run import Progress, Start
    from carom.trace import ImpactRecord

#: Impacts a disc after which time is counted anew, as in the event-driven kernel: see core/epochs.h.
EPOCH_IMPACTS = 32


class AllPairsRun:
    """A `carom.solvers.run.Run` by PIC of a scene without gravity, with the results of `EventDrivenRun` to the bit.

    The arguments are those of `EventDrivenRun`.

    Raises:
        InputError: The scene has gravity or damping, or an option is outside its range.
    """

    #: Infinity where time is never counted anew.
    epoch_impacts: ClassVar[float] = EPOCH_IMPACTS

    def __init__(
        self,
        start: Start,
        *,
        record: str = "all",
        window_s: tuple[float, float] = ALWAYS,
        contact_duration_s: float = 0.0,
    ) -> None:
        self.bodies = self._bodies_of(start)
        self.options = RunOptions(record, window_s, contact_duration_s)
        self.log = ImpactLog(start)
        self.time_s = 0.0
        self.notes: tuple[str, ...] = ()
        self._now = START  # of the last impact, since the epoch
        self._reported_s = 0.0  # of the last impact, since the start
        self._ended: Outcome | None = None
        self._at_instant = 0
        self._standstill = standstill_impacts(len(self.bodies) + len(self.bodies.walls))
        driven = start.arrays.wall_drives is not None or bool(self.bodies.driven)
        self._squeezes = Squeezes(self.bodies, self._standstill) if driven else None
        self._last_s = start.duration_s  # up to when impacts are asked for, at the least
        self._patience = Patience()
        self._last_impact_s = [-math.inf] * len(self.bodies)
        self._impacts_per_disc = [0] * len(self.bodies)
        self._counts = {"impacts": 0, "wall_impacts": 0, "predictions": 0, "epochs": 0}
        # Row i holds when disc i meets wall K-1, ..., wall 0, disc 0, ..., disc n-1, each pair once: so the first of
        # the least instants is that of the first impact in the order of (instant, first, second).
        columns = len(self.bodies.walls) + len(self.bodies)
        self._instants = np.full((2, len(self.bodies), columns), np.array(NEVER)[:, None, None])
        for i in range(len(self.bodies)):
            self._predict(i, range(i + 1, len(self.bodies)))

    def _bodies_of(self, start: Start) -> Bodies:
        require_supported(start, "PIC")
        return Bodies(start)

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Carry out every impact up to and including `time_s`, or until `max_impacts` in all have been carried out.

        Args:
            time_s: Seconds from the start; infinity for as long as there are impacts.
            max_impacts: Number of impacts, counted from the start of the run; None for no limit.
            progress: Called after each impact with the number of impacts so far and the time reached.

        Raises:
            InputError: `time_s` is NaN, or `max_impacts` no number of impacts.
        """
        require_goal(time_s, max_impacts)
        self._last_s = max(self._last_s, time_s)
        outcome = self._ended
        while outcome is None:
            instant, first, second = self._next_impact()
            if self._at_instant > self._standstill:
                outcome = Outcome.STANDSTILL
            elif instant == NEVER or (self._since_start(instant[0]), instant[1]) > (time_s, 0.0):
                outcome = Outcome.COMPLETED
            elif max_impacts is not None and self.impacts >= max_impacts:
                outcome = Outcome.MAX_IMPACTS
            else:
                self._carry_out(first, second, instant)
                outcome = self._ended
                self._patience.look()
                if progress is not None:
                    progress(self.impacts, self._reported_s)
        reached_s = time_s if outcome is Outcome.COMPLETED and time_s < math.inf else self._reported_s
        self.time_s = max(self.time_s, reached_s)
        return outcome

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.all_at(self._present())[0]

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.all_at(self._present())[1]

    def spins(self) -> NDArray[np.float64] | None:
        """Spins now, radians a second, shape ``(n,)``; None in a scene in which nothing turns."""
        return self.bodies.spins()

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Number of impacts of each disc so far, with discs and walls, shape ``(n,)``."""
        return np.array(self._impacts_per_disc, np.int64)

    @property
    def impacts(self) -> int:
        """Number of impacts so far, recorded or not."""
        return self._counts["impacts"]

    @property
    def counts(self) -> dict[str, int]:
        """Work so far: impacts, of these on walls, predictions of discs after impacts, and epochs begun anew."""
        return dict(self._counts)

    def _present(self) -> Instant:
        """Return the instant that states are asked of, since the epoch."""
        return self.bodies.since_epoch(self.time_s), 0.0

    def _since_start(self, time_s: float) -> float:
        """Return the time to be reported of a time since the epoch, never less than one reported before."""
        return max(self._reported_s, self.bodies.since_start(time_s))

    def _next_impact(self) -> tuple[Instant, int, int]:
        """Return the instant and the bodies of the impact that comes first."""
        heads, rests = self._instants
        ties = np.flatnonzero(heads == heads.min())
        place = int(ties[np.argmin(rests.flat[ties])])
        first, column = divmod(place, heads.shape[1])
        return (float(heads.flat[place]), float(rests.flat[place])), first, column - len(self.bodies.walls)

    def _carry_out(self, first: int, second: int, instant: Instant) -> None:
        bodies, counts = self.bodies, self._counts
        if instant[0] > self._now[0]:
            self._at_instant = 0
        self._now = max(self._now, instant)
        self._reported_s = self._since_start(self._now[0])
        discs = [first, second] if second >= 0 else [first]
        moved = [disc for disc in discs if bodies.inverse_mass[disc] > 0.0]
        found = self._collide(first, second, moved)
        if found is None:
            return
        self._at_instant += 1
        self._keep(*found)
        for disc in discs:
            self._impacts_per_disc[disc] += 1
        counts["impacts"] += 1
        counts["wall_impacts"] += second < 0
        counts["predictions"] += len(moved)
        if self._squeezes is not None:
            self._look_for_crushing(self._squeezes, moved, found[0])
        if self._ended is not None:
            return
        if counts["impacts"] % (self.epoch_impacts * len(bodies)) == 0:
            self._begin_epoch()
            moved = list(range(len(bodies)))
        for done, disc in enumerate(moved):
            self._predict(disc, (other for other in range(len(bodies)) if other not in moved[: done + 1]))

    def _collide(self, first: int, second: int, moved: list[int]) -> tuple[ImpactRecord, float] | None:
        """Bring two bodies through their impact; return its record, and to how many seconds its instant is known.

        None where it is no impact: one body rests on the other, and the run has ended.
        """
        now_s = self._now[0]
        if second < 0 and self.bodies.glides(first, wall_index(second)):
            self._ended = Outcome.GLIDES
            self.notes = (gliding_note(first, wall_index(second), self._reported_s),)
            return None
        soon = [now_s - self._last_impact_s[disc] < self.options.contact_duration_s for disc in moved]
        for disc in moved:
            self._last_impact_s[disc] = now_s
        record = self.bodies.collide(first, second, now_s, elastic=any(soon))._replace(time_s=self._reported_s)
        return record, self.bodies.resolution_s(record)

    def _look_for_crushing(self, squeezes: Squeezes, moved: list[int], record: ImpactRecord) -> None:
        """End the run where a disc that has just been struck is crushed before what is asked for ends."""
        first, second, (nx, ny) = record.first, record.second, record.normal
        for disc in moved:
            crush = squeezes.struck(*((disc, second, (-nx, -ny)) if disc == first else (disc, first, (nx, ny))))
            if crush is None or (time_s := self.bodies.since_start(crush.time_s)) > self._last_s:
                continue
            self._ended = Outcome.CRUSHED
            self.notes = (crushing_note(disc, crush.between, time_s),)

    def _keep(self, record: ImpactRecord, resolution_s: float) -> None:
        if self.options.keeps(record.time_s):
            self.log.add(record, resolution_s, feature=self.bodies.feature_of(record))

    def _begin_epoch(self) -> None:
        now_s = self._now[0]
        self.bodies.begin_epoch(now_s)
        self._last_impact_s = [time_s - now_s for time_s in self._last_impact_s]
        self._now = START
        self._counts["epochs"] += 1

    def _predict(self, disc: int, others: Iterable[int]) -> None:
        """Solve for the impacts of a disc on all walls and on others."""
        for k in range(len(self.bodies.walls)):
            self._expect(disc, wall_body(k))
        for other in others:
            self._expect(min(disc, other), max(disc, other))

    def _expect(self, first: int, second: int) -> None:
        """Solve for the impact of two bodies."""
        bodies = self.bodies
        wall = second < 0
        instant = bodies.next_wall_impact(first, wall_index(second)) if wall else bodies.next_pair_impact(first, second)
        self._instants[:, first, len(bodies.walls) + second] = instant
