"""What readers of several engines' files need alike: walls of faces, and one coefficient of many."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from carom.model.scene import Disc, Wall

Point = tuple[float, float]


def wall_towards(discs: Sequence[Disc], faces: Iterable[tuple[Point, Point]]) -> Wall | None:
    """Return the face, a point with its outward normal, that all discs lie before, as a wall; None where none is so.

    Of several it is the one that the discs are farthest from.
    """
    found = [(gap, point, normal) for point, normal in faces if (gap := _gap(discs, point, normal)) >= 0.0]
    if not found:
        return None
    _, point, normal = max(found)
    return Wall(point_m=point, normal=normal)


def _gap(discs: Sequence[Disc], point: Point, normal: Point) -> float:
    """Return how far the nearest disc is from a face; below 0, beyond rounding, one is behind it."""
    (px, py), (nx, ny) = point, normal
    gaps = [0.0] if not discs else []
    for disc in discs:
        gap = (disc.position_m[0] - px) * nx + (disc.position_m[1] - py) * ny - disc.radius_m
        # A centre and a corner are each rounded to half a unit of their own size, and so is the normal.
        rounding = 2.0**-50 * (math.hypot(*disc.position_m) + math.hypot(px, py) + disc.radius_m)
        gaps.append(0.0 if -rounding <= gap < 0.0 else gap)
    return min(gaps)


def one_coefficient(what: str, values: Sequence[float], most: float, dropped: list[str]) -> float:
    """Return the one coefficient that there is, or the greatest of several, cut to what scenes have; say so if it is.

    Args:
        what: What it is of.
        values: What the file has for each pair of bodies.
        most: The greatest that a scene has.
        dropped: Where what is lost is noted.
    """
    if not values:
        return 0.0
    found = max(values)
    if found - min(values) > 2.0**-50 * found:  # more than the rounding of a product and of two roots
        dropped.append(f"{what}: it differs, {min(values):g} to {found:g}, and the greatest is taken")
    # The product of the roots of 1, each rounded, may be a unit above it.
    if found > most * (1 + 2.0**-50):
        dropped.append(f"{what}: it is {found:g}, and cut to {most:g}")
    return min(found, most)
