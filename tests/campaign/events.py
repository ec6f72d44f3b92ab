"""Events of a run: its impacts and the changes of how discs move in contact, named so that runs can be compared."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom import Outcome, Scene, Trace
from carom.core.resolution import clock_resolution
from carom.model.trace import Mode, body_name, wall_index

Floats = NDArray[np.float64]
Rows = NDArray[np.void]
Key = tuple[int, ...]
Name = tuple[Key, int, int]

UNIT = 2.0**-53
#: Roundings of the impact law in units of the relative speed, and of the velocity before: see `tests.checker.laws`.
ROUNDINGS_OF_LAW, ROUNDINGS_OF_SUM, ROUNDINGS_OF_RIM = 24, 4, 8
#: Roundings of the velocity of a disc that falls, of its speed, and of the recorded time: see `tests.checker.flights`.
ROUNDINGS_OF_FALL, ROUNDINGS_OF_FALL_TIME = 20, 4
#: Resolutions of the clock within which bounces are part of a landing, and within which another run may have it so.
AS_LANDING, NEAR_LANDING = 8.0, 16.0


@dataclass(frozen=True)
class Record:
    """Result of a run: the fields of `carom.Trace` that are compared."""

    impacts: Rows
    spins: Rows | None
    edges: Rows | None
    modes: Rows | None
    final_position_m: Floats
    final_velocity_m_s: Floats
    final_spin_rad_s: Floats | None
    end_time_s: float
    outcome: Outcome
    notes: tuple[str, ...]

    @classmethod
    def of(cls, trace: Trace) -> "Record":
        """Return the record of a trace."""
        return cls(**{name: getattr(trace, name) for name in cls.__dataclass_fields__})

    @property
    def final_states(self) -> Floats:
        """Position, velocity and spin of each disc at the end."""
        spins = self.final_spin_rad_s if self.final_spin_rad_s is not None else np.zeros(len(self.final_position_m))
        return np.column_stack([self.final_position_m, self.final_velocity_m_s, spins])


class Event(NamedTuple):
    """An impact or a change of a mode.

    Attributes:
        key: Bodies of an impact; disc, wall and both modes of a change.
        landings: Number of earlier landings of the disc on the wall of an impact.
        occurrence: How many events of that key came before it in its run, after as many landings.
        number: Index of the impact or mode in its run.
        time_s: When it is.
        values: What is compared: velocities and spins after an impact, and velocities before it; position, velocity and
            spin of a mode.
        own: How far the roundings of this event alone may have each value off.
        closing_m_s: Speed at which the two bodies of an impact approach; speed that a disc loses from the change before
            to a reversal of its slip; infinity of other changes.
        closing_own_m_s: How far roundings may have that off.
        edge: Edge of a finite wall that an impact is on.
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
    edge: tuple[int, ...] = ()
    can_bounce: bool = False

    @property
    def name(self) -> Name:
        """Identity of the event among the events of its run."""
        return self.key, self.landings, self.occurrence

    @property
    def is_impact(self) -> bool:
        """Whether it is an impact, and no change of a mode."""
        return len(self.key) == 2

    @property
    def is_landing(self) -> bool:
        """Whether contact begins in it."""
        return not self.is_impact and self.key[2] == Mode.FLIGHT

    @property
    def landing(self) -> Key:
        """How the key of a landing begins that an impact on a wall may be a bounce before."""
        return *self.key, int(Mode.FLIGHT)

    @property
    def description(self) -> str:
        """What it is, and when."""
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
    """Yield events with how many like them came before."""
    landings: Counter[Key] = Counter()
    seen: Counter[tuple[Key, int]] = Counter()
    for event in events:
        landed = landings[event.key] if event.is_impact else 0
        yield event._replace(landings=landed, occurrence=seen[event.key, landed])
        seen[event.key, landed] += 1
        if event.is_landing:
            landings[event.key[:2]] += 1


def is_in_landing(event: Event, run: Iterable[Event], clocks: float = AS_LANDING) -> bool:
    """Whether a bounce is one of the last before a landing of its run: within a number of resolutions of its clock."""
    if not event.can_bounce:
        return False
    known_s = clocks * clock_resolution(event.time_s)
    return any(other.key[:3] == event.landing and abs(other.time_s - event.time_s) <= known_s for other in run)


def _impact_event(scene: Scene, record: Record, k: int) -> Event:
    row = record.impacts[k]
    key = (int(row["first"]), int(row["second"]))
    spins = [0.0, 0.0] if record.spins is None else record.spins[k].tolist()
    before = row["velocity_first_before"], row["velocity_second_before"]
    (v1, v2), (w1, w2) = _impact_rounding(scene, row, spins)
    return Event(
        key,
        0,
        0,
        k,
        float(row["time_s"]),
        np.concatenate([row["velocity_first_after"], row["velocity_second_after"], spins[-2:], *before]),
        np.array([v1, v1, v2, v2, w1, w2, v1, v1, v2, v2]),
        float((before[0] - before[1]) @ row["normal"]),
        v1 + v2,
        () if record.edges is None else record.edges[k].tolist(),
        can_bounce=key[1] < 0 and scene.arrays.materials[wall_index(key[1])].restitution > 0.0,
    )


def _mode_event(scene: Scene, record: Record, k: int, row: np.void, gap_m: float) -> Event:
    key = tuple(int(row[name]) for name in ("disc", "wall", "before", "after"))
    radius, time_s = scene.discs[key[0]].radius_m, float(row["time_s"])
    speed = float(np.hypot(*row["velocity"])) + abs(float(row["spin"])) * radius
    own_m_s = fall_rounding(scene, speed, time_s)
    values = np.concatenate([row["position"], row["velocity"], [row["spin"]]])
    own = np.array([gap_m, gap_m, own_m_s, own_m_s, own_m_s / radius])
    lost_m_s = math.inf
    if key[2:] == (Mode.SLIDE, Mode.SLIDE) and record.modes is not None:
        # A slip that roundings can begin, or not, also ends by roundings alone.
        before = next(other for other in record.modes[:k][::-1] if other["disc"] == row["disc"])
        lost_m_s = float(np.hypot(*before["acceleration"])) * (time_s - float(before["time_s"]))
    return Event(key, 0, 0, k, time_s, values, own, lost_m_s, own_m_s)


# Roundings ------------------------------------------------------------------------------------------------------------


def fall_rounding(scene: Scene, speed_m_s: float, time_s: float) -> float:
    """Return how far the roundings of a flight or of contact may have a velocity off, in metres per second."""
    pull = math.hypot(*scene.gravity_m_s2) + scene.table_deceleration_m_s2
    by_time = (ROUNDINGS_OF_FALL + ROUNDINGS_OF_FALL_TIME) * pull * time_s
    return UNIT * (ROUNDINGS_OF_FALL * speed_m_s + by_time)


def _impact_rounding(
    scene: Scene, row: np.void, spins: Sequence[float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return how far the roundings of the flights to an impact, and of the impact, may have its results off.

    The result has two velocities in metres per second, and two spins in radians per second.
    """
    arrays, first, second = scene.arrays, int(row["first"]), int(row["second"])
    movers = [first, second] if second >= 0 else [first]
    speeds = [float(np.hypot(*row[f"velocity_{side}_before"])) for side in ("first", "second")[: len(movers)]]
    rims = [abs(spin) * scene.discs[disc].radius_m for spin, disc in zip(spins, movers, strict=False)]
    falls = [fall_rounding(scene, speed, float(row["time_s"])) if _has_pull(scene) else 0.0 for speed in speeds]
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
    velocities, turns = [], []
    for i, mass, speed, rim, fall in zip(movers, masses, speeds, rims, falls, strict=True):
        share = mass / sum(masses) if mass else 0.0
        law = share * (ROUNDINGS_OF_LAW * UNIT * fast + sum(falls))
        velocities.append((push + drag) * law + ROUNDINGS_OF_SUM * UNIT * speed + fall)
        turned = drag * law / scene.discs[i].inertia_factor + ROUNDINGS_OF_RIM * UNIT * rim
        turns.append(turned / scene.discs[i].radius_m)
    (v1, v2), (w1, w2) = (*velocities, 0.0)[:2], (*turns, 0.0)[:2]
    return (v1, v2), (w1, w2)


def _has_pull(scene: Scene) -> bool:
    return scene.gravity_m_s2 != (0.0, 0.0) or scene.table_deceleration_m_s2 > 0.0
