"""Helpers to read files of engines: they build walls from faces, and combine several coefficients into one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from carom.model.scene import Disc, Wall

Point = tuple[float, float]


def wall_towards(discs: Sequence[Disc], faces: Iterable[tuple[Point, Point]]) -> Wall | None:
    """Return a wall that replaces one of a body's faces.

    All discs are in front of this face. If no face has all discs in front of it, return None.

    A face is given by a point and a normal. If several faces are possible, the face farthest from the discs is chosen.
    """
    faces_ahead = [
        (gap, point, normal) for point, normal in faces if (gap := _compute_gap(discs, point, normal)) >= 0.0
    ]
    if not faces_ahead:
        return None
    _, point, normal = max(faces_ahead)
    return Wall(point_m=point, normal=normal)


def _compute_gap(discs: Sequence[Disc], point: Point, normal: Point) -> float:
    """Return the distance of the nearest disc from a face; negative if a disc is behind the face."""
    (px, py), (nx, ny) = point, normal
    gaps = [0.0] if not discs else []
    for disc in discs:
        gap = (disc.position_m[0] - px) * nx + (disc.position_m[1] - py) * ny - disc.radius_m
        # Because of rounding, a disc that touches the face can seem to be behind the face by this distance.
        rounding = 2.0**-50 * (math.hypot(*disc.position_m) + math.hypot(px, py) + disc.radius_m)
        gaps.append(0.0 if -rounding <= gap < 0.0 else gap)
    return min(gaps)


def one_coefficient(what: str, values: Sequence[float], most: float, dropped: list[str]) -> float:
    """Return the largest of several coefficients, limited to the range that scenes allow, and report the changes.

    Args:
        what: Name of the coefficient, for the report.
        values: The coefficients in the file, one for each pair of bodies.
        most: Largest value that a scene allows.
        dropped: List to which the reported changes are added.
    """
    if not values:
        return 0.0
    greatest = max(values)
    if greatest - min(values) > 2.0**-50 * greatest:  # a smaller difference is due to rounding
        dropped.append(f"{what}: values from {min(values):g} to {greatest:g}; the greatest is used")
    # An excess of one unit in the last place is due to rounding.
    if greatest > most * (1 + 2.0**-50):
        dropped.append(f"{what}: {greatest:g} is reduced to {most:g}")
    return min(greatest, most)
