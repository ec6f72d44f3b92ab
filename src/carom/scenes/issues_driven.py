"""Complaints about bodies that are driven: mallets that a puck passes, or leaves as if they stood."""

from __future__ import annotations

import math

from carom.scenes.closed_forms import after_impact, answered, disc, impact, scene_of
from carom.scenes.complaint import complained, misses
from carom.scenes.entry import Staged

_LAW = "Newton's law in the frame of the driven body: v' = V - e (v - V) along the line of centres"


def _at_a_mallet(velocity: complex, drive: complex, normal: complex, *, time_s: float) -> Staged:
    """Stage a puck that meets a mallet; `normal` leads from puck to mallet when they meet."""
    radius, mallet_radius = 0.0625, 0.125
    puck, mallet = -velocity * time_s, (radius + mallet_radius) * normal - drive * time_s
    discs = [disc(puck, velocity, radius), disc(mallet, drive, mallet_radius, math.inf, driven=True)]
    scene = scene_of(discs, duration_s=2.0 * time_s)
    after, _ = after_impact(1.0, velocity, math.inf, drive, normal)
    return answered(scene, [impact(time_s, 0, 1, after, drive)], _LAW)


@misses(
    thread="https://github.com/NITDgpOS/AirHockey/issues/30",
    reported="A puck often passes a paddle where both move; and what it leaves at lacks the velocity of the paddle.",
    made="The thread has no scene: both come head-on, by more than their reach in a frame; all sizes are ours.",
)
def _airhockey_30() -> Staged:
    """Puck and mallet come at one another, and go past each other between two frames."""
    return _at_a_mallet(-8 + 0j, 12 + 0j, -1 + 0j, time_s=0.255)


@complained(
    thread="https://github.com/NITDgpOS/AirHockey/issues/56",
    reported="A puck that a paddle strikes with its side or its back does not change its velocity; head-on it does.",
    made="The sides are the thread's: the mallet overtakes the puck, and strikes it aslant; all sizes are ours.",
)
def _airhockey_56() -> Staged:
    """A mallet overtakes a slow puck, and strikes it from behind, aslant."""
    return _at_a_mallet(0.25 + 0.125j, 1.5 + 0j, -0.8 - 0.6j, time_s=0.405)
