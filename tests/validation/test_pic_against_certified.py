"""PIC against ball arithmetic on scenes full of ties: the order of impacts is proven there, however close they come."""

from __future__ import annotations

import numpy as np
import pytest
from tests.drawn import small
from tests.lengths import long_after

from carom import CertifiedTrace, certify, solve_pic
from carom.solvers.certified.result import Ending

#: Impacts of a scene: few, so that float64 has not yet lost the trajectory.
IMPACTS = 12


def in_one_order(impacts: list[tuple[int, int]], certified: CertifiedTrace) -> list[tuple[int, int]]:
    """Return impacts with those sorted by their bodies whose order makes no difference, as is proven."""
    ordered = list(impacts)
    for earlier, later in certified.commuted:
        ordered[earlier : later + 1] = sorted(ordered[earlier : later + 1])
    return ordered


@pytest.mark.parametrize("scenes", long_after(1, [60, 300]))
@pytest.mark.parametrize("parity", [0, 1], ids=["whole numbers", "anywhere"])
def test_the_impacts_are_those_that_are_proven(parity: int, scenes: int) -> None:
    """As far as ball arithmetic decides, PIC has the same impacts in the same order, and no other before the end."""
    proven = 0
    for number in range(parity, scenes, 2):
        scene = small(number, repeated=False)
        certified = certify(scene, max_impacts=IMPACTS)
        found = solve_pic(scene, max_impacts=IMPACTS).impacts[["first", "second"]].tolist()
        times = certified.trace.impacts["time_s"]
        truth = certified.trace.impacts[["first", "second"]].tolist()
        if certified.ending is not Ending.COMPLETED:
            found = found[: len(truth)]
        if certified.ending is Ending.MAX_IMPACTS:  # the limit may fall between impacts of one instant, in either order
            before = int(np.sum(times < times[-1]))
            found, truth = found[:before], truth[:before]
        assert in_one_order(found, certified) == in_one_order(truth, certified), f"small({number})"
        proven += len(truth)
    assert proven > scenes
