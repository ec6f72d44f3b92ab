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
    section, *_ = overview(results, grid, prices(grid))
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
    (heads, rows) = tables(results, Medium.DETAIL)[0]
    missed = sum(len(row.score.missed) for row in results.rows if row.score and row.job.engine == "pit")
    lines = {row[0].text: [cell.text for cell in row] for row in rows}
    assert lines["PIT tuned"][heads.index("impacts - +")] == f"-{missed}"
    assert list(lines) == ["PIT tuned"]


def test_a_terminal_counts_the_scenes_of_each_grade(results: Results) -> None:
    """The counts are those of the grid, a method a row, and each row's numbers add up to the scenes."""
    (heads, rows) = tables(results, Medium.TERMINAL)[0]
    ((name, *counts),) = [[cell.text for cell in row] for row in rows]
    marks = [cell.mark.word for row in build_grid(results).rows for cell in row.cells if cell.column.engine == "pit"]
    assert name == "PIT tuned"
    assert counts[heads.index("wrong") - 1] == str(marks.count("wrong"))
    assert sum(int(count or 0) for count in counts) == len(marks)


def test_one_scene_is_told_in_physical_units() -> None:
    """PIT finds paper/late .9 of a step of 1/24 s late, which is 37.5 ms, and .6 of one of 1/96 s, 6.25 ms."""
    found = carom.cross_check(
        find_scenes(["paper/late"]), ["pit"], dts=[1 / 24, 1 / 96], timing=False, pool=InProcess()
    )
    coarse, fine, *_ = tables(found, Medium.TERMINAL)
    (heads, ((*cells,),)) = coarse
    shown = dict(zip(heads, (cell.text for cell in cells), strict=True))
    assert (shown["method"], shown["impacts"], shown["time"], shown["energy"]) == (
        "PIT tuned",
        "1 of 1",
        "+37.5 ms",
        "0",
    )
    assert shown["grade"].startswith("sampled ")
    assert fine[1][0][2].text == "+6.25 ms"
