"""Declared options of studies: Python, the command line and the journal follow the same declarations."""

import dataclasses
import math
import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from tests.cases import each

import carom
from carom import studies
from carom.errors import InputError, UnknownNameError
from carom.solvers.certified.options import CertifyOptions
from carom.studies.advise.options import AdviceOptions
from carom.studies.bench.options import BenchPlan
from carom.studies.cross_check.options import Options
from carom.studies.diff.options import DiffOptions
from carom.studies.history.options import HistoryOptions
from carom.studies.stress.options import StressOptions
from carom.studies.tune.options import TuneOptions
from carom.support.limits import LARGEST, SMALLEST
from carom.support.options import DeclaredOptions, Option, list_declared_options

#: Each study with the command of its options.
STUDIES: dict[type[DeclaredOptions], tuple[str, ...]] = {
    Options: ("run", "paper/missed"),
    BenchPlan: ("bench", "paper/missed"),
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


@each("study", STUDIES)
def test_command_line_and_python_have_equal_defaults(study: type[DeclaredOptions]) -> None:
    """Options parsed from an empty command line equal the options that Python builds without arguments."""
    assert study.parse_command_line({}) == study()
    assert study.parse_command_line(dict.fromkeys(list_declared_options(study))) == study()


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
        (carom.advise, ("paper/lat",), UnknownNameError, "paper/late"),
        (carom.advise, ("paper/late", ["pymonk"]), UnknownNameError, "pymunk"),
        (carom.tune, ("pymonk",), UnknownNameError, "pymunk"),
    ],
)
def test_python_calls_refuse_unknown_names_and_wrong_options(
    call: Callable[..., object], given: tuple[object, ...], error: type[Exception], words: str
) -> None:
    """`carom.run`, `carom.advise` and `carom.tune` refuse unknown scenes and engines, and wrong options."""
    with pytest.raises(error, match=words):
        call(*given)
