"""The cells of the kernel: whatever is put in is found, however crowded a cell is, and so is every wall in reach."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.lengths import each, release_after

from carom.studies.bench.gas import hard_disc_gas

probe = pytest.importorskip("tests.probe")

#: Discs that a scan looks at in one go, `BATCH` of core/pic/state.h.
BATCH = 64

GAS = hard_disc_gas(200, 0.3)


def cells() -> Any:
    """Return the cells of a gas of 200 discs, with no disc in them."""
    found = probe.Cells(GAS.position_m, GAS.radius_m, np.array(GAS.walls))
    assert found.grid[3] > 3
    return found


def discs_around(grid: Any, row: int, column: int) -> list[int]:
    """Return the discs of the nine cells around one, as a scan of the kernel finds them."""
    batches = grid.around(row, column)
    assert max(map(len, batches)) <= BATCH
    return sorted(disc for batch in batches for disc in batch)


@given(st.data())
def test_discs_are_found_in_the_cells_that_they_were_put_into(data: st.DataObject) -> None:
    """Discs put into a few cells and taken out again in any order are there exactly as long as they should be."""
    grid = cells()
    inside: dict[int, tuple[int, int]] = {}
    for disc in data.draw(st.lists(st.integers(0, 99), max_size=60)):
        if disc in inside:
            grid.remove(disc, *inside.pop(disc))
        else:
            inside[disc] = data.draw(st.sampled_from([(2, 2), (2, 3), (3, 3)]))
            grid.add(disc, *inside[disc])
    assert discs_around(grid, 2, 2) == sorted(inside)
    assert discs_around(grid, 1, 1) == sorted(disc for disc, cell in inside.items() if cell == (2, 2))


def test_a_cell_holds_any_number_of_discs() -> None:
    """Far more discs than a scan looks at in one go are all found, and none once they are taken out."""
    grid = cells()
    for disc in range(200):
        grid.add(disc, 2, 2 + disc % 2)
    assert discs_around(grid, 2, 2) == list(range(200))
    for disc in np.random.default_rng(1).permutation(200).tolist():
        grid.remove(disc, 2, 2 + disc % 2)
    assert discs_around(grid, 2, 2) == []


@each("distance", [0.0, 1e9, 1e17])
@each("angle", release_after(1, [0.3, 0.0, 1.0, 2.5]))
def test_a_wall_is_near_wherever_a_disc_may_touch_it(angle: float, distance: float) -> None:
    """A wall through the gas, given by a point however far along it, is near each cell in which a disc touches it."""
    from fractions import Fraction

    nx, ny = math.cos(angle), math.sin(angle)
    wall = (6.0 - distance * ny, 7.0 + distance * nx, nx, ny)
    grid = probe.Cells(GAS.position_m, GAS.radius_m, np.array([wall]))
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


def test_each_of_many_walls_is_known_to_the_cells_in_which_a_disc_touches_it_and_to_few_others() -> None:
    """Of 300 walls around the gas a cell knows all that a disc in it touches; most cells in the middle know none."""
    turned = [complex(math.cos(k), math.sin(k)) for k in range(300)]
    middle, side = np.mean(GAS.position_m, axis=0), max(x for x, _, _, _ in GAS.half_planes())
    walls = np.array(
        [(middle[0] + 0.6 * side * n.real, middle[1] + 0.6 * side * n.imag, -n.real, -n.imag) for n in turned]
    )
    grid = probe.Cells(GAS.position_m, GAS.radius_m, walls)
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
