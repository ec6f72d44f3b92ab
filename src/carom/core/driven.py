"""Driven bodies and the legs of their paths, as rows of numbers for the core."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.model.trace import wall_body

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.model.disc_arrays import DiscArrays
    from carom.model.prescribed_motion import Drive


def driven_rows(start: DiscArrays) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rows of driven bodies, and the rows of the legs of their paths, as the core reads them.

    The first array has a row for each driven body and each conveyor wall, with body number (wall k is -1 - k), number
    of legs, and surface speed. Walls come first, then discs, both in ascending order. The second array has a row for
    each leg, path after path: start and end (seconds since the start), displacement of the body when the leg begins (x
    and y, metres), and velocity (x and y, metres a second).
    """
    rows: list[tuple[float, float, float]] = []
    legs: list[tuple[float, ...]] = []

    def add(body: int, drive: Drive, belt: float) -> None:
        path = () if drive.stands else drive.legs
        if path or belt:
            rows.append((body, len(path), belt))
            legs.extend((leg.begin_s, leg.end_s, *leg.moved, *leg.velocity) for leg in path)

    for k in range(len(start.walls) if start.driven else 0):
        add(wall_body(k), start.drive_of_wall(k), start.belt_of_wall(k))
    for disc, drive in zip(start.driven_discs, start.disc_drives, strict=True):
        add(disc, drive, 0.0)
    return np.array(rows, np.float64).reshape(-1, 3), np.array(legs, np.float64).reshape(-1, 6)
