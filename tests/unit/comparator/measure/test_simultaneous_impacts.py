"""Shared simultaneous contact: every admissible outcome is listed, and the score names the one that a trace took."""

import dataclasses
import math

import numpy as np
from tests.scene_builders import alter_impact, disc_at, require_value, staged, wall_at

from carom import compare, solve_pic
from carom.catalogue import catalogue, find_scenes
from carom.comparator import Verdict
from carom.comparator.measure.simultaneous_impacts import find_admissible_outcomes, find_first_group
from carom.model.walls import Leg

#: A disc that strikes two at once.
ONE_INTO_TWO = solve_pic(catalogue()["classics/one-into-two"].scene)


def test_one_disc_into_two_has_three_admissible_outcomes() -> None:
    """A disc that strikes two at once has two mirrored outcomes in turn, and one symmetric outcome all at once."""
    # In turn the striker leaves at (-1/8, -+sqrt(3)/8). All at once, by symmetry both struck discs leave along their
    # normals, at 30 degrees, with speed u. Momentum gives 1 = w + 2 u cos 30. Energy gives 1 = w^2 + 2 u^2. So u = 2
    # sqrt(3)/5 and w = -1/5.
    group = require_value(find_first_group(ONE_INTO_TWO))
    assert group.discs == (0, 1, 2)
    assert len(group.contacts) == 3
    outcomes = find_admissible_outcomes(ONE_INTO_TWO.scene, group, 1.0)
    striker = [outcome.motion_m_s[:, :2][0].tolist() for outcome in outcomes]
    expected = [[-1 / 8, -math.sqrt(3) / 8], [-1 / 8, math.sqrt(3) / 8], [-1 / 5, 0.0]]
    np.testing.assert_allclose(striker, expected, rtol=0, atol=1e-12)
    assert [outcome.how for outcome in outcomes][2] == "all at once"


def test_simultaneous_outcome_has_no_negative_impulse() -> None:
    """If one impulse of a simultaneous outcome would be negative, only the other disc gets an impulse."""
    # A disc strikes two discs 70 degrees apart at 83 degrees: all at once, the first impulse would be negative. After
    # an impulse on the first alone, the striker would still approach the second: that is not an outcome.
    way, other = (math.cos(math.radians(83)), math.sin(math.radians(83))), math.radians(70)
    discs = disc_at(-way[0], -way[1], *way), disc_at(1.0, 0.0), disc_at(math.cos(other), math.sin(other))
    scene = staged("aside", *discs, duration_s=2.0)
    outcomes = find_admissible_outcomes(scene, require_value(find_first_group(solve_pic(scene))), 1.0)
    assert [outcome.how for outcome in outcomes] == ["0 on 1, then 0 on 2", "0 on 2"]


def test_driven_wall_strikes_with_the_velocity_of_its_leg() -> None:
    """A driven wall in a simultaneous impact has the velocity of its second leg: discs end at 1 and 3/2 m/s."""
    # In turn, with equal masses: (0, -1/2) becomes (-1/2, 0), at a wall of 1/2 m/s (3/2, 0), (0, 3/2) and (1, 3/2).
    legs = (Leg(from_s=0.0, velocity_m_s=(0.25, 0.0)), Leg(from_s=1.0, velocity_m_s=(0.5, 0.0)))
    scene = staged(
        "squeeze", disc_at(0.75, 0.0), disc_at(2.75, 0.0, -0.5), wall_at(-0.5, 0.0, 1.0, 0.0, legs=legs), duration_s=4.0
    )
    group = require_value(find_first_group(solve_pic(scene)))
    outcomes = find_admissible_outcomes(scene, group, 1.0)
    assert [outcome.motion_m_s[:, :2].tolist() for outcome in outcomes] == [[[1.0, 0.0], [1.5, 0.0]]]


def test_disc_that_falls_onto_a_resting_one_has_two_outcomes() -> None:
    """A disc that falls onto one on a floor stays there, in turn, or leaves at 1 m/s, all at once; PIC stays."""
    # It falls at 2 m/s, with restitution 1/2 and 0 on the floor. In turn, each impact of the discs halves their
    # approach speed, and the floor stops the lower one: both are at rest after infinitely many. All at once, the lower
    # disc stays, and the upper one leaves at half of 2 m/s.
    (entry,) = find_scenes(["contact/pressed"])
    reference = solve_pic(entry.scene)
    group = require_value(find_first_group(reference))
    in_turn, at_once = find_admissible_outcomes(entry.scene, group, 2.0)
    np.testing.assert_allclose(in_turn.motion_m_s[:, :2], [[0, 0], [0, 0]], rtol=0, atol=4e-9)
    np.testing.assert_allclose(at_once.motion_m_s[:, :2], [[0, 0], [0, 1]], rtol=0, atol=1e-12)
    assert in_turn.how.startswith("0 on 1, then 0 on wall 0, then 0 on 1")
    assert in_turn.how.endswith(", and so on")
    score = compare(reference, reference)
    assert require_value(score.convention).nearest == 0
    assert require_value(score.convention).distance < 1e-7  # PIC ends by name after a dozen of them


def test_pic_matches_the_first_admissible_outcome() -> None:
    """PIC's run matches admissible outcome 1 of 3, its mirror image outcome 2, and other velocities match none."""
    # PIC takes the lower body numbers first.
    score = compare(ONE_INTO_TWO, ONE_INTO_TWO)
    assert (require_value(score.convention).nearest, require_value(score.convention).matches) == (0, True)
    assert "matches possible outcome 1 of 3" in score.findings[0].reason
    impacts = ONE_INTO_TWO.impacts.copy()
    for name in impacts.dtype.names or ():
        if impacts[name].ndim == 2:
            impacts[name][:, 1] *= -1.0
    impacts["second"] = [2, 1]
    other = compare(ONE_INTO_TWO, dataclasses.replace(ONE_INTO_TWO, impacts=impacts))
    assert (require_value(other.convention).nearest, require_value(other.convention).matches) == (1, True)
    wrong = compare(ONE_INTO_TWO, alter_impact(ONE_INTO_TWO, 1, velocity_first_after=(0.5, 0.5)))
    assert not require_value(wrong.convention).matches
    assert wrong.verdicts[0] is Verdict.CONVENTION
    assert "matches none of the 3 possible outcomes" in wrong.findings[0].reason


def test_row_of_touching_discs_passes_all_speed_to_the_last() -> None:
    """In the first outcome of a row of equal elastic discs, the last disc leaves with all the speed."""
    for discs in (3, 5):
        row = [disc_at(k, 0) for k in range(discs - 1)]
        reference = solve_pic(staged("cradle", disc_at(-2, 0, 1), *row, duration_s=3))
        group = require_value(find_first_group(reference))
        assert group.discs == tuple(range(discs))
        first = find_admissible_outcomes(reference.scene, group, 1.0)[0]
        np.testing.assert_allclose(first.motion_m_s[:, 0], [0.0] * (discs - 1) + [1.0], rtol=0, atol=1e-12)
