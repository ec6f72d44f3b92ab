"""PIC reports no impact of bodies that do not touch, even if a disc leaves its cell of the grid just before an impact.

The scenes have a disc that crosses the edge of a cell a rounding's width before it meets a partner. What must happen
follows from the geometry alone: one disc, on a straight line, meets one other.
"""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.scene_builders import disc_at, staged
from tests.transformed_scenes import Map, identity, mirror, transform_scene, turn_quarter

from carom import Trace, solve_pic

#: Width of a cell where four discs of radius .5 span 12 m by 6 m: the square root of the area a disc.
CELL = math.sqrt(12 / 4 * 6 / 4)


def list_bodies(trace: Trace) -> list[tuple[int, int]]:
    return [(int(row["first"]), int(row["second"])) for row in trace.impacts]


def test_disc_that_leaves_its_cell_before_an_impact_has_that_impact() -> None:
    """A disc that crosses the edge of a cell 1e-9 m before an immovable disc has exactly that one impact."""
    # It comes after 12 m - sqrt(6) m + 1e-9 m at 1 m/s. This scene once crashed the interpreter.
    discs = disc_at(0.0, 0.0), disc_at(12.0, 6.0, -1.0), disc_at(math.sqrt(6.0) - 1.0 - 1e-9, 6.0, m=math.inf)
    trace = solve_pic(staged("three", *discs, duration_s=20.0))
    assert list_bodies(trace) == [(1, 2)]
    assert trace.impacts["time_s"][0] == pytest.approx(12.0 - math.sqrt(6.0) + 1e-9, abs=2 * math.ulp(12.0))


#: Shares of the wait between the edge and the impact: within 2^-22 a lower bound of its time may come before.
SHARES = st.one_of(st.just(0.0), st.floats(-60.0, -18.0).map(lambda exponent: 2.0**exponent))


@given(
    share=SHARES,
    column=st.integers(1, 3),
    before=st.floats(0.0625, 1.0),
    turn=st.sampled_from([identity, mirror, turn_quarter, lambda v: (-v[0], -v[1])]),
    mass=st.sampled_from([1.0, math.inf]),
    order=st.permutations(range(4)),
)
@example(1.25e-9, 2, 0.8, identity, math.inf, [0, 1, 2, 3])
@example(1.25e-9, 2, 0.8, identity, math.inf, [1, 2, 0, 3])
@example(1.25e-3, 2, 0.8, identity, math.inf, [3, 2, 1, 0])
def test_impact_just_behind_a_cell_edge_is_the_only_impact(
    share: float, column: int, before: float, turn: Map, mass: float, order: list[int]
) -> None:
    """A disc that crosses the edge of a cell and meets a disc just behind it has exactly that impact."""
    # Two more discs are out of reach. The time is the length of the path at 1 m/s, to the rounding of the coordinates.
    edge = column * CELL
    mover = disc_at(edge - before, 2.0 * CELL, 1.0)
    target = disc_at(edge + 1.0 + before * share, 2.0 * CELL, m=mass)
    discs = mover, disc_at(0.0, 0.0), disc_at(4 * CELL, 4 * CELL, 0.0, -0.25), target
    scene = staged("edge", *(discs[k] for k in order), duration_s=3.0)
    trace = solve_pic(transform_scene(scene, turn, turn, turn))
    assert list_bodies(trace) == [tuple(sorted((order.index(0), order.index(3))))]
    assert float(trace.impacts["time_s"][0]) == pytest.approx(before + before * share, abs=4 * math.ulp(4 * CELL))
