"""The cells of the kernel, held against sets: whatever is put in is found, however crowded a cell is."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from tests.unit.solvers.columns import columns_of

from carom.bench.gas import hard_disc_gas
from carom.solvers.cells import put, take
from carom.solvers.layout import BATCH, CHAINS, COLUMNS, NOBODY, SLOTS, STRIDE, Columns
from carom.solvers.prediction import crowd

GAS = hard_disc_gas(200, 0.3)


def discs_around(s: Columns, row: int, column: int) -> list[int]:
    """Return the discs of the nine cells around one, as a scan of the kernel finds them."""
    first = (row - 1) * s.size[STRIDE] + column - 1
    found, chains, chain = [], 0, NOBODY
    for line in range(3):
        for k in range(3):
            base = (first + line * s.size[STRIDE] + k) * SLOTS
            slots = s.cells[base : base + SLOTS]
            found += [j for j in slots if j > NOBODY]
            chains += slots[-1] < NOBODY
    while chains:
        count, chains, chain = crowd(s, first, 3, s.size[STRIDE], 1, chains, chain)
        assert count <= BATCH
        found += s.nearby[:count]
    return sorted(found)


@given(st.data())
def test_discs_are_found_in_the_cells_that_they_were_put_into(data: st.DataObject) -> None:
    """Discs put into a few cells and taken out again in any order are there exactly as long as they should be."""
    s = columns_of(GAS)
    s.cells[: s.size[CHAINS]] = [NOBODY] * s.size[CHAINS]
    assert s.size[COLUMNS] > 3
    inside: dict[int, tuple[int, int]] = {}
    for disc in data.draw(st.lists(st.integers(0, 99), max_size=60)):
        if disc in inside:
            take(s, disc, *inside.pop(disc))
        else:
            inside[disc] = data.draw(st.sampled_from([(2, 2), (2, 3), (3, 3)]))
            put(s, disc, *inside[disc])
    assert discs_around(s, 2, 2) == sorted(inside)
    assert discs_around(s, 1, 1) == sorted(disc for disc, cell in inside.items() if cell == (2, 2))


def test_a_cell_holds_any_number_of_discs() -> None:
    """Far more discs than a scan looks at in one go are all found, and none once they are taken out."""
    s = columns_of(GAS)
    s.cells[: s.size[CHAINS]] = [NOBODY] * s.size[CHAINS]
    for disc in range(200):
        put(s, disc, 2, 2 + disc % 2)
    assert discs_around(s, 2, 2) == list(range(200))
    for disc in np.random.default_rng(1).permutation(200).tolist():
        take(s, disc, 2, 2 + disc % 2)
    assert discs_around(s, 2, 2) == []
