"""No doctored run is graded better than it is, or worse: to the end, in crowds, at rest, reported or not."""

import dataclasses
from functools import lru_cache

import pytest
from tests.cases import each, long_until, release_after
from tests.planted.altered_run_cases import (
    CROWD,
    FALLS,
    FROM_REST,
    LONG,
    ROUGH,
    ROUGH_GAS,
    STEPS,
    Rung,
    build_passing_run,
)
from tests.planted.altered_runs import (
    GAS,
    GAS_AFTER_S,
    GAS_BEFORE_S,
    GAS_HORIZON_S,
    Run,
    record_pic,
    remove_impacts,
    score_run,
)

from carom import Scene
from carom.comparator import Grade, Score, Verdict

#: From best to worst.
WORSENING = [Grade.EXACT, Grade.CLOSE, Grade.SAMPLED, Grade.INACCURATE, Grade.DIVERGED]
WORSENING += [Grade.DIVERGED_INACCURATE, Grade.WRONG]

#: That bodies pass through each other is said by whichever is found: the impact missed, or their states.
PASSES = {Verdict.PASSED_THROUGH, Verdict.MISSED, Verdict.MULTIPLE_MISSED}

SCENES = {scene.name: scene for scene in (GAS, ROUGH_GAS)}
BEGINS = {"before": GAS_BEFORE_S, "after": GAS_AFTER_S}
FAULTS = {(scene.name, fault.name): fault for scene, faults in ((GAS, CROWD), (ROUGH_GAS, ROUGH)) for fault in faults}
ALONE = {fault.name: fault for fault in (*FALLS, *FROM_REST, *LONG)}


@lru_cache(maxsize=8)
def load_exact_run(scene: Scene) -> Run:
    """Return PIC's run; each fault is planted in it."""
    return record_pic(scene)


#: Verdicts of which a wrong run has at least one, and verdicts that an exact one may have.
OF_WRONG = PASSES | {
    Verdict.SPURIOUS,
    Verdict.WRONG_ORDER,
    Verdict.CUT_SHORT,
    Verdict.WENT_ON,
    Verdict.NOT_FINITE,
    Verdict.TURNED_ALONE,
    Verdict.MISREPORTED,
}
#: What makes a run wrong whose trajectory has left the reference's before.
WRONG_LATER = {Verdict.PASSED_THROUGH, Verdict.TURNED_ALONE, Verdict.MISREPORTED, Verdict.CUT_SHORT}
OF_EXACT = {Verdict.CONFORMS, Verdict.RESTED}


def assert_grade(score: Score, best: Grade, worst: Grade, says: Verdict | None, why: str) -> None:
    """Require a grade between two, and a verdict."""
    said = "; ".join(f"{finding.verdict.name} ({finding.reason})" for finding in score.findings)
    found = f"{score.grade.name}: {said}. By hand: {why}"
    if Grade.UNGRADED in (best, score.grade):
        assert score.grade is best, found
    else:
        rank = WORSENING.index(score.grade)
        assert rank >= WORSENING.index(best), f"better than it is: {found}"
        assert rank <= WORSENING.index(worst), f"worse than it is: {found}"
    meant = PASSES if says in PASSES else {says}
    verdicts = set(score.verdicts)
    assert says is None or meant & verdicts, found
    # What is said of a run is what its grade rests on.
    assert (Verdict.CONFORMS in verdicts) == (score.grade is Grade.EXACT), found
    assert score.grade is not Grade.EXACT or verdicts <= OF_EXACT, found
    assert score.grade is not Grade.WRONG or verdicts & OF_WRONG, found
    diverged = score.grade in {Grade.DIVERGED, Grade.DIVERGED_INACCURATE}
    assert Verdict.DIVERGED in verdicts or not diverged, found
    assert Verdict.DIVERGED not in verdicts or diverged or (score.grade is Grade.WRONG and verdicts & WRONG_LATER), (
        found
    )
    assert Verdict.WORSE_STEPS not in verdicts or WORSENING.index(score.grade) >= WORSENING.index(Grade.INACCURATE), (
        found
    )


def worst_allowed_grade(rung: Rung, begins: str) -> Grade:
    """Return the worst that may be said: begun before the horizon, a fault may lead to another path."""
    may = Grade.DIVERGED_INACCURATE if begins == "before" and rung.size else rung.worst
    return max(rung.worst, may, key=WORSENING.index)


@each("begins, told", release_after(1, [("after", False), ("before", False), ("after", True), ("before", True)]))
@each(
    "where, rung",
    [
        pytest.param(where, rung, marks=[pytest.mark.release] * (k % 3 > 0 or rung is not fault.rungs[-1]))
        for k, (where, fault) in enumerate(FAULTS.items())
        for rung in fault.rungs
    ],
)
def test_fault_in_a_gas_has_its_listed_grade(where: tuple[str, str], rung: Rung, begins: str, told: bool) -> None:
    """A fault in a gas gets a grade between the listed best and worst one, and the listed verdict."""
    # It starts before or after the horizon, with velocities reported or not.
    run = FAULTS[where].plant(load_exact_run(SCENES[where[0]]), BEGINS[begins], rung.size)
    score = score_run(dataclasses.replace(run, told=told), horizon_s=GAS_HORIZON_S)
    assert_grade(score, rung.best, worst_allowed_grade(rung, begins), rung.says, FAULTS[where].why)


@each("told", release_after(1, [False, True]))
@each(
    "name, rung",
    [
        pytest.param(name, rung, marks=[pytest.mark.release] * (rung is not fault.rungs[-1]))
        for name, fault in ALONE.items()
        for rung in fault.rungs
    ],
)
def test_fault_of_one_or_two_discs_has_its_listed_grade(name: str, rung: Rung, told: bool) -> None:
    """A fault at rest, before it, or in a long contact gets a grade in the listed range, and the verdict."""
    says = rung.says if not told or rung.says is not Verdict.LATE else None  # if reported, it names the right instant
    score = score_run(dataclasses.replace(ALONE[name].plant(rung.size), told=told))
    assert_grade(score, rung.best, rung.worst, says, ALONE[name].why)


@each("begins", long_until(1, reversed(BEGINS)))
def test_reported_impacts_do_not_hide_passing_discs(begins: str) -> None:
    """A run whose discs pass through each other is wrong, even if it reports every impact."""
    passes = remove_impacts(load_exact_run(GAS), BEGINS[begins])
    claims = dataclasses.replace(passes, impacts=load_exact_run(GAS).impacts, told=True)
    score = score_run(claims, horizon_s=GAS_HORIZON_S)
    assert_grade(score, Grade.WRONG, Grade.WRONG, Verdict.PASSED_THROUGH, "its states decide")


@each("phase", release_after(1, [0.25, 0.0]))
@each("aside_m", [0.0, 0.3])
@each("steps", [*STEPS[1::3], *release_after(0, STEPS[1:])])
def test_a_pass_beyond_the_horizon_is_found_in_the_states(steps: int, aside_m: float, phase: float) -> None:
    """Two discs that pass through each other in two steps or more, beyond the horizon, are graded wrong."""
    score = score_run(build_passing_run(steps, aside_m, phase), horizon_s=0.1)
    assert_grade(score, Grade.WRONG, Grade.WRONG, Verdict.PASSED_THROUGH, "no velocity changes, on either side")
