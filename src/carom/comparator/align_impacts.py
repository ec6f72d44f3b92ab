"""Second stage of a comparison: match the impacts of a run with those of the reference, and compare their order."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.comparator.comparison_range import ComparedRun
from carom.comparator.match_impacts import LATEST_STAMP_STEPS, Alignment, Pair, match_impacts
from carom.model.step_windows import LocalTruth
from carom.model.trace import Trace

#: Largest edit distance that is computed. Two sequences of impacts with a larger distance are unrelated.
MOST_EDITS = 64


@dataclass(frozen=True, eq=False)
class AlignedRun(ComparedRun):
    """Matches between the impacts of the run, the reference and PIT, within the compared part of the run.

    Attributes:
        alignment: Matches of the run's impacts with the impacts of the reference.
        pit_alignment: Matches of PIT's impacts with the impacts of the reference; None without PIT.
        against_pit: Matches of the run's impacts with PIT's impacts; None without PIT.
        edits: Edit distance between the sequences of impacts in the reference and in the run; see
            `compute_edit_distance`.
        inverted: Pairs of impacts that the run has in the wrong order. Each impact is given by its index in the
            reference. Each pair begins with the impact that is earlier in the reference.
        diverged_s: Time in seconds of the run's first missed, spurious or out-of-order impact; None if there is none.
        pit_diverged_s: Time in seconds of the first impact that PIT misses or invents with the same step size. None
            without a PIT run, or if PIT misses and invents no impact.
    """

    alignment: Alignment
    pit_alignment: Alignment | None
    against_pit: Alignment | None
    edits: int
    inverted: tuple[tuple[int, int], ...]
    diverged_s: float | None
    pit_diverged_s: float | None


def align_impacts(compared: ComparedRun) -> AlignedRun:
    """Match the impacts of the run, the reference and PIT, up to the end of the compared part of the run."""
    reference, observed, pit = compared.reference, compared.observed, compared.pit
    alignment = match_impacts(reference, observed, compared.compared)
    visible_in_states = _find_shown_by_states(reference, alignment.missed, compared.truth, observed.dt_s)
    missed = tuple(k for k in alignment.missed if k not in visible_in_states)
    spurious = _drop_contact_starts(reference, observed, alignment.spurious)
    alignment = alignment._replace(missed=missed, spurious=spurious)
    edits, inverted = compare_order(reference, observed, alignment)
    pit_alignment = against_pit = pit_diverged_s = None
    if pit is not None:
        key = (match_impacts, compared.compared)
        pit_alignment = compared.baseline.compute_once(key, lambda: match_impacts(reference, pit, compared.compared))
        against_pit = match_impacts(pit, observed, compared.pit_range)
        pit_diverged_s = _find_divergence(reference, pit, pit_alignment, ())
    return AlignedRun.of(
        compared,
        alignment=alignment,
        pit_alignment=pit_alignment,
        against_pit=against_pit,
        edits=edits,
        inverted=inverted,
        diverged_s=_find_divergence(reference, observed, alignment, inverted),
        pit_diverged_s=pit_diverged_s,
    )


def _find_divergence(
    reference: Trace, observed: Trace, alignment: Alignment, inverted: Iterable[tuple[int, int]]
) -> float | None:
    """Return the time in seconds of the first missed, spurious or out-of-order impact; None if there is none."""
    missed = [*alignment.missed, *(first for first, _ in inverted)]
    times = [reference.impacts["time_s"][missed], observed.impacts["time_s"][list(alignment.spurious)]]
    return min(np.concatenate(times).tolist(), default=None)


def _find_shown_by_states(
    reference: Trace, missed: Sequence[int], truth: LocalTruth | None, dt_s: float
) -> frozenset[int]:
    """Return those missed impacts that the run's states show, although the engine did not report these impacts.

    Only groups of successive steps with several impacts are searched, because an engine may report only some of these
    impacts.
    """
    if truth is None or not missed:
        return frozenset()
    meetings = truth.meetings
    windows = truth.windows[meetings["window"]]
    is_candidate = windows["entangled"] & ~meetings["missed"] & ~np.isnan(meetings["due_s"])
    begin_s, end_s = windows["begin_s"][is_candidate] - dt_s, windows["end_s"][is_candidate] + dt_s
    bodies = _sort_bodies(meetings[is_candidate])
    impacts = reference.impacts[list(missed)]
    return frozenset(
        number
        for number, time_s, pair in zip(missed, impacts["time_s"], _sort_bodies(impacts), strict=True)
        if np.any((bodies == pair).all(axis=1) & (begin_s <= time_s) & (time_s <= end_s))
    )


def _sort_bodies(rows: NDArray[np.void]) -> NDArray[np.int64]:
    return np.sort(np.stack([rows["first"], rows["second"]], axis=1))


def _drop_contact_starts(reference: Trace, observed: Trace, invented: Sequence[int]) -> tuple[int, ...]:
    """Remove a disc's spurious impacts on a wall on which the disc already rests, slides or rolls in the reference.

    An engine may report the beginning of resting, sliding or rolling as an impact, with the start of a step as the
    time. So impacts up to one step before the lasting contact are also removed.
    """
    if reference.modes is None:
        return tuple(invented)
    begin_s = {(int(row["disc"]), int(row["wall"])): float(row["time_s"]) for row in reference.modes[::-1]}
    return tuple(
        k
        for k, row in zip(invented, observed.impacts[list(invented)], strict=True)
        if not row["time_s"] >= begin_s.get((int(row["first"]), int(row["second"])), math.inf) - observed.dt_s
    )


def compare_order(reference: Trace, observed: Trace, alignment: Alignment) -> tuple[int, tuple[tuple[int, int], ...]]:
    """Return the edit distance of the two sequences of impacts, and the pairs of impacts in the wrong order.

    A method that checks for overlap once per step can't order the impacts of one step, and reports impacts up to two
    steps late. So two impacts with the same reported time never count as out of order. Two impacts that share no
    movable disc never count as out of order if they are at most two steps apart.
    """
    to_reference = {o: r for r, o in alignment.matched}
    sequence = sorted([*to_reference, *alignment.spurious])
    expected = sorted([*to_reference.values(), *alignment.missed])
    inverted = _sort_by_reference(sequence, to_reference, reference, observed)
    edits = compute_edit_distance(_list_pairs(reference, expected), _list_pairs(observed, sequence))
    return edits, tuple(sorted(inverted))


def _sort_by_reference(
    sequence: list[int], to_reference: dict[int, int], reference: Trace, observed: Trace
) -> set[tuple[int, int]]:
    """Sort the run's impacts into the reference's order by swapping impacts that do not count as out of order.

    Pairs of impacts that count as out of order (see `compare_order`) are not swapped, but returned.

    An insertion sort is used, because it needs only one comparison for an impact that is already in order.
    """
    slack = LATEST_STAMP_STEPS * observed.dt_s
    stamp, time = observed.impacts["time_s"], reference.impacts["time_s"]
    inverted = set()
    for end in range(1, len(sequence)):
        k = end
        while k > 0:
            earlier, later = sequence[k - 1], sequence[k]
            if earlier not in to_reference or later not in to_reference:
                break
            a, b = to_reference[later], to_reference[earlier]  # if a < b, the reference has the opposite order
            if a > b:
                break
            common = set(reference.impacts[["first", "second"]][a]) & set(reference.impacts[["first", "second"]][b])
            has_common_body = any(body >= 0 and not reference.scene.discs[body].immovable for body in common)
            are_independent = not has_common_body and time[b] - time[a] <= slack
            if not (are_independent or stamp[earlier] == stamp[later]):
                inverted.add((a, b))
                break
            sequence[k - 1], sequence[k] = later, earlier
            k -= 1
    return inverted


def _list_pairs(trace: Trace, indices: Sequence[int]) -> list[Pair]:
    first, second = trace.impacts["first"].tolist(), trace.impacts["second"].tolist()
    return [(first[k], second[k]) for k in indices]


def compute_edit_distance(a: Sequence[Pair], b: Sequence[Pair]) -> int:
    """Return the smallest number of insertions, deletions and swaps of neighbours that turn `a` into `b`.

    The number is the restricted Damerau-Levenshtein distance without replacements (G. Navarro, A guided tour to
    approximate string matching, ACM Computing Surveys 33(1), 2001). Only a band around the diagonal of the distance
    table is computed. The band is widened until it is at least as wide as the distance (E. Ukkonen, 1985). The result
    is at most `MOST_EDITS`.
    """
    start = 0
    while start < min(len(a), len(b)) and a[start] == b[start]:
        start += 1
    end = 0
    while end < min(len(a), len(b)) - start and a[-1 - end] == b[-1 - end]:
        end += 1
    a, b = a[start : len(a) - end], b[start : len(b) - end]
    band = 4
    while True:
        found = _compute_edit_distance_within(a, b, band) if abs(len(a) - len(b)) <= band else band + 1
        if found <= band or band >= MOST_EDITS:
            return min(found, MOST_EDITS)
        band *= 2


def _compute_edit_distance_within(a: Sequence[Pair], b: Sequence[Pair], band: int) -> int:
    """Return the edit distance if it is at most `band`; otherwise return a number above `band`."""
    beyond = band + 1
    width = 2 * band + 1
    # Entry k of row r is the distance between the first r items of a and the first r + k - 1 - band items of b.
    rows = [[beyond] * (width + 2) for _ in range(len(a) + 1)]
    for r in range(len(a) + 1):
        row, above = rows[r], rows[r - 1]
        for c in range(max(0, r - band), min(len(b), r + band) + 1):
            k = c - r + band + 1
            best = 0 if r == c == 0 else beyond
            if r > 0:
                best = min(best, above[k + 1] + 1)
            if c > 0:
                best = min(best, row[k - 1] + 1)
            if r > 0 and c > 0 and a[r - 1] == b[c - 1]:
                best = min(best, above[k])
            if r > 1 and c > 1 and a[r - 1] == b[c - 2] and a[r - 2] == b[c - 1]:
                best = min(best, rows[r - 2][k] + 1)
            row[k] = best
        if min(row) > band:
            return beyond
    return rows[len(a)][len(b) - len(a) + band + 1]
