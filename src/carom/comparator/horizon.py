"""Horizons: how many impacts of a PIC trace are reliable in spite of rounding.

A horizon is either proven by interval arithmetic, or estimated from a second run that starts in a slightly different
state.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.comparator.match_impacts import group_by_pair
from carom.comparator.scales import find_largest
from carom.errors import InputError, SceneError
from carom.model.scene import Disc, Scene, to_scene
from carom.model.trace import Mode, Outcome, Trace, rim_speeds, velocities
from carom.solvers.certified.certify import certify
from carom.solvers.certified.result import CertifiedTrace
from carom.solvers.pic import solve_pic

# Largest relative error of a reliable reference. The docstring of `Horizon` lists the quantities by which errors are
# divided. The value is a thousand times the rounding threshold of the verdicts, and at most a thousandth of PIT's
# errors at usual step sizes. So the results do not depend on the exact value.
RELIABLE_ERROR = 1e-9


@dataclass(frozen=True)
class Horizon:
    """The number of impacts for which a PIC trace agrees with a certified trace, whose error bounds are proven.

    Attributes:
        tolerance: Largest relative error at which an impact still agrees. Time errors are divided by the scene's
            duration. Errors of velocities and rim speeds are divided by the greatest speed at the start. With gravity
            or driven bodies, the greatest speed of the whole run is used.
        agreed: Number of impacts before the first impact that does not agree within the tolerance.
        order_differs: Index of the first impact whose bodies differ from those of the certified impact with the same
            index; None if there is none.
        certified: Number of impacts whose error bounds are proven.
        complete: Whether all impacts of the scene were certified.
        end_s: Time up to which the reference is reliable: the end of the scene, or the last impact that agrees. A run
            is not compared with the reference after this time.

    Examples:
        >>> found = carom.horizon("paper/late")
        >>> found.agreed, found.complete
        (1, True)
    """

    tolerance: float
    agreed: int
    order_differs: int | None
    certified: int
    complete: bool
    end_s: float

    @property
    def covers_the_scene(self) -> bool:
        """Whether all impacts of the scene were certified, and all agree."""
        return self.complete and self.agreed == self.certified and self.order_differs is None

    def __str__(self) -> str:
        reach = describe_certified_impacts(self.certified, complete=self.complete)
        if self.covers_the_scene:
            return f"{reach}; PIC agrees to {self.tolerance:g} in all impacts"
        parts = f"{reach}; PIC agrees to {self.tolerance:g} up to impact {self.agreed}"
        if self.order_differs is not None:
            parts += f", and the order of impacts differs from impact {self.order_differs + 1} on"
        return parts


def describe_certified_impacts(count: int, *, complete: bool) -> str:
    """Describe in words how many impacts of a scene are certified."""
    if count == 0:
        return "no impact is certified"
    which = "all" if complete else "the first"
    if count > 1:
        return f"{which} {count} impacts are certified"
    return "the only impact is certified" if complete else "the first impact is certified"


def horizon(
    scene: Scene | str,
    *,
    tolerance: float = RELIABLE_ERROR,
    max_impacts: int | None = None,
    time_budget_s: float | None = None,
) -> Horizon:
    """Return the number of impacts for which PIC agrees with a certified run, whose error bounds are proven.

    Args:
        scene: The scene, or its name in the catalogue.
        tolerance: Largest relative error at which an impact still agrees; see `Horizon`.
        max_impacts: Largest number of impacts to compare; None for no limit.
        time_budget_s: Largest number of seconds that the certified run may take; None for no limit.

    Raises:
        InputError: The tolerance is not above 0.
        MissingExtraError: python-flint is not installed.

    Examples:
        >>> carom.horizon("classics/gas").agreed
        45
    """
    scene = to_scene(scene)
    trace = solve_pic(scene, max_impacts=max_impacts)
    if trace.outcome is Outcome.CRUSHED:  # without this limit, the certified run may not end
        max_impacts = len(trace.impacts)
    certified = certify(scene, max_impacts=max_impacts, time_budget_s=time_budget_s)
    return compute_horizon(certified, trace, tolerance=tolerance)


def compute_horizon(certified: CertifiedTrace, trace: Trace, *, tolerance: float = RELIABLE_ERROR) -> Horizon:
    """Return the number of impacts for which a trace agrees with a certified run of the same scene.

    Two impacts may be in either order if the order provably does not change their results.

    Raises:
        InputError: The traces are of different scenes, or the tolerance is not above 0.
    """
    if certified.trace.scene != trace.scene:
        raise InputError(f"the certified run is of scene {certified.trace.scene.name!r}, but the trace is not")
    if not 0 < tolerance < math.inf:
        raise InputError(f"the tolerance must be above 0, got {tolerance}")
    scene, truth = trace.scene, certified.trace.impacts
    order = _sort_as_certified(certified, trace, tolerance * scene.duration_s)
    found = trace.impacts[order]
    complete = certified.trace.end_time_s == scene.duration_s
    common = min(len(found), len(truth))
    is_same_pair = truth[["first", "second"]][:common] == found[["first", "second"]][:common]
    order_differs = int(is_same_pair.argmin()) if not is_same_pair.all() else None
    if order_differs is None and len(found) != len(truth) and complete:
        order_differs = common
    # The error includes the error bounds of the certified numbers. So an impact agrees only if the agreement is proven.
    speed = max([1e-300, *(math.hypot(*disc.velocity_m_s) for disc in scene.discs)])
    if scene.gravity_m_s2 != (0.0, 0.0) or scene.arrays.driven:  # discs that start at rest can gain speed
        speed = find_largest([speed, *np.hypot(*velocities(truth, "after").reshape(-1, 2).T)])
    end = common if order_differs is None else order_differs
    rims = np.zeros(end)
    if trace.spins is not None and certified.trace.spins is not None and certified.spin_radii is not None:
        speed = max(speed, float(np.abs(scene.arrays.surface_speed_m_s).max()))
        for side in ("first", "second"):
            spins = [rows[f"{side}_after"][:end] for rows in (trace.spins[order], certified.trace.spins)]
            radius = np.append(scene.arrays.radius_m, 0.0)[np.maximum(truth[side][:end], -1)]
            spin_error = np.abs(spins[0] - spins[1]) + certified.spin_radii[f"{side}_after"][:end]
            rims = np.maximum(rims, radius * spin_error / speed)
    radii = certified.radii[:end]
    error = _compute_largest_differences(found[:end], truth[:end], scene.duration_s, speed, radii)
    beyond = np.flatnonzero(~(np.maximum(error, rims) <= tolerance))
    agreed = int(beyond[0]) if len(beyond) else end
    is_whole_run = complete and agreed == len(truth) and order_differs is None
    end_s = scene.duration_s if is_whole_run else float(truth["time_s"][agreed - 1]) if agreed else 0.0
    return Horizon(tolerance, agreed, order_differs, len(truth), complete, end_s)


def _compute_largest_differences(
    one: NDArray[np.void], two: NDArray[np.void], time_s: float, speed_m_s: float, radii: NDArray[np.void] | None = None
) -> NDArray[np.float64]:
    """Return, for each impact, the largest relative difference between the numbers of `one` and `two`.

    The compared numbers are the time and the velocities after the impact. If one of them is NaN, the result is NaN.
    """
    found = np.zeros(len(one))
    for name, scale in (("time_s", time_s), ("velocity_first_after", speed_m_s), ("velocity_second_after", speed_m_s)):
        difference = np.abs(one[name] - two[name]) + (0.0 if radii is None else radii[name])
        found = np.maximum(found, difference.max(axis=tuple(range(1, difference.ndim))) / scale)
    return found


def _sort_as_certified(certified: CertifiedTrace, trace: Trace, alike_s: float) -> NDArray[np.intp]:
    """Return the indices of a trace's impacts in the certified run's order.

    Impacts are swapped only if the certified run proves that their order does not matter.

    If a disc lands and stays on a wall in the certified run, bounces of the trace at nearly the same time are omitted.
    """
    truth, order = certified.trace.impacts, np.flatnonzero(~_find_landing_bounces(certified.trace, trace, alike_s))
    found = trace.impacts[order]
    bodies = ["first", "second"]
    for a, b in certified.commuted:
        swapped = b < len(found) and found[a][bodies] == truth[b][bodies] and found[b][bodies] == truth[a][bodies]
        if swapped:
            found[[a, b]], order[[a, b]] = found[[b, a]], order[[b, a]]
    return order


def _find_landing_bounces(certified: Trace, trace: Trace, alike_s: float) -> NDArray[np.bool_]:
    """Find a trace's additional bounces where a disc lands and stays on a wall in the certified run."""
    parts = np.zeros(len(trace.impacts), bool)
    for mode in () if certified.modes is None else certified.modes[certified.modes["before"] == Mode.FLIGHT]:
        theirs, ours = (
            (rows["first"] == mode["disc"])
            & (rows["second"] == mode["wall"])
            & (rows["time_s"] <= mode["time_s"] + alike_s)
            for rows in (trace.impacts, certified.impacts)
        )
        additional = np.flatnonzero(theirs)[int(ours.sum()) :]
        parts[additional] = trace.impacts["time_s"][additional] >= mode["time_s"] - alike_s
    return parts


def estimate_horizon(reference: Trace) -> float | None:
    """Estimate the time up to which a trace by `carom.solve_pic` is reliable.

    Return None if the whole trace is reliable, has no impact, or has an impact without a unique result.

    The scene is solved a second time, from an initial state in which each number differs by one unit in the last place.
    Rounding changes the state after each impact by a similar amount. So neither run is reliable after the two runs
    diverge. The result is only an estimate; `carom certify` gives a proof.
    """
    scene = reference.scene
    if reference.ambiguous or not len(reference.impacts):
        return None
    try:
        nudged = _nudge(scene, positions=True)
    except SceneError:  # discs that touch may overlap after the change
        nudged = _nudge(scene, positions=False)
    other = solve_pic(nudged, max_impacts=len(reference.impacts))
    if not len(other.impacts):
        return 0.0
    one, times = reference.impacts, reference.impacts["time_s"]
    # Match the n-th impact of each pair with the pair's n-th impact in the other run (-1: no match). Nearly
    # simultaneous impacts of different pairs may be swapped between the runs.
    matching_rows, other_rows = np.full(len(one), -1, dtype=np.intp), group_by_pair(other.impacts)
    for pair, indices in group_by_pair(one).items():
        found = other_rows.get(pair, [])[: len(indices)]
        matching_rows[indices[: len(found)]] = found
    # An impact at the end of the scene may be missing from one run because of rounding.
    last = times > scene.duration_s * (1.0 - RELIABLE_ERROR)
    speed = float(np.max(np.abs([velocities(one, "before"), velocities(one, "after")])))
    matched = np.maximum(matching_rows, 0)
    rims = rim_speeds(reference, "after"), rim_speeds(other, "after")[:, matched]
    speed = max(speed, float(np.max(np.abs(rims))))
    error = _compute_largest_differences(one, other.impacts[matched], scene.duration_s, speed)
    error = np.maximum(error, np.max(np.abs(rims[0] - rims[1]), axis=0) / speed)
    # A NaN counts as a difference between the runs.
    differs = ~(error <= RELIABLE_ERROR)
    diverged = np.where(matching_rows < 0, ~last, differs)
    if not diverged.any():
        return None
    return max(0.0, float(np.nextafter(times[int(np.argmax(diverged))], -math.inf)))


def _nudge(scene: Scene, *, positions: bool) -> Scene:
    """Change each velocity and spin by one unit in the last place, and also each position if `positions` is true.

    Zeros stay zero, because a number that is 0 by symmetry has no rounding error.
    """
    rng, start = np.random.default_rng(0), scene.arrays
    signs = rng.choice([-math.inf, math.inf], size=(len(scene.discs), 4))
    turns = rng.choice([-math.inf, math.inf], size=len(scene.discs))
    numbers = ((start.position_m, signs[:, :2]), (start.velocity_m_s, signs[:, 2:]), (start.spins, turns))
    places, speeds, spins = (np.where(x == 0.0, x, np.nextafter(x, towards)).tolist() for x, towards in numbers)
    if not positions:
        places = start.position_m.tolist()
    nudged = zip(scene.discs, places, speeds, spins, strict=True)
    discs = [
        disc
        if disc.immovable
        else Disc(**{**dict(disc), "position_m": tuple(place), "velocity_m_s": tuple(velocity), "spin_rad_s": spin})
        for disc, place, velocity, spin in nudged
    ]
    return Scene(**{**dict(scene), "discs": discs})
