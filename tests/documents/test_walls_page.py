"""The page of walls has the tables of its figures, and what it says of engines is so in these."""

from __future__ import annotations

import json
from typing import Any

import pytest
from docs.figures import walls
from tests.lengths import long_after

ROWS: list[dict[str, Any]] = json.loads(walls.FIGURES.read_text(encoding="utf-8"))
SWEEPING = {"Box2D", "Box2D v3", "Havok", "Planck", "Rapier", "Rapier 2D"}
BY_ASKING = ("LinearCast", "useMaximalCoordinates", "eENABLE_CCD")
#: Found smooth on ten pieces at every start.
SMOOTH = {
    ("Box2D", "one chain"),
    ("Box2D v3", "one chain, with a ghost point at each end"),
    ("Jolt", "one compound, `mEnhancedInternalEdgeRemoval`"),
    ("Planck", "one chain"),
    ("pymunk", "`Segment`, `set_neighbors`"),
}


def test_the_tables_are_those_of_the_figures() -> None:
    """The page is what `walls.json` makes it, with a row for each way of building a wall."""
    page = walls.PAGE.read_text(encoding="utf-8")
    assert walls.filled(page, ROWS) == page
    assert [(row["engine"], row["way"]) for row in ROWS] == [(way.engine, way.words) for way in walls.WAYS]


def test_who_passes_a_thin_wall_is_as_the_page_says() -> None:
    """What sweeps passes at no start, what looks once a step by the closed form to four starts, and p2 by its own."""
    for row in ROWS:
        through = row["thin"]["through"]
        if row["engine"] in SWEEPING or any(asked in row["way"] for asked in BY_ASKING):
            assert through == [0] * len(walls.SPEEDS), row
        elif row["engine"] == "p2-es" and "boxes" in row["way"]:
            step = [q * (walls.THIN_RADIUS_M + walls.HALF_M) for q in walls.SPEEDS]
            if row["way"] == "boxes":
                assert through == pytest.approx([walls.STARTS * (1 - 2 * walls.HALF_M / s) for s in step], abs=1)
        elif row["engine"] == "Newton":  # contacts from 0.2 m, or from a step's way, a metre at most
            reach = walls.THIN_RADIUS_M + walls.HALF_M
            step = [q * reach for q in walls.SPEEDS]
            ahead = [max(0.2, min(s, 1.0)) if "speculative" in row["way"] else 0.2 for s in step]
            form = [walls.STARTS * max(0.0, 1 - (reach + a) / s) for a, s in zip(ahead, step, strict=True)]
            assert through == pytest.approx(form, abs=1), row
        elif row["engine"] == "Drake":  # a spring
            assert through[0] == 0
            assert through[3:] == [walls.STARTS] * 4
        elif (row["engine"], row["way"]) == ("DART", "capsules"):  # which its detector makes spheres of
            assert through == [walls.STARTS] * len(walls.SPEEDS)
        else:
            form = [walls.STARTS * max(0.0, 1 - 1 / q) for q in walls.SPEEDS]
            if row["engine"] == "PhysX":  # contacts from afar
                assert all(found <= most for found, most in zip(through, form, strict=True))
                assert through[-1] == pytest.approx(form[-1], abs=1)
            else:
                assert through == pytest.approx(form, abs=4), row
            assert through[0] == 0


def test_who_is_smooth_over_joints_is_as_the_page_says() -> None:
    """Ways that the page calls smooth meet no joint at any start, and every other meets some, or no floor at all."""
    for row in ROWS:
        if (row["engine"], row["way"]) == ("DART", "capsules"):
            continue
        assert ((row["engine"], row["way"]) in SMOOTH) == (row["seams"]["other"] == [0, 0]), row


def test_what_comes_of_ends_is_as_the_page_says() -> None:
    """Who checks once per step is off by the step's way, Box2D and Planck by their slop, and v3's chain has no end."""
    looking = {"DART", "MuJoCo", "ODE", "p2-es", "pymunk"}
    for row in ROWS:
        median, worst = row["ends"]["median_deg"], row["ends"]["worst_deg"]
        if (row["engine"], row["way"]) in {
            ("DART", "capsules"),
            ("Box2D v3", "one chain, with a ghost point at each end"),
        }:
            assert median == pytest.approx([120.0, 36.4, 120.0, 36.4], abs=0.05)
        elif row["engine"] in {"Box2D", "Planck"}:
            assert worst == pytest.approx([2.3, 11.0, 2.3, 11.5], abs=0.1)
        elif row["engine"] in looking:
            assert 20 < worst[0] < 27
            assert worst[2] < 6


def test_who_comes_back_out_of_a_corner_is_as_the_page_says() -> None:
    """To a millimetre a second, but for the engines that the page names with what they are off by."""
    off = {"ODE": 0.02, "p2-es": 0.57, "cannon-es": 0.79, "Havok": 0.37, "PyBullet": 2.82}
    for row in ROWS:
        if (row["engine"], row["way"]) != ("DART", "capsules") and row["engine"] not in off:
            assert max(row["corners"]["worst_m_s"]) < 1e-3, row
    for engine, worst in off.items():
        found = max(max(row["corners"]["worst_m_s"]) for row in ROWS if row["engine"] == engine)
        assert found == pytest.approx(worst, abs=0.005)


@pytest.mark.parametrize("figure", long_after(1, ["corners", "thin", "seams", "ends"]))
def test_the_figures_are_those_of_the_engine(figure: str) -> None:
    """pymunk, flown again, comes to its row."""
    (way,) = (way for way in walls.WAYS if way.key == "neighbours")
    (kept,) = (row for row in ROWS if (row["engine"], row["way"]) == (way.engine, way.words))
    if walls.version_of(way) != kept["version"]:
        pytest.skip("another release of pymunk was measured")
    found, expected = getattr(walls, figure)(way), kept[figure]
    assert found["other"] == expected["other"] if figure == "seams" else found == expected
