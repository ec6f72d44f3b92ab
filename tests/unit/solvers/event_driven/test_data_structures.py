"""Rows, queue and grid of the event-driven loop."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, staged

from carom import solve_pic
from carom.model.trace import IMPACT_DTYPE, SPIN_DTYPE
from carom.solvers.rows import CONTACT_DTYPE
from carom.studies.bench.gas import build_hard_disc_gas

core_functions = pytest.importorskip("tests.core_functions")


@each("name, dtype", [("Impact", IMPACT_DTYPE), ("Spins", SPIN_DTYPE), ("Contact", CONTACT_DTYPE)])
def test_kernel_structs_match_the_dtypes_of_a_trace(name: str, dtype: np.dtype[np.void]) -> None:
    """The kernel's structs have the fields of the trace's arrays, with the same order, offsets and types."""
    struct = core_functions.layouts()[name]
    assert struct.itemsize == dtype.itemsize
    kinds = [(kind.base, kind.shape, place) for kind, place in (struct.fields[name] for name in struct.names)]
    expected = [require_value(dtype.fields)[name][:2] for name in require_value(dtype.names)]
    assert kinds == [(kind.base, kind.shape, place) for kind, place in expected]


@each("name, size", [("Disc", 64), ("Prediction", 32), ("Cell", 8)])
def test_kernel_rows_fill_cache_lines_without_gaps(name: str, size: int) -> None:
    """A disc takes 64 bytes, a prediction 32 and a cell 8, without gaps, so that they fill cache lines."""
    struct = core_functions.layouts()[name]
    assert struct.itemsize == size
    bit_fields = 4 if name == "Prediction" else 0
    assert bit_fields + sum(np.dtype(struct.fields[field][0]).itemsize for field in struct.names) == size


# The event queue, compared with a plain list of times -----------------------------------------------------------------


# Few different times, so that many are the same.
TIMES = st.sampled_from([0.0, 1.0, 2.0, 3.0, math.inf])
DISCS = 70  # three levels, none of them full

changes = st.lists(st.tuples(st.integers(0, DISCS - 1), TIMES), min_size=1, max_size=60)


@given(changes)
def test_event_queue_finds_the_earliest_times(given_times: list[tuple[int, float]]) -> None:
    """After any changes the queue finds the earliest disc, the earliest time of the others, and all discs due."""
    queue = core_functions.EventQueue(DISCS)
    times = [math.inf] * DISCS
    for disc, time in given_times:
        queue.set_time(disc, time)
        times[disc] = time
        least = min(times)
        assert times[queue.earliest()] == least
        for other in (disc, (disc + 1) % DISCS, (disc + 31) % DISCS):
            left = [times[k] for k in range(DISCS) if k not in (disc, other)]
            assert queue.earliest_except(disc, other) == min(left)
        for limit in {least, time}:
            found, after = [], queue.next_not_after(0, limit)
            while after < DISCS:
                found.append(after)
                after = queue.next_not_after(after + 1, limit)
            assert found == [k for k in range(DISCS) if times[k] <= limit]


@each("discs", [1, 2, 7, 8, 9, 64, 65, 512, 513])
def test_event_queue_of_any_length_returns_discs_in_order(discs: int) -> None:
    """Queues of 1 to 513 discs return the discs in the order of their times."""
    queue = core_functions.EventQueue(discs)
    order = sorted(range(discs), key=lambda disc: (disc * 37) % 541)
    for disc in range(discs):
        queue.set_time(disc, float((disc * 37) % 541))
    for disc in order:
        assert queue.earliest() == disc
        queue.set_time(disc, math.inf)


# The cells of the grid: all discs in a cell and all walls in reach are found, even in crowded cells -------


#: Discs that a scan looks at in one go, `BATCH` of core/pic/state.h.
BATCH = 64

GAS = build_hard_disc_gas(200, 0.3)


def build_cells() -> Any:
    """Return the cells of a gas of 200 discs, with no disc in them."""
    found = core_functions.Cells(GAS.position_m, GAS.radius_m, np.array(GAS.walls))
    assert found.grid[3] > 3
    return found


def find_discs_around(grid: Any, row: int, column: int) -> list[int]:
    """Return the discs of the nine cells around one, as a scan of the kernel finds them."""
    batches = grid.around(row, column)
    assert max(map(len, batches)) <= BATCH
    return sorted(disc for batch in batches for disc in batch)


@given(st.data())
def test_discs_are_found_in_their_cells_until_removed(data: st.DataObject) -> None:
    """Discs that are added to cells and removed in any order are found exactly while they are there."""
    grid = build_cells()
    inside: dict[int, tuple[int, int]] = {}
    for disc in data.draw(st.lists(st.integers(0, 99), max_size=60)):
        if disc in inside:
            grid.remove(disc, *inside.pop(disc))
        else:
            inside[disc] = data.draw(st.sampled_from([(2, 2), (2, 3), (3, 3)]))
            grid.add(disc, *inside[disc])
    assert find_discs_around(grid, 2, 2) == sorted(inside)
    assert find_discs_around(grid, 1, 1) == sorted(disc for disc, cell in inside.items() if cell == (2, 2))


def test_cells_hold_any_number_of_discs() -> None:
    """All of 200 discs in two cells are found, and none after they were removed."""
    grid = build_cells()
    for disc in range(200):
        grid.add(disc, 2, 2 + disc % 2)
    assert find_discs_around(grid, 2, 2) == list(range(200))
    for disc in np.random.default_rng(1).permutation(200).tolist():
        grid.remove(disc, 2, 2 + disc % 2)
    assert find_discs_around(grid, 2, 2) == []


@each("distance", [0.0, 1e9, 1e17])
@each("angle", release_after(1, [0.3, 0.0, 1.0, 2.5]))
def test_wall_is_listed_in_each_cell_where_a_disc_touches_it(angle: float, distance: float) -> None:
    """A wall is listed in each cell in which a disc touches it, also if its point is 1e17 m away."""
    nx, ny = math.cos(angle), math.sin(angle)
    wall = (6.0 - distance * ny, 7.0 + distance * nx, nx, ny)
    grid = core_functions.Cells(GAS.position_m, GAS.radius_m, np.array([wall]))
    x0, y0, width, columns, rows = grid.grid
    qx, qy, mx, my = map(Fraction, wall)
    touched = 0
    for row in range(rows):
        for column in range(columns):
            for at_x, at_y in ((0.1, 0.1), (0.9, 0.1), (0.5, 0.5), (0.1, 0.9), (0.9, 0.9)):
                x, y = Fraction(x0 + (column + at_x) * width), Fraction(y0 + (row + at_y) * width)
                if abs((x - qx) * mx + (y - qy) * my) <= Fraction(0.5):
                    touched += 1
                    assert grid.walls_near(1 + row, 1 + column) == [0]
    if distance <= 1e15:  # beyond, the wall given by these floats may pass by
        assert touched


def test_cells_list_the_walls_that_discs_touch_and_few_others() -> None:
    """A cell lists all of 300 walls that a disc in it touches; over a third of the cells list none."""
    turned = [complex(math.cos(k), math.sin(k)) for k in range(300)]
    middle, side = np.mean(GAS.position_m, axis=0), max(x for x, _, _, _ in GAS.half_planes())
    walls = np.array(
        [(middle[0] + 0.6 * side * n.real, middle[1] + 0.6 * side * n.imag, -n.real, -n.imag) for n in turned]
    )
    grid = core_functions.Cells(GAS.position_m, GAS.radius_m, walls)
    x0, y0, width, columns, rows = grid.grid
    known = {(row, column): grid.walls_near(1 + row, 1 + column) for row in range(rows) for column in range(columns)}
    touched = 0
    for (row, column), numbers in known.items():
        assert numbers == sorted(set(numbers))
        for at_x, at_y in ((0.05, 0.05), (0.95, 0.05), (0.5, 0.5), (0.05, 0.95), (0.95, 0.95)):
            x, y = x0 + (column + at_x) * width, y0 + (row + at_y) * width
            distance = (x - walls[:, 0]) * walls[:, 2] + (y - walls[:, 1]) * walls[:, 3]
            near = np.flatnonzero(np.abs(distance) <= 0.5)
            touched += len(near)
            assert set(near.tolist()) <= set(numbers)
    assert touched > len(walls)
    assert sum(not numbers for numbers in known.values()) > len(known) / 3


@each("cells", [3, 4, 8])
def test_discs_that_touch_across_a_cell_meet_in_order_of_time(cells: int) -> None:
    r"""A disc that touches another one almost a cell away meets it before a third disc does.

    A cell is a thousandth wider than two discs. If it were narrower by 2^-10, these discs would touch across a whole
    cell. Equal discs exchange their velocities at 0.75 s, 0.75015 s and 0.7503 s.
    """
    place = cells * (1.0 - 2.0**-10) + 0.9986
    moves = [disc_at(place - 0.75, 0.0, 1.0), disc_at(place + 1.0, 0.0), disc_at(place + 2.7503, 0.0, -1.0)]
    rest = [disc_at(place + 5.0 + 1.2 * k, 0.0) for k in range(9)]
    impacts = solve_pic(staged("cells", disc_at(0.0, 0.0), *moves, *rest, duration_s=1.0)).impacts
    assert impacts[["first", "second"]].tolist() == [(1, 2), (2, 3), (1, 2)]
    assert impacts["time_s"] == pytest.approx([0.75, 0.75015, 0.7503], rel=1e-14)
