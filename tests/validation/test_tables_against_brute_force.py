"""PIC on finite walls against brute force of other formulas, as far as rounding lets floats say anything."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import pytest
from tests.campaign.tables import KINDS, Tally, draw, run_tables
from tests.lengths import long_after
from tests.validation import table_runs
from tests.validation.table_runs import Table, compare, scene_of

from carom.outline import Outline
from carom.physics.features import Arc, Face
from carom.physics.wall_features import WallFeature, features_of
from carom.solvers.event_driven import obstacles
from carom.solvers.plain import finite_walls


@pytest.mark.long
@pytest.mark.parametrize(("begun", "count", "least"), [(0, 12, 200), (10**6, 400, 8000)])
def test_random_tables_agree_up_to_where_rounding_has_grown(begun: int, count: int, least: int) -> None:
    """With bulges of both signs, thick bars, islands, cut sides, some under gravity: equal walls, times, velocities."""
    tally = Tally(begun=begun)
    run_tables(tally, count, float("inf"), None)
    assert tally.contradictions == []
    assert set(tally.counts) >= set(KINDS)
    assert tally.impacts > least


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
    """A disc was set on an arc of 14 km with the rounding of 14 km, which its next impact told."""
    drawn = draw(874)
    assert drawn is not None
    assert any(0.0 < abs(bulge) < 1e-3 for line in drawn[1].lines for bulge in line.bulges)
    assert compare(drawn[1], 6).ended == "most"


def without_last_vertex(found: tuple[WallFeature, ...]) -> Iterable[WallFeature]:
    """A joint that nothing meets."""
    last = [one for one in found if isinstance(one.feature, Arc) and one.feature.is_vertex][-1:]
    return [one for one in found if one not in last]


def without_backs(found: tuple[WallFeature, ...]) -> Iterable[WallFeature]:
    """Edges with one side."""
    faces = [one for one in found if isinstance(one.feature, Face)]
    return [one for one in found if one not in faces[1::2]]


def whole_arcs(found: tuple[WallFeature, ...]) -> Iterable[WallFeature]:
    """Arcs that are met all around their circles."""
    for one in found:
        yield one._replace(feature=replace(one.feature, sector=None)) if isinstance(one.feature, Arc) else one


def other_sectors(found: tuple[WallFeature, ...]) -> Iterable[WallFeature]:
    """Arcs less than half a circle that are taken for more, and the reverse."""
    for one in found:
        arc = one.feature
        if isinstance(arc, Arc) and arc.sector is not None:
            sector = replace(arc.sector, reflex=not arc.sector.reflex)
            yield one._replace(feature=replace(arc, sector=sector))
        else:
            yield one


def wider_vertices(found: tuple[WallFeature, ...]) -> Iterable[WallFeature]:
    """Vertices that are thicker than their edges by a millionth of a millionth of a metre."""
    for one in found:
        vertex = one.feature
        wide = isinstance(vertex, Arc) and vertex.is_vertex
        yield one._replace(feature=replace(vertex, half_width=vertex.half_width + 1e-12)) if wide else one


def rounded_arcs(found: tuple[WallFeature, ...]) -> Iterable[WallFeature]:
    """Arcs whose radius is off by some hundred units in the last place."""
    for one in found:
        arc = one.feature
        if isinstance(arc, Arc):
            yield one._replace(feature=replace(arc, radius=(arc.radius[0] * (1.0 + 1e-13), arc.radius[1])))
        else:
            yield one


@pytest.mark.parametrize(
    "fault",
    long_after(3, [whole_arcs, wider_vertices, rounded_arcs, without_last_vertex, without_backs, other_sectors]),
)
def test_a_fault_in_what_walls_consist_of_is_told(
    fault: Callable[[tuple[WallFeature, ...]], Iterable[WallFeature]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of the first tables contradicts brute force, whatever is wrong with a wall's sides, arcs and vertices."""

    def faulty(outline: Outline) -> tuple[WallFeature, ...]:
        return tuple(fault(features_of(outline)))

    for module in (obstacles, finite_walls):
        monkeypatch.setattr(module, "features_of", faulty)
    assert any(compare(table, 40).ended == "contradiction" for table in tables(0))
