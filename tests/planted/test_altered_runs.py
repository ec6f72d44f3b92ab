"""No doctored run is graded better than it is, or worse: to the end, in crowds, at rest, reported or not."""

import dataclasses
import itertools
from functools import cache, lru_cache

import numpy as np
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
    Alone,
    Fault,
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
    record_pit,
    remove_impacts,
    round_to_32_bits,
    score_run,
)

from carom import Scene
from carom.catalogue.find_scenes import all_scenes
from carom.comparator import Grade, Score, Verdict

#: From best to worst.
WORSENING = [Grade.EXACT, Grade.CLOSE, Grade.SAMPLED, Grade.INACCURATE, Grade.DIVERGED]
WORSENING += [Grade.DIVERGED_INACCURATE, Grade.WRONG]

#: In 32-bit floats, whose last place is 5e-7 m at 8 m, faults below this, in the units of each, may go unseen.
SEEN_32 = 1e-3

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


@cache
def score_gas_fault(where: tuple[str, str], size: float, *, begins: str, told: bool, bits: int) -> Score:
    """Return what is said of a fault of this size in a crowd, where the reference is believed to `GAS_HORIZON_S`."""
    run = FAULTS[where].plant(load_exact_run(SCENES[where[0]]), BEGINS[begins], size)
    run = dataclasses.replace(run, told=told)
    return score_run(run if bits == 64 else round_to_32_bits(run), horizon_s=GAS_HORIZON_S)


@cache
def score_small_fault(name: str, size: float, *, told: bool) -> Score:
    """Return what is said of a fault of this size of a disc or two."""
    return score_run(dataclasses.replace(ALONE[name].plant(size), told=told))


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
    assert_verdicts_fit_grade(score, found)
    meant = PASSES if says in PASSES else {says}
    assert says is None or meant & set(score.verdicts), found


def assert_verdicts_fit_grade(score: Score, found: str) -> None:
    """Require that what is said of a run is what its grade rests on."""
    said = set(score.verdicts)
    assert (Verdict.CONFORMS in said) == (score.grade is Grade.EXACT), found
    assert score.grade is not Grade.EXACT or said <= OF_EXACT, found
    assert score.grade is not Grade.WRONG or said & OF_WRONG, found
    diverged = score.grade in {Grade.DIVERGED, Grade.DIVERGED_INACCURATE}
    assert Verdict.DIVERGED in said or not diverged, found
    assert Verdict.DIVERGED not in said or diverged or (score.grade is Grade.WRONG and said & WRONG_LATER), found
    assert Verdict.WORSE_STEPS not in said or WORSENING.index(score.grade) >= WORSENING.index(Grade.INACCURATE), found


def worst_allowed_grade(rung: Rung, begins: str) -> Grade:
    """Return the worst that may be said: begun before the horizon, a fault may lead to another path."""
    may = Grade.DIVERGED_INACCURATE if begins == "before" and rung.size else rung.worst
    return max(rung.worst, may, key=WORSENING.index)


LONGER = pytest.mark.release
KINDS = [
    pytest.param("after", False, 64),
    *(
        pytest.param(begins, told, bits, marks=LONGER)
        for begins, told, bits in itertools.product(("before", "after"), (True, False), (64, 32))
        if (begins, told, bits) != ("after", False, 64)
    ),
]


@each("begins, told, bits", KINDS)
@each(
    "where, rung",
    [
        pytest.param(where, rung, id=f"{where[1]}-{rung.size:g}", marks=[LONGER] * (k % 3 > 0 or rung is not last))
        for k, (where, f) in enumerate(FAULTS.items())
        for *_, last in [f.rungs]
        for rung in f.rungs
    ],
)
def test_fault_in_a_gas_has_its_listed_grade(
    where: tuple[str, str], rung: Rung, begins: str, told: bool, bits: int
) -> None:
    """A fault in a gas gets a grade between the listed best and worst one, and the listed verdict."""
    # It starts before or after the horizon, with 64-bit or 32-bit floats, with velocities reported or not.
    score = score_gas_fault(where, rung.size, begins=begins, told=told, bits=bits)
    best = Grade.EXACT if bits == 32 and rung.size < SEEN_32 else rung.best
    assert_grade(score, best, worst_allowed_grade(rung, begins), rung.says, FAULTS[where].why)


@pytest.mark.release
@each("begins, told, bits", KINDS)
@each("where", FAULTS)
def test_larger_fault_in_a_gas_has_no_better_grade(where: tuple[str, str], begins: str, told: bool, bits: int) -> None:
    """No size of a fault in a gas is graded better than a smaller one."""
    scores = [score_gas_fault(where, rung.size, begins=begins, told=told, bits=bits) for rung in FAULTS[where].rungs]
    grades = [WORSENING.index(score.grade) for score in scores]
    assert grades == sorted(grades), [WORSENING[grade].name for grade in grades]


@each("told", release_after(1, [False, True]))
@each(
    "name, rung",
    [
        pytest.param(name, rung, id=f"{name}-{rung.size:g}", marks=[LONGER] * (rung is not f.rungs[-1]))
        for name, f in ALONE.items()
        for rung in f.rungs
    ],
)
def test_fault_of_one_or_two_discs_has_its_listed_grade(name: str, rung: Rung, told: bool) -> None:
    """A fault at rest, before it, or in a long contact gets a grade in the listed range, and the verdict."""
    says = rung.says if not told or rung.says is not Verdict.LATE else None  # if reported, it names the right instant
    assert_grade(score_small_fault(name, rung.size, told=told), rung.best, rung.worst, says, ALONE[name].why)


@pytest.mark.release
@each("told", [False, True])
@each("name", ALONE)
def test_larger_fault_of_one_or_two_discs_has_no_better_grade(name: str, told: bool) -> None:
    """No size of a fault of one or two discs is graded better than a smaller one; ungraded counts as best."""
    order = [Grade.UNGRADED, *WORSENING]
    grades = [order.index(score_small_fault(name, rung.size, told=told).grade) for rung in ALONE[name].rungs]
    assert grades == sorted(grades), [order[grade].name for grade in grades]


@each("begins", long_until(1, reversed(BEGINS)))
def test_reported_impacts_do_not_hide_passing_discs(begins: str) -> None:
    """A run whose discs pass through each other is wrong, even if it reports every impact."""
    passes = remove_impacts(load_exact_run(GAS), BEGINS[begins])
    claims = dataclasses.replace(passes, impacts=load_exact_run(GAS).impacts, told=True)
    score = score_run(claims, horizon_s=GAS_HORIZON_S)
    assert_grade(score, Grade.WRONG, Grade.WRONG, Verdict.PASSED_THROUGH, "its states decide")


@pytest.mark.release
@each("told", [False, True])
def test_pit_in_a_gas_is_graded_sampled_at_best(told: bool) -> None:
    """A run with PIT's states in a gas is never graded exact or close."""
    score = score_run(dataclasses.replace(record_pit(GAS), told=told), horizon_s=GAS_HORIZON_S)
    assert_grade(score, Grade.SAMPLED, Grade.WRONG, None, "it finds impacts at step boundaries")


@each("phase", release_after(1, [0.25, 0.0]))
@each("aside_m", [0.0, 0.3])
@each("steps", [*STEPS[1::3], *release_after(0, STEPS[1:])])
def test_a_pass_beyond_the_horizon_is_found_in_the_states(steps: int, aside_m: float, phase: float) -> None:
    """Two discs that pass through each other in two steps or more, beyond the horizon, are graded wrong."""
    score = score_run(build_passing_run(steps, aside_m, phase), horizon_s=0.1)
    assert_grade(score, Grade.WRONG, Grade.WRONG, Verdict.PASSED_THROUGH, "no velocity changes, on either side")


@pytest.mark.release
@each("fault", CROWD)
def test_gross_faults_are_found_in_a_gas_of_25(fault: Fault) -> None:
    """In the gas of 25 each gross fault, started long after the horizon, is graded as in the gas of 12."""
    scene = all_scenes()["engines/gas-of-25"].scene
    for rung in (fault.rungs[0], fault.rungs[-1]):
        run = fault.plant(load_exact_run(scene), 0.6 * scene.duration_s, rung.size)
        assert_grade(score_run(run, horizon_s=0.1 * scene.duration_s), rung.best, rung.worst, rung.says, fault.why)


def test_fault_sizes_increase_to_a_gross_fault() -> None:
    """The sizes of each fault increase from 0, and the largest is graded inaccurate or wrong at best."""
    faults: list[Fault | Alone] = [*FAULTS.values(), *ALONE.values()]
    for fault in faults:
        sizes = [rung.size for rung in fault.rungs]
        assert sizes[0] == 0.0
        assert np.all(np.diff(sizes) > 0)
        assert fault.rungs[-1].best in {Grade.INACCURATE, Grade.WRONG}
