"""Document of `carom tune`: the settings found, a comparison with the existing profiles, and code to paste."""

from __future__ import annotations

import math
import shlex
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

import tomli_w

from carom.comparator import Grade
from carom.engines.registry import format_engine_argument
from carom.execution.job import Method
from carom.model.trace import format_setting
from carom.report.document import Cell, Code, Column, Document, Lines, Media, Section, Table, Text
from carom.report.outcome_marks import mark_of_grade
from carom.report.provenance import build_provenance
from carom.studies.tune.objective import SceneResult
from carom.studies.tune.run import Tuning
from carom.studies.tune.search import TriedSettings
from carom.support import formatting

ERROR_NOTE = (
    "The error is the largest velocity or spin error, divided by PIT's largest error over the phases of the step. 1 is "
    "the error of checking once per step. 0 means that the error is within rounding."
)
MERIT_NOTE = (
    "Columns count scenes. 'Between' counts scenes with the grades sampled, inaccurate or diverged, and scenes without "
    "a grade. The error is a number from 0 to 100 on a logarithmic scale, as the mean over scenes. 0 is rounding, 50 "
    "is the error of checking once per step, and 100 is wrong or not run."
)
#: Name of the profile in the code to paste.
FOUND = "found"
#: Name of the settings that the search found, in tables and sentences.
FOUND_LABEL = "found settings"


def build_tune_document(tuning: Tuning, scene_words: Sequence[str]) -> Document:
    """Return the document of `carom tune`. `scene_words` are the command-line arguments that name the scenes."""
    better = tuning.best is not tuning.first
    columns = [Column("scene", lambda k: tuning.scenes[k].name)]
    columns += _build_result_columns(tuning.options.profile, tuning.first)
    columns += _build_result_columns(FOUND_LABEL, tuning.best) if better else ()
    left_out = tuple(f"Not run: {name} ({reason})." for name, reason in tuning.left_out.items())
    sections = (
        _build_profile_section(tuning),
        *((_build_setting_section(tuning),) if better else ()),
        Section("Results by scene", (Table(columns, range(len(tuning.scenes))), Text(ERROR_NOTE), Lines(left_out))),
        *(_build_code_sections(tuning, scene_words) if better else ()),
        *build_provenance(tuning.environment, tuning.command, tuning.elapsed_s),
    )
    return Document(f"Carom: settings of {tuning.engine}", tuple(_build_headline(tuning)), sections)


def _build_result_columns(name: str, found: TriedSettings) -> Iterator[Column]:
    """Yield two columns for a table of scenes: the grade and the error of each scene with the given settings."""
    yield Column(name, lambda k: _format_grade(found.results[k]))
    yield Column("error", lambda k: formatting.format_number(found.results[k].error_ratio), number=True)


def format_set_options(found: TriedSettings) -> str:
    """Return the options of `carom run` that set the found settings."""
    return shlex.join(
        [word for name, value in found.overrides for word in ("--set", f"{name}={format_setting(value)}")]
    )


def _build_headline(tuning: Tuning) -> Iterator[str]:
    scenes = formatting.format_count(len(tuning.scenes), "scene")
    early = f" ({tuning.abandoned} abandoned early)" if tuning.abandoned else ""
    trials_text = (
        f"tried {formatting.format_count(tuning.trials, 'combination of settings', 'combinations of settings')}{early}"
    )
    if tuning.best is tuning.first:
        yield f"No better settings than {tuning.options.profile} were found on {scenes}, although carom {trials_text}."
        yield f"With {tuning.options.profile}: {_format_grades(tuning.first)}."
        yield from _describe_equal_profiles(tuning)
        return
    profile = tuning.options.profile
    grades = f"{_format_grades(tuning.best)} ({profile}: {_format_grades(tuning.first)})"
    changed = formatting.format_count(len(tuning.best.overrides), "setting")
    yield f"{tuning.engine}: trial {tuning.best.trial} was best. It changed {changed} of {profile}. Grades: {grades}."
    yield from _describe_equal_profiles(tuning)
    step = "its own frame rate" if tuning.options.dt_s is None else formatting.format_step(tuning.options.dt_s)
    yield f"The search used {scenes}, each at {step}, and {trials_text}."
    if not math.isnan(tuning.time_ratio):
        cost = formatting.format_number(tuning.time_ratio)
        yield f"A step takes {cost} times as long as a step with {tuning.options.profile} (median over scenes)."
    yield "This result is only valid for these scenes and step sizes."


def _describe_equal_profiles(tuning: Tuning) -> Iterator[str]:
    """Yield a sentence that names profiles as good as the result, and a sentence that names better profiles.

    Profiles whose steps Carom shortens are omitted.
    """
    own_name = f"the {FOUND_LABEL}" if tuning.best is not tuning.first else tuning.options.profile
    other_merits = {name: one.merit for name, one in tuning.others.items() if name not in tuning.located}
    alike = [name for name, merit in other_merits.items() if merit.criteria == tuning.best.merit.criteria]
    better = [name for name, merit in other_merits.items() if merit.criteria < tuning.best.merit.criteria]
    if alike:
        yield f"{formatting.join_words([own_name, *alike])} are equally good."
    if better:
        noun, verb = ("profile", "is") if len(better) == 1 else ("profiles", "are")
        yield f"The existing {noun} {formatting.join_words(better)} {verb} better."


def _format_grades(found: TriedSettings) -> str:
    grades = Counter(map(_grade_word, found.results))
    return ", ".join(f"{count} {name}" for name, count in grades.most_common())


def _grade_word(result: SceneResult) -> str:
    return "not run" if result.grade is None else mark_of_grade(result.grade, result.float_bits).word


def _format_grade(result: SceneResult) -> Cell:
    if result.grade is None:
        return Cell(_grade_word(result), result.reason)
    lost = formatting.format_missed_and_invented(result.missed, result.spurious)
    return Cell(f"{_grade_word(result)} {lost}".rstrip())


def _build_profile_section(tuning: Tuning) -> Section:
    """Return a section with a table of the found settings and all profiles, best first.

    Profiles whose steps Carom shortens are last.
    """
    rows = {tuning.options.profile: tuning.first, **tuning.others}
    if tuning.best is not tuning.first:
        rows = {FOUND_LABEL: tuning.best, **rows}
    names = sorted(rows, key=lambda name: (name in tuning.located, rows[name].merit.criteria))

    def build_count(head: str, is_counted: Callable[[SceneResult], bool]) -> Column:
        return Column(head, lambda name: str(sum(map(is_counted, rows[name].results)) or ""), number=True)

    columns = (
        Column("", str),
        build_count("wrong", lambda one: one.grade is Grade.WRONG),
        build_count("exact or close", lambda one: not one.is_imprecise),
        build_count("between", lambda one: one.is_imprecise and not one.is_wrong),
        build_count("not run", lambda one: one.grade is None),
        Column("error, 0 to 100", lambda name: str(rows[name].merit.error), number=True),
    )
    refused = formatting.group_by(
        (reason, name)
        for name, other in tuning.others.items()
        for reason in dict.fromkeys(one.reason for one in other.results if one.grade is None)
    )
    lines = tuple(f"Not run: {formatting.join_words(names)} ({reason})." for reason, names in refused.items())
    return Section("Comparison with the existing profiles", (Table(columns, names, note=MERIT_NOTE), Lines(lines)))


def _build_setting_section(tuning: Tuning) -> Section:
    before = {name: format_setting(value) for name, value in tuning.profile_settings.items()}
    columns = (
        Column("setting", lambda item: item[0]),
        Column("found", lambda item: format_setting(item[1]), number=True),
        Column(tuning.options.profile, lambda item: before.get(item[0], "engine default"), number=True),
        Column(
            "tested range", lambda item: ", ".join(format_setting(tuning.space.values[item[0]][k]) for k in (0, -1))
        ),
    )
    note = "Each setting is needed: resetting any one of them makes the result worse."
    return Section("Settings found", (Table(columns, tuning.best.overrides), Text(note)))


def _build_code_sections(tuning: Tuning, scene_words: Sequence[str]) -> Iterator[Section]:
    """Yield sections with the engine's code, the command to run, and the new profile in Python and in a manifest."""
    step = () if tuning.options.dt_s is None else ("--dt", repr(tuning.options.dt_s))
    method = Method(tuning.engine, tuning.options.profile, tuning.best.overrides)
    words = ("carom", "run", *scene_words, "-e", format_engine_argument(method.engine), "-p", tuning.options.profile)
    if tuning.code:
        text = f"Code for {tuning.engine} in the scene {tuning.scenes[0].name}:"
        yield Section("Code for the engine", (Text(text), Code(tuning.code)))
    command = f"{shlex.join((*words, *step))} {format_set_options(tuning.best)}"
    yield Section("Command with these settings", (Code(command),))
    scenes = formatting.format_count(len(tuning.scenes), "scene")
    text = f"Found by carom tune on {scenes}: {_format_grades(tuning.best)}."
    constant = {name: value for name, value in tuning.settings.items() if name not in tuning.varying}
    varying = [f"# {name} varies with the step size, as in {method.profile}" for name in sorted(tuning.varying)]
    python = "\n".join(
        [
            f'"{FOUND}": Profile(',
            f"    {text!r},",
            "    lambda dt_s: {",
            '        "dt_s": dt_s,',
            *(f"        {name!r}: {value!r}," for name, value in constant.items()),
            *(f"        {line}" for line in varying),
            "    },",
            "),",
        ]
    )
    toml = tomli_w.dumps({"profiles": {FOUND: {"description": text, "settings": constant}}})
    yield Section("Profile in Python", (Code(python, Media.IN_FULL),))
    yield Section("Profile in engine.toml", (Code("\n".join([toml.rstrip("\n"), *varying]), Media.IN_FULL),))
