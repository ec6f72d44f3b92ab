"""Differences between a run of PIC and the rounding envelope of its scene."""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from flint import arb, ctx
from numpy.typing import NDArray
from tests.campaign.envelope import (
    PRECISION,
    ROUNDINGS_OF_FALL,
    ROUNDINGS_OF_FALL_TIME,
    UNIT,
    Envelope,
    EnvelopeImpact,
    EnvelopeMode,
    Rounding,
    law_rounding,
)

from carom import Outcome, Scene, Trace
from carom.core.resolution import clock_resolution
from carom.model.trace import Mode, body_name, wall_index

Floats = NDArray[np.float64]
Rows = NDArray[np.void]


class Kind(StrEnum):
    """Kind of a difference; tables show its value."""

    MISSED = "missed impact"
    SPURIOUS = "spurious impact"
    ROUNDING = "impact that is rounding"
    TIME = "time of an impact"
    VELOCITY = "velocity"
    SPIN = "spin"
    EDGE = "edge of a wall"
    MODE = "mode of contact"
    FINAL_STATE = "final state"
    ENDING = "ending"
    EARLY_END = "end before certified events"
    EARLY_LANDING = "landing before certified bounces"
    NOTE = "note of an ending"
    #: A documented limit of PIC, which is counted and is no finding.
    LOW_HOPS = "contact where hops are lower than a gap's resolution"
    #: Likewise of a disc that an impact may lift off the wall that it is in contact with.
    KEPT_CONTACT = "contact kept where rounding decides whether a disc hops"


class Difference(NamedTuple):
    """One difference: what differs, when, and a sentence with the numbers."""

    kind: Kind
    time_s: float
    text: str


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
    def of(cls, trace: Trace) -> Record:
        """Return the record of a trace."""
        return cls(**{name: getattr(trace, name) for name in cls.__dataclass_fields__})

    @property
    def is_cut(self) -> bool:
        """Whether a limit ended the run, so that more events may follow."""
        return self.outcome is Outcome.MAX_IMPACTS


def compare_with_envelope(scene: Scene, envelope: Envelope, record: Record) -> list[Difference]:
    """Return the differences of a run from all runs within PIC's rounding bounds, in order of time."""
    with ctx.workprec(PRECISION):
        return sorted(_Comparison(scene, envelope, record).differences(), key=lambda found: found.time_s)


def impact_rounding(scene: Scene, record: Record, k: int) -> Rounding:
    """Return bounds of the rounding errors of an impact, including those of the flights before it."""
    row = record.impacts[k]
    pair = (int(row["first"]), int(row["second"]))
    discs = [body for body in pair if body >= 0]
    speeds = [float(np.hypot(*row[f"velocity_{side}_before"])) for side in ("first", "second")[: len(discs)]]
    spins = (0.0, 0.0) if record.spins is None else record.spins[k].tolist()[:2]
    rims = [abs(spin) * scene.discs[disc].radius_m for spin, disc in zip(spins, discs, strict=False)]
    pull = math.hypot(*scene.gravity_m_s2) + scene.table_deceleration_m_s2
    by_time = (ROUNDINGS_OF_FALL + ROUNDINGS_OF_FALL_TIME) * pull * float(row["time_s"]) if pull else 0.0
    falls = [UNIT * (by_time + ROUNDINGS_OF_FALL * speed) if pull else 0.0 for speed in speeds]
    return law_rounding(scene, *pair, speeds, rims, falls)


def closing_speed(scene: Scene, record: Record, k: int) -> tuple[float, float]:
    """Return the approach speed of the bodies of an impact, and a bound of its rounding error."""
    row = record.impacts[k]
    closing = float((row["velocity_first_before"] - row["velocity_second_before"]) @ row["normal"])
    return closing, sum(impact_rounding(scene, record, k).velocities)


class _Comparison:
    def __init__(self, scene: Scene, envelope: Envelope, record: Record) -> None:
        self.scene, self.envelope, self.record = scene, envelope, record
        self._impacts: dict[tuple[int, int], deque[int]] = defaultdict(deque)
        for k, (first, second) in enumerate(record.impacts[["first", "second"]].tolist()):
            self._impacts[first, second].append(k)
        self._modes: dict[tuple[int, ...], deque[int]] = defaultdict(deque)
        rows = () if record.modes is None else record.modes[["disc", "wall", "before", "after"]].tolist()
        for k, (disc, wall, before, after) in enumerate(rows):
            self._modes[disc, wall, *map(_sticking, (before, after))].append(k)

    def differences(self) -> Iterator[Difference]:
        """Yield the differences up to the first event that differs: later events are not comparable."""
        for event in self.envelope.events:
            if self._ends_by_name_before(event):
                text = f"ends by {self.record.outcome.name} at {self.record.end_time_s!r} s, before the event at "
                text += f"{_format_ball(_time_of(event))} s: {self.record.notes}"
                yield Difference(Kind.EARLY_END, self.record.end_time_s, text)
                return
            found = list(self._of_impact(event) if isinstance(event, EnvelopeImpact) else self._of_mode(event))
            yield from found
            if found or (self.record.is_cut and self._has_ended_before(_time_of(event))):
                return
        yield from self._left_over()
        if self.envelope.end is not None:
            yield from self._of_end()

    def _ends_by_name_before(self, event: EnvelopeImpact | EnvelopeMode) -> bool:
        """Whether the run certainly ends before an event, for another reason than a limit."""
        if self.record.outcome in {Outcome.COMPLETED, Outcome.MAX_IMPACTS}:
            return False
        return bool(_time_of(event).lower() > self.record.end_time_s + event.time_s)

    def _has_ended_before(self, time: arb) -> bool:
        """Whether the run may have ended before an event."""
        return not time.upper() < self.record.end_time_s

    def _of_impact(self, event: EnvelopeImpact) -> Iterator[Difference]:
        impact, record = event.impact, self.record
        key = (impact.first, impact.second)
        if not self._impacts[key]:
            if self._has_ended_before(event.impact.time + arb(0, event.time_s)) or self._is_in_landing(*key, event):
                return
            yield Difference(
                Kind.MISSED, _middle(impact.time), f"{_format_bodies(*key)} meet at {_format_ball(impact.time)} s"
            )
            return
        k = self._impacts[key].popleft()
        row, what = record.impacts[k], f"impact {k}, of {_format_bodies(*key)},"
        if not _overlaps(row["time_s"], impact.time, event.time_s):
            closing, known = closing_speed(self.scene, record, k)
            text = f"{what} is at {float(row['time_s'])!r} s, not at {_format_ball(impact.time)} s; "
            text += f"closes at {closing!r} m/s"
            kind = Kind.ROUNDING if closing <= known else Kind.TIME
            yield Difference(kind, min(float(row["time_s"]), _middle(impact.time)), text)
            return
        if not event.is_ordered:
            return
        velocities = [("velocity_first_after", impact.after[:2], 0), ("velocity_second_after", impact.after[2:], 1)]
        if impact.before is not None:
            before = impact.before
            velocities += [("velocity_first_before", before[:2], 0), ("velocity_second_before", before[2:], 1)]
        values = [
            (name, value, ball, event.rounding.velocities[side])
            for name, balls, side in velocities
            for value, ball in zip(row[name], balls, strict=True)
        ]
        yield from _find_first_off(Kind.VELOCITY, row["time_s"], what, values)
        if record.spins is not None:
            sides = list(enumerate(("first_after", "second_after")))[: 2 if key[1] >= 0 else 1]
            spins, own = record.spins[k], event.rounding.spins
            values = [(f"spin {name}", spins[name], impact.spins_after[side], own[side]) for side, name in sides]
            yield from _find_first_off(Kind.SPIN, row["time_s"], what, values)
        if record.edges is not None and event.is_on_one_edge and tuple(record.edges[k]) != impact.edge:
            text = f"{what} is on edge {tuple(record.edges[k])}, not on {impact.edge}"
            yield Difference(Kind.EDGE, float(row["time_s"]), text)

    def _of_mode(self, event: EnvelopeMode) -> Iterator[Difference]:
        mode, record = event.mode, self.record
        key = (mode.disc, mode.wall, _sticking(mode.before), _sticking(mode.after))
        if record.modes is None or not self._modes[key]:
            if self._has_ended_before(mode.time + arb(0, event.time_s)) or self._has_with_next(event):
                return
            change = f"disc {mode.disc} on {body_name(mode.wall)}: {mode.before.name} to {mode.after.name}"
            yield Difference(Kind.MODE, _middle(mode.time), f"{change} at {_format_ball(mode.time)} s is missing")
            return
        k = self._modes[key].popleft()
        row = record.modes[k]
        what = f"mode {k}, of disc {mode.disc} on {body_name(mode.wall)},"
        is_still = not (row["velocity"].any() or row["acceleration"].any())
        if row["after"] != mode.after and is_still != (row["after"] == Mode.REST):
            text = f"{what} is {Mode(row['after']).name}, which does not match its velocity and acceleration"
            yield Difference(Kind.MODE, float(row["time_s"]), text)
            return
        if not _overlaps(row["time_s"], mode.time, event.time_s):
            text = f"{what} begins at {row['time_s']!r} s, not at {_format_ball(mode.time)} s"
            yield Difference(Kind.MODE, float(row["time_s"]), text)
            return
        gap_m, speed_m_s = self.envelope.gap_m, event.speed_m_s
        radius = self.scene.discs[mode.disc].radius_m
        # Friction and rolling resistance are in proportion to what presses the disc against the wall.
        friction = self.scene.arrays.materials[wall_index(mode.wall)].friction
        resistances = {
            Mode.SLIDE: friction,
            Mode.BLOCK: friction,
            Mode.ROLL: self.scene.wall_rolling_resistance,
        }
        pull = math.hypot(*self.scene.gravity_m_s2) * (1.0 + resistances.get(mode.after, 0.0))
        values = [
            *zip(("x", "y"), row["position"], mode.place, (gap_m, gap_m), strict=True),
            *zip(("vx", "vy"), row["velocity"], mode.velocity, (speed_m_s, speed_m_s), strict=True),
            *zip(("ax", "ay"), row["acceleration"], mode.acceleration, (16 * UNIT * pull,) * 2, strict=True),
            ("spin", row["spin"], mode.spin, speed_m_s / radius),
        ]
        yield from _find_first_off(Kind.MODE, row["time_s"], what, values)

    def _has_with_next(self, event: EnvelopeMode) -> bool:
        """Whether the run combines this change with the disc's next one, because their times are equal on its clock.

        The run's change then counts as the next one, which may be beyond the envelope.
        """
        mode, record, events = event.mode, self.record, self.envelope.events
        later = [one for one in events[events.index(event) + 1 :] if isinstance(one, EnvelopeMode)]
        follower = next((one.mode for one in later if one.mode.disc == mode.disc), None)
        for key, numbers in list(self._modes.items()):
            if record.modes is None or not numbers or key[:3] != (mode.disc, mode.wall, _sticking(mode.before)):
                continue
            if follower is not None and (follower.wall, _sticking(follower.after)) != key[1::2]:
                continue
            if _overlaps(record.modes[numbers[0]]["time_s"], mode.time, event.time_s):
                self._modes[*key[:2], _sticking(mode.after), key[3]].appendleft(numbers.popleft())
                return True
        return False

    def _is_in_landing(self, disc: int, wall: int, event: EnvelopeImpact) -> bool:
        """Whether a bounce is one of those that the run replaces by a landing at the same time."""
        if self.record.modes is None or wall >= 0:
            return False
        modes = self.record.modes
        landings = modes[(modes["disc"] == disc) & (modes["wall"] == wall) & (modes["before"] == Mode.FLIGHT)]
        return any(_overlaps(time, event.impact.time, event.time_s) for time in landings["time_s"])

    def _left_over(self) -> Iterator[Difference]:
        """Yield impacts and mode changes of the run that no run within the rounding bounds has."""
        record, horizon_s = self.record, self.envelope.horizon_s
        for k in sorted(k for rows in self._impacts.values() for k in rows):
            row = record.impacts[k]
            time_s, pair = float(row["time_s"]), (int(row["first"]), int(row["second"]))
            if time_s + 2.0 * clock_resolution(time_s) < horizon_s and not self._comes_before_landing(row):
                closing, known = closing_speed(self.scene, record, k)
                text = f"impact {k}, of {_format_bodies(*pair)}, at {time_s!r} s, closes at {closing!r} m/s"
                yield Difference(Kind.ROUNDING if closing <= known else Kind.SPURIOUS, time_s, text)
                return
        for k in sorted(k for rows in self._modes.values() for k in rows):
            assert record.modes is not None
            time_s = float(record.modes[k]["time_s"])
            if time_s + 2.0 * clock_resolution(time_s) < horizon_s:
                yield Difference(Kind.MODE, time_s, f"mode {k} is spurious: {record.modes[k]}")
                return

    def _comes_before_landing(self, row: np.void) -> bool:
        """Whether an impact is one of the bounces that the envelope replaces by a landing."""
        for event in self.envelope.events:
            if isinstance(event, EnvelopeMode) and event.mode.before is Mode.FLIGHT:
                same = (event.mode.disc, event.mode.wall) == (int(row["first"]), int(row["second"]))
                if same and _overlaps(row["time_s"], event.mode.time, event.time_s):
                    return True
        return False

    def _of_end(self) -> Iterator[Difference]:
        record, end = self.record, self.envelope.end
        assert end is not None
        if record.outcome is not Outcome.COMPLETED:
            if not record.is_cut:
                text = f"ends by {record.outcome.name} at {record.end_time_s!r} s, and nothing ends it: {record.notes}"
                yield Difference(Kind.ENDING, record.end_time_s, text)
            return
        for i, state in enumerate(end):
            rows = [("position", record.final_position_m[i], state.place, state.place_m)]
            rows.append(("velocity", record.final_velocity_m_s[i], state.velocity, state.speed_m_s))
            values = [(name, *pair, own) for name, row, balls, own in rows for pair in zip(row, balls, strict=True)]
            if record.final_spin_rad_s is not None:
                values.append(("spin", record.final_spin_rad_s[i], state.spin, state.spin_rad_s))
            yield from _find_first_off(Kind.FINAL_STATE, record.end_time_s, f"disc {i} at the end", values)


def _sticking(mode: int) -> int:
    """Return a mode; rest counts as rolling, because rounding decides between them at a speed near 0."""
    return int(Mode.ROLL if mode == Mode.REST else mode)


def _time_of(event: EnvelopeImpact | EnvelopeMode) -> arb:
    return event.impact.time if isinstance(event, EnvelopeImpact) else event.mode.time


def _overlaps(value: float, ball: arb, rounding: float) -> bool:
    """Whether a number of a run is in a ball, except for the run's own rounding error."""
    return bool(arb(float(value), rounding).overlaps(ball))


def _find_first_off(
    kind: Kind, time_s: float, what: str, values: Iterable[tuple[str, float, arb, float]]
) -> Iterator[Difference]:
    """Yield the first number of a run that is not in its ball."""
    for name, value, ball, own in values:
        if not _overlaps(value, ball, own):
            yield Difference(kind, float(time_s), f"{what} has {name} {value!r}, not {_format_ball(ball)}")
            return


def _middle(ball: arb) -> float:
    return float(ball.mid())


def _format_ball(ball: arb) -> str:
    return f"{float(ball.mid())!r} ± {float(ball.rad()):.2g}"


def _format_bodies(first: int, second: int) -> str:
    return f"{body_name(first)} and {body_name(second)}"
