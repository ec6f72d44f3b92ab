"""Reports contain no sentence that the numbers of a run do not support.

Each sentence is tested with runs for which it is false.
"""

import dataclasses
import re
from collections.abc import Callable, Sequence
from typing import Any

import pytest
from tests.cases import each, release_after
from tests.in_process_pool import InProcessPool
from tests.scene_builders import disc_at, require_value, run_cross_check, staged, wall_at
from tests.unit.studies.examples import build_campaign_results, build_growth

from carom import Results, Scene, solve_pic
from carom.catalogue import CatalogueScene, find_scenes
from carom.comparator import compare
from carom.report.document import Lines, Text
from carom.report.impact_rows import build_impact_rows
from carom.studies.bench.growth_document import build_growth_document
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.explain import explain
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import build_plan
from carom.studies.cross_check.sections.trend import build_trend_section
from carom.studies.stress.document import build_stress_document
from carom.studies.stress.result import CellEnding, CellResult

#: Nothing happens, PIT and all; and two discs that check for overlap once per step finds late.
NOTHING = staged("nothing", disc_at(0, 0, 1, 0), disc_at(0, 5, 1, 0), duration_s=1.0)
LATE = staged("late", disc_at(-1.0, 0.0, 3.0, 0.2, r=0.3), disc_at(1.0, 0.2, -2.0, 0.0, r=0.3), duration_s=1.0)
FALL: dict[str, Any] = {"gravity_m_s2": (0.0, -9.81), "wall_restitution": 0.0, "duration_s": 2.0}
THUD = staged("thud", disc_at(0, 2), wall_at(0, 0, 0, 1), **FALL)


def run_own_methods(*scenes: Scene, engines: tuple[str, ...] = ("pic", "pit")) -> Results:
    """Return a cross-check of some scenes."""
    return run_cross_check(scenes, engines, profiles=["tuned"], dts=[1 / 60, 1 / 120])


def join_lead(results: Results) -> str:
    return " ".join(cross_check_document(results).lead)


def test_certified_reference_is_reported_as_certified() -> None:
    """Without a known answer PIC is "without independent proof", unless certification proves every impact."""
    three = staged("three", disc_at(0, 0, 4, 0), disc_at(3, 0), disc_at(7, 0.2), duration_s=2.0)
    options: dict[str, Any] = {"profiles": ["tuned"], "dts": [1 / 60]}
    without = run_cross_check([three], ["pit"], certified=False, **options)
    assert "without independent proof" in join_lead(without)
    pytest.importorskip("flint")
    proven = run_cross_check([three], ["pit"], certified=True, **options)
    assert "every impact of PIC is certified in 1 of 1 scene" in join_lead(proven)


def join_trend_text(results: Results) -> str:
    section = build_trend_section(build_grid(results))
    texts = [block.text for block in section.blocks if isinstance(block, Text)]
    return " ".join(texts + [line for block in section.blocks if isinstance(block, Lines) for line in block.items])


def test_trend_without_errors_has_no_medians() -> None:
    """Without velocity errors of PIT the trend has no medians; methods that find no impact get a remark."""
    head_on = staged("head-on", disc_at(0, 0, 4, 0), disc_at(3, 0), duration_s=2.0)
    said = join_trend_text(run_own_methods(head_on))
    assert "PIT's velocities are correct at every step size" in said
    assert "There are no medians" in said
    assert "A method's median omits scenes in which the method finds no impact." in join_trend_text(
        run_own_methods(LATE)
    )


def build_stress_lead(change: Callable[[CellResult], CellEnding]) -> str:
    """Return the sentences of a campaign in which a function determines the result of each cell."""
    found = build_campaign_results()
    cells = {key: dataclasses.replace(result, ending=change(result)) for key, result in found.cells.items()}
    return " ".join(build_stress_document(dataclasses.replace(found, cells=cells)).lead)


def test_method_with_unsupported_tests_is_not_ranked() -> None:
    """A method that can't run every stress test is not ranked last; a sentence names it separately."""
    first = next(line.name for line in build_campaign_results().rows if line.kind == "attack")

    def change(result: CellResult) -> CellEnding:
        left_out = result.method == "pymunk/tuned" and result.kind == "attack" and result.test != first
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


def find_engines_line(scene: Scene) -> str:
    """Return what the plan of a run says that engines do."""
    plan = build_plan([scene], Options(engines=["pit"]), InProcessPool())
    return next(line for line in explain(plan) if line.strip().startswith("engines: "))


def test_explanation_mentions_free_flight_only_after_impacts() -> None:
    """The explanation promises no free flight with gravity or rest; without impacts no discs meet."""
    assert "run for all 120 steps" in find_engines_line(THUD)
    assert "the comparison with PIC ends at 0.553 s, when a disc comes to rest" in find_engines_line(THUD)
    assert "free flight" not in find_engines_line(find_scenes(["gravity/free-fall"])[0].scene)
    assert find_engines_line(NOTHING).endswith("because no discs meet in PIC")
    assert "PIC's last impact at" in find_engines_line(LATE)


MINE = LATE.model_copy(update={"name": "mine"})
#: Its impact falls between two frames of 1/60 s, and that of the other on one.
HEAD_ON = staged("head-on", disc_at(0, 0, 4, 0), disc_at(3.02, 0), duration_s=2.0)
AT_A_FRAME = staged("at-a-frame", disc_at(0, 0, 4, 0), disc_at(3, 0), duration_s=2.0)


def run_one_profile(scenes: Sequence[Scene | CatalogueScene], *engines: str, profile: str = "tuned") -> Results:
    return run_cross_check(scenes, ["pic", *engines], profiles=[profile], dts=[1 / 24])


def join_lead_lines(results: Results) -> str:
    return "\n".join(cross_check_document(results).lead)


WITHOUT_PROOF = "PIC is the reference, without independent proof."
ALL_UNPROVEN = f"None of these scenes has a known answer: {WITHOUT_PROOF}"
UNPROVEN = f"This scene has no known answer: {WITHOUT_PROOF}"
OFF = r"mine at 1/24 s: PIT: velocities are wrong by \S+ % of the greatest speed\."
PROVEN = r"PIC reproduces the one known answer \(largest deviation \S+\)\."
BY_PHASE = r"PIT: its grade depends on the phase of the step; PIT reaches this accuracy at only \d+ of \d+ phases\."


@each(
    "scenes, engines, sentences",
    release_after(
        2,
        [
            ([MINE], ["pit"], [OFF, UNPROVEN]),
            ([HEAD_ON], ["pit"], [r"head-on at 1/24 s: PIT: \S+ ms late\.", UNPROVEN]),
            ([AT_A_FRAME], ["pit"], [r"at-a-frame at 1/24 s: PIT: exact\.", UNPROVEN, BY_PHASE]),
            (find_scenes(["paper/missed"]), ["pit"], [r"paper/missed at 1/24 s: PIT: 1 missed of 1 impact\.", PROVEN]),
            ([MINE, HEAD_ON], ["pit"], [r"PIT misses no impact in 2 scenes\.", ALL_UNPROVEN]),
            ([MINE, HEAD_ON], [], [r"PIC misses no impact in 2 scenes\.", ALL_UNPROVEN]),
        ],
    ),
)
def test_lead_of_cross_check_has_exactly_the_expected_sentences(
    scenes: Sequence[Scene], engines: Sequence[str], sentences: Sequence[str]
) -> None:
    """The lead of a report consists of exactly the expected sentences and a count of runs by grade."""
    said = cross_check_document(run_one_profile(scenes, *engines)).lead
    assert len(said) == len(sentences) + 1
    assert sum(bool(re.match(r"Grades of \d+ \w+ runs? at ", sentence)) for sentence in said) == 1
    assert all(any(re.fullmatch(pattern, sentence) for sentence in said) for pattern in sentences)


def test_lead_names_engine_that_misses_with_default_settings() -> None:
    """The lead states that default pymunk misses an impact in 1 of 2 scenes, and the tuned profile after it."""
    pytest.importorskip("pymunk", reason="pymunk is not installed")
    scenes = find_scenes(["paper/missed", "paper/late"])
    first = "Default settings: pymunk misses an impact in 1 of 2 scenes"
    default = join_lead_lines(run_one_profile(scenes, "pymunk", profile="default"))
    assert default.startswith(f"{first}; pymunk is at least as accurate as PIT in 1 scene.")
    both = run_cross_check(scenes, ["pic", "pymunk"], profiles=["default", "tuned"], dts=[1 / 24])
    assert join_lead_lines(both).startswith(f"{first}. Tuned: pymunk is at least as accurate as PIT in 1 scene.")


def test_lead_states_missing_scores_and_wrong_known_answers() -> None:
    """The lead names a scene whose known answer PIC misses by 1e-3, and reports if nothing was scored."""
    one = run_one_profile(find_scenes(["paper/late"]), "pit")
    known = {name: (answer, 1e-3) for name, (answer, _) in one.known.items()}
    assert "but not paper/late." in join_lead_lines(dataclasses.replace(one, known=known))
    nothing = dataclasses.replace(one, rows=tuple(dataclasses.replace(row, score=None, trace=None) for row in one.rows))
    told = "Nothing was scored, because no requested method ran any of these scenes."
    assert join_lead_lines(nothing).startswith(told)
