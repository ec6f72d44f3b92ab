"""The overview: a line a method, and scene groups by method."""

from __future__ import annotations

import pytest

import carom
from carom.pages.document import Cell, Medium, Table
from carom.pages.grid import Mark, build_grid
from carom.runs.pool import InProcess
from carom.runs.results import Results
from carom.scenes import find_scenes
from carom.studies.cross_check.overview import overview
from carom.studies.cross_check.price import prices


@pytest.fixture(scope="module")
def results() -> Results:
    """The paper's four cases, and two scenes of no group of which one's name begins with the other's."""
    scene = find_scenes(["paper/late"])[0].scene
    own = [scene.model_copy(update={"name": name}) for name in ("mine", "mine-too")]
    return carom.cross_check(
        [*find_scenes(["paper"]), *own],
        ["pic", "pit"],
        dts=[1 / 24],
        profiles=["tuned"],
        timing=False,
        pool=InProcess(),
    )


def tables(results: Results, medium: Medium) -> list[tuple[list[str], list[list[Cell]]]]:
    """Return headings and rows of the first section's tables."""
    grid = build_grid(results)
    (section,) = overview(results, grid, prices(grid))
    found = [block.shown(medium) for block in section.shown(medium) if isinstance(block, Table)]
    return [([column.line for column in columns], rows) for columns, rows in found]


def test_a_group_counts_its_own_scenes(results: Results) -> None:
    """Scenes without a group are together, each counted once; the last row is all."""
    (_, rows), _ = tables(results, Medium.PAGE)
    assert [(row[0].text, row[0].note) for row in rows] == [
        ("paper", "4 scenes"),
        ("others", "2 scenes"),
        ("all", "6 scenes"),
    ]


def test_a_cell_tells_the_worst_grade_and_leads_to_the_worst_scene(results: Results) -> None:
    """PIT misses impacts in two of the paper's cases: the cell counts both, and leads to the one with more of them."""
    (heads, rows), _ = tables(results, Medium.PAGE)
    cell = rows[0][heads.index("PIT tuned")]
    assert (cell.text, cell.css) == ("2 of 4", Mark.WRONG.css)
    assert cell.link == "#paper/multiple/pit/tuned"
    assert sum(share.size for share in cell.shares) == 4


def test_a_method_is_a_line_with_its_own_numbers(results: Results) -> None:
    """Missed impacts are those of all its scores; PIC, which the others are held to, has no line among them."""
    (heads, rows) = tables(results, Medium.TERMINAL)[0]
    missed = sum(len(row.score.missed) for row in results.rows if row.score and row.job.engine == "pit")
    lines = {row[0].text: [cell.text for cell in row] for row in rows}
    assert lines["PIT tuned"][heads.index("impacts - +")] == f"-{missed}"
    assert list(lines) == ["PIT tuned"]
