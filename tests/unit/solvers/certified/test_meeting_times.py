"""When two bodies meet, as a ball, asked about one pair."""

from __future__ import annotations

from tests.lengths import each
from tests.stage import disc_at, staged

from carom.solvers.certified.ball_bodies import BallBodies
from carom.solvers.certified.meeting_times import meet


@each("speed", [2.0, 0.125])
def test_two_discs_that_touch_and_part_never_meet(speed: float) -> None:
    """3-4-5: however slowly they part, that the root of D is as large as b changes nothing."""
    discs = disc_at(0.0, 0.0, r=2.5), disc_at(3.0, 4.0, speed, 0.0, r=2.5)
    assert meet(BallBodies(staged("parting", *discs, duration_s=1.0)), 0, 1, 0.0) is None
