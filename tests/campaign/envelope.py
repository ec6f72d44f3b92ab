"""Rounding envelope of a scene: the events of a certified run, and how far roundings may have a float64 run off.

How far roundings have grown is measured by copies of the scene. A copy has its start moved by the resolution that PIC
states, and is rotated by any angle, so that each operation rounds otherwise. Where copies differ in which events they
have, rounding decides, and no later event is compared.
"""

import contextlib
import math
import random
import signal
import time
from collections.abc import Callable, Iterator
from types import FrameType
from typing import NamedTuple

import numpy as np
from tests.campaign.events import (
    NEAR_LANDING,
    UNIT,
    Event,
    Floats,
    Name,
    Record,
    is_in_landing,
    list_events,
)
from tests.campaign.transformation import restore_record, rotate_scene
from tests.transformed_scenes import turn_by

from carom import CertifiedTrace, Disc, Outcome, Scene, Trace, solve_pic
from carom.core.resolution import clock_resolution, gap_resolution
from carom.model.disc_arrays import list_wall_lengths
from carom.model.flights import free_flights
from carom.solvers.certified.options import CertifyOptions
from carom.solvers.certified.result import Ending
from carom.solvers.certified.run import CertifiedRun

#: Seconds of processor time of a certified run.
CERTIFIED_S = 2.0
#: Copies that are run for each scene, and where one of their events decides that there is a difference.
FEW, MANY = 4, 20
#: Relative change of velocities and spins of a copy's start, in roundings: as many as a sum of velocities has.
ROUNDINGS_OF_START = 4


class Copy(NamedTuple):
    """Result of a copy, rotated back.

    Attributes:
        events: By name.
        in_landing: Names of those that are the last before a landing.
        end_s: Before this time it has all events.
        record: Its record.
    """

    events: dict[Name, Event]
    in_landing: frozenset[Name]
    end_s: float
    record: Record


class Envelope:
    """Certified events of a scene, and the spread of its copies.

    Attributes:
        certified: The certified run.
        certified_s: Time up to which the certified run has all events.
        certified_events: Its events.
        horizon_s: Time before which all copies have the same events.
        gap_m: By how much each coordinate of a copy's start is moved at most.
    """

    def __init__(self, scene: Scene, trace: Trace, most: int, solve: Callable[..., Trace]) -> None:
        self.scene, self._solve, self._most_impacts = scene, solve, len(trace.impacts) + 1
        self._lying = set() if trace.modes is None else {*trace.modes["disc"][trace.modes["time_s"] == 0.0].tolist()}
        self._rng = random.Random(scene.name)
        self.gap_m = gap_resolution(2.0 * compute_extent(scene, trace))
        self.certified = certify_within(CERTIFIED_S, scene, most)
        self.certified_s = _find_certified_time(self.certified)
        self.certified_events = list_events(scene, Record.of(self.certified.trace), self.gap_m)
        self._copies: list[Copy] = []
        self.horizon_s = math.inf
        self.run_copies(FEW)

    @property
    def events(self) -> list[Event]:
        """The certified events that come before rounding decides."""
        return [event for event in self.certified_events if event.time_s < min(self.horizon_s, self.certified_s)]

    def run_copies(self, count: int) -> None:
        """Run copies up to a number, and find the time before which all have the same events."""
        while len(self._copies) < count:
            angle_rad = self._rng.uniform(0.0, math.tau)
            copy = rotate_scene(self._perturb_start(), turn_by(angle_rad))
            trace = self._solve(copy, max_impacts=self._most_impacts)
            record = restore_record(Record.of(trace), turn_by(-angle_rad))
            found = list_events(self.scene, record, self.gap_m)
            near = frozenset(event.name for event in found if is_in_landing(event, found, NEAR_LANDING))
            end_s = math.inf
            if trace.outcome is not Outcome.COMPLETED:
                end_s = trace.end_time_s - 2.0 * clock_resolution(trace.end_time_s)
            self._copies.append(Copy({event.name: event for event in found}, near, end_s, record))
        self.horizon_s = self._find_horizon()

    def _perturb_start(self) -> Scene:
        """Return the scene with a start that is moved by no more than rounding; discs in contact are not moved."""
        rng, gap_m = self._rng, self.gap_m

        def near(value: float) -> float:
            return value * (1.0 + rng.uniform(-1.0, 1.0) * ROUNDINGS_OF_START * UNIT)

        def moved(disc: Disc) -> Disc:
            (x, y), (u, v) = disc.position_m, disc.velocity_m_s
            update = {
                "position_m": (x + rng.uniform(-gap_m, gap_m), y + rng.uniform(-gap_m, gap_m)),
                "velocity_m_s": (near(u), near(v)),
                "spin_rad_s": near(disc.spin_rad_s),
            }
            return disc.model_copy(update=update)

        discs = enumerate(self.scene.discs)
        moved_discs = tuple(disc if disc.immovable or i in self._lying else moved(disc) for i, disc in discs)
        return self.scene.model_copy(update={"discs": moved_discs})

    def _find_horizon(self) -> float:
        copies, horizon_s = self._copies, math.inf
        if len({copy.record.outcome for copy in copies}) > 1:
            horizon_s = min(copy.end_s for copy in copies)
        for copy in copies:
            for name, event in copy.events.items():
                is_missing = any(name not in other.events and event.time_s < other.end_s for other in copies)
                if is_missing and name not in copy.in_landing:
                    horizon_s = min(horizon_s, event.time_s)
        return horizon_s

    def spread(self, event: Event) -> tuple[float, Floats] | None:
        """Return how far copies of an event are from their middle in time and values; None for fewer than two."""
        same = [copy.events[event.name] for copy in self._copies if event.name in copy.events]
        if len(same) < 2:
            return None
        times, values = np.array([other.time_s for other in same]), np.array([other.values for other in same])
        return float(0.5 * np.ptp(times)), 0.5 * np.ptp(values, axis=0)

    def is_on_one_edge(self, event: Event) -> bool:
        """Whether the copies agree on the edge of an impact."""
        return len({tuple(copy.events[event.name].edge) for copy in self._copies if event.name in copy.events}) == 1

    def spread_of_ends(self) -> float:
        """Return how far apart in time the copies end, in seconds; 0 if a copy does not end before the scene does."""
        ends = [copy.end_s for copy in self._copies]
        return 0.0 if math.inf in ends else max(ends) - min(ends)

    def spread_of_final_states(self) -> Floats:
        """Return how far copies are from their middle at the end of the scene."""
        return np.asarray(0.5 * np.ptp([copy.record.final_states for copy in self._copies], axis=0))


def compute_envelope(scene: Scene, trace: Trace, most: int, solve: Callable[..., Trace] = solve_pic) -> Envelope:
    """Return the rounding envelope of a scene.

    Args:
        scene: The scene.
        trace: A run of it, for the number of its impacts and how far discs get from the origin.
        most: Impacts after which the certified run ends.
        solve: The solver under test, which also solves the copies.
    """
    return Envelope(scene, trace, most, solve)


def compute_extent(scene: Scene, trace: Trace) -> float:
    """Return a bound on what a body's coordinates, its radius and the terms of its way add up to, in metres."""
    arrays, until_s = scene.arrays, float(trace.impacts["time_s"].max(initial=0.0))
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


@contextlib.contextmanager
def alarm(seconds: float, handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Call a handler after some seconds of processor time in the block; an outer limit continues after it."""
    before = signal.signal(signal.SIGPROF, handler)
    left, _ = signal.setitimer(signal.ITIMER_PROF, seconds)
    begin_s = time.process_time()
    try:
        yield
    finally:
        left = max(1e-3, left - (time.process_time() - begin_s)) if left else 0.0
        signal.signal(signal.SIGPROF, before)
        signal.setitimer(signal.ITIMER_PROF, left)


def certify_within(seconds: float, scene: Scene, impacts: int) -> CertifiedTrace:
    """Return what `carom.certify` proves of a scene within some seconds of processor time, or little more."""

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt  # which ends a certified run, and keeps what was certified

    run = CertifiedRun(scene, CertifyOptions(max_impacts=impacts))
    with contextlib.suppress(KeyboardInterrupt), alarm(seconds, interrupt):
        run.advance()
    if run.ending is None:  # interrupted between two attempts
        run = CertifiedRun(scene, CertifyOptions(max_impacts=0))
        run.advance()
    return run.result()


def _find_certified_time(certified: CertifiedTrace) -> float:
    """Return the time up to which a certified run has all events."""
    if certified.ending is Ending.COMPLETED:
        return math.inf
    if certified.degeneracy is not None:
        return certified.degeneracy.earliest_s
    last_s = float(certified.trace.impacts["time_s"].max(initial=0.0))
    return last_s - 4.0 * clock_resolution(last_s)  # events at the same instant may come later
