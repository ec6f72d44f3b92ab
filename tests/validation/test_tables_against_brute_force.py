"""PIC on finite walls against brute force of other formulas, as far as rounding lets floats say anything."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import pytest
from tests.cases import each, release_after
from tests.validation import table_runs
from tests.validation.random_tables import KINDS, draw
from tests.validation.table_runs import Table, compare, scene_of

from carom.core.wall_features import Arc, Face, WallFeature, features_of
from carom.solvers.event_driven import obstacles

#: Impacts of a table at most: what a billiard with such obstacles loses an impact has most of them end before.
MOST = 40


@pytest.mark.release
@each("begun, count, least", [(0, 12, 200), (10**6, 1000, 20_000)])
def test_random_tables_agree_up_to_where_rounding_has_grown(begun: int, count: int, least: int) -> None:
    """With bulges of both signs, thick bars, islands, cut sides, some under gravity: equal walls, times, velocities."""
    drawn = {number: one for number in range(begun, begun + 2 * count) if (one := draw(number)) is not None}
    found = {number: compare(drawn[number][1], MOST) for number in list(drawn)[:count]}
    assert [number for number, one in found.items() if one.ended == "contradiction"] == []
    assert {drawn[number][0] for number in found} >= set(KINDS)
    assert sum(one.agreed for one in found.values()) > least


def tables(first: int) -> Iterable[Table]:
    """Return tables without gravity, which are solved fast."""
    for number in range(first, first + 400):
        drawn = draw(number)
        if drawn is not None and drawn[1].gravity == (0.0, 0.0):
            yield drawn[1]


def test_a_table_that_differs_in_one_digit_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A restitution, or a radius, that is off by a millionth of a millionth contradicts brute force."""
    table = next(iter(tables(0)))
    assert compare(table, 6).ended != "contradiction"
    hair = 1.0 + 1e-12
    for wrong in (replace(table, restitution=table.restitution / hair), replace(table, radius=table.radius * hair)):
        monkeypatch.setattr(table_runs, "scene_of", lambda _, wrong=wrong: scene_of(wrong))
        assert compare(table, 6).ended == "contradiction"


def test_a_nearly_flat_arc_under_gravity_costs_no_digits() -> None:
    """A disc was set on an arc of 14 km with the rounding of 14 km, which its next impact showed."""
    drawn = draw(874)
    assert drawn is not None
    assert any(0.0 < abs(bulge) < 1e-3 for line in drawn[1].lines for bulge in line.bulges)
    assert compare(drawn[1], 6).ended == "most"


Features = tuple[WallFeature, ...]


def of_arcs(change: Callable[[Arc], Arc]) -> Callable[[Features], Features]:
    """Return what changes each arc of walls, vertices included."""
    return lambda found: tuple(
        one._replace(feature=change(one.feature)) if isinstance(one.feature, Arc) else one for one in found
    )


def without_last_vertex(found: Features) -> Features:
    """A joint that nothing meets."""
    last = [one for one in found if isinstance(one.feature, Arc) and one.feature.is_vertex][-1:]
    return tuple(one for one in found if one not in last)


def without_backs(found: Features) -> Features:
    """Edges with one side."""
    faces = [one for one in found if isinstance(one.feature, Face)]
    return tuple(one for one in found if one not in faces[1::2])


def turned_over(arc: Arc) -> Arc:
    """An arc less than half a circle that is taken for more, and the reverse."""
    return arc if arc.sector is None else replace(arc, sector=replace(arc.sector, reflex=not arc.sector.reflex))


FAULTS: dict[str, Callable[[Features], Features]] = {
    "arcs that are met all around": of_arcs(lambda arc: replace(arc, sector=None)),
    "vertices thicker by a millionth of a millionth of a metre": of_arcs(
        lambda arc: replace(arc, half_width=arc.half_width + 1e-12 * arc.is_vertex)
    ),
    "radii off by some hundred units in the last place": of_arcs(
        lambda arc: replace(arc, radius=(arc.radius[0] * (1.0 + 1e-13), arc.radius[1]))
    ),
    "no last vertex": without_last_vertex,
    "no backs": without_backs,
    "other sectors": of_arcs(turned_over),
}


@each("name", release_after(1, FAULTS))
def test_a_fault_in_what_walls_consist_of_is_told(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """One of the first tables contradicts brute force, whatever is wrong with a wall's sides, arcs and vertices."""
    monkeypatch.setattr(obstacles, "features_of", lambda *asked: FAULTS[name](features_of(*asked)))
    assert any(compare(table, 40).ended == "contradiction" for table in tables(0))
