"""How far float64 can be believed: where a PIC run parts from the certified run of its scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from carom.comparator.scales import largest
from carom.errors import InputError
from carom.scene import Scene
from carom.solvers.certified import CertifiedTrace, certify
from carom.solvers.pic import solve_pic
from carom.trace import Trace

__all__ = ["DEFAULT_TOLERANCE", "Horizon", "horizon", "horizon_of"]

#: Times over the scene's duration, velocities over its greatest speed: what a reference should be good for beside
#: engines that compute in float32 (1e-7).
DEFAULT_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Horizon:
    """How far a float64 trace agrees with the certified one.

    Attributes:
        tolerance: Largest error of a time over the scene's duration, and of a velocity over the greatest speed: that of
            the start or, under gravity, after any impact, where it is greater.
        agreed: How many impacts, from the first, agree to the tolerance.
        order_differs: Index of the first impact that is of other bodies than the certified one; None where none is.
        certified: How many impacts were certified.
        complete: Whether they are all impacts of the scene.
        end_s: Time up to which the reference may be believed: the end of the scene, or that of the last impact that
            agrees. What comes later is not scored globally.
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
        reach = f"certified to impact {self.certified}{', the last' if self.complete else ''}"
        if self.covers_the_scene:
            return f"{reach}; float64 agrees to {self.tolerance:g} in all of them"
        parts = f"{reach}; float64 agrees to {self.tolerance:g} up to impact {self.agreed}"
        if self.order_differs is not None:
            parts += f", and the order of impacts differs from impact {self.order_differs + 1} on"
        return parts


def horizon(
    scene: Scene,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    max_impacts: int | None = None,
    time_budget_s: float | None = None,
) -> Horizon:
    """Return how far float64 PIC agrees with the certified run of a scene.

    Args:
        scene: The scene.
        tolerance: Largest error of a time over the scene's duration, and of a velocity over the greatest speed.
        max_impacts: Look no further than this impact; None for no limit.
        time_budget_s: Seconds for the certified run; None for no limit.

    Raises:
        InputError: The tolerance is not above 0, or the scene has immovable discs under gravity.
        MissingExtraError: python-flint is not installed.
    """
    certified = certify(scene, max_impacts=max_impacts, time_budget_s=time_budget_s)
    return horizon_of(certified, solve_pic(scene, max_impacts=max_impacts), tolerance=tolerance)


def horizon_of(certified: CertifiedTrace, trace: Trace, *, tolerance: float = DEFAULT_TOLERANCE) -> Horizon:
    """Return how far a trace agrees with a certified run of the same scene.

    Impacts whose order makes no difference may stand either way round.

    Raises:
        InputError: The traces are of different scenes, or the tolerance is not above 0.
    """
    if certified.trace.scene != trace.scene:
        raise InputError(f"the certified run is of scene {certified.trace.scene.name!r}, the trace of another")
    if not 0 < tolerance < math.inf:
        raise InputError(f"tolerance must be above 0, got {tolerance}")
    scene, truth = trace.scene, certified.trace.impacts
    found = _in_certified_order(certified, trace)
    common = min(len(found), len(truth))
    same = np.array([(truth[k][["first", "second"]] == found[k][["first", "second"]]) for k in range(common)], bool)
    order_differs = int(same.argmin()) if not same.all() else None
    if order_differs is None and len(found) != len(truth) and certified_whole(certified):
        order_differs = common
    # Radii are part of the error: what was not proven to the tolerance does not agree to it.
    speed = max([1e-300, *(math.hypot(*disc.velocity_m_s) for disc in scene.discs)])
    if scene.gravity_m_s2 != (0.0, 0.0):  # what starts at rest gains speed
        after = [truth[name] for name in ("velocity_first_after", "velocity_second_after") if len(truth)]
        speed = largest([speed, *(float(np.hypot(*velocity.T).max()) for velocity in after)])
    end = common if order_differs is None else min(order_differs, common)
    error = np.zeros(end)
    for name, scale in (
        ("time_s", scene.duration_s),
        ("velocity_first_after", speed),
        ("velocity_second_after", speed),
    ):
        apart = (np.abs(found[name][:end] - truth[name][:end]) + certified.radii[name][:end]) / scale
        error = np.maximum(error, apart.reshape(end, apart.size // max(end, 1)).max(axis=1, initial=0.0))
    beyond = np.flatnonzero(~(error <= tolerance))
    agreed = int(beyond[0]) if len(beyond) else end
    complete = certified_whole(certified)
    whole = complete and agreed == len(truth) and order_differs is None
    end_s = scene.duration_s if whole else float(truth["time_s"][agreed - 1]) if agreed else 0.0
    return Horizon(tolerance, agreed, order_differs, len(truth), complete, end_s)


def certified_whole(certified: CertifiedTrace) -> bool:
    """Whether a run is certified to the end of its scene."""
    return certified.trace.end_time_s == certified.trace.scene.duration_s


def _in_certified_order(certified: CertifiedTrace, trace: Trace) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """Return the trace's impacts; two that commute stand as the certified run has them."""
    found, truth = trace.impacts.copy(), certified.trace.impacts
    bodies = ["first", "second"]
    for a, b in certified.commuted:
        swapped = b < len(found) and found[a][bodies] == truth[b][bodies] and found[b][bodies] == truth[a][bodies]
        if swapped:
            found[[a, b]] = found[[b, a]]
    return found
