"""A method with a fault, installed as anybody's would be and run through a whole cross-check, is graded no better."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.distribution import forget, lay
from tests.lengths import each
from tests.planted import carom_planted
from tests.planted.faults import DT, LENGTH, ROW, SPEED
from tests.stage import cross_checked, disc_at, staged, sure

from carom import Results, Scene
from carom.comparator import Grade, Verdict
from carom.runs.job import Status
from carom.runs.results import Row

#: Discs that meet nobody: without looking at positions, free flight would begin after the third step.
FREE = staged("free", disc_at(0, 0, 1, 0, r=LENGTH), disc_at(0, 5, 1, 1, r=LENGTH), duration_s=2.0)

#: What must be said of the scene `ROW` beside the grade, with the number that the reason must show.
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
    "stamped-late": "time_s of a contact of bodies 1 and 2 must lie within the step that reports it",
    "stamped-at-0": "must lie within the step that reports it",
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
