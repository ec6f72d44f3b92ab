"""A NaN or infinite number anywhere in a trace is named, and the run is graded wrong."""

import dataclasses
import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each
from tests.planted.faults import DT, ROW, replay_reference
from tests.scene_builders import alter_impact, require_value

from carom import Trace, compare, solve_pic, solve_pit
from carom.catalogue import catalogue
from carom.comparator import Grade, Verdict
from carom.comparator.non_finite import find_non_finite, find_turned_impacts, has_turned
from carom.comparator.scales import find_largest
from carom.errors import InputError
from carom.model.trace import IMPACT_DTYPE, STATE_DTYPE, Samples

REFERENCE = solve_pic(ROW)
BROKEN = [math.nan, math.inf, -math.inf]
#: Sampling runs to compare with, in turn: none, and a PIT without error.
SAMPLINGS = (None, dataclasses.replace(REFERENCE, dt_s=DT))


def replace_field(trace: Trace, field: str, value: Any) -> Trace:
    return dataclasses.replace(trace, **{field: value})


#: Every field of numbers, and where a part of one is meant, that part.
FIELDS = [
    *(f"impacts.{name}" for name in IMPACT_DTYPE.names or () if IMPACT_DTYPE[name].base.kind == "f"),
    *(f"state_before.{name}" for name in STATE_DTYPE.names or ()),
    *("effective_time_s", "final_position_m", "final_velocity_m_s", "samples.time_s", "samples.position_m"),
]


def broken_copies(trace: Trace, name: str) -> Iterator[tuple[Trace, str]]:
    """Yield a copy for each number of a field, with that number replaced by each non-finite value in turn."""
    field, _, part = name.partition(".")
    whole = getattr(trace, field)
    numbers = getattr(whole, part) if field == "samples" else whole[part] if part else whole
    for index, value in zip(np.ndindex(numbers.shape), itertools.cycle(BROKEN), strict=False):
        changed = numbers.copy()
        changed[index] = value
        spoilt: Any = changed
        if field == "samples":
            spoilt = dataclasses.replace(whole, **{part: changed})
        elif part:
            spoilt = whole.copy()
            spoilt[part] = changed
        yield replace_field(trace, field, spoilt), f"{name}{index} = {value}"


@each("name", FIELDS)
def test_non_finite_number_in_any_field_is_wrong(name: str) -> None:
    """NaN or infinity in any field of a trace gives NOT_FINITE as first verdict, and the grade WRONG."""
    bare = replay_reference(REFERENCE)
    samples = Samples(np.array([0.0, 1.0]), np.stack([bare.final_position_m, bare.final_position_m]))
    trace = dataclasses.replace(bare, samples=samples)
    assert compare(REFERENCE, trace).grade is Grade.EXACT
    broken = itertools.islice(broken_copies(trace, name), 0, None, 10)
    for sampling, (copy, what) in zip(itertools.cycle(SAMPLINGS), broken, strict=False):
        score = compare(REFERENCE, copy, sampling=sampling)
        assert score.grade is Grade.WRONG, what
        assert score.verdicts[0] is Verdict.NOT_FINITE, what
        assert Verdict.CONFORMS not in score.verdicts, what
        assert not score.equals_pit, what


@each(
    "name",
    [
        "classics/deflection",
        pytest.param("classics/sorting", marks=pytest.mark.long),
        pytest.param("classics/box", marks=pytest.mark.long),
    ],
)
def test_non_finite_number_beyond_the_horizon_is_wrong(name: str) -> None:
    """NaN or infinity in any impact is WRONG, also beyond a horizon, with walls and immovable discs."""
    reference = solve_pic(catalogue()[name].scene)
    for field in ("impacts.time_s", "impacts.normal", "impacts.velocity_second_before", "impacts.velocity_first_after"):
        for copy, what in broken_copies(dataclasses.replace(reference, dt_s=DT), field):
            score = compare(reference, copy, horizon=0.5 * float(reference.impacts["time_s"][-1]))
            assert (score.grade, score.verdicts[0]) == (Grade.WRONG, Verdict.NOT_FINITE), what


@each("field", ["end_time_s", "dt_s"])
def test_non_finite_end_or_step_is_wrong(field: str) -> None:
    """A run whose end time or step is NaN or infinite is WRONG."""
    for value in BROKEN:
        assert compare(REFERENCE, replace_field(replay_reference(REFERENCE), field, value)).grade is Grade.WRONG


def test_reason_names_the_non_finite_field_impact_and_value() -> None:
    """The reason of NOT_FINITE names the field, the impact and the value; the total error is infinite."""
    score = compare(REFERENCE, alter_impact(replay_reference(REFERENCE), 1, velocity_first_after=(math.nan, 0.0)))
    assert score.findings[0].reason == "velocity_first_after of impact 1 is nan, 0"
    assert score.total.velocity == math.inf
    assert score.errors[0].velocity == 0


def test_nan_for_an_unknown_state_is_accepted() -> None:
    """NaN for a whole unknown state and its effective time is no error; NaN for the time alone is one."""
    trace = replay_reference(REFERENCE)
    states, effective = require_value(trace.state_before).copy(), require_value(trace.effective_time_s).copy()
    effective[1] = math.nan
    assert (
        find_non_finite(dataclasses.replace(trace, effective_time_s=effective)) == "effective_time_s of impact 1 is nan"
    )
    states["position_first"][1] = states["position_second"][1] = math.nan
    unknown = dataclasses.replace(trace, effective_time_s=effective, state_before=states)
    assert find_non_finite(unknown) == ""
    assert compare(REFERENCE, unknown).grade is Grade.EXACT  # by the time stamp


def test_non_finite_reference_is_refused_and_pit_ignored() -> None:
    """A reference with NaN raises an InputError; a PIT run with NaN is treated as missing."""
    broken = dataclasses.replace(REFERENCE, final_position_m=REFERENCE.final_position_m * math.nan)
    with pytest.raises(InputError, match="final_position_m of disc 0 is nan, nan in the reference"):
        compare(broken, REFERENCE)
    pit = solve_pit(ROW, frame_rate_hz=61.0)  # impacts fall between its frames
    assert compare(REFERENCE, pit, sampling=pit).grade is Grade.SAMPLED
    spoilt = dataclasses.replace(pit, final_velocity_m_s=pit.final_velocity_m_s * math.nan)
    score = compare(REFERENCE, pit, sampling=spoilt)
    assert score.grade is Grade.UNGRADED
    assert Verdict.UNCOMPARED in score.verdicts


@each(
    "values, expected",
    [
        ([1.0, -3.0, 2.0], -3.0),
        ([1.0, math.nan], math.nan),
        ([math.nan, 1.0], math.nan),
        ([1.0, -math.inf], -math.inf),
        ([], math.nan),
    ],
)
def test_largest_of_values_with_nan_is_nan(values: list[float], expected: float) -> None:
    """The value of largest magnitude keeps its sign; it is NaN if any value is NaN, or if there is none."""
    assert find_largest(values) == pytest.approx(expected, nan_ok=True)


_SPEEDS = st.tuples(*[st.floats(-1e100, 1e100)] * 4)


@given(_SPEEDS, st.sampled_from([0.0, 1e-13, 1e-6, 1.0]), st.sampled_from([32, 64]))
def test_a_single_impact_turns_as_in_an_array(
    speeds: tuple[float, float, float, float], change: float, bits: int
) -> None:
    """One impact turned if and only if the test of an array of impacts finds it."""
    before = ((speeds[0], speeds[1]), (speeds[2], speeds[3]))
    after = ((speeds[0] * (1.0 + change), speeds[1]), (speeds[2], speeds[3] * (1.0 - change)))
    (found,) = find_turned_impacts(np.array(before)[:, None], np.array(after)[:, None], bits)
    assert has_turned(before, after, bits) == found
