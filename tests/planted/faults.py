"""Faults to plant in a right run, and what a comparison must say of each at which size: the scorer's own table.

The runs are of three equal discs in a row. Disc 0 comes at 4 m/s, strikes disc 1 at 0.5 s and stops; disc 1 strikes
disc 2 at 1.25 s and stops; disc 2 goes on to the end at 2 s. So each number in the table follows by hand. `replayed`
makes a run of impacts: where every disc is at the start of each step, and at the end, follows from them. A fault of the
impacts is planted before that, so that the run agrees with itself; one of what is reported, or of the states, after it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.stage import disc_at, staged

from carom import Trace
from carom.comparator import Grade, Verdict
from carom.trace import STATE_DTYPE

Array = NDArray[np.float64]
Rows = NDArray[np.void]

DT = 1 / 60
SPEED, LENGTH = 4.0, 0.5
FIRST_S, LAST_S, END_S = 0.5, 1.25, 2.0

ROW = staged(
    "row", disc_at(0, 0, SPEED, 0, r=LENGTH), disc_at(3, 0, r=LENGTH), disc_at(7, 0, r=LENGTH), duration_s=END_S
)

#: How a run moves a disc's centre away from where its impacts put it: takes place and time, gives the place shown.
Shift = Callable[[Array, float], Array]


def replayed(reference: Trace, impacts: Rows, shift: Shift = lambda place, _: place) -> Trace:
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
            there = shift(place[disc] + velocity[disc] * (begun - since[disc]), begun)
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
        final_position_m=np.array([shift(p, scene.duration_s) for p in place]),
        final_velocity_m_s=velocity,
        dt_s=DT,
        effective_time_s=impacts["time_s"].copy(),
        state_before=states,
        end_time_s=scene.duration_s,
    )


def faithful(reference: Trace) -> Trace:
    """Return the reference as a method with steps would give it: no fault at all."""
    return replayed(reference, reference.impacts.copy())


def turned(vector: Array, angle: float) -> Array:
    """Return the vectors turned to the left."""
    cosine, sine = math.cos(angle), math.sin(angle)
    result: Array = vector @ np.array([[cosine, sine], [-sine, cosine]])
    return result


def _last(reference: Trace) -> tuple[Rows, np.void]:
    impacts = reference.impacts.copy()
    return impacts, impacts[-1]


def _struck(reference: Trace) -> str:
    """Which body of the last impact the faults of its velocities are planted in: a disc that moves afterwards."""
    row = reference.impacts[-1]
    return "second" if row["second"] >= 0 and np.any(row["velocity_second_after"]) else "first"


def faster(reference: Trace, size: float) -> Trace:
    """The last impact leaves its disc faster by so large a part."""
    impacts, row = _last(reference)
    row[f"velocity_{_struck(reference)}_after"] *= 1 + size
    return replayed(reference, impacts)


def slower(reference: Trace, size: float) -> Trace:
    """The last impact leaves its disc slower by so large a part."""
    return faster(reference, -size)


def thrown_aside(reference: Trace, size: float) -> Trace:
    """The last impact sends its disc off turned by so many degrees."""
    impacts, row = _last(reference)
    name = f"velocity_{_struck(reference)}_after"
    row[name] = turned(row[name], math.radians(size))
    return replayed(reference, impacts)


def delayed(reference: Trace, size: float) -> Trace:
    """The last impact acts so many steps late."""
    impacts, row = _last(reference)
    row["time_s"] += size * DT
    return replayed(reference, impacts)


def hasty(reference: Trace, size: float) -> Trace:
    """The last impact acts so many steps early."""
    return delayed(reference, -size)


def stamped_late(reference: Trace, size: float) -> Trace:
    """The last impact is stamped so many steps late, and acts in time."""
    trace = faithful(reference)
    impacts = trace.impacts.copy()
    impacts["time_s"][-1] += size * DT
    return dataclasses.replace(trace, impacts=impacts)


def stamped_early(reference: Trace, size: float) -> Trace:
    """The last impact is stamped so many steps early, and acts in time."""
    return stamped_late(reference, -size)


def tunnelling(reference: Trace, size: float) -> Trace:
    """The last so many impacts do not happen: the discs pass through each other."""
    return replayed(reference, reference.impacts[: len(reference.impacts) - int(size)].copy())


def unreported(reference: Trace, size: float) -> Trace:
    """The last so many impacts happen and are not reported."""
    trace, kept = faithful(reference), len(reference.impacts) - int(size)
    assert trace.effective_time_s is not None
    assert trace.state_before is not None
    return dataclasses.replace(
        trace,
        impacts=trace.impacts[:kept],
        effective_time_s=trace.effective_time_s[:kept],
        state_before=trace.state_before[:kept],
    )


def doubled(reference: Trace, size: float) -> Trace:
    """The last impact is reported so many times more."""
    trace, again = faithful(reference), [*range(len(reference.impacts)), *[-1] * int(size)]
    assert trace.effective_time_s is not None
    assert trace.state_before is not None
    return dataclasses.replace(
        trace,
        impacts=trace.impacts[again],
        effective_time_s=trace.effective_time_s[again],
        state_before=trace.state_before[again],
    )


def swapped(reference: Trace, size: float) -> Trace:
    """The last two impacts are reported in each other's place; size 0 or 1."""
    trace = faithful(reference)
    if not size:
        return trace
    impacts = trace.impacts.copy()
    impacts[[-2, -1]] = impacts[[-1, -2]]
    impacts["time_s"] = trace.impacts["time_s"]
    return dataclasses.replace(trace, impacts=impacts)


def exchanged(reference: Trace, size: float) -> Trace:
    """The first and the last disc show each other's final state; size 0 or 1."""
    trace = faithful(reference)
    if not size:
        return trace
    order = [*range(len(reference.scene.discs))]
    order[0], order[-1] = order[-1], order[0]
    return dataclasses.replace(
        trace, final_position_m=trace.final_position_m[order], final_velocity_m_s=trace.final_velocity_m_s[order]
    )


def drifting(reference: Trace, size: float) -> Trace:
    """Every disc moves aside by so many radii a second that are not in its velocity."""
    length = max(disc.radius_m for disc in reference.scene.discs)
    return replayed(
        reference, reference.impacts.copy(), lambda place, time: place + np.array([0.0, size * length * time])
    )


def dragging(reference: Trace, size: float) -> Trace:
    """After the last impact its disc moves by so large a part less than its velocity says."""
    trace, row = faithful(reference), reference.impacts[-1]
    disc, place = int(row[_struck(reference)]), trace.final_position_m.copy()
    place[disc] -= size * trace.final_velocity_m_s[disc] * (trace.end_time_s - row["time_s"])
    return dataclasses.replace(trace, final_position_m=place)


def turning_later(reference: Trace, size: float) -> Trace:
    """Half-way from the last impact to the end its disc turns by so many degrees, without any impact."""
    trace, row = faithful(reference), reference.impacts[-1]
    disc, left = int(row[_struck(reference)]), (trace.end_time_s - row["time_s"]) / 2
    place, velocity = trace.final_position_m.copy(), trace.final_velocity_m_s.copy()
    velocity[disc] = turned(velocity[disc], math.radians(size))
    place[disc] += (velocity[disc] - trace.final_velocity_m_s[disc]) * left
    return dataclasses.replace(trace, final_position_m=place, final_velocity_m_s=velocity)


def damped(reference: Trace, size: float) -> Trace:
    """From the last impact on its disc loses speed evenly, so large a part of it to the end."""
    trace, row = faithful(reference), reference.impacts[-1]
    disc, left = int(row[_struck(reference)]), trace.end_time_s - row["time_s"]
    place, velocity = trace.final_position_m.copy(), trace.final_velocity_m_s.copy()
    place[disc] -= size * velocity[disc] * left / 2
    velocity[disc] *= 1 - size
    return dataclasses.replace(trace, final_position_m=place, final_velocity_m_s=velocity)


def carried_off(reference: Trace, size: float) -> Trace:
    """Every disc ends so many radii aside."""
    trace = faithful(reference)
    length = max(disc.radius_m for disc in reference.scene.discs)
    return dataclasses.replace(trace, final_position_m=trace.final_position_m + np.array([0.0, size * length]))


def normal_turned(reference: Trace, size: float) -> Trace:
    """The normal of the last impact is reported turned by so many degrees."""
    trace = faithful(reference)
    impacts = trace.impacts.copy()
    impacts["normal"][-1] = turned(impacts["normal"][-1], math.radians(size))
    return dataclasses.replace(trace, impacts=impacts)


def normal_stretched(reference: Trace, size: float) -> Trace:
    """The normal of the last impact is reported longer by so much."""
    trace = faithful(reference)
    impacts = trace.impacts.copy()
    impacts["normal"][-1] *= 1 + size
    return dataclasses.replace(trace, impacts=impacts)


def before_misstated(reference: Trace, size: float) -> Trace:
    """The velocity of a disc before the last impact is reported faster along the normal, by so much of the speed."""
    trace = faithful(reference)
    impacts = trace.impacts.copy()
    speed = max(math.hypot(*disc.velocity_m_s) for disc in reference.scene.discs)
    impacts["velocity_first_before"][-1] += size * speed * impacts["normal"][-1]
    return dataclasses.replace(trace, impacts=impacts)


@dataclass(frozen=True)
class Expected:
    """What a comparison must say of a fault of one size, with a PIT beside it that has no error.

    Attributes:
        size: The size planted.
        grade: The grade.
        says: Every verdict but `CONFORMS`, with the number that its reason must begin with; None where there is none.
    """

    size: float
    grade: Grade
    says: Mapping[Verdict, float | None]


@dataclass(frozen=True)
class Fault:
    """A fault, and a ladder of its sizes.

    Attributes:
        name: Its name.
        plant: Takes the reference and a size, gives the run; its docstring says what the size is.
        table: What must be said in the scene `ROW`, from size 0 upwards.
        impacts: How many impacts a scene must have for it.
        discs: How many discs.
    """

    name: str
    plant: Callable[[Trace, float], Trace]
    table: tuple[Expected, ...]
    impacts: int = 1
    discs: int = 1


_NOTHING: Mapping[Verdict, float | None] = {}


def _ladder(
    sizes: Mapping[float, Grade], says: Callable[[float], Mapping[Verdict, float | None]]
) -> tuple[Expected, ...]:
    """Return the rows of one fault. What is exact says nothing."""
    return tuple(
        Expected(size, grade, _NOTHING if grade is Grade.EXACT else says(size)) for size, grade in sizes.items()
    )


def _chord(degrees: float) -> float:
    """How far the end of a unit vector moves where it is turned."""
    return 2 * math.sin(math.radians(degrees) / 2)


EXACT, CLOSE, SAMPLED, INACCURATE, WRONG = Grade.EXACT, Grade.CLOSE, Grade.SAMPLED, Grade.INACCURATE, Grade.WRONG

#: Radii that a disc at `SPEED` goes from the last impact to the end, and in a step.
FLOWN, STEP = SPEED * (END_S - LAST_S) / LENGTH, SPEED * DT / LENGTH


def _energy(part: float) -> Mapping[Verdict, float | None]:
    gained = (1 + part) ** 2 - 1
    if abs(gained) <= 1e-6:
        return {}
    return {Verdict.ENERGY_GAINED if gained > 0 else Verdict.ENERGY_LOST: abs(gained)}


def _speed_fault(part: float) -> Mapping[Verdict, float | None]:
    return {
        Verdict.WRONG_VELOCITY: abs(part),
        Verdict.MISPLACED: abs(part) * FLOWN,
        Verdict.WRONG_END: abs(part),
        Verdict.MOMENTUM: abs(part) / 2,
        **_energy(part),
    }


def _thrown_aside(degrees: float) -> Mapping[Verdict, float | None]:
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


FAULTS: tuple[Fault, ...] = (
    Fault(
        "faster",
        faster,
        _ladder({0: EXACT, 1e-13: EXACT, 1e-9: INACCURATE, 0.01: INACCURATE, 1: INACCURATE}, _speed_fault),
    ),
    Fault(
        "slower",
        slower,
        _ladder(
            {0: EXACT, 1e-13: EXACT, 1e-9: INACCURATE, 0.01: INACCURATE, 0.9: INACCURATE}, lambda s: _speed_fault(-s)
        ),
    ),
    Fault(
        "thrown aside",
        thrown_aside,
        _ladder(
            {0: EXACT, 1e-12: EXACT, 1e-6: INACCURATE, 0.5: INACCURATE, 2: INACCURATE, 90: INACCURATE, 180: INACCURATE},
            _thrown_aside,
        ),
    ),
    Fault(
        "delayed",
        delayed,
        _ladder(
            {
                0: EXACT,
                1e-11: EXACT,
                1e-6: CLOSE,
                0.0099: CLOSE,
                0.0101: SAMPLED,
                0.3: SAMPLED,
                1: SAMPLED,
                1.1: INACCURATE,
                20: INACCURATE,
            },
            lambda steps: {Verdict.LATE: steps * DT, Verdict.MISPLACED: steps * STEP},
        ),
    ),
    Fault(
        "hasty",
        hasty,
        _ladder(
            {0: EXACT, 1e-11: EXACT, 1e-6: CLOSE, 0.0099: CLOSE, 0.0101: INACCURATE, 0.5: INACCURATE, 20: INACCURATE},
            lambda steps: {Verdict.EARLY: steps * DT, Verdict.MISPLACED: steps * STEP},
        ),
    ),
    Fault(
        "stamped late",
        stamped_late,
        # Impacts at the start of a step: within it any stamp is the step's own.
        _ladder(
            {0: EXACT, 0.9: EXACT, 1.5: INACCURATE, 22: INACCURATE},
            lambda steps: {Verdict.WRONG_STAMP: (steps - 1) * DT},
        ),
    ),
    Fault(
        "stamped early",
        stamped_early,
        _ladder(
            {0: EXACT, 1e-11: EXACT, 0.5: INACCURATE, 22: INACCURATE}, lambda steps: {Verdict.WRONG_STAMP: steps * DT}
        ),
    ),
    Fault(
        "tunnelling",
        tunnelling,
        (
            Expected(0, EXACT, _NOTHING),
            Expected(1, WRONG, {Verdict.MISSED: 1, Verdict.MISPLACED: FLOWN, Verdict.WRONG_END: 1}),
            Expected(2, WRONG, {Verdict.MULTIPLE_MISSED: 2, Verdict.MISPLACED: FLOWN + 6, Verdict.WRONG_END: 1}),
        ),
    ),
    Fault(
        "unreported",
        unreported,
        (
            Expected(0, EXACT, _NOTHING),
            # The positions are those after a bounce, of which the impacts left say nothing.
            Expected(1, WRONG, {Verdict.MISSED: 1, Verdict.DRIFTS: FLOWN, Verdict.TURNS: 1}),
            Expected(2, WRONG, {Verdict.MULTIPLE_MISSED: 2, Verdict.DRIFTS: FLOWN + 6, Verdict.TURNS: 1}),
        ),
    ),
    Fault(
        "doubled",
        doubled,
        (
            Expected(0, EXACT, _NOTHING),
            Expected(1, WRONG, {Verdict.SPURIOUS: 1, Verdict.TURNS: 1}),
            Expected(2, WRONG, {Verdict.SPURIOUS: 2, Verdict.TURNS: 1}),
        ),
    ),
    Fault(
        "swapped",
        swapped,
        (
            Expected(0, EXACT, _NOTHING),
            # Disc 1 moves off before anything has struck it.
            Expected(1, WRONG, {Verdict.WRONG_ORDER: 1, Verdict.DRIFTS: None, Verdict.TURNS: 1}),
        ),
        impacts=2,
    ),
    Fault(
        "exchanged",
        exchanged,
        (
            Expected(0, EXACT, _NOTHING),
            # Disc 0 ends at 2 m, disc 2 at 10 m.
            Expected(
                1, INACCURATE, {Verdict.MISPLACED: 16, Verdict.WRONG_END: 1, Verdict.DRIFTS: 16, Verdict.TURNS: 1}
            ),
        ),
        discs=2,
    ),
    Fault(
        "drifting",
        drifting,
        # Disc 0 drifts longest without an impact: from the first one on. PIT, a step late, ends up to `STEP` off.
        _ladder(
            {0: EXACT, 1e-13: EXACT, 1e-6: CLOSE, 0.01: INACCURATE, 10: INACCURATE},
            lambda radii: {Verdict.MISPLACED: radii * END_S, Verdict.DRIFTS: radii * (END_S - FIRST_S)},
        ),
    ),
    Fault(
        "dragging",
        dragging,
        _ladder(
            {0: EXACT, 1e-13: EXACT, 1e-6: CLOSE, 0.01: INACCURATE, 1: INACCURATE},
            lambda part: {Verdict.MISPLACED: part * FLOWN, Verdict.DRIFTS: part * FLOWN},
        ),
    ),
    Fault(
        "turning later",
        turning_later,
        _ladder(
            {0: EXACT, 1e-12: EXACT, 1e-6: INACCURATE, 1: INACCURATE, 90: INACCURATE, 180: INACCURATE},
            lambda degrees: {
                Verdict.MISPLACED: _chord(degrees) * FLOWN / 2,
                Verdict.WRONG_END: _chord(degrees),
                Verdict.DRIFTS: _chord(degrees) * FLOWN / 2,
                Verdict.TURNS: _chord(degrees),
            },
        ),
    ),
    Fault(
        "damped",
        damped,
        _ladder(
            {0: EXACT, 1e-13: EXACT, 1e-9: INACCURATE, 0.01: INACCURATE, 0.9: INACCURATE},
            lambda part: {
                Verdict.MISPLACED: part * FLOWN / 2,
                Verdict.WRONG_END: part,
                Verdict.DRIFTS: part * FLOWN / 2,
                Verdict.TURNS: part,
                **_energy(-part),
            },
        ),
    ),
    Fault(
        "carried off",
        carried_off,
        _ladder(
            {0: EXACT, 1e-13: EXACT, 1e-6: CLOSE, 1: INACCURATE, 2000: INACCURATE},
            lambda radii: {Verdict.MISPLACED: radii, Verdict.DRIFTS: radii},
        ),
    ),
    Fault(
        "normal turned",
        normal_turned,
        _ladder(
            {0: EXACT, 1e-12: EXACT, 1: INACCURATE, 90: INACCURATE, 180: INACCURATE},
            lambda degrees: {Verdict.WRONG_NORMAL: degrees},
        ),
    ),
    Fault(
        "normal stretched",
        normal_stretched,
        _ladder({0: EXACT, 1e-13: EXACT, 1e-6: INACCURATE, 4: INACCURATE}, lambda much: {Verdict.WRONG_NORMAL: much}),
    ),
    Fault(
        "before misstated",
        before_misstated,
        _ladder(
            {0: EXACT, 1e-13: EXACT, 1e-6: INACCURATE, 0.5: INACCURATE},
            lambda part: {Verdict.TURNS: part, Verdict.MOMENTUM: part / 2},
        ),
    ),
)
