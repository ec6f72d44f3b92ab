"""Each fault of the table, planted in a right run, comes back as itself, at its size, and with no better grade."""

import dataclasses
import itertools
import math
import re
from collections.abc import Iterator

import pytest
from tests.cases import each, release_after
from tests.planted.faults import DT, FAULTS, FIRST_S, LAST_S, ROW, Expected, Fault, replay_reference

from carom import Trace, compare, solve_pic, solve_pit
from carom.catalogue import catalogue
from carom.comparator import Grade, Verdict

REFERENCE = solve_pic(ROW)
BETWEEN_S = (FIRST_S + LAST_S) / 2
ROWS = [pytest.param(fault, row, id=f"{fault.name}-{row.size:g}") for fault in FAULTS for row in fault.table]

#: From best to worst. What is not graded has no place among them, and no fault of the table may lead there.
WORSENING = [Grade.EXACT, Grade.CLOSE, Grade.SAMPLED, Grade.INACCURATE, Grade.WRONG]

#: Faults that leave a run in agreement with itself, so that only a reference shows them: another path.
ANOTHER_PATH = {"delayed", "hasty", "tunnelling"}


def build_exact_sampling(reference: Trace) -> Trace:
    """A PIT that has no error, so that nothing hides behind sampling."""
    return dataclasses.replace(reference, dt_s=DT)


def parse_reason_number(reason: str) -> float:
    """The number that a reason gives: the first that is no number of impacts expected or of a disc."""
    found = re.search(r"(?:by up to |length is up to |^)(\d+(?:\.\d+)?(?:e[+-]?\d+)?)", reason)
    assert found is not None, reason
    return float(found[1])


@each("fault, row", ROWS)
def test_planted_fault_has_its_listed_grade_verdicts_and_size(fault: Fault, row: Expected) -> None:
    """The grade, all verdicts, and the sizes in their reasons are exactly those of the table."""
    score = compare(REFERENCE, fault.plant(REFERENCE, row.size), sampling=build_exact_sampling(REFERENCE))
    assert score.grade is row.grade
    assert set(score.verdicts) == (set(row.says) or {Verdict.CONFORMS})
    for finding in score.findings:
        expected = row.says.get(finding.verdict)
        if expected is not None:  # three digits are shown
            assert parse_reason_number(finding.reason) == pytest.approx(expected, rel=0.006, abs=1e-12), finding
    assert score.equals_pit == (row.grade is Grade.EXACT)


@each("fault", [fault for fault in FAULTS if fault.name not in ANOTHER_PATH])
def test_inconsistent_run_beyond_the_horizon_is_found(fault: Fault) -> None:
    """A run that contradicts itself beyond the horizon of the reference is inaccurate or wrong."""
    observed = fault.plant(REFERENCE, fault.table[-1].size)
    score = compare(REFERENCE, observed, sampling=build_exact_sampling(REFERENCE), horizon=BETWEEN_S)
    assert score.grade in {Grade.INACCURATE, Grade.WRONG}
    assert not score.equals_pit


@each("name", sorted(ANOTHER_PATH))
def test_consistent_run_beyond_the_horizon_stays_exact(name: str) -> None:
    """A run that takes another path beyond the horizon, and is consistent with itself, is graded exact."""
    (fault,) = (fault for fault in FAULTS if fault.name == name)
    size = 1 if name == "tunnelling" else fault.table[-1].size  # the other one is within the horizon
    score = compare(
        REFERENCE, fault.plant(REFERENCE, size), sampling=build_exact_sampling(REFERENCE), horizon=BETWEEN_S
    )
    assert score.verdicts == (Verdict.CONFORMS,)
    assert score.grade is Grade.EXACT


def iterate_grades(fault: Fault, reference: Trace, sampling: Trace) -> Iterator[Grade]:
    for row in fault.table:
        yield compare(reference, fault.plant(reference, row.size), sampling=sampling).grade


@each("fault", [*FAULTS[::6], *release_after(0, FAULTS)])
@each("exact", release_after(1, [True, False]))
@each(
    "name",
    release_after(
        1,
        [
            *("paper/multiple", "classics/inelastic-oblique", "paper/late", "classics/bullet"),
            *("classics/box", "classics/deflection", "classics/galperin-100"),
        ],
    ),
)
def test_larger_planted_fault_has_no_better_grade(name: str, exact: bool, fault: Fault) -> None:
    """In scenes of every kind, with PIT or an exact PIT, no size of a fault is graded better than a smaller one."""
    reference = solve_pic(catalogue()[name].scene)
    if len(reference.impacts) < fault.impacts or len(reference.scene.discs) < fault.discs:
        pytest.skip(f"{name} has too few impacts or discs")
    sampling = build_exact_sampling(reference) if exact else solve_pit(reference.scene, frame_rate_hz=1 / DT)
    grades = [WORSENING.index(grade) for grade in iterate_grades(fault, reference, sampling)]
    assert grades == sorted(grades)
    assert grades[0] == 0
    assert grades[-1] > 0


@each("name", ["paper/late", "classics/sorting", "classics/deflection", "classics/gas"])
def test_faithful_run_conforms(name: str) -> None:
    """The reference replayed in steps conforms, and all its errors are below 1e-12."""
    reference = solve_pic(catalogue()[name].scene)
    score = compare(reference, replay_reference(reference), sampling=build_exact_sampling(reference))
    assert score.verdicts == (Verdict.CONFORMS,)
    assert score.grade is Grade.EXACT
    own = score.consistency
    assert own is not None
    assert max(own.velocity.size, own.position.size, own.across, own.normal_rad, own.stamp_s) < 1e-12


def test_fault_sizes_increase_from_zero() -> None:
    """The sizes of each fault increase from 0 and are finite."""
    for fault in FAULTS:
        sizes = [row.size for row in fault.table]
        assert sizes[0] == 0
        assert all(a < b for a, b in itertools.pairwise(sizes))
        assert math.isfinite(sizes[-1])
