"""No impact between bodies that do not touch: a disc that leaves its cell just before an impact is not taken for one.

The scenes have a disc that crosses the edge of a cell a rounding's width before it meets a partner. What must happen
follows from the geometry alone: one disc, on a straight line, meets one other.
"""

from __future__ import annotations

import math

import pytest

from carom import Disc, Scene, solve_pic

#: Width of a cell where four discs of radius .5 span 12 m by 6 m: the square root of the area a disc.
CELL = math.sqrt(12 / 4 * 6 / 4)


def _disc(x: float, y: float, vx: float = 0.0, vy: float = 0.0, mass: float = 1.0) -> Disc:
    return Disc(position_m=(x, y), velocity_m_s=(vx, vy), radius_m=0.5, mass_kg=mass)


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (1, 2, 0, 3), (3, 2, 1, 0), (2, 0, 3, 1)])
@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-9, 1e-8, 1.5e-7, 2e-7, 1e-3])
def test_a_disc_that_leaves_its_cell_just_before_an_impact_meets_only_the_disc_in_its_way(
    gap: float, order: tuple[int, ...]
) -> None:
    """A disc .8 m before the edge of a cell meets the immovable disc just behind that edge, and returns."""
    edge = 2 * CELL
    discs = [
        _disc(edge - 0.8, 3.0, 1.0),
        _disc(0.0, 0.0),
        _disc(12.0, 6.0, 0.0, -0.25),
        _disc(edge + 1.0 + gap, 3.0, mass=math.inf),
    ]
    trace = solve_pic(Scene(name="edge", discs=[discs[k] for k in order], duration_s=5.0))
    mover, target = sorted((order.index(0), order.index(3)))
    assert [(int(row["first"]), int(row["second"])) for row in trace.impacts] == [(mover, target)]
    assert float(trace.impacts["time_s"][0]) == pytest.approx(0.8 + gap, abs=4 * math.ulp(edge))
    expected = {0: (-1.0, 0.0), 1: (0.0, 0.0), 2: (0.0, -0.25), 3: (0.0, 0.0)}
    for at, k in enumerate(order):
        assert tuple(trace.final_velocity_m_s[at]) == expected[k]
