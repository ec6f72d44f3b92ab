"""Impacts in which bodies stick although they should slide, or slide although they should stick.

Each impact is checked with the run's own numbers: the velocities before the impact, the normal and the normal impulse.
So errors of the impact's time and of its normal impulse do not matter. The law of friction computes two tangential
impulses: one that makes the bodies stick, and one that makes them slide. The smaller impulse is correct
(`core/impact_law.h`). If the run's tangential impulse is nearer to the larger of these two impulses, the bodies wrongly
stick or slide. If the two impulses are equal, sticking and sliding are both correct.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.comparator.measure.errors import build_impact_bodies
from carom.comparator.non_finite import find_finite_impacts
from carom.comparator.scales import Scales
from carom.core.impact_law import compute_branches
from carom.model.trace import Trace, rim_speeds, velocities


class WrongBranches(NamedTuple):
    """Indices of impacts with the wrong kind of friction.

    Attributes:
        slid: Impacts in which the bodies slid although friction can hold them.
        stuck: Impacts in which the bodies stuck although friction can't hold them.
    """

    slid: tuple[int, ...] = ()
    stuck: tuple[int, ...] = ()


def find_wrong_branches(trace: Trace, scales: Scales, rounding: float) -> WrongBranches:
    """Find the impacts in which bodies wrongly stick or slide.

    Differences below `rounding` times the scene's greatest disc or rim speed are ignored. If a disc has several
    contacts in one step, these contacts are not checked, because their effects can't be separated.
    """
    impacts = trace.impacts
    if not trace.scene.arrays.has_friction or not len(impacts):
        return WrongBranches()
    wall, before, after = impacts["second"] < 0, velocities(impacts, "before"), velocities(impacts, "after")
    (one, two), contacts = build_impact_bodies(trace, rim_speeds(trace, "before"))
    normal = impacts["normal"] / np.hypot(*impacts["normal"].T)[:, None]
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    lightness = 1.0 / one.mass + 1.0 / two.mass
    changed = (before[0] - before[1]) - (after[0] - after[1])
    pushed, rubbed = (np.sum(changed * along, axis=1) / lightness for along in (normal, tangent))
    both = compute_branches(one, two, tangent, np.maximum(pushed, 0.0), contacts)
    holds = np.abs(both.sticking) < np.abs(both.sliding)
    other = np.where(holds, both.sliding, both.sticking)
    # `least_difference` is an impulse: a velocity change, divided by the sum of the bodies' inverse masses.
    least_difference = rounding * scales.rim_m_s / lightness
    wrong = (np.abs(rubbed - other) < np.abs(rubbed - both.law)) & (np.abs(other - both.law) > least_difference)
    known = ~wall if trace.scene.wall_rolling_resistance else np.ones(len(impacts), dtype=np.bool_)
    if trace.effective_time_s is not None:
        known &= np.isfinite(trace.effective_time_s)
    wrong &= known & find_finite_impacts(trace)
    return WrongBranches(*(tuple(np.flatnonzero(wrong & side).tolist()) for side in (holds, ~holds)))
