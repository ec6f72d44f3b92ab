"""What bench, stress and advise say first: one screen for the engines of a default install, true to the numbers."""

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
from tests.cases import each, release_after
from tests.unit.report.test_terminal import print_as_line, print_document
from tests.unit.studies.examples import (
    METHODS,
    build_advice,
    build_bench,
    build_campaign_results,
    build_growth,
)

import carom
from carom.cli.ascii import ERRORS
from carom.execution.job import Method
from carom.report import formatting
from carom.report.document import Document, Media, Table
from carom.studies.advise.document import build_advice_document
from carom.studies.advise.run import Advice, UnsearchedMethod
from carom.studies.advise.step_search import SearchEnding, StepRange
from carom.studies.bench.axes import ErrorKind
from carom.studies.bench.document import build_bench_document
from carom.studies.bench.growth_document import build_growth_document
from carom.studies.bench.result import Curve
from carom.studies.bench.tables import build_method_table, build_suite_table, list_reached_targets
from carom.studies.stress.document import build_stress_document
from carom.studies.stress.result import CellEnding, CellResult, StressRow

DOCUMENTS: dict[str, Callable[[], Document]] = {
    "bench": lambda: build_bench_document(build_bench()),
    "bench of several scenes": lambda: build_bench_document(build_bench("paper/late", "paper/missed")),
    "growth": lambda: build_growth_document(build_growth()),
    "stress": lambda: build_stress_document(build_campaign_results()),
    "advice": lambda: build_advice_document(build_advice()),
}


@pytest.fixture(params=DOCUMENTS, scope="module")
def document(request: pytest.FixtureRequest) -> Document:
    """Each of the documents, of every method of a default install."""
    return DOCUMENTS[request.param]()


def test_terminal_answer_fits_24_lines(document: Document) -> None:
    """At 80 columns each study's answer has at most 24 lines, and every engine has a row."""
    lines = print_document(document, 80)
    assert len(lines) - sum(" passes " in line for line in lines) <= 24, "\n".join(lines)
    rows = METHODS[3:] if document.title == "Carom: advice" else METHODS[2:]  # PIT is no engine to take
    assert all(any(line.startswith(f"{m.label} ") for line in lines) for m in rows)


@each("width, full", release_after(1, [(60, False), (120, True), (200, False), (60, True), (120, False)]))
def test_no_line_is_wider_than_the_terminal(document: Document, width: int, full: bool) -> None:
    """No line is wider than the terminal (60 to 200 columns), and names of methods are not cut."""
    lines = print_document(document, width, full=full)
    assert max(map(len, lines)) <= width
    assert any(line.startswith("pybullet default ") for line in lines)


def test_every_symbol_has_an_ascii_replacement(document: Document) -> None:
    """Every character of the answers has an ASCII replacement that is not a question mark."""
    assert "?" not in "\n".join(print_document(document, 80)).encode("ascii", ERRORS).decode()


@each(
    "target, words",
    [
        (1e-3, "The fastest engine with at most 0.1 % error is box2d (default) with 0.268 ms at steps of 1/67 s"),
        (1e-6, "No engine reaches 1e-6 error at the tested step sizes. The most accurate is box2d (default) with "),
    ],
)
def test_bench_names_fastest_engine_within_target_error(target: float, words: str) -> None:
    """The bench names the fastest engine whose error is at most the target, or else the most accurate one."""
    bench = build_bench()
    assert words in print_as_line(build_bench_document(replace(bench, plan=replace(bench.plan, target=target))))


def test_methods_with_equal_targets_are_ranked_by_run_time() -> None:
    """Among methods that reach the same targets on as many scenes, the faster one is first."""
    several = build_bench("paper/late", "paper/missed")
    scenes = [replace(scene, curves=tuple(reversed(scene.curves))) for scene in several.scenes]  # dearest first
    table = build_suite_table(replace(several, scenes=tuple(scenes)), list_reached_targets(several))
    names = [row[0].text for row in table.select_for(Media.MARKDOWN)[1]]
    assert names.index("pymunk default") < names.index("pymunk tuned")
    assert names.index("box2d default") < names.index("box2d tuned") < names.index("mujoco default")


def test_bench_without_reached_target_names_the_best_engine() -> None:
    """If no target is reached, the table has no column for one, and the text names the engine that misses least."""
    whole = build_bench().scenes[0]
    curves = [
        replace(curve, points=tuple(replace(p, missed=3 - k % 2, spurious=1) for p in curve.points))
        for k, curve in enumerate(whole.curves)
        if curve.engine not in {"pic", "pit"}
    ]
    lossy = replace(build_bench(), scenes=(replace(whole, curves=tuple(curves)),))
    assert list_reached_targets(lossy) == []
    text = print_as_line(build_bench_document(lossy))
    assert "very engine misses or invents impacts at every step size; the best is box2d (default)" in text
    assert "which misses 2 and invents 1 of 4 impacts" in text
    assert " -2 +1 " in text
    crowd = replace(lossy.scenes[0], scene=carom.scene("classics/gas"))
    for scenes, answer in (
        ((whole, crowd), "on paper/late; every engine misses or invents impacts on classics/gas."),
        ((crowd, crowd), "Every engine misses or invents impacts on every scene."),
    ):
        text = print_as_line(build_bench_document(replace(lossy, scenes=scenes)))
        assert answer in text.partition(" Every method on ")[0]


def test_bench_states_why_points_are_not_scored() -> None:
    """The bench states the number of unscored points and the reason, or refers to the page for several reasons."""
    scene = build_bench().scenes[0]
    curves = [replace(c, points=(replace(c.points[0], reason="out of time"), *c.points[1:])) for c in scene.curves]

    def said(*chosen: Curve) -> str:
        return print_as_line(build_bench_document(replace(build_bench(), scenes=(replace(scene, curves=chosen),))))

    all_points = sum(len(curve.points) for curve in curves)
    assert f"{len(curves)} of {all_points} points could not be scored: out of time." in said(*curves)
    curves[0] = replace(curves[0], points=(*curves[0].points[:-1], replace(curves[0].points[-1], reason="crashed")))
    assert f"{len(curves) + 1} of {all_points} points could not be scored; the page lists the reasons." in said(*curves)


def render_advice(found: Advice) -> str:
    """What the terminal says of advice, in one line."""
    return print_as_line(build_advice_document(found))


def test_advice_names_all_methods_with_the_longest_step() -> None:
    """Both answers of the advice name all methods that pass with the longest step."""
    found = build_advice()
    twin = replace(found.answers[0], method=Method("twin", "tuned"))
    text = render_advice(replace(found, answers=(*found.answers, twin)))
    assert text.count("200 steps/s with box2d default or twin tuned.") == 2


def test_advice_has_steps_per_frame_and_engine_code() -> None:
    """A rate is also given in steps per frame, which may differ between the two demands, with code and command."""
    found = build_advice()
    (alone,) = [answer for answer in found.answers if answer.method == Method("pymunk", "tuned")]
    text = render_advice(replace(found, answers=(alone,)))
    assert text.startswith("paper/late: to miss no impact, use 600 steps/s (10 steps per frame at 60 Hz) with pymunk")
    coarse = replace(alone.never_misses, frame_divisor=replace(alone.trials[-1], dt_s=1 / 180))
    fewer = render_advice(replace(found, answers=(replace(alone, never_misses=coarse),)))
    assert "needs 10 steps per frame for a direction error of at most 1° (3 to miss no impact). As code:" in fewer
    finer = replace(alone.never_misses, frame_divisor=alone.trials[-1])
    many = replace(found, answers=(replace(alone, never_misses=finer, meets_target=finer),))
    assert "600 steps/s (40 steps per frame at 60 Hz are enough) with pymunk tuned." in render_advice(many)
    assert "--scene 'my scene.toml'" in print_as_line(build_advice_document(many, "my scene.toml"), 200)


def test_advice_without_failing_step_is_any_tested_step() -> None:
    """If no step fails, the answer is "any tested step"; refused steps and methods are stated with the reason."""
    found = build_advice()
    any_step = replace(found.answers[0].never_misses, smallest_failing=None)
    swept = replace(found.answers[0], never_misses=any_step, meets_target=any_step)
    every = replace(found, answers=(swept,))
    use = "use any tested step size (200 or more steps per second) with box2d default."
    assert render_advice(every).startswith(f"paper/late: to miss no impact, {use}")
    (row,) = list_method_rows(every)
    assert row.count("any tried") == 2
    refused = replace(found, answers=(replace(swept, refused_s=0.5, refusal="too far a step"),))
    assert "any" not in list_method_rows(refused)[0]
    assert "to miss no impact, use 200 steps/s" in render_advice(refused)
    assert list_range_rows(refused)[0].count("refused") == 2
    full = " ".join(print_document(build_advice_document(refused), 200, full=True))
    assert "Not run: box2d default at 2 steps per second (too far a step)." in full
    unable = UnsearchedMethod(Method("box2d", "default"), "the scene has walls")
    assert "Not run: box2d default (the scene has walls)." in render_advice(replace(found, unable=(unable,)))


def test_located_methods_are_last_and_not_recommended() -> None:
    """A located method is in the last row, without code, and is recommended only if there is no other method."""
    found = build_advice()
    first, *_, last = found.answers
    cut = replace(found, located=frozenset({first.method}))
    assert "200 steps" not in render_advice(cut)
    assert [row.split()[:2] for row in list_method_rows(cut)][-1] == ["box2d", "default"]
    alone = render_advice(replace(cut, answers=(first,)))
    assert "200 steps/s with box2d default" in alone
    assert "--show" not in alone
    assert "pymunk tuned" in render_advice(replace(found, answers=(last,)))


def test_advice_table_shows_result_at_one_step_per_frame() -> None:
    """The last column of the advice's table shows a method's result with one step per frame."""
    found = build_advice()
    one, frame_s = found.answers[0], 1 / found.scene.frame_rate_hz
    trial = replace(one.trials[-1], dt_s=frame_s)
    for at_frame, refused_s, ends in (
        (replace(trial, lost_phases=3), None, f"fails at 3 of {trial.phases}"),
        (trial, None, "found, 0.244° error"),
        (replace(trial, reason="crashed"), None, "stopped"),
        (None, frame_s, "refused"),
        (None, 2 * frame_s, "n/a"),
    ):
        trials = one.trials if at_frame is None else (*one.trials, at_frame)
        (row,) = list_method_rows(replace(found, answers=(replace(one, trials=trials, refused_s=refused_s),)))
        assert row.endswith(ends)


def test_advice_states_unfinished_searches_and_non_monotone_results() -> None:
    """A search ended by its budget, a non-monotone result and a demand that no step meets are stated as such."""
    found = build_advice()
    one = found.answers[0]
    stopped = replace(one, ending=SearchEnding.BUDGET)
    assert "For box2d default, the search stopped at its budget of 400000 engine steps" in render_advice(
        replace(found, answers=(stopped,))
    )
    coarse, fails = one.trials[0], one.trials[1]
    holed = replace(one.never_misses, coarser_passes=(coarse,), finer_failures=(fails,))
    text = render_advice(replace(found, answers=(replace(one, never_misses=holed, meets_target=holed),)))
    rates = [formatting.format_number(1 / trial.dt_s, 4) for trial in (coarse, fails)]
    passing = f"box2d default misses no impact at {rates[0]} steps per second, but fails at {rates[1]}."
    assert f"Smaller steps are not always better: {passing}" in text
    assert text.count("Smaller steps are not always better") == 1
    (row,) = list_method_rows(
        replace(found, answers=(replace(one, meets_target=replace(one.meets_target, largest_passing=None)),))
    )
    assert row.split()[3:] == ["unfinished", "n/a"]
    finest = one.trials[-1]
    nothing = replace(
        one,
        meets_target=replace(
            one.meets_target, largest_passing=None, smallest_failing=finest, smallest_tested_s=finest.dt_s
        ),
    )
    unmet = replace(found, answers=(nothing,))
    assert "For a direction error of at most 1°, no tested step size of any engine suffices." in render_advice(unmet)
    (row,) = list_range_rows(unmet)
    assert row.split()[4:6] == ["none", formatting.format_number(1 / finest.dt_s, 4)]
    untried = StepRange(None, None, math.nan, None, (), ())
    (row,) = list_method_rows(
        replace(found, answers=(replace(one, trials=(), never_misses=untried, meets_target=untried),))
    )
    assert row.split()[2:] == ["n/a"] * 3


def list_method_rows(found: Advice) -> list[str]:
    """The lines of the table that are about a method."""
    names = {f"{answer.method.engine} {answer.method.profile} " for answer in found.answers}
    table = [line for line in print_document(build_advice_document(found), 120) if any(map(line.startswith, names))]
    return [line.rstrip() for line in table if "per frame" not in line]


def list_range_rows(found: Advice) -> list[str]:
    """The lines of the table of ranges, which is printed in full alone."""
    lines = print_document(build_advice_document(found), 200, full=True)
    heading = "Steps per second that pass, from the largest step size to the smallest tested one:"
    return lines[lines.index(heading) + 4 :][: len(found.answers)]


def test_campaign_of_few_methods_has_a_sentence_per_method() -> None:
    """Each of two methods gets a sentence with its first failure, and a failed test a digit for the passed part."""
    whole = build_campaign_results()
    few = replace(whole, methods=(METHODS[1], METHODS[2]))
    lines = print_document(build_stress_document(few), 160)
    tests = sum(line.kind == "attack" for line in whole.rows)
    assert lines[0].rstrip() == f"pic (event-driven) passes {tests} of {tests}."
    assert sum(line.startswith(f"pit passes 0 of {tests}; it first fails in ") for line in lines) == 1
    stood = StressRow("attack", "gap", "a gap", "", "", (1.0, 0.1, 0.01, 1e-3, 1e-4), group="pairs")
    result = CellResult("attack", "gap", "pit/tuned", CellEnding.FAILS_AT_SIZE, 1e-3, passes_until=1e-2)
    gap = replace(few, rows=(stood,), methods=(METHODS[2],), cells={("gap", "pit/tuned"): result})
    told = print_document(build_stress_document(gap), 80)
    assert told[0].rstrip() == "pit passes 0 of 1; it first fails in gap at 0.001 (a gap)."
    assert any(line.split() == ["pit", "5"] for line in told)


def test_campaign_links_lead_to_rows_with_evidence() -> None:
    """Each link of a campaign's tables leads to a row, for example with the command that reruns PIT's grazing."""
    sections = list(build_stress_document(build_campaign_results()).select_for(Media.PAGE))
    tables = [block for section in sections for block in section.select_for(Media.PAGE) if isinstance(block, Table)]
    rows = [row for table in tables for row in table.select_for(Media.PAGE)[1]]
    cells = [cell for row in rows for cell in row]
    links = {cell.link for cell in cells if cell.link.startswith("#")}
    assert links == {f"#{cell.anchor}" for cell in cells if cell.anchor}
    row = next(row for row in rows if row[0].anchor == "grazing/pit/tuned")
    assert row[-1].text == "carom run scenes/grazing-pit-tuned.toml -e pit -p tuned"


def test_unscored_step_does_not_count_as_missing_impacts() -> None:
    """If only one of six steps was scored, and it finds all impacts, the table shows "1 of 1"."""
    whole = build_bench().scenes[0]
    curve = whole.curves[0]
    unscored = tuple(replace(point, reason="beyond the budget") for point in curve.points[1:])
    short = replace(curve, points=(curve.points[0], *unscored))
    table = build_method_table(replace(whole, curves=(short,)), ErrorKind.IMPACT, (1e-3, 0.0))
    columns, (line,) = table.select_for(Media.MARKDOWN)
    assert line[[column.head for column in columns].index("step sizes that find all")].text == "1 of 1"
