"""What bench, stress and advise say first: one screen for the engines of a default install, true to the numbers."""

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
from tests.cases import each, release_after
from tests.unit.report.test_terminal import print_as_line, print_document
from tests.unit.studies.examples import (
    METHODS,
    STEPS,
    build_advice,
    build_bench,
    build_campaign_results,
    build_growth,
    build_point,
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


def test_bench_names_fastest_engine_within_target_error() -> None:
    """The bench names the fastest engine with at most 0.1 % error, or else the most accurate one."""
    points = [build_point(method, step) for method in METHODS[3:] for step in range(len(STEPS))]
    below = [point for point in points if point.error <= 1e-3 and point.is_correct]
    best = min(below, key=lambda p: p.timing.advance_s.median if p.timing else 0.0)
    spent = formatting.format_number(best.timing.advance_s.median * 1e3, 3) if best.timing else ""
    asked = replace(build_bench(), plan=replace(build_bench().plan, target=1e-3))
    text = print_as_line(build_bench_document(asked))
    assert text.startswith("paper/late: PIC takes 0.002 ms. The fastest engine with at most 0.1 % error is ")
    assert f"is {best.engine} ({best.profile}) with {spent} ms at steps of {formatting.format_step(best.dt_s)}" in text
    beyond = print_as_line(build_bench_document(replace(asked, plan=replace(asked.plan, target=1e-6))))
    assert "No engine reaches 1e-6 error at the tested step sizes. The most accurate is box2d (default) with " in beyond


def test_methods_with_equal_targets_are_ranked_by_run_time() -> None:
    """Among methods that reach the same targets on as many scenes, the faster one is first."""
    several = build_bench("paper/late", "paper/missed")
    scenes = [replace(scene, curves=tuple(reversed(scene.curves))) for scene in several.scenes]  # dearest first
    table = build_suite_table(replace(several, scenes=tuple(scenes)), list_reached_targets(several))
    names = [row[0].text for row in table.select_for(Media.MARKDOWN)[1]]
    assert names.index("pymunk default") < names.index("pymunk tuned")
    assert names.index("box2d default") < names.index("box2d tuned") < names.index("mujoco default")


def test_bench_table_has_only_reached_targets() -> None:
    """The table has a column only for reached targets; if none is reached, the text names the best engine."""
    whole = build_bench().scenes[0]
    table = build_method_table(whole, ErrorKind.IMPACT, list_reached_targets(build_bench()))
    columns, rows = table.select_for(Media.MARKDOWN)
    assert [column.head for column in columns][4:9] == ["10 %", "1 %", "0.1 %", "0.01 %", "exact"]
    assert all(any(row[k].text for row in rows) for k in range(4, 9))
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
    """Both answers of the advice name the rate of the longest step and all methods that pass with it."""
    found = build_advice()
    passing = [(a.meets_target.largest_passing.dt_s, a.method) for a in found.answers if a.meets_target.largest_passing]
    longest = max(dt_s for dt_s, _ in passing)
    twin = replace(found.answers[0], method=Method("twin", "tuned"))
    for answers, who in (
        (found.answers, [f"{m.engine} {m.profile}" for dt_s, m in passing if dt_s == longest]),
        ((*found.answers, twin), ["box2d default", "twin tuned"]),
    ):
        text = render_advice(replace(found, answers=answers))
        named = f"{formatting.format_number(1 / longest, 4)} steps/s with {formatting.join_words(who, 'or')}."
        assert text.count(named) == 2


def test_advice_has_steps_per_frame_and_engine_code() -> None:
    """600 steps/s at 60 Hz are also 10 steps per frame, with the engine's code and a command."""
    found = build_advice()
    (alone,) = [answer for answer in found.answers if answer.method == Method("pymunk", "tuned")]
    text = render_advice(replace(found, answers=(alone,)))
    begin = "paper/late: to miss no impact, use 600 steps/s (10 steps per frame at 60 Hz) with pymunk tuned."
    assert text.startswith(begin)
    assert "at most 1°. As code: dt, steps = 0.01, 2 for _ in range(steps): space.step(dt) To print" in text
    assert "carom engines pymunk --show tuned --dt 1/600 --scene paper/late" in text
    coarse = replace(alone.never_misses, frame_divisor=replace(alone.trials[-1], dt_s=1 / 180))
    fewer = render_advice(replace(found, answers=(replace(alone, never_misses=coarse),)))
    assert "needs 10 steps per frame for a direction error of at most 1° (3 to miss no impact). As code:" in fewer
    finer = replace(alone.never_misses, frame_divisor=alone.trials[-1])
    many = replace(found, answers=(replace(alone, never_misses=finer, meets_target=finer),))
    assert "600 steps/s (40 steps per frame at 60 Hz are enough) with pymunk tuned." in render_advice(many)
    assert "--scene 'my scene.toml'" in print_as_line(build_advice_document(many, "my scene.toml"), 200)


def test_advice_without_failing_step_is_any_tested_step() -> None:
    """If no step fails, the answer is "any tested step"; if larger steps are refused, it is a rate."""
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
    full = " ".join(print_document(build_advice_document(refused), 200, full=True))
    assert "Not run: box2d default at 2 steps per second (too far a step)." in full


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


def test_advice_table_marks_ccd_and_result_at_one_step_per_frame() -> None:
    """A method with CCD is marked, and the last column shows its result with one step per frame."""
    found = build_advice()
    assert [row.startswith("box2d tuned +CCD ") for row in list_method_rows(found)].count(True) == 1
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


def test_advice_claims_no_bounds_and_has_no_rows_for_pic_and_pit() -> None:
    """The advice claims no bounds, has no rows of PIC and PIT, and lists refused steps and methods as such."""
    found = build_advice()
    text = render_advice(found)
    assert "at least" not in text
    assert "at most" not in text.replace("at most 1°", "")
    lines = print_document(build_advice_document(found), 80)
    assert not any(line.startswith(("pic ", "pit ")) for line in lines)
    assert "PIT (one check per step) needs 6.757 steps/s to miss none, 181.8 steps/s for 1°." in text
    one = found.answers[0]
    never = replace(one.never_misses, smallest_failing=None)
    refused = replace(one, never_misses=never, meets_target=never, refused_s=0.5, refusal="too far a step")
    (row,) = list_range_rows(replace(found, answers=(refused,)))
    assert row.count("refused") == 2
    unable = UnsearchedMethod(Method("box2d", "default"), "the scene has walls")
    assert "Not run: box2d default (the scene has walls)." in render_advice(replace(found, unable=(unable,)))


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


@each(
    "ending, passes_until, depth",
    [
        (CellEnding.PASSES, 1e-4, 1.0),
        (CellEnding.FAILS_AT_START, None, 0.0),
        (CellEnding.FAILS_AT_SIZE, 1.0, 0.0),
        (CellEnding.FAILS_AT_SIZE, 0.01, 0.4),
        (CellEnding.FAILS_AT_SIZE, 1e-4, 0.8),
        (CellEnding.NOT_RUN, None, None),
    ],
)
def test_bar_length_is_proportional_to_passed_decades(
    ending: CellEnding, passes_until: float | None, depth: float | None
) -> None:
    """On an axis of four decades and a final 0, each passed decade is a fifth of the bar."""
    line = StressRow("attack", "gap", "a gap", "", "", (1.0, 0.1, 0.01, 1e-3, 1e-4, 0.0))
    found = line.compute_depth(CellResult("attack", "gap", "pit/tuned", ending, passes_until=passes_until))
    assert found == (None if depth is None else pytest.approx(depth))


def test_campaign_of_few_methods_has_summary_and_sign_per_test() -> None:
    """Each of two methods gets a sentence with its first failure, and a row with a sign per test."""
    whole = build_campaign_results()
    few = replace(whole, methods=(METHODS[1], METHODS[2]))
    lines = print_document(build_stress_document(few), 160)
    tests = sum(line.kind == "attack" for line in whole.rows)
    assert lines[0].rstrip() == f"pic (event-driven) passes {tests} of {tests}."
    (pit,) = [line for line in lines if line.startswith(f"pit passes 0 of {tests}; it first fails in ")]
    assert pit.rstrip().endswith(").")
    (row,) = [line.split() for line in lines if line.startswith("pic event-driven ")]
    assert "".join(row[2:]) == "=" * tests
    stood = StressRow("attack", "gap", "a gap", "", "", (1.0, 0.1, 0.01, 1e-3, 1e-4), group="pairs")
    result = CellResult("attack", "gap", "pit/tuned", CellEnding.FAILS_AT_SIZE, 1e-3, passes_until=1e-2)
    gap = replace(few, rows=(stood,), methods=(METHODS[2],), cells={("gap", "pit/tuned"): result})
    told = print_document(build_stress_document(gap), 80)
    assert told[0].rstrip() == "pit passes 0 of 1; it first fails in gap at 0.001 (a gap)."
    assert any(line.split() == ["pit", "5"] for line in told)


def test_campaign_has_one_sentence_and_one_row_per_method() -> None:
    """At 80 columns each method gets one row and one sentence, which names the first failure, if any."""
    whole = build_campaign_results()
    lines = print_document(build_stress_document(whole), 80)
    tests = sum(line.kind == "attack" for line in whole.rows)
    for method in whole.methods:
        (sentence,) = [line for line in lines if line.startswith(f"{method.phrase} passes ")]
        assert ("it first fails in " in sentence) == (f"passes {tests} of {tests}" not in sentence)
        assert sum(line.startswith(f"{method.label} ") and " passes " not in line for line in lines) == 1


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
