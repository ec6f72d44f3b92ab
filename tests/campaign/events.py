"""Events of a run: its impacts and the changes of how discs move in contact, named so that runs can be compared."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from tests.campaign.comparison import Record, closing_speed, impact_rounding
from tests.campaign.envelope import ROUNDINGS_OF_FALL, ROUNDINGS_OF_FALL_TIME, UNIT

from carom import Scene
from carom.core.resolution import clock_resolution
from carom.model.trace import Mode, body_name, wall_index

Floats = NDArray[np.float64]
Key = tuple[int, ...]
Name = tuple[Key, int, int]

#: Resolutions of the clock within which bounces are part of a landing, and within which another run may have it so.
AS_LANDING, NEAR_LANDING = 8.0, 16.0


class Event(NamedTuple):
    """An impact or a change of a mode.

    Attributes:
        key: Bodies of an impact; disc, wall and both modes of a change.
        landings: Number of earlier landings of the disc on the wall of an impact.
        occurrence: How many events of that key came before it in its run, after as many landings.
        number: Index of the impact or mode in its run.
        time_s: When it is.
        values: What is compared: velocities and spins after an impact; position, velocity and spin of a mode.
        own: How far the roundings of this event alone may have each value off.
        closing_m_s: Speed at which the two bodies of an impact approach; speed that a disc loses from the change before
            to a reversal of its slip; infinity of other changes.
        closing_own_m_s: How far roundings may have that off.
        can_bounce: Whether it is an impact on a wall whose restitution is above 0.
    """

    key: Key
    landings: int
    occurrence: int
    number: int
    time_s: float
    values: Floats
    own: Floats
    closing_m_s: float
    closing_own_m_s: float
    can_bounce: bool = False

    @property
    def name(self) -> Name:
        """Identity of the event among the events of its run."""
        return self.key, self.landings, self.occurrence

    @property
    def is_impact(self) -> bool:
        """Whether it is an impact instead of a change of a mode."""
        return len(self.key) == 2

    @property
    def is_landing(self) -> bool:
        """Whether contact begins in it."""
        return not self.is_impact and self.key[2] == Mode.FLIGHT

    @property
    def landing(self) -> Key:
        """Beginning of the key of the landing that follows the last bounces on a wall."""
        return *self.key, int(Mode.FLIGHT)

    @property
    def description(self) -> str:
        """A phrase with the event and its time."""
        if self.is_impact:
            first, second = self.key
            return f"impact {self.number}, of {body_name(first)} and {body_name(second)}, at {self.time_s!r} s"
        disc, wall, before, after = self.key
        change = f"{Mode(before).name} to {Mode(after).name}"
        return f"mode {self.number}, of disc {disc} on {body_name(wall)}, {change}, at {self.time_s!r} s"


def list_events(scene: Scene, record: Record, gap_m: float) -> list[Event]:
    """Return the events of a run, in their order, without the last bounces before each landing.

    A run applies those of infinitely many bounces that its clock, or its digits, distinguish; their number is
    arbitrary.
    """
    found: list[Event] = []
    modes = [] if record.modes is None else list(enumerate(record.modes))
    for k in range(len(record.impacts) + 1):
        while modes and modes[0][1]["impacts"] <= k:
            number, row = modes.pop(0)
            found.append(_mode_event(scene, record, number, row, gap_m))
        if k < len(record.impacts):
            found.append(_impact_event(scene, record, k))
    return list(number_events(event for event in found if not is_in_landing(event, found, AS_LANDING)))


def number_events(events: Iterable[Event]) -> Iterator[Event]:
    """Yield events with the number of earlier events of the same bodies."""
    landings: Counter[Key] = Counter()
    seen: Counter[tuple[Key, int]] = Counter()
    for event in events:
        landed = landings[event.key] if event.is_impact else 0
        yield event._replace(landings=landed, occurrence=seen[event.key, landed])
        seen[event.key, landed] += 1
        if event.is_landing:
            landings[event.key[:2]] += 1


def _impact_event(scene: Scene, record: Record, k: int) -> Event:
    row = record.impacts[k]
    key = (int(row["first"]), int(row["second"]))
    spins = [0.0, 0.0] if record.spins is None else record.spins[k].tolist()[2:]
    (v1, v2), (w1, w2) = impact_rounding(scene, record, k)
    return Event(
        key,
        0,
        0,
        k,
        float(row["time_s"]),
        np.concatenate([row["velocity_first_after"], row["velocity_second_after"], spins]),
        np.array([v1, v1, v2, v2, w1, w2]),
        *closing_speed(scene, record, k),
        can_bounce=key[1] < 0 and scene.arrays.materials[wall_index(key[1])].restitution > 0.0,
    )


def _mode_event(scene: Scene, record: Record, k: int, row: np.void, gap_m: float) -> Event:
    key = tuple(int(row[name]) for name in ("disc", "wall", "before", "after"))
    radius, pull, time_s = scene.discs[key[0]].radius_m, math.hypot(*scene.gravity_m_s2), float(row["time_s"])
    speed = float(np.hypot(*row["velocity"])) + abs(float(row["spin"])) * radius
    own_m_s = UNIT * (ROUNDINGS_OF_FALL * speed + (ROUNDINGS_OF_FALL + ROUNDINGS_OF_FALL_TIME) * pull * time_s)
    values = np.concatenate([row["position"], row["velocity"], [row["spin"]]])
    own = np.array([gap_m, gap_m, own_m_s, own_m_s, own_m_s / radius])
    lost_m_s = math.inf
    if key[2:] == (Mode.SLIDE, Mode.SLIDE) and record.modes is not None:
        # A slip that roundings can begin, or not, also ends by roundings alone.
        before = next(other for other in record.modes[:k][::-1] if other["disc"] == row["disc"])
        lost_m_s = float(np.hypot(*before["acceleration"])) * (time_s - float(before["time_s"]))
    return Event(key, 0, 0, k, time_s, values, own, lost_m_s, own_m_s)


def is_in_landing(event: Event, run: Iterable[Event], clocks: float = AS_LANDING) -> bool:
    """Whether a bounce is within some resolutions of the clock of a landing of its run."""
    if not event.can_bounce:
        return False
    known_s = clocks * clock_resolution(event.time_s)
    return any(other.key[:3] == event.landing and abs(other.time_s - event.time_s) <= known_s for other in run)
