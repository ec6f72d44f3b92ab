"""Results that hold arrays are compared by value."""

from dataclasses import replace

import numpy as np
import pytest
from tests.scene_builders import disc_at, require_value, staged

from carom import certify, solve_pic, solve_pit
from carom.model.flights import free_flights
from carom.model.trace import Samples, Trace

SCENE = staged("pair", disc_at(0, 0, 1, 0), disc_at(3, 0), duration_s=4)


def build_trace() -> Trace:
    return replace(solve_pic(SCENE, sample_times_s=[0.0, 1.0]), effective_time_s=np.array([np.nan]))


def build_changed_traces() -> list[Trace]:
    one = build_trace()
    moved, later = one.final_position_m.copy(), one.impacts.copy()
    moved[1, 0] = np.nextafter(moved[1, 0], np.inf)
    later["time_s"][0] = np.nextafter(later["time_s"][0], np.inf)
    return [
        replace(one, method="other"),
        replace(one, impacts=later),
        replace(one, final_position_m=moved),
        replace(one, final_position_m=one.final_position_m.astype(np.float32)),
        replace(one, final_position_m=one.final_position_m.reshape(1, -1)),
        replace(one, final_velocity_m_s=-one.final_velocity_m_s),  # of which two are 0 and become -0
        replace(one, samples=Samples(require_value(one.samples).time_s, require_value(one.samples).position_m + 1.0)),
        replace(one, settings={"contact_duration_s": 1.0}),
        replace(one, scene=SCENE.model_copy(update={"name": "other"})),
        replace(one, end_time_s=3.0),
    ]


def test_traces_are_equal_if_no_field_differs() -> None:
    """Traces of the same run are equal; a last bit, a type, a shape, a sign of zero or a missing field differs."""
    assert build_trace() == build_trace()
    assert [k for k, other in enumerate(build_changed_traces()) if build_trace() == other] == []
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


def test_objects_with_arrays_are_not_hashable() -> None:
    """Arrays can be changed in place, so `hash` of a trace, samples or flights raises Python's TypeError."""
    trace = build_trace()
    for result in (trace, trace.samples, *free_flights(trace)):
        with pytest.raises(TypeError, match=f"unhashable type: '{type(result).__name__}'"):
            hash(result)
