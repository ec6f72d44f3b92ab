"""Each fault of the table, planted in a right run, comes back as itself, at its size, and with no better grade."""

import dataclasses
import math
import re

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.planted.faults import (
    DT,
    FAULTS,
    FIRST_S,
    LAST_S,
    ROW,
    Expected,
    Fault,
    replay_impacts,
    replay_reference,
    rotate,
)
from tests.transformed_scenes import in_units

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


@each("fault", FAULTS)
def test_fault_beyond_the_horizon_is_found_if_the_run_is_inconsistent(fault: Fault) -> None:
    """Beyond the horizon, a run that contradicts itself is inaccurate or wrong, and another path is exact."""
    is_other_path = fault.name in ANOTHER_PATH
    size = 1 if fault.name == "tunnelling" else fault.table[-1].size  # the other impact is within the horizon
    observed = fault.plant(REFERENCE, size)
    score = compare(REFERENCE, observed, sampling=build_exact_sampling(REFERENCE), horizon=BETWEEN_S)
    assert score.grade in ({Grade.EXACT} if is_other_path else {Grade.INACCURATE, Grade.WRONG})
    assert (score.verdicts == (Verdict.CONFORMS,)) is is_other_path
    assert is_other_path or not score.equals_pit


@each("name", ["classics/inelastic-oblique", "classics/deflection", "classics/sorting"])
def test_wrong_impact_law_is_measured_in_its_parts(name: str) -> None:
    """An impact along a normal turned by 1°, with a restitution 0.1 too low, has errors of exactly these sizes."""
    reference = solve_pic(catalogue()[name].scene)
    scene, impacts = reference.scene, reference.impacts.copy()
    row, angle, last = impacts[-1], math.radians(1.0), len(impacts) - 1
    w1, w2 = (1 / scene.discs[int(row[body])].mass_kg if row[body] >= 0 else 0.0 for body in ("first", "second"))
    restitution = (scene.restitution if row["second"] >= 0 else scene.wall_restitution) - 0.1
    right, turned = row["normal"].copy(), rotate(row["normal"], angle)
    approach = row["velocity_first_before"] - row["velocity_second_before"]
    impulse = (1 + restitution) * float(approach @ turned) / (w1 + w2)
    row["normal"] = turned
    row["velocity_first_after"] = row["velocity_first_before"] - impulse * w1 * turned
    row["velocity_second_after"] = row["velocity_second_before"] + impulse * w2 * turned
    score = compare(reference, replay_impacts(reference, impacts), sampling=build_exact_sampling(reference))
    assert [error.reference for error in score.errors if error.normal_rad > 1e-13] == [last]
    (wrong,) = (error for error in score.errors if error.reference == last)
    speed, fastest = score.scales.speed_m_s, max(w1, w2)
    along = impulse * math.cos(angle) - (1 + restitution + 0.1) * float(approach @ right) / (w1 + w2)
    assert wrong.normal_rad == pytest.approx(angle, abs=1e-13)
    assert wrong.across_normal == pytest.approx(impulse * math.sin(angle) * fastest / speed, abs=1e-13)
    assert wrong.along_normal == pytest.approx(abs(along) * fastest / speed, abs=1e-13)
    assert wrong.restitution_error == pytest.approx(-0.1, abs=1e-13)
    assert score.verdicts[0] is Verdict.WRONG_VELOCITY
    assert Verdict.WRONG_NORMAL in score.verdicts or row["second"] >= 0  # a wall's normal is known
    if np.isfinite(score.local.velocity[last]):  # not the second impact of a disc in one step
        assert score.local.velocity[last] == pytest.approx(wrong.velocity, abs=1e-12)
        parting = (row["velocity_second_after"] - row["velocity_first_after"]) @ right
        error = float(parting / (approach @ right)) - (restitution + 0.1)
        assert score.local.restitution[last] == pytest.approx(error, abs=1e-9)


@each("fault", [*FAULTS[::6], *release_after(0, FAULTS)])
@each("name", release_after(1, ["paper/multiple", "classics/box", "classics/deflection", "classics/galperin-100"]))
def test_larger_planted_fault_has_no_better_grade(name: str, fault: Fault) -> None:
    """In scenes of every kind, no size of a fault is graded better than a smaller one."""
    reference = solve_pic(catalogue()[name].scene)
    if len(reference.impacts) < fault.impacts:
        pytest.skip(f"{name} has too few impacts")
    runs = [fault.plant(reference, row.size) for row in fault.table]
    sampling = solve_pit(reference.scene, frame_rate_hz=1 / DT)
    grades = [WORSENING.index(compare(reference, run, sampling=sampling).grade) for run in runs]
    assert grades == sorted(grades)
    assert grades[0] == 0
    assert grades[-1] > 0


@each("length, time", release_after(1, [(1e-6, 1e3), (1000.0, 1e-3)]))
@each("name", ["paper/multiple", "classics/deflection"])
def test_units_of_a_scene_do_not_change_its_score(name: str, length: float, time: float) -> None:
    """A scene in other units of length and time has the same grade, verdicts and scaled errors, to 1e-9."""
    # The scaled start is rounded again, which affects an impact near a frame's edge most.
    scene = catalogue()[name].scene
    plain, again = (
        compare(solve_pic(s), solve_pit(s), sampling=solve_pit(s))
        for s in (scene, in_units(scene, length=length, time=time))
    )
    assert (again.grade, again.verdicts, again.edits) == (plain.grade, plain.verdicts, plain.edits)
    for kind in ("velocity", "along_normal", "across_normal", "restitution", "direction_rad", "energy"):
        assert getattr(again.total, kind) == pytest.approx(getattr(plain.total, kind), abs=1e-9, nan_ok=True), kind
    assert again.total.time_s / time == pytest.approx(plain.total.time_s, rel=1e-9, nan_ok=True)
    assert again.local.worst("velocity") == pytest.approx(plain.local.worst("velocity"), abs=1e-9, nan_ok=True)


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
