"""Helpers to read files of engines: make walls from faces, and a single coefficient from several coefficients."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from carom.model.scene import Disc, Wall

Point = tuple[float, float]


def wall_towards(discs: Sequence[Disc], faces: Iterable[tuple[Point, Point]]) -> Wall | None:
    """Return a face with all discs in front of it, as a wall; None if there is none. A face is a point and its normal.

    If there are several such faces, the one with the largest distance to the discs is chosen.
    """
    found = [(gap, point, normal) for point, normal in faces if (gap := _compute_gap(discs, point, normal)) >= 0.0]
    if not found:
        return None
    _, point, normal = max(found)
    return Wall(point_m=point, normal=normal)


def _compute_gap(discs: Sequence[Disc], point: Point, normal: Point) -> float:
    """Return the distance of the nearest disc from a face; negative if a disc is behind it by more than rounding."""
    (px, py), (nx, ny) = point, normal
    gaps = [0.0] if not discs else []
    for disc in discs:
        gap = (disc.position_m[0] - px) * nx + (disc.position_m[1] - py) * ny - disc.radius_m
        # A centre, a corner and the normal are each rounded by up to half a unit in the last place.
        rounding = 2.0**-50 * (math.hypot(*disc.position_m) + math.hypot(px, py) + disc.radius_m)
        gaps.append(0.0 if -rounding <= gap < 0.0 else gap)
    return min(gaps)


def one_coefficient(what: str, values: Sequence[float], most: float, dropped: list[str]) -> float:
    """Return the largest of several coefficients, limited to the range of scenes, and report any loss.

    Args:
        what: Name of the coefficient in reports.
        values: The coefficients in the file, one for each pair of bodies.
        most: Largest value in a scene.
        dropped: List to which losses are added.
    """
    if not values:
        return 0.0
    found = max(values)
    if found - min(values) > 2.0**-50 * found:  # a difference above the rounding of a product and of two roots
        dropped.append(f"{what}: values from {min(values):g} to {found:g}; the greatest is used")
    # Rounded roots of 1 can have a product above 1, by a unit in the last place.
    if found > most * (1 + 2.0**-50):
        dropped.append(f"{what}: {found:g} is reduced to {most:g}")
    return min(found, most)
