"""What the adviser says, in sentences and a table."""

from __future__ import annotations

import math
from collections.abc import Iterator

from carom.bench.adviser import RESOLUTION, Advice, Advised, Cause, HardImpact, StepTrial
from carom.report import wording
from carom.report.document import Column, Document, Section, Table
from carom.trace import body_name

__all__ = ["advice_document"]


def advice_document(advice: Advice) -> Document:
    """Return the answer, with what was tried for it."""
    table = Table(
        (
            Column("engine", lambda answer: answer.method.engine),
            Column("profile", lambda answer: answer.method.profile),
            Column("passes at", lambda answer: _step(answer.passes)),
            Column("there: lost, direction", lambda answer: _found(answer.passes)),
            Column("fails at", lambda answer: _step(answer.fails)),
            Column("there: lost, direction", lambda answer: _found(answer.fails)),
            Column("remark", _remark),
        ),
        advice.answers,
        title=f"{advice.scene.name}: the largest step that meets the demand",
        note=f"Each step was run at {wording.count(advice.phases, 'start')} spread evenly over it and at those that "
        f"look just before the hardest impacts; the two steps are no more than {wording.percent(RESOLUTION - 1.0)} "
        "apart. Lost: share of the even starts with an impact missed or invented (+: only at an aimed one). Found by "
        "trying: between the steps tried there is no proof.",
    )
    return Document("Carom: advice", tuple(_sentences(advice)), (Section(table.title, (table,)),))


def _sentences(advice: Advice) -> Iterator[str]:
    """Return the answer, then which impact is the hardest and why."""
    degrees = wording.number(math.degrees(advice.demand.direction_error_rad), 3)
    lost = advice.demand.miss_probability
    missing = "no impact missed" if lost == 0 else f"an impact missed at no more than {wording.percent(lost)} of starts"
    demand = f"directions right to {degrees}° and {missing} on {advice.scene.name}"
    if advice.closed_form_s is not None:
        yield (
            f"PIT needs {_rate(advice.closed_form_s)} for {demand}: by closed form, at any start."
            if math.isfinite(advice.closed_form_s)
            else f"Any frame rate at which PIT looks before the scene ends gives {demand}."
        )
    for answer in advice.answers:
        if answer.passes is not None and not (answer.method.engine == "pit" and advice.closed_form_s is not None):
            yield f"{answer.method.engine} ({answer.method.profile}) needs {_rate(answer.passes.dt_s)} for {demand}."
    yield _hardest(advice.hardest[0], advice.impacts)


def _rate(dt_s: float) -> str:
    return f"at least {wording.number(1.0 / dt_s, 4)} steps a second (a step of at most {wording.number(dt_s, 4)} s)"


def _hardest(impact: HardImpact, impacts: int) -> str:
    where = f"{body_name(impact.first)} and {body_name(impact.second)} at {wording.number(impact.time_s, 4)} s"
    which = "Its one impact" if impacts == 1 else f"The hardest of its {impacts} impacts"
    window = impact.limit.window
    if window is None:
        return f"{which} is that of {where}: {impact.cause.value}."
    size = f"{wording.number(window.speed_m_s)} m/s and {wording.number(window.reach_m)} m from centre to centre"
    why = {
        Cause.GRAZE: f"a graze, at {wording.number(window.share, 4)} of the contact distance off centre",
        Cause.FAST: f"fast for their size, {size}",
        Cause.TURN: f"their line of centres turns fast, at {size}",
        Cause.WALL: impact.cause.value,
    }[impact.cause]
    late = impact.limit.direction_dt_s
    direction = (
        "and however late they are found, the directions stay right to what was asked"
        if math.isinf(late)
        else f"and found more than {wording.number(late, 3)} s late, a direction is wrong by more than asked"
    )
    return (
        f"{which} is that of {where}: {why}. They overlap and approach for {wording.number(window.length_s, 3)} s, "
        f"{direction}."
    )


def _remark(answer: Advised) -> str:
    if answer.reason:
        return answer.reason
    if answer.closed_form_s is not None:
        return f"closed form: {wording.number(answer.closed_form_s, 4)} s, confirmed by running it"
    return "no step that was tried fails" if answer.fails is None else ""


def _step(trial: StepTrial | None) -> str:
    return wording.ABSENT if trial is None else f"{wording.number(trial.dt_s, 4)} s"


def _found(trial: StepTrial | None) -> str:
    if trial is None:
        return wording.ABSENT
    lost = wording.percent(trial.lost_share) + ("+" if trial.lost_anywhere and not trial.lost_share else "")
    return f"{lost}, {wording.number(math.degrees(trial.direction_error_rad), 3)}°"
