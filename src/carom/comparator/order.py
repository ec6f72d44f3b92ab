"""Order of impacts compared with the reference's, and the edit distance of the two sequences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carom.comparator.align import LATEST_STAMP_STEPS, Alignment, Pair
from carom.model.trace import Trace

#: Largest edit distance that is computed: sequences that differ more are unrelated.
MOST_EDITS = 64


@dataclass(frozen=True)
class Order:
    """How the order of an observed trace's impacts compares with the reference's.

    Attributes:
        edits: Impacts to insert, to delete, or to swap with their neighbour, to turn the one sequence of pairs into the
            other; `MOST_EDITS` where it is that many or more.
        inverted: Matched impacts whose order is wrong, as indices of the reference, the one that comes first there
            first.
    """

    edits: int
    inverted: tuple[tuple[int, int], ...]


def compare_order(reference: Trace, observed: Trace, alignment: Alignment) -> Order:
    """Compare the order of the impacts of an alignment, which may end at a horizon.

    A method that checks once per step has no order within a step, and stamps up to two steps late. So two impacts
    without a common body and within two steps of each other are not out of order; nor are two with one time stamp.
    """
    to_reference = {o: r for r, o in alignment.matched}
    sequence = sorted([*to_reference, *alignment.spurious])
    expected = sorted([*to_reference.values(), *alignment.missed])
    inverted = _sort_by_reference(sequence, to_reference, reference, observed)
    edits = edit_distance(_pairs(reference, expected), _pairs(observed, sequence))
    return Order(edits, tuple(sorted(inverted)))


def _sort_by_reference(
    sequence: list[int], to_reference: dict[int, int], reference: Trace, observed: Trace
) -> set[tuple[int, int]]:
    """Sort observed impacts into the reference's order where that is allowed; return the inverted pairs.

    Insertion sort over neighbours: an impact that is in order, as nearly all are, costs one comparison.
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
            a, b = to_reference[later], to_reference[earlier]  # in the order of the reference, if inverted
            if a > b:
                break
            apart = not _have_common_body(reference, a, b) and time[b] - time[a] <= slack
            if not (apart or stamp[earlier] == stamp[later]):
                inverted.add((a, b))
                break
            sequence[k - 1], sequence[k] = later, earlier
            k -= 1
    return inverted


def _have_common_body(reference: Trace, a: int, b: int) -> bool:
    """Whether two impacts have a movable body in common."""
    discs = reference.scene.discs
    bodies = [{int(reference.impacts[k]["first"]), int(reference.impacts[k]["second"])} for k in (a, b)]
    return any(body >= 0 and not discs[body].immovable for body in bodies[0] & bodies[1])


def _pairs(trace: Trace, indices: Sequence[int]) -> list[Pair]:
    first, second = trace.impacts["first"].tolist(), trace.impacts["second"].tolist()
    return [(first[k], second[k]) for k in indices]


def edit_distance(a: Sequence[Pair], b: Sequence[Pair]) -> int:
    """Return the least number of insertions, deletions and swaps of neighbours that turn `a` into `b`.

    The restricted Damerau-Levenshtein distance without replacements (G. Navarro, A guided tour to approximate string
    matching, ACM Computing Surveys 33(1), 2001), in a band about the diagonal that is doubled until the answer fits
    (E. Ukkonen, 1985); `MOST_EDITS` where the answer is that or more.
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
        found = _edit_distance_within(a, b, band) if abs(len(a) - len(b)) <= band else band + 1
        if found <= band or band >= MOST_EDITS:
            return min(found, MOST_EDITS)
        band *= 2


def _edit_distance_within(a: Sequence[Pair], b: Sequence[Pair], band: int) -> int:
    """Return the distance where it is at most `band`, else something larger."""
    beyond = band + 1
    width = 2 * band + 1
    rows = np.full((len(a) + 1, width + 2), beyond, np.int64)  # column k of row r is position r + k - 1 - band of b
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
        if row.min() > band:
            return beyond
    return int(rows[len(a)][len(b) - len(a) + band + 1])
