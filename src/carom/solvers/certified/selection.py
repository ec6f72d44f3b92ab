"""Which impact comes next: decided by certified comparison only, or said not to be decided.

The event with the least lower bound is solved in balls, which raises its bound; when the least bound belongs to an
event that is solved already, all whose bounds do not exceed its time are its rivals, and they are solved, too. It comes
next if it is certainly before each rival, or if the two commute.

Where a bound is no later than the start of both paths, it says nothing, and the instant to solve from may be far from
the impact. So the first solution only makes a bound, from which it is solved again when its turn comes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from flint import arb

from carom.extension import extension_available
from carom.solvers.certified.bodies import BallBodies
from carom.solvers.certified.exact import exactly_simultaneous
from carom.solvers.certified.prediction import Meeting, float_above, float_below, meet_pair, meet_wall
from carom.solvers.certified.result import Degeneracy, Degenerate
from carom.solvers.certified.start_bounds import StartBounds
from carom.trace import wall_index

if TYPE_CHECKING:
    from carom.solvers.certified import bounds

__all__ = ["Choice", "Selection", "Undecided"]


class Undecided(Exception):  # noqa: N818 - not an error: a signal to look closer
    """The next impact is not decided at this precision; holds what to report if no precision decides it."""

    def __init__(self, degeneracy: Degeneracy) -> None:
        super().__init__(str(degeneracy))
        self.degeneracy = degeneracy


class Choice(NamedTuple):
    """The next impact, and whether it might as well come after another that follows."""

    meeting: Meeting
    commutes: bool


class Selection:
    """Chooses the next impact of discs in ball arithmetic.

    Attributes:
        solved: Number of times of impact solved in balls.
    """

    def __init__(self, bodies: BallBodies, end_s: float) -> None:
        self.bodies = bodies
        self.bounds = _lower_bounds(bodies)
        self.end_s = end_s
        self.solved = 0
        self._meetings: dict[tuple[int, int], Meeting] = {}
        self._of: list[set[tuple[int, int]]] = [set() for _ in range(len(bodies))]

    def changed(self, meeting: Meeting) -> None:
        """Take over the state after an impact that was carried out."""
        discs = [body for body in (meeting.first, meeting.second) if body >= 0]
        for i in discs:
            if self.bodies.movable[i]:
                for key in self._of[i]:
                    self._meetings.pop(key, None)
                self._of[i].clear()
        self.bounds.changed(*discs)

    def next_impact(self) -> Choice | None:
        """Return the impact that certainly comes next; None where certainly none comes before the end.

        Raises:
            Undecided: That is not decided at this precision.
        """
        bounds, meetings = self.bounds, self._meetings
        while True:
            bound, *pair = bounds.earliest()
            place = (pair[0], pair[1])
            if bound > self.end_s:
                return None
            if place not in meetings:
                meeting = self._solve(place, bound)
                if (
                    meeting is not None
                    and meeting.decided
                    and meeting.latest <= self.end_s
                    and not bounds.several_up_to(meeting.latest)
                ):
                    return Choice(meeting, False)  # all other bounds are above all that its time may be
                continue
            limit, rivals = -math.inf, [place]
            while (reach := self._latest(rivals)) > limit:  # a rival's time may reach further than the first's
                limit, rivals = reach, bounds.up_to(reach)
            unsolved = [place for place in rivals if place not in meetings]
            if unsolved:
                place = min(unsolved, key=lambda p: bounds.at(*p))
                self._solve(place, bounds.at(*place))
                continue
            return self._choose([meetings[place] for place in rivals])

    def _latest(self, places: list[tuple[int, int]]) -> float:
        """Return the latest that any of these impacts may be, as far as they are solved."""
        return max(self._meetings[place].latest for place in places if place in self._meetings)

    def _solve(self, place: tuple[int, int], at: float) -> Meeting | None:
        """Solve one impact in balls from its bound, and raise that; return the impact if there may be one near it."""
        self.solved += 1
        start = self.bodies.path_start(*place)
        meeting = self._meet(place, at)
        bound = math.inf if meeting is None else max(at, float_below(meeting.time))
        self.bounds.raise_to(*place, bound)
        if meeting is None or at <= start < bound:
            return None
        self._meetings[place] = meeting
        for body in place:
            if body >= 0:
                self._of[body].add(place)
        return meeting

    def _meet(self, place: tuple[int, int], at: float) -> Meeting | None:
        disc, body = place
        if body < 0:
            return meet_wall(self.bodies, disc, wall_index(body), at)
        return meet_pair(self.bodies, min(place), max(place), at)

    def _choose(self, meetings: list[Meeting]) -> Choice | None:
        if all(meeting.time > self.end_s for meeting in meetings):
            return None
        blocking: Undecided | None = None
        for candidate in sorted(meetings, key=lambda m: float(m.time)):
            if candidate.time > self.end_s:
                continue
            if not candidate.decided:
                blocking = blocking or Undecided(self._unresolved(candidate))
                continue
            commutes = False
            for rival in meetings:
                if rival is candidate or candidate.time < rival.time:
                    continue
                if rival.decided and candidate.time.overlaps(rival.time) and self._commute(candidate, rival):
                    commutes = True
                    continue
                blocking = blocking or Undecided(self._tied(candidate, rival))
                break
            else:
                if not candidate.time <= self.end_s:
                    raise Undecided(self._report(Degenerate.AT_THE_END, (candidate,), candidate.time))
                return Choice(candidate, commutes)
        assert blocking is not None  # noqa: S101 - one meeting at least may be in time, and none was returned
        raise blocking

    def _commute(self, one: Meeting, other: Meeting) -> bool:
        """Whether two impacts whose times overlap give the same in either order."""
        bodies = self.bodies
        mine = {body for body in (one.first, one.second) if body >= 0 and bodies.movable[body]}
        theirs = {body for body in (other.first, other.second) if body >= 0 and bodies.movable[body]}
        if mine & theirs:
            both_walls = one.second < 0 and other.second < 0
            return both_walls and bodies.orthogonal(one.second, other.second)
        window = one.time.union(other.time)
        return all(self._out_of_reach(i, j, window) for i in mine for j in theirs)

    def _out_of_reach(self, i: int, j: int, window: arb) -> bool:
        """Whether two discs are so far apart that, whatever these impacts do to them, they can't meet in the window.

        No impact with a partner of speed s leaves a disc of speed v with more than ``v + 2 (v + s)``; the partners'
        speeds are among all discs' speeds.
        """
        bodies = self.bodies
        at = float(window.mid())
        (xi, yi), (xj, yj) = bodies.moved(i, at), bodies.moved(j, at)
        dx, dy = xj - xi, yj - yi
        fastest = max((bodies.vx[k] * bodies.vx[k] + bodies.vy[k] * bodies.vy[k]).upper() for k in range(len(bodies)))
        # Both may move at 5 times the fastest speed for twice the window's length, and from `at` to the window.
        length = 2 * (window.upper() - window.lower()) + abs(window - at).upper()
        gx, gy = bodies.gravity
        gained = (gx * gx + gy * gy).sqrt() * (window.upper() + length)  # the velocities are those at time 0
        reach = bodies.pair_law(i, j).reach + 10 * (fastest.sqrt() + gained) * length
        return bool(dx * dx + dy * dy > reach * reach)

    def _unresolved(self, meeting: Meeting) -> Degeneracy:
        kind = Degenerate.RESTING_CONTACT if meeting.resting else Degenerate.GRAZE
        return self._report(kind, (meeting,), meeting.time)

    def _tied(self, one: Meeting, other: Meeting) -> Degeneracy:
        if not other.decided:
            return self._unresolved(other)
        movable = [
            {body for body in (m.first, m.second) if body >= 0 and self.bodies.movable[body]} for m in (one, other)
        ]
        shared = bool(movable[0] & movable[1])
        kind = Degenerate.SHARED_INSTANT if shared else Degenerate.SIMULTANEOUS_NEIGHBOURS
        return self._report(kind, (one, other), one.time.union(other.time))

    def _report(self, kind: Degenerate, meetings: tuple[Meeting, ...], time: arb) -> Degeneracy:
        bodies = self.bodies
        involved = sorted({body for m in meetings for body in (m.first, m.second)})
        if kind is Degenerate.RESTING_CONTACT:  # whoever met one of them last drives it into the other
            last = [bodies.partner[body] for body in involved if body >= 0]
            involved = sorted({*involved, *(body for body in last if body is not None)})
        proven = all(m.proven for m in meetings) or (
            len(meetings) == 2
            and bodies.untouched(*involved)
            and not (bodies.falls and involved[0] < 0)
            and exactly_simultaneous(
                bodies.scene,
                (meetings[0].first, meetings[0].second),
                (meetings[1].first, meetings[1].second),
            )
        )
        bits = min(bodies.state_bits(body) for body in involved if body >= 0)
        latest = math.inf if kind is Degenerate.GRAZE else float_above(time)
        return Degeneracy(kind, tuple(involved), float_below(time), latest, proven, bits)


def _lower_bounds(bodies: BallBodies) -> bounds.LowerBounds | StartBounds:
    if not extension_available():
        return StartBounds(bodies)
    from carom.solvers.certified import bounds

    return bounds.LowerBounds(bodies)
