"""Verdicts on single steps of a run. Each step is compared with PIC from the run's own state; see `stepwise`."""

from __future__ import annotations

import math
from collections.abc import Iterator

from carom.comparator.grades import Grade
from carom.comparator.measure.stepwise_score import LocalScore
from carom.comparator.slowing import Slowing
from carom.comparator.verdict import Finding, Verdict
from carom.comparator.verdicts.judged_run import JudgedRun
from carom.support.formatting import format_count, format_instant, format_metres, format_number


def report_divergence(judged: JudgedRun) -> Iterator[Finding]:
    """Report the times at which the run and PIT diverged from the reference."""
    local = judged.local_truth
    if local is None or judged.diverged_s is None:
        return
    pit, pit_s, alignment = "", judged.pit_diverged_s, judged.alignment
    if judged.sampling is not None:
        pit = " (PIT's has not)" if pit_s is None else f" (PIT's at {format_instant(pit_s)})"
    spurious = format_count(len(alignment.spurious), "spurious one")
    yield Finding(
        Verdict.DIVERGED,
        f"at {format_instant(judged.diverged_s)}{pit}; the run misses {len(alignment.missed)} of "
        f"{judged.compared.impacts} impacts and has {spurious}; {_describe_steps(local)}",
    )


def _describe_steps(local: LocalScore) -> str:
    if local.grade in {Grade.INACCURATE, Grade.WRONG}:
        return f"some steps are {local.grade.value}, compared with PIC from the same state"
    how = "no worse than PIT's" if local.grade is Grade.SAMPLED else f"{local.grade.name.lower()}, compared with PIC"
    return f"each step is {how} from the same state"


def report_misreports(judged: JudgedRun) -> Iterator[Finding]:
    """Report impacts of a diverged run that appear only in its reports, or only in its states.

    If the run did not diverge, other verdicts report such impacts.
    """
    reports = judged.reports
    if reports is None or reports.agree or not judged.has_diverged_before_miss:
        return
    parts = []
    if reports.unshown:
        parts.append(f"{reports.unshown} only in the reports, the first {reports.first_unshown}")
    if reports.unreported:
        parts.append(f"{reports.unreported} only in the states, the first {reports.first_unreported}")
    yield Finding(Verdict.MISREPORTED, "; ".join(parts))


def report_sinking(judged: JudgedRun) -> Iterator[Finding]:
    """Report how deep discs sink into the bodies on which they rest."""
    local = judged.local_truth
    if local is not None and (local.sinks or local.sunk_radii > judged.rounding):
        depth = f"{format_number(local.sunk_radii, 3)} times the contact distance"
        part = "more than" if local.sinks else "which"
        yield Finding(Verdict.SINKS, f"by up to {depth}, {part} a fall from rest in each step explains")


def report_polygons(judged: JudgedRun) -> Iterator[Finding]:
    """Report an integrator that moves discs at constant velocity in each step, although the discs fall or slow down."""
    local, dt_s, scene = judged.local_truth, judged.observed.dt_s, judged.reference.scene
    if local is None or not local.polygon:
        return
    slowing = Slowing.of(scene)
    bends = slowing.compute_deceleration(judged.scales.speed_m_s) if slowing else math.hypot(*scene.gravity_m_s2)
    deviation = format_metres(0.5 * bends * dt_s * dt_s)
    verdict, bend, path = Verdict.POLYGON, "|g|", "parabola"
    if slowing:
        path = "path at the scene's greatest speed"
        verdict, bend = Verdict.DAMPED_POLYGON, "c |v|" if scene.damping_per_s else "a"
    yield Finding(
        verdict, f"each step ends up to {deviation} (half of {bend} dt^2) off its {path}; these errors add up"
    )


def report_bad_steps(judged: JudgedRun, *, has_findings: bool) -> Iterator[Finding]:
    """Report faults of steps beyond the horizon and after rest, which the trajectory does not show."""
    local, alignment = judged.local_truth, judged.alignment
    if local is None or judged.non_finite:
        return
    if local.missed and (local.missed != len(alignment.missed) or judged.has_diverged_before_miss):
        missed = f"{local.missed} of {local.due} due impacts, the first {local.first_missed}"
        pit = f"PIT also misses {local.missed_by_pit} of these from the same states"
        yield Finding(Verdict.PASSED_THROUGH, f"{missed}; {pit}")
    if local.invented and (local.invented != len(alignment.spurious) or judged.has_diverged_before_miss):
        yield Finding(Verdict.TURNED_ALONE, f"{local.invented}, the first {local.first_invented}")
    is_shown = judged.compared.is_whole_run and has_findings and not judged.has_diverged_before_miss
    if local.grade is Grade.INACCURATE and not is_shown:
        yield Finding(Verdict.WORSE_STEPS, "; ".join(_describe_faults(local)))
    agrees = judged.compared.is_whole_run and local.agrees_alone
    if local.grade in (Grade.CLOSE, Grade.SAMPLED) and not (has_findings or agrees):
        yield Finding(Verdict.SAMPLED_STEPS, "; ".join(_describe_costs(local)))


def _describe_costs(local: LocalScore) -> Iterator[str]:
    """Describe those errors of steps that checking once per step explains."""
    if local.judged:
        speed, ratio = (format_number(largest, 3) for largest in (local.velocity[1], local.ratio[1]))
        yield (
            f"velocities after {format_count(local.judged, 'separate impact')} are off by up to {speed} of their "
            f"bodies' speed, and by up to {ratio} of PIT's error"
        )
    if local.late_steps[1] > 0.0:
        yield f"impacts are late by up to {format_number(local.late_steps[1], 3)} steps"
    if local.entangled:
        contain = "contains" if local.entangled == 1 else "contain"
        yield f"{format_count(local.entangled, 'window')} {contain} several impacts"
    if local.missed:
        yield f"{format_count(local.missed, 'missed impact')}, which PIT also misses from the same states"


def _describe_faults(local: LocalScore) -> Iterator[str]:
    """Describe each fault that makes the steps of a run inaccurate, with numbers."""

    def describe_part(count: int, one: str, many: str) -> str:
        return f"{count} of {local.judged} separate impacts {one if count == 1 else many}"

    if local.worse_than_pit:
        free = math.isinf(local.ratio[1])
        worst = "some although PIT has no error" if free else f"up to {format_number(local.ratio[1], 4)} times as large"
        typical = local.restitution[0]
        restitution_text = f", restitution off by {format_number(typical, 3)} at the median" if typical > 0.0 else ""
        yield f"{describe_part(local.worse_than_pit, 'has', 'have')} larger errors than PIT, {worst}{restitution_text}"
    if local.early:
        yield f"{describe_part(local.early, 'is', 'are')} early by up to {format_number(local.early_steps, 3)} steps"
    if local.ahead:
        yield (
            f"{format_count(local.ahead, 'time')} a disc changes its velocity more than two steps before the impact, "
            "because of the engine's contact margin"
        )
    if local.too_late:
        late_steps = format_number(local.late_steps[1], 3)
        yield f"{describe_part(local.too_late, 'is', 'are')} over a step late, up to {late_steps} steps"
    if local.drifts:
        steps, drift = format_count(local.drifts, "step"), format_number(local.drift, 3)
        yield f"positions do not follow from velocities in {steps}, by up to {drift} radii"
    if local.slipped > local.rounding:
        yield f"velocities change with no other body near, by up to {format_number(local.slipped, 3)} of a disc's speed"
    if local.energy > local.energy_rounding:
        yield f"steps gain or lose {format_number(local.energy, 3)} times the scene's energy in addition to PIT's steps"
    if local.sinks:
        yield "a disc sinks into what it rests on"
