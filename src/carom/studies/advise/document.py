"""Document of `carom advise`: the recommended step sizes, the tested ones, and the impact that is hardest to find."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

from carom.engines.registry import format_engine_argument
from carom.model.trace import body_name
from carom.report.document import Block, Code, Column, Document, Figure, Figures, Lines, Media, Section, Table, Text
from carom.report.provenance import build_provenance
from carom.studies.advise.figure import render_advice_svg
from carom.studies.advise.run import Advice
from carom.studies.advise.step_search import CONFIRM, SearchEnding, StepAdvice, StepRange, count_steps_per_frame
from carom.studies.advise.step_trial import StepTrial
from carom.support import formatting

#: Name of the study in its output folders.
PURPOSE = "advise"

#: A list of at least this many step sizes is shortened to the first and the last one.
_MANY = 4


def build_advice_document(advice: Advice, scene_word: str = "") -> Document:
    """Return a document with one row per method. The method with the largest step size is first.

    Args:
        advice: The advice.
        scene_word: Name or path of the scene on command lines that the document shows. The default, the scene's name,
            works only for scenes of the catalogue.
    """

    def order(one: StepAdvice) -> tuple[bool, float, float]:
        return one.method in advice.located, -one.meets_target.largest_passing_s, -one.never_misses.largest_passing_s

    rows = sorted(advice.answers, key=order)
    answer, *further_lines = _build_headline(advice)
    notes = Lines(tuple(_build_notes(advice)))
    sections = [
        Section("Advice", (Lines(tuple(further_lines)), *([_build_table(advice, rows)] if rows else []), notes))
    ]
    if rows:
        caption = (
            "A cross marks a step size with a missed or spurious impact at one phase or more. The dotted line is "
            "the accuracy target."
        )
        figure = Figure(partial(render_advice_svg, advice), caption)
        search = Lines(tuple(_describe_search(advice, rows)), Media.IN_FULL)
        tested: tuple[Block, ...] = (search, *map(_build_trials_table, rows))
        sections += [
            Section("Error against step", (Figures((figure,), large=True),), only=Media.PAGE),
            Section("Code to paste", tuple(_build_code_blocks(advice, rows, scene_word or advice.scene.name))),
            Section("All tested steps", tested, only=Media.IN_FULL),
        ]
    making_of = build_provenance(advice.environment, advice.command, advice.elapsed_s)
    return Document("Carom: advice", (answer,), (*sections, *making_of))


def _build_table(advice: Advice, rows: Sequence[StepAdvice]) -> Table:
    def build_columns(head: str, read: Callable[[StepAdvice], StepRange]) -> Iterator[Column]:
        yield Column(head, lambda answer: _describe_passing_step(answer, read(answer)), "steps/s", number=True)
        yield Column(
            "per", lambda answer: str(_count_steps_per_frame(advice, read(answer)) or ""), "frame", number=True
        )

    frame = f"{formatting.format_number(advice.scene.frame_rate_hz, 4)} Hz"
    return Table(
        (
            Column("", lambda answer: answer.method.label + (" +CCD" if answer.method in advice.swept else "")),
            *build_columns("no miss", lambda answer: answer.never_misses),
            *build_columns(f"≤ {_format_target_angle(advice)}", lambda answer: answer.meets_target),
            Column(f"at {frame}", lambda answer: _format_frame_step_result(advice, answer)),
        ),
        rows,
        title=f"{advice.scene.name}, fewest steps per second that pass:",
        note="This step size and all smaller tested ones pass. Other step sizes were not checked. "
        "'Fails at' counts phases with a missed or spurious impact.",
    )


def _build_headline(advice: Advice) -> Iterator[str]:
    """Yield the two recommended step sizes, the step sizes that PIT needs, and the methods that could not be tested."""
    if advice.answers:
        without_miss = _describe_longest_step(advice, lambda answer: answer.never_misses)
        yield f"{advice.scene.name}: to miss no impact, {without_miss}."
        target = f"For a direction error of at most {_format_target_angle(advice)}"
        if advice.options.miss_probability > 0:
            most = formatting.format_percent(advice.options.miss_probability)
            target += f", with misses at no more than {most} of phases"
        yield f"{target}, {_describe_longest_step(advice, lambda answer: answer.meets_target)}."
    else:
        yield f"{advice.scene.name}: no engine was tested."
    without_miss, accurate = map(_describe_needed_rate, advice.pit_steps_s)
    yield f"PIT (one check per step) needs {without_miss} to miss none, {accurate} for {_format_target_angle(advice)}."
    reasons = formatting.group_by((reason, method.label) for method, reason in advice.unable.items())
    for reason, names in reasons.items():
        yield f"Not run: {formatting.join_words(names)} ({reason})."


def _format_target_angle(advice: Advice) -> str:
    return _format_degrees(advice.options.direction_error_rad)


def _describe_longest_step(advice: Advice, criterion: Callable[[StepAdvice], StepRange]) -> str:
    """Describe the largest step size that passes, and its method.

    Methods whose steps Carom shortens are considered only if there are no other methods, because no setting of an
    engine shortens steps in this way.
    """
    candidates = [one for one in advice.answers if one.method not in advice.located] or advice.answers
    longest_s = max(criterion(answer).largest_passing_s for answer in candidates)
    if not longest_s:
        return "no tested step size of any engine suffices"
    best = [answer for answer in candidates if criterion(answer).largest_passing_s == longest_s]
    names = formatting.join_words([answer.method.label for answer in best], "or")
    any_step = all(_has_no_step_limit(answer, criterion(answer)) for answer in best)
    steps = "any tested step size ({} or more steps per second)" if any_step else "{} steps/s"
    return f"use {steps.format(_format_rate(longest_s))}{_describe_substeps(advice, criterion(best[0]))} with {names}"


def _has_no_step_limit(answer: StepAdvice, step_range: StepRange) -> bool:
    """Whether a method passes with every tested step size, even if one step is as long as the whole run."""
    return step_range.largest_passing is not None and step_range.smallest_failing is None and answer.refused_s is None


def _describe_substeps(advice: Advice, step_range: StepRange) -> str:
    """Describe the smallest whole number of steps per frame that passes; empty if there is none."""
    if (times := _count_steps_per_frame(advice, step_range)) is None:
        return ""
    steps = formatting.format_count(times, "step")
    per_frame = f"per frame at {formatting.format_number(advice.scene.frame_rate_hz, 4)} Hz"
    if step_range.frame_divisor is step_range.largest_passing:
        return f" ({steps} {per_frame})"
    return f" ({steps} {per_frame} {'is' if times == 1 else 'are'} enough)"


def _count_steps_per_frame(advice: Advice, step_range: StepRange) -> int | None:
    trial = step_range.frame_divisor
    return None if trial is None else count_steps_per_frame(trial.dt_s, advice.scene.frame_rate_hz)


def _build_code_blocks(advice: Advice, rows: Sequence[StepAdvice], scene_word: str) -> Iterator[Block]:
    """For each method, yield its steps per frame, the engine's code for a frame, and a command that prints settings.

    On a terminal, only the first method is shown.
    """
    media = Media.EVERYWHERE
    for answer in rows:
        found = answer.meets_target if answer.meets_target.frame_divisor else answer.never_misses
        method, trial, times = answer.method, found.frame_divisor, _count_steps_per_frame(advice, found)
        if trial is None or times is None or method in advice.located:
            continue
        target = f"for a direction error of at most {_format_target_angle(advice)}"
        criterion = target if found is answer.meets_target else "to miss no impact"
        code = advice.code.get(method, "")
        ending = ". As code:" if code else "."
        fewer = _count_steps_per_frame(advice, answer.never_misses)
        fewest_note = f" ({fewer} to miss no impact)" if fewer is not None and fewer < times else ""
        steps = formatting.format_count(times, "step")
        yield Text(f"{method.label} needs {steps} per frame {criterion}{fewest_note}{ending}", media)
        if code:
            yield Code(code, media)
        words = ("carom", "engines", format_engine_argument(method.engine), "--show", method.profile)
        options = ("--dt", formatting.format_step_option(trial.dt_s), "--scene", scene_word)
        yield Text(f"To print all settings, run: {shlex.join((*words, *options))}", media)
        media = Media.IN_FULL


def _describe_passing_step(answer: StepAdvice, step_range: StepRange) -> str:
    if step_range.largest_passing is not None:
        return "any tried" if _has_no_step_limit(answer, step_range) else _format_rate(step_range.largest_passing_s)
    if not answer.trials:
        return formatting.ABSENT
    return "none" if step_range.smallest_failing is answer.trials[-1] else "unfinished"


def _format_frame_step_result(advice: Advice, answer: StepAdvice) -> str:
    """Describe the method's result with one step per frame."""
    rate_hz = advice.scene.frame_rate_hz
    trial = next((one for one in answer.trials if count_steps_per_frame(one.dt_s, rate_hz) == 1), None)
    if trial is None:
        return "refused" if answer.refused_s is not None and answer.refused_s <= 1.0 / rate_hz else formatting.ABSENT
    if trial.reason:
        return "stopped"
    if trial.lost_phases:
        return f"fails at {trial.lost_phases} of {trial.phases}"
    return f"found, {_format_degrees(trial.direction_error_rad)} error"


def _describe_needed_rate(dt_s: float) -> str:
    if math.isinf(dt_s):
        return "any number of steps"
    return f"{_format_rate(dt_s)} steps/s" if dt_s else "an unknown number of steps"


def _build_notes(advice: Advice) -> Iterator[str]:
    """Yield notes on the hardest impact, unfinished searches, and step sizes that fail although a larger one passes."""
    for answer in advice.answers:
        never_misses = answer.never_misses
        for found, result in ((never_misses, "misses no impact"), (answer.meets_target, "meets the target")):
            is_repeated = result != "misses no impact" and found.finer_failures == never_misses.finer_failures
            if is_repeated or not found.finer_failures:
                continue
            passing, failing = _format_rates(found.coarser_passes), _format_rates(found.finer_failures)
            where = f"at {passing} steps per second, but fails at {failing}"
            yield f"Smaller steps are not always better: {answer.method.label} {result} {where}."
    stopped = [answer.method.label for answer in advice.answers if answer.ending is SearchEnding.BUDGET]
    if stopped:
        budget = f"its budget of {advice.options.budget_steps} engine steps (--budget)"
        yield f"For {formatting.join_words(stopped)}, the search stopped at {budget}."
    for answer in advice.answers:
        if answer.ending is SearchEnding.BROKE:
            last = answer.trials[-1]
            yield f"{answer.method.label} stopped at {_format_rate(last.dt_s)} steps per second: {last.reason}."
    if advice.cut is not None:
        until = formatting.format_seconds(advice.scene.duration_s)
        yield f"Only the time up to {until} was searched, because from the next impact on, {advice.cut.value}."
    yield _describe_hardest_impact(advice)


def _build_trials_table(answer: StepAdvice) -> Table:
    columns = (
        Column("steps/s", lambda trial: _format_rate(trial.dt_s), number=True),
        Column("step size, s", lambda trial: formatting.format_number(trial.dt_s, 4), number=True),
        Column("missed or spurious", lambda trial: f"{trial.lost_phases} of {trial.phases}", number=True),
        Column("direction error", lambda trial: _format_degrees(trial.direction_error_rad), number=True),
        Column("", lambda trial: trial.reason),
    )
    name = f"{answer.method.label}, all tested step sizes"
    return Table(columns, answer.trials, title=name, folded=name, only=Media.IN_FULL)


def _format_rate(dt_s: float) -> str:
    return formatting.format_number(1.0 / dt_s, 4)


def _format_rates(trials: Iterable[StepTrial]) -> str:
    """List step sizes as steps per second.

    A long list is shortened to the first and the last step size, and the number of step sizes.
    """
    rates = [_format_rate(trial.dt_s) for trial in trials]
    if len(rates) < _MANY:
        return formatting.join_words(rates)
    return f"{rates[0]} to {rates[-1]} ({len(rates)} step sizes tested)"


def _describe_search(advice: Advice, rows: Sequence[StepAdvice]) -> Iterator[str]:
    """Yield the reasons for the end of searches and for refused step sizes, and describe the tested phases."""
    for ending, names in formatting.group_by((one.ending, one.method.label) for one in rows).items():
        yield f"For {formatting.join_words(names)}, no smaller step size was tested, because {ending.value}."
    for one in rows:
        if one.refused_s is not None:
            yield f"Not run: {one.method.label} at {_format_rate(one.refused_s)} steps per second ({one.refusal})."
    phases = advice.options.phases
    yield (
        f"Each step size was tested at {formatting.format_count(phases, 'phase')} that are spread evenly over "
        "a step, and at phases at which a step ends just before one of the hardest impacts. The largest step "
        f"size of each range was tested at {max(CONFIRM, phases)} phases."
    )


def _format_degrees(angle_rad: float) -> str:
    return formatting.ABSENT if math.isnan(angle_rad) else f"{formatting.format_number(math.degrees(angle_rad), 3)}°"


def _describe_hardest_impact(advice: Advice) -> str:
    impact, rate_hz = advice.hardest[0], advice.scene.frame_rate_hz
    bodies = f"{body_name(impact.first)} and {body_name(impact.second)}"
    bodies_and_time = f"between {bodies} at {formatting.format_number(impact.time_s, 4)} s"
    which = "The only impact is" if advice.impacts == 1 else f"The hardest of {advice.impacts} impacts is"
    window = impact.window
    if window is None:
        return f"{which} {bodies_and_time}: {impact.cause.value}."
    speed, reach = formatting.format_number(window.speed_m_s), formatting.format_number(window.reach_m)
    size = f"relative speed {speed} m/s, centres {reach} m apart"
    offset = formatting.format_number(window.relative_offset, 4)
    why = impact.cause.value.format(offset=offset, size=size)
    late = impact.direction_dt_s
    direction = f"error is too large if the impact is found more than {formatting.format_seconds(late)} late"
    if math.isinf(late):
        direction = "meets the target even if the impact is found late"
    if advice.scene.arrays.has_disc_friction:  # there is no formula for the effect of friction
        direction += " (without friction)"
    return (
        f"{which} {bodies_and_time}: {why}. The bodies overlap and approach each other for "
        f"{formatting.format_seconds(window.length_s)}. A frame at {formatting.format_number(rate_hz, 4)} Hz takes "
        f"{formatting.format_seconds(1.0 / rate_hz)}. The direction {direction}."
    )
