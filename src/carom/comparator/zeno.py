"""Limits of comparison for infinitely many bounces, to rest or to a crush, at a method's step."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align import Alignment, ComparisonRange, align, group_by_pair
from carom.comparator.stepwise.law import Law
from carom.comparator.stepwise.rest import RESTING_STEPS
from carom.model.trace import Outcome, Trace, free_flights, wall_index


class _Bounces(NamedTuple):
    """The last bounces of a disc, all on one body: their rows in the reference's impacts."""

    pair: tuple[int, int]
    rows: list[int]


def clip_before_rest(
    reference: Trace, compared: ComparisonRange, dt_s: float, sampling: Trace | None = None
) -> ComparisonRange:
    """Return the part of a range before a disc starts to rest, slide or roll, as far as steps of a size can show it.

    The last impacts before that, often infinitely many, close at no more than a disc falls in a step or two: a method
    that checks once per step rests already. PIT, where given, loses these bounces some hops earlier, and no step shows
    more than PIT's.
    """
    impacts, times = reference.impacts, reference.impacts["time_s"]
    if reference.scene.gravity_m_s2 == (0.0, 0.0) and reference.contact_s == math.inf:
        return compared
    closing = np.sum((impacts["velocity_first_before"] - impacts["velocity_second_before"]) * impacts["normal"], axis=1)
    weak = closing <= RESTING_STEPS * math.hypot(*reference.scene.gravity_m_s2) * dt_s
    bouncing = _find_last_bounces(reference)
    if reference.contact_s == math.inf or reference.outcome is Outcome.GLIDES:  # which is not rest
        final_rows = {row for bounces in bouncing for row in bounces.rows}
        weak &= np.array([row in final_rows for row in range(len(impacts))], dtype=np.bool_)
    if reference.outcome is Outcome.CRUSHED:
        return _clip(compared, times, _find_crush_limit(reference, dt_s, sampling))
    ends_s = [reference.contact_s]
    ends_s += np.nextafter(times[weak][:1], -math.inf).tolist()
    if sampling is not None and bouncing:
        alignment = align(reference, sampling)
        ends_s += [_pit_follows_until(reference, bounces, sampling, alignment) for bounces in bouncing]
    return _clip(compared, times, min(ends_s))


def _clip(compared: ComparisonRange, times: NDArray[np.float64], until_s: float) -> ComparisonRange:
    count = int(np.searchsorted(times, until_s, side="right"))
    return compared if compared.until_s <= until_s else ComparisonRange(min(count, compared.impacts), until_s)


def _find_crush_limit(reference: Trace, dt_s: float, sampling: Trace | None) -> float:
    """Return when steps can no longer separate the impacts of a disc on two walls that crush it.

    They come ever faster, so that from some instant on each follows the one before it within two steps: a look finds
    one of them at most, late. PIT, where it is given, loses or gains one earlier.
    """
    impacts, times = reference.impacts, reference.impacts["time_s"]
    disc = int(impacts["first"][-1])
    rows = np.flatnonzero((impacts["first"] == disc) | (impacts["second"] == disc))
    apart = np.flatnonzero(np.diff(times[rows]) > 2.0 * dt_s)
    begin = int(apart[-1]) + 1 if len(apart) else 0
    until_s = float(np.nextafter(times[rows[begin]], -math.inf))
    if sampling is None:
        return until_s
    alignment, found = align(reference, sampling), sampling.impacts
    lost_s = [float(times[row]) for row in alignment.missed if disc in (impacts["first"][row], impacts["second"][row])]
    lost_s += [
        float(found["time_s"][row]) for row in alignment.spurious if disc in (found["first"][row], found["second"][row])
    ]
    return min(until_s, min(lost_s, default=math.inf) - dt_s)


def _find_last_bounces(reference: Trace) -> list[_Bounces]:
    """Return the final bounces of discs that gravity brings back to the same fixed body, lower each time."""
    scene, impacts = reference.scene, reference.impacts
    found = []
    of_disc: dict[int, list[int]] = defaultdict(list)
    for row, (first, second) in enumerate(zip(impacts["first"].tolist(), impacts["second"].tolist(), strict=True)):
        for body in (first, second):
            if body >= 0 and not scene.discs[body].immovable:
                of_disc[body].append(row)
    for disc, rows in of_disc.items():
        pair = (int(impacts["first"][rows[-1]]), int(impacts["second"][rows[-1]]))
        other = pair[1] if pair[0] == disc else pair[0]
        fixed = other < 0 or scene.discs[other].immovable
        loses = float(scene.arrays.restitution_of(np.array([other]))[0]) < 1.0
        along = float(impacts["normal"][rows[-1]] @ np.array(scene.gravity_m_s2))
        if fixed and loses and (along if pair[0] == disc else -along) > 0.0:
            same = (impacts["first"][rows] == pair[0]) & (impacts["second"][rows] == pair[1])
            others = np.flatnonzero(~same)
            found.append(_Bounces(pair, rows[others[-1] + 1 if len(others) else 0 :]))
    return found


def _pit_follows_until(reference: Trace, bounces: _Bounces, sampling: Trace, alignment: Alignment) -> float:
    """Return the last frame at which PIT still has the bounces of a disc; infinite where it has them all.

    PIT finds each bounce late, so the following hops are slightly shorter or longer. Because hops get ever shorter, PIT
    is at some time ahead by a whole hop, which is a spurious impact, or finds the disc so deep that it falls back
    before it is out.
    """
    expected_s, found_s = reference.impacts["time_s"], sampling.impacts["time_s"]
    expected = group_by_pair(reference.impacts)[bounces.pair]
    found = group_by_pair(sampling.impacts).get(bounces.pair, [])
    stuck = _falls_back(sampling, found)
    begin_s, reference_of = float(expected_s[bounces.rows[0]]), {o: r for r, o in alignment.matched}
    for nth, k in enumerate(found):
        if found_s[k] <= begin_s:
            continue
        if k in alignment.spurious:
            return float(found_s[k]) - sampling.dt_s
        if stuck[nth] and nth + 1 < len(expected):
            # The impact itself counts where PIT has not lost or gained another before it.
            is_matched = reference_of.get(k) == expected[nth] and expected_s[expected[nth]] <= found_s[k]
            is_before_next = found_s[k] < expected_s[expected[nth + 1]]
            return float(found_s[k]) - (0.0 if is_matched and is_before_next else sampling.dt_s)
    return math.inf


def _falls_back(trace: Trace, impacts: list[int]) -> NDArray[np.bool_]:
    """Return after which of some impacts of one pair gravity closes the pair before it has separated.

    They overlap by `depth` when the impact is found, and part at `parting`: they come out of each other only if
    ``parting^2 > 2 pull depth``.
    """
    scene, law = trace.scene, Law(trace.scene)
    wanted, radius = {k: nth for nth, k in enumerate(impacts)}, scene.arrays.radius_m
    back, place = np.zeros(len(impacts), dtype=np.bool_), np.array([disc.position_m for disc in scene.discs])
    pulled = np.array([(0.0, 0.0) if disc.immovable else scene.gravity_m_s2 for disc in scene.discs])
    for flight in free_flights(trace):
        if flight.impact == len(trace.impacts):
            break
        place[flight.disc] = flight.at(flight.end_s)
        if (nth := wanted.get(flight.impact)) is None:
            continue
        impact = trace.impacts[flight.impact]
        first, second, normal = int(impact["first"]), int(impact["second"]), impact["normal"]
        if second >= 0:
            pull = (pulled[first] - pulled[second]) @ normal
            depth = radius[first] + radius[second] - math.hypot(*(place[second] - place[first]))
        else:
            pull = pulled[first] @ normal
            x, y = place[first].tolist()
            depth = radius[first] - law.side_of(wall_index(second), x, y, flight.end_s)[0]
        parting = (impact["velocity_second_after"] - impact["velocity_first_after"]) @ normal
        back[nth] = parting**2 <= 2.0 * pull * max(depth, 0.0)
    return back
