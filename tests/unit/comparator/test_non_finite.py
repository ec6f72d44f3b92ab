"""A NaN or infinite number anywhere in a trace is named, and the run is graded wrong."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.planted.faults import DT, ROW, replay_reference
from tests.scene_builders import alter_impact, require_value

from carom import Trace, compare, solve_pic, solve_pit
from carom.catalogue import catalogue
from carom.comparator import Grade, Verdict
from carom.comparator.non_finite import find_non_finite
from carom.comparator.scales import find_largest
from carom.errors import InputError
from carom.model.trace import IMPACT_DTYPE, STATE_DTYPE, Samples

REFERENCE = solve_pic(ROW)


def break_field(trace: Trace, name: str, value: Any) -> Trace:
    """Return a trace with this value as the last number of a field; "impacts.normal" is a part of a field."""
    field, _, part = name.partition(".")
    whole: Any = getattr(trace, field)
    if isinstance(whole, float):
        return dataclasses.replace(trace, **{field: value})
    if field == "samples":
        numbers = getattr(whole, part).copy()
        numbers.flat[-1] = value
        return dataclasses.replace(trace, samples=dataclasses.replace(whole, **{part: numbers}))
    changed = whole.copy()
    numbers = changed[part] if part else changed
    numbers[(-1,) * numbers.ndim] = value
    return dataclasses.replace(trace, **{field: changed})


#: Every field of numbers, and if only a part of it has numbers, this part.
FIELDS = [
    *(f"impacts.{name}" for name in IMPACT_DTYPE.names or () if IMPACT_DTYPE[name].base.kind == "f"),
    *(f"state_before.{name}" for name in STATE_DTYPE.names or ()),
    *("effective_time_s", "final_position_m", "final_velocity_m_s", "samples.time_s", "samples.position_m"),
    *("end_time_s", "dt_s"),
]


@each("value", [math.nan, math.inf, -math.inf])
@each("name", FIELDS)
def test_non_finite_number_in_any_field_is_wrong(name: str, value: float) -> None:
    """NaN or infinity in any field of a trace gives NOT_FINITE as first verdict, and the grade WRONG."""
    bare = replay_reference(REFERENCE)
    samples = Samples(np.array([0.0, 1.0]), np.stack([bare.final_position_m, bare.final_position_m]))
    trace = dataclasses.replace(bare, samples=samples)
    for sampling in (None, dataclasses.replace(REFERENCE, dt_s=DT)):
        score = compare(REFERENCE, break_field(trace, name, value), sampling=sampling if name != "dt_s" else None)
        assert score.grade is Grade.WRONG
        assert score.verdicts[0] is Verdict.NOT_FINITE
        assert Verdict.CONFORMS not in score.verdicts
        assert not score.equals_pit


@each("field", ["time_s", "normal", "velocity_second_before", "velocity_first_after"])
def test_non_finite_number_beyond_the_horizon_is_wrong(field: str) -> None:
    """NaN in the last impact, beyond a horizon, is WRONG, also with walls and immovable discs."""
    for name in ("classics/deflection", "classics/box"):
        reference = solve_pic(catalogue()[name].scene)
        broken = break_field(dataclasses.replace(reference, dt_s=DT), f"impacts.{field}", math.nan)
        score = compare(reference, broken, horizon=0.5 * float(reference.impacts["time_s"][-1]))
        assert (score.grade, score.verdicts[0]) == (Grade.WRONG, Verdict.NOT_FINITE), name


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
    score = compare(REFERENCE, unknown)
    assert score.grade is Grade.EXACT  # by the time stamp
    assert require_value(score.consistency).unchecked == 4  # of discs 1 and 2, before and after


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


def test_largest_of_values_with_nan_is_nan() -> None:
    """The value of largest magnitude keeps its sign; it is NaN if any value is NaN, or if there is none."""
    assert find_largest([1.0, -3.0, 2.0]) == -3.0
    assert find_largest([1.0, -math.inf]) == -math.inf
    assert all(math.isnan(find_largest(values)) for values in ([1.0, math.nan], [math.nan, 1.0], []))
