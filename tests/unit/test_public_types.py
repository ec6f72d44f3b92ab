"""The types of what people call, as mypy sees them: `make check` fails if one differs from this file."""

from __future__ import annotations

from typing import assert_type

import carom
from carom.execution.describe_engines import EngineList


def test_the_types_of_the_public_calls_are_those() -> None:
    """What mypy infers of each call is the type named, and each call is one that runs."""
    disc = carom.Disc(position_m=(0.0, 0.0), velocity_m_s=(2.0, 0.0), radius_m=0.25)
    other = carom.Disc(position_m=(1.5, 0.1), radius_m=0.25)
    scene = assert_type(carom.Scene(name="two", discs=[disc, other], duration_s=1.0), carom.Scene)
    pic = assert_type(carom.solve_pic(scene), carom.Trace)
    pit = assert_type(carom.solve_pit(scene), carom.Trace)
    score = assert_type(carom.compare(pic, pit, sampling=pit), carom.Score)
    assert_type(score.price_paid, float)
    assert_type(score.missed, tuple[int, ...])
    assert_type(pic.end_time_s, float)
    assert isinstance(score, carom.Score)


def listed() -> None:
    """Calls that start processes, for mypy alone."""
    assert_type(carom.engines(), EngineList)
    assert_type(carom.run("paper/late", "pit", dt=1 / 24), carom.Trace)
    assert_type(carom.cross_check(["paper/late"], ["pit"]), carom.Results)
    assert_type(carom.cross_check(["paper/late"], ["pit"]).rows[0].grade, carom.comparator.Grade | None)
