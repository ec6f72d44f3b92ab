"""Bodies that touch or overlap at the start and approach: such a state has no past, so no certain future.

All of the start is exact, so this is decided by rational arithmetic; float64 finds the few that need it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.broad_phase import near_pairs, near_walls
from carom.solvers.certified.exact import gap_and_speed_at_wall, gap_and_speed_of_pair, pull_along_wall
from carom.solvers.certified.result import Degeneracy, Degenerate
from carom.trace import wall_body, wall_index

if TYPE_CHECKING:
    from carom.scene import Scene

__all__ = ["contact_at_start"]

#: Relative slack of the float64 search: far above its rounding, far below what would let many pairs through.
_SLACK = 2.0**-40


def contact_at_start(scene: Scene) -> Degeneracy | None:
    """Return the first pair of bodies that touch or overlap at the start and approach; None where none do."""
    for i, j in _near_bodies(scene):
        if j >= 0:
            (gap, speed), pull = gap_and_speed_of_pair(scene, i, j), 0
        else:
            (gap, speed), pull = gap_and_speed_at_wall(scene, i, wall_index(j)), pull_along_wall(scene, wall_index(j))
        if gap <= 0 and speed < 0:
            kind = Degenerate.TOUCHING_START if gap == 0 else Degenerate.OVERLAPPING_START
        elif gap <= 0 and speed == 0 and pull < 0:  # it lies there
            kind = Degenerate.RESTING_CONTACT
        else:
            continue
        return Degeneracy(kind, (min(i, j), max(i, j)), 0.0, 0.0, proven=True, bits=0)
    return None


def _near_bodies(scene: Scene) -> list[tuple[int, int]]:
    """Return all pairs that may touch, in the order of their first discs, other discs before walls."""
    start = scene.arrays
    walls = np.array(start.walls).reshape(-1, 4)
    size = np.abs(start.position_m).max(axis=1) + start.radius_m
    reach = start.radius_m + _SLACK * size
    pairs = [pair for block in near_pairs(start.position_m, reach, start.movable) for pair in zip(*block, strict=True)]
    farthest = np.abs(walls[:, :2]).max(initial=0.0)
    contacts = [
        (disc, wall_body(wall))
        for block in near_walls(start.position_m, reach + _SLACK * farthest, start.movable, walls)
        for disc, wall in zip(*block, strict=True)
    ]
    return sorted(
        [(int(i), int(j)) for i, j in [*pairs, *contacts]],
        key=lambda pair: (pair[0], pair[1] < 0, abs(pair[1])),
    )
