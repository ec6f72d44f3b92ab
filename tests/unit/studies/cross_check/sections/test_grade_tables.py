"""Tables of methods: a row per method, with its grades in each group of scenes."""

from dataclasses import replace

import pytest
from tests.scene_builders import require_value, run_cross_check

from carom.catalogue import find_scenes
from carom.comparator import Grade
from carom.execution.job import Status
from carom.execution.results import Results, Row
from carom.report.document import Cell, Lines, Media, Table
from carom.report.outcome_marks import Mark
from carom.studies.cross_check.grid import build_grid, compute_standing
from carom.studies.cross_check.sections.grade_tables import build_impacts_section, build_methods_section


@pytest.fixture(scope="module")
def results() -> Results:
    """The paper's four cases, and two scenes of no group of which one's name begins with the other's."""
    scene = find_scenes(["paper/late"])[0].scene
    own = [scene.model_copy(update={"name": name}) for name in ("mine", "mine-too")]
    return run_cross_check([*find_scenes(["paper"]), *own], ["pic", "pit"], dts=[1 / 24], profiles=["tuned"])


def list_tables(results: Results, medium: Media) -> list[tuple[list[str], list[list[Cell]]]]:
    """Return headings and rows of the first section's tables."""
    section = build_methods_section(build_grid(results))
    found = [block.select_for(medium) for block in section.select_for(medium) if isinstance(block, Table)]
    return [([column.line for column in columns], rows) for columns, rows in found]


def test_group_cell_counts_good_scenes_and_links_to_the_worst(results: Results) -> None:
    """A cell counts a group's good scenes and links to the worst one; PIT's row has its sum of missed impacts."""
    ((heads, rows),) = list_tables(results, Media.PAGE)
    paper, others = rows[0][heads.index("paper 4 scenes")], rows[0][heads.index("others 2 scenes")]
    assert (paper.text, paper.corner) == ("0 of 4", Mark.WRONG.symbol)
    assert paper.title.startswith("an impact is missed in 2 scenes")
    assert paper.link == "#paper/multiple/pit/tuned"
    assert {share.css: share.size for share in paper.shares} == {Mark.SAMPLED.css: 2, Mark.WRONG.css: 2}
    assert (others.text, others.corner) == ("0 of 2", "")  # it finds these late, and misses nothing
    missed = sum(len(row.score.missed) for row in results.rows if row.score and row.job.engine == "pit")
    assert rows[0][heads.index("impacts - +")].text == f"-{missed}"


@pytest.fixture(scope="module")
def results_with_profiles() -> Results:
    """The paper's four cases by PIT and by three profiles of an engine, of which one steps up to the contact."""
    return run_cross_check(find_scenes(["paper"]), ["pic", "pit", "pymunk"], dts=[1 / 24])


def test_terminal_and_report_order_methods_equally(results_with_profiles: Results) -> None:
    """The terminal and the page order methods equally, for several scenes and for one; Markdown does so for several."""
    for scene in ("", "paper/missed", "paper/late", "paper/multiple"):
        rows = tuple(row for row in results_with_profiles.rows if scene in {"", row.job.scene.name})
        chosen = replace(results_with_profiles, rows=rows)
        media = (Media.TERMINAL, Media.PAGE) if scene else (Media.TERMINAL, Media.PAGE, Media.MARKDOWN)
        first, *others = [[row[0].line for row in list_tables(chosen, medium)[0][1]] for medium in media]
        assert all(order == first for order in others)
        assert len(first) == 4
        assert scene or first[0] == "pymunk located"


def test_methods_are_ranked_by_grade_then_error_ratio(results_with_profiles: Results) -> None:
    """Methods are ranked by grade, then by the ratio to PIT's error; a close run makes up for no wrong one."""
    row = next(row for row in results_with_profiles.rows if row.score and row.score.grade is Grade.SAMPLED)
    assert row.score is not None
    exact, close = (replace(row, score=replace(row.score, grade=grade)) for grade in (Grade.EXACT, Grade.CLOSE))
    cheap, dear = (replace(row, score=replace(row.score, price_paid=paid)) for paid in (0.25, 0.5))
    none = replace(row, status=Status.CRASHED, score=None, trace=None)

    def standing(*rows: Row) -> tuple[float, float]:
        return compute_standing(build_grid(replace(results_with_profiles, rows=rows)).runs)

    assert sorted([none, dear, close, cheap, exact], key=standing) == [exact, close, cheap, dear, none]
    narrow = replace(exact, score=replace(require_value(exact.score), float_bits=32))
    assert standing(exact) == standing(narrow)
    wrong = replace(row, score=replace(row.score, grade=Grade.WRONG))
    assert standing(row, row, row) < standing(close, wrong, row)


def test_methods_with_equal_verdicts_share_a_line_on_a_terminal() -> None:
    """Two profiles of an engine that miss the same impact have one line of verdicts, which names both and the step."""
    pytest.importorskip("pymunk", reason="pymunk is not installed")
    missed, profiles = find_scenes(["paper/missed"]), ["default", "tuned"]
    results = run_cross_check(missed, ["pic", "pymunk"], profiles=profiles, dts=[1 / 24, 1 / 12])
    section = build_impacts_section(build_grid(results))
    ((line,),) = [block.items for block in section.select_for(Media.TERMINAL) if isinstance(block, Lines)]
    assert line.startswith("pymunk default and pymunk tuned at 1/12 s: an impact is missed;")
