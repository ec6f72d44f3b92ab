"""What counts as a change of the engine's, of runs whose numbers are given."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from carom.runs.job import Answer, Status
from carom.studies.history.cells import Moved, Ran, SeenCell, change_of

PHASES = 8
RAN = Ran(
    digest="a",
    settings=(("dt_s", "0.1"),),
    grade="SAMPLED",
    verdicts=("LATE",),
    expected=1,
    found=1,
    lost=0,
    velocity=0.25,
    late_steps=0.5,
    path_m=(0.0, 2.0),
    velocity_m_s=(1.0, 0.0),
    float_bits=64,
)


def seen(*runs: Ran) -> SeenCell:
    """Return a release in one cell, with its own phase first."""
    own, *others = (Answer(Status.RAN, value=run) for run in runs)
    return SeenCell(own, tuple(others))


def over(low: float, high: float, **fields: Any) -> SeenCell:
    """Return a release whose velocity errors are spread evenly over a range, and whose bits are others."""
    step = (high - low) / PHASES
    own = {"digest": "b", "path_m": (low, high, float(len(fields)))} | fields
    return seen(*(replace(RAN, velocity=low + k * step, **own) for k in range(PHASES + 1)))


@pytest.mark.parametrize(
    ("old", "new", "moved"),
    [
        (seen(RAN), seen(RAN), Moved.NOTHING),
        (seen(RAN), seen(replace(RAN, settings=(("dt_s", "0.1"), ("new", "1")))), Moved.NOTHING),
        (seen(RAN), seen(replace(RAN, digest="b", velocity=0.25 + 1e-14)), Moved.ROUNDING),
        (over(0.1, 0.2), over(0.3, 0.4, digest="c"), Moved.WORSE),
        (over(0.3, 0.4), over(0.1, 0.2, digest="c"), Moved.BETTER),
        (over(0.1, 0.3), over(0.2, 0.4, digest="c"), Moved.OVERLAP),
        (over(0.1, 0.2), over(0.2, 0.4, digest="c"), Moved.OVERLAP),  # they touch
        (over(0.1, 0.2), over(0.3, 0.4, digest="c", settings=(("dt_s", "0.2"),)), Moved.ASKED),
        (over(0.1, 0.2), over(0.3, 0.4, digest="c", verdicts=("LATE", "TURNS")), Moved.UNSEEN),
        (over(0.1, 0.2, verdicts=("TURNS",)), over(0.3, 0.4, digest="c"), Moved.UNSEEN),
        (over(0.1, 0.2, grade="UNGRADED"), over(0.3, 0.4, digest="c"), Moved.OTHERWISE),
        (over(0.1, 0.2), over(0.1, 0.2, digest="c", lost=2), Moved.WORSE),
        (over(0.1, 0.2, lost=2), over(0.3, 0.4, digest="c"), Moved.BETTER),  # impacts come first
        (over(0.1, 0.2), over(0.1, 0.2, digest="c", verdicts=("MISPLACED",)), Moved.OTHERWISE),
        (over(0.1, 0.2), over(0.1, 0.2, digest="c", verdicts=("MISPLACED",), grade="WRONG"), Moved.WORSE),
        (seen(RAN), seen(replace(RAN, digest="b", velocity=math.nan)), Moved.OVERLAP),
        (over(0.1, 0.2, path_m=(1.0, 2.0)), over(0.3, 0.4, digest="c", path_m=(1.0, 2.0 + 1e-15)), Moved.TOLD),
        (over(0.1, 0.2, path_m=(1.0, 2.0)), over(0.3, 0.4, digest="c", path_m=(1.0, 2.1)), Moved.WORSE),
    ],
)
def test_a_change_is_the_engines_where_ranges_part(old: SeenCell, new: SeenCell, moved: Moved) -> None:
    """Settings must be equal, every contact seen, and a range or a verdict apart at every phase."""
    assert change_of(old, new).moved is moved


def test_fewer_phases_say_nothing() -> None:
    """However far apart, what ran at seven phases alone is no change of the engine's; at eight it is."""
    low, high = ([replace(RAN, digest=f"{v}", velocity=v, path_m=(v, v))] * PHASES for v in (0.1, 0.9))
    assert change_of(seen(*low), seen(*high[1:])).moved is Moved.OVERLAP
    assert change_of(seen(*low), seen(*high)).moved is Moved.WORSE


def test_ranges_that_part_by_rounding_do_not_part() -> None:
    """In 32-bit floats a gap of a millionth is rounding; in 64 bits it is a change."""
    for bits, moved in ((32, Moved.OVERLAP), (64, Moved.WORSE)):
        old = seen(*[replace(RAN, float_bits=bits, velocity=0.1)] * 9)
        own = replace(RAN, digest="b", float_bits=bits, velocity=0.1 + 1e-6, path_m=(0.0, 2.1))
        new, later = [replace(own, verdicts=("LATE", "EARLY"))], [own]
        assert change_of(old, seen(*new, *later * 8)).moved is moved


def test_what_one_of_the_two_did_not_run_is_said() -> None:
    """The reason is that of the one that did not."""
    refused = SeenCell(Answer(Status.UNSUPPORTED, "no gravity"))
    change = change_of(seen(RAN), refused)
    assert (change.moved, change.why) == (Moved.NOT_RUN, "unsupported: no gravity")


def test_no_impact_told_though_velocities_change_is_no_contact_seen() -> None:
    """A release of which no impact is told, though discs turn, is unseen; one of a scene without impacts is not."""
    assert replace(RAN, found=0, verdicts=("MISSED", "TURNS")).unseen
    assert not replace(RAN, found=0, verdicts=("MISSED",)).unseen
    assert not replace(RAN, found=0, expected=0, verdicts=("TURNS",)).unseen
