"""Bodies that touch or overlap at the start and approach: such a state has no past, so no certain future.

All of the start is exact, so this is decided by rational arithmetic; float64 finds the few that need it.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.certified.exact import pair_terms, pull_along_wall
from carom.solvers.certified.result import Degeneracy, Degenerate
from carom.trace import wall_body

if TYPE_CHECKING:
    from carom.scene import Scene

__all__ = ["contact_at_start"]

#: Relative slack of the float64 search: far above its rounding, far below what would let many pairs through.
_SLACK = 2.0**-40


def contact_at_start(scene: Scene) -> Degeneracy | None:
    """Return the first pair of bodies that touch or overlap at the start and approach; None where none do."""
    n = len(scene.discs)
    position = np.array([disc.position_m for disc in scene.discs])
    radius = np.array([disc.radius_m for disc in scene.discs])
    size = np.abs(position).max(axis=1) + radius
    for i in range(n):
        gap = np.hypot(*(position[i + 1 :] - position[i]).T) - (radius[i + 1 :] + radius[i])
        for j in np.flatnonzero(gap <= _SLACK * (size[i + 1 :] + size[i])) + i + 1:
            if scene.discs[i].immovable and scene.discs[j].immovable:
                continue
            terms = pair_terms(scene, i, int(j))
            if terms.c <= 0 and terms.b < 0:
                return _degeneracy((i, int(j)), touching=terms.c == 0)
        for k in range(len(scene.walls)):
            if _lies_on(scene, i, k):
                return Degeneracy(Degenerate.RESTING_CONTACT, (wall_body(k), i), 0.0, 0.0, proven=True, bits=0)
            touching = _approaches_and_touches(scene, i, k)
            if touching is not None:
                return _degeneracy((wall_body(k), i), touching=touching)
    return None


def _approaches_and_touches(scene: Scene, i: int, k: int) -> bool | None:
    """Return whether a disc touches (True) or overlaps (False) a wall it approaches; None for neither."""
    disc, wall = scene.discs[i], scene.walls[k]
    if disc.immovable:
        return None
    offset = [disc.position_m[c] - wall.point_m[c] for c in (0, 1)]
    gap = offset[0] * wall.normal[0] + offset[1] * wall.normal[1] - disc.radius_m
    if gap > _SLACK * (max(map(abs, (*disc.position_m, *wall.point_m))) + disc.radius_m):
        return None
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
    if disc.immovable or pull_along_wall(scene, k) >= 0:
        return False
    n = [Fraction(value) for value in wall.normal]
    if sum(Fraction(disc.velocity_m_s[c]) * n[c] for c in (0, 1)) != 0:
        return False
    along = sum((Fraction(disc.position_m[c]) - Fraction(wall.point_m[c])) * n[c] for c in (0, 1))
    return along <= 0 or along * along <= Fraction(disc.radius_m) ** 2 * (n[0] * n[0] + n[1] * n[1])


def _degeneracy(bodies: tuple[int, int], *, touching: bool) -> Degeneracy:
    kind = Degenerate.TOUCHING_START if touching else Degenerate.OVERLAPPING_START
    return Degeneracy(kind, bodies, 0.0, 0.0, proven=True, bits=0)
