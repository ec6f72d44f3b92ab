"""Intervals of contact between discs and walls: gap, overlap, hops, and how late bounces and slips end."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.comparator.stepwise.rest import RESTING_STEPS
from carom.model.step_windows import States
from carom.model.trace import Mode, Trace, wall_index

Array = NDArray[np.float64]

#: Number of final states over which the speed of a disc is averaged, because jitter alternates between states.
LAST = 8


class ContactInterval(NamedTuple):
    """A disc in contact with one half-plane: the wall's body number and normal, and from when to when."""

    disc: int
    wall: int
    normal: tuple[float, float]
    begin_s: float
    end_s: float


class ContactQuality(NamedTuple):
    """How well a run keeps discs on their walls; NaN where none was observed there.

    Attributes:
        gap_m: How far off its wall a disc is on average at the end, of that which is farthest off: negative in overlap.
        overlap_m: The deepest overlap in contact.
        hop_m_s: How fast, at the end, a disc goes off and into its wall, root mean square.
        take_offs: In which part of the states a disc leaves its wall faster than by half of what it falls in a step.
    """

    gap_m: float
    overlap_m: float
    hop_m_s: float
    take_offs: float


class Ends(NamedTuple):
    """How late a run ends bounces and slips, seconds, negative if early; NaN where that is not known.

    Attributes:
        bounces_s: To end its bounces: to no longer be faster, off or into a wall, than by what it falls in a few steps.
        slips_s: To end its slips: to no longer slip faster than friction changes in a few steps.
    """

    bounces_s: float
    slips_s: float


def find_contact_intervals(reference: Trace) -> list[ContactInterval]:
    """Return where discs of the reference are in contact with half-planes."""
    walls, found = reference.scene.arrays.walls, list[ContactInterval]()
    if reference.modes is None:
        return found
    begun: dict[int, tuple[int, float]] = {}
    over = [(int(row["disc"]), int(row["wall"]), float(row["time_s"]), int(row["after"])) for row in reference.modes]
    over += [(disc, 0, reference.end_time_s, Mode.FLIGHT) for disc in range(len(reference.scene.discs))]
    for disc, wall, time_s, after in over:
        if after != Mode.FLIGHT:
            begun.setdefault(disc, (wall, time_s))
        elif disc in begun:
            of, begin_s = begun.pop(disc)
            if isinstance(face := walls[wall_index(of)], tuple):
                found.append(ContactInterval(disc, of, face[2:], begin_s, time_s))
    return found


def measure_contact_quality(reference: Trace, truth: States, seen: States, dt_s: float) -> ContactQuality:
    """Measure how well a run keeps discs on their walls, where the reference is in contact at the same instants."""
    slow = 0.5 * math.hypot(*reference.scene.gravity_m_s2) * dt_s
    gaps, depths, hops, left = [math.nan], [math.nan], [math.nan], [math.nan]
    for touch in find_contact_intervals(reference):
        inside = (seen.time_s >= touch.begin_s) & (seen.time_s <= touch.end_s)
        if not inside.any():
            continue
        gap = (seen.position_m - truth.position_m)[inside, touch.disc] @ touch.normal
        speed = seen.velocity_m_s[inside, touch.disc] @ touch.normal
        depths.append(float(np.max(-gap)))
        left.append(float(np.mean(speed > slow)))
        if inside[-1]:
            gaps.append(float(np.mean(gap[-LAST:])))
            hops.append(math.sqrt(float(np.mean(speed[-LAST:] ** 2))))
    farthest = max(gaps, key=lambda gap: -1.0 if math.isnan(gap) else abs(gap))
    return ContactQuality(farthest, *(float(np.fmax.reduce(of)) for of in (depths, hops, left)))


def measure_late_ends(reference: Trace, truth: States, seen: States, dt_s: float, until_s: float) -> Ends:
    """Measure how late a run ends bounces and slips, by states at the same instants from the start on.

    In both runs the last state counts that is faster than `RESTING_STEPS` steps change. So hops and slips that no step
    shows count for neither.
    """
    arrays, few = reference.scene.arrays, RESTING_STEPS * dt_s
    bounces, slips = [math.nan], [math.nan]
    for touch in find_contact_intervals(reference):
        if touch.begin_s > until_s:
            continue
        rows = truth.time_s <= min(touch.end_s, until_s)
        (nx, ny), (gx, gy) = touch.normal, reference.scene.gravity_m_s2
        if touch.begin_s > 0.0:
            fast = RESTING_STEPS * math.hypot(gx, gy) * dt_s
            found = [np.abs(of.velocity_m_s[rows, touch.disc] @ touch.normal) for of in (truth, seen)]
            bounces.append(_late(truth.time_s[rows], found[0], found[1], fast))
        friction = arrays.materials[wall_index(touch.wall)].friction
        if not friction or seen.spin_rad_s is None or truth.spin_rad_s is None:
            continue
        pressed = -(gx * nx + gy * ny) * friction * (1.0 + 1.0 / float(arrays.inertia[touch.disc]))
        rim = float(arrays.radius_m[touch.disc])
        slip = [
            np.abs(of.velocity_m_s[rows, touch.disc] @ np.array([ny, -nx]) + rim * of.spin_rad_s[rows, touch.disc])
            for of in (truth, seen)
            if of.spin_rad_s is not None
        ]
        slips.append(_late(truth.time_s[rows], slip[0], slip[1], pressed * few))
    return Ends(*(max(of, key=lambda late: -1.0 if math.isnan(late) else abs(late)) for of in (bounces, slips)))


def _late(times_s: Array, truth: Array, seen: Array, fast: float) -> float:
    """Return how much later the last fast state is in the observed run than in the reference."""
    last = [np.flatnonzero(speeds > fast) for speeds in (truth, seen)]
    at_s = [float(times_s[rows[-1]]) if len(rows) else 0.0 for rows in last]
    return at_s[1] - at_s[0]
