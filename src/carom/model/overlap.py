"""Finds bodies that overlap at the start of a scene.

A scene with an overlap is invalid: rigid bodies never overlap, so the laws of impact don't determine how overlapping
bodies move. Two immovable bodies may overlap, since this has no effect.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.errors import InputError
from carom.model.broad_phase import find_near_pairs, find_near_walls
from carom.model.chain_geometry import Outline
from carom.model.disc_arrays import DiscArrays, HalfPlane
from carom.support.formatting import format_metres

Floats = NDArray[np.float64]

#: Largest number of overlaps of each kind (two discs, or disc and wall) that a message names.
NAMED = 10

#: Factor for distances in the search for near bodies, so that rounding hides no overlap. The factor adds 16 * 2^-52.
#: The rounding of a gap needs 4 * 2^-52, and the comparison in the search needs 8 * 2^-52.
_ROUNDED_UP = 1.0 + 2.0**-48


class Overlap(NamedTuple):
    """A disc that overlaps another body at the start.

    Attributes:
        disc: Number of the disc; the higher number if both bodies are discs.
        other: Number of the other disc, or number of the wall.
        message: What is wrong, and what the user can do. In an error message, a field's name precedes this text.
    """

    disc: int
    other: int
    message: str


def compute_input_rounding(size: Floats) -> Floats:
    """Return the largest overlap that rounding of the input can explain.

    Discs that touch exactly in the decimal numbers of a file may overlap slightly as floats. Discs with this small
    overlap must be accepted. The gap of two discs depends on six numbers. Each number is rounded by at most half a unit
    in the last place of the largest number, which gives 3 units. The computation of the gap rounds five times, by less
    than 3 units in all.

    Args:
        size: Magnitude of the largest number in the computation of a gap, in metres.
    """
    rounding: Floats = 6.0 * np.spacing(size)
    return rounding


def find_overlaps(start: DiscArrays, disc_name: str, wall_name: str) -> tuple[list[Overlap], bool]:
    """Return overlaps larger than rounding errors: at most ten each with discs, half-planes and other walls.

    Args:
        start: The discs and walls.
        disc_name: Text that names the other disc in a message, with ``{}`` for its number.
        wall_name: Text that names the wall in a message, with ``{}`` for its number.

    Returns:
        A list of overlaps, and whether there are more. The list has three parts: overlaps with discs, with half-planes,
        and with other walls. Each part is sorted by disc and then by the other body.
    """
    walls, size = start.walls, np.maximum(np.abs(start.position_m).max(axis=1), start.radius_m)
    planes = {k: wall for k, wall in enumerate(walls) if isinstance(wall, tuple)}
    outlines = {k: wall for k, wall in enumerate(walls) if not isinstance(wall, tuple)}
    overlaps: list[Overlap] = []
    has_more = False
    with np.errstate(over="ignore", invalid="ignore"):  # distances beyond the largest float are infinite
        kinds = [_find_disc_overlaps(start, size, disc_name)]
        kinds += [_find_half_plane_overlaps(start, size, planes, wall_name)] if planes else []
        kinds += [_find_outline_overlaps(start, size, outlines, wall_name)] if outlines else []
        for kind in kinds:
            first_overlaps = list(islice(kind, NAMED + 1))
            overlaps += first_overlaps[:NAMED]
            has_more = has_more or len(first_overlaps) > NAMED
    return overlaps, has_more


def require_apart(start: DiscArrays) -> None:
    """Refuse a state in which two discs, or a disc and a wall, overlap by more than rounding errors.

    Raises:
        InputError: Bodies overlap. The message names the first ten pairs of each kind.
    """
    overlaps, has_more = find_overlaps(start, "disc {}", "wall {}")
    if overlaps:
        lines = [f"position_m[{overlap.disc}] {overlap.message}" for overlap in overlaps]
        raise InputError("\n".join([*lines, "and more of them"] if has_more else lines))


def _find_disc_overlaps(start: DiscArrays, size: Floats, name: str) -> Iterator[Overlap]:
    position, radius = start.position_m, start.radius_m
    # The tolerance of a pair is at least the mean of both discs' `compute_input_rounding(size)`. So the search may
    # reduce the radius of each disc by half of this value.
    reach = radius * _ROUNDED_UP - compute_input_rounding(size) / 2.0
    for first, second in find_near_pairs(position, reach, start.movable):
        if not len(first):  # usually no pair is near, and the next lines take longer than the search
            continue
        offset = position[second] - position[first]
        gap = np.hypot(offset[:, 0], offset[:, 1]) - (radius[first] + radius[second])
        wrong = np.flatnonzero(gap < -compute_input_rounding(np.maximum(size[first], size[second])))
        for k in wrong[np.lexsort((first[wrong], second[wrong]))].tolist():
            i, j = int(first[k]), int(second[k])
            yield Overlap(
                j,
                i,
                f"must not overlap {name.format(i)} at the start, got {tuple(position[j].tolist())}: "
                f"the two overlap by {format_metres(-gap[k])}; move them apart",
            )


def _find_half_plane_overlaps(
    start: DiscArrays, size: Floats, walls: Mapping[int, HalfPlane], name: str
) -> Iterator[Overlap]:
    position, radius = start.position_m, start.radius_m
    numbers, planes = list(walls), np.array([*walls.values()])
    for disc, wall in find_near_walls(position, radius, start.movable, planes):
        x, y, nx, ny = planes[wall].T
        gap = (position[disc, 0] - x) * nx + (position[disc, 1] - y) * ny - radius[disc]
        largest = np.maximum(size[disc], np.abs(planes[wall, :2]).max(axis=1))
        for n in np.flatnonzero(gap < -compute_input_rounding(largest)).tolist():
            i, k = int(disc[n]), numbers[int(wall[n])]
            yield Overlap(
                i,
                k,
                f"must not overlap {name.format(k)} at the start, got {tuple(position[i].tolist())}: "
                f"the disc reaches {format_metres(-gap[n])} into it; move the disc, or reverse the wall's normal",
            )


def _find_outline_overlaps(
    start: DiscArrays, size: Floats, walls: Mapping[int, Outline], name: str
) -> Iterator[Overlap]:
    position, radius, movable = start.position_m, start.radius_m, start.movable
    near: list[tuple[int, int]] = []  # disc and wall numbers of pairs whose bounding boxes are near each other
    for k, wall in walls.items():
        low, high = wall.box
        beyond = np.maximum(low - position, position - high).max(axis=1)
        is_near = (beyond <= (radius + wall.half_width) * _ROUNDED_UP) & movable
        near += [(i, k) for i in np.flatnonzero(is_near).tolist()]
    for i, k in sorted(near):
        x, y, r, wall = float(position[i, 0]), float(position[i, 1]), float(radius[i]), walls[k]
        largest = np.array(max(float(size[i]), *map(abs, wall.lengths)))
        gap = wall.compute_gap(x, y, r)
        inside = wall.solid and wall.does_enclose(x, y)
        if not inside and gap >= -compute_input_rounding(largest):
            continue
        found = f"must not overlap {name.format(k)} at the start, got {(x, y)}: "
        if inside:
            yield Overlap(i, k, f"{found}the disc is inside this solid wall; move the disc")
        else:
            edge = "" if wall.radius is not None else f"edge {wall.find_nearest(x, y).edge} of "
            yield Overlap(i, k, f"{found}the disc reaches {format_metres(-gap)} into {edge}it; move the disc")
