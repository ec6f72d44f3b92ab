"""Scenes of the group `classics` with two discs and one impact or none. Formulas give the answers."""

from __future__ import annotations

import cmath
import math

from carom.catalogue.entry import Staged
from carom.catalogue.staging import build_disc, build_impact, stage, stage_meeting


def _head_on() -> Staged:
    """A disc of 1 kg and a disc of 3 kg meet head-on with restitution 1/2."""
    return stage_meeting((4, -2), (0.2, 0.3), mass_kg=(1.0, 3.0), restitution=0.5, time_s=0.71, duration_s=1.5)


def _oblique_3_4_5() -> Staged:
    """A disc at 5 m/s strikes an equal disc at rest. The discs leave at 3 and 4 m/s, at a right angle."""
    # The struck disc gets the striker's velocity along the normal (4, 3)/5, which is 4 m/s. The striker keeps its
    # velocity of 3 m/s across the normal.
    source = "Equal masses exchange the velocities along the normal: 5 m/s splits into 4 and 3 at a right angle"
    return stage_meeting((5, 0), (0.25, 0.25), offset=3 / 5, time_s=0.42, duration_s=1.25, source=source)


def _inelastic_oblique() -> Staged:
    """Two unequal discs, both moving, meet off centre with restitution 1/2."""
    return stage_meeting(
        (3 + 1j, -2 + 0.5j), (0.3, 0.2), mass_kg=(2.0, 1.0), offset=-0.4, restitution=0.5, time_s=0.57, duration_s=1.5
    )


def _perfectly_inelastic() -> Staged:
    """A disc hits an equal disc at rest with restitution 0, and both move on together."""
    # All numbers are exact as floats, because a rounded common velocity could cause a second impact.
    return stage_meeting((4, 0), (0.25, 0.25), restitution=0.0, time_s=0.71875, duration_s=1.5)


def _deflection() -> Staged:
    """A disc bounces off an immovable disc, and is deflected by 120 degrees."""
    radius, fixed, speed, start_x = 0.2, 0.3, 4.0, -2.1
    contact = radius + fixed
    miss_distance = contact / 2
    discs = [build_disc(complex(start_x, -miss_distance), speed, radius), build_disc(0, 0, fixed, math.inf)]
    time = (-start_x - math.sqrt(contact**2 - miss_distance**2)) / speed
    deflection = math.pi - 2 * math.asin(miss_distance / contact)
    # The fixed disc is to the left of the path, so the moving disc turns to the right.
    after = speed * cmath.exp(-1j * deflection)
    source = (
        "A rigid sphere deflects by the angle pi - 2 asin(b/R): Landau and Lifshitz, Mechanics, section 18, problem 1"
    )
    return stage(discs, [build_impact(time, 0, 1, after, 0)], source, duration_s=1.25)


def _graze() -> Staged:
    """A disc grazes another: its path leads past the other centre at 0.999 times the sum of the radii."""
    return stage_meeting((3, 0), (0.3, 0.2), offset=0.999, time_s=0.61, duration_s=1.25)


def _miss() -> Staged:
    """A disc passes another without an impact: their centres are never nearer than 1.001 times the sum of the radii."""
    # The discs are nearest after .6 s.
    contact, speed, nearest = 0.5, 3.0, 0.6
    discs = [build_disc(-speed * nearest, speed, 0.3), build_disc(1.001j * contact, 0, 0.2)]
    return stage(discs, [], "The smallest distance of the centres exceeds the sum of the radii", duration_s=1.25)


def _touching_apart() -> Staged:
    """Two discs touch at the start and move apart, so there is no impact."""
    radius = 0.25
    discs = [build_disc(-radius, -1 + 0.5j, radius), build_disc(radius, 2 + 0.25j, radius)]
    return stage(discs, [], "Bodies that do not approach exchange no impulse", duration_s=1.0)


def _mass_ratio_1000() -> Staged:
    """A disc of 500 kg strikes a disc of half a kilogram."""
    return stage_meeting((2, 0), (0.5, 0.1), mass_kg=(500.0, 0.5), offset=0.3, time_s=0.43, duration_s=1.25)


def _bullet() -> Staged:
    """A small disc at 100 m/s, which could pass its target between two frames, strikes another disc."""
    # The disc moves 1.7 m between two frames, and the target is 0.5 m wide.
    return stage_meeting((100, 0), (0.05, 0.25), mass_kg=(0.1, 2.0), offset=-0.3, time_s=0.171, duration_s=0.5)
