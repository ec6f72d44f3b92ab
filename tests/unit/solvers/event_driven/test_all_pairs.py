"""PIC by all pairs, the oracle of cells and queue, and what both loops do at the edges of numbers."""

from __future__ import annotations

import math

import numpy as np
from tests.lengths import each
from tests.stage import disc_at, line, staged, wall_at
from tests.unit.solvers.kinds import all_pairs

from carom import Disc, Scene
from carom.model.trace import Outcome
from carom.solvers.pic import pic_run


@each("friction, ambiguous", [(0.0, ()), (0.25, (1,))])
@each("by_all_pairs", [True, False])
def test_two_impacts_at_right_angles_are_unique_without_friction_only(
    friction: float, ambiguous: tuple[int, ...], by_all_pairs: bool
) -> None:
    """Struck at once from the left and from below, a disc takes both impulses; with friction each changes both."""
    discs = [
        Disc(position_m=(0.0, 0.0), radius_m=0.5),
        Disc(position_m=(-2.0, 0.0), velocity_m_s=(1.0, 0.0), radius_m=0.5),
        Disc(position_m=(0.0, -2.0), velocity_m_s=(0.0, 1.0), radius_m=0.5),
    ]
    run = pic_run(Scene(name="corner", duration_s=3.0, friction=friction, discs=discs), all_pairs=by_all_pairs)
    run.advance_to(3.0)
    assert run.log.array()["time_s"].tolist()[:2] == [1.0, 1.0]
    assert run.log.ambiguous() == ambiguous


def test_a_run_without_an_end_stays_where_the_last_impact_was() -> None:
    """A run up to its last impact ends there, with finite positions."""
    for run in (all_pairs(line(0.0, 3.0, velocities=(1.0, 0.0))), pic_run(line(0.0, 3.0, velocities=(1.0, 0.0)))):
        run.advance_to(math.inf)
        assert run.time_s == 2.0
        np.testing.assert_array_equal(run.positions(), [[2.0, 0.0], [3.0, 0.0]])


def test_a_wall_so_far_off_in_time_that_floats_overflow_is_never_met() -> None:
    """A disc that creeps at 1e-300 m/s to a wall 4 m away does not meet it in a second, nor ever."""
    discs = (disc_at(5, 0, -1e-300, 0), disc_at(9, 9, 1, 0))
    run = all_pairs(staged("creep", *discs, wall_at(0, 0, 1, 0), duration_s=1))
    assert run.advance_to(1.0) is Outcome.COMPLETED
    assert run.advance_to(math.inf) is Outcome.COMPLETED
    assert run.impacts == 0
