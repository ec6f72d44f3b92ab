"""PIC on finite walls against certified runs, as far as rounding lets floats say anything.

`test_certified_tables.py` compares certified runs of the same tables with brute force of other formulas.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import pytest
from tests.campaign.comparison import Record, compare_with_envelope
from tests.campaign.envelope import Envelope, compute_envelope
from tests.cases import each, long_until
from tests.scene_builders import require_value
from tests.validation.random_tables import KINDS, draw_table
from tests.validation.table_runs import Table, build_table_scene

from carom.core.wall_features import Arc, Face, WallFeature, build_features
from carom.solvers.event_driven import obstacles
from carom.solvers.pic import solve_pic

#: Impacts of a table at most: what a billiard with such obstacles loses an impact has most of them end before.
MOST = 40


def compare_table(table: Table, solved: Table | None = None) -> tuple[Envelope, list[str]]:
    """Return the rounding envelope of a table, and how PIC's run of it, or of another one, differs from that."""
    trace = solve_pic(build_table_scene(solved or table), max_impacts=MOST)
    envelope = compute_envelope(build_table_scene(table), trace, MOST)
    return envelope, [one.text for one in compare_with_envelope(build_table_scene(table), envelope, Record.of(trace))]


@pytest.mark.release
@each("begun, count, least", [(0, 12, 200), (10**6, 1600, 20_000)])
def test_pic_matches_certified_runs_on_random_tables(begun: int, count: int, least: int) -> None:
    """PIC agrees with certified runs on random tables up to the impact where rounding has grown too large."""
    # The tables have bulges of both signs, thick bars, islands and cut sides, some with gravity. Walls, times and
    # velocities are compared.
    drawn = {number: one for number in range(begun, begun + 2 * count) if (one := draw_table(number)) is not None}
    found = {number: compare_table(drawn[number][1]) for number in list(drawn)[:count]}
    assert {number: said for number, (_, said) in found.items() if said} == {}
    assert {drawn[number][0] for number in found} >= set(KINDS)
    assert sum(len(envelope.events) for envelope, _ in found.values()) > least


def draw_tables(first: int) -> Iterable[Table]:
    """Return tables without gravity, which are solved fast."""
    for number in range(first, first + 400):
        drawn = draw_table(number)
        if drawn is not None and drawn[1].gravity == (0.0, 0.0):
            yield drawn[1]


def test_table_parameter_off_by_1e_12_is_detected() -> None:
    """PIC with a restitution or a radius that is off by 1e-12 contradicts the certified run."""
    table, hair = next(iter(draw_tables(0))), 1.0 + 1e-12
    assert compare_table(table)[1] == []
    assert compare_table(table, replace(table, restitution=table.restitution / hair))[1]
    assert compare_table(table, replace(table, radius=table.radius * hair))[1]


@pytest.mark.long
def test_nearly_flat_arc_under_gravity_loses_no_digits() -> None:
    """On an arc with a radius of 14 km the impacts keep the digits of the disc's own position."""
    # Positions on the arc once had the rounding of 14 km.
    _, table = require_value(draw_table(874))
    assert any(0.0 < abs(bulge) < 1e-3 for line in table.lines for bulge in line.bulges)
    envelope, differences = compare_table(table)
    assert differences == []
    assert len(envelope.events) >= 6


Features = tuple[WallFeature, ...]


def change_arcs(change: Callable[[Arc], Arc]) -> Callable[[Features], Features]:
    """Return what changes each arc of walls, vertices included."""
    return lambda found: tuple(
        one._replace(feature=change(one.feature)) if isinstance(one.feature, Arc) else one for one in found
    )


def remove_last_vertex(found: Features) -> Features:
    """A joint that nothing meets."""
    last = [one for one in found if isinstance(one.feature, Arc) and one.feature.is_vertex][-1:]
    return tuple(one for one in found if one not in last)


def remove_back_sides(found: Features) -> Features:
    """Edges with one side."""
    faces = [one for one in found if isinstance(one.feature, Face)]
    return tuple(one for one in found if one not in faces[1::2])


def flip_sector(arc: Arc) -> Arc:
    """An arc less than half a circle that is taken for more, and the reverse."""
    return arc if arc.sector is None else replace(arc, sector=replace(arc.sector, reflex=not arc.sector.reflex))


FAULTS: dict[str, Callable[[Features], Features]] = {
    "arcs that are met all around": change_arcs(lambda arc: replace(arc, sector=None)),
    "vertices thicker by a millionth of a millionth of a metre": change_arcs(
        lambda arc: replace(arc, half_width=arc.half_width + 1e-12 * arc.is_vertex)
    ),
    "radii off by some hundred units in the last place": change_arcs(
        lambda arc: replace(arc, radius=(arc.radius[0] * (1.0 + 1e-13), arc.radius[1]))
    ),
    "no last vertex": remove_last_vertex,
    "no backs": remove_back_sides,
    "other sectors": change_arcs(flip_sector),
}


@each("name", long_until(1, FAULTS))
def test_fault_in_wall_features_is_detected(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrong side, arc or vertex of a wall makes PIC contradict the certified run on one of the first tables."""
    monkeypatch.setattr(obstacles, "build_features", lambda *asked: FAULTS[name](build_features(*asked)))
    assert any(compare_table(table)[1] for table in draw_tables(0))
