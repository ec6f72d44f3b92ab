"""Selection of the next impact by comparisons of intervals.

Each possible event has a lower bound of its time. To *solve* an event means to compute its time as an interval, which
increases the bound. The search solves the event with the smallest bound, again and again, until the smallest bound
belongs to a solved event. *Rivals* of this event are all events whose bounds are not after its time. Rivals are solved
too. The event is next if it certainly comes before each rival, or if their order does not matter. In all other cases,
the next event is undecided.

The first bound of an event can be much earlier than the impact, for example the start of the later of the two bodies'
paths. A solution that starts from an early bound is inaccurate, and is only used as a better bound. When the better
bound is the smallest of all, the event's time is computed again from this bound.
"""

from __future__ import annotations

import math
import sys
import time
from typing import NamedTuple, NoReturn

from flint import arb

from carom.solvers.certified import bounds
from carom.solvers.certified.ball_arithmetic import float_above, float_below
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.exact import are_simultaneous
from carom.solvers.certified.meeting import Meeting
from carom.solvers.certified.meeting_times import meet
from carom.solvers.certified.result import Degeneracy, Degenerate, Undecided

#: After this number of computed times of impact, the clock is checked again.
_CHUNK = 1024


class OutOfTime(Exception):  # noqa: N818 - not an error: a signal to stop
    """Signal that the deadline has passed during a search."""


class Choice(NamedTuple):
    """The next impact, and whether its order with the following impact is unknown but does not affect the result."""

    meeting: Meeting
    commutes: bool


class Selection:
    """Search for the next impact in interval arithmetic.

    Attributes:
        end_s: Impacts after this time, in seconds, are ignored. The time is finite: an event that never occurs has an
            infinite bound.
        deadline_s: Value of `time.perf_counter` after which the search ends.
        solved: Number of times of impact that were computed as intervals.
    """

    def __init__(self, bodies: BallBodies) -> None:
        self.bodies = bodies
        self.bounds = bounds.LowerBounds(bodies)
        self.end_s, self.deadline_s = sys.float_info.max, math.inf
        self.solved = 0
        self._meetings: dict[tuple[int, int], Meeting] = {}
        self._of: list[set[tuple[int, int]]] = [set() for _ in range(len(bodies))]
        for i in range(len(bodies)):
            self.expect_end(i)

    def expect_end(self, i: int) -> None:
        """Add the next change of disc `i` without an impact, if there is one, to the possible events."""
        if self.bodies.contacts.end_of(i) is not None:
            self._meetings.pop((i, i), None)
            self.bounds.raise_to(i, i, self.bodies.time[i])

    def changed(self, meeting: Meeting) -> None:
        """Update the possible events after an impact has happened."""
        for i in self._find_moved_discs(meeting):
            for key in self._of[i]:
                self._meetings.pop(key, None)
            self._of[i].clear()
        self.bounds.changed(*sorted(self._find_moved_discs(meeting)))
        for i in self._find_moved_discs(meeting):
            self.expect_end(i)

    def next_impact(self) -> Choice | None:
        """Return the impact that certainly comes next; None if there is certainly no impact up to `end_s`.

        Raises:
            Undecided: With this precision it is unknown which impact is next.
            OutOfTime: The deadline has passed.
        """
        bounds, meetings = self.bounds, self._meetings
        while True:
            bound, disc, body = bounds.earliest()
            if bound > self.end_s:
                return None
            if (disc, body) not in meetings:
                meeting = self._solve(bound, disc, body)
                if meeting is None or not meeting.decided or meeting.latest > self.end_s:
                    continue
                if len(bounds.up_to(meeting.latest)) == 1:  # all other bounds are later than this impact
                    return Choice(meeting, False)
                continue
            limit, rivals = -math.inf, [(bound, disc, body)]
            while (latest := self._latest(rivals)) > limit:  # a rival with a late upper bound may have more rivals
                limit, rivals = latest, bounds.up_to(latest)
            unsolved = [rival for rival in rivals if rival[1:] not in meetings]
            if not unsolved:
                return self._choose([meetings[rival[1:]] for rival in rivals])
            self._solve(*min(unsolved))

    def _latest(self, rivals: list[tuple[float, int, int]]) -> float:
        """Return the latest possible time of all solved rivals, or `end_s` if it is earlier.

        The end of a contact has an infinite upper bound if its interval is too wide at this precision.
        """
        latest = max(self._meetings[rival[1:]].latest for rival in rivals if rival[1:] in self._meetings)
        return min(latest, self.end_s)

    def _solve(self, instant_s: float, disc: int, body: int) -> Meeting | None:
        """Compute the time of an impact as an interval, starting from its bound.

        Return None if there is no impact. Also return None if the impact is later than its bound: then only the bound
        is replaced by a later one.
        """
        self.solved += 1
        if self.solved % _CHUNK == 0 and time.perf_counter() > self.deadline_s:
            raise OutOfTime
        start = self.bodies.path_start(disc, body)
        meeting = meet(self.bodies, disc, body, instant_s)
        bound = math.inf if meeting is None else max(instant_s, float_below(meeting.time))
        self.bounds.raise_to(disc, body, bound)
        if meeting is None or instant_s <= start < bound:
            return None
        self._meetings[disc, body] = meeting
        for number in {disc, body}:
            if number >= 0:
                self._of[number].add((disc, body))
        return meeting

    def _choose(self, meetings: list[Meeting]) -> Choice | None:
        if all(meeting.time > self.end_s for meeting in meetings):
            return None
        blocking: Undecided | None = None
        for candidate in sorted(meetings, key=lambda m: float(m.time)):
            if candidate.time > self.end_s:
                continue
            if not candidate.decided:
                blocking = blocking or Undecided(self._describe_unresolved(candidate))
                continue
            commutes = False
            for rival in meetings:
                if rival is candidate or candidate.time < rival.time or candidate.holds(rival):
                    continue
                if rival.decided and candidate.time.overlaps(rival.time) and self._do_commute(candidate, rival):
                    commutes = True
                    continue
                blocking = blocking or Undecided(self._describe_tie(candidate, rival))
                break
            else:
                if not candidate.time <= self.end_s:
                    self.raise_at_the_end(candidate)
                return Choice(candidate, commutes)
        assert blocking is not None  # noqa: S101 - at least one impact may come before the end, but none was chosen
        raise blocking

    def raise_at_the_end(self, meeting: Meeting) -> NoReturn:
        """Raise the signal that it is undecided whether an impact comes before the end of the scene.

        Raises:
            Undecided: Always.
        """
        raise Undecided(self._describe_degeneracy(Degenerate.AT_THE_END, (meeting,), meeting.time))

    def _do_commute(self, one: Meeting, other: Meeting) -> bool:
        """Return whether two impacts in undecided order have the same result in both orders."""
        mine, theirs = self._find_moved_discs(one), self._find_moved_discs(other)
        if mine & theirs:
            one_each = all(m.second < 0 and len(m.obstacles) == 1 for m in (one, other))
            return one_each and self.bodies.are_orthogonal(one.second, other.second)
        window = one.time.union(other.time)
        return all(self._are_out_of_reach(i, j, window) for i in mine for j in theirs)

    def _find_moved_discs(self, meeting: Meeting) -> set[int]:
        return {body for body in (meeting.first, meeting.second) if body >= 0 and self.bodies.movable[body]}

    def _are_out_of_reach(self, i: int, j: int, window: arb) -> bool:
        """Return whether two discs are too far apart to meet in the time `window`, even after other impacts.

        A disc of speed v that hits a body of speed s gets at most the speed ``v + 2 (v + s)``. Friction adds at most
        twice the slip speed, which is at most ``2 (v + s)`` plus both rim speeds. Both v and s are at most the greatest
        speed of all bodies.
        """
        bodies = self.bodies
        instant_s = float(window.mid())
        (xi, yi), (xj, yj) = bodies.centre_in_frame(i, instant_s), bodies.centre_in_frame(j, instant_s)
        dx, dy = xj - xi, yj - yi
        fastest = max((bodies.vx[k] * bodies.vx[k] + bodies.vy[k] * bodies.vy[k]).upper() for k in range(len(bodies)))
        fastest, speed_factor = fastest.sqrt().max(arb(bodies.fastest_drive)), 5
        if bodies.has_friction:
            fastest, speed_factor = max([fastest, *(abs(bodies.rim_speed(k)).upper() for k in range(len(bodies)))]), 13
        # The speed of each disc is at most 5 times the greatest speed (13 times with friction). The disc moves for at
        # most twice the window plus the time from `instant_s`.
        length = 2 * (window.upper() - window.lower()) + abs(window - instant_s).upper()
        gained_speed = bodies.bound_acceleration() * (window.upper() + length)  # stored velocities are valid at time 0
        reach = bodies.laws.of_discs(i, j).reach + 2 * speed_factor * (fastest + gained_speed) * length
        return bool(dx * dx + dy * dy > reach * reach)

    def _describe_unresolved(self, meeting: Meeting) -> Degeneracy:
        kind = Degenerate.RESTING_CONTACT if meeting.resting else Degenerate.GRAZE
        kind = Degenerate.AT_A_TURN if meeting.turning else kind
        return self._describe_degeneracy(kind, (meeting,), meeting.time)

    def _describe_tie(self, one: Meeting, other: Meeting) -> Degeneracy:
        if not other.decided:
            return self._describe_unresolved(other)
        shared = self._find_moved_discs(one) & self._find_moved_discs(other)
        kind = Degenerate.SHARED_INSTANT if shared else Degenerate.SIMULTANEOUS_NEIGHBOURS
        return self._describe_degeneracy(kind, (one, other), one.time.union(other.time))

    def _describe_degeneracy(self, kind: Degenerate, meetings: tuple[Meeting, ...], meeting_time: arb) -> Degeneracy:
        bodies = self.bodies
        involved = sorted({body for m in meetings for body in (m.first, m.second)})
        if kind is Degenerate.RESTING_CONTACT:  # the last impact pushed one body into the other
            last = [bodies.partner[body] for body in involved if body >= 0]
            involved = sorted({*involved, *(body for body in last if body is not None)})
        proven = all(m.proven for m in meetings) or (
            len(meetings) == 2
            and bodies.are_at_start(*involved)
            and not any(map(bodies.is_curved, involved))
            and are_simultaneous(bodies, meetings[0][:2], meetings[1][:2])
        )
        bits = min(bodies.state_bits(body) for body in involved if body >= 0)
        latest = math.inf if kind is Degenerate.GRAZE else float_above(meeting_time)
        trace_bodies = tuple(sorted({bodies.trace_body(body) for body in involved}))
        return Degeneracy(kind, trace_bodies, float_below(meeting_time), latest, proven, bits)
