"""Verdicts on the steps of a run, each compared with PIC from the run's own state; see `stepwise`."""

from __future__ import annotations

import math
from collections.abc import Iterator

from carom.comparator.grades import Grade
from carom.comparator.measure.steps import LocalScore
from carom.comparator.slowing import Slowing
from carom.comparator.verdict import Finding, Verdict
from carom.comparator.verdicts.judged_run import JudgedRun
from carom.support.formatting import instant, metres, number


def report_divergence(judged: JudgedRun) -> Iterator[Finding]:
    """Report when the trajectory left the reference's, and when PIT's did."""
    local = judged.local_truth
    if local is None or judged.parted_s is None:
        return
    pit = ""
    if judged.sampling is not None:
        pit = " (PIT's not)" if judged.pit_parted_s is None else f" (PIT's at {instant(judged.pit_parted_s)})"
    alignment = judged.alignment
    yield Finding(
        Verdict.PARTED,
        f"at {instant(judged.parted_s)}{pit}; of {judged.compared.impacts} impacts it does not have "
        f"{len(alignment.missed)}, and has {len(alignment.spurious)} others; {_describe_steps(local)}",
    )


def _describe_steps(local: LocalScore) -> str:
    """Describe the grade of the steps of a run."""
    if local.grade is Grade.INACCURATE:
        return "some steps by themselves are inaccurate"
    how = "no worse than PIT's from the same state" if local.grade is Grade.SAMPLED else local.grade.name.lower()
    return f"each step by itself is {how}"


def report_misreports(judged: JudgedRun) -> Iterator[Finding]:
    """Report differences of reports and states of a run that has diverged; else its impacts show them."""
    reports = judged.reports
    if reports is None or reports.agree or not judged.has_diverged_before_miss:
        return
    parts = []
    if reports.unshown:
        parts.append(f"{reports.unshown} reported that no state shows, the first {reports.first_unshown}")
    if reports.unreported:
        parts.append(f"{reports.unreported} shown and not reported, the first {reports.first_unreported}")
    yield Finding(Verdict.MISREPORTED, "; ".join(parts))


def report_sinking(judged: JudgedRun) -> Iterator[Finding]:
    """Report how deep discs sink into what they rest on."""
    local = judged.local_truth
    if local is not None and (local.sinks or local.sunk_radii > judged.rounding):
        held = "faster than by a fall from rest in each step" if local.sinks else "by what it falls in each step"
        yield Finding(Verdict.SINKS, f"by up to {number(local.sunk_radii, 3)} of the distance of contact, {held}")


def report_polygons(judged: JudgedRun) -> Iterator[Finding]:
    """Report that steps are straight and at one speed where paths are not: an effect of the integrator."""
    local, dt_s, scene = judged.local_truth, judged.observed.dt_s, judged.reference.scene
    if local is None or not local.polygon:
        return
    slowing = Slowing.of(scene)
    bends = slowing.bends(judged.scales.speed_m_s) if slowing else math.hypot(*scene.gravity_m_s2)
    off = metres(0.5 * bends * dt_s * dt_s)
    if slowing:
        bend = "c |v|" if scene.damping_per_s else "a"
        reason = f"each step ends up to half of {bend} dt^2 off its path, {off} at the scene's speed; it adds up"
        yield Finding(Verdict.DAMPED_POLYGON, reason)
    else:
        reason = f"each step ends up to half of |g| dt^2 off its parabola, {off}; it adds up"
        yield Finding(Verdict.POLYGON, reason)


def report_bad_steps(judged: JudgedRun, *, has_findings: bool) -> Iterator[Finding]:
    """Report faults of steps beyond the horizon and after rest, which the trajectory does not show."""
    local, alignment = judged.local_truth, judged.alignment
    if local is None or judged.non_finite:
        return
    if local.missed and (local.missed != len(alignment.missed) or judged.has_diverged_before_miss):
        pit = f"PIT misses {local.missed_by_pit} of these, too, from the same states"
        yield Finding(Verdict.PASSED_THROUGH, f"{local.missed} of {local.due} impacts due, {local.first_missed}; {pit}")
    if local.invented and (local.invented != len(alignment.spurious) or judged.has_diverged_before_miss):
        yield Finding(Verdict.TURNED_ALONE, f"{local.invented}, the first {local.first_invented}")
    is_shown = judged.compared.is_whole_run and has_findings and not judged.has_diverged_before_miss
    if local.grade is Grade.INACCURATE and not is_shown:
        yield Finding(Verdict.WORSE_STEPS, "; ".join(_faults(local)))
    agrees = judged.compared.is_whole_run and local.agrees_alone
    if local.grade in (Grade.CLOSE, Grade.SAMPLED) and not (has_findings or agrees):
        yield Finding(Verdict.SAMPLED_STEPS, "; ".join(_costs(local)))


def _costs(local: LocalScore) -> Iterator[str]:
    """Yield errors of steps that sampling explains, each with its numbers."""
    if local.judged:
        yield (
            f"velocities of {local.judged} impacts that stand alone by up to {number(local.velocity[1], 3)} of their "
            f"bodies' speed, {number(local.ratio[1], 3)} of what PIT pays"
        )
    if local.late_steps[1] > 0.0:
        yield f"late by up to {number(local.late_steps[1], 3)} steps"
    if local.entangled:
        yield f"{local.entangled} windows hold several impacts"
    if local.missed:
        yield f"{local.missed} impacts are missed, which PIT misses from the same states"


def _faults(local: LocalScore) -> Iterator[str]:
    """Yield faults that make the steps of a run inaccurate, each with its numbers."""
    judged = f"of {local.judged} impacts that stand alone"
    if local.worse_than_pit:
        free = math.isinf(local.ratio[1])
        worst = "some where PIT pays nothing" if free else f"up to {number(local.ratio[1], 4)} times as much"
        typical = local.restitution[0]
        off = f", restitution off by {number(typical, 3)} at the median" if typical > 0.0 else ""
        yield f"{local.worse_than_pit} {judged} pay more than PIT, {worst}{off}"
    if local.early:
        yield f"{local.early} {judged} come early, by up to {number(local.early_steps, 3)} steps"
    if local.ahead:
        yield f"{local.ahead} turns answer a meeting more than two steps ahead of it, by a margin of length"
    if local.too_late:
        yield f"{local.too_late} {judged} come later than a step, by up to {number(local.late_steps[1], 3)} steps"
    if local.drifts:
        drift = number(local.drift, 3)
        yield f"places move other than by their velocities in {local.drifts} steps, by up to {drift} radii"
    if local.slipped > local.rounding:
        yield f"velocities change with nothing near, by up to {number(local.slipped, 3)} of themselves"
    if local.energy > local.energy_rounding:
        yield f"{number(local.energy, 3)} of the energy is gained or lost that PIT's steps do not gain or lose"
    if local.sinks:
        yield "a disc sinks into what it rests on"
