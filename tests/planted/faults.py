"""Faults to plant in a right run, and what a comparison must say of each at which size: the scorer's own table.

The runs are of three equal discs in a row. Disc 0 comes at 4 m/s, strikes disc 1 at 0.5 s and stops; disc 1 strikes
disc 2 at 1.25 s and stops; disc 2 goes on to the end at 2 s. So each number in the table follows by hand.
`replay_impacts` makes a run of impacts: where every disc is at the start of each step, and at the end, follows from
them. A fault of the impacts is planted before that, so that the run agrees with itself; one of what is reported, or of
the states, after it.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.scene_builders import alter_impact, disc_at, staged

from carom import Trace
from carom.comparator import Grade, Score, Verdict
from carom.model.trace import STATE_DTYPE

Array = NDArray[np.float64]
Rows = NDArray[np.void]
Says = Mapping[Verdict, float | None]
Plant = Callable[[Trace, float], Trace]

DT = 1 / 60
SPEED, LENGTH = 4.0, 0.5
FIRST_S, LAST_S, END_S = 0.5, 1.25, 2.0

ROW = staged(
    "row", disc_at(0, 0, SPEED, 0, r=LENGTH), disc_at(3, 0, r=LENGTH), disc_at(7, 0, r=LENGTH), duration_s=END_S
)


def replay_impacts(reference: Trace, impacts: Rows) -> Trace:
    """Return the run that has these impacts, in steps of `DT`, each impact at the instant of its time stamp."""
    scene = reference.scene
    place = np.array([disc.position_m for disc in scene.discs])
    velocity = np.array([disc.velocity_m_s for disc in scene.discs])
    since = np.zeros(len(place))
    states = np.zeros(len(impacts), STATE_DTYPE)
    for impact, state in zip(impacts, states, strict=True):
        time = float(impact["time_s"])
        begun = state["time_s"] = math.floor(time / DT) * DT
        for body in ("first", "second"):
            disc = int(impact[body])
            if disc < 0:
                continue
            known = since[disc] <= begun  # else its path has turned in this very step
            there = place[disc] + velocity[disc] * (begun - since[disc])
            state[f"position_{body}"] = there if known else math.nan
            place[disc] += velocity[disc] * (time - since[disc])
            velocity[disc], since[disc] = impact[f"velocity_{body}_after"], time
        if np.isnan(state["position_first"]).any() or np.isnan(state["position_second"]).any():
            state["position_first"] = state["position_second"] = math.nan
    place += velocity * (scene.duration_s - since)[:, None]
    return dataclasses.replace(
        reference,
        method="planted",
        impacts=impacts,
        final_position_m=place,
        final_velocity_m_s=velocity,
        dt_s=DT,
        effective_time_s=impacts["time_s"].copy(),
        state_before=states,
        end_time_s=scene.duration_s,
    )


def replay_reference(reference: Trace) -> Trace:
    """Return the reference as a method with steps would give it: no fault at all."""
    return replay_impacts(reference, reference.impacts.copy())


def rotate(vector: Array, angle: float) -> Array:
    """Return the vectors turned to the left."""
    cosine, sine = math.cos(angle), math.sin(angle)
    result: Array = vector @ np.array([[cosine, sine], [-sine, cosine]])
    return result


@dataclass(frozen=True)
class Expected:
    """Required result of a comparison for a fault of one size, with a PIT without error.

    Attributes:
        size: The size planted.
        grade: The grade.
        says: Every verdict but `CONFORMS`, with the number that its reason must begin with; None where there is none.
    """

    size: float
    grade: Grade
    says: Says


@dataclass(frozen=True)
class Fault:
    """A fault, and a ladder of its sizes.

    Attributes:
        name: Its name.
        plant: Takes the reference and a size, gives the run; its docstring says what the size is.
        table: What must be said in the scene `ROW`, from size 0 upwards.
        impacts: How many impacts a scene must have for it.
    """

    name: str
    plant: Plant
    table: tuple[Expected, ...]
    impacts: int = 1


FAULTS: list[Fault] = []


def register_fault(
    says: Callable[[float], Says], *, impacts: int = 1, **sizes: tuple[float, ...]
) -> Callable[[Plant], Plant]:
    """Enter a fault: what must be said of a size that is not exact, and the sizes of each grade, from the best on."""
    ladder = [(size, Grade[grade.upper()]) for grade, all_ in sizes.items() for size in all_]
    table = tuple(Expected(size, grade, {} if grade is Grade.EXACT else says(size)) for size, grade in ladder)

    def enter(plant: Plant) -> Plant:
        FAULTS.append(Fault(plant.__name__.replace("_", " "), plant, table, impacts))
        return plant

    return enter


_MISSED: Mapping[float, Verdict] = {1: Verdict.MISSED, 2: Verdict.MULTIPLE_MISSED}
#: Radii that a disc at `SPEED` goes from the last impact to the end, and in a step.
FLOWN, STEP = SPEED * (END_S - LAST_S) / LENGTH, SPEED * DT / LENGTH


def _chord(degrees: float) -> float:
    """How far the end of a unit vector moves where it is turned."""
    return 2 * math.sin(math.radians(degrees) / 2)


def _energy(part: float) -> Says:
    gained = (1 + part) ** 2 - 1
    if abs(gained) <= 1e-6:
        return {}
    return {Verdict.ENERGY_GAINED if gained > 0 else Verdict.ENERGY_LOST: abs(gained)}


def _speed_fault(part: float) -> Says:
    return {
        Verdict.WRONG_VELOCITY: abs(part),
        Verdict.MISPLACED: abs(part) * FLOWN,
        Verdict.WRONG_END: abs(part),
        Verdict.MOMENTUM: abs(part) / 2,
        **_energy(part),
    }


def _direction_fault(degrees: float) -> Says:
    chord = _chord(degrees)
    says: dict[Verdict, float | None] = {
        Verdict.WRONG_VELOCITY: chord,
        Verdict.MISPLACED: chord * FLOWN,
        Verdict.WRONG_END: chord,
        Verdict.MOMENTUM: chord / 2,
    }
    if degrees > 1:
        says[Verdict.WRONG_DIRECTION] = degrees
    if degrees < 180:  # disc 1 stops as it should, so what the two change by is turned half as far, and at 180 nothing
        says[Verdict.WRONG_NORMAL] = degrees / 2
    return says


def _last(reference: Trace) -> tuple[Rows, np.void]:
    impacts = reference.impacts.copy()
    return impacts, impacts[-1]


def _faulty_body(reference: Trace) -> str:
    """Which body of the last impact the faults of its velocities are planted in: a disc that moves afterwards."""
    row = reference.impacts[-1]
    return "second" if row["second"] >= 0 and np.any(row["velocity_second_after"]) else "first"


@register_fault(_speed_fault, exact=(0, 1e-13), inaccurate=(1e-9, 0.01, 1))
def faster(reference: Trace, size: float) -> Trace:
    """The last impact leaves its disc faster by so large a part."""
    impacts, row = _last(reference)
    row[f"velocity_{_faulty_body(reference)}_after"] *= 1 + size
    return replay_impacts(reference, impacts)


@register_fault(lambda part: _speed_fault(-part), exact=(0, 1e-13), inaccurate=(1e-9, 0.01, 0.9))
def slower(reference: Trace, size: float) -> Trace:
    """The last impact leaves its disc slower by so large a part."""
    return faster(reference, -size)


@register_fault(_direction_fault, exact=(0, 1e-12), inaccurate=(1e-6, 0.5, 2, 90, 180))
def thrown_aside(reference: Trace, size: float) -> Trace:
    """The last impact turns its disc's velocity by the size, in degrees."""
    impacts, row = _last(reference)
    name = f"velocity_{_faulty_body(reference)}_after"
    row[name] = rotate(row[name], math.radians(size))
    return replay_impacts(reference, impacts)


@register_fault(
    lambda steps: {Verdict.LATE: steps * DT, Verdict.MISPLACED: steps * STEP},
    exact=(0, 1e-11), close=(1e-6, 0.0099), sampled=(0.0101, 0.3, 1), inaccurate=(1.1, 20),
)  # fmt: skip
def delayed(reference: Trace, size: float) -> Trace:
    """The last impact acts late by the size, in steps."""
    impacts, row = _last(reference)
    row["time_s"] += size * DT
    return replay_impacts(reference, impacts)


@register_fault(
    lambda steps: {Verdict.EARLY: steps * DT, Verdict.MISPLACED: steps * STEP},
    exact=(0, 1e-11), close=(1e-6, 0.0099), inaccurate=(0.0101, 0.5, 20),
)  # fmt: skip
def hasty(reference: Trace, size: float) -> Trace:
    """The last impact acts early by the size, in steps."""
    return delayed(reference, -size)


# Impacts at the start of a step: within it any stamp is the step's own.
@register_fault(lambda steps: {Verdict.WRONG_STAMP: (steps - 1) * DT}, exact=(0, 0.9), inaccurate=(1.5, 22))
def stamped_late(reference: Trace, size: float) -> Trace:
    """The last impact is stamped late by the size, in steps, and acts in time."""
    return alter_impact(replay_reference(reference), -1, time_s=reference.impacts["time_s"][-1] + size * DT)


@register_fault(lambda steps: {Verdict.WRONG_STAMP: steps * DT}, exact=(0, 1e-11), inaccurate=(0.5, 22))
def stamped_early(reference: Trace, size: float) -> Trace:
    """The last impact is stamped early by the size, in steps, and acts in time."""
    return stamped_late(reference, -size)


@register_fault(
    lambda lost: {_MISSED[lost]: lost, Verdict.MISPLACED: FLOWN + 6 * (lost - 1), Verdict.WRONG_END: 1},
    exact=(0,), wrong=(1, 2),
)  # fmt: skip
def tunnelling(reference: Trace, size: float) -> Trace:
    """As many last impacts as the size do not happen: the discs pass through each other."""
    return replay_impacts(reference, reference.impacts[: len(reference.impacts) - int(size)].copy())


def _report_rows(reference: Trace, rows: slice | list[int]) -> Trace:
    """Return the right run, of which these impacts are reported."""
    trace = replay_reference(reference)
    columns = {name: getattr(trace, name)[rows] for name in ("impacts", "effective_time_s", "state_before")}
    return dataclasses.replace(trace, **columns)


# The positions are those after a bounce, of which the impacts left say nothing.
@register_fault(
    lambda lost: {_MISSED[lost]: lost, Verdict.DRIFTS: FLOWN + 6 * (lost - 1), Verdict.TURNS: 1},
    exact=(0,), wrong=(1, 2),
)  # fmt: skip
def unreported(reference: Trace, size: float) -> Trace:
    """As many last impacts as the size happen and are not reported."""
    return _report_rows(reference, slice(len(reference.impacts) - int(size)))


@register_fault(lambda more: {Verdict.SPURIOUS: more, Verdict.TURNS: 1}, exact=(0,), wrong=(1, 2))
def doubled(reference: Trace, size: float) -> Trace:
    """The last impact is reported again, as often as the size."""
    return _report_rows(reference, [*range(len(reference.impacts)), *[-1] * int(size)])


# Disc 1 moves off before anything has struck it.
@register_fault(
    lambda _: {Verdict.WRONG_ORDER: 1, Verdict.DRIFTS: None, Verdict.TURNS: 1}, exact=(0,), wrong=(1,), impacts=2
)
def swapped(reference: Trace, size: float) -> Trace:
    """The last two impacts are reported in each other's place; size 0 or 1."""
    trace = replay_reference(reference)
    if not size:
        return trace
    impacts = trace.impacts.copy()
    impacts[[-2, -1]] = impacts[[-1, -2]]
    impacts["time_s"] = trace.impacts["time_s"]
    return dataclasses.replace(trace, impacts=impacts)


@register_fault(
    lambda degrees: {
        **dict.fromkeys((Verdict.MISPLACED, Verdict.DRIFTS), _chord(degrees) * FLOWN / 2),
        **dict.fromkeys((Verdict.WRONG_END, Verdict.TURNS), _chord(degrees)),
    },
    exact=(0, 1e-12), inaccurate=(1e-6, 1, 90, 180),
)  # fmt: skip
def turning_later(reference: Trace, size: float) -> Trace:
    """Half-way from the last impact to the end its disc turns by the size, in degrees, without any impact."""
    trace, row = replay_reference(reference), reference.impacts[-1]
    disc, left = int(row[_faulty_body(reference)]), (trace.end_time_s - row["time_s"]) / 2
    place, velocity = trace.final_position_m.copy(), trace.final_velocity_m_s.copy()
    velocity[disc] = rotate(velocity[disc], math.radians(size))
    place[disc] += (velocity[disc] - trace.final_velocity_m_s[disc]) * left
    return dataclasses.replace(trace, final_position_m=place, final_velocity_m_s=velocity)


@register_fault(
    lambda radii: {Verdict.MISPLACED: radii, Verdict.DRIFTS: radii},
    exact=(0, 1e-13), close=(1e-6,), inaccurate=(1, 2000),
)  # fmt: skip
def carried_off(reference: Trace, size: float) -> Trace:
    """Every disc ends aside by the size, in radii."""
    trace = replay_reference(reference)
    length = max(disc.radius_m for disc in reference.scene.discs)
    return dataclasses.replace(trace, final_position_m=trace.final_position_m + np.array([0.0, size * length]))


@register_fault(lambda degrees: {Verdict.WRONG_NORMAL: degrees}, exact=(0, 1e-12), inaccurate=(1, 90, 180))
def normal_turned(reference: Trace, size: float) -> Trace:
    """The normal of the last impact is reported turned by the size, in degrees."""
    return alter_impact(
        replay_reference(reference), -1, normal=rotate(reference.impacts["normal"][-1], math.radians(size))
    )


@register_fault(lambda much: {Verdict.WRONG_NORMAL: much}, exact=(0, 1e-13), inaccurate=(1e-6, 4))
def normal_stretched(reference: Trace, size: float) -> Trace:
    """The normal of the last impact is reported longer by so much."""
    return alter_impact(replay_reference(reference), -1, normal=reference.impacts["normal"][-1] * (1 + size))


@register_fault(
    lambda part: {Verdict.TURNS: part, Verdict.MOMENTUM: part / 2}, exact=(0, 1e-13), inaccurate=(1e-6, 0.5)
)
def before_misstated(reference: Trace, size: float) -> Trace:
    """The velocity of a disc before the last impact is reported faster along the normal, by so much of the speed."""
    row, speed = reference.impacts[-1], max(math.hypot(*disc.velocity_m_s) for disc in reference.scene.discs)
    before = row["velocity_first_before"] + size * speed * row["normal"]
    return alter_impact(replay_reference(reference), -1, velocity_first_before=before)


def drop_impact(trace: Trace, k: int) -> Trace:
    """Return a trace that does not report one of its impacts, and is otherwise the same."""
    return dataclasses.replace(trace, impacts=np.delete(trace.impacts, k))


def find_reason(score: Score, verdict: Verdict) -> str:
    """Return the reason of a verdict that is reported exactly once."""
    (found,) = (finding.reason for finding in score.findings if finding.verdict is verdict)
    return found
