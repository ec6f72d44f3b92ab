"""Geometric possibility of a state: a disc that two bodies have crushed has no possible motion."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection
from itertools import combinations

from carom.comparator.stepwise.block import Block
from carom.comparator.stepwise.law import Pair


def is_geometrically_possible(block: Block, step: int, pairs: Collection[Pair]) -> bool:
    """Whether at the start of a step no disc is between two opposite bodies that are nearer than its diameter.

    Only driven bodies come so near. From such a state infinitely many impacts come at one instant, each at a
    greater speed, and none of them makes room. Bodies are opposite as far as the places of discs are known.

    Args:
        block: The steps.
        step: Which of them.
        pairs: Pairs of bodies; of a disc all that may leave it no room.
    """
    law = block.law
    if not law.driven:
        return True
    discs = sorted({body for pair in pairs for body in pair if body < law.n})
    state, known_m = block.state(step, discs), block.place_rounding[step]
    sides: dict[int, list[tuple[int, float, tuple[float, float]]]] = defaultdict(list)
    for i, j in pairs:
        gap, (nx, ny), _ = state.contact((i, j))
        if not law.movable(j):
            sides[i].append((j, gap, (nx, ny)))
        elif not law.movable(i):
            sides[j].append((i, gap, (-nx, -ny)))
    return not any(
        one_gap + other_gap < 0.0
        and (law.is_driven(one) or law.is_driven(other))
        and abs(nx * my - ny * mx) * law.radius[disc] <= 2.0 * known_m[disc]
        and nx * mx + ny * my < 0.0
        for disc, near in sides.items()
        for (one, one_gap, (nx, ny)), (other, other_gap, (mx, my)) in combinations(near, 2)
    )
