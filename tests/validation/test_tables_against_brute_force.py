"""PIC on finite walls against brute force of other formulas, as far as rounding lets floats say anything."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from tests.validation import table_runs
from tests.validation.table_runs import Table, campaign, compare, random_table, scene_of

from carom import SceneError


def test_random_tables_agree_up_to_where_rounding_has_grown() -> None:
    """With bulges of both signs, thick bars and islands, some under gravity: the same walls, times and velocities."""
    ends, agreed, worst = campaign(8, 15)
    assert ends["contradiction"] == 0
    assert agreed > 60
    assert 0.0 < worst <= 1.0


@pytest.mark.long
def test_many_random_tables_agree_up_to_where_rounding_has_grown() -> None:
    """The same of hundreds, for up to forty impacts each."""
    ends, agreed, worst = campaign(300, 40, seed=2)
    assert ends["contradiction"] == 0
    assert agreed > 6000
    assert 0.0 < worst <= 1.0


def test_a_table_that_differs_in_one_digit_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A restitution, or a radius, that is off by a millionth of a millionth contradicts brute force."""
    table = _first_table()
    assert compare(table, 6).ended != "contradiction"
    hair = 1.0 + 1e-12
    for wrong in (replace(table, restitution=table.restitution / hair), replace(table, radius=table.radius * hair)):
        monkeypatch.setattr(table_runs, "scene_of", lambda _, wrong=wrong: scene_of(wrong))
        assert compare(table, 6).ended == "contradiction"


def _first_table() -> Table:
    """Return a table that is a scene, without gravity."""
    for seed in range(100):
        table = random_table(random.Random(seed))
        try:
            scene_of(table)
        except SceneError:
            continue
        if table.gravity == (0.0, 0.0):
            return table
    raise AssertionError("no random table is a scene")
