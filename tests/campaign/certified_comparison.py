"""Comparison of PIC with a certified run, beyond where a rounding envelope decides the order of events.

How far roundings have grown is measured by copies of the scene (`tests.campaign.copies`), to first order. Of event k
this is taken k + 2 times: once for the start, and once for each event that rounds. Where copies have other events than
one another, rounding decides, and no later event is compared. An event that a run has, or has not, against the
certified run and all copies is a difference.
"""

import math
import re
from collections.abc import Iterator, Sequence

import numpy as np
from tests.campaign.comparison import Difference, Kind, Record
from tests.campaign.copies import MANY, Copies
from tests.campaign.events import NEAR_LANDING, Event, Floats, list_events, number_events

from carom import CertifiedTrace, Outcome, Scene
from carom.core.resolution import clock_resolution
from carom.model.trace import EdgeKind, Mode, wall_index
from carom.solvers.certified.result import Degenerate, Ending

#: Ends of certified runs beyond which no run can continue.
WITHOUT_END = {Degenerate.COLLAPSE, Degenerate.CRUSH, Degenerate.EDGE}
#: Documented limits of PIC, which are counted and are no findings.
COUNTED = {Kind.LOW_HOPS, Kind.KEPT_CONTACT}
#: A note that names one body as two.
_TWICE = re.compile(r"\b((?:wall|disc) \d+) and \1\b")


def compare_with_certified(
    scene: Scene, certified: CertifiedTrace, record: Record, copies: Copies, gap_m: float
) -> list[Difference]:
    """Return the differences of a run from the certified run, in order of time."""
    comparison = _Comparison(scene, certified, record, copies, gap_m)
    found = list(comparison.differences())
    if any(difference.kind not in {Kind.NOTE, Kind.ROUNDING, *COUNTED} for difference in found):
        copies.run(MANY)  # rounding may decide, although the first few agree
        found = list(comparison.differences())
    return sorted(found, key=lambda difference: difference.time_s)


def reliable_until(certified: CertifiedTrace) -> float:
    """Return the time until which a certified run has all events."""
    if certified.ending is Ending.COMPLETED:
        return math.inf
    if certified.degeneracy is not None:
        return certified.degeneracy.earliest_s
    last_s = float(certified.trace.impacts["time_s"].max(initial=0.0))
    return last_s - 4.0 * clock_resolution(last_s)  # events at the same instant may come later


class _Comparison:
    def __init__(self, scene: Scene, certified: CertifiedTrace, record: Record, copies: Copies, gap_m: float) -> None:
        self.scene, self.certified, self.record, self.copies = scene, certified, record, copies
        self.ours = list_events(scene, record, gap_m)
        self.theirs = list_events(scene, Record.of(certified.trace), gap_m)
        self._certified_s = reliable_until(certified)
        self._gap_m, self._landed_s = gap_m, math.inf
        self._kept = list(self._drop_hops_within_contact())
        self._number = {event.name: number for run in (self.theirs, self.ours) for number, event in enumerate(run)}
        self._unordered = {number for pair in certified.commuted for number in pair}

    def differences(self) -> Iterator[Difference]:
        """Yield the differences before the certified run ends or rounding decides the order of events."""
        yield from self._kept
        unmatched = {event.name: event for event in self.theirs}
        until_s, alike, is_alike = min(self.copies.horizon_s, self._certified_s), list[Event](), True
        uncertified = set[int]()  # discs that have had an event which may be after the end of the certified run
        for event in self.ours:
            proven, discs = unmatched.pop(event.name, None), self._movable_discs(event)
            is_late = proven is None and not event.time_s + self._allowed_s(event) < self._certified_s
            if is_late or discs & uncertified:
                uncertified |= discs
            if proven is None:
                spurious = [] if discs <= uncertified else list(self._of_spurious(event, until_s))
                yield from spurious
                if any(difference.kind is Kind.LOW_HOPS for difference in spurious):
                    self._landed_s = min(self._landed_s, event.time_s)
                else:
                    is_alike = is_alike and self._is_in_landing(event)
            elif (found := self._of_values(event, proven)) is not None:
                is_alike = False
                if event.time_s < until_s:
                    yield found
                    return
            else:
                alike.append(event)
        left = [event for event in unmatched.values() if not self._is_in_landing(event)]
        # How well the end is known: it comes after what is alike, and nothing has made it worse.
        known_s = 2.0 * clock_resolution(self.record.end_time_s)
        known_s += max(map(self._allowed_s, alike), default=0.0)
        yield from self._of_missed(left, known_s, until_s)
        if is_alike:
            yield from self._of_ending(left, known_s)

    def _movable_discs(self, event: Event) -> set[int]:
        bodies = event.key[: 2 if event.is_impact else 1]
        return {body for body in bodies if body >= 0 and not self.scene.discs[body].immovable}

    def _drop_hops_within_contact(self) -> Iterator[Difference]:
        """Drop certified hops of discs in contact that the run cannot resolve and does not have; yield each.

        An impact lifts a disc off the wall that it is in contact with. The next event of the disc is its impact on that
        wall, and then its landing there. Where the run has the impact that lifts, it has the hop at the same time.
        """
        had = {event.name: event for event in self.ours}
        hops = True
        while hops:
            hops = False
            for start, takeoff in enumerate(self.theirs):
                hop = self._low_hop_from(start)
                lift = self.theirs[start - 1]
                found = had.get(lift.name)
                if hop is None or found is None:
                    continue
                same_time = [event for event in self.ours if not event.is_impact and event.time_s == found.time_s]
                same_wall = [event.key for event in same_time if event.key[:2] == takeoff.key[:2]]
                if takeoff.key in same_wall:
                    continue
                change = (*takeoff.key[:3], hop[-1].key[3])
                dropped = {takeoff.name, *(event.name for event in hop)}
                left = [event for event in self.theirs if event.name not in dropped]
                if change in same_wall:  # the run has both changes as one
                    left.insert(start, hop[-1]._replace(key=change))
                self.theirs, hops = list(number_events(left)), True
                yield Difference(
                    Kind.KEPT_CONTACT, takeoff.time_s, f"{takeoff.description}, ends {hop[-1].description}"
                )
                break

    def _low_hop_from(self, start: int) -> list[Event] | None:
        """Return impact and landing of a certified hop that rounding decides; None if no such hop begins there.

        An impact on a fixed body lifts a disc with a part of the velocity that it gives it. The normal of a flat wall
        is exact, so only a hop that the clock cannot resolve is dropped. On a curved body, rounding decides a part that
        is lower than the resolution of the normal: that of the gap over the radius. A hop by an impact of two moving
        discs may be as high as the resolution of the gap: `docs/theory/contact.md`.
        """
        takeoff, lift = self.theirs[start], self.theirs[start - 1]
        if takeoff.is_impact or takeoff.key[3] != Mode.FLIGHT or start == 0 or not lift.is_impact:
            return None
        disc = takeoff.key[0]
        hop = [event for event in self.theirs[start + 1 :] if disc in event.key[: 2 if event.is_impact else 1]][:2]
        if len(hop) < 2 or hop[0].key != takeoff.key[:2] or not hop[1].is_landing or hop[1].key[:2] != hop[0].key:
            return None
        closing_m_s = hop[0].closing_m_s
        if self._is_on_flat_wall(lift):
            is_unresolved = hop[0].time_s - takeoff.time_s <= 2.0 * clock_resolution(takeoff.time_s)
            return hop if is_unresolved else None
        others = [self.scene.discs[body] for body in lift.key[:2] if body >= 0 and body != disc]
        if all(other.immovable and not other.driven for other in others):
            row = self.certified.trace.impacts[lift.number]
            side = "first" if lift.key[0] == disc else "second"
            given_m_s = math.dist(row[f"velocity_{side}_after"], row[f"velocity_{side}_before"])
            return hop if closing_m_s <= given_m_s * self._gap_m / self.scene.discs[disc].radius_m else None
        return hop if closing_m_s * (hop[0].time_s - takeoff.time_s) <= 4.0 * self._gap_m else None

    def _is_on_flat_wall(self, impact: Event) -> bool:
        """Whether a certified impact is on a half-plane, or on a face of a finite wall."""
        edges = self.certified.trace.edges
        if impact.key[1] >= 0:
            return False
        is_half_plane = isinstance(self.scene.arrays.walls[wall_index(impact.key[1])], tuple)
        return is_half_plane or (edges is not None and edges["kind"][impact.number] == EdgeKind.FACE)

    def _is_in_landing(self, event: Event) -> bool:
        """Whether an event is one of the last bounces before a landing, whose number differs between runs.

        The landing may be another run's. How far it is off is known from copies, or from those of the bounce where a
        run ends between both.
        """
        if not event.can_bounce:
            return False
        landings = [other for run in (self.ours, self.theirs) for other in run if other.key[:3] == event.landing]
        near_s, own_s = NEAR_LANDING * clock_resolution(event.time_s), self._allowed_s(event)
        return any(
            abs(other.time_s - event.time_s) <= near_s + max(own_s, self._allowed_s(other)) for other in landings
        )

    def _follows_low_hop(self, event: Event) -> bool:
        """Whether a certified impact ends a hop that is lower than the resolution of a gap: `docs/theory/contact.md`.

        Where a disc is pulled back to a body for a time T, and hits it at speed w, it has been w T / 4 away from it.
        Since its start it has been w T away at most.
        """
        hop_s = self._hop_s(event)
        return event.closing_m_s * hop_s <= (self._gap_m if hop_s == event.time_s else 4.0 * self._gap_m)

    def _hop_s(self, event: Event) -> float:
        """Return the time of flight before a certified impact, since the last impact or the start."""
        earlier = [other.time_s for other in self.theirs if other.key == event.key and other.time_s < event.time_s]
        return event.time_s - earlier[-1] if earlier else event.time_s

    def _of_spurious(self, event: Event, until_s: float) -> Iterator[Difference]:
        """Yield an event that the certified run does not have."""
        latest_s = event.time_s + self._allowed_s(event)
        if self._is_in_landing(event):
            return
        if event.closing_m_s <= event.closing_own_m_s:
            if event.is_impact:  # PIC leaves out an impact that is rounding, but rounding may end a slip
                yield Difference(
                    Kind.ROUNDING, event.time_s, f"{event.description}, closes at {event.closing_m_s!r} m/s"
                )
        elif latest_s < until_s:
            kind = Kind.SPURIOUS if event.is_impact else Kind.MODE
            bounces = [other for other in self.theirs if other.key == event.key[:2] and other.time_s > latest_s]
            if event.is_landing and bounces:
                kind = Kind.LOW_HOPS if all(map(self._follows_low_hop, bounces)) else Kind.EARLY_LANDING
            yield Difference(kind, event.time_s, f"{event.description}, is not in the certified run")

    def _of_values(self, event: Event, proven: Event) -> Difference | None:
        """Return the difference of time or values of an event if rounding does not explain it."""
        spread = self.copies.spread(event)
        if spread is None:
            return None
        allowed_s, told = self._allowed_s(event), event.description
        if not abs(event.time_s - proven.time_s) <= allowed_s:
            text = f"{told}, is at {proven.time_s!r} s in the certified run; roundings explain {allowed_s:.2g} s"
            kind = Kind.TIME if event.is_impact else Kind.MODE
            kind = Kind.ROUNDING if event.closing_m_s <= event.closing_own_m_s else kind
            return Difference(kind, event.time_s, text)
        if proven.is_impact and proven.number in self._unordered:
            return None
        allowed = (self._number[event.name] + 2) * spread[1] + event.own + self._radii_of(proven)
        off = np.abs(event.values - proven.values)
        if np.all(off <= allowed):
            return None
        worst = int(np.argmax(off - allowed))
        kind = (Kind.SPIN if worst > 3 else Kind.VELOCITY) if event.is_impact else Kind.MODE
        found, truth = float(event.values[worst]), float(proven.values[worst])
        text = f"{told}, has value {worst} {found!r}, not {truth!r}; roundings explain {allowed[worst]:.2g}"
        return Difference(kind, event.time_s, text)

    def _allowed_s(self, event: Event) -> float:
        """Return a bound of the rounding error of an event's time.

        If no copy has the event, all may have ended just before it.
        """
        spread, damping = self.copies.spread(event), self.scene.damping_per_s
        # A damped clock is that of the undamped run, seen through a logarithm.
        undamped_s = math.expm1(damping * event.time_s) / damping if damping else 0.0
        own_s = 2.0 * clock_resolution(event.time_s) + clock_resolution(undamped_s)
        return own_s + (self._number[event.name] + 2) * (self.copies.spread_of_ends() if spread is None else spread[0])

    def _radii_of(self, proven: Event) -> Floats:
        """Return the error bounds that the certified run reports."""
        certified, k = self.certified, proven.number
        if proven.is_impact:
            radii = certified.radii[k]
            spins = [0.0, 0.0] if certified.spin_radii is None else list(certified.spin_radii[k].tolist()[2:])
            return np.concatenate([radii["velocity_first_after"], radii["velocity_second_after"], spins])
        assert certified.mode_radii is not None
        radii = certified.mode_radii[k]
        return np.concatenate([radii["position"], radii["velocity"], [radii["spin"]]])

    def _of_missed(self, left: Sequence[Event], known_s: float, until_s: float) -> Iterator[Difference]:
        """Yield a certified event that the run misses although it continues beyond it."""
        for event in left:
            # Where the height of a hop is rounding, so is its duration: the landing may be later by as much.
            if event.time_s + self._hop_s(event) > self._landed_s and self._follows_low_hop(event):
                continue
            if not event.is_impact and event.closing_m_s <= event.closing_own_m_s:
                continue
            if event.time_s < min(until_s, self.record.end_time_s - known_s):
                kind = Kind.MISSED if event.is_impact else Kind.MODE
                yield Difference(kind, event.time_s, f"certified {event.description}, is missing")
                return

    def _of_ending(self, left: Sequence[Event], known_s: float) -> Iterator[Difference]:
        """Yield an end of the run that is spurious, early, or missing."""
        record, certified = self.record, self.certified
        end_s, found = record.end_time_s, certified.degeneracy
        if record.outcome in {Outcome.COMPLETED, Outcome.MAX_IMPACTS}:
            if found is not None and found.kind in WITHOUT_END:  # impacts without end: no run gets beyond them
                latest_s = found.latest_s + known_s
                if latest_s < min(end_s, self.copies.horizon_s):
                    yield Difference(Kind.ENDING, found.latest_s, f"goes on to {end_s!r} s after: {found}")
            return
        if record.notes and (twice := _TWICE.search(record.notes[0])) is not None:
            yield Difference(Kind.NOTE, end_s, f"the note names {twice[1]} twice: {record.notes[0]}")
        named = f"ends by {record.outcome.name} at {end_s!r} s, known to {known_s:.2g} s"
        later = [event for event in left if event.time_s > end_s + known_s]
        if later:
            is_low = record.outcome.in_contact and all(map(self._follows_low_hop, later))
            kind = Kind.LOW_HOPS if is_low else Kind.EARLY_END
            yield Difference(kind, end_s, f"{named}, before certified {later[0].description}: {record.notes}")
        elif certified.ending is Ending.COMPLETED and end_s < self.copies.horizon_s:
            yield Difference(Kind.ENDING, end_s, f"{named}, and nothing certified ends it: {record.notes}")
