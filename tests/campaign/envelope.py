"""Rounding envelope of a scene: balls that contain every run within PIC's rounding bounds.

It is a certified run whose state is widened by the roundings of a float64 run. A centre is widened by the resolution of
a gap (`carom.core.resolution`), a velocity or spin after an impact by the roundings of the impact law that
`tests.checker.laws` derives. The widened balls grow from impact to impact as rounding errors do, so that nothing has to
be said of how much a run amplifies them. The envelope ends where its balls no longer decide which event comes next:
from there on rounding may change the order of events.

What a ball holds exactly is not widened where the law does not round it either. A disc that an impact with restitution
0 has left on a wall at rest has no normal velocity, exactly. Friction, a driven wall and any restitution other than 0
and 1 round, even if their exact result is a float.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from flint import arb, ctx

from carom import Scene, Trace
from carom.core.resolution import clock_resolution, gap_resolution
from carom.model.disc_arrays import list_wall_lengths
from carom.model.flights import free_flights
from carom.model.trace import NO_EDGE, wall_index
from carom.solvers.certified.ball_arithmetic import ZERO, float_above
from carom.solvers.certified.contact_state import BallMode, GlideState, Landing
from carom.solvers.certified.contacts import begin_contact, find_resting, record_landing, start_mode
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.impacts import BallEvent, BallImpact, apply_meeting
from carom.solvers.certified.meeting import Meeting, Seam, WallApproach
from carom.solvers.certified.recording import damp_impact
from carom.solvers.certified.result import Undecided
from carom.solvers.certified.run import find_degenerate_start
from carom.solvers.certified.selection import Selection
from carom.solvers.certified.slowing import damped_time, speed_fraction, start_deceleration, undamped_time_of

#: Bits of the balls: far more than the 53 of the roundings that they hold.
PRECISION = 192
UNIT = 2.0**-53
#: Roundings of the impact law in units of the relative speed, and of the velocity before: see `tests.checker.laws`.
ROUNDINGS_OF_LAW, ROUNDINGS_OF_SUM, ROUNDINGS_OF_RIM = 24, 4, 8
#: Roundings of the velocity of a disc that falls, of its speed, and of the recorded time: see `tests.checker.flights`.
ROUNDINGS_OF_FALL, ROUNDINGS_OF_FALL_TIME = 20, 4
#: Bounces are replaced by the landing that they end in where they are over within this part of the time.
LANDING_PART = 1e-15


class Rounding(NamedTuple):
    """Bounds of the rounding errors of velocities (m/s) and spins (rad/s) at one impact."""

    velocities: tuple[float, float]
    spins: tuple[float, float]


class EnvelopeImpact(NamedTuple):
    """An impact of the envelope.

    Attributes:
        impact: Balls for its time, normal, velocities and spins.
        rounding: What one run's own roundings at this impact may add to velocities and spins.
        time_s: What its own clock may add to the time.
        is_on_one_edge: Whether it is certain which edge of a finite wall is hit.
        is_ordered: Whether it certainly comes after the impacts before it, and before those after it: else velocities
            may be those of another order.
    """

    impact: BallImpact
    rounding: Rounding
    time_s: float
    is_on_one_edge: bool
    is_ordered: bool = True


class EnvelopeMode(NamedTuple):
    """A change of a disc's mode of contact: balls, and bounds of the rounding errors of velocity and time."""

    mode: BallMode
    speed_m_s: float
    time_s: float


class FinalState(NamedTuple):
    """Balls for centre, velocity and spin of a disc at the scene's end, and bounds of a run's own rounding errors."""

    place: tuple[arb, arb]
    velocity: tuple[arb, arb]
    spin: arb
    place_m: float
    speed_m_s: float
    spin_rad_s: float


@dataclass
class Envelope:
    """The events that every run within PIC's rounding bounds has.

    Attributes:
        events: Impacts and changes of modes, in an order in which they may come.
        end: The state of each disc at the end of the scene, where the envelope reaches it.
        horizon_s: No event before this time is left out; infinity where the scene's end is reached.
        gap_m: By how much each coordinate was widened.
    """

    events: list[EnvelopeImpact | EnvelopeMode] = field(default_factory=list)
    end: list[FinalState] | None = None
    horizon_s: float = 0.0
    gap_m: float = 0.0


def compute_envelope(scene: Scene, trace: Trace, most: int) -> Envelope:
    """Return the rounding envelope of a scene.

    Args:
        scene: The scene.
        trace: A run of it, from which the largest distance of a disc from the origin is computed.
        most: Events after which the envelope ends.
    """
    with ctx.workprec(PRECISION):
        return _Widened(scene, trace).envelope(most)


def compute_extent(scene: Scene, trace: Trace, until_s: float) -> float:
    """Return an upper bound of all lengths that a gap is computed from, in metres."""
    arrays = scene.arrays
    sizes = [float(np.abs(disc.position_m).sum()) + disc.radius_m for disc in scene.discs]
    for flight in free_flights(trace):
        if flight.begin_s <= until_s:
            lasts_s = max(0.0, min(flight.end_s, until_s) - flight.begin_s)
            way_m = lasts_s * (math.hypot(*flight.velocity_m_s) + 0.5 * lasts_s * math.hypot(*flight.pull_m_s2))
            sizes.append(float(np.abs(flight.position_m).sum()) + 2.0 * way_m + float(arrays.radius_m[flight.disc]))
    for wall, drive in ((wall, arrays.drive_of_wall(k)) for k, wall in enumerate(arrays.walls)):
        lengths = [abs(length) for length in list_wall_lengths(wall)]
        moved_m = 0.0 if drive.is_stationary else math.hypot(*drive.moved_at(until_s))
        sizes.append(2.0 * max(lengths, default=0.0) + moved_m)
    return max(sizes)


def law_rounding(
    scene: Scene, first: int, second: int, speeds: Sequence[float], rims: Sequence[float], falls: Sequence[float]
) -> Rounding:
    """Return bounds of the rounding errors of velocities and spins at one impact.

    Args:
        scene: The scene.
        first: A disc.
        second: A disc or the body number of a wall.
        speeds: Speeds before the impact of those of both that are discs, in metres per second.
        rims: Likewise the speeds of their rims.
        falls: Likewise how far the velocities before the impact may be off.
    """
    arrays, movers = scene.arrays, [first, second] if second >= 0 else [first]
    fast, back = sum(speeds) + sum(rims), scene.tangential_restitution
    restitution, friction, rolling = scene.restitution, scene.friction, 0.0
    if second < 0:
        k = wall_index(second)
        restitution, friction = arrays.materials[k]
        back, rolling = scene.wall_tangential_restitution, scene.wall_rolling_resistance
        fast += arrays.drive_of_wall(k).fastest + abs(arrays.belt_of_wall(k))
    push = 1.0 + restitution
    drag = max(1.0 + back, (friction + rolling) * push) if friction or rolling else 0.0
    masses = [1.0 / scene.discs[i].mass_kg for i in movers]
    velocities, spins = [], []
    for i, mass, speed, rim, fall in zip(movers, masses, speeds, rims, falls, strict=True):
        share = mass / sum(masses) if mass else 0.0
        law = share * (ROUNDINGS_OF_LAW * UNIT * fast + sum(falls))
        velocities.append((push + drag) * law + ROUNDINGS_OF_SUM * UNIT * speed + fall)
        turned = drag * law / scene.discs[i].inertia_factor + ROUNDINGS_OF_RIM * UNIT * rim
        spins.append(turned / scene.discs[i].radius_m)
    (v1, v2), (w1, w2) = (*velocities, 0.0)[:2], (*spins, 0.0)[:2]
    return Rounding((v1, v2), (w1, w2))


class _Widened:
    """A certified run of one precision whose state is widened at each event."""

    def __init__(self, scene: Scene, trace: Trace) -> None:
        self.scene = scene
        self.bodies = BallBodies(scene)
        last_s = float(trace.impacts["time_s"].max(initial=0.0))
        self.found = Envelope(gap_m=gap_resolution(2.0 * compute_extent(scene, trace, last_s)))
        self._final_gap_m = gap_resolution(2.0 * compute_extent(scene, trace, trace.end_time_s))
        self._last_rounding = [(0.0, 0.0)] * len(scene.discs)
        self._in_contact = [0] * len(scene.discs)
        self._pull = math.hypot(*scene.gravity_m_s2) + scene.table_deceleration_m_s2

    def envelope(self, most: int) -> Envelope:
        """Return the envelope with at most some number of events."""
        found, bodies = self.found, self.bodies
        try:
            if (trouble := find_degenerate_start(bodies)) is not None:
                raise Undecided(trouble)
            self._begin()
            selection = Selection(bodies)
            end = undamped_time_of(self.scene.damping_per_s, arb(self.scene.duration_s))
            selection.end_s = float_above(end)
            commutes = False
            while len(found.events) < most:
                choice = selection.next_impact()
                if choice is None or choice.meeting.time > end:
                    found.horizon_s, found.end = math.inf, self._final_states()
                    return found
                if not choice.meeting.time <= end:
                    selection.raise_at_the_end(choice.meeting)
                self._carry_out(choice.meeting)
                if commutes or choice.commutes:
                    self._mark_unordered()
                commutes = choice.commutes
                selection.changed(choice.meeting)
            found.horizon_s = self._earliest_s(selection)
        except Undecided as undecided:
            found.horizon_s = min(found.horizon_s, self._clock(arb(undecided.degeneracy.earliest_s)))
        return found

    def _begin(self) -> None:
        """Begin the motion on a table, and the contacts of discs that lie on something; widen all other centres."""
        bodies, table = self.bodies, self.scene.table_deceleration_m_s2
        lying = dict(find_resting(bodies)) if bodies.falls else {}
        for i in range(len(bodies)):
            if bodies.movable[i] and i not in lying:
                bodies.x[i], bodies.y[i] = _widen_point(bodies.x[i], bodies.y[i], self.found.gap_m)
                if table:
                    start_deceleration(bodies, i, ZERO, 0.0)
        for i, ground in lying.items():
            closing = -float(ground.normal_part(bodies.vx[i], bodies.vy[i]).mid())
            begun = begin_contact(bodies, i, ground)
            if isinstance(begun, Meeting):
                self._carry_out(self._delayed(begun, i, self.found.gap_m / closing, ground.length))
            else:
                self._add(BallEvent(None, (begun,)), None, Rounding((0.0, 0.0), (0.0, 0.0)))
                self._widen_in_contact(i, 0.0, self._fall_m_s(i, ZERO))

    def _mark_unordered(self) -> None:
        """Record that the last impact may come before or after another one."""
        for k in reversed(range(len(self.found.events))):
            event = self.found.events[k]
            if isinstance(event, EnvelopeImpact):
                self.found.events[k] = event._replace(is_ordered=False)
                return

    def _delayed(self, begun: Meeting, i: int, most_s: float, length: arb) -> Meeting:
        """Return the impact of a disc whose gap was set to 0, at a time from 0 to a bound.

        What it falls meanwhile is in its velocity.
        """
        bodies, near, fallen = self.bodies, begun.near, arb(0, self._pull * most_s)
        assert isinstance(near, WallApproach)
        bodies.vx[i], bodies.vy[i] = bodies.vx[i] + fallen, bodies.vy[i] + fallen
        time = arb(0.5 * most_s, 0.5 * most_s)
        return begun._replace(time=time, latest=2.0 * most_s, near=near._replace(root=near.root + fallen * length))

    def _carry_out(self, meeting: Meeting) -> None:
        bodies, (first, second) = self.bodies, meeting[:2]
        rounding = self._rounding(meeting)
        event = apply_meeting(bodies, meeting)
        self._add(event, meeting, rounding, is_on_one_edge=not isinstance(meeting.near, Seam))
        discs = [(body, side) for side, body in enumerate((first, second)) if body >= 0 and bodies.movable[body]]
        if first == second:
            self._widen_in_contact(first, meeting.at, 2.0 * rounding.velocities[0])
        for i, side in discs if first != second else ():
            self._last_rounding[i] = (rounding.velocities[side], rounding.spins[side])
            self._widen(i, meeting, rounding.velocities[side], rounding.spins[side])
        for i in {body for body, _ in discs}:
            record_landing(bodies, i, arb(LANDING_PART))

    def _widen(self, i: int, meeting: Meeting, speed_m_s: float, spin_rad_s: float) -> None:
        """Widen the state of a disc after an impact."""
        bodies, gap_m = self.bodies, self.found.gap_m
        if bodies.contacts.gliding[i] is not None:
            self._widen_in_contact(i, meeting.at, speed_m_s)
            return
        self._in_contact[i] = 0
        restitution, drag = self._law_of(meeting)
        if drag or not bodies.spin[i].is_exact():
            bodies.spin[i] = bodies.spin[i] + arb(0, spin_rad_s)
        second = self.bodies.trace_body(meeting.second)
        is_driven = second < 0 and not self.scene.arrays.drive_of_wall(wall_index(second)).is_stationary
        rounds = bool(drag) or is_driven or restitution not in {0.0, 1.0}
        if not self.scene.table_deceleration_m_s2:
            bodies.x[i], bodies.y[i] = _widen_point(bodies.x[i], bodies.y[i], gap_m)
            bodies.vx[i], bodies.vy[i] = (
                v if v.is_exact() and not rounds else v + arb(0, speed_m_s) for v in (bodies.vx[i], bodies.vy[i])
            )
            return
        # The deceleration is against the velocity: both are widened together.
        time, at = meeting.time, meeting.at
        (x, y), velocity = bodies.centre_at(i, time), bodies.velocity(i, time, at)
        vx, vy = (v if v.is_exact() and not rounds else v + arb(0, speed_m_s) for v in velocity)
        (x, y), wait = _widen_point(x, y, gap_m), time - arb(at)
        bodies.acceleration[i], bodies.contacts.stops[i] = None, None
        bodies.vx[i], bodies.vy[i], bodies.time[i] = vx, vy, at
        bodies.x[i], bodies.y[i] = x - vx * wait, y - vy * wait
        start_deceleration(bodies, i, time, at)

    def _widen_in_contact(self, i: int, at: float, speed_m_s: float) -> None:
        """Widen the state of a disc after an event, if it is in contact.

        Its path is that of its ground, which is exact. Its place on this path is rounded as any centre is. Its speed
        and the speed of its rim are rounded, and the slip is their sum; none of them is where the law makes it 0. The
        roundings of time add up over the disc's events in contact.
        """
        gliding = self.bodies.contacts.gliding[i]
        if gliding is None:
            return
        self._in_contact[i] += 1
        place, *speeds = gliding.begun
        wider = zip(speeds, (speed_m_s, 2.0 * speed_m_s, speed_m_s), strict=True)
        speed, slip, rim = (value if value.is_zero() else value + arb(0, by) for value, by in wider)
        widened = GlideState(place + arb(0, self.found.gap_m), speed, slip, rim)
        start_mode(self.bodies, i, Landing(gliding.since, gliding.ground, widened), at, gliding.mode)

    def _law_of(self, meeting: Meeting) -> tuple[float, float]:
        """Return restitution, and friction with rolling resistance, between the two bodies of an impact."""
        scene, second = self.scene, self.bodies.trace_body(meeting.second)
        if second >= 0:
            return scene.restitution, scene.friction
        restitution, friction = scene.arrays.materials[wall_index(second)]
        return restitution, friction + scene.wall_rolling_resistance

    # Roundings --------------------------------------------------------------------------------------------------------

    def _rounding(self, meeting: Meeting) -> Rounding:
        """Return bounds of the rounding errors of velocities and spins at one impact."""
        bodies, (first, second) = self.bodies, meeting[:2]
        movers = [first, second] if second >= 0 and second != first else [first]
        falls = [self._fall_m_s(i, meeting.time) for i in movers]
        if first == second:
            return Rounding((falls[0], 0.0), (0.0, 0.0))
        speeds = [math.hypot(*map(_size, bodies.velocity(i, meeting.time, meeting.at))) for i in movers]
        rims = [_size(bodies.rim_speed(i)) for i in movers]
        return law_rounding(self.scene, first, bodies.trace_body(second), speeds, rims, falls)

    def _fall_m_s(self, i: int, time: arb) -> float:
        """Return a bound of the rounding error of a velocity after a flight under gravity, or on a table."""
        if not self._pull or not self.bodies.movable[i]:
            return 0.0
        time_s = _size(time)
        flown_s = max(0.0, time_s - self.bodies.time[i])
        speed = math.hypot(*map(_size, self.bodies.velocity(i, time, self.bodies.time[i]))) + self._pull * flown_s
        return UNIT * (ROUNDINGS_OF_FALL * speed + ROUNDINGS_OF_FALL_TIME * self._pull * time_s)

    # Events as traces have them ---------------------------------------------------------------------------------------

    def _add(
        self, event: BallEvent, meeting: Meeting | None, rounding: Rounding, *, is_on_one_edge: bool = True
    ) -> None:
        impact, events = event.impact, self.found.events
        for mode in event.modes:
            own_s = (1 + self._in_contact[mode.disc]) * clock_resolution(_size(mode.time))
            speed = self._fall_m_s(mode.disc, mode.time) + rounding.velocities[0]
            events.append(EnvelopeMode(mode, speed, own_s))
        if impact is None:
            return
        in_contact = max(self._in_contact[body] for body in (impact.first, impact.second) if body >= 0)
        own_s = (1 + in_contact) * clock_resolution(_size(impact.time))
        if damping := self.scene.damping_per_s:
            left = float(speed_fraction(damping, impact.time).lower())
            own_s = own_s / max(left, UNIT) + clock_resolution(self._clock(impact.time))
            impact = damp_impact(damping, impact)
        if impact.edge != NO_EDGE and meeting is not None:
            is_on_one_edge &= len(self.bodies.obstacles[wall_index(meeting.second)].edges) == 1
        position = len(events) - len(event.modes)  # an impact comes before the modes that it begins or ends
        events.insert(position, EnvelopeImpact(impact, rounding, own_s, is_on_one_edge))

    def _clock(self, time: arb) -> float:
        """Convert a time of the undamped run to seconds of the scene's clock."""
        shown = damped_time(self.scene.damping_per_s, time)
        return float(shown.mid()) if shown.is_finite() else math.inf

    def _earliest_s(self, selection: Selection) -> float:
        """Return a time before which the envelope has all events, after the last applied event."""
        try:
            choice = selection.next_impact()
        except Undecided as undecided:
            return self._clock(arb(undecided.degeneracy.earliest_s))
        if choice is None:
            return math.inf
        return self._clock(choice.meeting.time.lower())

    def _final_states(self) -> list[FinalState]:
        bodies, damping, end_s = self.bodies, self.scene.damping_per_s, self.scene.duration_s
        now = undamped_time_of(damping, arb(end_s))
        left, found = speed_fraction(damping, now), []
        for i in range(len(bodies)):
            moves = bodies.movable[i]
            place = bodies.centre_at(i, now) if moves else bodies.centre(i, end_s)
            vx, vy = bodies.velocity(i, now, end_s)
            speed, spin = math.hypot(_size(vx), _size(vy)), bodies.spin_at(i, now)
            by_impact, by_impact_spin = self._last_rounding[i]
            speed_m_s = by_impact + self._fall_m_s(i, now) + ROUNDINGS_OF_SUM * UNIT * speed
            place_m = self._final_gap_m + by_impact * max(0.0, end_s - bodies.time[i])
            spin_rad_s = by_impact_spin + ROUNDINGS_OF_RIM * UNIT * _size(spin)
            states = ((vx * left, vy * left), spin * left, place_m, speed_m_s, spin_rad_s)
            found.append(FinalState(place, *states))
        return found


def _widen_point(x: arb, y: arb, by: float) -> tuple[arb, arb]:
    return x + arb(0, by), y + arb(0, by)


def _size(ball: arb) -> float:
    """Return an upper bound of the magnitude of a ball's numbers."""
    return float(abs(ball).upper())
