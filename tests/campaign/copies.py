"""Estimates of the rounding errors of a run, from copies of its scene that have other rounding errors.

A copy has its start moved by the resolution that PIC states, and is rotated by any angle, so that each operation rounds
otherwise. Where copies differ in which events they have, rounding decides. Copies measure to first order what an
envelope (`tests.campaign.envelope`) proves, and go on where its balls have become too wide.
"""

import math
import random
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from tests.campaign.comparison import Record
from tests.campaign.envelope import UNIT
from tests.campaign.events import NEAR_LANDING, Event, Floats, Name, is_in_landing, list_events
from tests.campaign.transformation import restore_record, rotate_scene
from tests.transformed_scenes import turn_by

from carom import Disc, Outcome, Scene, Trace
from carom.core.resolution import clock_resolution

#: Copies that are run for each scene, and where one of their events decides that there is a difference.
FEW, MANY = 4, 20
#: Relative change of velocities and spins of a copy's start, in roundings: as many as a sum of velocities has.
ROUNDINGS_OF_START = 4


class Copy(NamedTuple):
    """Result of a copy, rotated back to the original scene.

    Attributes:
        events: By name.
        in_landing: Names of those that are the last before a landing.
        end_s: Before this time it has all events.
        outcome: How its run ended.
    """

    events: dict[Name, Event]
    in_landing: frozenset[Name]
    end_s: float
    outcome: Outcome


class Copies:
    """Runs of copies of a scene.

    Args:
        scene: The scene.
        solve: The solver under test.
        most_impacts: Impacts of each run.
        gap_m: By how much each coordinate of a start is moved at most.
    """

    def __init__(self, scene: Scene, solve: Callable[..., Trace], most_impacts: int, gap_m: float) -> None:
        self._scene, self._solve, self._gap_m = scene, solve, gap_m
        self._most_impacts = max(1, most_impacts)
        self._rng = random.Random(scene.name)
        self._copies: list[Copy] = []
        self.horizon_s = math.inf
        self.run(FEW)

    def run(self, count: int) -> None:
        """Run a number of copies, and find the time before which all have the same events."""
        while len(self._copies) < count:
            angle_rad = self._rng.uniform(0.0, math.tau)
            copy = rotate_scene(_perturb_start(self._scene, self._gap_m, self._rng), turn_by(angle_rad))
            trace = self._solve(copy, max_impacts=self._most_impacts)
            found = list_events(self._scene, restore_record(Record.of(trace), turn_by(-angle_rad)), self._gap_m)
            near = frozenset(event.name for event in found if is_in_landing(event, found, NEAR_LANDING))
            end_s = math.inf
            if trace.outcome is not Outcome.COMPLETED:
                end_s = trace.end_time_s - 2.0 * clock_resolution(trace.end_time_s)
            self._copies.append(Copy({event.name: event for event in found}, near, end_s, trace.outcome))
        self.horizon_s = self._find_horizon()

    def _find_horizon(self) -> float:
        copies, horizon_s = self._copies, math.inf
        if len({copy.outcome for copy in copies}) > 1:
            horizon_s = min(copy.end_s for copy in copies)
        for copy in copies:
            for name, event in copy.events.items():
                if event.time_s < horizon_s and name not in copy.in_landing and self.count_copies_with(event)[1]:
                    horizon_s = event.time_s
        return horizon_s

    def count_copies_with(self, event: Event) -> tuple[int, int]:
        """Return the number of copies that have an event, and of those that continue beyond it without it."""
        having = sum(event.name in copy.events for copy in self._copies)
        return having, sum(event.name not in copy.events and event.time_s < copy.end_s for copy in self._copies)

    def spread(self, event: Event) -> tuple[float, Floats] | None:
        """Return the largest differences of an event's time and values from the copies; None if no copy has it."""
        same = [copy.events[event.name] for copy in self._copies if event.name in copy.events]
        if not same:
            return None
        values = np.max([np.abs(other.values - event.values) for other in same], axis=0)
        return max(abs(other.time_s - event.time_s) for other in same), values

    def spread_of_ends(self) -> float:
        """Return the difference between the copies' earliest and latest end; 0 if a copy reaches the scene's end."""
        ends = [copy.end_s for copy in self._copies]
        return 0.0 if math.inf in ends else max(ends) - min(ends)


def _perturb_start(scene: Scene, gap_m: float, rng: random.Random) -> Scene:
    """Return a scene whose start is changed by rounding errors only."""

    def near(value: float) -> float:
        return value * (1.0 + rng.uniform(-1.0, 1.0) * ROUNDINGS_OF_START * UNIT)

    def moved(disc: Disc) -> Disc:
        if disc.immovable:
            return disc
        (x, y), (u, v) = disc.position_m, disc.velocity_m_s
        update = {
            "position_m": (x + rng.uniform(-gap_m, gap_m), y + rng.uniform(-gap_m, gap_m)),
            "velocity_m_s": (near(u), near(v)),
            "spin_rad_s": near(disc.spin_rad_s),
        }
        return disc.model_copy(update=update)

    return scene.model_copy(update={"discs": tuple(map(moved, scene.discs))})
