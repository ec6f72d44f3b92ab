"""Which impact is next, and when two bodies meet: nothing that may come before it is overlooked."""

import pytest
from flint import arb, ctx
from tests.cases import each
from tests.scene_builders import disc_at, staged

from carom import Disc, Scene
from carom.solvers.certified.ball_bodies import BallBodies
from carom.solvers.certified.meeting_times import meet
from carom.solvers.certified.result import Degenerate, Undecided
from carom.solvers.certified.selection import Selection


def in_two_rows(*, last_speed: float) -> BallBodies:
    """Return two rows far apart, of three discs each, whose middle discs are struck from both sides after about 1 s.

    Row 0: both times are known only to be from 1 s less 2e-6 to 1 s. Row 1: one is 1 s more or less 1e-6, and the other
    is exact.
    """
    discs = [Disc(position_m=(x, y), radius_m=1.0) for y in (0.0, 1000.0) for x in (0.0, 3.0, 6.0)]
    bodies = BallBodies(Scene(name="rows", discs=discs, duration_s=2.0))
    bodies.vx[0], bodies.vx[2] = arb(1 + 1e-6, 1e-6), -arb(1 + 1e-6, 1e-6)
    bodies.vx[3], bodies.vx[5] = arb(1, 1e-6), arb(-last_speed)
    return bodies


def selection(bodies: BallBodies) -> Selection:
    found = Selection(bodies)
    found.end_s = 2.0
    return found


def test_an_impact_behind_the_first_ball_but_within_a_rivals_is_a_rival() -> None:
    """Neither row is decided: the exact time is after all of row 0's, but within the wide ball next to it."""
    with ctx.workprec(128), pytest.raises(Undecided) as caught:
        selection(in_two_rows(last_speed=1 - 5e-7)).next_impact()
    assert caught.value.degeneracy.kind is Degenerate.SHARED_INSTANT


def test_the_same_rival_certainly_later_leaves_the_wide_ball_next() -> None:
    """With the exact time after the wide ball, this is next, and may as well come after those of the other row."""
    with ctx.workprec(128):
        choice = selection(in_two_rows(last_speed=0.5)).next_impact()
    assert choice is not None
    assert (choice.meeting.first, choice.meeting.second, choice.commutes) == (3, 4, True)


# When two bodies meet, as a ball, asked about one pair ----------------------------------------------------------------


@each("speed", [2.0, 0.125])
def test_two_discs_that_touch_and_part_never_meet(speed: float) -> None:
    """3-4-5: however slowly they part, that the root of D is as large as b changes nothing."""
    discs = disc_at(0.0, 0.0, r=2.5), disc_at(3.0, 4.0, speed, 0.0, r=2.5)
    assert meet(BallBodies(staged("parting", *discs, duration_s=1.0)), 0, 1, 0.0) is None
