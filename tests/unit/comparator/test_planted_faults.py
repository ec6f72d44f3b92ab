"""A fault planted in scenes of every kind comes back as that fault, to rounding, and as no other.

It is planted in the last impact of the reference itself, so that everything but the fault is right to the last bit.
What must be said of each fault at which size is the table in `tests/planted`.
"""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.planted import faults
from tests.planted.faults import DT
from tests.transformed_scenes import in_units

from carom import Scene, Trace, compare, solve_pic, solve_pit
from carom.catalogue import catalogue
from carom.comparator import Score, Verdict

#: Scenes of every kind: one pair, a chain, inelastic, walls, an immovable disc, many impacts of one pair, a gas.
SCENES = [
    "paper/late",
    "paper/wrong-direction",
    "paper/multiple",
    "classics/inelastic-oblique",
    "classics/deflection",
    "classics/sorting",
    "classics/galperin-100",
    "classics/gas",
]


@pytest.fixture(params=SCENES)
def reference(request: pytest.FixtureRequest) -> Trace:
    """The PIC trace of a scene of the catalogue."""
    return solve_pic(catalogue()[request.param].scene)


def get_inverse_masses(scene: Scene, row: Any) -> tuple[float, float]:
    """Return the inverse masses of the two bodies of an impact; that of a wall is 0."""
    first, second = (1 / scene.discs[int(row[name])].mass_kg if row[name] >= 0 else 0.0 for name in ("first", "second"))
    return first, second


def score_against_perfect_pit(reference: Trace, observed: Trace) -> Score:
    """Compare with the reference as a PIT without error, so that sampling explains no error."""
    return compare(reference, observed, sampling=dataclasses.replace(reference, dt_s=DT))


def compute_rounding_tolerance(a: float) -> float:
    """What rounding can make of a planted fault of size `a`: sums and quotients of a few numbers about that size."""
    return 64 * 2.0**-52 * max(1.0, abs(a))


def test_normal_turned_by_one_degree_is_measured_exactly(reference: Trace) -> None:
    """An impact along a normal turned by 1° is the only one with a normal error, of 1° to rounding."""
    # The impulse J along the turned normal leaves errors in the velocities after the impact. Along and across the true
    # normal they are J (1 - cos 1°) and J sin 1° over the mass.
    angle = math.radians(1.0)
    impacts = reference.impacts.copy()
    row = impacts[-1]
    normal = faults.rotate(row["normal"], angle)
    scene = reference.scene
    w1, w2 = get_inverse_masses(scene, row)
    e = scene.restitution if row["second"] >= 0 else scene.wall_restitution
    closing = float((row["velocity_first_before"] - row["velocity_second_before"]) @ normal)
    push = (1 + e) * closing / (w1 + w2)
    row["normal"] = normal
    row["velocity_first_after"] = row["velocity_first_before"] - push * w1 * normal
    row["velocity_second_after"] = row["velocity_second_before"] + push * w2 * normal
    score = score_against_perfect_pit(reference, faults.replay_impacts(reference, impacts))
    wrong = [error for error in score.errors if error.normal_rad > compute_rounding_tolerance(1)]
    at = len(impacts) - 1
    assert [error.reference for error in wrong] == [at]
    assert wrong[0].normal_rad == pytest.approx(angle, abs=compute_rounding_tolerance(1))
    across = push * math.sin(angle) * max(w1, w2) / score.scales.speed_m_s
    assert wrong[0].across_normal == pytest.approx(across, abs=compute_rounding_tolerance(1))
    assert wrong[0].restitution_error == pytest.approx(0.0, abs=compute_rounding_tolerance(1))
    assert score.verdicts[0] is Verdict.WRONG_VELOCITY
    also = {Verdict.WRONG_DIRECTION, Verdict.MISPLACED, Verdict.WRONG_END}
    if row["second"] < 0:  # a wall's normal is known
        also.add(Verdict.WRONG_NORMAL)
    if e < 1:  # less of the energy is along the turned normal, and lost
        also |= {Verdict.ENERGY_LOST, Verdict.ENERGY_GAINED}
    assert set(score.verdicts[1:]) <= also
    assert "normal is wrong by 1 degrees" in score.findings[0].reason
    assert (score.missed, score.spurious, score.edits) == ((), (), 0)
    if np.isfinite(score.local.velocity[at]):  # not the second impact of a disc in one step
        assert score.local.velocity[at] == pytest.approx(wrong[0].velocity, abs=compute_rounding_tolerance(1))
        assert int(np.nanargmax(score.local.velocity)) == at


def test_restitution_lowered_by_a_tenth_is_measured_exactly(reference: Trace) -> None:
    """An impact with a restitution 0.1 too low has a restitution error of -0.1, all along the normal."""
    impacts = reference.impacts.copy()
    row, at = impacts[-1], len(impacts) - 1
    w1, w2 = get_inverse_masses(reference.scene, row)
    closing = float((row["velocity_first_before"] - row["velocity_second_before"]) @ row["normal"])
    less = 0.1 * closing / (w1 + w2)
    row["velocity_first_after"] += less * w1 * row["normal"]
    row["velocity_second_after"] -= less * w2 * row["normal"]
    score = score_against_perfect_pit(reference, faults.replay_impacts(reference, impacts))
    assert score.verdicts[0] is Verdict.WRONG_VELOCITY
    assert score.total.restitution == pytest.approx(-0.1, abs=compute_rounding_tolerance(1))
    assert score.total.across_normal == pytest.approx(0.0, abs=compute_rounding_tolerance(1))
    along = less * max(w1, w2) / score.scales.speed_m_s
    assert score.total.along_normal == pytest.approx(along, abs=compute_rounding_tolerance(1))
    if np.isfinite(score.local.restitution[at]):  # not the second impact of a disc in one step
        assert score.local.restitution[at] == pytest.approx(-0.1, abs=1e-9)


@each("length, time", release_after(1, [(1e-6, 1e3), (1000.0, 1.0), (1.0, 1e-3)]))
@each("name", ["paper/multiple", "classics/deflection"])
def test_units_of_a_scene_do_not_change_its_score(name: str, length: float, time: float) -> None:
    """A scene in other units of length and time has the same grade, verdicts and scaled errors."""
    # Errors agree to 1e-9: the scaled start is rounded again, which affects an impact near a frame's edge most.
    scene = catalogue()[name].scene
    other = in_units(scene, length=length, time=time)
    plain, again = (
        compare(solve_pic(s), pit, sampling=pit) for s, pit in ((scene, solve_pit(scene)), (other, solve_pit(other)))
    )
    assert (again.grade, again.verdicts, again.edits) == (plain.grade, plain.verdicts, plain.edits)
    for kind in ("velocity", "along_normal", "across_normal", "restitution", "direction_rad", "energy"):
        assert getattr(again.total, kind) == pytest.approx(getattr(plain.total, kind), abs=1e-9, nan_ok=True), kind
    assert again.total.time_s / time == pytest.approx(plain.total.time_s, rel=1e-9, nan_ok=True)
    assert again.local.worst("velocity") == pytest.approx(plain.local.worst("velocity"), abs=1e-9, nan_ok=True)
