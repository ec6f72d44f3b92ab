"""Intervals in which discs slide, roll or rest in the reference, and how late their ends are in a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from carom.comparator.scales import Array
from carom.comparator.stepwise.resting_pairs import RESTING_STEPS
from carom.model.step_windows import States
from carom.model.trace import Mode, Trace, wall_index

#: Number of final states over which a disc's speed is averaged, because a disc that jitters is fast in one state and
#: slow in the next.
LAST = 8


class ContactInterval(NamedTuple):
    """Time interval in which a disc is in contact with a half-plane wall, with the wall's body number and normal."""

    disc: int
    wall: int
    normal: tuple[float, float]
    begin_s: float
    end_s: float


class ContactQuality(NamedTuple):
    """Gaps and hops of discs that should stay on their walls; NaN if no contact was observed.

    Attributes:
        gap_m: Distance between a disc and its wall, averaged over the final states; negative for an overlap. The value
            is that of the disc with the largest gap or overlap.
        hop_m_s: Root mean square of a disc's speed perpendicular to its wall, over the final states.
        take_offs: Fraction of the states in which a disc moves away from its wall faster than half the speed gained by
            falling for one step.
    """

    gap_m: float
    hop_m_s: float
    take_offs: float


class Ends(NamedTuple):
    """How late the discs of a run stop bouncing and stop sliding, in seconds; negative if early, NaN if unknown.

    Attributes:
        bounces_s: Lateness of the last state in which a disc's speed perpendicular to its wall exceeds the speed gained
            by falling for `RESTING_STEPS` steps.
        slips_s: Lateness of the last state in which friction needs more than `RESTING_STEPS` steps to stop a sliding
            disc.
    """

    bounces_s: float
    slips_s: float


def find_contact_intervals(reference: Trace) -> list[ContactInterval]:
    """Return the intervals in which discs of the reference are in contact with half-plane walls."""
    walls, found = reference.scene.arrays.walls, list[ContactInterval]()
    if reference.modes is None:
        return found
    begins: dict[int, tuple[int, float]] = {}
    mode_changes = [
        (int(row["disc"]), int(row["wall"]), float(row["time_s"]), int(row["after"])) for row in reference.modes
    ]
    mode_changes += [(disc, 0, reference.end_time_s, Mode.FLIGHT) for disc in range(len(reference.scene.discs))]
    for disc, wall, time_s, after in mode_changes:
        if after != Mode.FLIGHT:
            begins.setdefault(disc, (wall, time_s))
        elif disc in begins:
            begin_wall, begin_s = begins.pop(disc)
            if isinstance(face := walls[wall_index(begin_wall)], tuple):
                found.append(ContactInterval(disc, begin_wall, face[2:], begin_s, time_s))
    return found


def measure_contact_quality(reference: Trace, truth: States, observed: States, dt_s: float) -> ContactQuality:
    """Measure gaps and hops of discs at instants at which they touch walls in the reference."""
    slow = 0.5 * math.hypot(*reference.scene.gravity_m_s2) * dt_s
    gaps, hops, left = [math.nan], [math.nan], [math.nan]
    for touch in find_contact_intervals(reference):
        inside = (observed.time_s >= touch.begin_s) & (observed.time_s <= touch.end_s)
        if not inside.any():
            continue
        gap = (observed.position_m - truth.position_m)[inside, touch.disc] @ touch.normal
        speed = observed.velocity_m_s[inside, touch.disc] @ touch.normal
        left.append(float(np.mean(speed > slow)))
        if inside[-1]:
            gaps.append(float(np.mean(gap[-LAST:])))
            hops.append(math.sqrt(float(np.mean(speed[-LAST:] ** 2))))
    return ContactQuality(_find_largest_known(gaps), float(np.fmax.reduce(hops)), float(np.fmax.reduce(left)))


def measure_late_ends(reference: Trace, truth: States, observed: States, dt_s: float, until_s: float) -> Ends:
    """Measure how late the discs of a run stop bouncing and sliding, from states of both runs at the same instants.

    A disc counts as stopped when it stays slower than the speed gained or lost in `RESTING_STEPS` steps. So hops and
    slides that are too small for this step size are ignored in both runs.
    """
    arrays, few = reference.scene.arrays, RESTING_STEPS * dt_s
    bounces, slips = [math.nan], [math.nan]
    for touch in find_contact_intervals(reference):
        if touch.begin_s > until_s:
            continue
        rows = truth.time_s <= min(touch.end_s, until_s)
        times_s = truth.time_s[rows]
        velocity = [states.velocity_m_s[rows, touch.disc] for states in (truth, observed)]
        (nx, ny), (gx, gy) = touch.normal, reference.scene.gravity_m_s2
        if touch.begin_s > 0.0:
            hops = [np.abs(of_states @ touch.normal) for of_states in velocity]
            bounces.append(_measure_lateness(times_s, hops, RESTING_STEPS * math.hypot(gx, gy) * dt_s))
        friction = arrays.materials[wall_index(touch.wall)].friction
        if not friction or observed.spin_rad_s is None:
            continue
        slip_deceleration = -(gx * nx + gy * ny) * friction * (1.0 + 1.0 / float(arrays.inertia[touch.disc]))
        rim, along = float(arrays.radius_m[touch.disc]), np.array([ny, -nx])
        rims = [rim * states.spins[rows, touch.disc] for states in (truth, observed)]
        slip = [np.abs(of_states @ along + spun) for of_states, spun in zip(velocity, rims, strict=True)]
        slips.append(_measure_lateness(times_s, slip, slip_deceleration * few))
    return Ends(_find_largest_known(bounces), _find_largest_known(slips))


def _find_largest_known(values: list[float]) -> float:
    """Return the value with the largest magnitude; NaN if all are NaN."""
    return max(values, key=lambda value: -1.0 if math.isnan(value) else abs(value))


def _measure_lateness(times_s: Array, speeds: Sequence[Array], fast: float) -> float:
    """Return how much later the last fast state is in the observed run than in the reference, in seconds.

    `speeds` contains the speeds in the reference, and then those in the observed run.
    """
    expected_s, found_s = (float(np.max(times_s[speed > fast], initial=0.0)) for speed in speeds)
    return found_s - expected_s
