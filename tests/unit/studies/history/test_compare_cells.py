"""Changes that are attributed to an engine's release, and the selection of releases."""

import math
from dataclasses import replace
from typing import Any

import pytest
from tests.cases import each

from carom.errors import CaromError
from carom.execution.job import Answer, Status
from carom.studies.history.compare_cells import PLACES, ChangeKind, ReleaseCell, ReleaseRun, classify_change
from carom.studies.history.run import select_versions

PHASES = 8
RAN = ReleaseRun(
    digest="a",
    settings=(("dt_s", "0.1"),),
    grade="SAMPLED",
    verdicts=("LATE",),
    expected=1,
    found=1,
    lost=0,
    velocity=0.25,
    late_steps=0.5,
    position_errors_m=(0.5, 0.0) * PLACES,
    velocity_errors_m_s=(0.25, 0.0),
    place_rounding_m=1e-12,
    speed_m_s=1.0,
    float_bits=64,
)


def build_cell(*runs: ReleaseRun) -> ReleaseCell:
    """Return a release in one cell, with its own phase first."""
    own, *others = (Answer(Status.RAN, value=run) for run in runs)
    return ReleaseCell(own, tuple(others))


def speeds(low: float, high: float, **fields: Any) -> ReleaseCell:
    """Return a release whose velocities at the end are off by a range, spread evenly, and whose bits are others."""
    step = (high - low) / PHASES
    own = {"digest": "b"} | fields
    return build_cell(*(replace(RAN, velocity_errors_m_s=(low + k * step, 0.0), **own) for k in range(PHASES + 1)))


def places(low: float, high: float, **fields: Any) -> ReleaseCell:
    """Return a result with a range of errors along x before the end, and an error of a metre at the end."""
    step = (high - low) / PHASES if high > low else 0.0
    own = {"digest": "b"} | fields
    off = [(low + k * step, 0.0) * (PLACES - 1) + (1.0, 0.0) for k in range(PHASES + 1)]
    return build_cell(*(replace(RAN, position_errors_m=at, **own) for at in off))


EIGHT, EIGHT_WORSE = ([replace(RAN, digest=f"{v}", velocity_errors_m_s=(v, 0.0))] * PHASES for v in (0.1, 0.9))
BEFORE, WORSE = speeds(0.1, 0.2), speeds(0.3, 0.4, digest="c")


@each(
    "old, new, moved",
    [
        (build_cell(RAN), build_cell(RAN), ChangeKind.SAME_BITS),
        (build_cell(RAN), build_cell(replace(RAN, settings=(("dt_s", "0.1"), ("new", "1")))), ChangeKind.SAME_BITS),
        (build_cell(RAN), build_cell(replace(RAN, digest="b", velocity=0.25 + 1e-14)), ChangeKind.ROUNDING),
        (BEFORE, WORSE, ChangeKind.WORSE),
        (speeds(0.3, 0.4), speeds(0.1, 0.2, digest="c"), ChangeKind.BETTER),
        (speeds(0.1, 0.3), speeds(0.2, 0.4, digest="c"), ChangeKind.PHASE_ONLY),
        (BEFORE, speeds(0.22, 0.32, digest="c"), ChangeKind.PHASE_ONLY),  # a phase between may fill a gap of 0.02
        (BEFORE, speeds(0.23, 0.33, digest="c"), ChangeKind.WORSE),
        (BEFORE, speeds(0.3, 0.4, digest="c", settings=(("dt_s", "0.2"),)), ChangeKind.OTHER_SETTINGS),
        (BEFORE, speeds(0.3, 0.4, digest="c", verdicts=("LATE", "TURNS")), ChangeKind.UNOBSERVED_CONTACTS),
        (speeds(0.1, 0.2, verdicts=("TURNS",)), WORSE, ChangeKind.UNOBSERVED_CONTACTS),
        (speeds(0.1, 0.2, grade="UNGRADED"), WORSE, ChangeKind.OTHERWISE),
        # With seven phases in all no change is the engine's.
        (build_cell(*EIGHT), build_cell(*EIGHT_WORSE[1:]), ChangeKind.PHASE_ONLY),
        (build_cell(*EIGHT), build_cell(*EIGHT_WORSE), ChangeKind.WORSE),
        # Reported contacts are no part of the motion, whether in counts, grades or verdicts.
        (BEFORE, speeds(0.1, 0.2, digest="c", lost=2), ChangeKind.OTHER_CONTACTS),
        (speeds(0.1, 0.3, lost=2), speeds(0.2, 0.4, digest="c"), ChangeKind.OTHER_CONTACTS),
        (speeds(0.1, 0.2, lost=2), WORSE, ChangeKind.WORSE),
        (
            speeds(0.1, 0.3),
            speeds(0.2, 0.4, digest="c", verdicts=("MISPLACED",), grade="WRONG"),
            ChangeKind.OTHER_CONTACTS,
        ),
        (BEFORE, speeds(0.1, 0.2, digest="c", late_steps=0.6), ChangeKind.OTHER_CONTACTS),
        (build_cell(RAN), build_cell(replace(RAN, digest="b", velocity=math.nan)), ChangeKind.PHASE_ONLY),
        # Places: before the end, too, and where they are on the other side of the right one.
        (places(1.1, 1.2), places(1.3, 1.4, digest="c"), ChangeKind.WORSE),
        (places(0.1, 0.2), places(-0.2, -0.1, digest="c"), ChangeKind.OTHERWISE),
        (places(0.1, 0.3), places(0.2, 0.4, digest="c"), ChangeKind.PHASE_ONLY),
        (places(1.1, 1.2), places(math.inf, math.inf, digest="c"), ChangeKind.WORSE),  # it ended before
        (places(math.inf, math.inf), places(math.inf, math.inf, digest="c"), ChangeKind.ROUNDING),
        # Velocities are nearer and places farther: nobody can say which is better.
        (speeds(0.3, 0.4), speeds(0.1, 0.2, digest="c", position_errors_m=(0.6, 0.0) * PLACES), ChangeKind.OTHERWISE),
    ],
)
def test_change_is_attributed_to_engine_if_ranges_are_disjoint(
    old: ReleaseCell, new: ReleaseCell, moved: ChangeKind
) -> None:
    """A release is better or worse only with equal settings, observed contacts and disjoint ranges of errors."""
    assert classify_change(old, new).kind is moved


def test_change_of_position_has_disc_time_and_ranges() -> None:
    """The reason of a change names the coordinate, disc and time of the largest difference, with both ranges."""
    change = classify_change(places(0.1, 0.2), places(-0.2, -0.1, digest="c"))
    assert (
        change.numbers == "error of disc 0's x coordinate after 1/8 of the run: 0.1 to 0.2 m before, -0.2 to -0.1 m now"
    )


def test_gap_within_rounding_is_no_change() -> None:
    """A gap of 1e-6 between two ranges is rounding with 32-bit floats and a change with 64-bit floats."""
    for bits, moved in ((32, ChangeKind.OTHER_CONTACTS), (64, ChangeKind.WORSE)):
        old = build_cell(*[replace(RAN, float_bits=bits, velocity_errors_m_s=(0.1, 0.0))] * 9)
        own = replace(RAN, digest="b", float_bits=bits, velocity_errors_m_s=(0.1 + 1e-6, 0.0))
        new, later = [replace(own, verdicts=("LATE", "EARLY"))], [own]
        assert classify_change(old, build_cell(*new, *later * 8)).kind is moved


def test_change_of_unsupported_cell_has_its_reason() -> None:
    """If one of two releases did not run a cell, the change has the kind "not run" and the reason."""
    refused = ReleaseCell(Answer(Status.UNSUPPORTED, "no gravity"))
    change = classify_change(build_cell(RAN), refused)
    assert (change.kind, change.numbers) == (ChangeKind.NOT_RUN, "unsupported: no gravity")


def test_release_without_reported_impacts_observes_no_contact() -> None:
    """A release that reports no impact although velocities turn as expected observes no contacts."""
    assert replace(RAN, found=0, verdicts=("MISSED", "TURNS")).observes_no_contact
    assert not replace(RAN, found=0, verdicts=("MISSED",)).observes_no_contact
    assert not replace(RAN, found=0, expected=0, verdicts=("TURNS",)).observes_no_contact


LISTED = ("10.0.0", "2.3.1.post1", "2.3.1", "3.0.0", "3.0.0rc1", "2.10", "0.0.0-50223ff-20240729")


@each(
    "asked, most, found",
    [
        (None, 2, ("3.0.0", "10.0.0")),
        (None, 9, ("2.3.1", "2.3.1.post1", "2.10", "3.0.0", "10.0.0")),
        ([">=2.10"], 9, ("2.10", "3.0.0", "10.0.0")),
        ([">=2.4,<10"], 9, ("2.10", "3.0.0")),
        ([">2.10", "<=10"], 9, ("3.0.0", "10.0.0")),
        (["2.3.1..3"], 9, ("2.3.1", "2.3.1.post1", "2.10", "3.0.0")),
        (["2.3.1..3"], 1, ("3.0.0",)),
        (["3.0.0rc1"], 9, ("3.0.0rc1",)),
        (["3.0.0rc1", ">=10"], 1, ("3.0.0rc1", "10.0.0")),
        (["latest"], 9, ("10.0.0",)),
        (["latest,2.10"], 9, ("2.10", "10.0.0")),
        (["10.0.0, 2.3.1"], 1, ("2.3.1", "10.0.0")),
        ([">11"], 9, ()),
    ],
)
def test_versions_are_selected_by_conditions_and_names(
    asked: list[str] | None, most: int, found: tuple[str, ...]
) -> None:
    """The newest releases that meet all conditions, and named ones, are selected in ascending order."""
    assert select_versions(LISTED, asked, most) == found


@each(
    "word, told",
    [
        ("2.3.2", "there is no release '2.3.2'; did you mean '2.3.1'"),
        ("--index-url=x", "a version must begin with a digit"),
        (">=x", "a version must begin with a digit"),
        ("1;2", "a version must begin with a digit"),
    ],
)
def test_unknown_or_malformed_version_is_refused(word: str, told: str) -> None:
    """An unknown version is refused with the nearest known one; a malformed version is refused, too."""
    with pytest.raises(CaromError, match=told):
        select_versions(LISTED, [word], 3)
