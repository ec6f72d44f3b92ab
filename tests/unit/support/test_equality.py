"""Results that hold arrays are compared by value."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, require_value, staged

from carom import certify, solve_pic, solve_pit
from carom.model.flights import Flight, free_flights
from carom.model.trace import Samples, Trace

SCENE = staged("pair", disc_at(0, 0, 1, 0), disc_at(3, 0), duration_s=4)


def build_trace() -> Trace:
    return replace(solve_pic(SCENE, sample_times_s=[0.0, 1.0]), effective_time_s=np.array([np.nan]))


def test_traces_of_the_same_run_are_equal() -> None:
    """Traces with arrays, samples and NaN at the same places are equal and are compared without an error."""
    assert build_trace() == build_trace()


def build_changed_traces() -> list[Trace]:
    one = build_trace()
    moved, later = one.final_position_m.copy(), one.impacts.copy()
    moved[1, 0] = np.nextafter(moved[1, 0], np.inf)
    later["time_s"][0] = np.nextafter(later["time_s"][0], np.inf)
    return [
        replace(one, method="other"),
        replace(one, impacts=later),
        replace(one, impacts=one.impacts[:0]),
        replace(one, final_position_m=moved),
        replace(one, final_position_m=one.final_position_m.astype(np.float32)),
        replace(one, final_position_m=one.final_position_m.reshape(1, -1)),
        replace(one, final_velocity_m_s=-one.final_velocity_m_s),  # of which two are 0 and become -0
        replace(one, effective_time_s=None),
        replace(one, effective_time_s=np.array([2.0])),
        replace(one, samples=None),
        replace(one, samples=Samples(require_value(one.samples).time_s, require_value(one.samples).position_m + 1.0)),
        replace(one, counts={**one.counts, "impacts": 7}),
        replace(one, settings={"contact_duration_s": 1.0}),
        replace(one, scene=SCENE.model_copy(update={"name": "other"})),
        replace(one, notes=("a note",)),
        replace(one, end_time_s=3.0),
    ]


@each("k", range(len(build_changed_traces())))
def test_traces_that_differ_in_one_field_are_not_equal(k: int) -> None:
    """The last bit of a number, a type, a shape, the sign of a zero or a missing field makes a difference."""
    assert build_trace() != build_changed_traces()[k]


def test_trace_differs_from_other_objects() -> None:
    """A trace differs from the trace of another method, from a text and from None, without an error."""
    assert build_trace() != solve_pit(SCENE)
    assert build_trace() != "trace"
    assert build_trace() != None  # noqa: E711 - the operator is what is tried


def test_certified_traces_are_compared_without_run_time() -> None:
    """Two certified runs of a scene are equal whatever their run time; one with other digits or radii is not."""
    pytest.importorskip("flint")
    one = certify(SCENE)
    assert one == replace(certify(SCENE), elapsed_s=one.elapsed_s + 1.0)
    assert one != certify(SCENE, digits=20)
    assert one != replace(one, radii=one.radii[:0])


@each("kind", [Trace, Samples, Flight])
def test_objects_with_arrays_are_not_hashable(kind: type) -> None:
    """Arrays can be changed in place, so `hash` of a trace, samples or flights raises Python's TypeError."""
    one = build_trace()
    result: Any = next(each for each in (one, one.samples, *free_flights(one)) if isinstance(each, kind))
    with pytest.raises(TypeError, match=f"unhashable type: '{kind.__name__}'"):
        hash(result)
