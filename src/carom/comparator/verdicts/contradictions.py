"""Verdicts on contradictions within a run: its own states, velocities, stamps and normals."""

from __future__ import annotations

import math
from collections.abc import Iterator

from carom.comparator.measure.consistency import Deviation
from carom.comparator.measure.measured_run import MeasuredRun
from carom.comparator.verdict import Finding, Verdict
from carom.support.formatting import instant, number, seconds, steps

#: If the arm of friction differs from the radius by less than this part, four digits would show 1. Then the difference
#: is shown instead.
_NEAR_THE_RIM = 5e-4


def report_drifts(run: MeasuredRun) -> Iterator[Finding]:
    """Report places and angular momenta that do not follow from a run's own impacts."""
    own = run.consistency
    if own is None:
        return
    if own.strayed > run.place_rounding:
        reason = f"by up to {number(own.position.size, 3)} of the largest radius, {_format_since(own.position)}"
        if own.strayed_excess > run.place_rounding:
            reason += f"; {number(own.excess.size, 3)} more than bodies close in a step"
        yield Finding(Verdict.DRIFTS, reason)
    if own.angular > run.rounding:
        reason = f"by up to {number(own.angular, 3)} of the scene's speed of rims"
        if math.isfinite(own.arm):
            at, off = f"{number(own.arm, 4)} times its radius", own.arm - 1.0
            if abs(off) < _NEAR_THE_RIM:
                at = f"{number(abs(off), 3)} of its radius {'outside' if off > 0.0 else 'inside'} its rim"
            reason += f"; friction turns a disc as if at {at}"
        if own.angular_excess > run.rounding:
            reason += f"; {number(own.angular_excess, 3)} more than bodies close in a step"
        yield Finding(Verdict.ANGULAR, reason)


def report_contradictions(run: MeasuredRun) -> Iterator[Finding]:
    """Report contradictions of a run's states, velocities, stamps and normals."""
    own, rounding = run.consistency, run.rounding
    if own is None:
        return
    speed, two_discs = "of the scene's speed", "for the centre of mass of the two discs"
    rims = "of the scene's speed of rims"
    degrees, rounding_s = math.degrees(own.normal_rad), rounding * run.scales.time_s
    for verdict, size, allowed, reason in (
        (
            Verdict.TURNS,
            own.velocity.size,
            rounding,
            f"{number(own.velocity.size, 3)} {speed}, {_format_since(own.velocity)}",
        ),
        (Verdict.SPINS, own.spin.size, rounding, f"{number(own.spin.size, 3)} {rims}, {_format_since(own.spin)}"),
        (Verdict.MOMENTUM, own.momentum, rounding, f"{number(own.momentum, 3)} {speed}, {two_discs}"),
        (Verdict.WRONG_STAMP, own.stamp_s, rounding_s, format_seconds_and_steps(own.stamp_s, run)),
        (
            Verdict.WRONG_NORMAL,
            own.across,
            rounding,
            f"{number(degrees, 3)} degrees from what the velocities change by",
        ),
    ):
        if not size <= allowed:
            yield Finding(verdict, f"by up to {reason}")
    if not own.normal_length <= rounding:
        yield Finding(Verdict.WRONG_NORMAL, f"their length is up to {number(own.normal_length, 3)} off 1")


def _format_since(slip: Deviation) -> str:
    return f"disc {slip.disc} after {instant(slip.since_s)}"


def format_seconds_and_steps(time_s: float, run: MeasuredRun) -> str:
    """Format a time in seconds and, if the run has steps, in steps."""
    dt_s = run.observed.dt_s
    return seconds(time_s) + (f", {steps(time_s, dt_s)}" if dt_s else "")
