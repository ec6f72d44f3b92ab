"""Declared options of studies: Python, the command line and the journal follow the same declarations."""

import dataclasses
import math
import re
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from tests.cases import each, release_after
from tests.command import carom_command

import carom
from carom import studies
from carom.errors import InputError, UnknownNameError
from carom.solvers.certified.options import CertifyOptions
from carom.studies.advise.options import AdviceOptions
from carom.studies.bench.options import BenchPlan, GrowthOptions
from carom.studies.cross_check.options import Options
from carom.studies.diff.options import DiffOptions
from carom.studies.history.options import HistoryOptions
from carom.studies.stress.options import StressOptions
from carom.studies.tune.options import TuneOptions
from carom.support.limits import LARGEST, SMALLEST
from carom.support.options import DeclaredOptions, Option, list_declared_options

#: Each study with the command of its options; a growth bench has its options from `carom bench`.
STUDIES: dict[type[DeclaredOptions], tuple[str, ...]] = {
    Options: ("run", "paper/missed"),
    BenchPlan: ("bench", "paper/missed"),
    GrowthOptions: (),
    AdviceOptions: ("advise", "paper/missed"),
    StressOptions: ("stress",),
    TuneOptions: ("tune", "pymunk"),
    CertifyOptions: ("certify", "paper/missed"),
    DiffOptions: ("diff", "tests/earlier_formats/results-3.jsonl", "tests/earlier_formats/results-3.jsonl"),
    HistoryOptions: ("history", "pymunk"),
}
#: Values that an option refuses, by the option's word in `--help`. Numbers are below.
WRONG_BY_WORD: dict[str, tuple[Any, ...]] = {
    "": ("no", 0, 1, None),
    "NAME": (5, None, True, 0.5, ["x"]),
    "NAME=VALUE": ("x", 5, ["x"], None),
    "OLD=NEW": (5, "x", ["x"], ["x", ""], ["x", 5], ["x", "y", "z"]),
    "ADDRESS": ("host:8786", "nan", "", 5, True, ["tcp://host:8786"]),
}
#: Two numbers that are just too small and too large for an option, by the beginning of its requirement.
OUTSIDE = {
    "an angle": (0.0, 2.0 * math.pi),
    "a positive number of megabytes": (0.0, 2e9),
    "a positive number of seconds": (0.0, 2e7),
    "a positive number": (0.0, 2.0 * LARGEST),
    "a number of seconds": (math.nextafter(SMALLEST, 0.0), 2.0 * LARGEST),
    "0 or more and below 1": (-math.ulp(0.0), 1.0),
}


def list_wrong_values(one: Option) -> list[Any]:
    """Values that an option refuses in Python."""
    word, said = one.kind.word, one.kind.requirement
    if word == "INTEGER":
        least, *most = map(int, re.findall(r"\d+", said))
        wrong: tuple[Any, ...] = (least - 1, *(n + 1 for n in most), -math.inf, math.nan, least + 0.5, "2", True, None)
    elif "|" in word:
        wrong = ("x", 5, None, True)
    elif said.startswith("left out"):
        wrong = ("tcp://host:8786", "", 5)
    elif word in WRONG_BY_WORD:
        wrong = WRONG_BY_WORD[word]
    else:
        outside = next(numbers for begin, numbers in OUTSIDE.items() if said.startswith(begin))
        wrong = (*outside, -1.0, math.inf, math.nan, "x", "5", True, None)
    return [*([value] for value in wrong), "text", 5] if one.many else list(wrong)


WRONG = [
    (study, name, value)
    for study in STUDIES
    for name, one in list_declared_options(study).items()
    for value in list_wrong_values(one)
]


def test_every_study_has_a_row_and_documented_options() -> None:
    """`STUDIES` has the options of each study's package, and the docstrings describe every option."""
    modules = [
        import_module(f"carom.studies.{path.parent.name}.options")
        for path in Path(studies.__path__[0]).glob("*/options.py")
    ]
    found = {
        one
        for module in modules
        for one in vars(module).values()
        if isinstance(one, type) and issubclass(one, DeclaredOptions) and one.__module__ == module.__name__
    }
    assert found == set(STUDIES) - {CertifyOptions}
    for study in found:
        told = "".join(base.__doc__ or "" for base in study.__mro__)
        assert [name for name in list_declared_options(study) if f"    {name}: " not in told] == [], study


def is_optional(study: type[DeclaredOptions], name: str) -> bool:
    return next(field.default for field in dataclasses.fields(study) if field.name == name) is None


@each("study", STUDIES)
def test_wrong_option_value_is_refused_in_python(study: type[DeclaredOptions]) -> None:
    """Each study refuses each wrong value of an option; the message begins with the option's name."""
    for own, name, value in WRONG:
        if own is not study:
            continue
        if value is None and is_optional(study, name):
            study(**{name: None})
            continue
        with pytest.raises(InputError, match=rf"^{name}(\[0\])? must be"):
            study(**{name: value})


def list_wrong_texts() -> list[tuple[type[DeclaredOptions], str, str]]:
    """Every option that a shell has, with each wrong value that is a number or is no number."""
    found = []
    for study, name, value in WRONG:
        one = list_declared_options(study)[name]
        item = value[0] if one.many and isinstance(value, list) else value
        number = isinstance(item, int | float) and not isinstance(item, bool)
        if one.many and not isinstance(value, list):
            continue
        worded = one.kind.word not in {"", "NAME", "ANGLE", "NAME=VALUE", "OLD=NEW"}
        if STUDIES[study] and one.flags and worded and (number or item == "x"):
            found.append((study, name, str(item)))
    return found


@each("study, name, text", release_after(1, list_wrong_texts()))
def test_wrong_option_value_is_refused_on_the_command_line(study: type[DeclaredOptions], name: str, text: str) -> None:
    """A wrong value ends a command with exit code 2 and the flag, the declared requirement and the value."""
    one = list_declared_options(study)[name]
    result = carom_command(*STUDIES[study], one.flags[0], text)
    assert result.exit_code == 2, result.output
    assert f"carom: {one.flags[0]} must be {one.kind.requirement}, got {text!r}" in result.output


@each("study", STUDIES)
def test_command_line_and_python_have_equal_defaults(study: type[DeclaredOptions]) -> None:
    """Options parsed from an empty command line equal the options that Python builds without arguments."""
    assert study.parse_command_line({}) == study()
    assert study.parse_command_line(dict.fromkeys(list_declared_options(study))) == study()


#: Another sensible value of each option that is neither yes or no nor a number, by name.
OTHER: dict[str, Any] = {
    "engines": ["pit"],
    "profiles": ["tuned"],
    "versions": ["1.0"],
    "profile": "located",
    "dts": [0.25],
    "sizes": [3],
    "settings": {"iterations": 3},
    "error": "time",
    "certified": True,
    "miss_probability": 0.5,
    "match": [("pit", "pic")],
    "fail_on": "close",
    "scheduler": "tcp://host:8786",
}
#: The options of each study, except those that the study can't have and refuses.
TAKEN = [
    (study, name)
    for study in STUDIES
    for name, one in list_declared_options(study).items()
    if name not in OTHER or OTHER[name] not in list_wrong_values(one)
]


@each("study, name", TAKEN)
def test_journal_stamp_depends_only_on_fixed_options(study: type[DeclaredOptions], name: str) -> None:
    """Another value of an option changes the journal's stamp exactly if the option is declared as fixed on resume."""
    usual = study()
    value = getattr(usual, name)
    if isinstance(value, bool):
        other: Any = not value
    elif name in OTHER:
        other = OTHER[name]
    else:
        assert value is None or isinstance(value, int | float), f"{name} needs another sensible value in OTHER"
        other = value + 1 if value else 2
    changed = study(**{name: other})
    assert getattr(changed, name) != value
    assert (changed.stamp != usual.stamp) is (name in study.fixed_on_resume)


def test_lists_whole_seconds_and_step_series_are_accepted() -> None:
    """Lists, whole seconds, series of steps and degrees are accepted; a quick stress test has 10 s, not 60."""
    assert Options(["pit"], [1, 0.5], ["tuned"], time_limit_s=5).dts == (1, 0.5)
    assert BenchPlan(engines=("pit",), rounds=3, budget_s=1).rounds == 3
    assert BenchPlan.parse_command_line({"dts": ["1/60", "1/100..1/400:3"]}).dts == (1 / 60, 1 / 100, 1 / 200, 1 / 400)
    angle = AdviceOptions.parse_command_line({"direction_error_rad": "80deg"}).direction_error_rad
    assert angle == math.radians(80)
    assert (StressOptions().time_limit_s, StressOptions(quick=True).time_limit_s) == (60.0, 10.0)


@each(
    "call, given, error, words",
    [
        (carom.run, (7, "pit"), InputError, "^scene must be a Scene or the name of one in the catalogue, got 7"),
        (partial(carom.run, dt=0.1, time_limit_s=-1.0), ("paper/missed", "pit"), InputError, "^time_limit_s must be"),
        (carom.advise, ("paper/lat",), UnknownNameError, "paper/late"),
        (carom.advise, ("paper/late", ["pymonk"]), UnknownNameError, "pymunk"),
        (carom.tune, ("pymunk", ["paper/lat"]), UnknownNameError, "paper/late"),
        (carom.tune, ("pymonk",), UnknownNameError, "pymunk"),
    ],
)
def test_python_calls_refuse_unknown_names_and_wrong_options(
    call: Callable[..., object], given: tuple[object, ...], error: type[Exception], words: str
) -> None:
    """`carom.run`, `carom.advise` and `carom.tune` refuse unknown scenes and engines, and wrong options."""
    with pytest.raises(error, match=words):
        call(*given)
