"""A PIC run under gravity: by all pairs, in plain Python, for up to some hundred discs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from carom.solvers.falling.bodies import FallingBodies
from carom.solvers.falling.contacts import Contacts
from carom.solvers.falling.grounds import ground_of
from carom.solvers.options import ALWAYS
from carom.solvers.plain.instants import NEVER
from carom.solvers.plain.run import AllPairsRun
from carom.trace import Outcome, body_name, wall_body, wall_index

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.solvers.plain.instants import Instant
    from carom.solvers.run import Progress, Start
    from carom.trace import ImpactRecord, ModeRecord


class FallingRun(AllPairsRun):
    """A PIC run under gravity: `carom.solvers.run.Run`.

    It goes on where gravity presses a disc to a half-plane or a straight edge: the disc slides, rolls or rests there,
    see `contacts`. It ends before its time, by name, at any other contact that lasts: see `carom.trace.Outcome` and
    `notes`. The arguments are those of `AllPairsRun`, except for the contact time of the TC model.
    """

    bodies: FallingBodies
    epoch_impacts: ClassVar[float] = math.inf  # instants are pairs, which need no epochs

    def __init__(self, start: Start, *, record: str = "all", window_s: tuple[float, float] = ALWAYS) -> None:
        self._bounded: set[tuple[int, int]] = set()  # bodies that meet at the instant kept of them at the earliest
        self._unresolved = 0
        self._struck: list[ModeRecord] = []  # how those go on that the impact found in contact
        super().__init__(start, record=record, window_s=window_s)
        for disc, mode in self.contacts.begin():
            self._go_on(disc, mode)

    def _bodies_of(self, start: Start) -> FallingBodies:
        bodies = FallingBodies(start)
        self.contacts = Contacts(bodies)
        return bodies

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Carry out every impact up to and including `time_s`, or until there have been `max_impacts` in all.

        Arguments and errors are those of `AllPairsRun.advance_to`.
        """
        outcome = super().advance_to(time_s, max_impacts, progress)
        if outcome is Outcome.COMPLETED and time_s < math.inf:
            self._now = max(self._now, (time_s, 0.0))
        return outcome

    def spins(self) -> NDArray[np.float64] | None:
        """Spins now, radians a second, shape ``(n,)``; None in a scene in which nothing turns."""
        bodies = self.bodies
        return np.array([bodies.spin_at(i, self._now) for i in range(len(bodies))]) if bodies.turns else None

    @property
    def counts(self) -> dict[str, int]:
        """Work counts: impacts, and predictions of discs, with those at the start."""
        return {"impacts": self.impacts, "predictions": len(self.bodies) + self._counts["predictions"]}

    def _present(self) -> Instant:
        return self._now

    def _next_impact(self) -> tuple[Instant, int, int]:
        """Return the instant and the bodies of what comes first, solving what is bounded before it.

        Where a mode ends, its disc stands for both bodies.
        """
        while (found := super()._next_impact())[1:] in self._bounded:
            self._bounded.remove(found[1:])
            super()._expect(*found[1:])
        ends = min(self.contacts.ends)
        disc = self.contacts.ends.index(ends)
        return (ends, disc, disc) if ends <= found[0] else found

    def _carry_out(self, first: int, second: int, instant: Instant) -> None:
        if first != second:
            super()._carry_out(first, second, instant)
            return
        self._now = max(self._now, instant)
        self._reported_s = self._since_start(self._now[0])
        self.bodies.bring_to(first, self._now)
        self._after_mode(first, self.contacts.end_mode(first))

    def _after_mode(self, disc: int, mode: ModeRecord | None) -> None:
        """Go on after a mode, or end the run where a disc comes over the end of an edge, too slowly to fly off."""
        if mode is not None:
            self._go_on(disc, mode)
            return
        ground = self.contacts.grounds[disc]
        where = "" if ground is None else f" of {body_name(wall_body(ground.wall))}"
        self._ended = Outcome.EDGE
        self.notes = (f"disc {disc} comes to the end of a straight edge{where} and does not fly off",)

    def _go_on(self, disc: int, mode: ModeRecord | None) -> None:
        """Keep how a disc moves from now on, and predict what it meets."""
        self._keep_mode(mode)
        self._predict(disc, (other for other in range(len(self.bodies)) if other != disc))

    def _keep_mode(self, mode: ModeRecord | None) -> None:
        if mode is not None and self.options.keeps(self._reported_s):
            self.log.add_mode(mode._replace(time_s=self._reported_s))

    def _expect(self, first: int, second: int) -> None:
        """Solve for the impact of two bodies, or bound it, where solving costs much.

        A disc and the wall that it is in contact with have none.
        """
        self._bounded.discard((first, second))
        ground = self.contacts.grounds[first] if second < 0 else None
        if ground is not None and ground.face is None and ground.wall == wall_index(second):
            self._instants[:, first, len(self.bodies.walls) + second] = NEVER
            return
        earliest = None if second < 0 else self.bodies.earliest_of_pair(first, second)
        if earliest is None:
            super()._expect(first, second)
        else:
            self._instants[:, first, len(self.bodies.walls) + second] = earliest
            self._bounded.add((first, second))

    def _collide(self, first: int, second: int, moved: list[int]) -> tuple[ImpactRecord, float] | None:
        found = self._meet_wall(first, wall_index(second)) if second < 0 else self._meet_disc(first, second)
        if found is not None:
            self._struck = [mode for disc in moved if (mode := self.contacts.after_impact(disc)) is not None]
        return found

    def _meet_disc(self, i: int, j: int) -> tuple[ImpactRecord, float] | None:
        bodies = self.bodies
        last = bodies.instant[i] if bodies.have_just_met(i, j) else None
        for disc in (i, j):
            bodies.bring_to(disc, self._now)
        fixed = [disc for disc in (i, j) if bodies.inverse_mass[disc] == 0.0]
        one, other = (j, i) if i in fixed else (i, j)
        approach, pull, gap_m = bodies.contact_with_disc(one, other)
        # Two that fall alike are not pressed together, whatever their centrifugal force is.
        presses = fixed or bodies.acceleration[i] != bodies.acceleration[j]
        if presses and self._is_at_rest(approach, pull, gap_m, None if fixed else last):
            self._end_in_contact(one, other, approach)
            return None
        bodies.part(i, j, approach)
        record = bodies.collide_pair(i, j)
        resolution_s = bodies.resolution_s(record)
        if fixed:
            bodies.leave_fixed(one, other)
        return record._replace(time_s=self._now[0]), resolution_s

    def _meet_wall(self, i: int, k: int) -> tuple[ImpactRecord, float] | None:
        bodies = self.bodies
        again = bodies.returns_to(i, k, self._now[0])
        last = bodies.instant[i] if again else None
        bodies.bring_to(i, self._now)
        approach, pull, gap_m = bodies.contact_with_wall(i, k, again)
        if self._is_at_rest(approach, pull, gap_m, last):
            part = bodies.expected(i, k)
            ground = ground_of(bodies, k, None if part is None else part.feature)
            if self.contacts.grounds[i] is not None or ground is None:
                bodies.leave_wall(i, k, 0.0)
                self._end_in_contact(i, wall_body(k), approach)
            else:
                self._go_on(i, self.contacts.land(i, ground, approach))
            return None
        record = bodies.bounce(i, k, approach)
        # Where a disc comes back to the wall that it has left, its time does not depend on a rounded gap.
        return record, 0.0 if again else bodies.resolution_s(record)

    def _is_at_rest(self, approach: float, pull: float, gap_m: float, last: Instant | None) -> bool:
        """Whether the impact that has come is none: the disc rests on the other body.

        Gravity presses it there (`pull` below 0), and either it does not approach; or it comes back from its `last`
        bounce on it, and the flight was shorter than the clock can tell; or it comes from elsewhere, and this speed
        makes a hop that is lower than the gap is known to.
        """
        if not pull < 0.0 or not approach > 0.0:
            return pull < 0.0
        return last[0] == self._now[0] if last is not None else approach * approach <= -2.0 * pull * gap_m

    def _end_in_contact(self, i: int, other: int, approach: float) -> None:
        """End the run where disc `i` stays in touch with something else than one straight wall."""
        bodies = self.bodies
        restitution = bodies.restitution if other >= 0 else bodies.restitution_of_wall(wall_index(other))
        infinitely_many = approach > 0.0 and 0.0 < restitution < 1.0
        why = ", after infinitely many impacts" if infinitely_many else ""
        if other >= 0 and bodies.inverse_mass[other] > 0.0:
            self._ended, what = Outcome.PRESSED, "stays in touch with"
        elif (held := self.contacts.grounds[i]) is not None:
            self._ended, what = Outcome.CORNER, f"is held by {body_name(wall_body(held.wall))} and"
        else:
            self._ended, what = Outcome.AT_REST, "comes to rest on" if infinitely_many else "rests on"
        self.notes = (f"disc {i} {what} {body_name(other)}{why}",)

    def _keep(self, record: ImpactRecord, resolution_s: float) -> None:
        kept, feature = self.options.keeps(record.time_s), self.bodies.feature_of(record)
        ambiguous = self.log.add(record, resolution_s, kept=kept, feature=feature)
        # Bodies that are pressed together by others collide without end, and soon faster than arithmetic can tell.
        for mode in self._struck:
            self._keep_mode(mode)
        self._unresolved = self._unresolved + 1 if ambiguous else 0
        if max(self._at_instant, self._unresolved) > self._standstill:
            self._ended = Outcome.STANDSTILL
            self.notes = ("impact after impact comes sooner than the arithmetic can tell",)
