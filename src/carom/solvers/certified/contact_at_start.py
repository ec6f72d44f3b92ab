"""Bodies that touch or overlap at the start and approach: such a state has no past, so no certain future.

All of the start is exact, so this is decided by rational arithmetic; float64 finds the few that need it.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from carom.broad_phase import near_pairs, near_walls
from carom.solvers.certified.exact import pair_terms, pull_along_wall
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
            terms = pair_terms(scene, i, j)
            if terms.c <= 0 and terms.b < 0:
                return _degeneracy((i, j), touching=terms.c == 0)
            continue
        if _lies_on(scene, i, wall_index(j)):
            return Degeneracy(Degenerate.RESTING_CONTACT, (j, i), 0.0, 0.0, proven=True, bits=0)
        touching = _approaches_and_touches(scene, i, wall_index(j))
        if touching is not None:
            return _degeneracy((j, i), touching=touching)
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


def _approaches_and_touches(scene: Scene, i: int, k: int) -> bool | None:
    """Return whether a disc touches (True) or overlaps (False) a wall it approaches; None for neither."""
    disc, wall = scene.discs[i], scene.walls[k]
    n = [Fraction(value) for value in wall.normal]
    if sum(Fraction(disc.velocity_m_s[c]) * n[c] for c in (0, 1)) >= 0:
        return None
    along = sum((Fraction(disc.position_m[c]) - Fraction(wall.point_m[c])) * n[c] for c in (0, 1))
    rim = Fraction(disc.radius_m) ** 2 * (n[0] * n[0] + n[1] * n[1])
    if along > 0 and along * along > rim:
        return None
    return along > 0 and along * along == rim


def _lies_on(scene: Scene, i: int, k: int) -> bool:
    """Whether gravity presses a disc to a wall that it touches (or overlaps) and neither approaches nor leaves."""
    disc, wall = scene.discs[i], scene.walls[k]
    if pull_along_wall(scene, k) >= 0:
        return False
    n = [Fraction(value) for value in wall.normal]
    if sum(Fraction(disc.velocity_m_s[c]) * n[c] for c in (0, 1)) != 0:
        return False
    along = sum((Fraction(disc.position_m[c]) - Fraction(wall.point_m[c])) * n[c] for c in (0, 1))
    return along <= 0 or along * along <= Fraction(disc.radius_m) ** 2 * (n[0] * n[0] + n[1] * n[1])


def _degeneracy(bodies: tuple[int, int], *, touching: bool) -> Degeneracy:
    kind = Degenerate.TOUCHING_START if touching else Degenerate.OVERLAPPING_START
    return Degeneracy(kind, bodies, 0.0, 0.0, proven=True, bits=0)
