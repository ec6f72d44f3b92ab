"""Constants of impacts in interval arithmetic, for two discs, and for a disc and a straight or round part of a wall."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

from flint import arb

from carom.core.wall_parts import Plane, Round
from carom.model.scene import Scene
from carom.solvers.certified.ball_arithmetic import ZERO, ball
from carom.solvers.certified.obstacles import Obstacle


class PairLaw(NamedTuple):
    """Constants of a pair of discs, as intervals of the current precision.

    An impact changes a disc's velocity by its `share` times the relative velocity along the normal.
    """

    reach: arb
    reach2: arb
    share_i: arb
    share_j: arb
    keep_i: arb
    keep_j: arb
    change_i: arb
    change_j: arb


class WallLaw(NamedTuple):
    """Constants of a wall for discs of one radius.

    An impact changes a velocity v to ``M v`` and a position x to ``M x + shift``. With restitution 1, the impact is a
    reflection.
    """

    nx: arb
    ny: arb
    length: arb
    level: arb
    m_xx: arb
    m_xy: arb
    m_yy: arb
    shift_x: arb
    shift_y: arb


class RoundLaw(NamedTuple):
    """Constants of a vertex or arc for discs of one radius.

    (cx, cy) is the centre of the vertex or arc, and `reach` its distance from the centre of a touching disc. With the
    numbers of `RoundApproach`, an impact adds ``change * root * (px, py)`` to the disc's velocity.
    """

    cx: arb
    cy: arb
    reach: arb
    reach2: arb
    change: arb


class Laws:
    """Constants of a scene's impacts, as intervals of the current precision. Each constant is computed once.

    Attributes:
        of_straight: Function that returns the constants of the k-th obstacle, a half-plane or straight side, for discs
            of a given radius.
        of_round: Function that returns the constants of the k-th obstacle, a vertex or an arc, for discs of a given
            radius.
    """

    def __init__(self, scene: Scene, obstacles: Sequence[Obstacle]) -> None:
        self._scene = scene
        self._obstacles = obstacles
        self._materials = scene.arrays.materials
        self._kind = [(disc.mass_kg, disc.radius_m) for disc in scene.discs]
        self._of_kinds = cache(self._build_pair_law)
        self.of_straight = cache(self._build_wall_law)
        self.of_round = cache(self._build_round_law)

    def of_discs(self, i: int, j: int) -> PairLaw:
        """Return the constants of discs `i` and `j`."""
        return self._of_kinds(*self._kind[i], *self._kind[j])

    def _build_pair_law(self, mass_i: float, radius_i: float, mass_j: float, radius_j: float) -> PairLaw:
        """Return the constants of two discs. The share of disc 1 is ``(1 + e) (1/m1) / (1/m1 + 1/m2)``."""
        turn = arb(self._scene.restitution) + 1
        if math.isinf(mass_i) or math.isinf(mass_j):
            share_i, share_j = (turn, ZERO) if math.isinf(mass_j) else (ZERO, turn)
        else:
            share_i, share_j = (turn * mass / (arb(mass_i) + arb(mass_j)) for mass in (arb(mass_j), arb(mass_i)))
        reach = arb(radius_i) + arb(radius_j)
        reach2 = reach * reach
        return PairLaw(reach, reach2, share_i, share_j, 1 - share_i, 1 - share_j, share_i / reach2, share_j / reach2)

    def _build_wall_law(self, k: int, radius: float) -> WallLaw:
        """Return the constants of a straight obstacle.

        The half-plane is ``(p - q).n >= 0``. The direction of the stored normal n is exact, but its length differs
        from 1 by rounding. So distances are divided by ``|n|``, and reflections by ``|n|^2``.
        """
        obstacle = self._obstacles[k]
        shape = obstacle.shape
        assert isinstance(shape, Plane)  # noqa: S101 - callers pass straight obstacles only
        (px, py), (nx, ny) = map(ball, shape.point), map(ball, shape.normal)
        length2 = nx * nx + ny * ny
        length = length2.sqrt()
        thick = arb(radius) + ball(obstacle.half_width)
        level = px * nx + py * ny + thick * length
        turn = arb(self._materials[obstacle.wall].restitution) + 1
        if ny.is_zero() or nx.is_zero():  # along an axis no division is needed, so the numbers stay exact
            xx, xy, yy = (1 - turn, ZERO, arb(1)) if ny.is_zero() else (arb(1), ZERO, 1 - turn)
        else:
            xx, xy, yy = 1 - turn * nx * nx / length2, ZERO - turn * nx * ny / length2, 1 - turn * ny * ny / length2
        return WallLaw(nx, ny, length, level, xx, xy, yy, turn * level * nx / length2, turn * level * ny / length2)

    def _build_round_law(self, k: int, radius: float) -> RoundLaw:
        obstacle = self._obstacles[k]
        shape = obstacle.shape
        assert isinstance(shape, Round)  # noqa: S101 - callers pass round obstacles only
        (cx, cy), inside = shape.centre, shape.inside
        thick = arb(radius) + ball(obstacle.half_width)
        reach = ball(shape.radius2).sqrt() + (ZERO - thick if inside else thick)
        reach2 = reach * reach
        change = (arb(self._materials[obstacle.wall].restitution) + 1) / reach2
        return RoundLaw(ball(cx), ball(cy), reach, reach2, ZERO - change if inside else change)
