"""PIC by all pairs, on plain floats: every two bodies are solved for, and the earliest impact is carried out.

It has no cells, no bounds and no queue, so it is what the event-driven kernel is held to, bit for bit; and it serves
where that is not there. A disc's stored position is that of its last impact, and its position at any time is computed
from there: so it does not matter in how many pieces a run is taken.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.impact_log import ImpactLog, standstill_impacts
from carom.solvers.options import ALWAYS, RunOptions, require_goal
from carom.solvers.plain.bodies import Bodies, require_supported
from carom.trace import Outcome, wall_body

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from carom.solvers.run import Progress, Start

__all__ = ["EPOCH_IMPACTS", "AllPairsRun"]

#: Impacts a disc after which time is counted anew, as in the event-driven kernel: see `new_epoch` in its kernel.pyx.
EPOCH_IMPACTS = 32


class AllPairsRun:
    """A `carom.solvers.run.Run` by PIC of a scene without gravity, with the results of `EventDrivenRun` to the bit.

    The arguments are those of `EventDrivenRun`.

    Raises:
        InputError: The scene has gravity, or an option is outside its range.
    """

    def __init__(
        self,
        start: Start,
        *,
        record: str = "all",
        window_s: tuple[float, float] = ALWAYS,
        contact_duration_s: float = 0.0,
    ) -> None:
        require_supported(start, "PIC")
        self.options = RunOptions(record, window_s, contact_duration_s)
        self.bodies = Bodies(start)
        self.log = ImpactLog(start)
        self.time_s = 0.0
        self.notes: tuple[str, ...] = ()
        self._now_s = 0.0  # of the last impact, since the epoch
        self._reported_s = 0.0  # of the last impact, since the start
        self._at_instant = 0
        self._standstill = standstill_impacts(len(self.bodies) + len(self.bodies.walls))
        self._last_impact_s = [-math.inf] * len(self.bodies)
        self._impacts_per_disc = [0] * len(self.bodies)
        self._counts = {"impacts": 0, "wall_impacts": 0, "predictions": 0, "epochs": 0}
        # Row i holds when disc i meets wall K-1, ..., wall 0, disc 0, ..., disc n-1, each pair once: so the first of
        # the least times is that of the first impact in the order of (time, first, second).
        self._times = np.full((len(self.bodies), len(self.bodies.walls) + len(self.bodies)), math.inf)
        for i in range(len(self.bodies)):
            self._predict(i, range(i + 1, len(self.bodies)))

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Carry out every impact up to and including `time_s`, or until `max_impacts` in all have been carried out."""
        require_goal(time_s, max_impacts)
        outcome = None
        while outcome is None:
            first, column = divmod(int(np.argmin(self._times)), self._times.shape[1])
            impact_s, second = float(self._times[first, column]), column - len(self.bodies.walls)
            if self._at_instant > self._standstill:
                outcome = Outcome.STANDSTILL
            elif impact_s == math.inf or self._since_start(impact_s) > time_s:
                outcome = Outcome.COMPLETED
            elif max_impacts is not None and self._counts["impacts"] >= max_impacts:
                outcome = Outcome.MAX_IMPACTS
            else:
                self._carry_out(first, second, impact_s)
                if progress is not None:
                    progress(self._counts["impacts"], self._reported_s)
        reached_s = time_s if outcome is Outcome.COMPLETED and time_s < math.inf else self._reported_s
        self.time_s = max(self.time_s, reached_s)
        return outcome

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.positions_at(self.bodies.since_epoch(self.time_s))

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.velocities()

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

    def _since_start(self, time_s: float) -> float:
        """Return the time to be reported of a time since the epoch, never less than one reported before."""
        return max(self._reported_s, self.bodies.since_start(time_s))

    def _carry_out(self, first: int, second: int, time_s: float) -> None:
        bodies, counts = self.bodies, self._counts
        if time_s > self._now_s:
            self._now_s, self._at_instant = time_s, 0
        self._reported_s = self._since_start(self._now_s)
        self._at_instant += 1
        discs = [first, second] if second >= 0 else [first]
        moved = [disc for disc in discs if bodies.inverse_mass[disc] > 0.0]
        soon = [self._now_s - self._last_impact_s[disc] < self.options.contact_duration_s for disc in moved]
        for disc in moved:
            self._last_impact_s[disc] = self._now_s
        record = bodies.collide(first, second, self._now_s, elastic=any(soon))._replace(time_s=self._reported_s)
        begin_s, end_s = self.options.recorded_s
        if begin_s <= record.time_s <= end_s:
            self.log.add(record, bodies.resolution_s(record))
        for disc in discs:
            self._impacts_per_disc[disc] += 1
        counts["impacts"] += 1
        counts["wall_impacts"] += second < 0
        counts["predictions"] += len(moved)
        if counts["impacts"] % (EPOCH_IMPACTS * len(bodies)) == 0:
            self._begin_epoch()
            moved = list(range(len(bodies)))
        for done, disc in enumerate(moved):
            self._predict(disc, (other for other in range(len(bodies)) if other not in moved[: done + 1]))

    def _begin_epoch(self) -> None:
        self.bodies.begin_epoch(self._now_s)
        self._last_impact_s = [time_s - self._now_s for time_s in self._last_impact_s]
        self._now_s = 0.0
        self._counts["epochs"] += 1

    def _predict(self, disc: int, others: Iterable[int]) -> None:
        """Solve for the impacts of a disc on all walls and on others."""
        bodies, walls = self.bodies, len(self.bodies.walls)
        for k in range(walls):
            self._times[disc, walls + wall_body(k)] = bodies.wall_impact_time(disc, k)
        for other in others:
            i, j = (disc, other) if disc < other else (other, disc)
            self._times[i, walls + j] = bodies.pair_impact_time(i, j)
