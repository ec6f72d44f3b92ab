"""The overview: the methods ranked, a row each, with what they do in each group of scenes."""

from dataclasses import replace

import pytest
from tests.cases import each
from tests.scene_builders import cross_checked, sure

from carom.catalogue import find_scenes
from carom.comparator import Grade
from carom.execution.job import Status
from carom.execution.results import Results, Row
from carom.report.document import Cell, Media, Table
from carom.report.outcome_marks import Mark
from carom.studies.cross_check.grade_tables import build_methods_section
from carom.studies.cross_check.grid import build_grid, compute_standing
from carom.studies.cross_check.scene_sections import build_scenes_section


@pytest.fixture(scope="module")
def results() -> Results:
    """The paper's four cases, and two scenes of no group of which one's name begins with the other's."""
    scene = find_scenes(["paper/late"])[0].scene
    own = [scene.model_copy(update={"name": name}) for name in ("mine", "mine-too")]
    return cross_checked([*find_scenes(["paper"]), *own], ["pic", "pit"], dts=[1 / 24], profiles=["tuned"])


def tables(results: Results, medium: Media) -> list[tuple[list[str], list[list[Cell]]]]:
    """Return headings and rows of the first section's tables."""
    section = build_methods_section(build_grid(results))
    found = [block.select_for(medium) for block in section.select_for(medium) if isinstance(block, Table)]
    return [([column.line for column in columns], rows) for columns, rows in found]


def test_a_group_counts_its_own_scenes(results: Results) -> None:
    """Each group is a column and counts its scenes; scenes without a group are together."""
    ((heads, _),) = tables(results, Media.PAGE)
    assert heads[4:-1] == ["paper 4 scenes", "others 2 scenes"]


def test_a_cell_counts_what_is_right_and_leads_to_the_worst_scene(results: Results) -> None:
    """PIT is right in none of the paper's cases and misses impacts in two: a mark says so, and the worst is played."""
    ((heads, rows),) = tables(results, Media.PAGE)
    paper, others = rows[0][heads.index("paper 4 scenes")], rows[0][heads.index("others 2 scenes")]
    assert (paper.text, paper.corner) == ("0 of 4", Mark.WRONG.symbol)
    assert paper.title.startswith("an impact is missed in 2 scenes")
    assert paper.link == "#paper/multiple/pit/tuned"
    assert {share.css: share.size for share in paper.shares} == {Mark.SAMPLED.css: 2, Mark.WRONG.css: 2}
    assert (others.text, others.corner) == ("0 of 2", "")  # it finds these late, and misses nothing


def test_a_method_is_a_line_with_its_own_numbers(results: Results) -> None:
    """Missed impacts are summed over all scores of a method; PIC, the reference of the others, has no line."""
    (heads, rows) = tables(results, Media.DETAIL)[0]
    missed = sum(len(row.score.missed) for row in results.rows if row.score and row.job.engine == "pit")
    lines = {row[0].line: [cell.text for cell in row] for row in rows}
    assert lines["PIT"][heads.index("impacts - +")] == f"-{missed}"
    assert list(lines) == ["PIT"]


def test_a_terminal_counts_the_scenes_of_each_grade(results: Results) -> None:
    """The counts are those of the grid, a method a row, and each row's numbers add up to the scenes."""
    (heads, rows) = tables(results, Media.TERMINAL)[0]
    ((name, *counts),) = [[cell.text for cell in row] for row in rows]
    marks = [cell.mark.word for row in build_grid(results).rows for cell in row.cells if cell.column.engine == "pit"]
    assert name == "PIT"
    assert counts[heads.index("wrong") - 1] == str(marks.count("wrong"))
    assert sum(int(count or 0) for count in counts) == len(marks)


def test_one_scene_is_told_in_physical_units() -> None:
    """PIT finds paper/late .9 of a step of 1/24 s late, which is 37.5 ms, and .6 of one of 1/96 s, 6.25 ms."""
    found = cross_checked(find_scenes(["paper/late"]), ["pit"], dts=[1 / 24, 1 / 96])
    coarse, fine, *_ = tables(found, Media.TERMINAL)
    (heads, ((*cells,),)) = coarse
    shown = dict(zip((head.split()[0] for head in heads), (cell.text for cell in cells), strict=True))
    assert (shown["method"], shown["impacts"], shown["time"], shown["energy"]) == ("PIT", "1/1", "+37.5", "0")
    assert shown["grade"].startswith("≈ ")
    assert fine[1][0][2].text == "+6.25"


@pytest.fixture(scope="module")
def several() -> Results:
    """The paper's four cases by PIT and by three profiles of an engine, of which one steps up to the contact."""
    return cross_checked(find_scenes(["paper"]), ["pic", "pit", "pymunk"], dts=[1 / 24])


def test_terminal_and_report_have_one_order(several: Results) -> None:
    """Methods are ordered by the mean grade of the shown counts, from exact to wrong."""
    (heads, counted), *_ = tables(several, Media.TERMINAL)
    orders = [[row[0].line for row in counted]]
    orders += [[row[0].line for row in tables(several, medium)[0][1]] for medium in (Media.PAGE, Media.MARKDOWN)]
    assert orders[0] == orders[1] == orders[2]
    assert orders[0][0] == "pymunk located"
    assert len(orders[0]) == 4

    def count(row: list[Cell], *names: str) -> int:
        return sum(int(row[heads.index(name)].text or 0) for name in names)

    graded = ("exact", "close", "sampled", "inaccurate", "parted", "wrong")
    # Nothing parts here, so the two grades that share this column need not be distinguished.
    assert not any(count(row, "parted") for row in counted)
    places = (0, 1, 2, 3, 4, 6)
    merits = [
        sum(place * count(row, name) for place, name in zip(places, graded, strict=True)) / count(row, *graded)
        for row in counted
    ]
    assert merits == sorted(merits)
    assert len(set(merits)) > 1


@each("scene", ["paper/missed", "paper/late", "paper/multiple"])
def test_of_one_scene_terminal_and_report_have_one_order(several: Results, scene: str) -> None:
    """Where one scene was run, its table of physical errors and the report's table of methods begin with the same."""
    rows = tuple(row for row in several.rows if row.job.scene.name == scene)
    alone = replace(several, rows=rows)
    (_, terminal), *_ = tables(alone, Media.TERMINAL)
    (_, page), *_ = tables(alone, Media.PAGE)
    assert [row[0].line for row in terminal] == [row[0].line for row in page]
    assert len(page) == 4


def test_among_equals_the_better_grade_and_the_lower_price_stand_first(several: Results) -> None:
    """Exact precedes close, the cheaper sampled run precedes the other, and a close run does not offset a wrong one."""
    row = next(row for row in several.rows if row.score and row.score.grade is Grade.SAMPLED)
    assert row.score is not None
    exact, close = (replace(row, score=replace(row.score, grade=grade)) for grade in (Grade.EXACT, Grade.CLOSE))
    cheap, dear = (replace(row, score=replace(row.score, price_paid=paid)) for paid in (0.25, 0.5))
    none = replace(row, status=Status.CRASHED, score=None, trace=None)

    def standing(*rows: Row) -> tuple[float, float]:
        return compute_standing(build_grid(replace(several, rows=rows)).runs)

    order = [exact, close, cheap, dear, none]
    mixed = [none, dear, close, cheap, exact]
    assert sorted(mixed, key=standing) == order
    narrow = replace(exact, score=replace(sure(exact.score), float_bits=32))
    assert standing(exact) == standing(narrow)
    wrong = replace(row, score=replace(row.score, grade=Grade.WRONG))
    assert standing(row, row, row) < standing(close, wrong, row)


def test_pic_stands_once_in_the_table_of_every_scene(several: Results) -> None:
    """PIC's two profiles say the same of every scene, so there is one column of PIC; an engine keeps all."""
    grid = build_grid(several)
    assert [column.name for column in grid.columns.values()][:2] == ["PIC frame-by-frame", "PIC event-driven"]
    section = build_scenes_section(grid)
    (table,) = (block for block in section.select_for(Media.PAGE) if isinstance(block, Table))
    heads = [column.line for column in table.select_for(Media.PAGE)[0]]
    assert heads == ["scene", "PIC", "PIT", "pymunk default", "pymunk tuned", "pymunk located"]
