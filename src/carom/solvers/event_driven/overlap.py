"""Whether discs overlap at the start: such a state has no past, so its future has no unique answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from carom.solvers.event_driven.disc_arrays import DiscArrays

    Ranks = NDArray[np.intp]

__all__ = ["require_apart"]

#: A cell, and those of its neighbours that have not looked at it themselves: (columns, rows) away.
_HALF_OF_THE_NEIGHBOURS = ((0, 0), (1, 0), (-1, 1), (0, 1), (1, 1))


def require_apart(start: DiscArrays) -> None:
    """Refuse a start in which two discs, or a disc and a wall, overlap by more than rounding can explain.

    As for a scene, two immovable bodies may overlap.

    Raises:
        InputError: Two bodies overlap; the message names them.
    """
    movable = np.isfinite(start.mass_kg)
    x, y, radius = *start.position_m.T, start.radius_m
    for a, b in _near_pairs(start):
        # A gap of more than minus six roundings is not below 0 in this form either, which is the cheaper one.
        near = (x[b] - x[a]) ** 2 + (y[b] - y[a]) ** 2 < (radius[a] + radius[b]) ** 2
        if not near.any():
            continue
        i, j = a[near], b[near]
        gap = np.hypot(x[j] - x[i], y[j] - y[i]) - (radius[i] + radius[j])
        sizes = [abs(start.position_m[k]).max(axis=1) for k in (i, j)]
        slack = _input_rounding(np.maximum.reduce([*sizes, radius[i], radius[j]]))
        wrong = np.flatnonzero((gap < -slack) & (movable[i] | movable[j]))
        if len(wrong):
            first, second = sorted((int(i[wrong[0]]), int(j[wrong[0]])))
            raise InputError(
                f"position_m[{second}] must not overlap disc {first} at the start, got "
                f"{start.position_m[second].tolist()}: the two overlap by {-gap[wrong[0]]:.3g} m; move them apart"
            )
    for k, (qx, qy, nx, ny) in enumerate(start.walls):
        gap = (start.position_m - (qx, qy)) @ np.array([nx, ny]) - start.radius_m
        size = np.maximum(np.maximum(abs(start.position_m).max(axis=1), start.radius_m), max(abs(qx), abs(qy)))
        wrong = np.flatnonzero((gap < -_input_rounding(size)) & movable)
        if len(wrong):
            i = int(wrong[0])
            raise InputError(
                f"position_m[{i}] must not overlap wall {k} at the start, got {start.position_m[i].tolist()}: the disc "
                f"reaches {-gap[i]:.3g} m into it; move the disc, or turn the wall's normal round"
            )


def _input_rounding(size: NDArray[np.float64]) -> NDArray[np.float64]:
    """Error of a gap that nobody need have meant, see the same function of `carom.scene`."""
    rounding: NDArray[np.float64] = 6 * np.spacing(size)
    return rounding


def _near_pairs(start: DiscArrays) -> Iterator[tuple[Ranks, Ranks]]:
    """Yield all pairs of discs in the same or in neighbouring cells of the width of the largest contact distance."""
    n = len(start)
    low = start.position_m.min(axis=0)
    # No more cells in a direction than a key has room for.
    width = max(start.largest_reach, float((start.position_m.max(axis=0) - low).max()) / 2**30)
    column, row = np.floor((start.position_m - low) / width).astype(np.int64).T
    stride = int(column.max()) + 3  # an empty column on either side, so that rows do not touch
    key = (row + 1) * stride + column + 1
    order = np.argsort(key, kind="stable")
    key = key[order]
    for across, up in _HALF_OF_THE_NEIGHBOURS:
        other = key + up * stride + across
        begin, end = np.searchsorted(key, other, side="left"), np.searchsorted(key, other, side="right")
        if (across, up) == (0, 0):
            begin = np.arange(1, n + 1)
        here = np.flatnonzero(begin < end)
        place = begin[here]
        while len(here):
            yield order[here], order[place]
            place = place + 1
            go_on = place < end[here]
            here, place = here[go_on], place[go_on]
