"""Helpers to read files of engines: they build walls from faces, and combine several coefficients into one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from carom.model.scene import Disc, Wall

Point = tuple[float, float]


def wall_towards(discs: Sequence[Disc], faces: Iterable[tuple[Point, Point]]) -> Wall | None:
    """Return a face with all discs in front of it, as a wall; None if there is none. A face is a point and a normal.

    If there are several such faces, the one with the largest distance from the discs is chosen.
    """
    found = [(gap, point, normal) for point, normal in faces if (gap := _compute_gap(discs, point, normal)) >= 0.0]
    if not found:
        return None
    _, point, normal = max(found)
    return Wall(point_m=point, normal=normal)


def _compute_gap(discs: Sequence[Disc], point: Point, normal: Point) -> float:
    """Return the distance of the nearest disc from a face; negative if a disc is behind it, except for rounding."""
    (px, py), (nx, ny) = point, normal
    gaps = [0.0] if not discs else []
    for disc in discs:
        gap = (disc.position_m[0] - px) * nx + (disc.position_m[1] - py) * ny - disc.radius_m
        # The disc's centre, the face's point and the normal are each rounded by up to half a unit in the last place.
        rounding = 2.0**-50 * (math.hypot(*disc.position_m) + math.hypot(px, py) + disc.radius_m)
        gaps.append(0.0 if -rounding <= gap < 0.0 else gap)
    return min(gaps)


def one_coefficient(what: str, values: Sequence[float], most: float, dropped: list[str]) -> float:
    """Return the largest of several coefficients, limited to the range that scenes allow. Report what this changes.

    Args:
        what: Name of the coefficient, for the report.
        values: The coefficients in the file, one for each pair of bodies.
        most: Largest value in a scene.
        dropped: List to which the reported changes are added.
    """
    if not values:
        return 0.0
    found = max(values)
    if found - min(values) > 2.0**-50 * found:  # the difference exceeds the rounding of two roots and their product
        dropped.append(f"{what}: values from {min(values):g} to {found:g}; the greatest is used")
    # The product of two rounded roots of 1 can exceed 1 by a unit in the last place.
    if found > most * (1 + 2.0**-50):
        dropped.append(f"{what}: {found:g} is reduced to {most:g}")
    return min(found, most)
