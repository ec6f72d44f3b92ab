"""Which impact is next, and when two bodies meet: nothing that may come before it is overlooked."""

import pytest
from flint import arb, ctx
from tests.cases import each
from tests.scene_builders import disc_at, staged

from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.meeting_times import meet
from carom.solvers.certified.result import Degenerate, Undecided
from carom.solvers.certified.selection import Selection


def build_two_rows(*, last_speed: float) -> BallBodies:
    """Return two rows far apart, of three discs each, whose middle discs are struck from both sides after about 1 s.

    Row 0: both times are known only to be from 1 s less 2e-6 to 1 s. Row 1: one is 1 s more or less 1e-6, and the other
    is exact.
    """
    discs = (disc_at(x, y, r=1.0) for y in (0.0, 1000.0) for x in (0.0, 3.0, 6.0))
    bodies = BallBodies(staged("rows", *discs, duration_s=2.0))
    bodies.vx[0], bodies.vx[2] = arb(1 + 1e-6, 1e-6), -arb(1 + 1e-6, 1e-6)
    bodies.vx[3], bodies.vx[5] = arb(1, 1e-6), arb(-last_speed)
    return bodies


def build_selection(bodies: BallBodies) -> Selection:
    found = Selection(bodies)
    found.end_s = 2.0
    return found


def test_impact_within_the_time_ball_of_a_rival_is_undecided() -> None:
    """The next impact is undecided (SHARED_INSTANT) if an exact time is within the wide ball of a rival."""
    with ctx.workprec(128), pytest.raises(Undecided) as caught:
        build_selection(build_two_rows(last_speed=1 - 5e-7)).next_impact()
    assert caught.value.degeneracy.kind is Degenerate.SHARED_INSTANT


def test_certainly_later_rival_leaves_the_next_impact_decided() -> None:
    """If the rival is certainly later, the impact with the wide ball is next, and commutes with the other row."""
    with ctx.workprec(128):
        choice = build_selection(build_two_rows(last_speed=0.5)).next_impact()
    assert choice is not None
    assert (choice.meeting.first, choice.meeting.second, choice.commutes) == (3, 4, True)


# When two bodies meet, as a ball, asked about one pair ----------------------------------------------------------------


@each("speed", [2.0, 0.125])
def test_touching_discs_that_part_never_meet(speed: float) -> None:
    """Touching discs that part at 2 m/s or 0.125 m/s never meet."""
    # The root of D is as large as b here (3-4-5).
    discs = disc_at(0.0, 0.0, r=2.5), disc_at(3.0, 4.0, speed, 0.0, r=2.5)
    assert meet(BallBodies(staged("parting", *discs, duration_s=1.0)), 0, 1, 0.0) is None
