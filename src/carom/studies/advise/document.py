"""The document of `carom advise`: the answer, what it rests on, and which impact asks for it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator

from carom.pages import wording
from carom.pages.document import DETAIL, Block, Column, Document, Headline, Lines, Section, Table, Text
from carom.runs.job import Method
from carom.studies.advise.run import Advice, Advised, Cause, HardImpact, SearchEnding, StepRange, StepTrial
from carom.studies.advise.step_search import CONFIRM
from carom.trace import body_name

__all__ = ["advice_document"]

#: From this number of steps on the first and the last are named.
_MANY = 4

Question = Callable[[Advised], StepRange]


def _misses(answer: Advised) -> StepRange:
    return answer.never_misses


def _whole(answer: Advised) -> StepRange:
    return answer.demand


def advice_document(advice: Advice) -> Document:
    """Return the answers, a row a method, and what was not reached; who may take the longest step comes first."""
    rows = sorted(advice.answers, key=lambda answer: (_order(answer.demand), _order(answer.never_misses)))
    table = Table(
        (
            Column("", lambda answer: _name(answer.method)),
            Column("misses", lambda answer: _range(answer.never_misses), "none", number=True),
            Column("fails", lambda answer: _fails(answer, answer.never_misses), "at", number=True),
            Column("also to", lambda answer: _range(answer.demand), _angle(advice), number=True),
            Column("fails", lambda answer: _fails(answer, answer.demand), "at", number=True),
            Column("direction", _direction, "wrong by", number=True),
            Column("refused", _refused, "at", number=True, only=DETAIL),
            Column("engine", lambda answer: str(answer.steps), "steps", number=True, only=DETAIL),
            Column("no further, as", lambda answer: answer.ending.value, only=DETAIL),
        ),
        rows,
        title=f"{advice.scene.name}, in steps a second:",
        note="a-b: every step tried between passes; between the steps there is no proof.",
    )
    answer, *more = _answers(advice)
    blocks: tuple[Block, ...] = (
        Lines(tuple(more)),
        *([table] if rows else []),
        Lines(tuple(_limits(advice))),
        Text(_how(advice), DETAIL),
        *(_curve(answer) for answer in rows),
    )
    return Document("Carom: advice", Headline(answer), (Section("Advice", blocks),))


def _answers(advice: Advice) -> Iterator[str]:
    """Yield the two answers, the yardstick, and who was not searched."""
    wholly = f"that also keep {_demanded(advice)}"
    if advice.demand.miss_probability > 0:
        few = wording.percent(advice.demand.miss_probability)
        wholly = f"that miss at {few} of starts or fewer and keep {_demanded(advice)}"
    if advice.answers:
        yield _fewest(advice, "that miss no impact", _misses)
        yield _fewest(advice, wholly, _whole)
    else:
        yield "No engine was searched."
    if told := _yardstick(advice):
        yield f"Looking once a step (PIT), as a yardstick: {told}."
    reasons = dict.fromkeys(unable.reason for unable in advice.unable)
    for reason in reasons:
        names = [_name(unable.method) for unable in advice.unable if unable.reason == reason]
        yield f"Not searched: {wording.listed(names)} ({reason})."


def _demanded(advice: Advice) -> str:
    return f"directions to {_angle(advice)}"


def _angle(advice: Advice) -> str:
    return _degrees(advice.demand.direction_error_rad)


def _fewest(advice: Advice, which: str, question: Question) -> str:
    """Return who takes the longest step that passes, or all of them who do."""
    passing = [(found.dt_s, answer.method) for answer in advice.answers if (found := question(answer).passes)]
    if not passing:
        return f"Steps {which}: no answer was found, for any engine."
    longest = max(dt_s for dt_s, _ in passing)
    names = [_name(method) for dt_s, method in passing if dt_s == longest]
    who = names[0] if len(names) == 1 else f"{wording.listed(names)} tie"
    rate_hz = advice.scene.frame_rate_hz
    per_frame = 1.0 / (longest * rate_hz)
    frames = f" ({wording.number(per_frame, 4)} a frame of {wording.number(rate_hz, 4)} Hz)" if per_frame > 1.0 else ""
    return f"Fewest steps {which}: {who}, {_rate(longest)} a second{frames}."


def _yardstick(advice: Advice) -> str:
    if (closed := advice.closed_form) is not None:
        steps = (closed.never_misses_s, closed.demand_s)
        one, other = (_rate(dt_s) if math.isfinite(dt_s) else "any number" for dt_s in steps)
        return f"{one} and {other} a second, by closed form"
    if advice.sampling is None:
        return ""
    one, other = (_range(found) for found in (advice.sampling.never_misses, advice.sampling.demand))
    return f"{one} and {other} a second, by trying"


def _limits(advice: Advice) -> Iterator[str]:
    """Yield what a row alone does not say: curves that are not monotone, what was not reached, and how far it goes."""
    for answer in advice.answers:
        told = answer.never_misses
        for found, what in ((told, "miss none"), (answer.demand, "meet the demand")):
            again = what != "miss none" and found.finer_failures == told.finer_failures
            if found.monotone or again:
                continue
            passing, failing = _rates(found.coarser_passes), _rates(found.finer_failures)
            yield f"Not monotone: steps of {_name(answer.method)} {what} at {passing} a second, and not at {failing}."
    stopped = [_name(answer.method) for answer in advice.answers if answer.ending is SearchEnding.BUDGET]
    if stopped:
        budget = f"the budget of {advice.budget_steps} engine steps each (--budget)"
        yield f"Not searched to the end, for {budget}: {wording.listed(stopped)}."
    for answer in advice.answers:
        if answer.ending is SearchEnding.BROKE:
            last = answer.trials[-1]
            yield f"{_name(answer.method)} broke off at {_rate(last.dt_s)} steps a second: {last.reason}."
    if advice.cut is not None:
        yield f"Asked up to {wording.seconds(advice.scene.duration_s)}: from the next impact on {advice.cut.value}."
    yield _hardest(advice.hardest[0], advice.impacts, rough=advice.scene.arrays.rubs_discs)


def _how(advice: Advice) -> str:
    return (
        f"Each step was tried at {wording.count(advice.phases, 'start')} spread evenly over it and at those that look "
        f"just before the hardest impacts; the first of each range at {max(CONFIRM, advice.phases)}. Lost: starts at "
        "which an impact is missed or invented."
    )


def _curve(answer: Advised) -> Table:
    columns = (
        Column("steps/s", lambda trial: _rate(trial.dt_s), number=True),
        Column("step, s", lambda trial: wording.number(trial.dt_s, 4), number=True),
        Column("lost", lambda trial: f"{trial.lost} of {trial.starts}", number=True),
        Column("direction wrong by", lambda trial: _degrees(trial.direction_error_rad), number=True),
        Column("", lambda trial: trial.reason),
    )
    return Table(columns, answer.trials, title=f"{_name(answer.method)}, every step tried", only=DETAIL)


def _order(found: StepRange) -> float:
    return math.inf if found.passes is None else -found.passes.dt_s


def _name(method: Method) -> str:
    return f"{method.engine} {method.profile}"


def _rate(dt_s: float) -> str:
    return wording.number(1.0 / dt_s, 4)


def _rates(trials: Iterable[StepTrial]) -> str:
    """Return rates as a list, or, of many, the first and the last with their number."""
    rates = [_rate(trial.dt_s) for trial in trials]
    return wording.listed(rates) if len(rates) < _MANY else f"{rates[0]} to {rates[-1]} ({len(rates)} steps tried)"


def _range(found: StepRange) -> str:
    if found.passes is not None:
        return f"{_rate(found.passes.dt_s)}-{_rate(found.down_to_s)}"
    if math.isnan(found.down_to_s):
        return wording.ABSENT
    failed = found.fails is not None and found.fails.dt_s == found.down_to_s
    return "none" if failed else "unfinished"


def _fails(answer: Advised, found: StepRange) -> str:
    if found.fails is not None:
        return _rate(found.fails.dt_s)
    if not answer.trials:
        return wording.ABSENT
    return "none" if answer.refused_s is None else "refused"


def _refused(answer: Advised) -> str:
    return "" if answer.refused_s is None else f"{_rate(answer.refused_s)}: {answer.refusal}"


def _direction(answer: Advised) -> str:
    """Return the error at the step that is the answer, or at the finest tried."""
    trial = answer.demand.passes or (answer.trials[-1] if answer.trials else None)
    if trial is None:
        return wording.ABSENT
    flat = answer.flat
    any_step = flat is not None and trial.dt_s <= flat.from_s
    return _degrees(trial.direction_error_rad) + (" at any" if any_step else "")


def _degrees(angle_rad: float) -> str:
    return wording.ABSENT if math.isnan(angle_rad) else f"{wording.number(math.degrees(angle_rad), 3)}°"


def _hardest(impact: HardImpact, impacts: int, *, rough: bool) -> str:
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
    if rough:  # how friction turns with the line of centres has no closed form
        direction += ", were there no friction"
    return (
        f"{which} is that of {where}: {why}. They overlap and approach for {wording.number(window.length_s, 3)} s, "
        f"{direction}."
    )
