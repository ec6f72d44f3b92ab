"""Summaries of studies: they fit a terminal, and the results support every sentence."""

import dataclasses
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import pytest
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, run_cross_check, staged
from tests.unit.report.test_terminal import print_as_line, print_document
from tests.unit.studies.examples import (
    METHODS,
    build_advice,
    build_bench,
    build_campaign_results,
    build_growth,
)

import carom
from carom import Results, Scene, solve_pic
from carom.catalogue import CatalogueScene, find_scenes
from carom.cli.ascii import ERRORS
from carom.comparator import compare
from carom.execution.job import Method
from carom.report.document import Document
from carom.report.impact_rows import build_impact_rows
from carom.studies.advise.document import build_advice_document
from carom.studies.advise.run import Advice
from carom.studies.advise.step_search import SearchEnding, StepRange
from carom.studies.bench.document import build_bench_document
from carom.studies.bench.growth_document import build_growth_document
from carom.studies.bench.result import Curve
from carom.studies.bench.tables import list_reached_targets
from carom.studies.cross_check.document import cross_check_document
from carom.studies.stress.document import build_stress_document
from carom.studies.stress.result import CellEnding, CellResult, StressRow
from carom.support import formatting

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
    """No line is wider than the terminal, names are not cut, and symbols of answers have ASCII replacements."""
    lines = print_document(document, width, full=full)
    assert max(map(len, lines)) <= width
    assert any(line.startswith("pybullet default ") for line in lines)
    assert "?" not in "\n".join(lines).encode("ascii", ERRORS).decode()


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
    """The bench counts unscored points and states their reason, if there is one; they do not count as misses."""
    scene = build_bench().scenes[0]
    curves = [replace(c, points=(replace(c.points[0], reason="out of time"), *c.points[1:])) for c in scene.curves]

    def said(*chosen: Curve) -> str:
        bench = replace(build_bench(), scenes=(replace(scene, curves=chosen),))
        return print_as_line(build_bench_document(bench), full=True)

    all_points = sum(len(curve.points) for curve in curves)
    assert f"{len(curves)} of {all_points} points could not be scored: out of time." in said(*curves)
    assert "pit 1.00 5 of 5" in said(*curves)
    curves[0] = replace(curves[0], points=(*curves[0].points[:-1], replace(curves[0].points[-1], reason="crashed")))
    assert f"{len(curves) + 1} of {all_points} points could not be scored; the page lists the reasons." in said(*curves)


def render_advice(found: Advice) -> str:
    """Return the advice as a terminal shows it, in one line."""
    return print_as_line(build_advice_document(found))


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
    full = " ".join(print_document(build_advice_document(refused), 200, full=True))
    assert "Not run: box2d default at 2 steps per second (too far a step)." in full
    unable = {Method("box2d", "default"): "the scene has walls"}
    assert "Not run: box2d default (the scene has walls)." in render_advice(replace(found, unable=unable))


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
    failing = replace(one.meets_target, largest_passing=None, smallest_failing=finest)
    unmet = replace(found, answers=(replace(one, meets_target=failing),))
    assert "For a direction error of at most 1°, no tested step size of any engine suffices." in render_advice(unmet)
    assert list_method_rows(unmet)[0].split()[3:] == ["none", "n/a"]
    untried = StepRange(None, None, None, (), ())
    (row,) = list_method_rows(
        replace(found, answers=(replace(one, trials=(), never_misses=untried, meets_target=untried),))
    )
    assert row.split()[2:] == ["n/a"] * 3


def list_method_rows(found: Advice) -> list[str]:
    """The lines of the table that are about a method."""
    names = {f"{answer.method.engine} {answer.method.profile} " for answer in found.answers}
    table = [line for line in print_document(build_advice_document(found), 120) if any(map(line.startswith, names))]
    return [line.rstrip() for line in table if "per frame" not in line]


def test_campaign_of_few_methods_has_a_sentence_per_method() -> None:
    """Each of two methods gets a sentence with its first failure, and a failed test a digit for the passed part."""
    whole = build_campaign_results()
    few = replace(whole, methods=(METHODS[1], METHODS[2]))
    lines = print_document(build_stress_document(few), 160)
    tests = sum(line.kind == "attack" for line in whole.rows)
    assert lines[0].rstrip() == f"pic (event-driven) passes {tests} of {tests}."
    assert sum(line.startswith(f"pit passes 0 of {tests}; it first fails in ") for line in lines) == 1
    stood = StressRow("attack", "gap", "a gap", "", "", (1.0, 0.1, 0.01, 1e-3, 1e-4, 0.0), group="pairs")
    result = CellResult(CellEnding.FAILS_AT_SIZE, 1e-3, passes_until=1e-2)
    gap = replace(few, rows=(stood,), methods=(METHODS[2],), cells={("gap", "pit/tuned"): result})
    told = print_document(build_stress_document(gap), 80)
    assert told[0].rstrip() == "pit passes 0 of 1; it first fails in gap at 0.001 (a gap)."
    assert any(line.split() == ["pit", "4"] for line in told)


LATE = staged("late", disc_at(-1.0, 0.0, 3.0, 0.2, r=0.3), disc_at(1.0, 0.2, -2.0, 0.0, r=0.3), duration_s=1.0)


def run_own_methods(*scenes: Scene, engines: tuple[str, ...] = ("pic", "pit")) -> Results:
    """Return a cross-check of some scenes."""
    return run_cross_check(scenes, engines, profiles=["tuned"], dts=[1 / 60, 1 / 120])


def join_lead(results: Results) -> str:
    return "\n".join(cross_check_document(results).lead)


def test_certified_reference_is_reported_as_certified() -> None:
    """Without a known answer PIC is "without independent proof", unless certification proves every impact."""
    three = staged("three", disc_at(0, 0, 4, 0), disc_at(3, 0), disc_at(7, 0.2), duration_s=2.0)
    options: dict[str, Any] = {"profiles": ["tuned"], "dts": [1 / 60]}
    without = run_cross_check([three], ["pit"], certified=False, **options)
    assert "without independent proof" in join_lead(without)
    pytest.importorskip("flint")
    proven = run_cross_check([three], ["pit"], certified=True, **options)
    assert "every impact of PIC is certified in 1 of 1 scene" in join_lead(proven)


def build_stress_lead(change: Callable[[str, str, CellResult], CellEnding]) -> str:
    """Return the sentences of a campaign in which a function determines the result of each cell."""
    found = build_campaign_results()
    cells = {key: dataclasses.replace(result, ending=change(*key, result)) for key, result in found.cells.items()}
    return " ".join(build_stress_document(dataclasses.replace(found, cells=cells)).lead)


def test_method_with_unsupported_tests_is_not_ranked() -> None:
    """A method that can't run every stress test is not ranked last; a sentence names it separately."""
    _, *others = (line.name for line in build_campaign_results().rows if line.kind == "attack")

    def change(test: str, method: str, result: CellResult) -> CellEnding:
        left_out = method == "pymunk/tuned" and test in others
        return CellEnding.NOT_RUN if left_out else result.ending

    said = build_stress_lead(change)
    told = "1 method is not ranked, because not every stress test could be run: pymunk (tuned) passed 0 of the 1"
    assert f"{told} that it could run." in said
    assert "; pymunk (tuned) passed" not in said


def test_growth_of_single_method_has_no_ranking() -> None:
    """The growth of a single method is reported without a fastest engine."""
    whole = build_growth()
    alone = dataclasses.replace(whole, curves=whole.curves[:1])
    said = "For a simulated second of 10000 discs, PIC takes 0.1 s (grows as n^1.00)."
    assert build_growth_document(alone).lead == (said,)


@each("known", [True, False])
def test_impact_reported_twice_is_not_attributed_to_errors(known: bool) -> None:
    """An impact that is reported twice comes from the run's own state, or is unknown, never from errors."""
    reference = solve_pic(LATE)
    row = next(row for row in run_own_methods(LATE).rows if row.job.engine == "pit")
    trace = require_value(row.trace)
    again = [0, 0]
    states = require_value(trace.state_before)[again].copy()
    if not known:
        states["position_first"] = states["position_second"] = float("nan")
    effective_s = require_value(trace.effective_time_s)[again]
    changes: dict[str, Any] = {"impacts": trace.impacts[again], "state_before": states, "effective_time_s": effective_s}
    doubled = dataclasses.replace(trace, **changes)
    rows = build_impact_rows(reference, doubled, compare(reference, doubled))
    (cause,) = (row["cause"] for row in rows if row["flag"] == "invented")
    assert "errors before" not in cause
    assert cause.endswith("the bodies do collide" if known else "not known")


def run_one_profile(scenes: Sequence[Scene | CatalogueScene], *engines: str, profile: str = "tuned") -> Results:
    return run_cross_check(scenes, ["pic", *engines], profiles=[profile], dts=[1 / 24])


def test_lead_states_that_a_grade_depends_on_the_phase() -> None:
    """If PIT has a frame at the instant of the impact, the lead states that other phases are less accurate."""
    at_a_frame = staged("at-a-frame", disc_at(0, 0, 4, 0), disc_at(3, 0), duration_s=2.0)
    said = join_lead(run_one_profile([at_a_frame], "pit"))
    assert said.startswith("at-a-frame at 1/24 s: PIT: exact.\n")
    phases = r"PIT: its grade depends on the phase of the step; PIT reaches this accuracy at only \d+ of \d+ phases\."
    assert re.search(phases, said)


def test_lead_names_engine_that_misses_with_default_settings() -> None:
    """The lead states that default pymunk misses an impact in 1 of 2 scenes, and the tuned profile after it."""
    pytest.importorskip("pymunk", reason="pymunk is not installed")
    scenes = find_scenes(["paper/missed", "paper/late"])
    first = "Default settings: pymunk misses an impact in 1 of 2 scenes"
    default = join_lead(run_one_profile(scenes, "pymunk", profile="default"))
    assert default.startswith(f"{first}; pymunk is at least as accurate as PIT in 1 scene.")
    both = run_cross_check(scenes, ["pic", "pymunk"], profiles=["default", "tuned"], dts=[1 / 24])
    assert join_lead(both).startswith(f"{first}. Tuned: pymunk is at least as accurate as PIT in 1 scene.")


def test_lead_states_missing_scores_and_wrong_known_answers() -> None:
    """The lead names a scene whose known answer PIC misses by 1e-3, and reports if nothing was scored."""
    one = run_one_profile(find_scenes(["paper/late"]), "pit")
    known = {name: (answer, 1e-3) for name, (answer, _) in one.known.items()}
    assert "but not paper/late." in join_lead(dataclasses.replace(one, known=known))
    nothing = dataclasses.replace(one, rows=tuple(dataclasses.replace(row, score=None, trace=None) for row in one.rows))
    told = "Nothing was scored, because no requested method ran any of these scenes."
    assert join_lead(nothing).startswith(told)
