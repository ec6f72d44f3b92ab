"""PIC reports no impact of bodies that do not touch, even if a disc leaves its cell of the grid just before an impact.

The scenes have a disc that crosses the edge of a cell a rounding's width before it meets a partner. What must happen
follows from the geometry alone: one disc, on a straight line, meets one other.
"""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.scene_builders import disc_at, staged, wall_at

from carom import Disc, Trace, certify, solve_pic, solve_pic_framewise

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


def test_six_discs_at_integer_positions_have_four_impacts() -> None:
    """Six discs at integer positions have four impacts, at multiples of a quarter of a second."""
    # PIC, frame-by-frame PIC and a certified run agree. Disc 1 goes from (5, 6) along (-2, 2) to (4, 7) below the
    # immovable disc 2, loses its speed along y, and goes 3.5 m at 2 m/s to the left wall. Disc 3 goes 2.5 m at 2 m/s to
    # the upper wall, disc 4 1.5 m at 1 m/s to the right one.
    scene = staged(
        "whole numbers",
        disc_at(1.0, 9.0),
        disc_at(5.0, 6.0, -2.0, 2.0, m=2.0),
        disc_at(4.0, 8.0, m=math.inf),
        disc_at(7.0, 9.0, -1.0, 2.0),
        disc_at(10.0, 3.0, 1.0, 1.0),
        disc_at(8.0, 8.0, m=math.inf),
        *(wall_at(0.0, 0.0, 1.0, 0.0), wall_at(12.0, 0.0, -1.0, 0.0)),
        *(wall_at(0.0, 0.0, 0.0, 1.0), wall_at(0.0, 12.0, 0.0, -1.0)),
        restitution=0.0,
        wall_restitution=0.5,
        duration_s=6.0,
    )
    for trace in (solve_pic(scene), solve_pic_framewise(scene), certify(scene).trace):
        assert list_bodies(trace) == [(1, 2), (3, -4), (4, -2), (1, -1)]
        assert trace.impacts["time_s"].tolist() == [0.5, 1.25, 1.5, 2.25]


#: Shares of the wait between the edge and the impact: within 2^-22 a lower bound of its time may come before.
SHARES = st.one_of(st.just(0.0), st.floats(-60.0, -18.0).map(lambda exponent: 2.0**exponent))


@given(
    share=SHARES,
    column=st.integers(1, 3),
    before=st.floats(0.0625, 1.0),
    along_y=st.booleans(),
    backwards=st.booleans(),
    immovable=st.booleans(),
    moves_aside=st.booleans(),
    order=st.permutations(range(4)),
)
@example(1.25e-9, 2, 0.8, False, False, True, True, [0, 1, 2, 3])
@example(1.25e-9, 2, 0.8, False, False, True, True, [1, 2, 0, 3])
@example(1.25e-3, 2, 0.8, False, False, True, True, [3, 2, 1, 0])
def test_impact_just_behind_a_cell_edge_is_the_only_impact(
    share: float,
    column: int,
    before: float,
    along_y: bool,
    backwards: bool,
    immovable: bool,
    moves_aside: bool,
    order: list[int],
) -> None:
    """A disc that crosses the edge of a cell and meets a disc just behind it has exactly that impact."""
    # The partner is immovable or at rest, and two more discs are out of reach. The time is the length of the path at 1
    # m/s, to the rounding of the coordinates. The centres are on one line, so the velocity is exchanged or reversed.
    edge = column * CELL
    at = (edge - before, edge + 1.0 + before * share)
    aside = (0.0, -0.25) if moves_aside else (0.0, 0.0)
    low, high = disc_at(0.0, 0.0), disc_at(4 * CELL, 4 * CELL, *aside)
    mover, target = disc_at(at[0], 2.0 * CELL, 1.0), disc_at(at[1], 2.0 * CELL, m=math.inf if immovable else 1.0)

    def placed(disc: Disc) -> Disc:
        """Return the disc with the scene turned as asked for, about its middle."""
        (x, y), (vx, vy) = disc.position_m, disc.velocity_m_s
        if backwards:
            x, vx = 4 * CELL - x, -vx
        place, velocity = ((y, x), (vy, vx)) if along_y else ((x, y), (vx, vy))
        return disc.model_copy(update={"position_m": place, "velocity_m_s": velocity})

    discs = [placed(disc) for disc in (mover, low, high, target)]
    trace = solve_pic(staged("edge", *(discs[k] for k in order), duration_s=3.0))
    first, second = sorted((order.index(0), order.index(3)))
    assert list_bodies(trace) == [(first, second)]
    assert float(trace.impacts["time_s"][0]) == pytest.approx(before + before * share, abs=4 * math.ulp(4 * CELL))
    ahead = placed(disc_at(0.0, 0.0, 1.0)).velocity_m_s
    back = tuple(-v for v in ahead)
    assert tuple(trace.final_velocity_m_s[order.index(0)]) == (back if immovable else (0.0, 0.0))
    assert tuple(trace.final_velocity_m_s[order.index(3)]) == ((0.0, 0.0) if immovable else ahead)
    for other in (1, 2):
        assert tuple(trace.final_velocity_m_s[order.index(other)]) == discs[other].velocity_m_s
