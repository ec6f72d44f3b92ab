"""What makes no sense is refused from Python by field and value, in one way in every study."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

import carom
from carom.bench.bench_plan import BenchPlan
from carom.bench.growth import growth
from carom.errors import InputError
from carom.runs.plan import Options
from carom.stress.campaign import StressOptions
from carom.tune.run import TuneOptions

#: Of each field, by whatever study has it, what can't be meant.
WRONG: dict[str, tuple[Any, ...]] = {
    "engines": ("pit", 5, [5]),
    "profiles": ("tuned", 5, [None]),
    "dts": (0.1, "0.1", [0.0], [-1.0], [math.nan], [math.inf], ["0.1"], [True]),
    "dt_s": (0.0, -1.0, math.nan, math.inf, "0.1", True),
    "phases": (-1, 1.5, "2", True, 10**9),
    "seed": ("x", -1, 0.5, True, 2**64),
    "jobs": (0, -1, 1.5, "2", True, 10**9),
    "rounds": (1, 2, -1, 7.5, "7", True),
    "trials": (0, -5, "10", 2.5),
    "target": (0.0, -1.0, math.nan, math.inf, "x", True),
    "timing": ("no", 0, None),
    "samples": ("no", 1),
    "quick": ("yes", 1),
    "certified": ("no", 1),
    "certify_s": (0, -1, math.nan, math.inf, "5"),
    "budget_s": (0, -1, math.nan, math.inf, "5"),
    "time_limit_s": (0, -1, math.nan, math.inf, "5"),
    "memory_limit_mb": (0, -1, math.nan, math.inf, "5"),
}
STUDIES = (Options, BenchPlan, StressOptions, TuneOptions)
CASES = [
    (study, name, value)
    for study in STUDIES
    for name in study.__dataclass_fields__
    if name in WRONG
    for value in WRONG[name]
]


@pytest.mark.parametrize(("study", "name", "value"), CASES)
def test_what_makes_no_sense_is_refused_by_name(study: Callable[..., Any], name: str, value: Any) -> None:
    """Each study refuses each wrong value of each of its fields, and the message begins with the field."""
    with pytest.raises(InputError, match=rf"^{name}(\[0\])? must be"):
        study(**{name: value})


@pytest.mark.parametrize("study", STUDIES)
def test_every_field_that_is_a_number_or_a_list_is_checked(study: Any) -> None:
    """A field that a study gains is checked, or named here with the reason why not."""
    others = {"settings", "error", "profile"}  # checked where they are read: a mapping, a kind, a name
    assert study.__dataclass_fields__.keys() - others <= WRONG.keys()


def test_usual_values_are_taken() -> None:
    """Defaults, lists in place of tuples and whole numbers of seconds are what people write."""
    for study in STUDIES:
        study()
    assert Options(["pit"], [1, 0.5], ["tuned"], time_limit_s=5).dts == (1, 0.5)
    assert BenchPlan(engines=("pit",), rounds=3, budget_s=1).rounds == 3


def test_calls_refuse_likewise() -> None:
    """A name in place of a scene, and wrong limits of single calls, are refused in a sentence, too."""
    for act, words in (
        (lambda: carom.run(7, "pit", dt=0.1), "scene must be a Scene or the name of one in the catalogue, got 7"),  # type: ignore[arg-type] # what is refused
        (lambda: growth(["pit"], sizes=[0]), "a number of discs must be a whole number, 1 or more, got 0"),
        (lambda: growth("pit"), "engines must be a list"),
        (lambda: growth(["pit"], budget_s=-1), "budget_s must be"),
    ):
        with pytest.raises(InputError, match=words):
            act()
