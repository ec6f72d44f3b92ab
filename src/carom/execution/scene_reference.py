"""Reference of a scene: a trace of PIC or of a certified run, and the time up to which the trace is reliable."""

from __future__ import annotations

import math
from typing import NamedTuple

from carom.comparator import Horizon, compute_horizon
from carom.comparator.horizon import describe_certified_impacts, estimate_horizon
from carom.comparator.non_finite import find_non_finite
from carom.comparator.shifted_scenes import shift_start
from carom.errors import InputError, MissingExtraError
from carom.execution.job import Job, UnsupportedError
from carom.model.scene import Scene
from carom.model.trace import Outcome, Trace
from carom.solvers.certified.certify import certify
from carom.solvers.pic import solve_pic
from carom.support.formatting import format_instant
from carom.support.limits import CERTIFY_SECONDS

#: Largest number of impacts of a reference in a cross-check. Each impact needs memory.
MOST_IMPACTS = 200_000

#: Largest number of discs in a scene that is certified by default. A certified run stores bounds for all pairs of
#: discs.
MOST_DISCS = 1000
#: Smallest number of discs in a scene that is certified by default. A formula solves scenes with fewer discs.
FEWEST_DISCS = 3


class Reference(NamedTuple):
    """Trace with which all runs of a scene are compared.

    Attributes:
        trace: The PIC trace, or the certified trace.
        certified: Comparison of PIC with the certified run, or why there is no comparison; None if no certified run was
            requested.
        horizon_s: Time from which `trace` is not reliable, or at which lasting contact begins; None if neither happens.
        pic: The PIC trace, if `trace` is the certified trace.
    """

    trace: Trace
    certified: Horizon | str | None = None
    horizon_s: float | None = None
    pic: Trace | None = None


def solve_reference(scene: Scene) -> Trace | str:
    """Solve a scene with PIC. Return the trace, or the reason why there is no trace."""
    try:
        trace = solve_pic(scene, max_impacts=MOST_IMPACTS)
    except InputError as error:
        return str(error)
    if trace.outcome is Outcome.MAX_IMPACTS:
        limit = f"{MOST_IMPACTS} impacts happen before {format_instant(trace.end_time_s)}"
        lasts = f"the scene lasts {scene.duration_s:g} s"
        return f"{limit}, but {lasts}; a cross-check stops at this number of impacts, so shorten duration_s"
    if broken := find_non_finite(trace):
        return f"PIC's own result is not a number: {broken}"
    return trace


def shift_to_phase(job: Job) -> Scene:
    """Return a job's scene, shifted so that the scene begins earlier by the job's phase.

    Raises:
        UnsupportedError: The scene can't begin earlier by this phase.
    """
    try:
        return shift_start(job.scene, job.phase * job.dt_s)
    except InputError as error:
        raise UnsupportedError(str(error)) from None


def require_reference(reference: Trace | str) -> Trace:
    """Return the trace that `solve_reference` found.

    Raises:
        UnsupportedError: There is no reference.
    """
    if isinstance(reference, str):
        raise UnsupportedError(reference)
    return reference


def needs_certification(scene: Scene, is_requested: bool | None) -> bool:
    """Whether to compute a certified run of a scene. See `build_reference` for `is_requested`."""
    return bool(is_requested) or (is_requested is None and len(scene.discs) >= FEWEST_DISCS)


def build_reference(trace: Trace, is_requested: bool | None, time_budget_s: float = CERTIFY_SECONDS) -> Reference:
    """Build the reference of a scene.

    The reference's horizon is the time after which PIC is not reliable. Without a certified run, the horizon is
    estimated.

    Args:
        trace: The PIC trace of the scene.
        is_requested: If true, compute a certified run and use it as the reference. If None, use PIC as the reference,
            and a certified run only to find the horizon; the certified run needs `FEWEST_DISCS` to `MOST_DISCS` discs,
            and python-flint. If false, compute no certified run.
        time_budget_s: Seconds for the certified run.

    Raises:
        MissingExtraError: Certification was requested, and python-flint is not installed.
    """
    reference = Reference(trace)
    if needs_certification(trace.scene, is_requested):
        reference = _certify_reference(trace, is_requested, time_budget_s)
    if reference.trace.contact_s < math.inf:
        reliable_s = math.inf if reference.horizon_s is None else reference.horizon_s
        return reference._replace(horizon_s=min(reference.trace.contact_s, reliable_s))
    if reference.horizon_s is not None or isinstance(reference.certified, Horizon):
        return reference
    return reference._replace(horizon_s=estimate_horizon(reference.trace))


def _certify_reference(trace: Trace, is_requested: bool | None, time_budget_s: float) -> Reference:
    scene = trace.scene
    if is_requested is None and len(scene.discs) > MOST_DISCS:
        return Reference(trace, f"not certified: more than {MOST_DISCS} discs; --certify certifies it nevertheless")
    try:
        certified = certify(scene, time_budget_s=time_budget_s)
    except (MissingExtraError, InputError) as error:
        if is_requested and isinstance(error, MissingExtraError):
            raise
        return Reference(trace, f"not certified: {error}")
    horizon = compute_horizon(certified, trace)
    # physics does not determine the result of the event that ends the certified run, so PIC is the reference
    if certified.degeneracy is not None:
        reach = describe_certified_impacts(len(certified), complete=False)
        return Reference(trace, f"{reach}; the next event is undecided: {certified.degeneracy}")
    if not is_requested:
        return Reference(trace, horizon, None if horizon.covers_the_scene else horizon.end_s)
    reach_s = scene.duration_s if horizon.complete else certified.trace.end_time_s
    return Reference(certified.trace, horizon, reach_s, trace)
