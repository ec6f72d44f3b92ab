"""Each fault of the table, planted in a right run, comes back as itself, at its size, and with no better grade."""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.distribution import forget, lay
from tests.lengths import each, long_after
from tests.planted import carom_planted
from tests.planted.faults import DT, FAULTS, FIRST_S, LAST_S, LENGTH, ROW, SPEED, Expected, Fault, faithful
from tests.stage import cross_checked, disc_at, staged, sure

from carom import Results, Scene, Trace, compare, solve_pic, solve_pit
from carom.catalogue import catalogue
from carom.comparator import Grade, Verdict
from carom.execution.job import Status
from carom.execution.results import Row

REFERENCE = solve_pic(ROW)
BETWEEN_S = (FIRST_S + LAST_S) / 2
ROWS = [pytest.param(fault, row, id=f"{fault.name}-{row.size:g}") for fault in FAULTS for row in fault.table]

#: From best to worst. What is not graded has no place among them, and no fault of the table may lead there.
WORSENING = [Grade.EXACT, Grade.CLOSE, Grade.SAMPLED, Grade.INACCURATE, Grade.WRONG]

#: Faults that leave a run in agreement with itself, so that only a reference shows them: another path.
ANOTHER_PATH = {"delayed", "hasty", "tunnelling"}


def without_error(reference: Trace) -> Trace:
    """A PIT that has no error, so that nothing hides behind sampling."""
    return dataclasses.replace(reference, dt_s=DT)


def shown(reason: str) -> float:
    """The number that a reason gives: the first that is no number of impacts expected or of a disc."""
    found = re.search(r"(?:by up to |length is up to |^)(\d+(?:\.\d+)?(?:e[+-]?\d+)?)", reason)
    assert found is not None, reason
    return float(found[1])


@each("fault, row", ROWS)
def test_a_planted_fault_is_named_at_its_size(fault: Fault, row: Expected) -> None:
    """The grade, every verdict, and the size that its reason shows are those of the table: no more, and no less."""
    score = compare(REFERENCE, fault.plant(REFERENCE, row.size), sampling=without_error(REFERENCE))
    assert score.grade is row.grade
    assert set(score.verdicts) == (set(row.says) or {Verdict.CONFORMS})
    for finding in score.findings:
        expected = row.says.get(finding.verdict)
        if expected is not None:  # three digits are shown
            assert shown(finding.reason) == pytest.approx(expected, rel=0.006, abs=1e-12), finding
    assert score.equals_pit == (row.grade is Grade.EXACT)


@each("fault", [fault for fault in FAULTS if fault.name not in ANOTHER_PATH])
def test_a_fault_beyond_the_horizon_is_found_in_the_run_itself(fault: Fault) -> None:
    """Where the reference may not be believed to the end, a run that contradicts itself is no better for that."""
    observed = fault.plant(REFERENCE, fault.table[-1].size)
    score = compare(REFERENCE, observed, sampling=without_error(REFERENCE), horizon=BETWEEN_S)
    assert score.grade in {Grade.INACCURATE, Grade.WRONG}
    assert not score.equals_pit


@pytest.mark.parametrize("name", sorted(ANOTHER_PATH))
def test_another_path_beyond_the_horizon_is_nobodys_fault(name: str) -> None:
    """A run that takes another path where the reference is not to be believed, and agrees with itself, stays exact."""
    (fault,) = (fault for fault in FAULTS if fault.name == name)
    size = 1 if name == "tunnelling" else fault.table[-1].size  # the other one is within the horizon
    score = compare(REFERENCE, fault.plant(REFERENCE, size), sampling=without_error(REFERENCE), horizon=BETWEEN_S)
    assert score.verdicts == (Verdict.CONFORMS,)
    assert score.grade is Grade.EXACT


def graded(fault: Fault, reference: Trace, sampling: Trace) -> Iterator[Grade]:
    for row in fault.table:
        yield compare(reference, fault.plant(reference, row.size), sampling=sampling).grade


@each("fault", FAULTS)
@pytest.mark.parametrize("exact", long_after(1, [True, False]))
@pytest.mark.parametrize(
    "name",
    long_after(
        1,
        [
            *("paper/multiple", "classics/inelastic-oblique", "paper/late", "classics/bullet"),
            *("classics/box", "classics/deflection", "classics/galperin-100"),
        ],
    ),
)
def test_a_fault_that_grows_never_improves_its_grade(name: str, exact: bool, fault: Fault) -> None:
    """In scenes of every kind, with a real PIT or one without error, each size is graded no better than a lesser."""
    reference = solve_pic(catalogue()[name].scene)
    if len(reference.impacts) < fault.impacts or len(reference.scene.discs) < fault.discs:
        pytest.skip(f"{name} has too few impacts or discs")
    sampling = without_error(reference) if exact else solve_pit(reference.scene, frame_rate_hz=1 / DT)
    grades = [WORSENING.index(grade) for grade in graded(fault, reference, sampling)]
    assert grades == sorted(grades)
    assert grades[0] == 0
    assert grades[-1] > 0


@each("name", ["paper/late", "classics/sorting", "classics/deflection", "classics/gas"])
def test_nothing_planted_is_nothing_found(name: str) -> None:
    """The reference, as a method with steps would give it, conforms, and no error of any kind is more than rounding."""
    reference = solve_pic(catalogue()[name].scene)
    score = compare(reference, faithful(reference), sampling=without_error(reference))
    assert score.verdicts == (Verdict.CONFORMS,)
    assert score.grade is Grade.EXACT
    own = score.consistency
    assert own is not None
    assert max(own.velocity.size, own.position.size, own.across, own.normal_rad, own.stamp_s) < 1e-12


def test_every_size_of_a_ladder_is_larger_than_the_one_before() -> None:
    """A ladder climbs, from nothing: what the tests of growth rest on."""
    for fault in FAULTS:
        sizes = [row.size for row in fault.table]
        assert sizes[0] == 0
        assert all(a < b for a, b in itertools.pairwise(sizes))
        assert math.isfinite(sizes[-1])


#: Discs that meet nobody: without looking at positions, free flight would begin after the third step.
FREE = staged("free", disc_at(0, 0, 1, 0, r=LENGTH), disc_at(0, 5, 1, 1, r=LENGTH), duration_s=2.0)

#: What must be said of the scene `ROW` in addition to the grade, with the number that the reason must show.
SAID: dict[str, tuple[Grade, dict[Verdict, str]]] = {
    "none": (Grade.EXACT, {Verdict.CONFORMS: "2 of 2"}),
    "told-none": (Grade.EXACT, {Verdict.CONFORMS: "2 of 2"}),
    "normal-1": (Grade.INACCURATE, {Verdict.WRONG_NORMAL: "by up to 1 degrees"}),
    "normal-90": (Grade.INACCURATE, {Verdict.WRONG_NORMAL: "by up to 90 degrees"}),
    "normal-reversed": (Grade.INACCURATE, {Verdict.WRONG_NORMAL: "by up to 180 degrees"}),
    "told-normal-1": (Grade.INACCURATE, {Verdict.WRONG_NORMAL: "by up to 1 degrees"}),
    "told-before": (Grade.INACCURATE, {Verdict.TURNS: f"{0.5 / SPEED:.3g} of the scene's speed"}),
    "told-stamped-early": (
        Grade.INACCURATE,
        {Verdict.EARLY: "0.5 steps", Verdict.DRIFTS: f"{SPEED * DT / 2 / LENGTH:.3g}"},
    ),
    "dropped": (Grade.WRONG, {Verdict.MISSED: "1 of 2", Verdict.TURNS: "1 of the scene's speed"}),
    "told-dropped": (Grade.WRONG, {Verdict.MISSED: "1 of 2", Verdict.TURNS: "1 of the scene's speed"}),
    "told-doubled": (Grade.WRONG, {Verdict.SPURIOUS: "1, the first at 1.25 s", Verdict.TURNS: "1 of"}),
    # Disc 0 ends where disc 2 does, 8 m further on.
    "swapped-states": (Grade.WRONG, {Verdict.MISPLACED: "16 of", Verdict.WRONG_END: "1 of", Verdict.TURNED_ALONE: ""}),
    "told-swapped-states": (
        Grade.WRONG,
        {Verdict.MISPLACED: "16 of", Verdict.WRONG_END: "1 of", Verdict.TURNS: "1 of"},
    ),
    "drifting": (Grade.INACCURATE, {Verdict.MISPLACED: f"{0.01 * 120 / LENGTH:.3g} of"}),
    # By 2 % of the velocity in a step: more than what counts as passing through an impact.
    "damped": (Grade.WRONG, {Verdict.ENERGY_LOST: "", Verdict.TURNS: "", Verdict.WRONG_END: ""}),
    "turning": (Grade.INACCURATE, {Verdict.WRONG_END: f"{math.sqrt(2):.3g}", Verdict.TURNS: f"{math.sqrt(2):.3g}"}),
    "nan-state": (Grade.WRONG, {Verdict.CUT_SHORT: "no longer finite"}),
}

#: Refused by name: what can't be is the adapter's slip, and no row is graded for it.
REFUSED = {
    "stamped-late": "time_s of a contact of bodies 1 and 2 must be within the step that reports it",
    "stamped-at-0": "must be within the step that reports it",
    "normal-long": "normal of a contact of bodies 1 and 2 must have the length 1, got 5, 0",
    "nan-normal": "normal of a contact of bodies 1 and 2 must be finite, got nan",
    "nan-impulse": "impulse_n_s of a contact of bodies 1 and 2 must be finite, got nan",
    "told-nan-velocity": "velocities of a contact of bodies 1 and 2 must be finite",
    "told-infinite-time": "time_s of a contact of bodies 1 and 2 must be finite, got inf",
}

#: Radii by which discs that meet nobody end off: the harness must not stop looking before.
FREE_OFF = {"drifting": 0.01 * 120 / LENGTH, "slow": 0.01 * 2.0 * math.sqrt(2) / LENGTH}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Name of the adapter, which is found by its entry point."""
    folder = tmp_path_factory.mktemp("planted")
    lay(folder, "planted", {"planted": "carom_planted:adapter"})
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        patch.syspath_prepend(str(Path(carom_planted.__file__).parent))
        forget()
        yield carom_planted.adapter.name
    forget()


@pytest.fixture(scope="module")
def results(installed: str) -> Results:
    """Every fault, in both scenes."""
    return cross_checked([ROW, FREE], [installed], dts=[DT], profiles=["all"], certified=False)


def row_of(results: Results, scene: Scene, fault: str) -> Row:
    (row,) = (row for row in results.rows if row.job.scene.name == scene.name and row.job.profile == fault)
    return row


@each("fault", SAID)
def test_a_faulty_method_is_named_and_graded(results: Results, fault: str) -> None:
    """The grade, and the verdicts with their numbers, are those of the table."""
    grade, says = SAID[fault]
    row = row_of(results, ROW, fault)
    assert row.status is Status.RAN, row.reason
    found = {finding.verdict: finding.reason for finding in sure(row.score).findings}
    assert row.grade is grade, found
    for verdict, words in says.items():
        assert words in found.get(verdict, "not said"), (verdict, found)
    assert grade is Grade.EXACT or not sure(row.score).equals_pit


@each("fault", REFUSED)
def test_what_can_not_be_is_refused_by_name(results: Results, fault: str) -> None:
    """A contact with a number that can't be is no row to be graded, and its reason names the number."""
    row = row_of(results, ROW, fault)
    assert (row.status, row.grade) == (Status.FAILED, None)
    assert REFUSED[fault] in row.reason


@pytest.mark.parametrize("fault", FREE_OFF)
def test_states_that_move_otherwise_than_their_velocities_are_followed_to_the_end(results: Results, fault: str) -> None:
    """Where positions do not move with velocities no step is left out, though nothing can meet, and the end is seen."""
    row = row_of(results, FREE, fault)
    assert sure(row.trace).counts["steps_skipped"] == 0
    assert sure(row.score).total.final_position == pytest.approx(FREE_OFF[fault], rel=1e-9)
    assert row.grade is Grade.INACCURATE
    assert not sure(row.score).equals_pit
    assert {Verdict.MISPLACED, Verdict.DRIFTS} <= set(sure(row.score).verdicts)
    sound = row_of(results, FREE, "none")
    assert sure(sound.trace).counts["steps_skipped"] > 0
    assert sound.grade is Grade.UNGRADED  # there is no impact to be graded by
    assert sure(sound.score).verdicts == (Verdict.NO_IMPACT,)


def test_every_fault_has_its_row() -> None:
    """No fault of the adapter is left out of the tables."""
    assert set(carom_planted.FAULTS) == SAID.keys() | REFUSED.keys() | FREE_OFF.keys()
