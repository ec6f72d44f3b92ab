"""Verdicts on contradictions between a run's own states, velocities, reported times and normals."""

from __future__ import annotations

import math
from collections.abc import Iterator

from carom.comparator.measure.consistency import Deviation
from carom.comparator.measure.measured_run import MeasuredRun
from carom.comparator.verdict import Finding, Verdict
from carom.support.formatting import format_instant, format_number, format_seconds, format_steps

#: If friction's lever arm differs from the disc's radius by less than this fraction, their difference is shown, because
#: their quotient would be shown as 1.
_NEAR_THE_RIM = 5e-4


def report_drifts(run: MeasuredRun) -> Iterator[Finding]:
    """Report positions and angular momenta that do not agree with a run's own impacts."""
    consistency = run.consistency
    if consistency is None:
        return
    if consistency.strayed > run.place_rounding:
        position = consistency.position
        reason = f"{_format_size(position.size)} times the largest radius, {_format_since(position)}"
        if consistency.strayed_excess > run.place_rounding:
            reason += f"; {format_number(consistency.excess.size, 3)} more than the overlap gained in a step explains"
        yield Finding(Verdict.DRIFTS, reason)
    if consistency.angular > run.rounding:
        reason = f"{_format_size(consistency.angular)} times the scene's greatest disc or rim speed"
        if math.isfinite(consistency.arm):
            distance, excess = f"{format_number(consistency.arm, 4)} times its radius", consistency.arm - 1.0
            if abs(excess) < _NEAR_THE_RIM:
                side = "outside" if excess > 0.0 else "inside"
                distance = f"{format_number(abs(excess), 3)} of its radius {side} its rim"
            reason += f"; a disc turns as if friction acted at {distance}"
        if consistency.angular_excess > run.rounding:
            more = format_number(consistency.angular_excess, 3)
            reason += f"; {more} more than the overlap gained in a step explains"
        yield Finding(Verdict.ANGULAR, reason)


def report_contradictions(run: MeasuredRun) -> Iterator[Finding]:
    """Report contradictions between a run's states, velocities, reported times and normals."""
    found, rounding = run.consistency, run.rounding
    if found is None:
        return
    speed, rims = "times the scene's greatest speed", "times the scene's greatest disc or rim speed"
    if not found.velocity.size <= rounding:
        yield Finding(Verdict.TURNS, f"{_format_size(found.velocity.size)} {speed}, {_format_since(found.velocity)}")
    if not found.spin.size <= rounding:
        yield Finding(Verdict.SPINS, f"{_format_size(found.spin.size)} {rims}, {_format_since(found.spin)}")
    if not found.momentum <= rounding:
        reason = f"{_format_size(found.momentum)} {speed}, in the velocity of the two discs' centre of mass"
        yield Finding(Verdict.MOMENTUM, reason)
    if not found.stamp_s <= rounding * run.scales.time_s:
        yield Finding(Verdict.WRONG_STAMP, f"by up to {format_seconds_and_steps(found.stamp_s, run)}")
    if not found.across <= rounding:
        angle = f"{format_number(math.degrees(found.normal_rad), 3)} degrees"
        yield Finding(Verdict.WRONG_NORMAL, f"{angle} from the velocity change at the impact with the largest error")
    if not found.normal_length <= rounding:
        yield Finding(Verdict.WRONG_NORMAL, f"their length differs from 1 {_format_size(found.normal_length)}")


def _format_size(size: float) -> str:
    return f"by up to {format_number(size, 3)}"


def _format_since(slip: Deviation) -> str:
    return f"disc {slip.disc} after {format_instant(slip.since_s)}"


def format_seconds_and_steps(time_s: float, run: MeasuredRun) -> str:
    """Format a time in seconds and, if the run has steps, in steps."""
    dt_s = run.observed.dt_s
    return format_seconds(time_s) + (f", {format_steps(time_s, dt_s)}" if dt_s else "")
